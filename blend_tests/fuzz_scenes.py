# SPDX-License-Identifier: GPL-3.0-or-later
"""Random scenes by seed, for fuzz_cycles.py: `build(seed)` fills an empty file.

A scene is a room, a room with a window, or open ground. It has 2 to 5 objects of eight shapes,
which are rotated, scaled unevenly, half of them mirrored, and neither overlap nor touch. A third of
them emit light. There are one to three lamps of any type, and a world if it can be seen. All
surfaces are Lambertian. A third of the round shapes are shaded smooth.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import bpy
import lamp_rooms  # noqa: F401  (makes the package `build` of scenes importable)
import numpy as np
from build.construction import (Diffuse, Emission, FaceBlock, Shape, Sum, add_mesh, add_object, box,
                                cylinder, grid, material, room, set_world, smooth, uv_sphere)
from mathutils import Euler, Matrix, Vector

GAP = 0.08  # least distance between objects, lamps and walls, m
TRIES = 200

Sphere = tuple[np.ndarray, float]  # centre and radius of an occupied place, m


def build(seed: int) -> str:
    """Builds the scene of a seed and returns its kind: room, window or ground."""
    random = np.random.default_rng(seed)
    bpy.ops.wm.read_homefile(use_empty=True)
    kind = str(random.choice(("room", "window", "ground")))
    size = random.uniform((3.0, 3.0, 2.4), (6.0, 6.0, 3.5))
    if kind == "ground":
        size = np.array((6.0, 6.0, 3.0))
        add_mesh("ground", grid((-6, -6, 0), (12, 0, 0), (0, 12, 0), 24, 24), _surface(random))
    else:
        add_walls(random, size, kind == "window")
    set_world(tuple(random.uniform(0.2, 1.0, 3)) if kind != "room" else (0, 0, 0),
              random.uniform(0.1, 1.5))
    taken: list[Sphere] = []
    for number in range(random.integers(2, 6)):
        add_object_at_random(random, number, size, taken)
    for number in range(random.integers(1, 4)):
        add_lamp_at_random(random, number, size, taken, kind != "room")
    bpy.context.view_layer.update()
    return kind


def add_walls(random: np.random.Generator, size: np.ndarray, has_window: bool) -> None:
    cells = [max(6, round(3.0 * edge)) for edge in size]
    for name, shape in room(size.tolist(), cells).items():
        if has_window and name == "wall_south":
            block = shape.blocks[0].corners
            centres = shape.vertices[block].mean(axis=1)
            away = np.abs(centres[:, (0, 2)] - (0.0, 0.5 * size[2])) / size[[0, 2]]
            shape = Shape(shape.vertices, [FaceBlock(block[(away > 0.27).any(axis=1)])])
        add_mesh(name, shape, _surface(random))


def _surface(random: np.random.Generator) -> bpy.types.Material:
    return material("surface", Diffuse(tuple(random.uniform(0.1, 0.8, 3))))


# --------------------------------------------------------------------------------------------------
# Objects
# --------------------------------------------------------------------------------------------------


def _disk(corners: int = 20) -> Shape:
    angle = 2.0 * np.pi * np.arange(corners) / corners
    index = np.arange(corners)
    vertices = np.stack([np.cos(angle), np.sin(angle), np.zeros(corners)], axis=1)
    return Shape(np.concatenate([[(0.0, 0.0, 0.0)], vertices]), [FaceBlock(
        np.stack([np.zeros(corners, int), 1 + index, 1 + (index + 1) % corners], axis=1))])


def _cone(sides: int = 20) -> Shape:
    base = _disk(sides).flipped()
    corners = base.blocks[0].corners
    tip = len(base.vertices)
    mantle = np.stack([corners[:, 1], corners[:, 0], np.full(sides, tip)], axis=1)
    return Shape(np.concatenate([base.vertices, [(0.0, 0.0, 2.0)]]),
                 [*base.blocks, FaceBlock(mantle)]).moved((0, 0, -1))


def _torus(around: int = 20, across: int = 8) -> Shape:
    major, minor = np.meshgrid(2 * np.pi * np.arange(around) / around,
                               2 * np.pi * np.arange(across) / across, indexing="ij")
    radius = 0.75 + 0.25 * np.cos(minor)
    vertices = np.stack([radius * np.cos(major), radius * np.sin(major), 0.25 * np.sin(minor)],
                        axis=2).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    corners = np.stack([i * across + j, (i + 1) % around * across + j,
                        (i + 1) % around * across + (j + 1) % across,
                        i * across + (j + 1) % across], axis=2)
    return Shape(vertices, [FaceBlock(corners.reshape(-1, 4))])


def _wave() -> Shape:
    """Returns a wavy sheet of triangles.

    Its quads would not be plane, and Cycles and Raybundle would divide them differently.
    """
    shape = grid((-1, -1, 0), (2, 0, 0), (0, 2, 0), 8, 8)
    x, y, _ = shape.vertices.T
    shape.vertices[:, 2] = 0.2 * np.sin(3.0 * x) * np.cos(2.0 * y)
    quads = shape.blocks[0].corners
    return Shape(shape.vertices, [FaceBlock(np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]))])


# Shapes of a radius of about 1 around the origin, and whether they are round.
SHAPES: tuple[tuple[str, Callable[[], Shape], bool], ...] = (
    ("box", lambda: box((1.2, 1.2, 1.2), (4, 4, 4), at=(0, 0, -0.6)), False),
    ("sphere", lambda: uv_sphere(1.0, 20, 10), True),
    ("cylinder", lambda: cylinder(0.7, 1.4, 20, at=(0, 0, -0.7)), True),
    ("cone", _cone, True),
    ("torus", _torus, True),
    ("plate", lambda: grid((-1, -1, 0), (2, 0, 0), (0, 2, 0), 8, 8), False),
    ("disk", _disk, False),
    ("wave", _wave, True),
)


def add_object_at_random(random: np.random.Generator, number: int, size: np.ndarray,
                         taken: list[Sphere]) -> None:
    kind, shape, is_round = SHAPES[random.integers(len(SHAPES))]
    emits = random.uniform() < 1.0 / 3.0
    is_smooth = is_round and random.uniform() < 1.0 / 3.0
    scale = random.uniform(0.15, 0.6) * random.uniform(0.5, 1.0, 3)
    scale *= random.choice((-1.0, 1.0), 3)
    turn = Euler(random.uniform(-np.pi, np.pi, 3))
    mesh = shape()
    radius = float(np.linalg.norm(mesh.vertices * scale, axis=1).max())
    place = _free_place(random, size, radius, taken)
    colour = tuple(random.uniform(0.1, 0.8, 3))
    shader = Diffuse(colour)
    if emits:
        # The power is about equal for objects of all sizes.
        shader = Sum(shader, Emission(tuple(random.uniform(0.3, 1.0, 3)),
                                      float(random.uniform(0.5, 2.0) / radius ** 2)))
    if place is None:
        return
    name = f"{kind}_{number}" + ("_lamp" if emits else "")
    item = add_mesh(name, mesh, material(name, shader))
    item.matrix_world = (Matrix.Translation(Vector(place)) @ turn.to_matrix().to_4x4()
                         @ Matrix.Diagonal((*scale, 1.0)))
    if is_smooth:
        smooth(item.data)
    taken.append((place, radius))


def _free_place(random: np.random.Generator, size: np.ndarray, radius: float, taken: list[Sphere]
                ) -> np.ndarray | None:
    reach = radius + GAP
    low = np.array((reach - 0.5 * size[0], reach - 0.5 * size[1], reach))
    high = np.array((0.5 * size[0] - reach, 0.5 * size[1] - reach, size[2] - reach))
    for _ in range(TRIES):
        place = random.uniform(low, high)
        if all(np.linalg.norm(place - centre) > reach + other for centre, other in taken):
            return place
    return None


# --------------------------------------------------------------------------------------------------
# Lamps
# --------------------------------------------------------------------------------------------------


def add_lamp_at_random(random: np.random.Generator, number: int, size: np.ndarray,
                       taken: list[Sphere], is_open: bool) -> None:
    kind = str(random.choice(('POINT', 'SPOT', 'AREA', 'SUN') if is_open
                             else ('POINT', 'SPOT', 'AREA')))
    light = bpy.data.lights.new(f"{kind}_{number}", kind)
    light.color = random.uniform(0.3, 1.0, 3)
    radius = float(random.uniform(0.02, 0.15))
    if kind == 'SUN':
        light.energy, light.angle = random.uniform(1.0, 4.0), random.uniform(0.0, 0.2)
    else:
        light.energy = random.uniform(30.0, 150.0)
    if kind in ('POINT', 'SPOT'):
        light.shadow_soft_size = radius
    if kind == 'SPOT':
        light.spot_size, light.spot_blend = random.uniform(1.0, 2.2), random.uniform(0.1, 0.8)
    if kind == 'AREA':
        light.shape = str(random.choice(('SQUARE', 'RECTANGLE', 'DISK', 'ELLIPSE')))
        light.size, light.size_y = random.uniform(0.2, 1.0, 2)
        radius = 0.5 * math.hypot(light.size, light.size_y)
    place = _free_place(random, size, radius, taken)
    # Approximately downwards.
    turn = random.uniform((-0.8, -0.8, -3.0), (0.8, 0.8, 3.0))
    if place is None:
        bpy.data.lights.remove(light)
        return
    item = add_object(light.name, light)
    item.location, item.rotation_euler = place, turn
    taken.append((place, radius))
