# SPDX-License-Identifier: GPL-3.0-or-later
"""The topology 'ADAPTIVE': what the copies of objects have, and what happens to the file."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
import raybundle
from raybundle.live_light import LiveLight
from surface_error import corner_vertices, read_colors

PLANE = [(-5, -5, 0), (5, -5, 0), (5, 5, 0), (-5, 5, 0)]
CUBE = [(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0),
        (-0.5, -0.5, 1), (0.5, -0.5, 1), (0.5, 0.5, 1), (-0.5, 0.5, 1)]
CUBE_FACES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def bake(**overrides):
    return raybundle.bake(bpy.context, **{"topology": 'ADAPTIVE', **overrides})


@pytest.fixture
def cube_on_plane(new_object, new_light, new_material):
    """Returns a plane of two faces, on which a cube stands in the sun."""
    grey = new_material("Grey", (0.5, 0.5, 0.5))
    # The faces share the edge from the middle of the front to that of the back.
    vertices = [*PLANE, (0, -5, 0), (0, 5, 0)]
    plane = new_object("Plane", vertices, [(0, 4, 5, 3), (4, 1, 2, 5)], grey)
    plane.rotation_euler = (0.3, 0.2, 0.7)
    cube = new_object("Cube", CUBE, CUBE_FACES, grey)
    cube.parent = plane
    sun = new_light("Sun", 'SUN', 3.0, (0, 0, 5), angle=0.02)
    sun.rotation_euler = (0.9, 0.2, 0.4)
    bpy.context.view_layer.update()
    return plane


def copy_of(item):
    return next(other for other in bpy.context.scene.objects if other.raybundle.source == item)


def corner_positions(mesh):
    """Returns the position of the vertex of each corner, (c, 3)."""
    return np.array([mesh.vertices[loop.vertex_index].co for loop in mesh.loops])


def border_length(item):
    """Returns the length of the edges that have a single face, by the positions of their ends."""
    use: dict[tuple, int] = {}
    for polygon in item.data.polygons:
        points = [tuple(item.data.vertices[vertex].co) for vertex in polygon.vertices]
        for edge in zip(points, [*points[1:], points[0]]):
            use[tuple(sorted(edge))] = use.get(tuple(sorted(edge)), 0) + 1
    return sum(np.linalg.norm(np.subtract(*edge)) for edge, count in use.items() if count == 1)


# --------------------------------------------------------------------------------------------------
# The mesh
# --------------------------------------------------------------------------------------------------


def test_vertices_follow_the_shadow(cube_on_plane):
    kept = raybundle.bake(bpy.context, topology='KEEP')
    bpy.ops.raybundle.clear()
    report = bake(discontinuity_lines=False)
    copy = copy_of(cube_on_plane)
    assert copy.visible_get() and not cube_on_plane.visible_get()
    assert len(cube_on_plane.data.vertices) == 6 and not cube_on_plane.data.color_attributes
    assert 60 < len(copy.data.vertices) < 1000
    assert report.error["mesh"] < 0.4 * kept.error["mesh"]
    count = sum(len(copy_of(item).data.vertices)
                for item in (cube_on_plane, bpy.data.objects["Cube"]))
    assert report.vertices == {'before': 14, 'after': count} and not kept.vertices
    # Most vertices lie at the shadow, which takes a fiftieth of the plane.
    points = np.array([vertex.co for vertex in copy.data.vertices])
    assert np.median(np.linalg.norm(points[:, :2], axis=1)) < 2.5
    light = read_colors(copy).mean(axis=1)
    assert light.min() < 0.2 * light.max()


def jumps(mesh: bpy.types.Mesh, light: np.ndarray) -> np.ndarray:
    """Returns the difference between the brightest and the darkest corner of each vertex."""
    vertices = corner_vertices(mesh)
    most = np.full(len(mesh.vertices), -np.inf)
    least = np.full(len(mesh.vertices), np.inf)
    np.maximum.at(most, vertices, light)
    np.minimum.at(least, vertices, light)
    return most - least


def test_a_shadow_is_crisp_with_few_vertices(cube_on_plane):
    # Half the target, since the mesh with lines has half the error that it may have.
    without = bake(discontinuity_lines=False, target_error=0.01)
    blurred = read_colors(copy_of(cube_on_plane)).mean(axis=1)
    assert jumps(copy_of(cube_on_plane).data, blurred).max() < 1e-5
    report = bake()
    copy = copy_of(cube_on_plane)
    assert report.vertices['after'] < 0.6 * without.vertices['after']
    assert report.error['mesh'] < 1.2 * without.error['mesh']
    light = read_colors(copy).mean(axis=1)
    # The corners of the shadow, which is a hexagon with one side under the cube.
    assert np.count_nonzero(jumps(copy.data, light) > 0.3 * light.max()) >= 5
    # A vertex with one value cannot show the two sides of an edge.
    report = bake(domain='POINT', target_error=0.01)
    assert report.vertices == without.vertices


def test_vertices_are_counted_before_one_decides(cube_on_plane):
    counted = bake(topology='KEEP', count_adaptive=True)
    assert not counted.vertices and len(cube_on_plane.data.vertices) == 6
    kept = {item.name: item for item in counted.objects}
    assert kept["Cube"].vertices == 8 and kept[cube_on_plane.name].vertices == 6
    # The plane loses the shadow.
    assert kept[cube_on_plane.name].error['mesh'] > 0.05
    report = bake()
    assert report.vertices['after'] == pytest.approx(counted.adaptive_vertices, rel=0.05)
    for item in report.objects:
        assert item.adaptive_vertices == pytest.approx(
            kept[item.name.removesuffix(" (Radiosity)")].adaptive_vertices, rel=0.05)


def test_there_is_neither_a_gap_nor_a_t_junction(cube_on_plane):
    bake(target_error=0.01)
    assert border_length(copy_of(cube_on_plane)) == pytest.approx(40.0, rel=1e-5)
    assert border_length(copy_of(bpy.data.objects["Cube"])) == 0.0
    for item in (cube_on_plane, bpy.data.objects["Cube"]):
        assert sum(face.area for face in copy_of(item).data.polygons) == pytest.approx(
            sum(face.area for face in item.data.polygons), rel=1e-5)


def test_a_furnace_keeps_its_mesh(closed_box):
    bake()
    copy = copy_of(closed_box)
    assert [tuple(face.vertices) for face in copy.data.polygons] == [
        tuple(face.vertices) for face in closed_box.data.polygons]


def test_the_limit_of_vertices_is_kept_and_named(cube_on_plane):
    report = bake(max_vertices=90, target_error=0.005, discontinuity_lines=False)
    assert sum(len(copy_of(item).data.vertices)
               for item in (cube_on_plane, bpy.data.objects["Cube"])) <= 90
    assert any("max_vertices (90) was reached" in warning for warning in report.warnings)
    report = bake(max_vertices=14)
    assert report.vertices == {'before': 14, 'after': 14}
    assert any("max_vertices (14) is not more than the 14 vertices" in warning
               for warning in report.warnings)


def test_only_selected_objects_get_a_copy(cube_on_plane):
    cube_on_plane.select_set(True)
    bpy.data.objects["Cube"].select_set(False)
    bake(scope='SELECTED')
    assert [item.name for item in bpy.data.objects if item.raybundle.source] == [
        "Plane (Radiosity)"]


# --------------------------------------------------------------------------------------------------
# What the user's mesh has
# --------------------------------------------------------------------------------------------------

# Attributes whose values are linear in the position, so that every new vertex has a known value:
# domain, type, property of the elements, and the value at a position.
LINEAR = {
    "point_float": ('POINT', 'FLOAT', 'value', lambda p: p @ [0.3, -0.2, 1.0]),
    "corner_float": ('CORNER', 'FLOAT', 'value', lambda p: p @ [0.1, 0.4, 0.0]),
    "point_vector": ('POINT', 'FLOAT_VECTOR', 'vector', lambda p: 2.0 * p),
    "corner_uv": ('CORNER', 'FLOAT2', 'vector', lambda p: p[:, :2] + 3.0),
    "point_colour": ('POINT', 'FLOAT_COLOR', 'color', lambda p: np.c_[p, p[:, 0]] * 0.1 + 1.0),
    "corner_colour": ('CORNER', 'FLOAT_COLOR', 'color', lambda p: np.c_[p, p[:, 1]] * 0.1 + 1.0),
    # Bytes are of sRGB, in which a linear change is not linear: one value.
    "byte_colour": ('CORNER', 'BYTE_COLOR', 'color', lambda p: np.full((len(p), 4), 1.0)),
}


def add_attributes(mesh):
    points = np.array([vertex.co for vertex in mesh.vertices])
    corners = corner_positions(mesh)
    for name, (domain, data_type, prop, value) in LINEAR.items():
        attribute = mesh.attributes.new(name, data_type, domain)
        at = points if domain == 'POINT' else corners
        attribute.data.foreach_set(prop, value(at).astype(np.float32).ravel())
    mesh.attributes.new("face_number", 'INT', 'FACE').data.foreach_set('value', [7, 9])
    mesh.attributes.new("point_number", 'INT', 'POINT').data.foreach_set(
        'value', list(range(len(points))))
    marked = mesh.attributes.new("edge_mark", 'FLOAT', 'EDGE')
    for edge in mesh.edges:
        is_middle = set(edge.vertices) == {4, 5}
        marked.data[edge.index].value = 0.75 if is_middle else 0.0
        edge.use_seam = edge.use_edge_sharp = is_middle


def test_every_attribute_is_carried_over(cube_on_plane, new_material):
    mesh = cube_on_plane.data
    add_attributes(mesh)
    mesh.materials.append(new_material("Second", (0.3, 0.3, 0.3)))
    mesh.polygons[1].material_index = 1
    for name in ("First", "Second"):
        layer = mesh.uv_layers.new(name=name)
        scale = 1.0 if name == "First" else 2.0
        layer.data.foreach_set(
            'uv', (scale * corner_positions(mesh)[:, :2]).astype(np.float32).ravel())
    mesh.uv_layers.active = mesh.uv_layers["Second"]
    report = bake()
    assert not [warning for warning in report.warnings if "has no" in str(warning)]
    copy = copy_of(cube_on_plane).data
    assert len(copy.vertices) > 60
    points = np.array([vertex.co for vertex in copy.vertices])
    corners = corner_positions(copy)
    for name, (domain, data_type, prop, value) in LINEAR.items():
        attribute = copy.attributes[name]
        assert (attribute.domain, attribute.data_type) == (domain, data_type)
        expected = value(points if domain == 'POINT' else corners)
        found = np.empty(expected.size, np.float32)
        attribute.data.foreach_get(prop, found)
        assert found == pytest.approx(expected.ravel(), abs=1e-4), name
    for name, scale in (("First", 1.0), ("Second", 2.0)):
        uvs = np.array([item.uv for item in copy.uv_layers[name].data])
        assert uvs == pytest.approx(scale * corners[:, :2], abs=1e-4)
    assert copy.uv_layers.active.name == "Second"
    right = np.array([face.center.x > 0 for face in copy.polygons])
    numbers = np.array([item.value for item in copy.attributes["face_number"].data])
    assert np.array_equal(numbers, np.where(right, 9, 7))
    assert np.array_equal([face.material_index for face in copy.polygons], right)
    assert [item.value for item in copy.attributes["point_number"].data][:6] == list(range(6))
    # The edge between the two faces is still marked, and no other.
    ends = np.array([[copy.vertices[vertex].co for vertex in edge.vertices] for edge in copy.edges])
    is_middle = (np.abs(ends[:, :, 0]) < 1e-6).all(axis=1)
    assert is_middle.sum() > 3
    for edge, middle in zip(copy.edges, is_middle):
        # Other edges in the middle cross no face: the faces end there.
        assert edge.use_seam == edge.use_edge_sharp == middle
        assert copy.attributes["edge_mark"].data[edge.index].value == (0.75 if middle else 0.0)


def test_vertex_groups_and_shape_keys_are_carried_over(cube_on_plane):
    group = cube_on_plane.vertex_groups.new(name="Weights")
    empty = cube_on_plane.vertex_groups.new(name="Empty")
    empty.lock_weight = True
    for vertex in cube_on_plane.data.vertices:
        group.add([vertex.index], 0.5 + 0.05 * vertex.co.x, 'REPLACE')
    cube_on_plane.shape_key_add(name="Basis")
    raised = cube_on_plane.shape_key_add(name="Raised")
    for point in raised.data:
        point.co.z += 1.0 + 0.1 * point.co.y
    raised.value = 0.25
    bpy.context.view_layer.update()
    shown = [tuple(vertex.co) for vertex in cube_on_plane.evaluated_get(
        bpy.context.evaluated_depsgraph_get()).data.vertices]
    report = bake()
    assert not [warning for warning in report.warnings if "has no" in str(warning)]
    copy = copy_of(cube_on_plane)
    assert [item.name for item in copy.vertex_groups] == ["Weights", "Empty"]
    assert copy.vertex_groups["Empty"].lock_weight
    basis = copy.data.shape_keys.key_blocks["Basis"].data
    for vertex in copy.data.vertices:
        assert {item.group: item.weight for item in vertex.groups} == {
            0: pytest.approx(0.5 + 0.05 * basis[vertex.index].co.x, abs=1e-5)}
    key = copy.data.shape_keys.key_blocks["Raised"]
    assert key.value == 0.25
    for point, base in zip(key.data, basis):
        assert point.co.z - base.co.z == pytest.approx(1.0 + 0.1 * base.co.y, abs=1e-4)
    evaluated = copy.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    assert np.array([vertex.co for vertex in evaluated.vertices])[:6] == pytest.approx(
        np.array(shown), abs=1e-5)


def test_shape_keys_below_modifiers_are_named(cube_on_plane):
    cube_on_plane.shape_key_add(name="Basis")
    cube_on_plane.modifiers.new("Array", 'ARRAY')
    report = bake()
    assert [str(warning) for warning in report.warnings if "shape keys" in str(warning)] == [
        '"Plane (Radiosity)" has no shape keys, which "Plane" has: they cannot be carried over to '
        'other vertices']


def test_modifiers_that_copy_faces_are_no_matter(cube_on_plane):
    modifier = bpy.data.objects["Cube"].modifiers.new("Array", 'ARRAY')
    modifier.count, modifier.relative_offset_displace = 3, (2.0, 0.0, 0.0)
    kept = bake(topology='KEEP')
    assert any("Modifiers copy faces" in warning for warning in kept.warnings)
    bpy.ops.raybundle.clear()
    assert not any("Modifiers" in warning for warning in bake().warnings)
    # Each of the three cubes is there, with its own light.
    copy = copy_of(bpy.data.objects["Cube"]).data
    assert {round(vertex.co.x) for vertex in copy.vertices} >= {0, 2, 4}
    assert len(copy.vertices) >= 24


def test_smooth_shading_is_kept(new_object, new_light, new_material):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=8)
    sphere = bpy.context.object
    sphere.data.polygons.foreach_set('use_smooth', [True] * len(sphere.data.polygons))
    sphere.data.update()
    new_light("Lamp", 'POINT', 50.0, (1.5, 0.3, 1.2), shadow_soft_size=0.0)
    bake(target_error=0.01)
    copy = copy_of(sphere).data
    assert len(copy.vertices) > 1.5 * len(sphere.data.vertices)
    if bpy.app.version < (4, 1, 0):
        copy.calc_normals_split()
    normals = np.array([loop.normal for loop in copy.loops])
    vertices = np.array([loop.vertex_index for loop in copy.loops])
    means = np.array([normals[vertices == vertex].mean(axis=0)
                      for vertex in range(len(copy.vertices))])
    # All faces at a vertex agree; those of a sphere with flat facets differ by up to 30 degrees.
    assert (normals * means[vertices]).sum(axis=1).min() > 0.9999


# --------------------------------------------------------------------------------------------------
# The file
# --------------------------------------------------------------------------------------------------


def test_the_copy_is_replaced_and_cleared(cube_on_plane):
    names = sorted(item.name for item in bpy.data.objects)
    for _ in range(2):
        bake()
        assert len(bpy.data.objects) == len(names) + 2
    copy = copy_of(cube_on_plane)
    with pytest.raises(raybundle.RaybundleError):
        bake(progress=lambda *_: False)
    assert copy.visible_get() and not cube_on_plane.visible_get()
    assert bpy.ops.raybundle.clear() == {'FINISHED'}
    assert sorted(item.name for item in bpy.data.objects) == names
    assert cube_on_plane.visible_get() and len(bpy.data.meshes) == 2


def test_progress_goes_forwards(cube_on_plane):
    seen = []

    def note(stage, fraction):
        seen.append((stage, fraction))
        return True

    bake(progress=note)
    order = list(dict.fromkeys(stage for stage, _ in seen))
    assert order == ['export', 'patches', 'first_shot', 'bundles', 'solve', 'reconstruction',
                     'write_back']
    # The first pass is a part of the stage of the patches, which the second begins again.
    fractions = [fraction for stage, fraction in seen if stage == 'patches']
    assert sum(b < a for a, b in zip(fractions, fractions[1:])) <= 1


def test_drafts_keep_the_vertices_of_the_copy(cube_on_plane):
    bake()
    copy = copy_of(cube_on_plane)
    before = read_colors(copy)
    settings = bpy.context.scene.raybundle
    settings.topology = 'ADAPTIVE'
    settings.live = True
    live = LiveLight()
    bpy.data.lights["Sun"].energy *= 2.0
    bpy.context.view_layer.update()
    while live.drafts < 1:
        live.step(bpy.context)
    assert copy_of(cube_on_plane) == copy and not cube_on_plane.data.color_attributes
    after = read_colors(copy)
    assert after.shape == before.shape
    assert after.mean() == pytest.approx(2.0 * before.mean(), rel=0.02)
