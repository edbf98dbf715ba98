# SPDX-License-Identifier: GPL-3.0-or-later
"""Command lines of the programs in this folder that run inside Blender.

Blender leaves all arguments after `--` to the script that it runs.
"""

import argparse
import sys
from pathlib import Path


def arguments() -> list[str]:
    """Returns the arguments after `--`, or none if there is no `--`."""
    return sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []


def parser(script: str, description: str) -> argparse.ArgumentParser:
    """Returns a parser of a script's arguments.

    script: its `__file__`. description: its `__doc__`, whose line breaks are kept.
    """
    return argparse.ArgumentParser(prog=Path(script).name, description=description,
                                   formatter_class=argparse.RawDescriptionHelpFormatter)
