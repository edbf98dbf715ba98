# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows colour attributes in the 3D views by solid shading, and restores the earlier shading."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import bpy


@dataclass(frozen=True)
class _Shading:
    type: str
    color_type: str
    light: str


_PREVIEW = _Shading('SOLID', 'VERTEX', 'FLAT')
_DEFAULT = _Shading('SOLID', 'MATERIAL', 'STUDIO')

# The shading before the preview by the view's address, because views have no names.
_earlier: dict[int, _Shading] = {}


def toggle(window_manager: bpy.types.WindowManager) -> bool:
    """Switches the preview on in all 3D views, or off if it is on in all of them. Returns whether
    it is on now."""
    if not show(window_manager):
        hide(window_manager)
        return False
    return True


def show(window_manager: bpy.types.WindowManager) -> bool:
    """Switches the preview on in all 3D views. Returns whether it was off in any."""
    was_off = False
    for view in _views(window_manager):
        if _read(view) != _PREVIEW:
            _earlier[view.as_pointer()] = _read(view)
            _apply(view, _PREVIEW)
            was_off = True
    return was_off


def hide(window_manager: bpy.types.WindowManager) -> None:
    """Gives all 3D views that show the preview their earlier shading."""
    for view in _views(window_manager):
        if _read(view) == _PREVIEW:
            _apply(view, _earlier.pop(view.as_pointer(), _DEFAULT))


def _views(window_manager: bpy.types.WindowManager) -> Iterator[bpy.types.SpaceView3D]:
    for window in window_manager.windows:
        for area in window.screen.areas:
            if area.type == 'VIEW_3D':
                yield area.spaces.active


def _read(view: bpy.types.SpaceView3D) -> _Shading:
    return _Shading(view.shading.type, view.shading.color_type, view.shading.light)


def _apply(view: bpy.types.SpaceView3D, shading: _Shading) -> None:
    view.shading.type = shading.type
    view.shading.color_type = shading.color_type
    view.shading.light = shading.light
