# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels of the add-on: in Render properties, Object properties and the 3D view's sidebar."""

import json

import bpy

from . import native
from .light_sets import attribute_of


def property_layout(panel: bpy.types.Panel) -> bpy.types.UILayout:
    """Returns the panel's layout, with labels beside the values and without buttons for
    keyframes."""
    panel.layout.use_property_split = True
    panel.layout.use_property_decorate = False
    return panel.layout


def draw_used(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup, name: str,
              **options) -> None:
    """Draws a setting if it has an effect with the current values of the other settings. If the
    library, which provides this information, is missing, every setting is drawn."""
    try:
        setting = native.settings()[name]
    except native.RaybundleError:
        setting = None
    if setting is None or not setting.used_with or \
            getattr(settings, setting.used_with) in setting.used_with_choices:
        layout.prop(settings, name, **options)


class RaybundleRenderPanel:
    """Mixin of panels in the Render properties. They are shown for all render engines, because a
    bake does not depend on the engine."""
    bl_space_type = 'PROPERTIES'
    bl_region_type = 'WINDOW'
    bl_context = "render"

    @classmethod
    def poll(cls, context):
        return context.scene is not None


class RAYBUNDLE_PT_render(RaybundleRenderPanel, bpy.types.Panel):
    bl_label = "Raybundle"

    def draw(self, context):
        layout = property_layout(self)
        settings = context.scene.raybundle
        row = layout.row(align=True)
        row.operator("raybundle.bake", text="Bake", icon='LIGHT')
        row.operator("raybundle.relight")
        row.operator("raybundle.clear", text="", icon='TRASH')
        layout.prop(settings, "scope")


class RAYBUNDLE_PT_last_bake(RaybundleRenderPanel, bpy.types.Panel):
    bl_label = "Last Bake"
    bl_parent_id = "RAYBUNDLE_PT_render"

    @classmethod
    def poll(cls, context):
        return context.scene is not None and context.scene.raybundle.report != ""

    def draw(self, context):
        layout = self.layout
        report = json.loads(context.scene.raybundle.report)
        column = layout.column(align=True)
        # Reports of earlier releases have no 'error'.
        if error := report.get('error'):
            column.label(text=f"Noise: {100.0 * error['noise']:.2g} %")
            column.label(text=f"Discretisation: {100.0 * error['discretisation']:.2g} %")
            column.label(text=f"Mesh: {100.0 * error['mesh']:.2g} %")
            column.label(text=f"Stated error: {100.0 * error['total']:.2g} %")
        column.label(text=f"Time: {report['seconds']['total']:.2f} s")
        column.label(text=f"Patches: {report['patches']:,}")
        column.label(text=f"Bundles: {report['bundles']:,}")
        for warning in report['warnings']:
            layout.label(text=warning, icon='ERROR')


class RAYBUNDLE_PT_quality(RaybundleRenderPanel, bpy.types.Panel):
    bl_label = "Quality"
    bl_parent_id = "RAYBUNDLE_PT_render"

    def draw(self, context):
        layout = property_layout(self)
        settings = context.scene.raybundle
        for name in ("target_error", "topology", "patch_size", "refine", "contacts"):
            layout.prop(settings, name)


class RAYBUNDLE_PT_limits(RaybundleRenderPanel, bpy.types.Panel):
    bl_label = "Limits"
    bl_parent_id = "RAYBUNDLE_PT_quality"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context):
        layout = property_layout(self)
        settings = context.scene.raybundle
        # Short labels, because the editor is narrow.
        layout.prop(settings, "max_patches", text="Patches")
        layout.prop(settings, "max_bundles", text="Bundles")
        layout.prop(settings, "lines_per_bundle", text="Lines")
        layout.prop(settings, "memory_limit", text="Memory (MB)")


