# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators that show baked light in materials, export it, and check exports."""

import json
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_tip as tip_
from bpy.props import BoolProperty, EnumProperty, StringProperty

from . import bake_run, gltf_export, light_in_material, viewport_preview
from .bake_report import BakeError
from .channel_bake import bake_channels, why_not
from .export_check import check
from .gltf_export import EXPORTER_OFF, ExportError, ExportSettings
from .live_light import live
from .messages import Message, encoded, quoted, translated
from .native import RaybundleError
from .properties import enum_export_format, enum_export_range, enum_shown_as

enum_surface_color = (
    ('AUTO', "Automatic",
     "Without the colour of the surface for the output Combined, and with it for other outputs"),
    ('WITH', "With Colour", "The light is multiplied by the colour of the surface"),
    ('WITHOUT', "Without Colour", "The light alone is shown"),
)


class _NeedsObjectMode:
    """Mixin of operators that need a scene in Object Mode."""

    @classmethod
    def poll(cls, context):
        if context.mode != 'OBJECT':
            cls.poll_message_set(tip_("Leave the present mode: light is used and exported in "
                                      "Object Mode"))
        return context.scene is not None and context.mode == 'OBJECT'


class _NeedsLight(_NeedsObjectMode):
    """Mixin of operators that need an object with baked light."""

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        attribute = context.scene.raybundle.attribute
        if not any(item.type == 'MESH' and attribute in item.data.color_attributes
                   for item in context.scene.objects):
            cls.poll_message_set(tip_("No object has the attribute \"{name}\": bake first").format(
                name=attribute))
            return False
        return True


def _check(scene: bpy.types.Scene) -> list[Message]:
    """Returns what the check of exports finds, one line each, and keeps it for the panel."""
    lines = [finding.text() for finding in check(scene)]
    scene.raybundle.export_check = json.dumps([encoded(line) for line in lines])
    return lines


def _check_again(scene: bpy.types.Scene) -> None:
    """Updates what the panel shows of an earlier check."""
    if scene.raybundle.export_check:
        _check(scene)


class RAYBUNDLE_OT_use_in_material(_NeedsLight, bpy.types.Operator):
    """Show the baked light in Eevee and Cycles, by nodes in the materials of the baked objects"""
    bl_idname = "raybundle.use_in_material"
    bl_label = "Use in Material"
    bl_options = {'REGISTER', 'UNDO'}

    way: EnumProperty(name="Show As", description="How the light is shown", items=enum_shown_as)

    def invoke(self, context, event):
        self.way = context.scene.raybundle.shown_as
        result = self.execute(context)
        viewport_preview.show(context, viewport_preview.MATERIALS)
        return result

    def execute(self, context):
        settings = context.scene.raybundle
        way = light_in_material.chosen_way(
            settings, self.way if self.properties.is_property_set('way') else "")
        settings.is_light_lent = False
        with live.ignoring_changes(context):
            report = light_in_material.use(context.scene, settings.attribute, way)
        _check_again(context.scene)
        for warning in report.warnings:
            self.report({'WARNING'}, translated(warning))
        self.report({'INFO'}, translated(Message(
            "Materials that show {name}: {count}", name=quoted(settings.attribute),
            count=len(report.materials))))
        return {'FINISHED'}


class RAYBUNDLE_OT_take_out_of_material(_NeedsObjectMode, bpy.types.Operator):
    """Remove the nodes of Use in Material from all materials of the file"""
    bl_idname = "raybundle.take_out_of_material"
    bl_label = "Take Out of Material"
    bl_options = {'REGISTER', 'UNDO'}

    def invoke(self, context, event):
        with live.ignoring_changes(context):
            viewport_preview.hide(context)
        return self.execute(context)

    def execute(self, context):
        context.scene.raybundle.is_light_lent = False
        with live.ignoring_changes(context):
            count = light_in_material.take_out()
        self.report({'INFO'}, translated(Message("Materials restored: {count}", count=count)))
        _check_again(context.scene)
        return {'FINISHED'}


