# SPDX-License-Identifier: GPL-3.0-or-later
"""Live mode: the light in the attributes follows lamps, materials, the world and places of objects
while the user changes them.

While changes come, each update is a draft: few rays and bundles on the lines of the last bake. When
changes stop, a bake with the settings of the scene replaces the draft, unless the preferences leave
that to the user. Both run in the background (bake_run.py), one at a time. Changes of the shape of
meshes are not followed, because writing light to a mesh changes the mesh too.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager

import bpy
from bpy.app.handlers import persistent

from . import bake_run, preferences, viewport_preview
from .bake import PreparedBake
from .bake_report import BakeError
from .messages import Message, translated
from .native import RaybundleError

# The settings of a draft that differ from those of the scene. With these, a bake takes no more
# bundles than it has.
DRAFT = {'target_error': 0.3, 'max_bundles': 64}
# Seconds between two looks of this module while it has something to do and while not.
_LOOK_SECONDS, IDLE_SECONDS = 0.005, 0.25


def rest_seconds() -> float:
    """Returns the time without a change after which a bake replaces the draft, s; infinity: none
    does."""
    user = preferences.get()
    if user is None:
        return preferences.LIVE_DELAY
    return user.live_delay if user.live_bakes else math.inf


class LiveLight:
    """Starts the bakes of live mode, and writes their light."""

    def __init__(self) -> None:
        self.drafts = 0  # number of drafts that were written
        self.message = ""  # why the light does not follow, for the user; "": it does
        self._run: bake_run.BakeRun | None = None
        self._is_draft = False  # whether self._run is a draft
        # The last bake that was prepared, as long as nothing but lamps has changed since.
        self._exported: PreparedBake | None = None
        self._was_on = False
        self._ignores_changes = False  # see ignoring_changes()
        self._is_stale = False  # whether something has changed since the last draft began
        self._draft_report = ""  # the scene's report after the last draft; "": a bake replaced it
        self._last_change = 0.0  # time.perf_counter()

    def note_update(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Notes what an update of the scene has changed, unless changes are ignored."""
        if self._ignores_changes:
            return
        if not bake_run.changes_only_lamps(depsgraph):
            self._exported = None
        if bake_run.changes_light(depsgraph):
            self._note_change()

    def _note_change(self) -> None:
        self._is_stale = True
        self._last_change = time.perf_counter()

    def shows_draft(self, scene: bpy.types.Scene) -> bool:
        """Returns whether the attributes hold a draft that no bake has replaced."""
        return bool(self._draft_report) and scene.raybundle.report == self._draft_report

    def step(self, context: bpy.types.Context) -> float:
        """Does what is to be done now. Returns the seconds until the next step."""
        scene = context.scene
        is_on = scene is not None and scene.raybundle.live
        if is_on != self._was_on:
            # While live mode is off, nothing notes changes, and the export would only take memory.
            self._exported = None
        if is_on and not self._was_on:
            self._note_change()
        self._was_on = is_on
        if self._run is not None:
            self._go_on(context, is_on)
        # Meshes in Edit Mode can be neither read nor written.
        if is_on and self._run is None and bake_run.active() is None and context.mode == 'OBJECT':
            self._begin(context)
        has_work = is_on and (self._run or self._is_stale or self.waits(scene))
        return _LOOK_SECONDS if has_work else IDLE_SECONDS

    def waits(self, scene: bpy.types.Scene) -> bool:
        """Returns whether a bake will replace the draft."""
        return self.shows_draft(scene) and math.isfinite(rest_seconds())

    def _begin(self, context: bpy.types.Context) -> None:
        rested = time.perf_counter() - self._last_change
        if not self._is_stale and not (
                self.shows_draft(context.scene) and rested > rest_seconds()):
            return
        self._is_draft = self._is_stale
        self._is_stale = False
        self.message = ""
        try:
            with self.ignoring_changes(context):
                self._run = bake_run.BakeRun(
                    context, DRAFT if self._is_draft else {}, is_live=True,
                    is_draft=self._is_draft, last=self._exported if self._is_draft else None)
            self._exported = self._run.prepared
        except (BakeError, RaybundleError) as error:
            self._fail(error)

    def _go_on(self, context: bpy.types.Context, is_on: bool) -> None:
        run = self._run
        if not is_on or self._is_stale and not self._is_draft:
            run.stop(Message("The light has changed"))
        if run.advance():
            return
        self._run = None
        try:
            if not run.stopped_because:
                with self.ignoring_changes(context):
                    run.finish(context)
                    viewport_preview.show_result(context, is_new=False)
                self._draft_report = context.scene.raybundle.report if self._is_draft else ""
                self.drafts += self._is_draft
        except (BakeError, RaybundleError) as error:
            self._fail(error)
        finally:
            run.leave()

    @contextmanager
    def ignoring_changes(self, context: bpy.types.Context) -> Iterator[None]:
        """Changes of the scene in the with block do not count as changes of the light. For
        operators that change materials without changing the light."""
        context.view_layer.update()  # reports earlier changes, which count
        self._ignores_changes = True
        try:
            yield
            # Blender evaluates and reports the changes now.
            context.view_layer.update()
        finally:
            self._ignores_changes = False

    def _fail(self, error: BakeError | RaybundleError) -> None:
        """Waits for the next change, which may end the cause of the error."""
        self.message = translated(error)
        self._exported = None
        self._draft_report = ""


live = LiveLight()


def keeps_draft(scene: bpy.types.Scene) -> bool:
    """Returns whether the attributes hold a draft that live mode will not replace by a bake."""
    return live.shows_draft(scene) and not (scene.raybundle.live and live.waits(scene))


@persistent
def _after_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    live.note_update(depsgraph)


@persistent
def _after_load(*_arguments: object) -> None:
    # A file that is opened does not begin to bake by itself.
    for scene in bpy.data.scenes:
        scene.raybundle.live = False
    live.__init__()


def _step() -> float:
    return live.step(bpy.context)


def register() -> None:
    bpy.app.handlers.depsgraph_update_post.append(_after_update)
    bpy.app.handlers.load_post.append(_after_load)
    # Background processes run no timers.
    if not bpy.app.background:
        bpy.app.timers.register(_step, first_interval=IDLE_SECONDS, persistent=True)


def unregister() -> None:
    if bpy.app.timers.is_registered(_step):
        bpy.app.timers.unregister(_step)
    bpy.app.handlers.load_post.remove(_after_load)
    bpy.app.handlers.depsgraph_update_post.remove(_after_update)