class RAYBUNDLE_PT_method(RaybundleRenderPanel, bpy.types.Panel):
    bl_label = "Method"
    bl_parent_id = "RAYBUNDLE_PT_render"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context):
        layout = property_layout(self)
        settings = context.scene.raybundle
        for name in ("solver", "estimator", "first_shot", "local_rays", "directions", "projector",
                     "plane_count"):
            draw_used(layout, settings, name)
        draw_used(layout, settings, "plane_placement", text="Placement")
        for name in ("small_patches", "reconstruction", "final_gather", "seed", "threads"):
            draw_used(layout, settings, name)


class RAYBUNDLE_PT_output(RaybundleRenderPanel, bpy.types.Panel):
    bl_label = "Output"
    bl_parent_id = "RAYBUNDLE_PT_render"

    def draw(self, context):
        layout = property_layout(self)
        settings = context.scene.raybundle
        for name in ("output", "attribute", "domain", "data_type", "exposure", "clamp",
                     "write_error"):
            layout.prop(settings, name)
        column = layout.column()
        # Subdivided copies never share a mesh.
        column.active = settings.topology == 'KEEP'
        column.prop(settings, "shared_meshes")


class RAYBUNDLE_UL_light_sets(bpy.types.UIList):
    def draw_item(self, context, layout, data, item, icon, active_data, active_property):
        row = layout.row(align=True)
        row.prop(item, "enabled", text="")
        row.prop(item, "name", text="", emboss=False)


class RAYBUNDLE_PT_light_sets(RaybundleRenderPanel, bpy.types.Panel):
    bl_label = "Light Sets"
    bl_parent_id = "RAYBUNDLE_PT_render"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context):
        layout = property_layout(self)
        settings = context.scene.raybundle
        row = layout.row()
        row.template_list("RAYBUNDLE_UL_light_sets", "", settings, "light_sets", settings,
                          "light_set_index", rows=3)
        column = row.column(align=True)
        column.operator("raybundle.light_set_add", text="", icon='ADD')
        column.operator("raybundle.light_set_remove", text="", icon='REMOVE')
        if settings.light_set_index < len(settings.light_sets):
            item = settings.light_sets[settings.light_set_index]
            layout.prop(item, "collection")
            layout.prop(item, "world")
            layout.prop(item, "attribute")
            if not item.attribute:
                layout.label(text=f'Attribute "{attribute_of(item, settings.attribute)}"',
                             icon='BLANK1')


class RAYBUNDLE_PT_object(bpy.types.Panel):
    bl_label = "Raybundle"
    bl_space_type = 'PROPERTIES'
    bl_region_type = 'WINDOW'
    bl_context = "object"
    bl_options = {'DEFAULT_CLOSED'}

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type in {
            'MESH', 'CURVE', 'SURFACE', 'META', 'FONT'}

    def draw(self, context):
        layout = property_layout(self)
        settings = context.object.raybundle
        layout.prop(settings, "role")
        column = layout.column()
        column.active = settings.role == 'BAKE'
        column.prop(settings, "side")


class RAYBUNDLE_PT_sidebar(bpy.types.Panel):
    bl_label = "Raybundle"
    bl_space_type = 'VIEW_3D'
    bl_region_type = 'UI'
    bl_category = "Raybundle"

    def draw(self, context):
        layout = self.layout
        column = layout.column(align=True)
        column.operator("raybundle.bake", text="Bake", icon='LIGHT')
        column.operator("raybundle.relight")
        column.operator("raybundle.clear", text="Clear")
        layout.operator("raybundle.preview")


register, unregister = bpy.utils.register_classes_factory((
    RAYBUNDLE_PT_render,
    RAYBUNDLE_PT_last_bake,
    RAYBUNDLE_PT_quality,
    RAYBUNDLE_PT_limits,
    RAYBUNDLE_PT_method,
    RAYBUNDLE_PT_output,
    RAYBUNDLE_UL_light_sets,
    RAYBUNDLE_PT_light_sets,
    RAYBUNDLE_PT_object,
    RAYBUNDLE_PT_sidebar,
))
