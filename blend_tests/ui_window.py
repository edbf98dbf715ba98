# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's windows as a user sees and uses them: pictures, the mouse and the keyboard (xdotool).

Functions that yield are steps of a script that runs in a timer of Blender: they yield pauses in s,
in which Blender handles events and draws. Places are in pixels from the lower left corner of the
window. The screen has no window manager, so that new windows are moved into it
from here, and none is closed.
"""

from __future__ import annotations

import json
import subprocess
import time
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np

# Widgets have this colour while the test searches for them. Nothing else in Blender has it.
MARK = (1.0, 0.0, 1.0)
# Pause between two steps, s.
PAUSE = 0.15
LONGEST_SECONDS = 60.0
# Turns of the wheel between two looks at an editor, and the number of looks.
_TURNS, _LOOKS = 10, 10

# Seconds that a user hesitates before each click and each key.
pace = 0.0


class UiError(Exception):
    """The screen does not show what the test expects."""


class Box(NamedTuple):
    """The rectangle of a widget."""

    left: int
    bottom: int
    right: int
    top: int

    @property
    def centre(self) -> tuple[int, int]:
        return (self.left + self.right) // 2, (self.bottom + self.top) // 2


def xdotool(*arguments: object) -> str:
    return subprocess.run(["xdotool", *map(str, arguments)], check=True, capture_output=True,
                          text=True).stdout


def until(is_done: Callable[[], object], otherwise: str) -> Iterator[float]:
    """Waits until something is done. Yields pauses, s. otherwise: the message of the UiError that
    is raised after LONGEST_SECONDS."""
    deadline = time.monotonic() + LONGEST_SECONDS
    while not is_done():
        if time.monotonic() > deadline:
            raise UiError(f"{otherwise} within {LONGEST_SECONDS:.0f} s")
        yield PAUSE
    yield PAUSE


def press(keys: str) -> Iterator[float]:
    """Presses keys, as xdotool names them, in the window under the mouse. Yields pauses, s."""
    yield pace
    xdotool("key", keys)
    yield PAUSE


def type_text(text: str) -> Iterator[float]:
    """Types a text into the field that is being edited. Yields pauses, s."""
    xdotool("type", "--delay", 12, text)
    yield PAUSE


class UiWindow:
    """One of Blender's windows.

    title   regular expression of its title
    editor  type of an editor that only this window has, in bpy.types.Area
    """

    def __init__(self, title: str, editor: str) -> None:
        self._title, self._editor = title, editor
        self._found: dict[str, Box] = {}  # widgets by name, which may have moved since

    @property
    def window(self) -> bpy.types.Window | None:
        """The window, None while it is closed. Opening a file makes earlier values invalid."""
        return next((window for window in bpy.context.window_manager.windows
                     if any(area.type == self._editor for area in window.screen.areas)), None)

    def area(self, editor: str) -> bpy.types.Area:
        """Returns the largest editor of a type."""
        areas = [area for area in self.window.screen.areas if area.type == editor]
        if not areas:
            raise UiError(f"the window has no {editor}")
        return max(areas, key=lambda area: area.width * area.height)

    def region(self, editor: str, kind: str = 'WINDOW') -> Box:
        """Returns the rectangle of a region of the largest editor of a type."""
        region = next(region for region in self.area(editor).regions if region.type == kind)
        return Box(region.x, region.y, region.x + region.width, region.y + region.height)

    # ----------------------------------------------------------------------------------------------
    # Seeing
    # ----------------------------------------------------------------------------------------------

    def picture(self, path: Path, box: Box | None = None) -> np.ndarray:
        """Saves a picture of the window. Returns (height, width, 3) in 0..1, bottom row first.
        box: a widget to point at in the documentation, is saved beside the picture."""
        with bpy.context.temp_override(window=self.window, area=self.window.screen.areas[0]):
            # Shows what has changed since the last pause.
            bpy.ops.wm.redraw_timer(type='DRAW_WIN_SWAP', iterations=1)
        if box:
            path.with_suffix(".json").write_text(json.dumps(box))
        return self._save_picture(path)

    def _save_picture(self, path: Path) -> np.ndarray:
        with bpy.context.temp_override(window=self.window, area=self.window.screen.areas[0]):
            bpy.ops.screen.screenshot(filepath=str(path), check_existing=False)
        image = bpy.data.images.load(str(path))
        width, height = image.size
        pixels = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        return pixels.reshape(height, width, -1)[:, :, :3]

    def boxes(self, widgets: str, within: Box, path: Path) -> Generator[float, None, list[Box]]:
        """Returns the widgets of a kind in a rectangle, row by row from the top. widgets: the name
        of their colours in bpy.types.ThemeUserInterface. path: of the picture that is made."""
        marked = yield from self._marked_pixels(widgets, 'inner', within, path)
        found = []
        # Rounded corners have fewer pixels than a row of a button.
        for bottom, top in reversed(_runs(marked.sum(axis=1) > 8)):
            # A text is inside of a button. Between two buttons is a line of another colour.
            found += [Box(within.left + left, within.bottom + bottom, within.left + right,
                          within.bottom + top)
                      for left, right in _runs(marked[bottom:top].any(axis=0))
                      if right - left >= 10 and top - bottom >= 10]
        return found

    def words(self, widgets: str, within: Box, path: Path) -> Generator[float, None, list[Box]]:
        """Returns the words on widgets that have no background, from the left. Arguments as in
        boxes()."""
        marked = yield from self._marked_pixels(widgets, 'text', within, path)
        # Letters are nearer to each other than words.
        near = np.convolve(marked.any(axis=0), np.ones(9, int), 'same') > 0
        return [Box(within.left + left, within.bottom, within.left + right, within.top)
                for left, right in _runs(near)]

    def _marked_pixels(self, widgets: str, part: str, within: Box,
                       path: Path) -> Generator[float, None, np.ndarray]:
        """Gives the part 'inner' or 'text' of widgets the colour MARK, and returns which pixels of
        a rectangle have it. The other arguments are as in boxes()."""
        colors = getattr(bpy.context.preferences.themes[0].user_interface, widgets)
        before = tuple(getattr(colors, part))
        setattr(colors, part, (*MARK, 1.0)[:len(before)])
        try:
            yield PAUSE  # Blender draws the top bar only here.
            pixels = self._save_picture(path)[within.bottom:within.top, within.left:within.right]
        finally:
            setattr(colors, part, before)
        # Widgets that are greyed out have half the colour.
        return pixels[:, :, [0, 2]].min(axis=2) - pixels[:, :, 1] > 0.25

    def name_at(self, place: tuple[int, int], keys: str) -> Generator[float, None, str]:
        """Returns what Blender copies of the widget at a place. keys: ctrl+c is the Python command
        of a button, ctrl+shift+alt+c the data path of a property."""
        yield from self.move_to(place)
        bpy.context.window_manager.clipboard = ""
        xdotool("key", keys)
        for _ in range(8):
            yield 0.05
            if bpy.context.window_manager.clipboard:
                break
        return bpy.context.window_manager.clipboard

    def find(self, name: str, out: Path, editor: str = 'PROPERTIES', kind: str = 'WINDOW',
             widgets: str = 'wcol_tool') -> Generator[float, None, Box]:
        """Scrolls through a region until it shows a widget. name: its Python command or data path
        begins or ends with it. out: folder of pictures."""
        if name in self._found and (yield from self._is_at(name, self._found[name])):
            return self._found[name]
        for look in range(_LOOKS):
            region = self.region(editor, kind)
            for box in (yield from self.boxes(widgets, region, out / "found.png")):
                if (yield from self._is_at(name, box)):
                    self._found[name] = box
                    return box
            yield from self.move_to(region.centre)
            # Down to the end, and then from the top.
            is_end = look == _LOOKS // 2
            xdotool("click", "--repeat", 80 if is_end else _TURNS, "--delay", 5, 4 if is_end else 5)
            yield PAUSE
        raise UiError(f"the {editor} shows no widget {name}")

    def _is_at(self, name: str, box: Box) -> Generator[float, None, bool]:
        """Returns whether a widget has the name that find() looks for."""
        if name.startswith("bpy.ops."):
            return (yield from self.name_at(box.centre, "ctrl+c")).startswith(name)
        return (yield from self.name_at(box.centre, "ctrl+shift+alt+c")).endswith(name)

    # ----------------------------------------------------------------------------------------------
    # The mouse
    # ----------------------------------------------------------------------------------------------

    def identifier(self) -> str:
        """Returns the window's number for xdotool."""
        found = xdotool("search", "--onlyvisible", "--name", f"^{self._title}$").split()
        if len(found) != 1:
            raise UiError(f"there are {len(found)} windows with the title {self._title}")
        return found[0]

    def move_to(self, place: tuple[int, int]) -> Iterator[float]:
        """Moves the mouse to a place from above, so that Blender makes the widget there the active
        one. Yields pauses, s."""
        x, y = place
        number, height = self.identifier(), self.window.height
        for offset in (30, 0):
            xdotool("mousemove", "--window", number, x, height - 1 - y - offset)
            yield 0.4 * PAUSE

    def click(self, place: tuple[int, int], stays: bool = False) -> Iterator[float]:
        """Clicks at a place. stays: whether the mouse stays there, as menus need it. Yields pauses,
        s."""
        yield pace
        yield from self.move_to(place)
        xdotool("mousedown", 1)
        yield PAUSE
        xdotool("mouseup", 1)
        yield PAUSE
        if self.window and not stays:
            self.rest()

    def rest(self) -> None:
        """Moves the mouse into the corner, because the tooltip of a widget would hide others."""
        xdotool("mousemove", "--window", self.identifier(), 5, 5)

    def opened(self) -> Iterator[float]:
        """Waits until the window is open, and moves it into the screen. Yields pauses, s."""
        yield from until(lambda: self.window, f"no window with the title {self._title} has opened")
        xdotool("windowmove", self.identifier(), 60, 60)
        yield from until(lambda: self.window.x == 60, "the window has not moved")
        yield from self.move_to((self.window.width // 2, self.window.height // 2))


MAIN = UiWindow(r"Blender\*?( \[.*\])?", 'PROPERTIES')
PREFERENCES = UiWindow("Blender Preferences", 'PREFERENCES')
FILES = UiWindow("Blender File View", 'FILE_BROWSER')


def choose_file(path: Path, picture: Path) -> Iterator[float]:
    """Enters a path in the window that asks for a file, and confirms. Yields pauses, s."""
    yield from FILES.opened()
    yield from press("ctrl+l")
    yield from press("ctrl+a")
    yield from type_text(str(path))
    yield from press("Return")
    yield from confirm_file(path, picture)


def confirm_file(path: Path, picture: Path) -> Iterator[float]:
    """Confirms the path in the window that asks for a file. Yields pauses, s."""
    def is_chosen() -> bool:
        parameters = FILES.area('FILE_BROWSER').spaces.active.params
        return Path(parameters.directory.decode(), parameters.filename) == path
    yield from until(is_chosen, f"{path} was not chosen")
    FILES.picture(picture)
    yield from press("Return")
    yield from until(lambda: not FILES.window, "the window that asks for a file has not closed")


def _runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """Returns first and last + 1 of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist()))
