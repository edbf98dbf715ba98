# SPDX-License-Identifier: GPL-3.0-or-later
"""Each object is clean at the default target, not the scene in the mean.

A smooth sphere and a block in a room under a lamp: props that are a small part of the scene's area.
Two seeds tell the noise of each object: what the report says of it must not be less than two thirds
of that, and the target must be reached or a warning name the object. The difference at the corners,
over the root of 2 and relative to the light there, is at its 95th percentile 4 to 5 % on the sphere
(beside the point where it touches the floor) and below 3 % elsewhere; blend_tests/cleanliness.py
measures the scenes so.
"""

from __future__ import annotations

import bmesh
import bpy
import numpy as np
import pytest
import raybundle
from cleanliness import DARK
from conftest import create_material, create_object
from surface_error import corner_areas, read_colors

TARGET = 0.02  # the default

pytestmark = pytest.mark.needs_library


def _object_of(shape: bmesh.types.BMesh, name: str, reflectance: float,
               location: tuple[float, float, float] = (0, 0, 0)) -> bpy.types.Object:
    item = create_object(name, [], [], create_material(name, (reflectance,) * 3), location)
    shape.to_mesh(item.data)
    shape.free()
    return item


def _room_with_props() -> None:
    room = bmesh.new()
    bmesh.ops.create_cube(room, size=8.0)
    bmesh.ops.subdivide_edges(room, edges=room.edges[:], cuts=15, use_grid_fill=True)
    bmesh.ops.reverse_faces(room, faces=room.faces[:])
    _object_of(room, "room", 0.8, (0, 0, 4))
    block = bmesh.new()
    bmesh.ops.create_cube(block, size=1.0)
    item = _object_of(block, "block", 0.8, (-1.5, 1, 2.5))
    item.scale, item.rotation_euler = (2.4, 2.4, 5), (0, 0, 0.3)
    sphere = bmesh.new()
    bmesh.ops.create_uvsphere(sphere, u_segments=64, v_segments=32, radius=1.3)
    _object_of(sphere, "sphere", 0.8, (1.5, -1, 1.3)).data.polygons.foreach_set(
        'use_smooth', np.ones(64 * 32, dtype=bool))
    lamp = [(-0.8, -0.8, 0), (-0.8, 0.8, 0), (0.8, 0.8, 0), (0.8, -0.8, 0)]
    create_object("lamp", lamp, [(0, 1, 2, 3)], create_material("lamp", (1,) * 3, (20,) * 3),
                  (0, 0, 7.8))
    bpy.context.view_layer.update()


def _bake(seed: int) -> tuple[raybundle.BakeReport, dict[str, np.ndarray]]:
    report = raybundle.bake(bpy.context, output='LIGHTING', domain='CORNER', seed=seed)
    return report, {entry.name: read_colors(bpy.data.objects[entry.name]).astype(float)[:, :3]
                    for entry in report.objects}


def test_a_smooth_sphere_in_a_room_is_not_mottled():
    _room_with_props()
    report, first = _bake(1)
    _, second = _bake(2)
    areas = {name: corner_areas(bpy.data.objects[name]) for name in first}
    mean = sum(areas[name] @ first[name].mean(axis=1) for name in first) / sum(
        area.sum() for area in areas.values())
    for entry in report.objects:
        name = entry.name
        off = (first[name] - second[name]) / np.sqrt(2)
        true = np.sqrt((areas[name] @ off ** 2).sum() / (areas[name] @ first[name] ** 2).sum())
        stated = entry.error['noise']
        seen = np.abs(off).max(axis=1) / np.maximum(first[name].max(axis=1), DARK * mean)
        worst = np.percentile(seen, 95)
        assert true < 1.5 * max(stated, 0.005), (name, true, stated)
        assert stated < TARGET or any(f'"{name}"' in text and "noise" in text
                                      for text in report.warnings), (name, stated)
        assert worst < (0.06 if name == "sphere" else 0.04), (name, worst)
