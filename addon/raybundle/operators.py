# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators of the add-on. Each checks whether it may run, calls the bake, and reports the
result."""

import time

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_tip as tip_

from . import bake_cache, bake_run, color_attribute, viewport_preview
from .bake import bake
from .bake_progress import BakeProgress
from .bake_report import BakeError, BakeReport
from .finer_copy import remove_copies
from .light_sets import written_attributes
from .live_light import live
from .materials.last_surfaces import LastSurfaces
from .messages import Message, quoted, translated
from .native import ErrorCode, RaybundleError

# Seconds between two looks at a running bake, and between two drawings of its progress. Software
# renderers take a tenth of a second to draw.
_LOOK_SECONDS, _DRAW_SECONDS = 0.01, 0.25


def _say(operator: bpy.types.Operator, report: BakeReport) -> set[str]:
    """Reports the warnings and the summary of a bake to the user."""
    for warning in report.warnings:
        operator.report({'WARNING'}, translated(warning))
    operator.report({'INFO'}, translated(report.summary()))
    return {'FINISHED'}


def _refuse(operator: bpy.types.Operator, error: BakeError | RaybundleError) -> set[str]:
    """Reports why there is no bake."""
    cancelled = isinstance(error, RaybundleError) and error.code == ErrorCode.CANCELLED
    operator.report({'WARNING' if cancelled else 'ERROR'}, translated(error))
    return {'CANCELLED'}


def _redraw(context: bpy.types.Context) -> None:
    """Draws the panels again that show the progress, and not the 3D views beside them."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if (area.type, region.type) in (('PROPERTIES', 'WINDOW'), ('VIEW_3D', 'UI')):
                    region.tag_redraw()


class _Bakes:
    """Mixin of operators that bake: at once if a script calls them, and in the background if a
    button does, while Blender stays usable."""

    def execute(self, context):
        bake_run.make_way()
        progress = BakeProgress({})
        window_manager = context.window_manager

        def show_progress(stage: str, fraction: float) -> None:
            progress.note(stage, fraction)
            window_manager.progress_update(1000.0 * progress.fraction)

        window_manager.progress_begin(0.0, 1000.0)
        try:
            return _say(self, bake(context, show_progress))
        except (BakeError, RaybundleError) as error:
            return _refuse(self, error)
        finally:
            window_manager.progress_end()

    def invoke(self, context, _event):
        if bpy.app.background or context.window is None:
            return self.execute(context)
        bake_run.make_way()
        context.window.cursor_modal_set('WAIT')
        try:
            self._run = bake_run.BakeRun(context)
        except (BakeError, RaybundleError) as error:
            return _refuse(self, error)
        finally:
            context.window.cursor_modal_restore()
        self._next_draw = 0.0
        self._switched_preview = None
        self._timer = context.window_manager.event_timer_add(_LOOK_SECONDS, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {'RUNNING_MODAL'}

    def modal(self, context, event):
        run = self._run
        if event.type == 'ESC' and event.value == 'PRESS':
            run.stop(Message("The bake was cancelled: the attributes are as before"))
        elif event.type != 'TIMER':
            return {'PASS_THROUGH'}
        try:
            result = self._advance(context)
        except (BakeError, RaybundleError) as error:
            result = _refuse(self, error)
        except BaseException:
            # Blender ends the operator, without calling cancel().
            self.cancel(context)
            raise
        if result is None:
            self._show_progress(context)
            return {'PASS_THROUGH'}
        self.cancel(context)
        return result

    def _advance(self, context) -> set[str] | None:
        """Takes the next step of the bake. Returns the operator's result if it was the last."""
        run = self._run
        if run.stopped_because:
            self.report({'WARNING'}, translated(run.stopped_because))
            if self._switched_preview and not run.is_kept:
                viewport_preview.hide(context)
            return {'FINISHED'} if run.is_kept else {'CANCELLED'}
        goes_on = run.advance()
        # Once, so that the user can choose another shading meanwhile.
        if run.shows_light and self._switched_preview is None:
            self._switched_preview = viewport_preview.show_interim(context)
        if goes_on:
            return None
        with live.ignoring_changes(context):
            report = run.finish(context)
            warnings = viewport_preview.show_result(context)
        for warning in warnings:
            self.report({'WARNING'}, translated(warning))
        return _say(self, report)

    def _show_progress(self, context) -> None:
        if time.perf_counter() < self._next_draw:
            return
        self._next_draw = time.perf_counter() + _DRAW_SECONDS
        progress = self._run.progress
        context.workspace.status_text_set(
            f"{progress.stage_name()}: {progress.text(self._run.state)}    "
            f"{iface_('Esc: cancel')}")
        _redraw(context)

    def cancel(self, context):
        """Ends the bake. Blender calls this if it ends the operator itself."""
        self._run.leave()
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)
        _redraw(context)


