# SPDX-License-Identifier: GPL-3.0-or-later
"""The buttons beside the warnings of the report: they do what a warning advises, or show what it is
about."""

from __future__ import annotations

import re
from collections.abc import Iterable

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_tip as tip_
from bpy.props import IntProperty, StringProperty

from .finer_copy import find_copies
from .messages import Message, translated
from .properties import assign
from .report_data import Line, read_report, warning_lines

# Advice ends a warning: "choose solver LINE_REUSE and first_shot GATHER".
_ADVICE = re.compile(r'\b(solver|first_shot|projector|small_patches|topology) ([A-Z][A-Z_]+)\b'
                     r'|\b(patch_size) (\d[\d.e+-]*) m\b|(the data type) (Color)\b')
_REACHED = re.compile(r'max_bundles was reached at (\d+) bundles')
_BUNDLES_FACTOR = 4
_NOISY = re.compile(r'the target of ([\d.]+) %.*; lower target_error')
# Warnings of the library about an error that the attribute of the error shows.
_ABOUT_ERROR = {'NOISY_OBJECTS', 'DIRECT_NOISE', 'MAX_BUNDLES', 'FEW_LINES', 'COARSE_MESH'}
_ABOUT_ERROR_TEXT = re.compile(r'noisier than|the noise is|too coarse for')  # of earlier releases
_UNLIT = re.compile(r'almost no light reaches the baked sides')


def is_about_error(line: Line) -> bool:
    return line.id in _ABOUT_ERROR or _ABOUT_ERROR_TEXT.search(line.text) is not None


def is_about_side(line: Line) -> bool:
    """Returns whether the other side of the objects' faces should be baked."""
    return line.id == 'NO_LIGHT_ON_SIDE' or _UNLIT.search(line.text) is not None


def advised_settings(line: Line, settings: bpy.types.PropertyGroup) -> dict[str, object]:
    """Returns the settings that a warning advises to change, by name. Values that another warning
    has already improved more than this one advises are kept."""
    definitions = settings.bl_rna.properties
    if match := _REACHED.match(line.text):
        most = definitions['max_bundles'].hard_max
        return {'max_bundles': max(settings.max_bundles,
                                   min(_BUNDLES_FACTOR * int(match[1]), most))}
    if match := _NOISY.search(line.text):
        half = max(0.005 * float(match[1]), definitions['target_error'].hard_min)
        return {'target_error': min(settings.target_error, half)}
    advised: dict[str, object] = {}
    for match in _ADVICE.finditer(line.text.rpartition("choose ")[2]):
        name, value = (group for group in match.groups() if group is not None)
        if name == "the data type":
            advised['data_type'] = 'FLOAT_COLOR'
        elif name == 'patch_size':
            advised[name] = float(value)
        elif value in definitions[name].enum_items:
            advised[name] = value
    if 'patch_size' in advised and settings.topology == 'SUBDIVIDE' and settings.patch_size > 0.0:
        advised['patch_size'] = min(advised['patch_size'], settings.patch_size)
    return advised


def advice_text(advised: dict[str, object], settings: bpy.types.PropertyGroup) -> str:
    """Returns the text of the button that applies advised settings, translated."""
    if 'patch_size' in advised:
        return iface_("Subdivide to {size} m").format(size=f"{advised['patch_size']:.3g}")
    if 'target_error' in advised:
        return f"{iface_('Noise')}: {100.0 * advised['target_error']:.3g} %"
    return ", ".join(f"{iface_(settings.bl_rna.properties[name].name)}: "
                     f"{_value_text(settings, name, value)}" for name, value in advised.items())


def _value_text(settings: bpy.types.PropertyGroup, name: str, value: object) -> str:
    definition = settings.bl_rna.properties[name]
    return iface_(definition.enum_items[value].name) if definition.type == 'ENUM' \
        else f"{value:,}"


def is_applied(advised: dict[str, object], settings: bpy.types.PropertyGroup) -> bool:
    """Returns whether the settings already have the advised values."""
    return all(getattr(settings, name) == value if isinstance(value, (str, int))
               else abs(getattr(settings, name) - value) <= 1e-5 * value
               for name, value in advised.items())


def exist(kind: str, names: Iterable[str]) -> bool:
    """Returns whether the file still has any of the owners that a warning names."""
    blocks = {'object': bpy.data.objects, 'light': bpy.data.objects, 'mesh': bpy.data.meshes,
              'material': bpy.data.materials}.get(kind, {})
    return any(name in blocks for name in names)


def objects_of(scene: bpy.types.Scene, kind: str, names: Iterable[str]) -> list[bpy.types.Object]:
    """Returns the scene's objects that a warning is about. kind, names: of Line."""
    wanted = set(names)
    if kind == 'mesh':
        return [item for item in scene.objects if item.data and item.data.name in wanted]
    if kind == 'material':
        return [item for item in scene.objects if any(
            slot.material and slot.material.name in wanted for slot in item.material_slots)]
    return [item for item in scene.objects if item.name in wanted]


