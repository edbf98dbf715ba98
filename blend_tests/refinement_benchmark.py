# SPDX-License-Identifier: GPL-3.0-or-later
r"""Run time against error with refinement and without, interleaved in one run.

    blender -b --factory-startup -P blend_tests/refinement_benchmark.py -- SCENE [SCENE ...]

Errors are relative RMSEs of the baked corners, weighted by area, against a bake with patches of
half the size and 1024 bundles: the noise and what larger patches do, without what the mesh itself
cannot show. Per scene and refinement a row of: seconds, error, stated error (of noise and
discretisation), patches and bundles at falling targets, each the median over the seeds.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent / "addon"), str(HERE)]
sys.dont_write_bytecode = True

import raybundle  # noqa: E402
from cycles_reference import bakeable_objects  # noqa: E402
from raybundle import bake_cache  # noqa: E402
from surface_error import (corner_areas, read_colors, surface_error,  # noqa: E402
                           world_positions)

SCENES = HERE.parent / "scenes"
TARGETS = (0.08, 0.04, 0.02, 0.01)
SEEDS = range(3)
REFERENCE_BUNDLES, REFERENCE_SEED = 1024, 77
# The automatic patch size is a 64th of the diagonal.
REFERENCE_SHARE = 1 / 128
# Here it is far less on small objects, and half of it everywhere would be too many patches: no
# errors but the stated one.
WITHOUT_REFERENCE = ("house_on_plain", "laid_table")


def bake(settings, **values) -> tuple[float, dict]:
    for name, value in values.items():
        setattr(settings, name, value)
    bake_cache.discard_all()
    started = time.perf_counter()
    if bpy.ops.raybundle.bake() != {'FINISHED'}:
        sys.exit("the bake was cancelled")
    return time.perf_counter() - started, json.loads(settings.report)


def run_scene(name: str) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(SCENES / f"{name}.blend"))
    settings = bpy.context.scene.raybundle
    settings.output = 'LIGHTING'
    objects = bakeable_objects(bpy.context)
    weights = np.concatenate([corner_areas(item) for item in objects])

    def light() -> np.ndarray:
        return np.concatenate([read_colors(item) for item in objects])

    positions = np.concatenate([world_positions(item) for item in objects])
    diagonal = float(np.linalg.norm(np.ptp(positions, axis=0)))
    reference = None
    if name not in WITHOUT_REFERENCE:
        bake(settings, refine=False, patch_size=diagonal * REFERENCE_SHARE, target_error=1e-4,
             max_bundles=REFERENCE_BUNDLES, seed=REFERENCE_SEED)
        reference = light()
    settings.patch_size, settings.max_bundles = 0.0, 4096

    rows: dict[tuple[bool, float], list] = {}
    for seed in SEEDS:
        for target in TARGETS:
            for refine in (False, True):
                seconds, report = bake(settings, seed=seed, target_error=target, refine=refine)
                error = np.nan if reference is None else surface_error(
                    light(), reference, weights).rmse
                stated = np.hypot(report["error"]["noise"], report["error"]["discretisation"])
                rows.setdefault((refine, target), []).append(
                    (seconds, 100 * error, 100 * stated, report["patches"], report["bundles"]))
    for refine in (False, True):
        parts = ("{:.3f} s {:.2f} % (stated {:.2f} %) {:.0f} patches {:.0f} bundles".format(
            *np.median(rows[refine, target], axis=0)) for target in TARGETS)
        print(f"{name} refine={refine}: " + " | ".join(parts), flush=True)


if __name__ == "__main__":
    raybundle.register()
    for scene in sys.argv[sys.argv.index("--") + 1:]:
        run_scene(scene)
