# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts in lines of the width of a panel."""

from types import SimpleNamespace

import bpy
import pytest
from drawn_layout import DrawnLayout
from raybundle.text_wrap import draw_wrapped, wrapped


@pytest.mark.parametrize("text, width, lines", [
    ("", 10, []),
    ("one", 10, ["one"]),
    ("one two three", 7, ["one two", "three"]),
    ("one two three", 6, ["one", "two", "three"]),
    # A word that is wider than a line is divided.
    ("abcdefgh ij", 3, ["abc", "def", "gh", "ij"]),
    ("a bcdefg", 4, ["a", "bcde", "fg"]),
    ("abc", 0, ["a", "b", "c"]),
    # A number and its unit stay together.
    ("faces 1.5 m wide", 9, ["faces", "1.5\N{NO-BREAK SPACE}m", "wide"]),
    ("error of 12 % at", 11, ["error of", "12\N{NO-BREAK SPACE}% at"]),
])
def test_lines(text, width, lines):
    assert wrapped(text, width, len) == lines


def test_no_line_is_wider_than_the_region():
    text = "object \"floor\": its faces, 1.5 m wide on average, are too coarse for its light " * 3
    for width in (150, 300, 800):
        layout = DrawnLayout()
        context = SimpleNamespace(region=SimpleNamespace(width=width),
                                  preferences=bpy.context.preferences)
        draw_wrapped(layout, context, text, 'ERROR')
        lines = layout.texts()
        assert " ".join(lines).replace("\N{NO-BREAK SPACE}", " ") == text.strip()
        icons = [options['icon'] for method, _, options, *_ in layout.record if method == 'label']
        assert icons == ['ERROR'] + ['BLANK1'] * (len(lines) - 1)
    assert len(lines) < 10


def test_a_script_has_no_region():
    layout = DrawnLayout()
    draw_wrapped(layout, bpy.context, "one two")
    assert layout.texts() == ["one two"]
