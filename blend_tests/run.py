# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs pytest inside Blender, from the repository root:

    blender -b --factory-startup --python-exit-code 1 -P blend_tests/run.py -- [pytest arguments]

or with the Python of an environment that has Blender as the module bpy.
"""

import os
import sys
from pathlib import Path

import bpy
import pytest

arguments = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
here = Path(__file__).parent
# Blender changes sys.argv and the paths. Names this folder unless the arguments name a file in it.
if not any(argument.split("::")[0].endswith(".py") for argument in arguments):
    arguments.append(str(here))
code = pytest.main(["-p", "no:cacheprovider", f"--rootdir={here}", *arguments])
if not bpy.app.binary_path and bpy.app.version < (4, 3, 0):
    # Python crashes when it ends after the glTF exporter of the module bpy 4.2 has run, without
    # Raybundle too. The exit code of the tests would be lost.
    sys.stdout.flush()
    os._exit(code)
sys.exit(code)
