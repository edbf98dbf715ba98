# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake in a thread of the native library, while Blender's window stays usable.

The main thread exports the scene, asks for the state of the run in a timer, and writes the light.
Nothing of Blender is used in another thread. At most one bake runs at a time.
"""

from __future__ import annotations

import atexit
import time

import bpy
from bpy.app.handlers import persistent
from bpy.app.translations import pgettext_tip as tip_

from . import native
from .bake import (PreparedBake, object_mode, prepare, prepare_lamps, write_results,
                   writes_copies)
from .bake_progress import BakeProgress
from .bake_report import BakeError, BakeReport
from .interim_light import InterimLight
from .messages import Message
from .report_data import read_report

# Interim light is shown so rarely that writing and drawing it take at most this share of the time.
_SHOWING_SHARE = 0.2

_active: BakeRun | None = None


def active() -> BakeRun | None:
    """Returns the bake that is running, or whose result is not written yet."""
    return _active


def changes_light(depsgraph: bpy.types.Depsgraph) -> bool:
    """Returns whether an update changes a lamp, a material, the world, the place of an object, or
    which objects there are. Changes of meshes do not count, because writing light to a mesh is
    one."""
    return any(
        isinstance(update.id, (bpy.types.Light, bpy.types.World, bpy.types.Material,
                               bpy.types.ShaderNodeTree, bpy.types.Collection))
        or isinstance(update.id, bpy.types.Object) and update.is_updated_transform
        for update in depsgraph.updates)


def changes_only_lamps(depsgraph: bpy.types.Depsgraph) -> bool:
    """Returns whether an update changes nothing but lamps."""
    changed = [update.id for update in depsgraph.updates]
    has_lamp = any(isinstance(item, bpy.types.Light) for item in changed)
    # From Blender 5.1 on every lamp has a node tree, which is updated with it. The owners of
    # embedded trees are listed too.
    return all(isinstance(item, bpy.types.Light)
               or isinstance(item, bpy.types.Object) and item.type == 'LIGHT'
               or isinstance(item, bpy.types.ShaderNodeTree) and item.is_embedded_data and has_lamp
               for item in changed)


def can_begin(operator: type[bpy.types.Operator]) -> bool:
    """Returns whether no bake is running that another bake would have to wait for. Otherwise sets
    the reason that the operator's button shows."""
    if _active is not None and not _active.is_live:
        operator.poll_message_set(tip_("A bake is running: wait until it ends, or press Esc"))
        return False
    return True


def make_way() -> None:
    """Ends the run of live mode, if there is one, before another bake begins."""
    if _active is not None and _active.is_live:
        _active.stop(Message("Another bake has begun"))
        _active.leave()


