# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes scenes and rooms of lamps, and returns the mean light of each original object."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import bpy
import lamp_rooms
import numpy as np
import raybundle
from build import construction, cornell_box
from covered_faces import COVERED, covered_faces, mark_covered
from scene_items import ORIGIN, ORIGINS, mesh_items
from surface_error import corner_areas, face_sizes, read_colors

SCENES = Path(__file__).parent.parent / "scenes"


@dataclass
class Bake:
    """The result of a bake.

    Light and noise are by the name of the original object, before objects were joined or cut up.
    """

    light: dict[str, np.ndarray]  # (3,) mean of LIGHTING by area
    areas: dict[str, float]  # m^2
    noise: dict[str, float]  # stated noise, in the unit of the light
    balance: float
    bundles: int
    seconds: float
    warnings: list[str]

    def scene_mean(self) -> float:
        areas = np.array([self.areas[name] for name in self.light])
        return float(areas @ np.mean(list(self.light.values()), axis=1) / areas.sum())


_covered: dict[str, dict[str, np.ndarray]] = {}  # per scene: result of covered_faces


def open_scene(name: str, cells: int = lamp_rooms.FINE) -> None:
    """Opens a scene and marks its covered faces (covered_faces.py)."""
    open_file(name, cells)
    bpy.context.view_layer.update()
    if name not in _covered:
        _covered[name] = covered_faces(mesh_items())
    mark_covered(_covered[name])


def open_file(name: str, cells: int) -> None:
    """cells: of rooms, along a metre; where they are COARSE, the Cornell box is coarse too."""
    kind, _, room = name.partition(":")
    if kind == "room":
        lamp_rooms.build(room, cells)
        return
    if name == "cornell_box" and cells == lamp_rooms.COARSE:
        build_cornell_box(0.5)
        return
    path = SCENES / f"{name}.blend"
    bpy.ops.wm.open_mainfile(filepath=str(path if path.is_file() else Path(name).resolve()))


def build_cornell_box(density: float) -> None:
    """Replaces the open file by the Cornell box of scenes/.

    density: factor of the number of cells along each edge of the walls.
    """
    bpy.ops.wm.read_homefile(use_empty=True)
    construction.set_render_settings(bpy.context.scene)
    construction.density, before = density, construction.density
    cornell_box.build(bpy.context)
    construction.density = before
    bpy.context.view_layer.update()


def bake(**settings: object) -> Bake:
    """Bakes the open scene."""
    bpy.context.view_layer.update()
    started = time.perf_counter()
    report = raybundle.bake(bpy.context, **settings)
    seconds = time.perf_counter() - started
    scene = bpy.context.scene
    attributes = [entry['attribute'] for entry in report.light_sets] or [scene.raybundle.attribute]
    light: dict[str, np.ndarray] = {}
    areas: dict[str, float] = {}
    noise: dict[str, float] = {}
    for entry in report.objects:
        if not entry.status.startswith('baked'):
            continue
        item = bpy.data.objects[entry.name]
        values = sum(read_colors(item, name).astype(float) for name in attributes)
        sizes = face_sizes(item.data)
        weights = corner_areas(item) * np.repeat(1 - face_numbers(item, COVERED), sizes)
        size = np.sqrt(weights @ (values ** 2).mean(axis=1) / max(weights.sum(), 1e-30))
        for name, own in _by_origin(item):
            area = weights[own].sum()
            if area <= 0.0:
                continue
            light[name] = light.get(name, 0.0) + weights[own] @ values[own]
            areas[name] = areas.get(name, 0.0) + area
            noise[name] = max(noise.get(name, 0.0), float(entry.error.get('noise', 0.0) * size))
    light = {name: total / areas[name] for name, total in light.items()}
    return Bake(light, areas, noise, report.energy['balance_error'], report.bundles, seconds,
                report.warnings)


def face_numbers(item: bpy.types.Object, attribute: str) -> np.ndarray:
    """Returns (faces,) values of a face attribute, 0 if the mesh does not have it."""
    numbers = np.zeros(len(item.data.polygons), np.int32)
    if attribute in item.data.attributes:
        item.data.attributes[attribute].data.foreach_get('value', numbers)
    return numbers


def _by_origin(item: bpy.types.Object) -> list[tuple[str, np.ndarray]]:
    """Returns (corners,) masks of an object's corners by the name of the original object."""
    if ORIGIN not in item.data.attributes:
        return [(item.name, np.ones(len(item.data.loops), bool))]
    names = bpy.context.scene[ORIGINS]
    origins = np.repeat(face_numbers(item, ORIGIN), face_sizes(item.data))
    return [(names[index], origins == index) for index in np.unique(origins)]
