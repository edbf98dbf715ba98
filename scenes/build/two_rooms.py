"""Two rooms of 4 x 4 x 2.6 m with a doorway between them. Only the western room has a lamp."""

from __future__ import annotations

import bpy

from .construction import (WHITE, Diffuse, Emission, add_mesh, box, material, room, set_camera,
                           set_world)
from .furniture import table

HEIGHT, DOOR_WIDTH, DOOR_HEIGHT, THICKNESS = 2.6, 1.0, 2.1, 0.2


def build(context: bpy.types.Context) -> None:
    """Fills the scene. Floor, ceiling and long walls continue under the dividing wall."""
    white = material("white", Diffuse(WHITE))
    warm = material("warm", Diffuse((0.7, 0.4, 0.2)))
    cool = material("cool", Diffuse((0.25, 0.4, 0.65)))
    wood = material("wood", Diffuse((0.6, 0.45, 0.28)))
    metal = material("metal", Diffuse((0.4, 0.4, 0.4)))
    lamp = material("lamp", Emission((1.0, 0.95, 0.85), 90.0))

    surfaces = {"floor": wood, "wall_west": warm, "wall_east": cool}
    for name, side in room((8 + THICKNESS, 4, HEIGHT), (41, 20, 13)).items():
        add_mesh(name, side, surfaces.get(name, white))

    pier = (4 - DOOR_WIDTH) / 2
    centre = (DOOR_WIDTH + pier) / 2
    for name, y in (("divider_south", -centre), ("divider_north", centre)):
        add_mesh(name, box((THICKNESS, pier, HEIGHT), (1, 8, 13), at=(0, y, 0)), white)
    add_mesh("lintel", box((THICKNESS, DOOR_WIDTH, HEIGHT - DOOR_HEIGHT), (1, 5, 3),
                           at=(0, 0, DOOR_HEIGHT)), white)
    add_mesh("lamp", box((0.8, 0.4, 0.08), (4, 2, 1), at=(-1.7, 0.3, 2.3), slots={"bottom": 1}),
             metal, lamp)
    add_mesh("table_west", table(1.2, 0.7, 0.75, (6, 4)).moved((-2.4, -0.9, 0)), wood)
    add_mesh("crate_east", box((0.6, 0.6, 0.6), (6, 6, 6)).turned(25).moved((1.5, 0.9, 0)), warm)

    set_world()
    set_camera((3.9, -1.75, 1.7), (-0.6, 0.6, 0.95), lens=20)
