# SPDX-License-Identifier: GPL-3.0-or-later
"""Installs the zip of the add-on in this Blender, as a user does, and bakes with it.

    blender -b --factory-startup --python-exit-code 1 -P blend_tests/installed_zip.py -- COMMAND ...

or with the Python of an environment that has Blender as the module bpy. The user's folder, which
Blender finds by the environment variable HOME, should be a new one. The commands are:

    life ZIP OLDER_ZIP  installs an older version, updates, disables and removes the add-on
    install ZIP         installs the add-on and leaves it there
    source LIGHT        bakes scenes/cornell_box.blend with the add-on of the source tree, and
                        writes the light
    compare LIGHT       bakes it with the installed add-on, and prints the largest difference from
                        the light, relative to the brightest
    fail TEXT           a bake with the installed add-on must end in an error that contains TEXT

LIGHT is a .npy file: (corners, 3) float32 of all objects in the order of their names. From Blender
4.2 on the add-on is installed as an extension, before as a legacy add-on.
native/packaging/check runs these commands.
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).parent.parent
SCENE = ROOT / "scenes" / "cornell_box.blend"
IS_EXTENSION = bpy.app.version >= (4, 2, 0)
MODULE = "bl_ext.user_default.raybundle" if IS_EXTENSION else "raybundle"
# The repository of extensions that are installed from files.
REPOSITORY = "user_default"


def install(path: str) -> None:
    """Installs the zip and enables the add-on, also over another version of it."""
    if IS_EXTENSION:
        bpy.ops.extensions.package_install_files(
            filepath=path, repo=REPOSITORY, enable_on_install=True)
    else:
        bpy.ops.preferences.addon_install(filepath=path)
        bpy.ops.preferences.addon_enable(module=MODULE)


def uninstall() -> None:
    if IS_EXTENSION:
        names = [item.module for item in bpy.context.preferences.extensions.repos]
        bpy.ops.extensions.package_uninstall(
            repo_index=names.index(REPOSITORY), pkg_id="raybundle")
    else:
        # The operator redraws the window from which a user starts it.
        with bpy.context.temp_override(area=bpy.context.screen.areas[0]):
            bpy.ops.preferences.addon_remove(module=MODULE)


def version() -> str:
    """Returns the version of the enabled add-on, which is also that of its library."""
    module = importlib.import_module(MODULE)
    native = importlib.import_module(MODULE + ".native")
    found = native.version()
    if not IS_EXTENSION:  # an extension has its version in the manifest
        assert module.bl_info["version"] == tuple(map(int, found.split("."))), found
    return found


def bake() -> np.ndarray:
    """Bakes the scene by the operator. Returns the light at the corners of all objects."""
    bpy.ops.wm.open_mainfile(filepath=str(SCENE))
    assert bpy.ops.raybundle.bake() == {'FINISHED'}
    name = bpy.context.scene.raybundle.attribute
    light = []
    for item in sorted(bpy.data.objects, key=lambda item: item.name):
        if item.type == 'MESH' and name in item.data.color_attributes:
            data = item.data.color_attributes[name].data
            colors = np.empty((len(data), 4), np.float32)
            data.foreach_get('color', colors.ravel())
            light.append(colors[:, :3])
    return np.concatenate(light)


def live(path: str, older: str) -> None:
    """Tests the life of an installed add-on: update, disable, enable, remove."""
    install(older)
    assert importlib.import_module(MODULE + ".native").IS_OLDER
    assert bake().max() > 0.0
    install(path)
    # Blender has loaded all modules of the new version, and none of the old one is left.
    assert not hasattr(importlib.import_module(MODULE + ".native"), 'IS_OLDER')
    folder = Path(importlib.import_module(MODULE).__file__).parent
    assert not (folder / "only_in_the_older.py").exists()
    assert bake().max() > 0.0
    print("updated to", version())

    # Scripts find the module as docs/scripting.md says.
    name = next(name for name in bpy.context.preferences.addons.keys()
                if name.split(".")[-1] == "raybundle")
    assert name == MODULE and callable(importlib.import_module(name).bake)
    bpy.ops.preferences.addon_disable(module=MODULE)
    assert not hasattr(bpy.types.Scene, "raybundle")
    bpy.ops.preferences.addon_enable(module=MODULE)
    assert bake().max() > 0.0
    uninstall()
    assert not folder.exists() and not hasattr(bpy.types.Scene, "raybundle")


def fail(text: str) -> None:
    try:
        bake()
    except RuntimeError as error:
        assert text in str(error), error
    else:
        raise AssertionError("the bake did not fail")


def main() -> None:
    command, *arguments = sys.argv[sys.argv.index("--") + 1:]
    if command == "life":
        live(*arguments)
    elif command == "install":
        install(*arguments)
    elif command == "source":
        sys.path.insert(0, str(ROOT / "addon"))
        importlib.import_module("raybundle").register()
        np.save(arguments[0], bake())
    else:
        bpy.ops.preferences.addon_enable(module=MODULE)
        if command == "fail":
            fail(*arguments)
        else:
            expected = np.load(arguments[0])
            print("difference", np.abs(bake() - expected).max() / expected.max())


if __name__ == "__main__":
    main()
