# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures error and time of small objects in large scenes: a house on a plain, a table in a hall.

    blender -b --factory-startup -P blend_tests/small_objects.py -- \\
        [--target 0.01] [--seeds 2] [--factor 10] [--runs 3] [--samples 1024]

Errors are relative RMSEs of LIGHTING over RGB by area, at the corners of the small objects only,
with each of two reconstructions:

noise     against the same patches with --factor times the bundles (4096 at most) and another seed:
          at all corners, hidden ones included; at the vertices off contact edges; and as it is
          seen, which is interpolated over the faces, at points inside them that nothing covers
vertices  against Cycles at the vertices off contact edges
surface   interpolated over the faces, against Cycles at points inside them; beside it the error of
          Cycles' own vertex bake without noise

The noise of Cycles is eliminated as in mesh_densities.py. The last column is the time of a bake
divided by that of the same small objects without the large surroundings (the plain cut to 18 m, or
a hall of 5 x 6 x 3.2 m), run in turns, as medians of --runs. Prints a table in Markdown.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import bmesh
import bpy
import numpy as np

HERE = Path(__file__).parent
ROOT = HERE.parent
sys.path[:0] = [str(ROOT / "addon"), str(HERE)]
sys.dont_write_bytecode = True

import command_line  # noqa: E402
import raybundle  # noqa: E402
from benchmark import bake_cycles, bake_raybundle  # noqa: E402
from cycles_reference import bakeable_objects  # noqa: E402
from mesh_densities import squared_error  # noqa: E402
from surface_error import (corner_areas, is_defined, off_contact_edges,  # noqa: E402
                           surface_error)
from surface_reference import Light, SurfaceReference  # noqa: E402

# Names of the large and of the small objects begin with these texts.
LARGE = {"house_on_plain": ("plain",), "laid_table": ("floor", "ceiling", "wall_", "lamp_")}
SMALL = {"house_on_plain": ("",),
         "laid_table": ("plate", "cup", "fork", "knife", "candlestick")}
RECONSTRUCTIONS = ("LEAST_SQUARES", "POINT")


def small_objects(scene: str) -> list[bpy.types.Object]:
    return [item for item in bakeable_objects(bpy.context)
            if item.name.startswith(SMALL[scene]) and not item.name.startswith(LARGE[scene])]


def cut(scene: str) -> None:
    """Removes the large surroundings from the open scene."""
    if scene == "house_on_plain":
        mesh = bpy.data.objects["plain"].data
        shape = bmesh.new()
        shape.from_mesh(mesh)
        far = [vertex for vertex in shape.verts if max(map(abs, vertex.co[:2])) > 9.0]
        bmesh.ops.delete(shape, geom=far, context='VERTS')
        shape.to_mesh(mesh)
        shape.free()
        return
    for item in list(bpy.data.objects):
        if item.name.startswith(("floor", "ceiling", "wall_")):
            item.scale = (0.25, 0.2, 0.4)
        elif item.name.startswith("lamp_") and item.name != "lamp_table":
            bpy.data.objects.remove(item)


def open_scene(name: str) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / f"scenes/{name}.blend"))
    bpy.context.scene.raybundle.output = 'LIGHTING'


def squared_vertex_error(objects: list[bpy.types.Object], light: Light, references: list[Light]
                         ) -> float:
    """Returns the relative squared error at vertices off contact edges.

    It does not contain the noise of the two independent references.
    """
    off = [{name: light[name] - values for name, values in reference.items()}
           for reference in references]
    return max(0.0, mean_product(objects, off, references))


def mean_product(objects: list[bpy.types.Object], factors: list[Light], references: list[Light]
                 ) -> float:
    """Returns the mean product of two values at the corners off contact edges, by area.

    It is relative to the mean product of the two references.
    """
    off_contacts = off_contact_edges(bakeable_objects(bpy.context))
    product = scale = 0.0
    for item in objects:
        first, second = (reference[item.name] for reference in references)
        area = corner_areas(item) * off_contacts[item.name] * is_defined(item, first)
        product += area @ (factors[0][item.name] * factors[1][item.name]).sum(axis=1)
        scale += area @ (first * second).sum(axis=1)
    return product / scale


