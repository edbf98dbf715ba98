# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators of the add-on. Each checks whether it may run, calls the bake, and reports the
result."""

import bpy
from bpy.app.translations import pgettext_tip as tip_

from . import bake_cache, color_attribute, viewport_preview
from .bake import bake
from .bake_report import BakeError
from .light_sets import written_attributes
from .materials.last_surfaces import LastSurfaces
from .native import ErrorCode, RaybundleError
from .subdivided_copy import remove_copies

# Position on the progress bar, from 0 to 1, at which each stage starts. Bundles take most of the
# time.
_STAGE_STARTS = {'export': 0.0, 'patches': 0.05, 'first_shot': 0.1, 'bundles': 0.3, 'solve': 0.85,
                 'reconstruction': 0.9, 'write_back': 0.97, 'done': 1.0}


def _overall_fraction(stage: str, fraction: float) -> float:
    """Returns the position on the progress bar, 0 to 1, for a fraction of a stage."""
    starts = list(_STAGE_STARTS.values())
    index = list(_STAGE_STARTS).index(stage)
    return starts[index] + fraction * (starts[index + 1] - starts[index])


def _run_bake(operator: bpy.types.Operator, context: bpy.types.Context) -> set[str]:
    """Bakes with a progress bar, and reports errors, warnings and the summary to the user."""
    window_manager = context.window_manager

    def show_progress(stage: str, fraction: float) -> None:
        window_manager.progress_update(1000.0 * _overall_fraction(stage, fraction))

    window_manager.progress_begin(0.0, 1000.0)
    try:
        report = bake(context, show_progress)
    except (BakeError, RaybundleError) as error:
        cancelled = isinstance(error, RaybundleError) and error.code == ErrorCode.CANCELLED
        operator.report({'WARNING' if cancelled else 'ERROR'}, str(error))
        return {'CANCELLED'}
    finally:
        window_manager.progress_end()
    for warning in report.warnings:
        operator.report({'WARNING'}, warning)
    operator.report({'INFO'}, report.summary())
    return {'FINISHED'}


class _NeedsScene:
    """Mixin of operators that only require a scene."""

    @classmethod
    def poll(cls, context):
        return context.scene is not None


class RAYBUNDLE_OT_bake(_NeedsScene, bpy.types.Operator):
    """Write direct and indirect light into the colour attributes of the scene's meshes"""
    bl_idname = "raybundle.bake"
    bl_label = "Bake Radiosity"
    bl_options = {'REGISTER', 'UNDO'}

    def execute(self, context):
        return _run_bake(self, context)


class RAYBUNDLE_OT_relight(_NeedsScene, bpy.types.Operator):
    """Bake again after a change of lights or materials, and reuse the lines of the last bake"""
    bl_idname = "raybundle.relight"
    bl_label = "Relight"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        if context.scene is None or not bake_cache.has_result(context.scene):
            cls.poll_message_set(tip_("There is nothing to relight: bake first. The lines of a "
                                      "bake are kept only until the file is closed"))
            return False
        return True

    def execute(self, context):
        return _run_bake(self, context)


class RAYBUNDLE_OT_clear(bpy.types.Operator):
    """Remove the baked attributes and the subdivided copies, and free the memory of the lines"""
    bl_idname = "raybundle.clear"
    bl_label = "Clear Bake"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        if context.scene is None or context.mode != 'OBJECT':
            cls.poll_message_set(tip_("Leave the present mode: attributes are removed in Object "
                                      "Mode"))
            return False
        return True

    def execute(self, context):
        scene = context.scene
        copies = remove_copies(scene)
        meshes = {item.data for item in scene.objects
                  if item.type == 'MESH' and item.data.library is None}
        cleared = sum(color_attribute.clear(mesh, scene.raybundle.attribute) for mesh in meshes)
        for name in written_attributes(scene):
            for mesh in meshes:
                color_attribute.clear(mesh, name)
        LastSurfaces(scene).forget_attributes()
        scene.raybundle.report = ""
        bake_cache.discard(scene)
        self.report({'INFO'}, f'Attribute "{scene.raybundle.attribute}" removed from meshes: '
                              f'{cleared}. Subdivided copies removed: {copies}')
        return {'FINISHED'}


class RAYBUNDLE_OT_light_set_add(_NeedsScene, bpy.types.Operator):
    """Add a light set: a group of lights that is baked into an attribute of its own"""
    bl_idname = "raybundle.light_set_add"
    bl_label = "Add Light Set"
    bl_options = {'REGISTER', 'UNDO'}

    def execute(self, context):
        settings = context.scene.raybundle
        names = {item.name for item in settings.light_sets}
        number = 1
        while f"Set {number}" in names:
            number += 1
        settings.light_sets.add().name = f"Set {number}"
        settings.light_set_index = len(settings.light_sets) - 1
        return {'FINISHED'}


class RAYBUNDLE_OT_light_set_remove(bpy.types.Operator):
    """Remove the selected light set. Its baked attributes stay until you press Clear"""
    bl_idname = "raybundle.light_set_remove"
    bl_label = "Remove Light Set"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        settings = context.scene.raybundle if context.scene is not None else None
        return settings is not None and settings.light_set_index < len(settings.light_sets)

    def execute(self, context):
        settings = context.scene.raybundle
        settings.light_sets.remove(settings.light_set_index)
        settings.light_set_index = max(0, min(settings.light_set_index,
                                              len(settings.light_sets) - 1))
        return {'FINISHED'}


class RAYBUNDLE_OT_preview(_NeedsScene, bpy.types.Operator):
    """Show the baked attribute in all 3D views, or restore their earlier shading"""
    bl_idname = "raybundle.preview"
    bl_label = "Preview"

    def execute(self, context):
        for item in context.scene.objects:
            if item.type == 'MESH' and item.data.library is None:
                color_attribute.activate(item.data, context.scene.raybundle.attribute)
        # A background process has no windows.
        if not bpy.app.background:
            viewport_preview.toggle(context.window_manager)
        return {'FINISHED'}


register, unregister = bpy.utils.register_classes_factory((
    RAYBUNDLE_OT_bake,
    RAYBUNDLE_OT_relight,
    RAYBUNDLE_OT_clear,
    RAYBUNDLE_OT_light_set_add,
    RAYBUNDLE_OT_light_set_remove,
    RAYBUNDLE_OT_preview,
))
