# SPDX-License-Identifier: GPL-3.0-or-later
"""Time and error of bakes of dense meshes, whose faces exchange light in clusters and whose vertices
gather it, and of bakes with a patch for each face.

    blender -b --factory-startup -P blend_tests/dense_surfaces.py -- errors [--scenes room yard]
    blender -b --factory-startup -P blend_tests/dense_surfaces.py -- triangles [--scenes room yard]

Four props of 5,000 to 8,000 faces (a torus, a ball, a subdivided monkey, a ball with flat faces)
stand in five scenes.

`errors` compares them with Cycles. The reference is the mean of two bakes of Cycles, whose
difference gives its noise, which is taken off. Errors are relative, RMS over the corners of a prop
and RGB. The table shows the RMS over the props, the largest ratio of the two errors of a prop, and
in how many of the bakes with gathered light, with different seeds, the error of a prop is at most
the error that its report states.

`triangles` bakes four balls with more and more faces instead, and prints the seconds of the stages
and the power of the number of faces that the sum of the first four grows with.

Prints tables in Markdown.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).parent
ROOT = HERE.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "scenes"), str(HERE)]
sys.dont_write_bytecode = True

import raybundle  # noqa: E402
from build.construction import (  # noqa: E402
    Diffuse, Shape, add_area_light, add_mesh, add_point_light, add_sun, grid, material, room,
    set_sky, set_world, smooth, uv_sphere)
from cycles_reference import bake_objects  # noqa: E402
from surface_error import read_colors  # noqa: E402

PROPS = ("torus", "ball", "monkey", "flat")
SCENES = ("room", "lamps", "window", "yard", "dune")
SEEDS = range(1, 5)  # of the bakes with gathered light
STAGES = ("patches", "first_shot", "bundles", "solve")


def _finish(name: str, paint: bpy.types.Material, is_smooth: bool = True) -> None:
    prop = bpy.context.object
    prop.name = name
    prop.data.polygons.foreach_set("use_smooth", [is_smooth] * len(prop.data.polygons))
    prop.data.materials.append(paint)


def add_props() -> None:
    """Adds the four props to the open scene."""
    paint = material("props", Diffuse((0.7, 0.2, 0.15)))
    bpy.ops.mesh.primitive_torus_add(major_segments=100, minor_segments=50, major_radius=0.5,
                                     minor_radius=0.2, location=(-1, -0.6, 0.2))
    _finish("torus", paint)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=100, ring_count=50, radius=0.4,
                                         location=(0.8, 0.7, 0.4))
    _finish("ball", paint)
    bpy.ops.mesh.primitive_monkey_add(size=1.0, location=(0.7, -0.9, 0.55))
    bpy.context.object.modifiers.new("Subdivision", 'SUBSURF').levels = 2
    bpy.ops.object.modifier_apply(modifier="Subdivision")
    _finish("monkey", paint)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5, radius=0.35, location=(-0.9, 1.0, 0.35))
    _finish("flat", paint, is_smooth=False)


def add_balls(faces: int) -> None:
    """Adds four balls that together have about this number of faces."""
    paint = material("props", Diffuse((0.7, 0.2, 0.15)))
    around, rings = round(math.sqrt(faces / 2)), round(math.sqrt(faces / 8))
    for number, place in enumerate(((-1, -0.6), (0.8, 0.7), (0.7, -0.9), (-0.9, 1.0))):
        ball = uv_sphere(0.4, around, rings, (*place, 0.4))
        smooth(add_mesh(f"ball{number}", ball, paint).data)


def make_scene(name: str) -> None:
    """Builds one of SCENES, without props, in an empty file.

    They are a closed room with two lamps, one with twelve, one that is open to the sky on one side,
    and a floor and a dune under a sun and a sky.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    paint = material("paint", Diffuse((0.7, 0.65, 0.6)))
    for side, mesh in room((4, 4, 3), (24, 24, 18)).items():
        if {"window": side != "wall_west", "yard": side == "floor", "dune": False}.get(name, True):
            add_mesh(side, mesh, paint)
    if name == "dune":
        flat = grid((-8, -8, 0), (16, 0, 0), (0, 16, 0), 200, 200)
        x, y = flat.vertices[:, 0], flat.vertices[:, 1]
        high = 0.3 * np.sin(0.9 * x + 0.4) * np.cos(0.7 * y) - 0.3
        smooth(add_mesh("dune", Shape(np.stack([x, y, high], axis=1), flat.blocks), paint).data)
    if name in ("room", "lamps"):
        set_world()
    else:
        set_sky()
    if name == "room":
        add_area_light("panel", (0, 0, 2.9), (0, 0, 0), (0.6, 0.6), power=60)
        add_point_light("lamp", (1.5, -1.5, 2.0), power=30, radius=0.05)
    elif name == "lamps":
        for number in range(12):
            turn = number * math.tau / 12
            place = (1.7 * math.cos(turn), 1.7 * math.sin(turn), 1.0 + 0.15 * number)
            add_point_light(f"lamp{number}", place, power=2 + number, radius=0.04)
    elif name in ("yard", "dune"):
        add_sun("sun", towards=(0.3, -0.5, 0.8), irradiance=2.0, colour=(1.0, 0.95, 0.85))


