"""A cube of 1 m on a plane of one face under sun and sky."""

from __future__ import annotations

import bpy

from .construction import (WHITE, Diffuse, add_mesh, add_sun, box, grid, material, set_camera,
                           set_world)


def build(context: bpy.types.Context) -> None:
    """Fills the scene: seven faces. None of them has a vertex in the cube's shadow."""
    white = material("white", Diffuse(WHITE))
    add_mesh("plane", grid((-3, -3, 0), (6, 0, 0), (0, 6, 0), 1, 1), white)
    add_mesh("cube", box((1, 1, 1)), white)
    set_world((0.55, 0.75, 1.0), 0.5)
    add_sun("sun", towards=(-0.45, -0.6, 0.85), irradiance=3.5, colour=(1.0, 0.93, 0.82))
    set_camera((2.6, -4.2, 3.2), (0.2, 0.2, 0.2), lens=32)
