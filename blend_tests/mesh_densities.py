# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface error of Raybundle's reconstructions and of Cycles' vertex bake, by mesh density.

    blender -b --factory-startup -P blend_tests/mesh_densities.py -- \\
        [--scenes NAME ...] [--densities 0.5 1 2] [--samples 128] [--seeds 2] \\
        [--set name=value ...] [--out FILE.json]

Builds each scene with its number of cells along every edge multiplied by each density. Bakes
LIGHTING with Raybundle (each `reconstruction`) and with Cycles (all bounces, no denoising) at the
same corners. Interpolates both over the faces and compares them with Cycles at points inside the
faces. The error is the relative RMSE over RGB of all objects, weighted by area.

The noise of Cycles is eliminated, so that few samples suffice. Its two references and its two bakes
are independent. The mean product of the difference of the first bake from the first reference and
that of the second bake from the second reference is the square of the error that remains with
infinitely many samples. The noise of 4096 samples is then added to the bake of Cycles. It follows
from the difference of the two bakes, since its variance is inversely proportional to the number of
samples. Prints a table in Markdown. --out appends one line of JSON for each scene and density.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).parent
ROOT = HERE.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "scenes"), str(HERE)]
sys.dont_write_bytecode = True

import command_line  # noqa: E402
import raybundle  # noqa: E402
from benchmark import bake_cycles, bake_raybundle  # noqa: E402
from cycles_reference import bakeable_objects  # noqa: E402
from raybundle.properties import assign  # noqa: E402
from surface_reference import Light, SurfaceReference  # noqa: E402

CYCLES_SAMPLES = 4096  # number of samples whose noise is stated


def scene_builder():
    """Returns the module scenes/build.py.

    Its file is loaded by its path, because a package beside it has the same name.
    """
    spec = importlib.util.spec_from_file_location("scene_builder", ROOT / "scenes/build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def make_plain() -> None:
    """Gives every visible object, instances included, a mesh of its own without modifiers."""
    bpy.ops.object.select_all(action='SELECT')
    bpy.ops.object.duplicates_make_real()
    bpy.ops.object.select_all(action='SELECT')
    bpy.ops.object.make_single_user(object=True, obdata=True)
    for item in bpy.context.view_layer.objects:
        item.select_set(item.type == 'MESH')
        if item.type == 'MESH':
            bpy.context.view_layer.objects.active = item
    bpy.ops.object.convert(target='MESH')


def compare(options: argparse.Namespace) -> dict[str, float]:
    """Returns the relative RMSE of each method in the open scene."""
    settings = bpy.context.scene.raybundle
    settings.output = 'LIGHTING'
    for assignment in options.set:
        key, _, value = assignment.partition("=")
        assign(settings, key, value)
    objects = bakeable_objects(bpy.context)
    references = [SurfaceReference(objects, options.samples, seed) for seed in (0, 1)]
    errors: dict[str, float] = {}
    for kind in settings.bl_rna.properties["reconstruction"].enum_items.keys():
        settings.reconstruction = kind
        squares = []
        for settings.seed in range(options.seeds):
            light = bake_raybundle(objects)[1]
            squares.append(squared_error(references, [light, light]))
        errors[kind] = float(np.sqrt(np.median(squares)))
    lights = [bake_cycles(objects, options.samples, seed)[1] for seed in (2, 3)]
    limit = squared_error(references, lights)
    noise = squared_noise(references[0], lights) * options.samples / CYCLES_SAMPLES
    errors[f"Cycles, {CYCLES_SAMPLES} samples"] = float(np.sqrt(limit + noise))
    errors["Cycles without noise"] = float(np.sqrt(limit))
    return errors


def squared_error(references: Sequence[SurfaceReference], lights: Sequence[Light]) -> float:
    """Returns the relative squared error of a light without the noise of lights and references.

    lights: two independent lights, or one light twice. references: two independent references.
    """
    product = scale = 0.0
    for name in lights[0]:
        parts = [reference.points(name, light[name])
                 for reference, light in zip(references, lights)]
        area = np.minimum(parts[0][2], parts[1][2])
        off = [shown - truth for shown, truth, _ in parts]
        product += area @ (off[0] * off[1]).sum(axis=1)
        scale += area @ (parts[0][1] * parts[1][1]).sum(axis=1)
    return max(0.0, product / scale)


def squared_noise(reference: SurfaceReference, lights: Sequence[Light]) -> float:
    """Returns the relative squared noise of each of two independent bakes."""
    noise = scale = 0.0
    for name in lights[0]:
        (first, truth, area), (second, _, _) = (reference.points(name, light[name])
                                                for light in lights)
        noise += area @ ((first - second) ** 2).sum(axis=1) / 2
        scale += area @ (truth ** 2).sum(axis=1)
    return noise / scale


def run_scene(builder, name: str, density: float, options: argparse.Namespace) -> dict:
    with tempfile.TemporaryDirectory() as folder:
        path = builder.build_scene(name, Path(folder), density)
        bpy.ops.wm.open_mainfile(filepath=str(path))
        make_plain()
        errors = compare(options)
    return {"scene": name, "density": density, "samples": options.samples,
            "settings": options.set, "errors": errors}


def table_row(result: dict) -> str:
    return (f"| `{result['scene']}` | {result['density']:g} | "
            + " | ".join(f"{100 * error:.2f} %" for error in result["errors"].values()) + " |")


def main(arguments: Sequence[str]) -> None:
    builder = scene_builder()
    parser = command_line.parser(__file__, __doc__)
    parser.add_argument("--scenes", nargs="+", default=builder.SCENES, choices=builder.SCENES)
    parser.add_argument("--densities", nargs="+", type=float, default=[0.5, 1.0, 2.0])
    parser.add_argument("--samples", type=int, default=128,
                        help="of each of Cycles' two references and two bakes")
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
    main(command_line.arguments())
