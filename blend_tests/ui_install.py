# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps of ui_test.py: installs the zip in the Preferences of Blender before 4.2, and opens a file,
as docs/install.md describes it."""

from __future__ import annotations

import importlib
import os
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import bpy
from bpy.app.handlers import persistent
from ui_window import MAIN, PREFERENCES, Box, UiError, choose_file, press, until

# Height of the top bar, and width of its menus, in pixels.
_TOP_BAR, _MENUS = 26, 270
_FILE, _EDIT = 1, 2  # of the menus, after Blender's icon
# From the left end of an add-on's box to the middle of its check box, in pixels.
_CHECK_BOX = 35


def addon(name: str = "") -> ModuleType:
    """Returns a module of the installed add-on."""
    module = importlib.import_module(f"raybundle.{name}" if name else "raybundle")
    if not Path(module.__file__).is_relative_to(os.environ["HOME"]):
        raise UiError(f"{module.__file__} is not the installed add-on")
    return module


def close_splash(out: Path) -> Iterator[float]:
    """Closes what Blender shows at its first start. Yields pauses, s."""
    MAIN.picture(out / "first_start.png")
    yield from press("Escape")


def install(archive: Path, out: Path) -> Iterator[float]:
    """Installs the zip and enables the add-on. Yields pauses, s."""
    yield from _open_add_ons(out)
    region = PREFERENCES.region('PREFERENCES')
    button = yield from PREFERENCES.find("bpy.ops.preferences.addon_install", out, 'PREFERENCES')
    PREFERENCES.picture(out / "preferences.png", button)
    yield from PREFERENCES.click(button.centre)
    yield from choose_file(archive, out / "choose_zip.png")
    boxes = yield from PREFERENCES.boxes('wcol_box', region, out / "found.png")
    if len(boxes) != 1:
        raise UiError(f"the Preferences show {len(boxes)} add-ons after the installation")
    box = boxes[0]
    check_box = box._replace(left=box.left + _CHECK_BOX - 9, right=box.left + _CHECK_BOX + 9)
    command = yield from PREFERENCES.name_at(check_box.centre, "ctrl+c")
    if command != 'bpy.ops.preferences.addon_enable(module="raybundle")':
        raise UiError(f"the check box would call {command or 'nothing'}")
    yield from PREFERENCES.click(check_box.centre)
    yield from until(lambda: "raybundle" in bpy.context.preferences.addons,
                     "the add-on was not enabled")
    PREFERENCES.picture(out / "enabled.png", check_box)
    addon()


def _open_add_ons(out: Path) -> Iterator[float]:
    """Opens the section Add-ons of the Preferences by mouse. Yields pauses, s."""
    yield from _choose_in_menu(_EDIT, "p", out)
    yield from PREFERENCES.opened()
    preferences = bpy.context.preferences
    names = [item.identifier for item in preferences.bl_rna.properties['active_section'].enum_items
             if item.identifier != preferences.active_section]  # which has another colour
    sections = yield from PREFERENCES.boxes(
        'wcol_radio', PREFERENCES.region('PREFERENCES', 'NAVIGATION_BAR'), out / "found.png")
    yield from PREFERENCES.click(sections[names.index('ADDONS')].centre)
    yield from until(lambda: preferences.active_section == 'ADDONS', "Add-ons did not open")


def _choose_in_menu(menu: int, letter: str, out: Path) -> Iterator[float]:
    """Opens a menu of the top bar, and chooses the entry with an underlined letter. Yields pauses,
    s."""
    top = MAIN.window.height
    menus = yield from MAIN.words('wcol_pulldown', Box(0, top - _TOP_BAR, _MENUS, top),
                                  out / "found.png")
    yield from MAIN.click(menus[menu].centre, stays=True)
    yield from press(letter)


def open_file(path: Path, out: Path) -> Iterator[float]:
    """Opens a file by the menu File. Yields pauses, s."""
    opened = []

    @persistent
    def note(*_arguments: object) -> None:
        opened.append(bpy.data.filepath)

    bpy.app.handlers.load_post.append(note)
    yield from _choose_in_menu(_FILE, "o", out)
    yield from choose_file(path, out / "choose_file.png")
    yield from until(lambda: opened, f"{path} was not opened")
    bpy.app.handlers.load_post.remove(note)
    if opened != [str(path)]:
        raise UiError(f"{opened} was opened instead of {path}")
