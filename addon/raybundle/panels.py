# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels of the add-on: in Render properties, Object properties and the 3D view's sidebar.

The panel of the last report is in report_panel.py, that of collections in object_roles.py.
"""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from . import live_light, native, preferences, viewport_preview
from .light_sets import attribute_of
from .presets import RAYBUNDLE_PT_presets
from .progress_panel import draw_progress
from .properties import automatic_values
from .quality import TARGETS, enum_quality, estimated_seconds
from .report_data import read_report, time_text
from .text_wrap import draw_wrapped

# The settings of the panel Method.
METHODS = ("solver", "estimator", "first_shot", "local_rays", "directions", "projector",
           "plane_count", "plane_placement", "small_patches")
_BUTTON = 24.0  # width of a button with an icon, in pixels at a resolution scale of 1


def property_layout(panel: bpy.types.Panel) -> bpy.types.UILayout:
    """Returns the panel's layout, with labels beside the values and without buttons for
    keyframes."""
    panel.layout.use_property_split = True
    panel.layout.use_property_decorate = False
    return panel.layout


def draw_quality(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draws the buttons Draft, Good and Final, and below each what a bake would take."""
    column = layout.column(align=True)
    row = column.row(align=True)
    row.use_property_split = False
    for name in TARGETS:
        row.prop_enum(scene.raybundle, "quality", name)
    report = read_report(scene)
    costs = [estimated_seconds(report, target) for target in TARGETS.values()]
    row = column.row(align=True)
    row.active = False
    row.alignment = 'CENTER' if None in costs else 'EXPAND'
    if None in costs:
        row.label(text="Times after first bake")
        return
    for cost in costs:
        cell = row.row()
        cell.alignment = 'CENTER'
        cell.label(text=f"\N{ALMOST EQUAL TO} {time_text(cost)}", translate=False)


def draw_bake(layout: bpy.types.UILayout) -> None:
    """Draws the buttons that bake, relight and clear."""
    row = layout.row(align=True)
    row.operator("raybundle.bake", text="Bake", icon='LIGHT')
    row.operator("raybundle.relight")
    row.operator("raybundle.clear", text="", icon='TRASH')


def draw_preview(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup) -> None:
    """Draws the button that shows baked light in the 3D views, and the choice how."""
    row = layout.row(align=True)
    row.use_property_split = False  # The names are on the buttons.
    row.operator("raybundle.preview")
    for way in (viewport_preview.SOLID, viewport_preview.MATERIALS):
        row.prop_enum(settings, "show_in", way)


