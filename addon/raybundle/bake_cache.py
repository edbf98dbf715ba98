# SPDX-License-Identifier: GPL-3.0-or-later
"""The native bake of each scene, kept for the session.

It holds the patches and the traced lines, so that a bake after a change of lights or colours only
solves anew. Whether the geometry is still the same is the native library's own comparison.
"""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent

from . import native
from .materials import cycles_bake

_bakes: dict[str, native.Bake] = {}


def get_or_create(scene: bpy.types.Scene) -> native.Bake:
    if scene.name_full not in _bakes:
        _bakes[scene.name_full] = native.Bake()
    return _bakes[scene.name_full]


def has_result(scene: bpy.types.Scene) -> bool:
    """Whether the scene was baked since the file was opened."""
    bake = _bakes.get(scene.name_full)
    if bake is None:
        return False
    try:
        bake.report()
    except native.RaybundleError:
        return False
    return True


def discard(scene: bpy.types.Scene) -> None:
    bake = _bakes.pop(scene.name_full, None)
    if bake is not None:
        bake.close()


def discard_all() -> None:
    cycles_bake.discard_all()
    for bake in _bakes.values():
        bake.close()
    _bakes.clear()


@persistent
def _on_load(*_arguments: object) -> None:
    # The names of scenes mean other scenes now.
    discard_all()


def register() -> None:
    bpy.app.handlers.load_pre.append(_on_load)


def unregister() -> None:
    bpy.app.handlers.load_pre.remove(_on_load)
    discard_all()
