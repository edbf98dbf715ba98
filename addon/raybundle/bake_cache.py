# SPDX-License-Identifier: GPL-3.0-or-later
"""The native bake of each scene, kept until the file is closed.

A native bake contains the patches and the traced lines, so that a bake after a change of lights or
colours only needs to solve again. The native library itself compares the geometry with that of the
last bake.
"""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent

from . import native
from .materials import cycles_bake

# By full name of the scene.
_bakes: dict[str, native.Bake] = {}


def get_or_create(scene: bpy.types.Scene) -> native.Bake:
    """Returns the scene's native bake, which this module owns. Raises RaybundleError if the library
    cannot be loaded."""
    if scene.name_full not in _bakes:
        _bakes[scene.name_full] = native.Bake()
    return _bakes[scene.name_full]


def has_result(scene: bpy.types.Scene) -> bool:
    """Returns whether the scene was baked since the file was opened."""
    bake = _bakes.get(scene.name_full)
    if bake is None:
        return False
    try:
        bake.report()
    except native.RaybundleError:
        return False
    return True


def discard(scene: bpy.types.Scene) -> None:
    """Closes the scene's native bake, if it has one."""
    bake = _bakes.pop(scene.name_full, None)
    if bake is not None:
        bake.close()


def discard_all() -> None:
    """Closes all native bakes and discards the images of materials that Cycles has baked."""
    cycles_bake.discard_all()
    for bake in _bakes.values():
        bake.close()
    _bakes.clear()


@persistent
def _on_load(*_arguments: object) -> None:
    # In the next file, these names may belong to other scenes.
    discard_all()


def register() -> None:
    bpy.app.handlers.load_pre.append(_on_load)


def unregister() -> None:
    bpy.app.handlers.load_pre.remove(_on_load)
    discard_all()
