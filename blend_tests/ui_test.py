# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes with the mouse in a Blender with a window. run_ui_test.py starts this script.

    blender --factory-startup FILE.blend -P blend_tests/ui_test.py -- --out DIR

Shows the Raybundle panel in the Render properties, finds its Bake button on the screen, clicks it
with xdotool, and checks the result of the click: the light in the attributes and in the 3D view,
Undo and Redo by their keys, and Esc during a bake that would never end. The exit code is 0 or 1.
Pictures of the window are saved in DIR.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "addon"))
sys.dont_write_bytecode = True

import raybundle  # noqa: E402
from raybundle import bake_run  # noqa: E402

# Buttons of operators have this colour while the test searches for them. Nothing else in Blender
# has it.
MARK = (1.0, 0.0, 1.0)
# Pause between two steps, s, in which Blender draws and handles events.
PAUSE = 0.3
BAKE_SECONDS = 60.0


class UiError(Exception):
    """The screen does not show what the test expects."""


# --------------------------------------------------------------------------------------------------
# The window
# --------------------------------------------------------------------------------------------------


def window() -> bpy.types.Window:
    return bpy.context.window_manager.windows[0]


def properties_area() -> bpy.types.Area:
    for area in window().screen.areas:
        if area.type == 'PROPERTIES':
            return area
    raise UiError("the file's screen has no Properties editor")


def show_panel() -> None:
    """Shows the Render properties with only Raybundle's panel, which is open by default."""
    panels = list(bpy.types.Panel.__subclasses__())
    for panel in panels:
        if (getattr(panel, 'bl_space_type', '') == 'PROPERTIES'
                and getattr(panel, 'bl_region_type', '') == 'WINDOW'
                and getattr(panel, 'bl_context', '') == 'render'
                and not panel.__name__.startswith('RAYBUNDLE') and panel.is_registered):
            bpy.utils.unregister_class(panel)
    space = properties_area().spaces.active
    space.context = 'RENDER'


def screenshot(path: Path) -> np.ndarray:
    """Saves a picture of the window. Returns (height, width, 3) in 0..1, bottom row first."""
    with bpy.context.temp_override(window=window(), area=properties_area()):
        bpy.ops.wm.redraw_timer(type='DRAW_WIN_SWAP', iterations=2)
        bpy.ops.screen.screenshot(filepath=str(path), check_existing=False)
    image = bpy.data.images.load(str(path))
    width, height = image.size
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, -1)[:, :, :3]


def find_bake_button(path: Path) -> tuple[int, int]:
    """Returns the centre of the Bake button, in pixels from the lower left corner of the window.

    It is the leftmost button in the top row of the panel's buttons.
    """
    theme = bpy.context.preferences.themes[0].user_interface.wcol_tool
    before = tuple(theme.inner)
    theme.inner = (*MARK, 1.0)
    try:
        pixels = screenshot(path)
    finally:
        theme.inner = before
    region = next(region for region in properties_area().regions if region.type == 'WINDOW')
    inside = pixels[region.y:region.y + region.height, region.x:region.x + region.width]
    marked = (np.abs(inside - MARK) < 0.1).all(axis=2)
    rows = np.flatnonzero(marked.sum(axis=1) > 8)
    if not len(rows):
        raise UiError("there is no button in the Render properties: is the panel closed or hidden?")
    # Rows of the topmost button, without its rounded corners.
    top = rows[-1]
    bottom = next((row for row in range(top, -1, -1) if marked[row].sum() <= 8), -1) + 1
    middle = (top + bottom) // 2
    columns = np.flatnonzero(marked[bottom:top + 1].any(axis=0))
    # The text is inside the button, so that gaps of the width of a letter belong to the button.
    # Between buttons there is a line of another colour from top to bottom.
    left = columns[0]
    right = left
    while right + 1 < marked.shape[1] and marked[bottom:top + 1, right + 1].any():
        right += 1
    if top - bottom < 10 or right - left < 30:
        raise UiError(f"the first button is only {right - left} x {top - bottom} pixels large")
    return region.x + (left + right) // 2, region.y + middle


def xdotool(*arguments: object) -> str:
    return subprocess.run(["xdotool", *map(str, arguments)], check=True, capture_output=True,
                          text=True).stdout


def click(x: int, y: int) -> Iterator[float]:
    """Clicks at x, y, in pixels from the window's lower left corner. Yields pauses in s."""
    identifiers = xdotool("search", "--onlyvisible", "--name", "Blender").split()
    if len(identifiers) != 1:
        raise UiError(f"there are {len(identifiers)} windows of Blender")
    place = ["mousemove", "--window", identifiers[0], x]
    # Enters the button from outside, so that the button becomes the active one, with time for
    # Blender to react.
    for offset in (40, 2, 0):
        xdotool(*place, window().height - 1 - y - offset)
        yield PAUSE
    xdotool("mousedown", 1)
    yield PAUSE
    xdotool("mouseup", 1)
    yield PAUSE
    # Moves away, because the tooltip of the button would hide a part of the panel.
    xdotool("mousemove", "--window", identifiers[0], 5, 5)


# --------------------------------------------------------------------------------------------------
# The steps
# --------------------------------------------------------------------------------------------------