class _NeedsScene:
    """Mixin of operators that only require a scene."""

    @classmethod
    def poll(cls, context):
        return context.scene is not None


class RAYBUNDLE_OT_bake(_Bakes, bpy.types.Operator):
    """Write direct and indirect light into the colour attributes of the scene's meshes"""
    bl_idname = "raybundle.bake"
    bl_label = "Bake Radiosity"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        return context.scene is not None and bake_run.can_begin(cls)


class RAYBUNDLE_OT_relight(_Bakes, bpy.types.Operator):
    """Bake again after a change of lights or materials, and reuse the lines of the last bake"""
    bl_idname = "raybundle.relight"
    bl_label = "Relight"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        if context.scene is None or not bake_run.can_begin(cls):
            return False
        # While live mode bakes, the cache cannot tell. Relighting ends that bake and works.
        if bake_run.active() is None and not bake_cache.has_result(context.scene):
            cls.poll_message_set(tip_("There is nothing to relight: bake first. The lines of a "
                                      "bake are kept only until the file is closed"))
            return False
        return True


class RAYBUNDLE_OT_stop(bpy.types.Operator):
    """Stop the bake that is running"""
    bl_idname = "raybundle.stop"
    bl_label = "Stop Bake"

    keep: bpy.props.BoolProperty(
        name="Keep", description="Keep the light so far, with its noise, instead of restoring "
                                 "what the attributes held before")

    @classmethod
    def poll(cls, context):
        return bake_run.active() is not None

    def execute(self, context):
        bake_run.active().stop(
            Message("The bake was stopped: the attributes keep the light so far" if self.keep else
                    "The bake was cancelled: the attributes are as before"), self.keep)
        return {'FINISHED'}


class RAYBUNDLE_OT_clear(bpy.types.Operator):
    """Remove the baked attributes and the finer copies, and free the memory of the lines"""
    bl_idname = "raybundle.clear"
    bl_label = "Clear Bake"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        if context.scene is None or not bake_run.can_begin(cls):
            return False
        if context.mode != 'OBJECT':
            cls.poll_message_set(tip_("Leave the present mode: attributes are removed in Object "
                                      "Mode"))
            return False
        return True

    def execute(self, context):
        bake_run.make_way()
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
        self.report({'INFO'}, translated(Message(
            "Attribute {name} removed from meshes: {cleared}. Subdivided copies removed: {copies}",
            name=quoted(scene.raybundle.attribute), cleared=cleared, copies=copies)))
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
    bl_options = {'REGISTER', 'UNDO'}

    def execute(self, context):
        for item in context.scene.objects:
            if item.type == 'MESH' and item.data.library is None:
                color_attribute.activate(item.data, context.scene.raybundle.attribute)
        # A background process has no windows.
        if not bpy.app.background:
            with live.ignoring_changes(context):
                warnings = viewport_preview.toggle(context)
            for warning in warnings:
                self.report({'WARNING'}, translated(warning))
        return {'FINISHED'}


register, unregister = bpy.utils.register_classes_factory((
    RAYBUNDLE_OT_bake,
    RAYBUNDLE_OT_relight,
    RAYBUNDLE_OT_stop,
    RAYBUNDLE_OT_clear,
    RAYBUNDLE_OT_light_set_add,
    RAYBUNDLE_OT_light_set_remove,
    RAYBUNDLE_OT_preview,
))
