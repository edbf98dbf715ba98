# SPDX-License-Identifier: GPL-3.0-or-later
r"""Compares run time and error without and with the cuts of a setting, in turns.

    blender -b --factory-startup -P blend_tests/cuts_benchmark.py -- contacts|refine \
        SCENE [SCENE ...]

Errors are relative RMSEs of the baked corners, weighted by area, against a bake with patches of
half the size and 1024 bundles. They consist of noise and of the error of larger patches, but not of
what the mesh itself cannot show. In house_on_plain and laid_table, patches of half the size
everywhere would be too many. There the error is the surface error of the small objects against
Cycles, without the noise of Cycles. For each scene and value of the setting, a row shows seconds,
error, stated error (noise and discretisation), patches and bundles at decreasing targets, each as
the median over the seeds.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent / "addon"), str(HERE), str(HERE.parent / "scenes")]
sys.dont_write_bytecode = True

import raybundle  # noqa: E402
import small_objects  # noqa: E402
from cycles_reference import bakeable_objects  # noqa: E402
from mesh_densities import squared_error  # noqa: E402
from raybundle import bake_cache  # noqa: E402
from surface_error import (corner_areas, read_colors, surface_error,  # noqa: E402
                           world_positions)
from surface_reference import SurfaceReference  # noqa: E402

SCENES = HERE.parent / "scenes"
SWITCHES = ("contacts", "refine")
TARGETS = (0.08, 0.04, 0.02, 0.01)
SEEDS = range(3)
REFERENCE_BUNDLES, REFERENCE_SEED = 1024, 77
# Share of the diagonal. The automatic patch size is a 64th of the diagonal.
REFERENCE_SHARE = 1 / 128
CYCLES_SAMPLES = 256


def bake(settings, **values) -> tuple[float, dict]:
    for name, value in values.items():
        setattr(settings, name, value)
    bake_cache.discard_all()
    started = time.perf_counter()
    if bpy.ops.raybundle.bake() != {'FINISHED'}:
        sys.exit("the bake was cancelled")
    return time.perf_counter() - started, json.loads(settings.report)


def error_against_cycles(objects) -> Callable[[], float]:
    references = [SurfaceReference(objects, CYCLES_SAMPLES, seed) for seed in (0, 1)]

    def error() -> float:
        light = {item.name: read_colors(item) for item in objects}
        return squared_error(references, [light, light]) ** 0.5

    return error


def error_against_finer_patches(settings, objects) -> Callable[[], float]:
    weights = np.concatenate([corner_areas(item) for item in objects])

    def light() -> np.ndarray:
        return np.concatenate([read_colors(item) for item in objects])

    positions = np.concatenate([world_positions(item) for item in objects])
    diagonal = float(np.linalg.norm(np.ptp(positions, axis=0)))
    bake(settings, refine=False, patch_size=diagonal * REFERENCE_SHARE, target_error=1e-4,
         max_bundles=REFERENCE_BUNDLES, seed=REFERENCE_SEED)
    settings.patch_size, settings.max_bundles = 0.0, 4096
    reference = light()
    return lambda: surface_error(light(), reference, weights).rmse


def run_scene(switch: str, name: str) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(SCENES / f"{name}.blend"))
    settings = bpy.context.scene.raybundle
    settings.output = 'LIGHTING'
    if name in small_objects.LARGE:
        error = error_against_cycles(small_objects.small_objects(name))
    else:
        error = error_against_finer_patches(settings, bakeable_objects(bpy.context))

    rows: dict[tuple, list] = {}
    for seed in SEEDS:
        for target in TARGETS:
            for value in (False, True):
                seconds, report = bake(settings, seed=seed, target_error=target, **{switch: value})
                stated = np.hypot(report["error"]["noise"], report["error"]["discretisation"])
                rows.setdefault((value, target), []).append(
                    (seconds, 100 * error(), 100 * stated, report["patches"], report["bundles"]))
    for value in (False, True):
        parts = ("{:.3f} s {:.2f} % (stated {:.2f} %) {:.0f} patches {:.0f} bundles".format(
            *np.median(rows[value, target], axis=0)) for target in TARGETS)
        print(f"{name} {switch}={value}: " + " | ".join(parts), flush=True)


if __name__ == "__main__":
    raybundle.register()
    chosen, *scenes = sys.argv[sys.argv.index("--") + 1:]
    if chosen not in SWITCHES:
        sys.exit(f"{chosen} is none of {SWITCHES}")
    for scene in scenes:
        run_scene(chosen, scene)
