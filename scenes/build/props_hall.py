"""A hall of 24 x 24 x 5 m with 64 props of 5,000 faces each, under sixteen ceiling lamps."""

from __future__ import annotations

import bpy
import numpy as np

from .construction import (Diffuse, Emission, FaceBlock, Shape, add_mesh, box, material, room,
                           set_camera, set_world, smooth)

AROUND, ALONG = 100, 50  # faces of a prop around its axis and along its outline
SPACING = 2.8  # between the axes of neighbouring props, m


def turned_body(outline: np.ndarray, bumps: int, depth: float) -> Shape:
    """Returns a body of revolution about the z axis, with fronts outside.

    outline: (points, 2), distance from the axis and height, m, anticlockwise around the section of
    the body. bumps: number of ridges around the axis, by which the distance varies by ``depth``.
    """
    angle = 2 * np.pi * np.arange(AROUND)[:, None] / AROUND
    distance = outline[:, 0] * (1 + depth * np.cos(bumps * angle))
    vertices = np.stack([distance * np.cos(angle), distance * np.sin(angle),
                         np.broadcast_to(outline[:, 1], distance.shape)], axis=2)
    row, column = np.meshgrid(np.arange(AROUND), np.arange(len(outline)), indexing="ij")
    next_row, next_column = (row + 1) % AROUND, (column + 1) % len(outline)
    corners = np.stack([row * len(outline) + column, next_row * len(outline) + column,
                        next_row * len(outline) + next_column, row * len(outline) + next_column],
                       axis=2).reshape(-1, 4)
    return Shape(vertices.reshape(-1, 3), [FaceBlock(corners)])


def outlines() -> list[np.ndarray]:
    """Returns the outlines of a ring, a vase and a drum, each with ALONG points."""
    angle = 2 * np.pi * np.arange(ALONG) / ALONG
    ring = np.stack([0.55 + 0.25 * np.cos(angle), 0.25 + 0.25 * np.sin(angle)], axis=1)
    height = np.linspace(0, 1.2, ALONG // 2)
    outside = 0.3 + 0.15 * np.sin(4.5 * height + 0.3)
    vase = np.concatenate([np.stack([outside, height], axis=1),
                           np.stack([outside - 0.04, height * 0.96 + 0.03], axis=1)[::-1]])
    cosine, sine = np.cos(angle), np.sin(angle)
    drum = np.stack([0.4 + 0.3 * np.sign(cosine) * np.abs(cosine) ** 0.6,
                     0.4 + 0.4 * np.sign(sine) * np.abs(sine) ** 1.2], axis=1)
    return [ring, vase, drum]


def build(context: bpy.types.Context) -> None:
    """Fills the scene: 320,000 faces on the props and 1,728 around them."""
    plaster = material("plaster", Diffuse((0.7, 0.68, 0.62)))
    tiles = material("tiles", Diffuse((0.45, 0.36, 0.3)))
    metal = material("metal", Diffuse((0.4, 0.4, 0.42)))
    lamp = material("lamp", Emission((1.0, 0.92, 0.8), 30.0))
    colours = [material(f"prop_{k}", Diffuse(colour)) for k, colour in enumerate(
        ((0.7, 0.3, 0.2), (0.25, 0.4, 0.65), (0.7, 0.65, 0.5), (0.3, 0.5, 0.3)))]

    for name, side in room((24, 24, 5), (24, 24, 5)).items():
        add_mesh(name, side, tiles if name == "floor" else plaster)
    bodies = outlines()
    for index in range(64):
        row, column = divmod(index, 8)
        body = turned_body(bodies[index % 3], 3 + index % 7, 0.08)
        at = (SPACING * (column - 3.5), SPACING * (row - 3.5), 0.002)
        prop = add_mesh(f"prop_{index + 1}", body.turned(17 * index).moved(at),
                        colours[(index + row) % 4])
        smooth(prop.data)
    for index in range(16):
        row, column = divmod(index, 4)
        at = (5.6 * (column - 1.5), 5.6 * (row - 1.5), 4.6)
        add_mesh(f"lamp_{index + 1}", box((1.6, 0.6, 0.1), at=at, slots={"bottom": 1}), metal,
                 lamp)

    set_world()
    set_camera((-11.4, -11.4, 3.4), (2.0, 2.0, 0.4), lens=22)
