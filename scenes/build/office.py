"""An office of 6 x 5 x 2.8 m whose lamps face the floor or the ceiling.

The collections ``lamps_down`` and ``lamps_up`` select the lamps: one of them is shown, the other
one is excluded from the view layer.
"""

from __future__ import annotations

import bpy

from .construction import (Diffuse, Emission, Principled, add_mesh, box, join, material, room,
                           set_camera, set_world)
from .furniture import chair, desk, floor_lamp, hanging_lamp, monitor, shelf

HEIGHT = 2.8
DESKS = ((-1.7, 1.0), (1.3, 1.0), (-1.7, -1.2))
LAMPS_DOWN = ((-1.7, 0.9), (1.3, 0.9), (-1.7, -1.3), (1.3, -1.3))
LAMPS_UP = ((-2.7, 2.2), (2.6, 1.9), (-2.7, -0.1), (0.4, -2.2))


def build(context: bpy.types.Context) -> None:
    """Fills the scene: 1166 faces with the lamps that face the floor."""
    paint = material("paint", Principled((0.75, 0.73, 0.68)))
    accent = material("accent", Principled((0.25, 0.42, 0.55)))
    ceiling = material("ceiling", Diffuse((0.85, 0.85, 0.85)))
    carpet = material("carpet", Diffuse((0.35, 0.2, 0.15)))
    beech = material("beech", Principled((0.66, 0.47, 0.29)))
    fabric = material("fabric", Diffuse((0.5, 0.08, 0.06)))
    steel = material("steel", Diffuse((0.42, 0.44, 0.46)))
    black = material("black", Diffuse((0.05, 0.05, 0.05)))
    screen = material("screen", Emission((0.35, 0.6, 1.0), 1.5))
    lamp = material("lamp", Emission((1.0, 0.9, 0.75), 55.0))
    paper = material("paper", Diffuse((0.7, 0.62, 0.4)))

    surfaces = {"floor": carpet, "ceiling": ceiling, "wall_west": accent}
    for name, side in room((6, 5, HEIGHT), (12, 10, 5)).items():
        add_mesh(name, side, surfaces.get(name, paint))

    for index, (x, y) in enumerate(DESKS):
        add_mesh(f"desk_{index + 1}", desk(1.6, 0.8).moved((x, y, 0)), beech)
        add_mesh(f"chair_{index + 1}",
                 chair().turned(180 + 14 * index).moved((x + 0.1, y - 0.75, 0)), fabric)
        add_mesh(f"monitor_{index + 1}", monitor().moved((x, y + 0.12, 0.74)), black, screen)
    add_mesh("shelf", shelf(1.8, 0.35, 2.0, 5).moved((1.5, 2.325, 0)), beech)
    for index in range(8):
        books = box((0.16, 0.22, 0.3), at=(0.84 + 0.2 * index, 2.3, 0.03 + 0.4925 * (index % 3)))
        add_mesh(f"books_{index + 1}", books, (paper, fabric, accent)[index % 3])
    add_mesh("cabinet", join([box((0.5, 1.2, 1.1), (1, 3, 3), at=(2.75, -0.6, 0)),
                              box((0.02, 0.3, 0.02), at=(2.49, -0.6, 0.8))]), steel)
    add_mesh("bin", box((0.3, 0.3, 0.35), (1, 1, 2), at=(-0.6, 2.2, 0)), steel)

    shown, hidden = (bpy.data.collections.new(name) for name in ("lamps_down", "lamps_up"))
    for collection in (shown, hidden):
        context.scene.collection.children.link(collection)
    for index, (x, y) in enumerate(LAMPS_DOWN):
        add_mesh(f"lamp_down_{index + 1}", hanging_lamp(0.7).moved((x, y, HEIGHT)), steel, lamp,
                 collection=shown)
    for index, (x, y) in enumerate(LAMPS_UP):
        add_mesh(f"lamp_up_{index + 1}", floor_lamp(1.8).moved((x, y, 0)), steel, lamp,
                 collection=hidden)
    context.view_layer.layer_collection.children[hidden.name].exclude = True

    set_world()
    set_camera((2.75, -2.3, 1.85), (-1.0, 1.2, 1.0), lens=20)
