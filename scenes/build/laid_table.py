"""A hall of 20 x 30 x 8 m with a table for four, laid with plates, cups and cutlery."""

from __future__ import annotations

import bpy
import numpy as np

from .construction import (Diffuse, Emission, FaceBlock, Shape, add_mesh, box, cylinder, join,
                           material, room, set_camera, set_world)
from .furniture import chair, hanging_lamp, table

WIDTH, DEPTH, HEIGHT = 1.6, 1.0, 0.75  # of the table, m
# Outlines of solids of revolution, from the axis outwards and back to it: (radius, height), m.
PLATE = ((0.0, 0.006), (0.08, 0.006), (0.125, 0.02), (0.13, 0.018), (0.085, 0.001), (0.0, 0.001))
CUP = ((0.0, 0.008), (0.032, 0.012), (0.038, 0.08), (0.042, 0.08), (0.036, 0.006), (0.03, 0.001),
       (0.0, 0.001))
SEATS = ((-0.4, -0.33, 0), (0.4, -0.33, 0), (-0.4, 0.33, 180), (0.4, 0.33, 180))


def turned_shape(outline: tuple[tuple[float, float], ...], segments: int) -> Shape:
    """Returns a closed solid of revolution about the z axis; both ends of the outline are on it."""
    angle = 2 * np.pi * np.arange(segments) / segments
    rings = [np.stack([r * np.cos(angle), r * np.sin(angle), np.full(segments, z)], axis=1)
             for r, z in outline[1:-1]]
    vertices = np.concatenate([[(0, 0, outline[0][1])], *rings, [(0, 0, outline[-1][1])]])
    index = np.arange(segments)
    after = (index + 1) % segments
    first = (1 + segments * np.arange(len(rings) - 1)).reshape(-1, 1)
    quads = np.stack([first + index, first + index + segments, first + after + segments,
                      first + after], axis=2).reshape(-1, 4)
    last = 1 + segments * (len(rings) - 1)
    top = np.stack([np.zeros(segments, dtype=int), 1 + index, 1 + after], axis=1)
    bottom = np.stack([np.full(segments, len(vertices) - 1), last + after, last + index], axis=1)
    return Shape(vertices, [FaceBlock(top), FaceBlock(quads), FaceBlock(bottom)])


def fork() -> Shape:
    """Returns a fork along y: a handle, a root and four tines of 2 mm."""
    tines = [box((0.002, 0.05, 0.002), (1, 4, 1), at=(0.006 * k - 0.009, 0.075, 0.001))
             for k in range(4)]
    return join([box((0.009, 0.12, 0.002), (1, 8, 1), at=(0, -0.03, 0.001)),
                 box((0.022, 0.02, 0.002), (2, 2, 1), at=(0, 0.04, 0.001)), *tines])


def knife() -> Shape:
    """Returns a knife along y: a handle and a blade."""
    return join([box((0.014, 0.1, 0.008), (1, 6, 1), at=(0, -0.05, 0.001)),
                 box((0.018, 0.1, 0.0015), (1, 6, 1), at=(0, 0.05, 0.004))])


def build(context: bpy.types.Context) -> None:
    """Fills the scene.

    The small objects are the plates, cups, forks, knives and the candlestick.
    """
    plaster = material("plaster", Diffuse((0.7, 0.68, 0.62)))
    ceiling = material("ceiling", Diffuse((0.8, 0.8, 0.8)))
    stone = material("stone", Diffuse((0.45, 0.38, 0.32)))
    wood = material("wood", Diffuse((0.5, 0.3, 0.15)))
    cloth = material("cloth", Diffuse((0.5, 0.1, 0.08)))
    china = material("china", Diffuse((0.8, 0.8, 0.78)))
    glaze = material("glaze", Diffuse((0.2, 0.4, 0.65)))
    steel = material("steel", Diffuse((0.5, 0.5, 0.52)))
    lamp = material("lamp", Emission((1.0, 0.92, 0.8), 120.0))

    surfaces = {"floor": stone, "ceiling": ceiling}
    for name, side in room((20, 30, 8), (20, 30, 8)).items():
        add_mesh(name, side, surfaces.get(name, plaster))
    for index, (x, y) in enumerate((x, y) for y in (-10.0, 0.0, 10.0) for x in (-5.0, 5.0)):
        add_mesh(f"lamp_{index + 1}", hanging_lamp(2.5).moved((x, y, 8)), steel, lamp)
    add_mesh("lamp_table", hanging_lamp(5.8).moved((0.3, 0.2, 8)), steel, lamp)

    add_mesh("table", table(WIDTH, DEPTH, HEIGHT, (32, 20)), wood)
    for index, (x, y, angle) in enumerate(SEATS):
        add_mesh(f"chair_{index + 1}",
                 chair().turned(180 + angle).moved((x, 2.2 * y, 0)), cloth)
        # The fork lies left of each plate, the knife right of it, and the cup stands behind it.
        for name, shape, paint in (
                ("plate", turned_shape(PLATE, 24), china),
                ("cup", turned_shape(CUP, 16).moved((0.14, 0.14, 0)), glaze),
                ("fork", fork().moved((-0.17, 0, 0)), steel),
                ("knife", knife().moved((0.17, -0.01, 0)), steel)):
            add_mesh(f"{name}_{index + 1}",
                     shape.turned(angle).moved((x, y, HEIGHT)), paint)
    add_mesh("candlestick", join([cylinder(0.06, 0.015, 16), cylinder(0.012, 0.22, 12,
                                                                      at=(0, 0, 0.015))])
             .moved((0, 0, HEIGHT)), steel)

    set_world()
    set_camera((0.95, -1.35, 1.65), (-0.05, 0.0, 0.72), lens=30, clip_start=0.01)
