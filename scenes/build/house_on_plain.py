"""A house of 10 m, open to the south, on a plain of 1 km under sun and sky."""

from __future__ import annotations

import bpy
import numpy as np

from .construction import (Diffuse, FaceBlock, Shape, add_mesh, add_sun, box, grid, join, material,
                           set_camera, set_world)
from .furniture import chair, shelf, table

LENGTH, DEPTH, HEIGHT, THICK = 10.0, 7.0, 3.0, 0.3
BASE = 0.1  # top of the floor slab above the plain, m
CELL = 0.5  # edge of the faces of the walls, m


def plain(reach: float, fine: float, cell: float, growth: float) -> Shape:
    """Returns a square of edge 2 ``reach``, m.

    Its faces have the edge ``cell`` up to the distance ``fine`` from its centre, and grow beyond.
    """
    steps = [cell]
    while fine + sum(steps) < reach:
        steps.append(steps[-1] * growth)
    outer = fine + np.cumsum(steps) * ((reach - fine) / sum(steps))
    inner = np.linspace(-fine, fine, int(round(2 * fine / cell)) + 1)
    lines = np.concatenate([-outer[::-1], inner, outer])
    cells = len(lines) - 1
    flat = grid((0, 0, 0), (cells, 0, 0), (0, cells, 0), cells, cells)
    x, y = (np.interp(flat.vertices[:, axis], np.arange(len(lines)), lines) for axis in (0, 1))
    vertices = np.stack([x, y, np.zeros(x.size)], axis=1)
    return Shape(vertices, [FaceBlock(block.corners) for block in flat.blocks])


def wall(length: float, openings: list[tuple[float, float, float, float]]) -> Shape:
    """Returns a wall along x, centred on the origin.

    openings: (left, right, sill, top) of each opening in the wall, m.
    """
    def piece(left: float, right: float, low: float, high: float) -> Shape:
        cells = (max(1, round((right - left) / CELL)), 1, max(1, round((high - low) / CELL)))
        return box((right - left, THICK, high - low), cells, at=((left + right) / 2, 0, low))

    pieces, at = [], -length / 2
    for left, right, sill, top in openings:
        pieces.append(piece(at, left, 0, HEIGHT))
        if sill > 0:
            pieces.append(piece(left, right, 0, sill))
        pieces.append(piece(left, right, top, HEIGHT))
        at = right
    pieces.append(piece(at, length / 2, 0, HEIGHT))
    return join(pieces)


def build(context: bpy.types.Context) -> None:
    """Fills the scene. The small objects are all objects except ``plain``."""
    grass = material("grass", Diffuse((0.3, 0.36, 0.2)))
    lime = material("lime", Diffuse((0.75, 0.72, 0.65)))
    tiles = material("tiles", Diffuse((0.55, 0.24, 0.15)))
    boards = material("boards", Diffuse((0.5, 0.35, 0.2)))
    wood = material("wood", Diffuse((0.55, 0.4, 0.25)))
    blue = material("blue", Diffuse((0.15, 0.3, 0.55)))

    add_mesh("plain", plain(500, 8, CELL, 1.3), grass)
    add_mesh("floor", box((LENGTH, DEPTH, BASE), (20, 14, 1)), boards)
    south = wall(LENGTH, [(-3.5, -1.5, 0.9, 2.2), (0.0, 1.2, 0.0, 2.2), (2.5, 4.0, 0.9, 2.2)])
    north = wall(LENGTH, [(-2.0, -0.5, 1.1, 2.0)])
    side = wall(DEPTH - 2 * THICK, [(-0.8, 0.8, 0.9, 2.2)]).turned(90)
    add_mesh("wall_south", south.moved((0, -(DEPTH - THICK) / 2, BASE)), lime)
    add_mesh("wall_north", north.moved((0, (DEPTH - THICK) / 2, BASE)), lime)
    add_mesh("wall_west", side.moved((-(LENGTH - THICK) / 2, 0, BASE)), lime)
    add_mesh("wall_east", side.moved(((LENGTH - THICK) / 2, 0, BASE)), lime)
    add_mesh("roof", box((LENGTH + 1, DEPTH + 1, 0.25), (22, 16, 1), at=(0, 0, BASE + HEIGHT)),
             tiles)
    add_mesh("chimney", box((0.6, 0.6, 1.2), (2, 2, 4), at=(2.5, 1.5, BASE + HEIGHT + 0.25)),
             tiles)

    add_mesh("table", table(1.6, 0.9, 0.75, (6, 4)).moved((-1.5, -0.5, BASE)), wood)
    add_mesh("chair_south", chair().turned(180).moved((-1.5, -1.3, BASE)), blue)
    add_mesh("chair_north", chair().moved((-1.5, 0.3, BASE)), blue)
    add_mesh("shelf", shelf(1.8, 0.35, 2.0, 5).moved((2.8, 2.9, BASE)), wood)
    add_mesh("bench", table(1.8, 0.4, 0.45, (8, 2)).moved((3.2, -4.2, 0)), wood)
    add_mesh("trough", box((1.2, 0.6, 0.5), (4, 2, 2)).turned(20).moved((-4.0, -5.5, 0)), blue)

    set_world((0.55, 0.75, 1.0), 0.5)
    add_sun("sun", towards=(-0.45, -0.7, 0.6), irradiance=3.5, colour=(1.0, 0.93, 0.82))
    set_camera((9.0, -13.5, 5.0), (-0.3, -1.0, 1.3), lens=30)
