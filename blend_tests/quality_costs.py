# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures what Draft, Good and Final cost, and how well the panel estimates it.

    blender -b --factory-startup -P blend_tests/quality_costs.py -- [SCENE ...]

Bakes each scene with each quality, and estimates the times of Draft and Final from the bake with
Good, as the panel does. Prints a table of seconds, and the median and extremes of the ratios of
estimated to measured time. SCENE is the name of a scene in scenes/. By default all scenes are baked
that take less than 10 s with Good.
"""

from __future__ import annotations

import statistics
import sys
from pathlib import Path

import bpy

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent / "addon"), str(HERE)]
sys.dont_write_bytecode = True

import command_line  # noqa: E402
import raybundle  # noqa: E402
from object_light import open_file  # noqa: E402
from raybundle.quality import TARGETS, estimated_seconds  # noqa: E402

SCENES = ("cornell_box", "two_rooms", "big_room", "office", "open_court", "instances", "thin_wall",
          "sphere_interior", "laid_table", "house_on_plain")


def measure(scene: str) -> tuple[dict[str, float], dict[str, float]]:
    """Returns the seconds of a bake and those estimated from Good, both by quality."""
    seconds, estimated = {}, {}
    for name, target in TARGETS.items():
        open_file(scene, 0.0)
        report = raybundle.bake(bpy.context, target_error=target, seed=1)
        seconds[name] = report.seconds['total']
        if name == 'GOOD':
            estimated = {other: estimated_seconds({'full_bake': report.full_bake}, its_target)
                         for other, its_target in TARGETS.items()}
    return seconds, estimated


def main() -> None:
    parser = command_line.parser(__file__, __doc__)
    parser.add_argument("scenes", nargs="*", default=SCENES)
    options = parser.parse_args(command_line.arguments())
    if not hasattr(bpy.types.Scene, "raybundle"):
        raybundle.register()
    ratios: dict[str, list[float]] = {'DRAFT': [], 'FINAL': []}
    print("| scene | Draft | estimated | Good | Final | estimated |\n|---|---|---|---|---|---|")
    for scene in options.scenes:
        seconds, estimated = measure(scene)
        print(f"| `{scene}` | {seconds['DRAFT']:.2f} | {estimated['DRAFT']:.2f} "
              f"| {seconds['GOOD']:.2f} | {seconds['FINAL']:.2f} | {estimated['FINAL']:.2f} |",
              flush=True)
        for name, found in ratios.items():
            found.append(estimated[name] / seconds[name])
    for name, found in ratios.items():
        print(f"{name}: estimated / measured {statistics.median(found):.2f} "
              f"({min(found):.2f} to {max(found):.2f})")


if __name__ == "__main__":
    main()