def seen_noise(reference: SurfaceReference, found: Light, truth: Light) -> float:
    """Returns the relative RMSE at the points of the reference."""
    noise = scale = 0.0
    for name, values in found.items():
        (shown, _, area), (true, _, _) = (reference.points(name, light[name])
                                          for light in (found, truth))
        noise += area @ ((shown - true) ** 2).sum(axis=1)
        scale += area @ (true ** 2).sum(axis=1)
    return float(np.sqrt(noise / scale))


def time_ratio(name: str, options: argparse.Namespace, reconstruction: str) -> float:
    """Returns the time of a bake divided by its time without the large surroundings."""
    seconds: dict[bool, list[float]] = {False: [], True: []}
    for _ in range(options.runs):
        for is_cut, times in seconds.items():
            open_scene(name)
            if is_cut:
                cut(name)
            bpy.context.view_layer.update()
            settings = bpy.context.scene.raybundle
            settings.target_error, settings.reconstruction = options.target, reconstruction
            times.append(bake_raybundle(small_objects(name))[0])
    return float(np.median(seconds[False]) / np.median(seconds[True]))


def measure(name: str, options: argparse.Namespace) -> list[str]:
    """Returns rows of the table, one for each reconstruction."""
    open_scene(name)
    objects = small_objects(name)
    cycles = [bake_cycles(objects, options.samples, seed)[1] for seed in (2, 3)]
    references = [SurfaceReference(objects, options.samples, seed) for seed in (0, 1)]
    areas = np.concatenate([corner_areas(item) for item in objects])
    rows = []
    for reconstruction in RECONSTRUCTIONS:
        open_scene(name)
        settings = bpy.context.scene.raybundle
        settings.target_error, settings.reconstruction = options.target, reconstruction
        objects = small_objects(name)
        bakes = []
        for settings.seed in range(1, options.seeds + 1):
            bakes.append(bake_raybundle(objects)[1:])
        light, report = bakes[0]
        vertices = squared_vertex_error(objects, light, cycles)
        surface = squared_error(references, [light, light])
        settings.seed, settings.target_error = 7, 1e-5
        settings.max_bundles = min(4096, options.factor * report["bundles"])
        truth = bake_raybundle(objects)[1]
        off_contacts = off_contact_edges(bakeable_objects(bpy.context))
        is_off = np.concatenate([off_contacts[item.name] for item in objects])
        noises = [[surface_error(*(np.concatenate([values[item.name] for item in objects])
                                   for values in (found, truth)), weights).rmse
                   for found, _ in bakes] for weights in (areas, areas * is_off)]
        noises.append([seen_noise(references[0], found, truth) for found, _ in bakes])
        columns = [f"`{name}`", f"`{reconstruction}`", f"{report['bundles']}",
                   f"{report['lines'] / 1e6:.0f} million",
                   *(", ".join(f"{100 * noise:.2f} %" for noise in of) for of in noises),
                   *(f"{100 * square ** 0.5:.2f} %"
                     for square in (vertices, surface, squared_error(references, cycles))),
                   f"{time_ratio(name, options, reconstruction):.1f}"]
        rows.append("| " + " | ".join(columns) + " |")
    return rows


def main(arguments: Sequence[str]) -> None:
    parser = command_line.parser(__file__, __doc__)
    parser.add_argument("--scenes", nargs="+", default=list(LARGE), choices=list(LARGE))
    parser.add_argument("--target", type=float, default=0.01)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--factor", type=int, default=10)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--samples", type=int, default=1024)
    options = parser.parse_args(arguments)
    raybundle.register()
    columns = ["scene", "reconstruction", "bundles", "lines", "noise, by seed",
               "noise off contacts", "noise between corners", "vertices",
               "surface", "Cycles' bake, surface",
               "time relative to a bake without the large surroundings"]
    rows = ["| " + " | ".join(columns) + " |", "|---" * len(columns) + "|"]
    for name in options.scenes:
        rows += measure(name, options)
    print("\n".join(rows))


if __name__ == "__main__":
    main(command_line.arguments())
