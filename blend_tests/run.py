# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs pytest inside Blender, from the repository root:

    blender -b --factory-startup --python-exit-code 1 -P blend_tests/run.py -- [pytest arguments]

or with the Python of an environment that has Blender as the module bpy.
"""

import sys
from pathlib import Path

import pytest

arguments = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
here = Path(__file__).parent
# Blender changes sys.argv and the paths. Names this folder unless the arguments name a file in it.
if not any(argument.split("::")[0].endswith(".py") for argument in arguments):
    arguments.append(str(here))
sys.exit(pytest.main(["-p", "no:cacheprovider", f"--rootdir={here}", *arguments]))
