"""The Cornell box: 2 x 2 x 2 m, open at the front, a one-sided lamp 2 cm below the ceiling."""

from __future__ import annotations

import bpy

from .construction import (WHITE, Diffuse, Emission, OneSided, add_mesh, box, grid, material,
                           room, set_camera, set_world)

GREY = (0.5, 0.5, 0.5)


def build(context: bpy.types.Context) -> None:
    """Fills the scene. The edges of the lamp (0.25 m) lie between the grid lines (0.1 m apart)."""
    white = material("white", Diffuse(WHITE))
    red = material("red", Diffuse((0.63, 0.06, 0.05)))
    green = material("green", Diffuse((0.14, 0.45, 0.09)))
    lamp = material("lamp", OneSided(front=Emission((1.0, 0.86, 0.7), 44.0), back=Diffuse(GREY)))

    sides = room((2, 2, 2), (20, 20, 20))
    add_mesh("floor", sides["floor"], white)
    add_mesh("ceiling", sides["ceiling"], white)
    add_mesh("wall_back", sides["wall_north"], white)
    add_mesh("wall_left", sides["wall_west"], red)
    add_mesh("wall_right", sides["wall_east"], green)

    tall = box((0.6, 0.6, 1.2), (6, 6, 12)).turned(17)
    short = box((0.6, 0.6, 0.6), (6, 6, 6)).turned(-17)
    add_mesh("box_tall", tall.moved((-0.36, 0.32, 0)), white)
    add_mesh("box_short", short.moved((0.36, -0.32, 0)), white)
    add_mesh("lamp", grid((-0.25, 0.25, 1.98), (0.5, 0, 0), (0, -0.5, 0), 1, 1), lamp)

    set_world()
    set_camera((0, -3.9, 1.0), (0, 0, 1.0), lens=37)
