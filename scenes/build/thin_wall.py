"""A closed room of 6 x 4 x 2.6 m divided by a wall without thickness, lit on one side only.

The floor and the long walls are two objects each, one for each half. The ceiling is one mesh with
sharp edges along the divider. The exact light of the eastern half, zero, can therefore be stored at
all its corners. The camera stands outside, and its near clipping plane cuts the southern wall away.
"""

from __future__ import annotations

import bpy

from .construction import (WHITE, Diffuse, OneSided, Shape, add_area_light, add_mesh,
                           add_point_light, box, grid, mark_sharp, material, room, set_camera,
                           set_world)

HEIGHT = 2.6
BLACK = (0.0, 0.0, 0.0)


def divider(south: float, north: float, cells: int) -> Shape:
    """Returns a piece of the dividing wall x = 0. Its front faces west, where the light is."""
    return grid((0, north, 0), (0, south - north, 0), (0, 0, HEIGHT), cells, 13)


def build(context: bpy.types.Context) -> None:
    """Fills the scene. Cabinets stand flush against walls, floor and divider."""
    white = material("white", Diffuse(WHITE))
    red = material("red", Diffuse((0.6, 0.15, 0.1)))
    wood = material("wood", Diffuse((0.55, 0.38, 0.22)))
    one_sided = material("one_sided", OneSided(front=Diffuse((0.2, 0.5, 0.65)),
                                               back=Diffuse(BLACK)))

    halves = room((3, 4, HEIGHT), (15, 20, 13))
    for half, x in (("west", -1.5), ("east", 1.5)):
        for part in ("floor", "wall_south", "wall_north"):
            add_mesh(f"{part}_{half}", halves[part].moved((x, 0, 0)), white)
        add_mesh(f"wall_{half}", halves[f"wall_{half}"].moved((x, 0, 0)),
                 red if half == "west" else white)
    shape = room((6, 4, HEIGHT), (30, 20, 13))["ceiling"]
    ceiling = add_mesh("ceiling", shape, white)
    mark_sharp(ceiling.data, abs(shape.vertices[:, 0]) < 1e-6)

    add_mesh("divider_plain", divider(-2.0, 0.0, 10), white)
    add_mesh("divider_one_sided", divider(0.0, 1.0, 5), one_sided)
    add_mesh("divider_turned", divider(1.0, 2.0, 5).flipped(), white)
    add_mesh("screen", grid((-2.2, 0.6, 0), (0.8, 0.5, 0), (0, 0, 1.5), 8, 13), white)
    add_mesh("screen_one_sided", grid((-2.6, -1.0, 0), (0.7, -0.4, 0), (0, 0, 1.2), 8, 10),
             one_sided)

    cabinet = box((0.8, 0.5, 1.0), (8, 5, 10))
    add_mesh("cabinet_corner_west", cabinet.moved((-2.6, 1.75, 0)), wood)
    add_mesh("cabinet_divider_west", cabinet.moved((-0.4, 0.3, 0)), wood)
    add_mesh("cabinet_divider_east", cabinet.moved((0.4, 0.3, 0)), wood)
    add_mesh("cabinet_corner_east", cabinet.moved((2.6, 1.75, 0)), wood)

    set_world()
    add_point_light("point", (-1.9, -0.9, 2.0), power=12.0, radius=0.02)
    add_area_light("area", (-1.2, 0.8, 2.5), (-1.2, 0.8, 0), (0.6, 0.4), power=25.0)
    set_camera((0, -6.2, 1.3), (0, 0, 1.3), lens=25, clip_start=4.25)
