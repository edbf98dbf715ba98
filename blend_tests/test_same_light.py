# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps made of meshes, and lamps in the plane of a wall, give the same light in every orientation.

Scenes are compared before and after a rotation, and one of each kind with Cycles. The compared
values are means over the corners of an object. At the target of 1 %, their noise is below half a
per cent. The tolerance of 2 % is four times this noise. The error of the energy balance is at most
5e-3, as in other closed rooms.
"""

from __future__ import annotations

import bmesh
import bpy
import numpy as np
import pytest
import raybundle
from conftest import create_material, create_object
from cycles_comparison import cycles_light, square
from mathutils import Euler
from surface_error import read_colors
from test_scenes import SCENES

pytestmark = pytest.mark.needs_library

TURN = Euler((0.4, 0.7, 1.1))
SAME, BALANCE = 0.02, 5e-3


def _room(size: float = 4.0, cells: int = 8, reflectance: float = 0.6) -> bpy.types.Object:
    """Returns a cube on the plane z = 0 with its fronts inwards. size: length of an edge, m."""
    grid = bmesh.new()
    bmesh.ops.create_cube(grid, size=size)
    bmesh.ops.subdivide_edges(grid, edges=grid.edges[:], cuts=cells - 1, use_grid_fill=True)
    bmesh.ops.reverse_faces(grid, faces=grid.faces[:])
    mesh = bpy.data.meshes.new("room")
    grid.to_mesh(mesh)
    grid.free()
    mesh.materials.append(create_material("room", (reflectance,) * 3))
    item = bpy.data.objects.new("room", mesh)
    item.location.z = 0.5 * size
    bpy.context.scene.collection.objects.link(item)
    return item


def _lamp_material(radiance: float, reflectance: float = 0.5) -> bpy.types.Material:
    return create_material("lamp", (reflectance,) * 3, (radiance,) * 3)


def _turn_all() -> None:
    bpy.context.view_layer.update()
    for item in bpy.context.scene.objects:
        if item.parent is None:
            item.matrix_world = TURN.to_matrix().to_4x4() @ item.matrix_world
    bpy.context.view_layer.update()


def _bake(**settings: object) -> raybundle.BakeReport:
    bpy.context.view_layer.update()
    return raybundle.bake(bpy.context, output='LIGHTING', **{'target_error': 0.01, **settings})


def _means(report: raybundle.BakeReport) -> dict[str, float]:
    return {entry.name: float(read_colors(bpy.data.objects[entry.name]).mean())
            for entry in report.objects}


@pytest.mark.parametrize("name", ["cornell_box", "two_rooms"])
def test_a_turned_scene_has_the_same_light(name):
    means = []
    for turned in (False, True):
        bpy.ops.wm.open_mainfile(filepath=str(SCENES / f"{name}.blend"))
        if turned:
            _turn_all()
        report = _bake()
        assert report.energy['balance_error'] < BALANCE
        means.append(_means(report))
    # For objects with less than a twentieth of the brightest light, the tolerance is relative to
    # this twentieth.
    floor = 0.05 * max(means[0].values())
    for item, light in means[0].items():
        assert means[1][item] == pytest.approx(light, rel=SAME, abs=SAME * floor), item


CUBE = ([(x, y, z) for x in (-.5, .5) for y in (-.5, .5) for z in (-.5, .5)],
        [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
TRIANGLE = ([(-1, -1, 0), (1, -1, 0), (0, 1, 0)], [(0, 1, 2)])


@pytest.mark.parametrize("shape, own", [(square(2.0, 1), 0.0), (square(2.0, 4), 0.0),
                                        (TRIANGLE, 0.0), (CUBE, 0.3)],
                         ids=["quad", "4 x 4", "triangle", "cube"])
def test_a_tilted_emitter_lights_the_ground_as_in_cycles_and_not_itself(shape, own):
    ground = create_object("ground", *square(10.0, 16), create_material("ground", (0.5,) * 3))
    lamp = create_object("lamp", *shape, _lamp_material(10.0, 0.8), (0.3, -0.2, 2.5))
    lamp.rotation_euler = (0.4, 0.2, 0.3)
    report = _bake()
    # The sides of the cube get light that the ground reflects. The other lamps face up and get no
    # light, except for rounding errors of the reconstruction.
    assert read_colors(lamp).max() <= max(own, 5e-4)
    assert report.energy['balance_error'] < BALANCE
    light = read_colors(ground).mean()
    assert light == pytest.approx(cycles_light([ground])["ground"].mean(), rel=SAME)


def _torus(major: float, minor: float, steps: tuple[int, int], height: float) -> bpy.types.Object:
    bpy.ops.mesh.primitive_torus_add(major_radius=major, minor_radius=minor,
                                     major_segments=steps[0], minor_segments=steps[1],
                                     location=(0, 0, height))
    return bpy.context.object


def test_the_order_of_a_lamps_faces_does_not_matter():
    means = []
    for settings in ({}, {'shuffled': True}, {'first_shot': 'SHOOT', 'target_error': 0.03}):
        bpy.ops.wm.read_homefile(use_empty=True)
        room = _room(reflectance=0.0)
        lamp = _torus(0.4, 0.03, (48, 12), 3.5)
        if settings.pop('shuffled', False):
            mesh = bmesh.new()
            mesh.from_mesh(lamp.data)
            order = np.random.default_rng(1).permutation(len(mesh.faces))
            for face, index in zip(mesh.faces, order):
                face.index = int(index)
            mesh.faces.sort()
            mesh.to_mesh(lamp.data)
            mesh.free()
        lamp.data.materials.append(_lamp_material(50.0, 0.0))
        _bake(**settings)
        means.append(read_colors(room).mean())
    assert means[1] == pytest.approx(means[0], rel=5e-3)
    assert means[2] == pytest.approx(means[0], rel=0.01), "a mean over 9216 corners of 3 % noise"


def _point_at_wall() -> None:
    lamp = bpy.data.lights.new("lamp", 'POINT')
    lamp.energy, lamp.shadow_soft_size = 100.0, 0.0
    item = bpy.data.objects.new("lamp", lamp)
    item.location = (0, 1.99, 2)
    bpy.context.scene.collection.objects.link(item)


def _area(height: float, size: float) -> None:
    lamp = bpy.data.lights.new("lamp", 'AREA')
    lamp.energy, lamp.size = 100.0, size
    item = bpy.data.objects.new("lamp", lamp)
    item.location.z = height
    bpy.context.scene.collection.objects.link(item)


def _tube() -> None:
    bpy.ops.mesh.primitive_cylinder_add(vertices=24, radius=0.05, depth=2, location=(0, 0, 3.8),
                                        rotation=(np.pi / 2, 0, 0))
    bpy.context.object.data.materials.append(_lamp_material(30.0))


def _bulb() -> None:
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1, location=(0, 0, 3.2))
    bpy.context.object.data.materials.append(_lamp_material(250.0))


def _block() -> None:
    bpy.ops.mesh.primitive_cube_add(size=0.4, location=(0, 0, 3.5))
    bpy.context.object.data.materials.append(_lamp_material(10.0))


def test_lamps_of_mesh_need_no_more_bundles_than_others():
    """The light of a mesh lamp has noise on the lamp itself and on surfaces near it.

    More bundles do not reduce this noise. A mesh lamp may therefore need at most twice as many
    bundles as an area light.
    """
    def bundles(lamp) -> int:
        bpy.ops.wm.read_homefile(use_empty=True)
        _room(cells=16)
        create_object("box", *CUBE, create_material("box", (0.6,) * 3), (0.3, 0.2, 0.51))
        lamp()
        report = _bake(target_error=0.02)
        assert report.error['noise'] <= 0.022
        return report.bundles

    area = bundles(lambda: _area(3.9, 0.5))
    for lamp in (_bulb, _point_at_wall, _block, _tube):
        assert bundles(lamp) <= 2 * area, lamp.__name__


def _panel(location=(0.0, 2.0, 2.0)) -> None:
    panel = create_object("panel", *square(1.0, 1), _lamp_material(10.0), location)
    panel.rotation_euler = (np.pi / 2, 0, 0)


@pytest.mark.parametrize("lamp", [_panel, lambda: _area(4.0, 1.0)], ids=["panel", "area"])
def test_a_lamp_flush_with_a_wall_keeps_the_balance(lamp):
    means = []
    for turned in (False, True):
        bpy.ops.wm.read_homefile(use_empty=True)
        room = _room()
        create_object("box", *CUBE, create_material("box", (0.6,) * 3), (0.3, 0.2, 0.5))
        lamp()
        if turned:
            _turn_all()
        report = _bake()
        assert report.energy['balance_error'] < BALANCE
        means.append(read_colors(room).mean())
    assert means[1] == pytest.approx(means[0], rel=SAME)
