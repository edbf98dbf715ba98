# SPDX-License-Identifier: GPL-3.0-or-later
"""Raybundle: global illumination in vertex colours, computed by bundles of parallel global lines.

Scripts call raybundle.bake(bpy.context, ...), which returns a BakeReport and raises BakeError or
RaybundleError.
"""

import atexit
import sys

import bpy

# After an update in the same session, Blender before 4.2 runs only this file again. Forget the
# other modules, which are those of the old version, and their names here.
for _name in [name for name in sys.modules if name.startswith(f"{__name__}.")]:
    del sys.modules[_name]
    globals().pop(_name[len(__name__) + 1:], None)

from . import (bake_cache, bake_run, error_view, export_operators, export_panels,  # noqa: E402
               live_light, menus, object_roles, operators, panels, preferences, presets,
               properties, report_panel, report_remedies, translations)
from .bake import bake  # noqa: E402
from .bake_report import BakeError, BakeReport  # noqa: E402
from .native import RaybundleError  # noqa: E402

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

# In the order of registration: panels refer to operators and properties.
_MODULES = (translations, preferences, properties, bake_cache, bake_run, live_light, operators,
            export_operators, report_remedies, error_view, object_roles, presets, panels,
            report_panel, export_panels, menus)


def register() -> None:
    for module in _MODULES:
        module.register()
    # Blender as a Python module (4.2) frees the classes of panels after Python has ended, which
    # crashes. Therefore unregister the classes while Python is still running.
    if not bpy.app.binary_path:
        atexit.register(unregister)


def unregister() -> None:
    atexit.unregister(unregister)
    # Blender as a Python module also disables its add-ons when Python ends, after the above.
    if not hasattr(bpy.types.Scene, "raybundle"):
        return
    for module in reversed(_MODULES):
        module.unregister()
