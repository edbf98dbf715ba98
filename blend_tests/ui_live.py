# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of ui_test.py: drags a lamp with the mouse while live mode follows."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Vector
from ui_bake import colors, same
from ui_install import addon
from ui_window import LONGEST_SECONDS, MAIN, PAUSE, UiError, press, until, xdotool

# The drag: number of movements, and pixels of each.
_MOVES, _PIXELS = 10, 8
# Looks at unchanged light after which live mode rests. It begins a whole bake after 0.4 s.
_STILL_LOOKS = 8


def place_in_window(item: bpy.types.Object) -> tuple[int, int]:
    """Returns where the 3D view shows the middle of an object, in pixels of the window."""
    region = next(region for region in MAIN.area('VIEW_3D').regions if region.type == 'WINDOW')
    middle = item.matrix_world @ (sum((Vector(corner) for corner in item.bound_box), Vector()) / 8)
    place = location_3d_to_region_2d(region, MAIN.area('VIEW_3D').spaces.active.region_3d, middle)
    return region.x + int(place.x), region.y + int(place.y)


def live(out: Path, lamp: str) -> Iterator[float]:
    """Switches live mode on and drags a lamp. Yields pauses, s. lamp: the name of its object."""
    settings = bpy.context.scene.raybundle
    toggle = yield from MAIN.find("raybundle.live", out, widgets='wcol_regular')
    yield from MAIN.click(toggle.centre)
    yield from until(lambda: settings.live, "Live was not switched on")
    yield from _reach_target()
    item = bpy.data.objects[lamp]
    place = place_in_window(item)
    yield from MAIN.click(place)
    yield from until(lambda: bpy.context.view_layer.objects.active == item and item.select_get(),
                     f"a click has not selected {lamp}")
    yield from _drag(item, place, out)
    yield from _reach_target()
    MAIN.picture(out / "live_after_drag.png")
    _check_light()


def _reach_target() -> Iterator[float]:
    """Waits until live mode rests, and checks its noise. Yields pauses, s."""
    looks, last = 0, colors()
    deadline = time.monotonic() + LONGEST_SECONDS
    while looks < _STILL_LOOKS:
        if time.monotonic() > deadline:
            raise UiError(f"live mode does not rest within {LONGEST_SECONDS:.0f} s")
        yield PAUSE
        is_still = addon("bake_run").active() is None and same(colors(), last)
        looks, last = looks + 1 if is_still else 0, colors()
    settings = bpy.context.scene.raybundle
    noise = json.loads(settings.report or "{}").get("estimated_error", 1.0)
    if noise > settings.target_error:
        raise UiError(f"live mode rests at a noise of {noise:.1%}: "
                      f"{addon('live_light').live.message}")


def _drag(item: bpy.types.Object, place: tuple[int, int], out: Path) -> Iterator[float]:
    """Moves an object along x with the mouse, and looks at the light before the button confirms.
    Yields pauses, s."""
    start, before = item.location.x, colors()
    yield from MAIN.move_to(place)
    yield from press("g")
    yield from press("x")
    number, height = MAIN.identifier(), MAIN.window.height
    states = [before]
    for move in range(1, _MOVES + 1):
        xdotool("mousemove", "--window", number, place[0] - move * _PIXELS, height - 1 - place[1])
        yield 2.0 * PAUSE
        now = colors()
        if not same(now, states[-1]):
            states.append(now)
    MAIN.picture(out / "live_drag.png")
    if item.location.x >= start:
        raise UiError(f"the mouse has not moved {item.name}")
    if len(states) < 3:
        raise UiError(f"the light has changed {len(states) - 1} times during the drag")
    xdotool("click", 1)
    yield PAUSE
    MAIN.rest()


def _check_light() -> None:
    """Compares the light of live mode with that of a bake of the scene as it is now."""
    live, target = colors(), bpy.context.scene.raybundle.target_error
    addon().bake(bpy.context)
    for name, values in colors().items():
        error = np.sqrt(((live[name] - values) ** 2).mean() / (values ** 2).mean())
        # Both have the noise of the target.
        if error > 3.0 * target:
            raise UiError(f'live mode is {error:.1%} off the bake on "{name}"')
