# SPDX-License-Identifier: GPL-3.0-or-later
"""Time of the first shot and error of bakes of a room, by the number of its lamps.

    blender -b --factory-startup -P blend_tests/many_lamps.py -- [--lamps 10 100 1000]

The room has 40 x 40 x 5 m and 64 boxes. Its point lamps hang in a grid and have the same power in
all, however many they are. The difference is that from a bake with a target of 0.4 % and another
seed: relative, RMS over the corners of all objects and RGB. Prints a table in Markdown.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).parent
ROOT = HERE.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "scenes"), str(HERE)]
sys.dont_write_bytecode = True

import raybundle  # noqa: E402
from build.construction import (  # noqa: E402
    Diffuse, add_mesh, add_point_light, box, material, room, set_world)
from surface_error import read_colors  # noqa: E402

POWER = 40000.0  # of all lamps together, W


def make_room(lamps: int) -> None:
    """Builds the room in an empty file."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    paint = material("paint", Diffuse((0.6, 0.6, 0.6)))
    for name, side in room((40, 40, 5), (40, 40, 5)).items():
        add_mesh(name, side, paint)
    for index in range(64):
        row, column = divmod(index, 8)
        shape = box((1.2, 1.2, 1.5), (4, 4, 5)).turned(10 * row + column)
        add_mesh(f"box_{index}", shape.moved((5 * (row - 3.5), 5 * (column - 3.5), 0)), paint)
    across = math.ceil(math.sqrt(lamps))
    for index in range(lamps):
        row, column = divmod(index, across)
        at = (38 / across * (column + 0.5) - 19, 38 / across * (row + 0.5) - 19, 4.5)
        add_point_light(f"lamp_{index}", at, power=POWER / lamps, radius=0.05)
    set_world()


def baked(**settings: object) -> tuple[raybundle.BakeReport, np.ndarray]:
    """Bakes the open scene. Returns the report and (corners, 3) light of all objects."""
    report = raybundle.bake(bpy.context, output='LIGHTING', **settings)
    light = [read_colors(item) for item in bpy.data.objects if item.type == 'MESH']
    return report, np.concatenate(light)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lamps", type=int, nargs="+", default=[10, 100, 1000])
    arguments = parser.parse_args(sys.argv[sys.argv.index("--") + 1:]
                                  if "--" in sys.argv else [])
    raybundle.register()
    print("| lamps | first shot, s | shadow rays | difference |\n|---|---|---|---|")
    for lamps in arguments.lamps:
        make_room(lamps)
        report, light = baked()
        _, reference = baked(target_error=0.004, seed=5)
        difference = np.sqrt(np.mean((light - reference) ** 2) / np.mean(reference ** 2))
        print(f"| {lamps} | {report.seconds['first_shot']:.2f} | {report.shadow_rays / 1e6:.1f} "
              f"million | {difference:.2%} |")


if __name__ == "__main__":
    main()