class _OfWarning:
    """Mixin of operators that act on one warning of the last report."""

    index: IntProperty(
        name="Warning", description="Position of the warning in the report", default=-1,
        options={'HIDDEN', 'SKIP_SAVE'})

    @classmethod
    def poll(cls, context):
        return context.scene is not None

    def line(self, context: bpy.types.Context) -> Line | None:
        """Returns the warning, None if the report has changed and has no such warning."""
        lines = warning_lines(read_report(context.scene))
        return lines[self.index] if 0 <= self.index < len(lines) else None


class _InObjectMode(_OfWarning):
    """Mixin of operators that select objects."""

    @classmethod
    def poll(cls, context):
        if context.scene is None or context.mode != 'OBJECT':
            cls.poll_message_set(tip_("Leave the present mode: objects are selected in Object "
                                      "Mode"))
            return False
        return True


def _select(operator: bpy.types.Operator, context: bpy.types.Context,
            items: list[bpy.types.Object]) -> bool:
    """Selects only these objects and makes the first one active. Objects that are finer copies
    of hidden ones are selected in their place. Returns whether any was selected."""
    view_layer = context.view_layer
    copies = find_copies(context.scene)
    items = [copies.get(item, item) for item in items]
    shown = [item for item in items
             if item.name in view_layer.objects and item.visible_get(view_layer=view_layer)]
    if not shown:
        operator.report({'WARNING'}, translated(Message(
            "Nothing is selected: the objects are hidden, in another view layer or removed")))
        return False
    for item in context.selected_objects:
        item.select_set(False)
    for item in shown:
        item.select_set(True)
    view_layer.objects.active = shown[0]
    operator.report({'INFO'}, translated(Message("Selected objects: {count}", count=len(shown))))
    return True


class RAYBUNDLE_OT_select_named(_InObjectMode, bpy.types.Operator):
    """Select the objects that this line of the report names"""
    bl_idname = "raybundle.select_named"
    bl_label = "Select"
    bl_options = {'REGISTER', 'UNDO'}

    object_name: StringProperty(
        name="Object", description="Name of the object, if the line is no warning",
        options={'HIDDEN', 'SKIP_SAVE'})

    def execute(self, context):
        line = self.line(context)
        if line is None:
            found = objects_of(context.scene, 'object', [self.object_name])
        else:
            found = objects_of(context.scene, line.kind, line.names)
        return {'FINISHED'} if _select(self, context, found) else {'CANCELLED'}


class RAYBUNDLE_OT_show_material(_InObjectMode, bpy.types.Operator):
    """Select the objects with these materials, and make the first one their active material"""
    bl_idname = "raybundle.show_material"
    bl_label = "Show Material"
    bl_options = {'REGISTER', 'UNDO'}

    def execute(self, context):
        line = self.line(context)
        found = objects_of(context.scene, line.kind, line.names) if line is not None else []
        if not _select(self, context, found):
            return {'CANCELLED'}
        for item in found:
            item.active_material_index = next(
                index for index, slot in enumerate(item.material_slots)
                if slot.material and slot.material.name in line.names)
        return {'FINISHED'}


class RAYBUNDLE_OT_apply_advice(_OfWarning, bpy.types.Operator):
    """Change the settings as this warning advises. The next bake uses them"""
    bl_idname = "raybundle.apply_advice"
    bl_label = "Apply Advice"
    bl_options = {'REGISTER', 'UNDO'}

    def execute(self, context):
        line = self.line(context)
        settings = context.scene.raybundle
        advised = advised_settings(line, settings) if line is not None else {}
        for name, value in advised.items():
            assign(settings, name, value)
        if not advised:
            return {'CANCELLED'}
        self.report({'INFO'}, translated(Message("The settings are changed: bake again")))
        return {'FINISHED'}


class RAYBUNDLE_OT_bake_other_side(_OfWarning, bpy.types.Operator):
    """Set the side of the named objects to the other one. The next bake uses it"""
    bl_idname = "raybundle.bake_other_side"
    bl_label = "Bake Other Side"
    bl_options = {'REGISTER', 'UNDO'}

    def execute(self, context):
        line = self.line(context)
        found = objects_of(context.scene, line.kind, line.names) if line is not None else []
        for item in found:
            item.raybundle.side = 'FRONT' if item.raybundle.side == 'BACK' else 'BACK'
        self.report({'INFO'}, translated(Message("Objects with another side: {count}. Bake again",
                                                 count=len(found))))
        return {'FINISHED'}


register, unregister = bpy.utils.register_classes_factory((
    RAYBUNDLE_OT_select_named,
    RAYBUNDLE_OT_show_material,
    RAYBUNDLE_OT_apply_advice,
    RAYBUNDLE_OT_bake_other_side,
))