class BakeRun:
    """A bake from the export of the scene to the end of the native run."""

    def __init__(self, context: bpy.types.Context, overrides: dict[str, object] | None = None,
                 is_live: bool = False, is_draft: bool = False,
                 last: PreparedBake | None = None) -> None:
        """Exports the context's scene, starts the native run, and makes this the active run.
        is_live: whether live mode has started it; such a run shows no interim light. is_draft: as
        in prepare(). last: an earlier bake, if nothing but lamps has changed since it was prepared.
        overrides, and errors: as in bake()."""
        global _active
        self.is_live = is_live
        self.progress = BakeProgress(read_report(context.scene).get('seconds', {}))
        self.stopped_because = ""  # why the run was stopped, for the user; "": it was not
        self.is_kept = False  # whether the light so far was kept when the run was stopped
        self.was_scene_changed = False  # whether lights, materials or places changed meanwhile
        native.load()
        with object_mode(context):
            self.prepared = last and prepare_lamps(context, overrides or {}, is_draft, last)
            if self.prepared is None:
                self.prepared = prepare(context, overrides or {}, is_draft)
        try:
            self._run = native.Run(self.prepared.native_bake, self.prepared.native_scene)
        finally:
            # The run keeps the native scene until it ends. If only lamps change, live mode uses it
            # for the next run too.
            if not is_live:
                self.prepared.native_scene.close()
        self._interim = InterimLight(self.prepared)
        self.state = self._run.state()
        # time.perf_counter() when light was last shown, or None if that has been drawn; and before
        # which none is shown again
        self._shown: float | None = None
        self._next_show = 0.0
        _active = self

    @property
    def shows_light(self) -> bool:
        """Returns whether interim light is in the attributes."""
        return self._interim.is_shown

    def advance(self) -> bool:
        """Reads the state of the run and shows its light. Returns whether it goes on."""
        if self.stopped_because:
            return False
        self.state = self._run.state()
        self.progress.note(self.state.stage, self.state.fraction)
        now = time.perf_counter()
        if self._shown is not None:
            # By now the light is written and drawn.
            self._next_show = now + (now - self._shown) * (1.0 / _SHOWING_SHARE - 1.0)
            self._shown = None
        if (self.state.interim > 0 and self.state.is_running and now >= self._next_show
                and not self.is_live):
            self._interim.show(self._run)
            self._shown = now
        return self.state.is_running

    def hide_light(self) -> None:
        """Gives the attributes what they held before, until the next light is shown."""
        self._interim.put_back()

    def stop(self, because: Message, keep: bool = False) -> None:
        """Ends the run within about 100 ms. because: for the user. keep: whether the
        attributes keep the light so far, or get back what they held before."""
        if self.stopped_because:
            return
        self.stopped_because = because
        self._run.cancel()
        self.is_kept = keep and self.shows_light
        if self.is_kept:
            # The last report describes other light.
            self.prepared.scene.raybundle.report = ""
        else:
            self._interim.put_back()
        self._run.close()

    def finish(self, context: bpy.types.Context) -> BakeReport:
        """Writes the result of a run that has ended by itself, and returns the report. Errors: as
        in bake(); the attributes then get back what they held before."""
        self.progress.note('write_back', 0.0)
        warnings = [Message("The scene was changed while the bake ran, and the light is that of "
                            "the scene before: bake again, or relight")
                    ] if self.was_scene_changed else []
        prepared = self.prepared
        try:
            self._run.finish()
            if writes_copies(prepared.settings) and context.scene != prepared.scene:
                # Copies are evaluated and placed in the scene that the window shows.
                raise BakeError(Message("The window shows another scene than the one that was "
                                        "baked: nothing was written, show that scene and bake "
                                        "again"))
            with object_mode(context):
                return write_results(context, prepared, warnings)
        except (BakeError, native.RaybundleError):
            self._interim.put_back()
            raise

    def leave(self) -> None:
        """Ends the run if it goes on, and makes room for the next one."""
        global _active
        self._run.close()
        if _active is self:
            _active = None


# --------------------------------------------------------------------------------------------------
# What happens to the file meanwhile
# --------------------------------------------------------------------------------------------------


@persistent
def _before_undo(*_arguments: object) -> None:
    if _active is not None:
        # Undo compares meshes with its own copies, which do not have the interim light.
        _active.stop(Message("The bake was stopped by Undo or Redo: nothing was written"))


@persistent
def _before_load(*_arguments: object) -> None:
    if _active is not None:
        _active.stop(Message("The bake was stopped because a file was opened: nothing was "
                             "written"))
        _active.leave()


@persistent
def _before_save(*_arguments: object) -> None:
    # The file gets what the attributes held before. The next interim light is written again.
    if _active is not None and not _active.stopped_because:
        _active.hide_light()


@persistent
def _after_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if _active is not None and not _active.is_live and changes_light(depsgraph):
        _active.was_scene_changed = True


def _before_exit() -> None:
    # A thread of the library must not outlive Blender.
    if _active is not None:
        _active.leave()


_HANDLERS = (('undo_pre', _before_undo), ('redo_pre', _before_undo), ('load_pre', _before_load),
             ('save_pre', _before_save), ('depsgraph_update_post', _after_update))


def register() -> None:
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)
    atexit.register(_before_exit)


def unregister() -> None:
    atexit.unregister(_before_exit)
    _before_exit()
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
