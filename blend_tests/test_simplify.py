# SPDX-License-Identifier: GPL-3.0-or-later
"""The setting Simplify: copies without the vertices that neither light nor shape needs."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import raybundle
from mathutils.bvhtree import BVHTree
from mathutils.interpolate import poly_3d_calc
from raybundle.bake import prepare
from raybundle.channel_bake import bake_channels
from surface_error import read_colors

pytestmark = pytest.mark.needs_library

TARGET = 0.02
SIDE, CELLS = 6.0, 24


def bake(**overrides):
    return raybundle.bake(bpy.context, **{"simplify": True, "target_error": TARGET, **overrides})


def copy_of(item):
    return next(other for other in bpy.context.scene.objects if other.raybundle.source == item)


@pytest.fixture
def floor(new_object, new_light, new_material):
    """Returns a floor of many quads and two materials, with a box on it, below a lamp."""
    steps = np.linspace(-SIDE / 2, SIDE / 2, CELLS + 1)
    vertices = [(x, y, 0.0) for y in steps for x in steps]
    faces = [(k, k + 1, k + CELLS + 2, k + CELLS + 1) for y in range(CELLS)
             for k in range(y * (CELLS + 1), y * (CELLS + 1) + CELLS)]
    item = new_object("Floor", vertices, faces, new_material("Left", (0.5, 0.5, 0.5)))
    item.data.materials.append(new_material("Right", (0.4, 0.5, 0.6)))
    for polygon in item.data.polygons:
        polygon.material_index = int(polygon.center.x > 0.0)
    layer = item.data.uv_layers.new(name="UVMap")
    for loop in item.data.loops:
        layer.data[loop.index].uv = item.data.vertices[loop.vertex_index].co.xy * 0.1
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(-1.5, 0.5, 0.5))
    lamp = new_light("Lamp", 'AREA', 200.0, (1.0, 0.0, 3.0), size=1.0)
    lamp.rotation_euler = (0.0, 0.2, 0.0)
    bpy.context.view_layer.update()
    return item


def light_at(item, points, domain):
    """Returns the colours that a mesh shows at the points on it that are nearest to given ones."""
    mesh = item.data
    tree = BVHTree.FromPolygons([vertex.co for vertex in mesh.vertices],
                                [tuple(polygon.vertices) for polygon in mesh.polygons])
    colors = read_colors(item)
    found = []
    for point in points:
        place, _, index, distance = tree.find_nearest(point)
        assert distance < 1e-4
        polygon = mesh.polygons[index]
        weights = poly_3d_calc([mesh.vertices[vertex].co for vertex in polygon.vertices], place)
        corners = polygon.loop_indices if domain == 'CORNER' else polygon.vertices
        found.append(sum(weight * colors[corner] for weight, corner in zip(weights, corners)))
    return np.array(found)


@pytest.mark.parametrize("domain", ['CORNER', 'POINT'])
def test_light_stays_within_the_target(floor, domain):
    kept = raybundle.bake(bpy.context, target_error=TARGET, domain=domain)
    points = [vertex.co.copy() for vertex in floor.data.vertices
              # At the edges of the box, the corners of faces inside of it are dark.
              if not (abs(vertex.co.x + 1.5) < 0.51 and abs(vertex.co.y - 0.5) < 0.51)]
    before = light_at(floor, points, domain)
    shown = read_colors(floor)
    if domain == 'POINT':
        shown = shown[[loop.vertex_index for loop in floor.data.loops]]
    size = np.sqrt(np.mean(shown ** 2, axis=0)).max()
    bpy.ops.raybundle.clear()
    report = bake(domain=domain)
    copy = copy_of(floor)
    assert copy.visible_get() and not floor.visible_get() and not floor.data.color_attributes
    assert report.vertices == {
        'before': (CELLS + 1) ** 2 + 8,
        'after': len(copy.data.vertices) + len(copy_of(bpy.data.objects["Cube"]).data.vertices)}
    assert report.vertices['after'] < 0.5 * report.vertices['before']
    off = light_at(copy, points, domain) - before
    # The same lines gave the light of both. Simplifying may change it by twice the target.
    assert np.abs(off).max() < 2.001 * TARGET * size
    entry = next(item for item in report.objects if item.name == copy.name)
    was = next(item for item in kept.objects if item.name == "Floor")
    assert entry.vertices == len(copy.data.vertices) and entry.corners == len(copy.data.loops)
    changed = np.sqrt(entry.error['mesh'] ** 2 - was.error['mesh'] ** 2)
    # Apart from the 25 vertices that are left out above.
    assert changed == pytest.approx(np.sqrt(np.mean(off ** 2, axis=0)).max() / size, rel=0.15)
    assert entry.error['total'] > was.error['total']
    assert report.error['mesh'] > kept.error['mesh']


def test_even_light_needs_the_corners_alone(new_object, new_world):
    """A square under an even sky: four vertices, of the same light."""
    new_world((1.0, 1.0, 1.0))
    steps = np.linspace(0.0, 1.0, 9)
    item = new_object("Square", [(x, y, 0.0) for y in steps for x in steps],
                      [(k, k + 1, k + 10, k + 9) for y in range(8)
                       for k in range(9 * y, 9 * y + 8)])
    report = bake()
    copy = copy_of(item)
    assert len(copy.data.vertices) == 4 and len(copy.data.polygons) == 2
    assert report.vertices == {'before': 81, 'after': 4}
    assert read_colors(copy) == pytest.approx(1.0, rel=TARGET)


def test_what_the_mesh_has_is_carried_over(floor):
    group = floor.vertex_groups.new(name="Weights")
    for vertex in floor.data.vertices:
        group.add([vertex.index], 0.5 + 0.05 * vertex.co.x, 'REPLACE')
    floor.shape_key_add(name="Basis")
    raised = floor.shape_key_add(name="Raised")
    raised.value = 0.0  # which is 1 in new versions
    for point in raised.data:
        point.co.z += 1.0 + 0.1 * point.co.y
    for edge in floor.data.edges:
        ends = [floor.data.vertices[vertex].co for vertex in edge.vertices]
        edge.use_seam = all(abs(end.y - 1.0) < 1e-5 for end in ends)
    bpy.context.view_layer.update()
    report = bake()
    assert not [warning for warning in report.warnings if "has no" in str(warning)]
    copy = copy_of(floor).data
    assert len(copy.vertices) < 0.6 * len(floor.data.vertices)
    for vertex in copy.vertices:
        assert vertex.groups[0].weight == pytest.approx(0.5 + 0.05 * vertex.co.x, abs=1e-5)
        place = copy.shape_keys.key_blocks["Raised"].data[vertex.index].co
        assert place.z == pytest.approx(1.0 + 0.1 * vertex.co.y, abs=1e-5)
    for loop in copy.loops:
        assert np.array(copy.uv_layers["UVMap"].data[loop.index].uv) == pytest.approx(
            np.array(copy.vertices[loop.vertex_index].co.xy) * 0.1, abs=1e-6)
    for polygon in copy.polygons:
        xs = [copy.vertices[vertex].co.x for vertex in polygon.vertices]
        assert min(xs) > -1e-5 if polygon.material_index else max(xs) < 1e-5
    seams = [[copy.vertices[vertex].co for vertex in edge.vertices]
             for edge in copy.edges if edge.use_seam]
    assert all(abs(end.y - 1.0) < 1e-5 for ends in seams for end in ends)
    assert sum((a - b).length for a, b in seams) == pytest.approx(SIDE, rel=1e-5)
    # The area is still covered once.
    assert sum(polygon.area for polygon in copy.polygons) == pytest.approx(SIDE ** 2, rel=1e-5)
    assert all(polygon.normal.z > 0.999 for polygon in copy.polygons)


def test_a_smooth_ball_keeps_its_shape(new_object, new_light):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5, radius=1.0)
    bpy.ops.object.shade_smooth()
    ball = bpy.context.object
    new_light("Lamp", 'POINT', 300.0, (3.0, 1.0, 2.0), shadow_soft_size=0.1)
    bake()
    copy = copy_of(ball)
    assert len(copy.data.vertices) < len(ball.data.vertices) / 3
    tree = BVHTree.FromPolygons([vertex.co for vertex in copy.data.vertices],
                                [tuple(polygon.vertices) for polygon in copy.data.polygons])
    diagonal = np.sqrt(12.0)
    assert max(tree.find_nearest(vertex.co)[3] for vertex in ball.data.vertices) < (
        0.1 * TARGET * diagonal + 1e-5)
    # Closed, as the original is.
    assert len(copy.data.vertices) - len(copy.data.edges) + len(copy.data.polygons) == 2


def test_all_attributes_fit_the_copy(floor):
    light_set = bpy.context.scene.raybundle.light_sets.add()
    light_set.name = "Lamp"
    light_set.collection = bpy.data.collections.new("Lamp")
    light_set.collection.objects.link(bpy.data.objects["Lamp"])
    bake(write_error=True)
    mesh = copy_of(floor).data
    assert len(mesh.attributes["Radiosity Error"].data) == len(mesh.loops)
    assert read_colors(copy_of(floor), "Radiosity Lamp") == pytest.approx(
        read_colors(copy_of(floor)), rel=1e-4)


def test_broken_texture_coordinates_are_no_matter(floor):
    for index, value in ((3, float('nan')), (50, float('inf'))):
        floor.data.uv_layers["UVMap"].data[index].uv = (value, 0.0)
    assert bake(target_error=0.1).vertices['after'] < (CELLS + 1) ** 2


def test_clear_shows_the_originals(floor):
    bake()
    bpy.ops.raybundle.clear()
    assert floor.visible_get() and not any(item.raybundle.source for item in bpy.data.objects)


def test_vertices_are_added_and_removed(floor):
    adaptive = bake(topology='ADAPTIVE', simplify=False)
    both = bake(topology='ADAPTIVE')
    assert both.vertices['before'] == adaptive.vertices['before']
    assert both.vertices['after'] < 0.8 * adaptive.vertices['after']


def test_drafts_keep_the_copies(floor):
    bake()
    copy = copy_of(floor)
    with prepare(bpy.context, {"simplify": True}, is_draft=True).native_scene:
        pass
    prepared = prepare(bpy.context, {"simplify": True}, is_draft=True)
    with prepared.native_scene:
        assert not prepared.settings.simplify
        assert copy in [target.object for target in prepared.export.targets]


def test_channels_are_not_simplified(floor):
    settings = bpy.context.scene.raybundle
    settings.simplify, settings.target_error = True, 0.1
    settings.channel_r, settings.channel_g = 'DIRECT', 'INDIRECT'
    bake_channels(bpy.context)
    assert not any(item.raybundle.source for item in bpy.data.objects)
    assert len(floor.data.color_attributes["Radiosity"].data) == len(floor.data.loops)