def baked_objects() -> list[bpy.types.Object]:
    return [item for item in bpy.context.scene.objects
            if item.type == 'MESH' and "Radiosity" in item.data.color_attributes]


def steps(out: Path) -> Iterator[float]:
    """Runs the test. Yields the pauses between its steps, s."""
    show_panel()
    yield 2.0 * PAUSE
    if bpy.context.scene.raybundle.report or baked_objects():
        raise UiError("the file was baked before")
    x, y = find_bake_button(out / "buttons_found.png")
    yield PAUSE
    screenshot(out / "raybundle_panel_before.png")
    yield from click(x, y)
    yield from until(lambda: bpy.context.scene.raybundle.report, "nothing was baked")
    screenshot(out / "raybundle_panel.png")
    check_result()
    view = next(area for area in window().screen.areas if area.type == 'VIEW_3D').spaces.active
    if (view.shading.type, view.shading.color_type) != ('SOLID', 'VERTEX'):
        raise UiError("the 3D view does not show the colours")
    baked = colors()
    yield from press("ctrl+z")
    yield from until(lambda: not baked_objects(), "Undo has not removed the light")
    yield from press("ctrl+shift+z")
    yield from until(lambda: same(colors(), baked), "Redo has not brought the light back")
    yield from escape(x, y, out)


def escape(x: int, y: int, out: Path) -> Iterator[float]:
    """Starts a bake that would never end, looks at its light, and cancels it with Esc. x, y: the
    Bake button. Yields pauses, s."""
    view = next(area for area in window().screen.areas if area.type == 'VIEW_3D').spaces.active
    view.shading.color_type = 'OBJECT'
    settings = bpy.context.scene.raybundle
    settings.seed, settings.skips_off, settings.max_bundles = 1, {'bundles'}, 2 ** 24
    before = colors()
    yield from click(x, y)
    yield from until(lambda: bake_run.active() is not None and not same(colors(), before),
                     "a running bake shows no light")
    screenshot(out / "raybundle_running.png")
    yield from press("Escape")
    yield from until(lambda: bake_run.active() is None, "Esc has not ended the bake")
    if not same(colors(), before):
        raise UiError("Esc has not restored the attributes")
    if view.shading.color_type != 'OBJECT':
        raise UiError("Esc has not restored the shading of the 3D view")


def until(is_done: Callable[[], object], otherwise: str) -> Iterator[float]:
    """Waits until something is done. Yields pauses, s. otherwise: the message of the UiError that
    is raised after BAKE_SECONDS."""
    deadline = time.monotonic() + BAKE_SECONDS
    while not is_done():
        if time.monotonic() > deadline:
            raise UiError(f"{otherwise} within {BAKE_SECONDS:.0f} s")
        yield PAUSE
    yield 2.0 * PAUSE


def press(keys: str) -> Iterator[float]:
    """Presses keys, as xdotool names them, in the window. Yields pauses, s."""
    xdotool("key", keys)
    yield PAUSE


def colors() -> dict[str, np.ndarray]:
    """Returns the colours of all baked objects by name."""
    result = {}
    for item in baked_objects():
        attribute = item.data.color_attributes["Radiosity"]
        values = np.empty(4 * len(attribute.data), np.float32)
        attribute.data.foreach_get('color', values)
        result[item.name] = values
    return result


def same(some: dict[str, np.ndarray], others: dict[str, np.ndarray]) -> bool:
    return some.keys() == others.keys() and all(
        np.array_equal(values, others[name]) for name, values in some.items())


def check_result() -> None:
    report = json.loads(bpy.context.scene.raybundle.report)
    names = {entry["name"] for entry in report["objects"] if entry["status"] == "baked"}
    meshes = {item.name for item in bpy.context.scene.objects if item.type == 'MESH'}
    if names != meshes:
        raise UiError(f"baked are {sorted(names)}, in the scene are {sorted(meshes)}")
    for name, values in colors().items():
        if not np.isfinite(values).all() or values.reshape(-1, 4)[:, :3].max() <= 0.0:
            raise UiError(f'"{name}" has no light in its attribute')
    if colors().keys() != meshes:
        raise UiError("not every mesh has the attribute")


def leave(code: int, message: str) -> None:
    print(f"ui_test: {message}", flush=True)
    sys.stdout.flush()
    # A normal exit would open a dialog that asks whether to save the file.
    os._exit(code)


def main() -> None:
    parser = argparse.ArgumentParser(prog="ui_test.py")
    parser.add_argument("--out", type=Path, required=True)
    out = parser.parse_args(sys.argv[sys.argv.index("--") + 1:]).out
    out.mkdir(parents=True, exist_ok=True)
    if bpy.app.background:
        leave(1, "needs a window: start it without -b")
    bpy.context.preferences.view.show_splash = False
    raybundle.register()
    script = steps(out)

    def advance() -> float | None:
        try:
            return next(script)
        except StopIteration:
            leave(0, f"Bake was clicked and has baked {len(baked_objects())} objects")
        except UiError as error:
            screenshot(out / "failure.png")
            leave(1, str(error))
        except Exception:
            traceback.print_exc()
            leave(1, "failed, see above")
        return None

    bpy.app.timers.register(advance, first_interval=1.0)


if __name__ == "__main__":
    main()
