# SPDX-License-Identifier: GPL-3.0-or-later
"""Entries in Blender's menus Render and Object. The search (F3) finds operators by them."""

from __future__ import annotations

import bpy


class RAYBUNDLE_MT_render(bpy.types.Menu):
    bl_label = "Raybundle"

    def draw(self, context):
        draw_operators(self.layout)


class RAYBUNDLE_MT_object(bpy.types.Menu):
    bl_label = "Raybundle"

    def draw(self, context):
        draw_operators(self.layout)
        self.layout.separator()
        for property_name in ("role", "side", "quality"):
            self.layout.operator_menu_enum(f"raybundle.set_{property_name}", property_name)


def draw_operators(layout: bpy.types.UILayout) -> None:
    layout.operator("raybundle.bake", icon='LIGHT')
    layout.operator("raybundle.relight")
    layout.operator("raybundle.preview")
    layout.operator("raybundle.clear", icon='TRASH')
    layout.separator()
    layout.operator("raybundle.use_in_material", icon='MATERIAL')
    layout.operator("raybundle.take_out_of_material")
    layout.operator("raybundle.export_gltf", icon='EXPORT')
    layout.operator("raybundle.check_export")
    layout.operator("raybundle.bake_channels")


def _draw_in_render(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.separator()
    menu.layout.menu("RAYBUNDLE_MT_render")


def _draw_in_object(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.separator()
    menu.layout.menu("RAYBUNDLE_MT_object")


_register_classes, _unregister_classes = bpy.utils.register_classes_factory((
    RAYBUNDLE_MT_render,
    RAYBUNDLE_MT_object,
))


def register() -> None:
    _register_classes()
    bpy.types.TOPBAR_MT_render.append(_draw_in_render)
    bpy.types.VIEW3D_MT_object.append(_draw_in_object)


def unregister() -> None:
    bpy.types.VIEW3D_MT_object.remove(_draw_in_object)
    bpy.types.TOPBAR_MT_render.remove(_draw_in_render)
    _unregister_classes()
