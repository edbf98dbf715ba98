# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows baked light in the 3D views, and restores their earlier shading.

Solid shading shows the colour attribute at once and leaves the materials as they are, but shows
neither surface colours nor the scene's view transform. Material Preview shows both, if the
materials use the light.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import bpy

from . import light_in_material


@dataclass(frozen=True)
class _Shading:
    type: str
    color_type: str
    light: str


SOLID, MATERIALS = 'SOLID', 'MATERIALS'
_SOLID = _Shading('SOLID', 'VERTEX', 'FLAT')
_DEFAULT = _Shading('SOLID', 'MATERIAL', 'STUDIO')

# The shading before the preview by the view's address, because views have no names.
_earlier: dict[int, _Shading] = {}


def toggle(context: bpy.types.Context) -> list[str]:
    """Switches the preview on in all 3D views as the scene's settings say, or off if it is on in
    all of them. Returns warnings about materials that cannot show the light."""
    way = context.scene.raybundle.show_in
    warnings = _lend(context.scene) if way == MATERIALS else []
    if not show(context, way):
        hide(context)
    return warnings


def show_result(context: bpy.types.Context, is_new: bool = True) -> list[str]:
    """Shows the result of a bake as the scene's settings say. Returns warnings about materials that
    cannot show it. is_new: whether objects and materials may have changed since the last result
    was shown."""
    settings = context.scene.raybundle
    if not settings.show_result:
        return []
    warnings = _lend(context.scene, is_new) if settings.show_in == MATERIALS else []
    show(context, settings.show_in)
    return warnings


def show_interim(context: bpy.types.Context) -> bool:
    """Shows the light of a bake that is running, without changing materials. Returns whether any
    3D view has been switched."""
    settings = context.scene.raybundle
    in_materials = settings.show_in == MATERIALS and _uses_light(context.scene)
    return settings.show_result and show(context, MATERIALS if in_materials else SOLID)


def follow_choice(_settings: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """Switches the preview, if it is on in any 3D view, to the way that the scene's settings say
    now."""
    if not any(_shows(view, context.scene) for view in _views(context.window_manager)):
        return
    if context.scene.raybundle.show_in == MATERIALS:
        _lend(context.scene)
    else:
        _take_back(context.scene)
    show(context, context.scene.raybundle.show_in)


def show(context: bpy.types.Context, way: str = SOLID) -> bool:
    """Switches the preview on in all 3D views, SOLID or MATERIALS. Returns whether it was off in
    any. Materials are not changed."""
    was_off = False
    for view in _views(context.window_manager):
        shown = _shows(view, context.scene)
        if shown == way:
            continue
        if shown is None:
            _earlier[view.as_pointer()] = _read(view)
        # A file may have been saved with the preview.
        _earlier.setdefault(view.as_pointer(), _DEFAULT)
        was_off = True
        if way == SOLID:
            _apply(view, _SOLID)
        else:
            view.shading.type = 'MATERIAL'
    return was_off


def hide(context: bpy.types.Context) -> None:
    """Gives all 3D views that show the preview their earlier shading, and takes the light out of
    the materials that had it only for the preview."""
    for view in _views(context.window_manager):
        if _shows(view, context.scene) is not None:
            _apply(view, _earlier.pop(view.as_pointer(), _DEFAULT))
    _take_back(context.scene)


def _lend(scene: bpy.types.Scene, is_new: bool = False) -> list[str]:
    """Adds the light to the materials of the scene if none shows it, or in any case if is_new.
    Returns warnings about materials that cannot show it."""
    settings = scene.raybundle
    uses_light = _uses_light(scene)
    if uses_light and not is_new:
        return []
    settings.is_light_lent |= not uses_light
    return light_in_material.use(scene, settings.attribute,
                                 light_in_material.chosen_way(settings)).warnings


def _take_back(scene: bpy.types.Scene) -> None:
    """Takes the light out of the materials if it is there only for the preview."""
    if scene.raybundle.is_light_lent:
        scene.raybundle.is_light_lent = False
        light_in_material.take_out()


def _uses_light(scene: bpy.types.Scene) -> bool:
    """Returns whether any material of the scene shows baked light."""
    return any(slot.material is not None and light_in_material.shows_light(slot.material)
               for item in scene.objects for slot in item.material_slots)


def _shows(view: bpy.types.SpaceView3D, scene: bpy.types.Scene) -> str | None:
    """Returns how a view shows the preview: SOLID, MATERIALS, or None if it does not."""
    if _read(view) == _SOLID:
        return SOLID
    # Users switch to Material Preview themselves too.
    is_preview = view.as_pointer() in _earlier or scene.raybundle.is_light_lent
    return MATERIALS if view.shading.type == 'MATERIAL' and is_preview else None


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
