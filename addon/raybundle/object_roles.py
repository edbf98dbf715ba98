# SPDX-License-Identifier: GPL-3.0-or-later
"""Sets the role, the side and the quality of many objects at once: of a collection or of the
selection."""

from __future__ import annotations

from collections import Counter

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_tip as tip_
from bpy.props import EnumProperty

from .messages import Message, translated
from .properties import enum_role, enum_side
from .quality import enum_object_quality

# Types of objects that have surfaces.
SURFACE_TYPES = {'MESH', 'CURVE', 'SURFACE', 'META', 'FONT'}
_enum_target = (
    ('SELECTED', "Selected", "All selected objects"),
    ('COLLECTION', "Collection", "All objects of the active collection and of its children"),
)


def targets(context: bpy.types.Context, target: str) -> list[bpy.types.Object]:
    """Returns the objects with surfaces of a target, 'SELECTED' or 'COLLECTION'."""
    items = context.collection.all_objects if target == 'COLLECTION' else context.selected_objects
    return [item for item in items if item.type in SURFACE_TYPES]


class _SetsObjects:
    """Mixin of operators that set a property of the objects' settings."""

    target: EnumProperty(
        name="Objects", description="Which objects are set", items=_enum_target,
        default='SELECTED', options={'SKIP_SAVE'})

    @classmethod
    def poll(cls, context):
        if not targets(context, 'SELECTED') and not (
                context.collection and targets(context, 'COLLECTION')):
            cls.poll_message_set(tip_("No object with surfaces is selected"))
            return False
        return True

    def set_all(self, context: bpy.types.Context, name: str, value: str) -> set[str]:
        """Sets a property, by name, of all targets, and reports their number."""
        items = targets(context, self.target)
        # Objects of other files cannot be changed, unless they are overridden.
        changed = [item for item in items if item.library is None]
        for item in changed:
            setattr(item.raybundle, name, value)
        if len(changed) < len(items):
            self.report({'WARNING'}, translated(Message(
                "Objects set: {count}. Objects linked from other files, which cannot be changed: "
                "{linked}", count=len(changed), linked=len(items) - len(changed))))
        else:
            self.report({'INFO'}, translated(Message("Objects set: {count}", count=len(changed))))
        return {'FINISHED'}


class RAYBUNDLE_OT_set_role(_SetsObjects, bpy.types.Operator):
    """Set how the objects take part in a bake"""
    bl_idname = "raybundle.set_role"
    bl_label = "Set Role"
    bl_options = {'REGISTER', 'UNDO'}

    role: EnumProperty(
        name="Role", description="How the objects take part in a bake", items=enum_role)

    def execute(self, context):
        return self.set_all(context, 'role', self.role)


class RAYBUNDLE_OT_set_side(_SetsObjects, bpy.types.Operator):
    """Set the side of the objects' faces whose light is baked"""
    bl_idname = "raybundle.set_side"
    bl_label = "Set Side"
    bl_options = {'REGISTER', 'UNDO'}

    side: EnumProperty(
        name="Side", description="The side of the faces whose light is baked", items=enum_side)

    def execute(self, context):
        return self.set_all(context, 'side', self.side)


class RAYBUNDLE_OT_set_quality(_SetsObjects, bpy.types.Operator):
    """Set how exactly the light of the objects is computed, compared with the scene"""
    bl_idname = "raybundle.set_quality"
    bl_label = "Set Quality"
    bl_options = {'REGISTER', 'UNDO'}

    quality: EnumProperty(
        name="Quality", description="How exactly the light of the objects is computed",
        items=enum_object_quality)

    def execute(self, context):
        return self.set_all(context, 'quality', self.quality)


class RAYBUNDLE_PT_collection(bpy.types.Panel):
    bl_label = "Raybundle"
    bl_space_type = 'PROPERTIES'
    bl_region_type = 'WINDOW'
    bl_context = "collection"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context):
        layout = self.layout
        items = targets(context, 'COLLECTION')
        layout.label(text=iface_("Objects with surfaces: {count}").format(count=len(items)),
                     translate=False)
        column = layout.column()
        column.enabled = bool(items)
        for name, choices in (("role", enum_role), ("side", enum_side),
                              ("quality", enum_object_quality)):
            counts = Counter(getattr(item.raybundle, name) for item in items)
            split = column.split(factor=0.3, align=True)
            split.label(text=bpy.types.Object.bl_rna.properties['raybundle'].fixed_type
                        .properties[name].name)
            row = split.row(align=True)
            for value, label, _ in choices:
                button = row.operator(f"raybundle.set_{name}", text=iface_(label),
                                      depress=bool(items) and counts[value] == len(items),
                                      translate=False)
                button.target = 'COLLECTION'
                setattr(button, name, value)


register, unregister = bpy.utils.register_classes_factory((
    RAYBUNDLE_OT_set_role,
    RAYBUNDLE_OT_set_side,
    RAYBUNDLE_OT_set_quality,
    RAYBUNDLE_PT_collection,
))
