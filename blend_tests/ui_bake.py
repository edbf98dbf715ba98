# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of ui_test.py: Bake, Undo and Redo, Esc, Stop and Keep, saving and opening the file."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
from ui_install import addon, open_file
from ui_window import MAIN, PAUSE, Box, UiError, press, until

# The place of the tab Render among the tabs that are not open.
_RENDER_TAB = 1
# Mean differences of the colours of two pictures of the 3D view, 0 to 1: of a view that shows other
# light at least, and of the same view at most. The pointer of the mouse is not in pictures.
_OTHER, _SAME = 0.02, 0.002


def baked_objects() -> list[bpy.types.Object]:
    return [item for item in bpy.context.scene.objects
            if item.type == 'MESH' and "Radiosity" in item.data.color_attributes]


def colors() -> dict[str, np.ndarray]:
    """Returns the colours of all baked objects by name, (corners, 4)."""
    result = {}
    for item in baked_objects():
        attribute = item.data.color_attributes["Radiosity"]
        values = np.empty((len(attribute.data), 4), np.float32)
        attribute.data.foreach_get('color', values.ravel())
        result[item.name] = values
    return result


def same(some: dict[str, np.ndarray], others: dict[str, np.ndarray]) -> bool:
    return some.keys() == others.keys() and all(
        np.array_equal(values, others[name]) for name, values in some.items())


def view_picture(path: Path, box: Box | None = None) -> np.ndarray:
    """Saves a picture of the window. Returns the part of it that is the 3D view. box: as in
    UiWindow.picture()."""
    view = MAIN.region('VIEW_3D')
    return MAIN.picture(path, box)[view.bottom:view.top, view.left:view.right]


def difference(some: np.ndarray, other: np.ndarray) -> float:
    return float(np.abs(some - other).mean())


def bake(out: Path) -> Iterator[float]:
    """Opens the panel, presses Bake and checks the result. Yields pauses, s."""
    tabs = yield from MAIN.boxes('wcol_tab', MAIN.region('PROPERTIES', 'NAVIGATION_BAR'),
                                 out / "found.png")
    yield from MAIN.click(tabs[_RENDER_TAB].centre)
    yield from until(lambda: MAIN.area('PROPERTIES').spaces.active.context == 'RENDER',
                     "the tab Render has not opened")
    if bpy.context.scene.raybundle.report or baked_objects():
        raise UiError("the file was baked before")
    before = view_picture(out / "before_bake.png")
    button = yield from MAIN.find("bpy.ops.raybundle.bake(", out)
    yield from MAIN.click(button.centre)
    yield from until(lambda: bpy.context.scene.raybundle.report, "nothing was baked")
    if difference(view_picture(out / "baked.png", button), before) < _OTHER:
        raise UiError("the 3D view does not show the light")


def check_result() -> None:
    report = json.loads(bpy.context.scene.raybundle.report)
    names = {entry["name"] for entry in report["objects"] if entry["status"] == "baked"}
    meshes = {item.name for item in bpy.context.scene.objects if item.type == 'MESH'}
    if names != meshes:
        raise UiError(f"baked are {sorted(names)}, in the scene are {sorted(meshes)}")
    for name, values in colors().items():
        if not np.isfinite(values).all() or values[:, :3].max() <= 0.0:
            raise UiError(f'"{name}" has no light in its attribute')
    if colors().keys() != meshes:
        raise UiError("not every mesh has the attribute")


def undo_and_redo() -> Iterator[float]:
    """Removes the light of a bake and brings it back, by keys. Yields pauses, s."""
    baked = colors()
    yield from MAIN.move_to(MAIN.region('VIEW_3D').centre)
    yield from press("ctrl+z")
    yield from until(lambda: not baked_objects(), "Undo has not removed the light")
    yield from press("ctrl+shift+z")
    yield from until(lambda: same(colors(), baked), "Redo has not brought the light back")


# --------------------------------------------------------------------------------------------------
# A bake that is stopped
# --------------------------------------------------------------------------------------------------


