"""A hall of 16 x 10 x 5 m with columns, tables, chairs, steps and eight ceiling lamps."""

from __future__ import annotations

import bpy

from .construction import (Diffuse, Emission, add_mesh, box, join, material, room, set_camera,
                           set_world)
from .furniture import chair, table

TABLES = ((-5.0, -2.6), (-1.0, -2.6), (3.0, -2.6), (1.0, 2.8))
CHAIRS = ((-5.6, -1.6, 0), (-4.4, -3.7, 180), (-1.6, -1.6, -12), (-0.4, -3.7, 170),
          (2.4, -1.6, 0), (3.6, -3.7, 195))


def build(context: bpy.types.Context) -> None:
    """Fills the scene: 1130 faces in all."""
    plaster = material("plaster", Diffuse((0.7, 0.68, 0.62)))
    ceiling = material("ceiling", Diffuse((0.8, 0.8, 0.8)))
    tiles = material("tiles", Diffuse((0.45, 0.36, 0.3)))
    brick = material("brick", Diffuse((0.6, 0.25, 0.17)))
    blue = material("blue", Diffuse((0.2, 0.32, 0.6)))
    stone = material("stone", Diffuse((0.55, 0.55, 0.5)))
    wood = material("wood", Diffuse((0.5, 0.3, 0.15)))
    cloth = material("cloth", Diffuse((0.15, 0.42, 0.25)))
    metal = material("metal", Diffuse((0.4, 0.4, 0.42)))
    lamp = material("lamp", Emission((1.0, 0.92, 0.8), 30.0))

    surfaces = {"floor": tiles, "ceiling": ceiling, "wall_west": brick, "wall_east": blue}
    for name, side in room((16, 10, 5), (16, 10, 5)).items():
        add_mesh(name, side, surfaces.get(name, plaster))

    for index, (x, y) in enumerate((x, y) for y in (-1.0, 1.0) for x in (-4.5, 0.0, 4.5)):
        add_mesh(f"column_{index + 1}", box((0.5, 0.5, 5), (1, 1, 5), at=(x, y, 0)), stone)
    for index, (x, y) in enumerate(TABLES):
        add_mesh(f"table_{index + 1}", table(2.0, 1.0, 0.75).moved((x, y, 0)), wood)
    for index, (x, y, angle) in enumerate(CHAIRS):
        add_mesh(f"chair_{index + 1}", chair().turned(angle).moved((x, y, 0)), cloth)
    add_mesh("steps", join([box((0.5 * (3 - level), 4, 0.2),
                                at=(8 - 0.25 * (3 - level), 0, 0.2 * level))
                            for level in range(3)]), stone)
    add_mesh("lectern", join([box((0.4, 0.4, 1.0), (1, 1, 2), at=(-6.5, 2.5, 0)),
                              box((0.6, 0.6, 0.06), at=(-6.5, 2.5, 1.0))]), wood)
    for index, (x, y) in enumerate((x, y) for y in (-2.7, 2.7) for x in (-6.0, -2.0, 2.0, 6.0)):
        add_mesh(f"lamp_{index + 1}", box((1.6, 0.6, 0.1), at=(x, y, 4.5), slots={"bottom": 1}),
                 metal, lamp)

    set_world()
    set_camera((-7.6, -4.6, 2.3), (3.0, 1.2, 1.5), lens=20)
