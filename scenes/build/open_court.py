"""A walled court on a plain of 30 m under sun and sky."""

from __future__ import annotations

import bpy

from .construction import Diffuse, add_mesh, add_sun, box, grid, material, set_camera, set_world


def build(context: bpy.types.Context) -> None:
    """Fills the scene. The walls touch each other and stand on the ground."""
    sand = material("sand", Diffuse((0.5, 0.43, 0.32)))
    lime = material("lime", Diffuse((0.75, 0.72, 0.65)))
    clay = material("clay", Diffuse((0.62, 0.25, 0.14)))
    green = material("green", Diffuse((0.2, 0.4, 0.15)))

    add_mesh("ground", grid((-15, -15, 0), (30, 0, 0), (0, 30, 0), 60, 60), sand)
    wall_x, wall_y = box((12, 0.5, 3), (24, 1, 6)), box((0.5, 9, 3), (1, 18, 6))
    add_mesh("wall_north", wall_x.moved((0, 4.75, 0)), lime)
    add_mesh("wall_west", wall_y.moved((-5.75, 0, 0)), clay)
    add_mesh("wall_east", wall_y.moved((5.75, 0, 0)), lime)
    gate = box((4.5, 0.5, 3), (9, 1, 6))
    add_mesh("wall_south_west", gate.moved((-3.75, -4.75, 0)), lime)
    add_mesh("wall_south_east", gate.moved((3.75, -4.75, 0)), lime)
    add_mesh("gate_beam", box((3, 0.5, 0.6), (6, 1, 2), at=(0, -4.75, 2.4)), clay)

    add_mesh("block_clay", box((1.5, 1.5, 1.5), (6, 6, 6)).turned(30).moved((-2.8, 1.6, 0)), clay)
    add_mesh("block_green", box((1, 2, 0.8), (4, 8, 4)).turned(-15).moved((1.2, -0.6, 0)), green)
    add_mesh("block_tower", box((1, 1, 4), (4, 4, 16), at=(3.2, 2.6, 0)), lime)
    canopy = material("canopy", Diffuse((0.65, 0.65, 0.6)))
    add_mesh("canopy", box((3, 2, 0.15), (12, 8, 1), at=(-4, -3.5, 2.2)), canopy)

    set_world((0.55, 0.75, 1.0), 0.5)
    add_sun("sun", towards=(-0.45, -0.6, 0.85), irradiance=3.5, colour=(1.0, 0.93, 0.82))
    set_camera((7.5, -12.0, 8.5), (-0.3, 0.3, 0.6), lens=32)