class RAYBUNDLE_OT_export_gltf(_NeedsLight, bpy.types.Operator):
    """Export the visible objects to a .glb file, with the light as colours of unlit materials"""
    bl_idname = "raybundle.export_gltf"
    bl_label = "Export glTF"

    filepath: StringProperty(
        name="File Path", description="The .glb file that is written", subtype='FILE_PATH',
        options={'SKIP_SAVE'})
    filter_glob: StringProperty(default="*.glb", options={'HIDDEN'})
    check_existing: BoolProperty(default=True, options={'HIDDEN'})
    format: EnumProperty(name="Format", description="How the light is stored",
                         items=enum_export_format)
    range: EnumProperty(
        name="Range", description="How light is fitted into the range 0 to 1 of glTF",
        items=enum_export_range)
    surface_color: EnumProperty(
        name="Surface", description="Whether the colour of the surface multiplies the light",
        items=enum_surface_color)
    apply_modifiers: BoolProperty(
        name="Apply Modifiers", description="Export the shapes that modifiers make, without shape "
                                            "keys", default=True)
    selected: BoolProperty(
        name="Selected Only", description="Export only the selected objects", default=False)

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        if not gltf_export.exporter_options():
            cls.poll_message_set(tip_(EXPORTER_OFF))
            return False
        return True

    def invoke(self, context, event):
        settings = context.scene.raybundle
        self.format, self.range = settings.export_format, settings.export_range
        if not self.filepath:
            name = bpy.data.filepath or str(Path.home() / "untitled")
            self.filepath = str(Path(name).with_suffix(".glb"))
        context.window_manager.fileselect_add(self)
        return {'RUNNING_MODAL'}

    def check(self, context):
        # The file browser asks before it overwrites the file that this name stands for.
        filepath = bpy.path.ensure_ext(self.filepath, ".glb")
        is_changed = filepath != self.filepath
        self.filepath = filepath
        return is_changed

    def draw(self, context):
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        for name in ("format", "range", "surface_color", "apply_modifiers", "selected"):
            self.layout.prop(self, name)

    def execute(self, context):
        settings = context.scene.raybundle
        is_set = self.properties.is_property_set
        with_color = settings.output != 'COMBINED' if self.surface_color == 'AUTO' \
            else self.surface_color == 'WITH'
        path = Path(bpy.path.abspath(bpy.path.ensure_ext(self.filepath, ".glb")))
        try:
            # The exporter changes materials and restores them.
            with live.ignoring_changes(context):
                report = gltf_export.export(context, path, ExportSettings(
                    settings.attribute, with_color,
                    self.format if is_set('format') else settings.export_format,
                    self.range if is_set('range') else settings.export_range,
                    self.apply_modifiers, self.selected))
        except ExportError as error:
            self.report({'ERROR'}, translated(error))
            return {'CANCELLED'}
        warnings = [*report.warnings]
        if live.shows_draft(context.scene):
            warnings.append(Message("The light in the file is a draft of live mode: press Bake, and "
                                    "export again"))
        for warning in warnings:
            self.report({'WARNING'}, translated(warning))
        self.report({'INFO'}, translated(report.summary()))
        return {'FINISHED'}


class RAYBUNDLE_OT_bake_channels(_NeedsObjectMode, bpy.types.Operator):
    """Bake the luminance of several parts of the light to the channels of the attribute"""
    bl_idname = "raybundle.bake_channels"
    bl_label = "Bake Channels"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        if not super().poll(context) or not bake_run.can_begin(cls):
            return False
        if reason := why_not(context.scene):
            cls.poll_message_set(translated(reason))
        return not reason

    def execute(self, context):
        bake_run.make_way()
        try:
            report = bake_channels(context)
        except (BakeError, RaybundleError) as error:
            self.report({'ERROR'}, translated(error))
            return {'CANCELLED'}
        for warning in report.warnings:
            self.report({'WARNING'}, translated(warning))
        self.report({'INFO'}, translated(Message(
            "Channels of {name} written", name=quoted(context.scene.raybundle.attribute))))
        return {'FINISHED'}


class RAYBUNDLE_OT_check_export(_NeedsObjectMode, bpy.types.Operator):
    """Say what Blender's own glTF exporter would lose or change of the light, and what to do"""
    bl_idname = "raybundle.check_export"
    bl_label = "Check Export"

    def execute(self, context):
        lines = _check(context.scene)
        for line in lines:
            self.report({'WARNING'}, translated(line))
        if not lines:
            self.report({'INFO'}, translated(Message(
                "Blender's glTF exporter keeps the light as it is")))
        return {'FINISHED'}


register, unregister = bpy.utils.register_classes_factory((
    RAYBUNDLE_OT_use_in_material,
    RAYBUNDLE_OT_take_out_of_material,
    RAYBUNDLE_OT_export_gltf,
    RAYBUNDLE_OT_bake_channels,
    RAYBUNDLE_OT_check_export,
))
