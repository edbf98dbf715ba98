"""A terrain of a million faces on 1 km, with 2,000 instanced trees under sun and sky."""

from __future__ import annotations

import bpy
import numpy as np

from .construction import (Diffuse, Shape, add_mesh, add_object, add_sun, cylinder, grid, join,
                           material, set_camera, set_sky, smooth, uv_sphere)

EDGE, CELLS, TREES = 1000.0, 1000, 2000  # of the terrain: edge, m, and faces along it


def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Returns the height of the terrain, m: hills of 400 m down to bumps of 4 m."""
    chance = np.random.default_rng(7)
    total = np.zeros_like(x)
    for octave in range(8):
        length = 400.0 / 2 ** octave
        for _ in range(3):
            turn, phase = chance.uniform(0, 2 * np.pi, 2)
            along = x * np.cos(turn) + y * np.sin(turn)
            total += 0.03 * length * np.sin(2 * np.pi * along / length + phase)
    return total


def tree() -> Shape:
    """Returns a tree of 580 faces and 8 m, which stands on the origin."""
    crown = uv_sphere(1.0, 32, 18)
    bumps = 1 + 0.15 * np.sin(7 * crown.vertices[:, :1]) * np.cos(5 * crown.vertices[:, 1:2])
    crown = Shape(crown.vertices * bumps * (2.2, 2.2, 3.0), crown.blocks)
    return join([cylinder(0.25, 2.5, 12), crown.moved((0, 0, 5.0)).with_slot(1)])


def build(context: bpy.types.Context) -> None:
    """Fills the scene. The trees are instances on the vertices of the mesh ``places``."""
    grass = material("grass", Diffuse((0.3, 0.36, 0.2)))
    bark = material("bark", Diffuse((0.3, 0.2, 0.12)))
    leaves = material("leaves", Diffuse((0.12, 0.3, 0.08)))

    flat = grid((-EDGE / 2, -EDGE / 2, 0), (EDGE, 0, 0), (0, EDGE, 0), CELLS, CELLS)
    x, y = flat.vertices[:, 0], flat.vertices[:, 1]
    land = add_mesh("land", Shape(np.stack([x, y, height(x, y)], axis=1), flat.blocks), grass)
    smooth(land.data)

    x, y = np.random.default_rng(3).uniform(-0.48 * EDGE, 0.48 * EDGE, (2, TREES))
    points = bpy.data.meshes.new("places")
    points.from_pydata(np.stack([x, y, height(x, y)], axis=1).tolist(), [], [])
    places = add_object("places", points)
    places.instance_type = "VERTS"
    single = add_mesh("tree", tree(), bark, leaves)
    smooth(single.data)
    single.parent = places

    set_sky()
    add_sun("sun", towards=(-0.45, -0.6, 0.85), irradiance=3.5, colour=(1.0, 0.93, 0.82))
    set_camera((-80.0, -140.0, 40.0), (40.0, 60.0, 0.0), lens=28, clip_start=1.0)
    bpy.context.scene.camera.data.clip_end = 2000.0
