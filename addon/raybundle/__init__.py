# SPDX-License-Identifier: GPL-3.0-or-later
"""Raybundle: global illumination in vertex colours, by bundles of parallel global lines.

From Python: raybundle.bake(bpy.context, ...) -> BakeReport.
"""

import atexit

import bpy

from . import bake_cache, operators, panels, properties
from .bake import bake
from .bake_report import BakeError, BakeReport
from .native import RaybundleError

__all__ = ('BakeError', 'BakeReport', 'RaybundleError', 'bake', 'register', 'unregister')

bl_info = {
    "name": "Raybundle",
    "description": "Bake direct and indirect light into vertex colours by radiosity",
    "author": "The Raybundle developers",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Properties > Render > Raybundle; 3D View > Sidebar > Raybundle",
    "category": "Render",
}


def register() -> None:
    properties.register()
    bake_cache.register()
    operators.register()
    panels.register()
    # Blender as a module frees the classes of panels when Python has ended, and crashes by it (4.2).
    if not bpy.app.binary_path:
        atexit.register(unregister)


def unregister() -> None:
    atexit.unregister(unregister)
    panels.unregister()
    operators.unregister()
    bake_cache.unregister()
    properties.unregister()
