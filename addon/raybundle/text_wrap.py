# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws long texts in panels. Blender cuts a label off at the width of the panel, so that a text
has to be divided into lines of this width."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache

import blf
import bpy

# Space that a panel and a label take beside the text, and the width of an icon, in pixels at a
# resolution scale of 1.
_MARGIN = 36.0
_ICON = 20.0
# Scale of the distance between the lines of one text.
_LINE_HEIGHT = 0.7
_SPACE = re.compile(r'[ \n]+')
# The space between a number and its unit, where a line must not end.
_UNIT = re.compile(r'(?<=\d) (?=(?:m|s|%|MB)\b|%)')


def wrapped(text: str, width: float, measure: Callable[[str], float]) -> list[str]:
    """Returns the text in lines that are at most `width` wide, divided at spaces. A word that is
    wider is divided between letters. measure: returns the width of a text, in the unit of width."""
    lines: list[str] = []
    line = ""
    for word in _SPACE.split(_UNIT.sub("\N{NO-BREAK SPACE}", text.strip())):
        joined = f"{line} {word}" if line else word
        if measure(joined) <= width:
            line = joined
            continue
        if line:
            lines.append(line)
        while measure(word) > width and len(word) > 1:
            length = _fitting_length(word, width, measure)
            lines.append(word[:length])
            word = word[length:]
        line = word
    return lines + [line] if line else lines


def _fitting_length(word: str, width: float, measure: Callable[[str], float]) -> int:
    """Returns the number of letters, at least 1, that fit into the width."""
    least, most = 1, len(word)
    while least < most:
        middle = (least + most + 1) // 2
        if measure(word[:middle]) <= width:
            least = middle
        else:
            most = middle - 1
    return least


def draw_wrapped(layout: bpy.types.UILayout, context: bpy.types.Context, text: str,
                 icon: str = 'NONE', indent: float = 0.0) -> None:
    """Draws a text below each other in lines as wide as the region. The text is not translated.

    icon: is drawn before the first line; further lines begin below the text. indent: width that
    surrounding boxes take, in pixels at a resolution scale of 1.
    """
    # A context without a region, as of a script, has the width of a usual panel.
    width = context.region.width if context.region is not None else 400.0
    scale = _ui_scale(context)
    width -= (_MARGIN + indent + (_ICON if icon != 'NONE' else 0.0)) * scale
    column = layout.column(align=True)
    column.scale_y = _LINE_HEIGHT
    size = context.preferences.ui_styles[0].widget.points * scale
    for line in _lines(text, max(width, 40.0 * scale), size):
        column.label(text=line, icon=icon, translate=False)
        if icon != 'NONE':
            icon = 'BLANK1'


# Panels are drawn at every movement of the mouse, and measuring text takes time.
@lru_cache(maxsize=256)
def _lines(text: str, width: float, size: float) -> list[str]:
    """Returns the text in lines of Blender's own font. width, size: in pixels."""
    blf.size(0, size)
    return wrapped(text, width, lambda part: blf.dimensions(0, part)[0])


def _ui_scale(context: bpy.types.Context) -> float:
    # It is 0 in a background process, which has no screen.
    return context.preferences.system.ui_scale or 1.0
