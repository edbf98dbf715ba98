# SPDX-License-Identifier: GPL-3.0-or-later
r"""Surface error of Raybundle's reconstructions and of Cycles' vertex bake on coarse and fine meshes.

    blender -b --factory-startup -P blend_tests/mesh_densities.py -- \
        [--scenes NAME ...] [--densities 0.5 1 2] [--samples 4096] [--reference 2048] \
        [--seeds 2] [--set name=value ...] [--out FILE.json]

Builds each scene with so many times the cells along every edge, bakes LIGHTING with Raybundle (each
`reconstruction`) and with Cycles (--samples, every bounce, no denoising) at the same corners, and
compares both, interpolated over the faces, with Cycles at points inside the faces (--reference
samples): relative RMSE over RGB, weighted by area, over all objects. Prints a table in Markdown;
--out appends one line of JSON per scene and density. With the default samples all scenes take more
than an hour on 2 cores.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).parent
ROOT = HERE.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "scenes"), str(HERE)]
sys.dont_write_bytecode = True

import raybundle  # noqa: E402
from benchmark import SurfaceReference, bake_cycles, bake_raybundle  # noqa: E402
from cycles_reference import bakeable_objects  # noqa: E402
from raybundle.properties import checked_value  # noqa: E402
from surface_error import SurfaceError  # noqa: E402

CYCLES = "Cycles"


def scene_builder():
    """The module scenes/build.py (a package of the same name lies beside it)."""
    spec = importlib.util.spec_from_file_location("scene_builder", ROOT / "scenes/build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def compare(options: argparse.Namespace) -> dict[str, list[SurfaceError]]:
    """Of the scene that is open: errors of each contestant, seed by seed."""
    settings = bpy.context.scene.raybundle
    settings.output = 'LIGHTING'
    for assignment in options.set:
        key, _, value = assignment.partition("=")
        setattr(settings, key, checked_value(key, value))
    objects = bakeable_objects(bpy.context)
    reference = SurfaceReference(objects, options.reference)
    errors: dict[str, list[SurfaceError]] = {}
    kinds = settings.bl_rna.properties["reconstruction"].enum_items.keys()
    for seed in range(options.seeds):
        settings.seed = seed
        for kind in kinds:
            settings.reconstruction = kind
            errors.setdefault(kind, []).append(reference.error(bake_raybundle(objects)[1]))
    # The reference has seed 0; noise of so many samples is far below the error of point samples.
    errors[CYCLES] = [reference.error(bake_cycles(objects, options.samples, 1)[1])]
    return errors


def run_scene(builder, name: str, density: float, options: argparse.Namespace) -> dict:
    with tempfile.TemporaryDirectory() as folder:
        path = builder.build_scene(name, Path(folder), density)
        bpy.ops.wm.open_mainfile(filepath=str(path))
        errors = compare(options)
    return {"scene": name, "density": density, "samples": options.samples,
            "reference_samples": options.reference, "settings": options.set,
            "errors": {key: [asdict(error) for error in entry] for key, entry in errors.items()}}


def table_row(result: dict) -> str:
    medians = {key: 100 * float(np.median([error["rmse"] for error in entry]))
               for key, entry in result["errors"].items()}
    return (f"| `{result['scene']}` | {result['density']:g} | "
            + " | ".join(f"{value:.2f} %" for value in medians.values()) + " |")


def main(arguments: Sequence[str]) -> None:
    builder = scene_builder()
    parser = argparse.ArgumentParser(prog="mesh_densities.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", nargs="+", default=builder.SCENES, choices=builder.SCENES)
    parser.add_argument("--densities", nargs="+", type=float, default=[0.5, 1.0, 2.0])
    parser.add_argument("--samples", type=int, default=4096, help="of Cycles' vertex bake")
    parser.add_argument("--reference", type=int, default=2048, metavar="SAMPLES")
    parser.add_argument("--seeds", type=int, default=2, help="of Raybundle; the median counts")
    parser.add_argument("--set", nargs="+", action="extend", default=[], metavar="name=value",
                        help="settings of scene.raybundle")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args(arguments)
    raybundle.register()
    rows = []
    for name in options.scenes:
        for density in options.densities:
            result = run_scene(builder, name, density, options)
            if not rows:
                columns = ["scene", "cells along an edge", *result["errors"]]
                rows += ["| " + " | ".join(columns) + " |", "|---" * len(columns) + "|"]
                print("\n".join(rows))
            rows.append(table_row(result))
            print(rows[-1], flush=True)
            if options.out:
                with options.out.open("a") as file:
                    file.write(json.dumps(result) + "\n")


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])
