# SPDX-License-Identifier: GPL-3.0-or-later
"""Time and error of bakes of dense meshes, with their light gathered at vertices and without.

    blender -b --factory-startup -P blend_tests/dense_surfaces.py -- [--scenes room yard]

Four props of 5,000 to 8,000 faces (a torus, a ball, a subdivided monkey, a ball with flat faces)
stand in a room with two lamps, or on a floor under a sun and a sky. Without the final gather, each
face is a patch of its own and shows its own light. The difference is that from a bake without the
final gather, with a target of 0.8 % and another seed: relative, RMS over the corners of the props
and RGB. It contains what distinguishes the light at a vertex, with its shading normal, from the
mean over the faces around it. Prints a table in Markdown.
"""

from __future__ import annotations

import argparse
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
    Diffuse, add_mesh, add_point_light, material, room, set_world)
from surface_error import read_colors  # noqa: E402

PROPS = ("torus", "ball", "monkey", "flat")


def _finish(name: str, paint: bpy.types.Material, smooth: bool = True) -> None:
    prop = bpy.context.object
    prop.name = name
    prop.data.polygons.foreach_set("use_smooth", [smooth] * len(prop.data.polygons))
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
    _finish("flat", paint, smooth=False)


def make_scene(name: str) -> None:
    """Builds the scene `room` or `yard` in an empty file."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    paint = material("paint", Diffuse((0.7, 0.65, 0.6)))
    for side, mesh in room((4, 4, 3), (24, 24, 18)).items():
        if name == "room" or side == "floor":
            add_mesh(side, mesh, paint)
    add_props()
    set_world()
    if name == "room":
        bpy.ops.object.light_add(type='AREA', location=(0, 0, 2.9))
        bpy.context.object.data.energy = 60
        bpy.context.object.data.size = 0.6
        add_point_light("lamp", (1.5, -1.5, 2.0), power=30, radius=0.05)
        return
    bpy.ops.object.light_add(type='SUN', rotation=(0.7, 0.3, 0))
    bpy.context.object.data.energy = 2
    tree = bpy.context.scene.world.node_tree
    sky = tree.nodes.new('ShaderNodeTexSky')
    sky.sky_type = 'PREETHAM'
    background = next(node for node in tree.nodes if node.type == 'BACKGROUND')
    background.inputs['Strength'].default_value = 0.2
    tree.links.new(sky.outputs['Color'], background.inputs['Color'])


def baked(**settings: object) -> tuple[raybundle.BakeReport, np.ndarray]:
    """Bakes the open scene. Returns the report and (corners, 3) light of the props."""
    report = raybundle.bake(bpy.context, output='LIGHTING', **settings)
    light = [read_colors(bpy.data.objects[name]) for name in PROPS]
    return report, np.concatenate(light)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", nargs="+", choices=("room", "yard"), default=["room", "yard"])
    arguments = parser.parse_args(sys.argv[sys.argv.index("--") + 1:]
                                  if "--" in sys.argv else [])
    raybundle.register()
    print("| scene | patches | time | difference | patches, gathered | time | difference |\n"
          "|---|---|---|---|---|---|---|")
    for name in arguments.scenes:
        make_scene(name)
        _, reference = baked(final_gather=False, target_error=0.008, seed=5)
        row = [name]
        for gathers in (False, True):
            report, light = baked(final_gather=gathers)
            difference = np.sqrt(np.mean((light - reference) ** 2) / np.mean(reference ** 2))
            row += [f"{report.patches:,}", f"{report.seconds['total']:.1f} s",
                    f"{100 * difference:.1f} %"]
        print("| " + " | ".join(row) + " |")


if __name__ == "__main__":
    main()