def draw_live(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draws the switch of live mode, why the light does not follow, and whether a draft stays."""
    row = layout.row()
    row.use_property_split = False  # The name is on the button.
    row.prop(context.scene.raybundle, "live", toggle=True, icon='OUTLINER_OB_LIGHT')
    if context.scene.raybundle.live and live_light.live.message:
        draw_wrapped(layout.column(), context, live_light.live.message, 'ERROR', 0.0)
    elif live_light.keeps_draft(context.scene):
        draw_wrapped(layout.column(), context, iface_("The light is a draft: press Bake"), 'INFO',
                     0.0)


def changed_methods(settings: bpy.types.PropertyGroup) -> list[str]:
    """Returns the names, as shown, of the settings of the panel Method that differ from their
    defaults."""
    definitions = [settings.bl_rna.properties[name] for name in METHODS]
    return [iface_(item.name) for item in definitions
            if getattr(settings, item.identifier) != item.default]


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

    def draw_header_preset(self, context):
        RAYBUNDLE_PT_presets.draw_panel_header(self.layout)

    def draw(self, context):
        layout = property_layout(self)
        settings = context.scene.raybundle
        draw_quality(layout, context.scene)
        if not draw_progress(layout, context):
            draw_bake(layout)
            draw_live(layout, context)
        draw_preview(layout, settings)
        layout.prop(settings, "scope")
        methods = changed_methods(settings)
        if methods and not preferences.studies_methods():
            row = layout.row()
            text = iface_("Not the default: {methods}").format(methods=", ".join(methods))
            draw_wrapped(row.column(), context, text, 'INFO', _BUTTON)
            row.operator("raybundle.reset_methods", text="", icon='LOOP_BACK')


class RAYBUNDLE_OT_reset_methods(bpy.types.Operator):
    """Set all methods to their defaults, which are nearly always the fastest"""
    bl_idname = "raybundle.reset_methods"
    bl_label = "Reset Methods"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        return context.scene is not None

    def execute(self, context):
        for name in METHODS:
            context.scene.raybundle.property_unset(name)
        return {'FINISHED'}


class RAYBUNDLE_PT_quality(RaybundleRenderPanel, bpy.types.Panel):
    bl_label = "Quality"
    bl_parent_id = "RAYBUNDLE_PT_render"
    bl_options = {'DEFAULT_CLOSED'}
    bl_order = 30

    def draw(self, context):
        layout = property_layout(self)
        settings = context.scene.raybundle
        for name in ("target_percent", "topology"):
            layout.prop(settings, name)
        row = layout.row()
        row.active = settings.topology == 'ADAPTIVE'
        row.prop(settings, "max_vertices")
        row = layout.row()
        row.active = settings.topology == 'ADAPTIVE' and settings.domain == 'CORNER'
        row.prop(settings, "discontinuity_lines")
        layout.prop(settings, "simplify")
        row = layout.row()
        row.active = settings.topology != 'ADAPTIVE'
        row.prop(settings, "count_adaptive")
        for name in ("patch_size", "refine", "contacts", "reconstruction", "final_gather"):
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
        layout.prop(settings, "threads")
        layout.prop(settings, "seed")
        if settings.threads != 0 or settings.is_property_set('memory_limit'):
            layout.operator("raybundle.use_preferences", icon='LOOP_BACK')
        automatic = automatic_values(settings)
        if automatic.get('threads'):
            self._draw_automatic(iface_("Preferences: {count} threads"), automatic['threads'])
        if 'memory_limit' in automatic and \
                automatic['memory_limit'] != settings.bl_rna.properties['memory_limit'].default:
            self._draw_automatic(iface_("Preferences: {count} MB"), automatic['memory_limit'])

    def _draw_automatic(self, text: str, value: float) -> None:
        """Names a value of the add-on's preferences that applies instead of the scene's."""
        self.layout.label(text=text.format(count=f"{value:,.0f}"), icon='INFO', translate=False)


class RAYBUNDLE_OT_use_preferences(bpy.types.Operator):
    """Leave the number of threads and the memory limit to the preferences of the add-on"""
    bl_idname = "raybundle.use_preferences"
    bl_label = "Use Preferences"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        return context.scene is not None

    def execute(self, context):
        for name in ("threads", "memory_limit"):
            context.scene.raybundle.property_unset(name)
        return {'FINISHED'}


class RAYBUNDLE_PT_method(RaybundleRenderPanel, bpy.types.Panel):
    bl_label = "Method"
    bl_parent_id = "RAYBUNDLE_PT_render"
    bl_options = {'DEFAULT_CLOSED'}
    bl_order = 50

    @classmethod
    def poll(cls, context):
        return super().poll(context) and preferences.studies_methods()

    def draw(self, context):
        layout = property_layout(self)
        settings = context.scene.raybundle
        for name in METHODS:
            # Its name is too long for the editor.
            options = {'text': iface_("Placement")} if name == "plane_placement" else {}
            draw_used(layout, settings, name, **options)


class RAYBUNDLE_PT_output(RaybundleRenderPanel, bpy.types.Panel):
    bl_label = "Output"
    bl_parent_id = "RAYBUNDLE_PT_render"
    bl_order = 10

    def draw(self, context):
        layout = property_layout(self)
        settings = context.scene.raybundle
        for name in ("output", "attribute", "domain", "data_type", "exposure", "clamp",
                     "write_error", "show_result"):
            layout.prop(settings, name)
        column = layout.column()
        # Finer copies never share a mesh.
        column.active = settings.topology == 'KEEP' and not settings.simplify
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
    bl_order = 40

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
                layout.label(text=iface_("Attribute \"{name}\"").format(
                    name=attribute_of(item, settings.attribute)), icon='BLANK1', translate=False)


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
        column.prop(settings, "quality")


class RAYBUNDLE_PT_sidebar(bpy.types.Panel):
    bl_label = "Raybundle"
    bl_space_type = 'VIEW_3D'
    bl_region_type = 'UI'
    bl_category = "Raybundle"

    def draw(self, context):
        layout = self.layout
        draw_quality(layout, context.scene)
        if not draw_progress(layout, context):
            column = layout.column(align=True)
            column.operator("raybundle.bake", text="Bake", icon='LIGHT')
            column.operator("raybundle.relight")
            column.operator("raybundle.clear", text="Clear")
            draw_live(layout, context)
        draw_preview(layout, context.scene.raybundle)


register, unregister = bpy.utils.register_classes_factory((
    RAYBUNDLE_PT_render,
    RAYBUNDLE_OT_reset_methods,
    RAYBUNDLE_OT_use_preferences,
    # In the order of bl_order. 20 is that of export_panels.py.
    RAYBUNDLE_PT_output,
    RAYBUNDLE_PT_quality,
    RAYBUNDLE_PT_limits,
    RAYBUNDLE_UL_light_sets,
    RAYBUNDLE_PT_light_sets,
    RAYBUNDLE_PT_method,
    RAYBUNDLE_PT_object,
    RAYBUNDLE_PT_sidebar,
))
