"""A level of 154 x 178 m with 136 rooms, each lit by a small lamp in a housing."""

from __future__ import annotations

import bpy

from .construction import (Diffuse, Shape, add_mesh, add_point_light, box, grid, join, material,
                           set_camera, set_world)

COLUMNS, ROWS = 8, 17  # rooms along x and y
WIDTH, LENGTH, HIGH = 154.0, 178.0, 3.2  # m
THICK, DOOR = 0.2, 1.6  # of the walls, and width of the openings in their middles, m


def wall(length: float) -> Shape:
    """Returns a wall along x on the origin, with an opening in its middle."""
    part = (length - DOOR) / 2
    return join([box((part, THICK, HIGH), (6, 1, 3), at=(-(DOOR + part) / 2, 0, 0)),
                 box((part, THICK, HIGH), (6, 1, 3), at=((DOOR + part) / 2, 0, 0)),
                 box((DOOR, THICK, HIGH - 2.2), at=(0, 0, 2.2))])


def housing() -> Shape:
    """Returns the housing of a lamp, of 35 faces and 0.3 m: a box that is open below."""
    rim = [box((0.3, 0.02, 0.12), (3, 1, 1), at=(0, y, 0)) for y in (-0.14, 0.14)]
    lid = grid((-0.15, 0.15, 0.12), (0.3, 0, 0), (0, -0.3, 0), 7, 1)
    return join([*rim, lid])


def build(context: bpy.types.Context) -> None:
    """Fills the scene: 136 housings with 4,760 faces, in rooms of coarse faces."""
    concrete = material("concrete", Diffuse((0.55, 0.55, 0.52)))
    floor = material("floor", Diffuse((0.4, 0.35, 0.3)))
    metal = material("metal", Diffuse((0.5, 0.5, 0.52)))

    across, along = WIDTH / COLUMNS, LENGTH / ROWS
    flat = grid((-WIDTH / 2, -LENGTH / 2, 0), (WIDTH, 0, 0), (0, LENGTH, 0), 80, 90)
    add_mesh("floor", flat, floor)
    add_mesh("ceiling", flat.flipped().moved((0, 0, HIGH)), concrete)
    for row in range(ROWS + 1):
        y = along * row - LENGTH / 2
        inner = 0 < row < ROWS
        for column in range(COLUMNS):
            x = across * (column + 0.5) - WIDTH / 2
            shape = (wall(across - THICK) if inner
                     else box((across - THICK, THICK, HIGH), (12, 1, 3)))
            add_mesh(f"wall_x_{row}_{column}", shape.moved((x, y, 0)), concrete)
    for column in range(COLUMNS + 1):
        x = across * column - WIDTH / 2
        inner = 0 < column < COLUMNS
        for row in range(ROWS):
            y = along * (row + 0.5) - LENGTH / 2
            shape = wall(along + THICK) if inner else box((along + THICK, THICK, HIGH), (8, 1, 3))
            add_mesh(f"wall_y_{column}_{row}", shape.turned(90).moved((x, y, 0)), concrete)
    for row in range(ROWS):
        for column in range(COLUMNS):
            at = (across * (column + 0.5) - WIDTH / 2, along * (row + 0.5) - LENGTH / 2, HIGH - 0.3)
            name = f"{row}_{column}"
            add_mesh(f"housing_{name}", housing().moved(at), metal)
            add_point_light(f"lamp_{name}", (at[0], at[1], at[2] + 0.06), power=60.0, radius=0.03)

    set_world()
    set_camera((-WIDTH / 2 + 2.0, -LENGTH / 2 + 1.5, 2.4), (-WIDTH / 2 + 16, -LENGTH / 2 + 9, 1.2),
               lens=20)