@contextmanager
def endless_bakes() -> Iterator[None]:
    """Bakes that begin in the with block go on until they are stopped."""
    settings = bpy.context.scene.raybundle
    settings.seed, settings.skips_off, settings.max_bundles = 1, {'bundles'}, 2 ** 24
    settings.threads = 1  # leaves the other core to the window
    try:
        yield
    finally:
        for name in ("seed", "skips_off", "max_bundles", "threads"):
            bpy.context.scene.raybundle.property_unset(name)


def escape(out: Path) -> Iterator[float]:
    """Looks at the light and the progress of a bake, and cancels it with Esc. Yields pauses, s."""
    before, view = colors(), view_picture(out / "before_escape.png")
    with endless_bakes():
        yield from _start(out, "running.png")
        yield from press("Escape")
        yield from until(_no_bake, "Esc has not ended the bake")
    if not same(colors(), before):
        raise UiError("Esc has not restored the attributes")
    if difference(view_picture(out / "escaped.png"), view) > _SAME:
        raise UiError("Esc has not restored the 3D view")


def stop_and_keep(out: Path) -> Iterator[float]:
    """Stops a bake by its button, and undoes it. Yields pauses, s."""
    before = colors()
    with endless_bakes():
        yield from _start(out, "running_again.png")
        button = yield from MAIN.find("bpy.ops.raybundle.stop(keep=True)", out)
        yield from MAIN.click(button.centre)
        yield from until(_no_bake, "Stop and Keep has not ended the bake")
    if same(colors(), before) or not baked_objects():
        raise UiError("Stop and Keep has not kept the light")
    yield from MAIN.move_to(MAIN.region('VIEW_3D').centre)
    yield from press("ctrl+z")
    yield from until(lambda: same(colors(), before), "Undo has not removed the light so far")


def _start(out: Path, name: str) -> Iterator[float]:
    """Presses Bake, and waits for the first light and the progress. Yields pauses, s. name: of the
    picture."""
    before = colors()
    button = yield from MAIN.find("bpy.ops.raybundle.bake(", out)
    yield from MAIN.click(button.centre)
    yield from until(lambda: not _no_bake() and not same(colors(), before),
                     "a running bake shows no light")
    status = _status_bar(MAIN.picture(out / name))
    yield from until(lambda: difference(_status_bar(MAIN.picture(out / name)), status) > 0.0,
                     "the status bar shows no progress")


def _status_bar(pixels: np.ndarray) -> np.ndarray:
    """Returns the part of a picture of the window that shows the progress of a bake."""
    return pixels[:20, :pixels.shape[1] // 2]


def _no_bake() -> bool:
    return addon("bake_run").active() is None


# --------------------------------------------------------------------------------------------------
# Saving
# --------------------------------------------------------------------------------------------------


def save_and_reopen(out: Path) -> Iterator[float]:
    """Saves the file by keys, opens it, and looks at what is left. Yields pauses, s."""
    baked, view = colors(), view_picture(out / "saved.png")
    path = Path(bpy.data.filepath)
    yield from MAIN.move_to(MAIN.region('VIEW_3D').centre)
    yield from press("ctrl+s")
    yield from until(lambda: not bpy.data.is_dirty, "the file was not saved")
    yield from open_file(path, out)
    if not same(colors(), baked):
        raise UiError("the file has lost the light")
    if difference(view_picture(out / "reopened.png"), view) > _SAME:
        raise UiError("the 3D view does not show the light of the file")
    yield from _relight_is_greyed_out(out)


def _relight_is_greyed_out(out: Path) -> Iterator[float]:
    """Clicks Relight, which has nothing to reuse after a file was opened. Yields pauses, s."""
    report = bpy.context.scene.raybundle.report
    button = yield from MAIN.find("bpy.ops.raybundle.relight(", out)
    yield from MAIN.click(button.centre)
    yield 2.0 * PAUSE
    if not _no_bake() or bpy.context.scene.raybundle.report != report:
        raise UiError("Relight has begun although the file was only opened")
    # Its tooltip gives the reason.
    without = MAIN.picture(out / "relight_greyed.png")
    yield from MAIN.move_to(button.centre)
    yield 1.5
    if difference(MAIN.picture(out / "relight_greyed.png", button), without) == 0.0:
        raise UiError("Relight has no tooltip")