def error_of(light: np.ndarray, reference: Sequence[np.ndarray]) -> float:
    """Returns the relative RMS error of (corners, 3) light, less the noise of two references."""
    truth = (reference[0] + reference[1]) / 2
    noise = np.mean((reference[0] - reference[1]) ** 2) / 4
    square = np.mean((light - truth) ** 2) - noise
    return math.sqrt(max(square, 0.0) / np.mean(truth ** 2))


def print_errors(names: Sequence[str], samples: int) -> None:
    print("| scene | patches | time | error | patches, gathered | time | error | largest ratio |"
          " stated |\n|---|---|---|---|---|---|---|---|---|", flush=True)
    held = bakes = 0
    for name in names:
        make_scene(name)
        add_props()
        props = [bpy.data.objects[prop] for prop in PROPS]
        row, errors, stated = [name], {}, []
        for gathers in (False, True):
            for seed in SEEDS if gathers else (1,):
                report = raybundle.bake(bpy.context, output='LIGHTING', final_gather=gathers,
                                        seed=seed)
                light = [read_colors(prop) for prop in props]
                errors.setdefault(gathers, []).append(light)
                if gathers:
                    totals = {item.name: item.error['total'] for item in report.objects}
                    stated.append([totals[prop] for prop in PROPS])
            row += [f"{report.patches:,}", f"{report.seconds['total']:.1f} s", ""]
        references = [bake_objects(props, samples, seed) for seed in (0, 1)]
        reference = [[made[prop] for made in references] for prop in PROPS]
        single, gathered = (
            np.array([[error_of(light, truth) for light, truth in zip(bake, reference)]
                      for bake in errors[gathers]]) for gathers in (False, True))
        row[3], row[6] = (f"{100 * np.sqrt(np.mean(each ** 2)):.1f} %"
                          for each in (single, gathered))
        with np.errstate(divide='ignore', invalid='ignore'):
            ratio = np.sqrt(np.mean(gathered ** 2, axis=0)) / single[0]
        covered = int(np.sum(gathered <= np.array(stated)))
        held, bakes = held + covered, bakes + gathered.size
        worst = int(np.nanargmax(ratio))
        row += [f"{ratio[worst]:.2f} ({PROPS[worst]})", f"{covered}/{gathered.size}"]
        print("| " + " | ".join(row) + " |", flush=True)
    print(f"\nThe stated error holds in {held} of {bakes} cases.")


def print_triangles(names: Sequence[str], counts: Sequence[float]) -> None:
    print("| scene | faces | patches | " + " | ".join(STAGES) + " | sum | reconstruction | memory |"
          "\n|---|---|---|---|---|---|---|---|---|---|", flush=True)
    for name in names:
        faces, sums = [], []
        for count in counts:
            make_scene(name)
            add_balls(int(count))
            report = raybundle.bake(bpy.context, output='LIGHTING')
            faces.append(sum(len(mesh.polygons) for mesh in bpy.data.meshes))
            seconds = report.seconds
            sums.append(sum(seconds[stage] for stage in STAGES))
            print("| " + " | ".join(
                [name, f"{faces[-1]:,}", f"{report.patches:,}",
                 *(f"{seconds[stage]:.2f} s" for stage in STAGES), f"{sums[-1]:.2f} s",
                 f"{seconds['reconstruction']:.2f} s",
                 f"{report.peak_memory_bytes / 1e9:.2f} GB"]) + " |", flush=True)
        if len(faces) > 1:
            power = np.polyfit(np.log(faces), np.log(sums), 1)[0]
            print(f"\n{name}: the sum grows with the power {power:.2f} of the faces.\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("errors", "triangles"))
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=SCENES)
    parser.add_argument("--samples", type=int, default=256, help="of each bake of Cycles")
    parser.add_argument("--faces", nargs="+", type=float, default=(1e4, 1e5, 1e6))
    arguments = parser.parse_args(sys.argv[sys.argv.index("--") + 1:]
                                  if "--" in sys.argv else ["errors"])
    raybundle.register()
    if arguments.what == "errors":
        print_errors(arguments.scenes, arguments.samples)
    else:
        print_triangles(arguments.scenes, arguments.faces)


if __name__ == "__main__":
    main()
