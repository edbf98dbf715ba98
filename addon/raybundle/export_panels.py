# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels for baked light in materials and in exported files."""

import json

import bpy

from .channel_bake import CHANNELS
from .messages import decoded, translated
from .panels import RaybundleRenderPanel, property_layout
from .text_wrap import draw_wrapped


class RAYBUNDLE_PT_use_and_export(RaybundleRenderPanel, bpy.types.Panel):
    bl_label = "Use and Export"
    bl_parent_id = "RAYBUNDLE_PT_render"
    bl_order = 20

    def draw(self, context):
        layout = property_layout(self)
        settings = context.scene.raybundle
        layout.prop(settings, "engine")
        layout.prop(settings, "shown_as")
        _draw_use(layout)
        layout.prop(settings, "export_format")
        layout.prop(settings, "export_range")
        column = layout.column(align=True)
        column.operator("raybundle.export_gltf", icon='EXPORT')
        column.operator("raybundle.check_export")
        if settings.export_check:
            _draw_check(layout, context, [
                decoded(line) for line in json.loads(settings.export_check)])


def _draw_use(layout: bpy.types.UILayout) -> None:
    column = layout.column(align=True)
    column.operator("raybundle.use_in_material", icon='MATERIAL')
    column.operator("raybundle.take_out_of_material")


def _draw_check(layout: bpy.types.UILayout, context: bpy.types.Context, lines: list[str]) -> None:
    """Draws what a check has found."""
    column = layout.column(align=True)
    if not lines:
        column.label(text="Blender's exporter keeps the light", icon='CHECKMARK')
        return
    column.label(text="With Blender's own exporter:")
    for line in lines:
        draw_wrapped(column, context, translated(line), 'ERROR')


class RAYBUNDLE_PT_channels(RaybundleRenderPanel, bpy.types.Panel):
    bl_label = "Channels"
    bl_parent_id = "RAYBUNDLE_PT_use_and_export"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context):
        layout = property_layout(self)
        column = layout.column(align=True)
        for name in CHANNELS:
            column.prop(context.scene.raybundle, name)
        layout.operator("raybundle.bake_channels")


class RAYBUNDLE_PT_sidebar_export(bpy.types.Panel):
    bl_label = "Use and Export"
    bl_space_type = 'VIEW_3D'
    bl_region_type = 'UI'
    bl_category = "Raybundle"

    def draw(self, context):
        column = self.layout.column()
        _draw_use(column)
        column.operator("raybundle.export_gltf", icon='EXPORT')


register, unregister = bpy.utils.register_classes_factory((
    RAYBUNDLE_PT_use_and_export,
    RAYBUNDLE_PT_channels,
    RAYBUNDLE_PT_sidebar_export,
))
