# SPDX-License-Identifier: GPL-3.0-or-later
"""The data that the add-on exports to the native library.

Counts, areas, orientation, materials, lights and world are checked. Coordinates are in single
precision, so that tolerances are 1e-6, relative, unless a comment gives another reason.
"""

import math

import bpy
import numpy as np
import pytest
from conftest import CUBE_FACES, CUBE_VERTICES
from mathutils import Matrix
from raybundle.corner_map import CORNER_CODE, VERTEX_CODE, build_corner_map
from raybundle.light_export import (area_light_radiance,
                                    sun_irradiance_factor)
from raybundle.materials import cycles_bake
from raybundle.materials.principled import PrincipledSockets, principled_albedo
from raybundle.materials.scattering import LAMBERT, OREN_NAYAR
from raybundle.scene_export import export_scene

# Albedo of the diffuse part of a Principled shader with roughness 0.5, without specular reflection.
ALBEDO = principled_albedo(PrincipledSockets(0.5, 0.0, 1.5, 0.0, False, 0.5), 1.0).diffuse[0]
SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]


def export():
    return export_scene(bpy.context)


def world_vertices(scene, instance):
    vertices = scene.meshes[instance.mesh].vertices
    return vertices @ instance.transform[:, :3].T + instance.transform[:, 3]


def face_area_vectors(scene, instance):
    """Returns (faces, 3): area times normal of each face in the world, m^2, by its triangle fan."""
    mesh, points = scene.meshes[instance.mesh], world_vertices(scene, instance)
    vectors = []
    for first, last in zip(mesh.face_offsets[:-1], mesh.face_offsets[1:]):
        ring = points[mesh.corner_vertices[first:last]]
        vectors.append(0.5 * np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0))
    sign = np.sign(np.linalg.det(instance.transform[:, :3]))
    return np.array(vectors) * sign


def area(scene):
    return sum(np.linalg.norm(face_area_vectors(scene, item), axis=1).sum()
               for item in scene.instances)


# --------------------------------------------------------------------------------------------------
# Geometry
# --------------------------------------------------------------------------------------------------


def test_box_counts_areas_and_winding(new_object):
    new_object("Box", CUBE_VERTICES, CUBE_FACES, location=(3, 4, 5))
    scene = export().scene
    mesh = scene.meshes[0]
    assert (len(mesh.vertices), mesh.corner_count, mesh.face_count) == (8, 24, 6)
    assert area(scene) == pytest.approx(24.0)
    vectors = face_area_vectors(scene, scene.instances[0])
    centres = np.array([world_vertices(scene, scene.instances[0])[list(face)].mean(axis=0)
                        for face in CUBE_FACES])
    # Each face points away from the centre of the box.
    assert ((centres - [3, 4, 5]) * vectors).sum(axis=1).min() > 0.0


def test_negative_scale_keeps_front_sides_outside(new_object):
    item = new_object("Box", CUBE_VERTICES, CUBE_FACES)
    item.scale = (-1.0, 2.0, 1.0)
    bpy.context.view_layer.update()
    scene = export().scene
    vectors = face_area_vectors(scene, scene.instances[0])
    points = world_vertices(scene, scene.instances[0])
    centres = np.array([points[list(face)].mean(axis=0) for face in CUBE_FACES])
    assert (centres * vectors).sum(axis=1).min() > 0.0
    # The box is 2 x 4 x 2 m: two faces have 4 m^2 and four have 8 m^2.
    assert area(scene) == pytest.approx(40.0)


def test_ngons_stay_ngons(new_object):
    angles = np.arange(7) * 2.0 * np.pi / 7
    ring = [(math.cos(angle), math.sin(angle), 0.0) for angle in angles]
    new_object("Heptagon", ring, [tuple(range(7))])
    scene = export().scene
    assert scene.meshes[0].face_offsets.tolist() == [0, 7]
    assert area(scene) == pytest.approx(3.5 * math.sin(2.0 * np.pi / 7))


def test_modifiers_are_applied_and_leave_no_trace(new_object):
    item = new_object("Square", SQUARE, [(0, 1, 2, 3)])
    array = item.modifiers.new("Array", 'ARRAY')
    array.count = 3
    result = export()
    assert result.scene.meshes[0].face_count == 3
    assert area(result.scene) == pytest.approx(3.0)
    assert [attribute.name for attribute in item.data.attributes
            if attribute.name in (VERTEX_CODE, CORNER_CODE)] == []
    # Each of the four original corners has the value of the copy in its place.
    corner_map = result.targets[0].corner_map
    assert (corner_map.copied, corner_map.untraced) == (4, 0)
    values = np.repeat([[1.0], [2.0], [6.0]], 4, axis=0) * np.ones(3)
    assert corner_map.to_original(values) == pytest.approx(np.full((4, 3), 1.0))
    assert any("copy faces" in text and '"Square"' in text for text in result.warnings)


@pytest.mark.parametrize("offset", [-1.0, 0.0, 1.0])
@pytest.mark.parametrize("flips", [False, True])
def test_of_solidify_the_shell_that_looks_as_the_face_does(new_object, offset, flips):
    item = new_object("Deck", SQUARE, [(0, 1, 2, 3)])
    solidify = item.modifiers.new("Solidify", 'SOLIDIFY')
    solidify.thickness, solidify.offset, solidify.use_flip_normals = 0.05, offset, flips
    result = export()
    mesh, corner_map = result.scene.meshes[0], result.targets[0].corner_map
    faces = np.searchsorted(mesh.face_offsets, corner_map.evaluated, side='right') - 1
    assert len(set(faces)) == 1 and len(faces) == 4
    corners = mesh.vertices[mesh.corner_vertices[mesh.face_offsets[faces[0]]:][:4]]
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[1])
    assert normal[2] > 0
    places = corner_map.to_original(mesh.vertices[mesh.corner_vertices])
    assert places[:, :2] == pytest.approx(np.array(SQUARE, float)[:, :2], abs=1e-6)


def test_subdivision_surface_maps_back_to_the_corners(new_object):
    item = new_object("Box", CUBE_VERTICES, CUBE_FACES)
    item.modifiers.new("Subdivision", 'SUBSURF').levels = 2
    result = export()
    mesh, corner_map = result.scene.meshes[0], result.targets[0].corner_map
    assert mesh.face_count == 6 * 16
    assert (corner_map.original_count, corner_map.untraced) == (24, 0)
    # Each original corner has exactly one evaluated corner, in the same octant.
    assert sorted(corner_map.original) == list(range(24)) and corner_map.copied == 0
    positions = corner_map.to_original(mesh.vertices[mesh.corner_vertices])
    original = np.array(CUBE_VERTICES, float)[[index for face in CUBE_FACES for index in face]]
    assert np.array_equal(np.sign(positions), np.sign(original))


@pytest.mark.parametrize("modifier, settings", [
    ('BEVEL', {'width': 0.2}), ('REMESH', {'voxel_size': 0.2}), ('SOLIDIFY', {'thickness': 0.1}),
    ('TRIANGULATE', {}), ('DECIMATE', {'ratio': 0.5}), ('MIRROR', {}), ('EDGE_SPLIT', {}),
])
def test_every_corner_gets_the_light_of_its_place(new_object, modifier, settings):
    item = new_object("Box", CUBE_VERTICES, CUBE_FACES)
    added = item.modifiers.new(modifier.title(), modifier)
    for name, value in settings.items():
        setattr(added, name, value)
    result = export()
    mesh, corner_map = result.scene.meshes[0], result.targets[0].corner_map
    positions = corner_map.to_original(mesh.vertices[mesh.corner_vertices])
    original = np.array(CUBE_VERTICES, float)[[index for face in CUBE_FACES for index in face]]
    if modifier == 'MIRROR':
        assert positions == pytest.approx(original, abs=1e-6)
    elif modifier == 'DECIMATE':
        # DECIMATE removes vertices. All corners get positions on the box.
        assert np.abs(positions).max() <= 1.0 + 1e-6
    else:
        # Positions move by at most the width of the bevel, or by the size of a voxel.
        assert np.linalg.norm(positions - original, axis=1).max() < 0.3
    for count, text in ((corner_map.untraced, "no trace"), (corner_map.copied, "copy faces")):
        lines = [line for line in result.warnings if text in line and '"Box"' in line]
        assert len(lines) == (1 if count else 0)
    assert bool(corner_map.untraced) == (modifier in ('BEVEL', 'REMESH', 'DECIMATE'))
    assert bool(corner_map.copied) == (modifier in ('SOLIDIFY', 'MIRROR'))
    if modifier not in ('DECIMATE', 'REMESH'):
        # The evaluated corner belongs to the same face as the original corner, or to what remains
        # of this face.
        faces = np.searchsorted(mesh.face_offsets, corner_map.evaluated, side='right') - 1
        for corner, face in zip(corner_map.original, faces):
            ring = mesh.vertices[mesh.corner_vertices[mesh.face_offsets[face]:][:3]]
            ring = np.asarray(ring, float)
            normal = np.cross(ring[1] - ring[0], ring[2] - ring[1])
            box = np.array(CUBE_VERTICES, float)[list(CUBE_FACES[corner // 4])]
            wanted = np.cross(box[1] - box[0], box[2] - box[1])
            assert normal @ wanted > 0.9 * np.linalg.norm(normal) * np.linalg.norm(wanted)


def test_interpolated_codes_are_not_mistaken_for_corners(new_object):
    # A grid of 50 x 50 squares is subdivided once. Only the original corners have exact codes.
    size = 50
    vertices = [(x, y, 0) for y in range(size + 1) for x in range(size + 1)]
    faces = [(i, i + 1, i + size + 2, i + size + 1)
             for y in range(size) for i in range(y * (size + 1), y * (size + 1) + size)]
    item = new_object("Grid", vertices, faces)
    modifier = item.modifiers.new("Subdivision", 'SUBSURF')
    modifier.subdivision_type = 'SIMPLE'
    modifier.levels = 1
    result = export()
    mesh, corner_map = result.scene.meshes[0], result.targets[0].corner_map
    assert (mesh.face_count, corner_map.untraced) == (4 * size ** 2, 0)
    positions = mesh.vertices[mesh.corner_vertices][corner_map.evaluated]
    expected = np.array(vertices, float)[np.array(faces).ravel()][corner_map.original]
    assert positions == pytest.approx(expected, abs=1e-4)


def test_unchanged_topology_maps_one_to_one(new_object):
    item = new_object("Box", CUBE_VERTICES, CUBE_FACES)
    item.modifiers.new("Cast", 'CAST')
    assert export().targets[0].corner_map.is_identity
    assert build_corner_map(item.data, item.data).is_identity


def test_objects_with_one_mesh_export_it_once(new_object):
    first = new_object("First", SQUARE, [(0, 1, 2, 3)])
    second = bpy.data.objects.new("Second", first.data)
    second.location.z = 2.0
    bpy.context.scene.collection.objects.link(second)
    # A mesh with equal content counts as the same mesh.
    third = bpy.data.objects.new("Third", first.data.copy())
    bpy.context.scene.collection.objects.link(third)
    bpy.context.view_layer.update()
    result = export()
    assert len(result.scene.meshes) == 1
    assert [item.name for item in result.scene.instances] == ["First", "Second", "Third"]
    assert len(result.targets) == 3


def test_materials_of_objects_split_a_shared_mesh(new_object, new_material):
    first = new_object("First", SQUARE, [(0, 1, 2, 3)], new_material("Red", (1, 0, 0)))
    second = bpy.data.objects.new("Second", first.data)
    bpy.context.scene.collection.objects.link(second)
    second.material_slots[0].link = 'OBJECT'
    second.material_slots[0].material = new_material("Blue", (0, 0, 1))
    bpy.context.view_layer.update()
    scene = export().scene
    materials = [scene.materials[scene.meshes[item.mesh].face_materials[0]]
                 for item in scene.instances]
    reflectances = [material.front.reflectance.constant for material in materials]
    assert reflectances[0].tolist() == [1, 0, 0] and reflectances[1].tolist() == [0, 0, 1]


def test_collection_instances_light_but_get_no_colours(new_object):
    item = new_object("Lamp", SQUARE, [(0, 1, 2, 3)])
    collection = bpy.data.collections.new("Lamps")
    bpy.context.scene.collection.objects.unlink(item)
    collection.objects.link(item)
    for index in range(3):
        empty = bpy.data.objects.new(f"Empty {index}", None)
        empty.instance_type = 'COLLECTION'
        empty.instance_collection = collection
        empty.location.x = 2.0 * index
        bpy.context.scene.collection.objects.link(empty)
    bpy.context.view_layer.update()
    result = export()
    assert [item.role for item in result.scene.instances] == ['OCCLUDE'] * 3
    assert sorted(item.transform[0, 3] for item in result.scene.instances) == [0, 2, 4]
    assert result.targets == []
    assert all("instance" in status for status in result.statuses.values())


@pytest.mark.parametrize("add", [
    lambda: bpy.ops.object.text_add(),
    lambda: bpy.ops.object.metaball_add(),
    lambda: bpy.ops.surface.primitive_nurbs_surface_sphere_add(),
])
def test_whatever_evaluates_to_a_mesh_takes_part(add):
    add()
    name = bpy.context.object.name
    result = export()
    assert [item.role for item in result.scene.instances] == ['OCCLUDE']
    assert result.scene.meshes[0].face_count > 0
    assert "no colours" in result.statuses[name]


def test_a_curve_without_surface_is_passed_over():
    bpy.ops.curve.primitive_bezier_curve_add()
    result = export()
    assert result.scene.instances == [] and result.warnings == []


def test_roles_and_hidden_objects(new_object):
    roles = {"Bake": 'BAKE', "Occlude": 'OCCLUDE', "Ignore": 'IGNORE'}
    for name, role in roles.items():
        new_object(name, SQUARE, [(0, 1, 2, 3)]).raybundle.role = role
    new_object("Hidden", SQUARE, [(0, 1, 2, 3)]).hide_render = True
    collection = bpy.data.collections.new("Hidden")
    bpy.context.scene.collection.children.link(collection)
    inside = new_object("Inside", SQUARE, [(0, 1, 2, 3)])
    bpy.context.scene.collection.objects.unlink(inside)
    collection.objects.link(inside)
    collection.hide_render = True
    bpy.context.view_layer.update()
    result = export()
    assert {item.name: item.role for item in result.scene.instances} == {
        "Bake": 'BAKE', "Occlude": 'OCCLUDE'}
    assert [target.object.name for target in result.targets] == ["Bake"]


def test_selected_objects_bake_and_the_others_occlude(new_object):
    first = new_object("First", SQUARE, [(0, 1, 2, 3)])
    new_object("Second", SQUARE, [(0, 1, 2, 3)])
    result = export_scene(bpy.context, {first})
    assert [(item.name, item.role) for item in result.scene.instances] == [
        ("First", 'BAKE'), ("Second", 'OCCLUDE')]


def test_smooth_and_flat_normals(new_object):
    item = new_object("Box", CUBE_VERTICES, CUBE_FACES)
    flat = export().scene.meshes[0].corner_normals
    # In a flat face all corners have the normal of the face, with exactly one component of 1 or -1.
    assert np.abs(flat).max(axis=1) == pytest.approx(np.ones(24))
    item.data.polygons.foreach_set('use_smooth', [True] * 6)
    item.data.update()
    bpy.context.view_layer.update()
    smooth = export().scene.meshes[0]
    positions = smooth.vertices[smooth.corner_vertices]
    # The mean of the normals of three faces points along the diagonal. Blender may store normals in
    # 16 bits.
    assert smooth.corner_normals == pytest.approx(positions / math.sqrt(3.0), abs=1e-4)
    # Corners of smooth faces have the normals of their vertices, those of flat faces the normal of
    # the face.
    flags = [True, False] * 3
    item.data.polygons.foreach_set('use_smooth', flags)
    item.data.update()
    bpy.context.view_layer.update()
    mixed = export().scene.meshes[0]
    assert mixed.face_smooth.tolist() == flags
    is_smooth = np.repeat(flags, 4)[:, None]
    at_vertices = smooth.corner_normals
    if bpy.app.version >= (4, 1, 0):
        # The edges of flat faces are sharp. Vertex normals are the mean over smooth faces only.
        sums = np.zeros((8, 3))
        np.add.at(sums, mixed.corner_vertices, np.where(is_smooth, flat, 0.0))
        at_vertices = sums[mixed.corner_vertices]
        at_vertices /= np.maximum(np.linalg.norm(at_vertices, axis=1, keepdims=True), 1e-9)
    assert mixed.corner_normals == pytest.approx(
        np.where(is_smooth, at_vertices, flat), abs=1e-4)


@pytest.mark.skipif(bpy.app.version >= (4, 1, 0), reason="edges split normals by themselves")
def test_auto_smooth_splits_the_normals_of_sharp_edges(new_object):
    item = new_object("Box", CUBE_VERTICES, CUBE_FACES)
    flat = export().scene.meshes[0].corner_normals
    item.data.polygons.foreach_set('use_smooth', [True] * 6)
    item.data.use_auto_smooth, item.data.auto_smooth_angle = True, math.radians(30.0)
    item.data.update()
    bpy.context.view_layer.update()
    assert export().scene.meshes[0].corner_normals == pytest.approx(flat, abs=1e-4)


def test_meshes_with_the_same_counts_stay_apart_and_copies_do_not(new_object):
    stretched = [(2.0 * x, y, z) for x, y, z in CUBE_VERTICES]
    for name, vertices in (("A", CUBE_VERTICES), ("B", stretched), ("C", CUBE_VERTICES),
                           ("D", stretched)):
        new_object(name, vertices, CUBE_FACES)
    result = export().scene
    assert [item.mesh for item in result.instances] == [0, 1, 0, 1]
    assert len(result.meshes) == 2


def test_meshes_that_differ_only_in_how_faces_are_shaded_stay_apart(new_object):
    # The normals of a plane grid do not depend on the shading.
    places = [(x, y, 0.0) for y in range(3) for x in range(3)]
    faces = [(k, k + 1, k + 4, k + 3) for k in (0, 1, 3, 4)]
    flat, smooth = (new_object(name, places, faces) for name in ("Flat", "Smooth"))
    smooth.data.polygons.foreach_set('use_smooth', [True] * 4)
    smooth.data.update()
    bpy.context.view_layer.update()
    meshes = [export().scene.meshes[item.mesh] for item in export().scene.instances]
    assert [mesh.face_smooth.all() for mesh in meshes] == [False, True]
    assert np.allclose(meshes[0].corner_normals, meshes[1].corner_normals)


def test_marked_edges_are_sharp_however_they_are_shaded(new_object):
    # The user guide says: mark edges as sharp where light must not be blended.
    item = new_object("Box", CUBE_VERTICES, CUBE_FACES)
    item.data.edges[3].use_edge_sharp = True
    for is_smooth in (False, True):
        item.data.polygons.foreach_set('use_smooth', [is_smooth] * 6)
        item.data.update()
        bpy.context.view_layer.update()
        sharp = export().scene.meshes[0].sharp_edges
        assert sharp.tolist() == [list(item.data.edges[3].vertices)]


# --------------------------------------------------------------------------------------------------
# Bad geometry
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_not_finite_coordinates_leave_the_object_out(new_object, value):
    bad = new_object("Bad", SQUARE, [(0, 1, 2, 3)])
    bad.data.vertices[2].co.z = value
    bad.data.update()
    new_object("Good", SQUARE, [(0, 1, 2, 3)])
    result = export()
    assert [item.name for item in result.scene.instances] == ["Good"]
    assert "not finite" in result.statuses["Bad"]
    assert any('"Bad"' in text for text in result.warnings)


@pytest.mark.parametrize("vertices", [[], SQUARE])
def test_meshes_without_faces(new_object, vertices):
    new_object("Empty", vertices, [])
    result = export()
    assert result.scene.instances == [] and result.statuses == {"Empty": "it has no faces"}


# --------------------------------------------------------------------------------------------------
# Materials
# --------------------------------------------------------------------------------------------------


def exported_material(material):
    mesh = bpy.data.meshes.new("Square")
    mesh.from_pydata(SQUARE, [], [(0, 1, 2, 3)])
    mesh.uv_layers.new(name="UVMap")
    if material is not None:
        mesh.materials.append(material)
    item = bpy.data.objects.new("Square", mesh)
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.update()
    result = export()
    return result.scene.materials[0], result


@pytest.fixture
def principled():
    """Returns a material of a Principled shader without specular reflection."""
    material = bpy.data.materials.new("Principled")
    material.use_nodes = True
    set_specular(material, 0.0)
    return material


def set_specular(material, value):
    inputs = shader_of(material).inputs
    (inputs.get('Specular IOR Level') or inputs['Specular']).default_value = value


def part_of(part, reflectance):
    return part.scale * reflectance + part.offset


def diffuse_of(side):
    return part_of(side.shown.color, side.reflectance.constant)


def shader_of(material):
    return next(node for node in material.node_tree.nodes if node.type == 'BSDF_PRINCIPLED')


def sockets_of(shader, specular, base):
    """Returns the sockets of a Principled shader with the default roughness, 0.5."""
    return PrincipledSockets(0.5, specular, shader.inputs['IOR'].default_value, 0.0,
                             shader.distribution == 'MULTI_GGX', base)


def test_no_material_is_grey():
    for side in exported_material(None)[0].sides:
        assert side.reflectance.constant == pytest.approx(np.full(3, 0.8))


def test_material_without_nodes():
    material = bpy.data.materials.new("Plain")
    if bpy.app.version >= (5, 0, 0):
        pytest.skip("every material has nodes")
    material.use_nodes = False
    material.diffuse_color = (0.1, 0.2, 0.3, 1.0)
    front = exported_material(material)[0].front
    assert front.reflectance.constant == pytest.approx([0.1, 0.2, 0.3])


def test_principled(principled):
    shader = shader_of(principled)
    new = bpy.app.version >= (4, 0, 0)
    shader.inputs['Base Color'].default_value = (0.8, 0.4, 0.2, 1.0)
    shader.inputs['Metallic'].default_value = 0.5
    shader.inputs['Transmission Weight' if new else 'Transmission'].default_value = 0.5
    shader.inputs['Emission Color' if new else 'Emission'].default_value = (1.0, 0.5, 0.0, 1.0)
    shader.inputs['Emission Strength'].default_value = 3.0
    material, result = exported_material(principled)
    base = np.array([0.8, 0.4, 0.2])
    albedo = principled_albedo(sockets_of(shader, 0.0, base), 1.0)
    assert any('"Principled"' in text and "mirrors" in text for text in result.warnings)
    for side in material.sides:
        assert side.reflectance.constant == pytest.approx(
            0.25 * ALBEDO * base + 0.5 * (albedo.metal * base + albedo.metal_edge))
        assert diffuse_of(side) == pytest.approx(0.25 * albedo.shown * base)
        assert side.emission.constant == pytest.approx([3 * math.pi, 1.5 * math.pi, 0.0])


def test_light_under_the_surface_has_a_colour_of_its_own(principled):
    shader = shader_of(principled)
    if 'Subsurface Color' not in shader.inputs:
        pytest.skip("it has the base colour from 4.0 on")
    shader.inputs['Base Color'].default_value = (0.8, 0.4, 0.2, 1.0)
    shader.inputs['Subsurface Color'].default_value = (0.2, 0.4, 0.6, 1.0)
    shader.inputs['Subsurface'].default_value = 0.25
    material, _ = exported_material(principled)
    assert diffuse_of(material.front) == pytest.approx([0.65, 0.4, 0.3])
    assert material.front.reflectance.constant == pytest.approx(ALBEDO * np.array([0.65, 0.4, 0.3]))


@pytest.mark.parametrize("roughness, model", [(0.0, LAMBERT), (0.5, OREN_NAYAR)])
def test_backfacing_separates_the_sides(new_material, roughness, model):
    material = new_material("Sides", (1, 0, 0))
    tree = material.node_tree
    output = next(node for node in tree.nodes if node.type == 'OUTPUT_MATERIAL')
    red = output.inputs['Surface'].links[0].from_socket
    blue = tree.nodes.new('ShaderNodeBsdfDiffuse')
    blue.inputs['Color'].default_value = (0, 0, 1, 1)
    blue.inputs['Roughness'].default_value = roughness
    geometry = tree.nodes.new('ShaderNodeNewGeometry')
    mix = tree.nodes.new('ShaderNodeMixShader')
    tree.links.new(geometry.outputs['Backfacing'], mix.inputs[0])
    tree.links.new(red, mix.inputs[1])
    tree.links.new(blue.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs['Surface'])
    exported, result = exported_material(material)
    front, back = (side.reflectance.constant for side in exported.sides)
    assert front.tolist() == [1, 0, 0]
    assert back[:2].tolist() == [0, 0]
    # One facet of a rough surface absorbs some of the light that its colour reflects. From 4.3 on,
    # Cycles adds the light that several facets reflect, and white facets reflect all light.
    if roughness > 0 and bpy.app.version < (4, 3, 0):
        assert 0.85 < back[2] < 1
    else:
        assert back[2] == pytest.approx(1)
    assert [side.diffuse.model for side in exported.sides] == [LAMBERT, model]
    assert result.warnings == []


def test_mixed_shaders_and_colours_through_a_group(new_material):
    # A group mixes two colours with the factor 0.25, and a reroute passes the result on.
    group = bpy.data.node_groups.new("Tint", 'ShaderNodeTree')
    if bpy.app.version < (4, 0, 0):
        group.inputs.new('NodeSocketColor', "First")
        group.outputs.new('NodeSocketColor', "Result")
    else:
        group.interface.new_socket("First", in_out='INPUT', socket_type='NodeSocketColor')
        group.interface.new_socket("Result", in_out='OUTPUT', socket_type='NodeSocketColor')
    inside, outside = (group.nodes.new(kind) for kind in ('NodeGroupInput', 'NodeGroupOutput'))
    mix = group.nodes.new('ShaderNodeMix')
    mix.data_type = 'RGBA'
    sockets = {socket.identifier: socket for socket in mix.inputs}
    sockets['Factor_Float'].default_value = 0.25
    sockets['B_Color'].default_value = (0.0, 0.8, 0.0, 1.0)
    reroute = group.nodes.new('NodeReroute')
    group.links.new(inside.outputs[0], sockets['A_Color'])
    result_socket = next(item for item in mix.outputs if item.identifier == 'Result_Color')
    group.links.new(result_socket, reroute.inputs[0])
    group.links.new(reroute.outputs[0], outside.inputs[0])

    material = new_material("Grouped")
    tree = material.node_tree
    node = tree.nodes.new('ShaderNodeGroup')
    node.node_tree = group
    color = tree.nodes.new('ShaderNodeRGB')
    color.outputs[0].default_value = (0.4, 0.0, 0.0, 1.0)
    diffuse = next(item for item in tree.nodes if item.type == 'BSDF_DIFFUSE')
    tree.links.new(color.outputs[0], node.inputs[0])
    tree.links.new(node.outputs[0], diffuse.inputs['Color'])
    exported, result = exported_material(material)
    assert exported.front.reflectance.constant == pytest.approx([0.3, 0.2, 0.0])
    assert result.warnings == []


def new_image(values, is_float):
    height, width, _ = values.shape
    image = bpy.data.images.new("Image", width, height, float_buffer=is_float)
    rgba = np.ones((height, width, 4), np.float32)
    rgba[:, :, :3] = values
    image.pixels.foreach_set(rgba.ravel())
    image.update()
    return image


@pytest.mark.parametrize("is_float", [False, True])
def test_image_as_base_colour(principled, is_float):
    values = np.zeros((2, 2, 3), np.float32)
    values[0, 1] = 0.5
    image = new_image(values, is_float)
    tree = principled.node_tree
    texture = tree.nodes.new('ShaderNodeTexImage')
    texture.image = image
    texture.extension = 'EXTEND'
    mapping = tree.nodes.new('ShaderNodeMapping')
    mapping.inputs['Location'].default_value = (0.25, 0.0, 0.0)
    mapping.inputs['Scale'].default_value = (2.0, 3.0, 1.0)
    coordinates = tree.nodes.new('ShaderNodeUVMap')
    tree.links.new(coordinates.outputs[0], mapping.inputs['Vector'])
    tree.links.new(mapping.outputs[0], texture.inputs['Vector'])
    tree.links.new(texture.outputs['Color'], shader_of(principled).inputs['Base Color'])
    material, result = exported_material(principled)
    assert result.warnings == []
    for side in material.sides:
        assert side.reflectance.image == 0
        assert side.reflectance.image_weight == pytest.approx(np.full(3, ALBEDO))
        assert side.reflectance.constant == pytest.approx(np.zeros(3))
    data = result.scene.images[0]
    assert data.extension == 'EXTEND'
    # A texel of 0.5 in 8 bits is 128/255 (127.5 is rounded up), in sRGB. Floats are linear.
    expected = 0.5 if is_float else ((128 / 255 + 0.055) / 1.055) ** 2.4
    assert data.pixels[0, 1] == pytest.approx(np.full(3, expected), rel=1e-3)
    assert data.pixels[1, 0] == pytest.approx(np.zeros(3))
    uvs = result.scene.meshes[0].uvs
    assert uvs == pytest.approx(np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) * [2, 3] + [0.25, 0])


def test_corner_colours_as_base_colour(principled):
    tree = principled.node_tree
    node = tree.nodes.new('ShaderNodeVertexColor')
    node.layer_name = "Paint"
    tree.links.new(node.outputs['Color'], shader_of(principled).inputs['Base Color'])
    mesh = bpy.data.meshes.new("Square")
    mesh.from_pydata(SQUARE, [], [(0, 1, 2, 3)])
    mesh.materials.append(principled)
    paint = mesh.color_attributes.new("Paint", 'FLOAT_COLOR', 'POINT')
    paint.data.foreach_set('color', np.arange(16, dtype=np.float32) / 16)
    item = bpy.data.objects.new("Square", mesh)
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.update()
    scene = export().scene
    for side in scene.materials[0].sides:
        assert side.reflectance.corner_color_weight == pytest.approx(np.full(3, ALBEDO))
    assert scene.meshes[0].corner_colors == pytest.approx(
        (np.arange(16).reshape(4, 4) / 16)[:, :3])


def add_noise(material):
    tree = material.node_tree
    noise = tree.nodes.new('ShaderNodeTexNoise')
    tree.links.new(noise.outputs['Color'], shader_of(material).inputs['Base Color'])
    shader_of(material).inputs['Base Color'].default_value = (0.1, 0.2, 0.3, 1.0)
    return noise


def test_what_cannot_be_read_is_baked_and_named(principled):
    add_noise(principled)
    material, result = exported_material(principled)
    pixels = result.scene.images[material.front.reflectance.image].pixels
    # The mean of the noise is near 0.5. Texels of 0 are outside the face.
    assert 0.3 < pixels[pixels > 0].mean() < 0.7
    assert len(result.warnings) == 1
    assert '"Principled"' in result.warnings[0] and '"Noise Texture"' in result.warnings[0]
    assert 'baked by Cycles on "Square"' in result.warnings[0]


def fail_to_bake(_stage):
    raise RuntimeError("no bake today")


def test_what_cannot_be_baked_either_is_named(principled, monkeypatch):
    monkeypatch.setattr(cycles_bake._Stage, '_run', fail_to_bake)
    add_noise(principled)
    material, result = exported_material(principled)
    assert material.front.reflectance.constant == pytest.approx(ALBEDO * np.array([0.1, 0.2, 0.3]))
    assert len(result.warnings) == 2
    assert '"Square"' in result.warnings[0] and "no bake today" in result.warnings[0]
    assert '"Principled"' in result.warnings[1] and '"Noise Texture"' in result.warnings[1]


@pytest.mark.parametrize("fails", [False, True])
def test_a_bake_leaves_no_trace(principled, monkeypatch, fails):
    if fails:
        monkeypatch.setattr(cycles_bake._Stage, '_run', fail_to_bake)
    add_noise(principled)
    # A group contains noise too. The bake copies the group.
    group = bpy.data.node_groups.new("Group", 'ShaderNodeTree')
    group.nodes.new('ShaderNodeTexNoise')
    principled.node_tree.nodes.new('ShaderNodeGroup').node_tree = group
    exported_material(principled)
    cycles_bake.discard_all()

    item = bpy.data.objects["Square"]
    other = bpy.data.objects.new("Other", None)
    bpy.context.scene.collection.objects.link(other)
    bpy.context.view_layer.objects.active = other
    other.select_set(True)

    def state():
        scene = bpy.context.scene
        return ({name: sorted(data.name for data in getattr(bpy.data, name))
                 for name in ('meshes', 'objects', 'materials', 'images', 'scenes', 'node_groups',
                              'worlds')},
                scene.name, scene.render.engine, bpy.context.view_layer.objects.active,
                [item.select_get(), other.select_get()], bpy.context.mode,
                [layer.name for layer in item.data.uv_layers],
                [node.name for node in principled.node_tree.nodes],
                principled.node_tree.nodes.active,
                scene.render.bake.margin, scene.render.bake.use_clear)

    before = state()
    export()
    assert state() == before


def test_a_bake_is_kept_until_something_changes(principled, monkeypatch):
    stage = cycles_bake._Stage
    runs = []
    original = stage._run
    monkeypatch.setattr(stage, '_run', lambda self: (runs.append(1), original(self)))
    noise = add_noise(principled)
    ramp = principled.node_tree.nodes.new('ShaderNodeValToRGB')
    principled.node_tree.links.new(noise.outputs['Fac'], ramp.inputs['Fac'])
    principled.node_tree.links.new(ramp.outputs['Color'],
                                   shader_of(principled).inputs['Base Color'])
    exported_material(principled)
    item = bpy.data.objects["Square"]

    def bakes_again():
        count = len(runs)
        bpy.context.view_layer.update()
        export()
        return len(runs) > count

    assert not bakes_again()
    noise.inputs['Scale'].default_value = 7.0
    assert bakes_again() and not bakes_again()
    ramp.color_ramp.elements[0].color = (1, 0, 0, 1)
    assert bakes_again() and not bakes_again()
    item.data.vertices[0].co.z = 0.1
    item.data.update()
    assert bakes_again() and not bakes_again()
    shader_of(principled).location.x += 10.0
    bpy.context.scene.raybundle.target_error = 0.01
    assert not bakes_again()


def test_gloss_is_reflected_and_not_diffuse(principled):
    set_specular(principled, 0.5)
    shader = shader_of(principled)
    base = np.array([0.8, 0.4, 0.0])
    shader.inputs['Base Color'].default_value = (*base, 1.0)
    albedo, alone = (principled_albedo(sockets_of(shader, 0.5, base), filter_glossy)
                     for filter_glossy in (1.0, None))
    material, result = exported_material(principled)
    assert result.warnings == []
    # F0 is 0.04 or slightly less.
    assert 0.04 < albedo.specular[0] < 0.07
    assert material.front.reflectance.constant == pytest.approx(
        albedo.diffuse * base + albedo.specular)
    assert diffuse_of(material.front) == pytest.approx(albedo.shown * base)
    bpy.context.scene.cycles.caustics_reflective = False
    front = exported_material(principled)[0].front
    assert front.reflectance.constant == pytest.approx(alone.diffuse * base)


def test_gloss_beside_an_image(principled):
    set_specular(principled, 0.5)
    values = np.zeros((2, 2, 3), np.float32)
    values[0, 1] = 0.5
    tree = principled.node_tree
    texture = tree.nodes.new('ShaderNodeTexImage')
    texture.image = new_image(values, True)
    tree.links.new(texture.outputs['Color'], shader_of(principled).inputs['Base Color'])
    material, _ = exported_material(principled)
    reflectance, color = material.front.reflectance, material.front.shown.color
    dark, bright = (reflectance.constant + reflectance.image_weight * value for value in (0, 0.5))
    assert (dark > 0.03).all()
    assert part_of(color, dark) == pytest.approx(np.zeros(3))
    assert (part_of(color, bright) > 0.45).all() and (part_of(color, bright) < 0.51).all()


def test_all_of_a_matt_material_is_diffuse(principled):
    tree = principled.node_tree
    texture = tree.nodes.new('ShaderNodeTexImage')
    texture.image = new_image(np.full((2, 2, 3), 0.25, np.float32), True)
    # White minus the image gives the image a negative weight.
    mix = tree.nodes.new('ShaderNodeMixRGB')
    mix.blend_type = 'SUBTRACT'
    mix.inputs['Fac'].default_value = 1.0
    mix.inputs['Color1'].default_value = (1.0, 1.0, 1.0, 1.0)
    tree.links.new(texture.outputs['Color'], mix.inputs['Color2'])
    shader = tree.nodes.new('ShaderNodeBsdfDiffuse')
    tree.links.new(mix.outputs[0], shader.inputs['Color'])
    output = next(node for node in tree.nodes if node.type == 'OUTPUT_MATERIAL')
    tree.links.new(shader.outputs[0], output.inputs['Surface'])
    material, _ = exported_material(principled)
    for side in material.sides:
        assert (side.reflectance.image_weight < 0.0).all()
        assert side.shown.color.scale == pytest.approx(np.ones(3))
        assert side.shown.color.offset == pytest.approx(np.zeros(3))


def test_gloss_of_what_cycles_bakes(principled):
    add_noise(principled)
    matt = exported_material(principled)[0]
    for side in matt.sides:
        assert side.shown.color.scale == pytest.approx(
            np.full(3, matt.front.shown.color.scale[0]))
    set_specular(principled, 0.5)
    shader_of(principled).inputs['Metallic'].default_value = 0.2
    material, result = exported_material(principled)
    pixels = result.scene.images[material.front.reflectance.image].pixels
    whole = pixels[pixels > 0.02].mean()
    diffuse = part_of(material.front.shown.color, whole).mean()
    # The mean of the noise is near 0.5, and 80 % of the base colour is diffuse.
    assert 0.3 < diffuse / 0.8 < 0.7 and diffuse < 0.85 * whole


def test_gloss_alone(principled):
    tree = principled.node_tree
    node = tree.nodes.new('ShaderNodeBsdfGlossy')
    node.inputs['Color'].default_value = (0.8, 0.4, 0.2, 1.0)
    node.inputs['Roughness'].default_value = 0.0
    output = next(node for node in tree.nodes if node.type == 'OUTPUT_MATERIAL')
    tree.links.new(node.outputs[0], output.inputs['Surface'])
    # By default, Filter Glossy makes gloss rougher for diffuse light.
    material, _ = exported_material(principled)
    assert 0.6 < material.front.gloss.roughness < 0.7
    assert (material.front.reflectance.constant < [0.7, 0.35, 0.18]).all()
    bpy.context.scene.cycles.blur_glossy = 0.0
    material, result = exported_material(principled)
    assert material.front.gloss.roughness == 0.0
    assert material.front.gloss.part.scale == pytest.approx(np.ones(3))
    assert material.front.reflectance.constant == pytest.approx([0.8, 0.4, 0.2], rel=1e-3)
    assert (diffuse_of(material.front) == 0.0).all()
    assert any("mirrors" in text for text in result.warnings)


def test_alpha_is_opacity(principled):
    shader_of(principled).inputs['Alpha'].default_value = 0.25
    shader_of(principled).inputs['Base Color'].default_value = (0.8, 0.4, 0.0, 1.0)
    material, result = exported_material(principled)
    assert material.opacity == pytest.approx(0.25)
    # Reflectance includes the opacity: light that passes through is not reflected.
    assert material.front.reflectance.constant == pytest.approx(ALBEDO * np.array([0.2, 0.1, 0.0]))
    assert result.warnings == []


def test_emission_by_image(principled):
    values = np.zeros((2, 2, 3), np.float32)
    values[0, 1] = 0.5
    tree = principled.node_tree
    texture = tree.nodes.new('ShaderNodeTexImage')
    texture.image = new_image(values, True)
    shader = shader_of(principled)
    tree.links.new(texture.outputs['Color'],
                   shader.inputs.get('Emission Color') or shader.inputs['Emission'])
    shader.inputs['Emission Strength'].default_value = 2.0
    material, result = exported_material(principled)
    assert result.warnings == []
    for side in material.sides:
        assert side.reflectance.image is None and side.emission.image == 0
        assert side.emission.image_weight == pytest.approx(np.full(3, 2 * math.pi))
        assert side.emission.constant == pytest.approx(np.zeros(3))


def test_glass_lets_light_through_and_is_named(new_material):
    material = new_material("Window")
    tree = material.node_tree
    glass = tree.nodes.new('ShaderNodeBsdfGlass')
    output = next(node for node in tree.nodes if node.type == 'OUTPUT_MATERIAL')
    tree.links.new(glass.outputs[0], output.inputs['Surface'])
    exported, result = exported_material(material)
    assert not any(side.reflectance.constant.any() for side in exported.sides)
    assert exported.opacity == pytest.approx(0.0)
    assert '"Window"' in result.warnings[0] and "Glass" in result.warnings[0]


def test_translucence_is_laid_out_like_the_reflectance(new_material):
    material = new_material("Leaf")
    tree = material.node_tree
    texture = tree.nodes.new('ShaderNodeTexImage')
    texture.image = new_image(np.full((2, 2, 3), 0.5), True)
    shaders = [tree.nodes.new(f'ShaderNodeBsdf{kind}') for kind in ('Diffuse', 'Translucent')]
    for shader in shaders:
        tree.links.new(texture.outputs['Color'], shader.inputs['Color'])
    mix = tree.nodes.new('ShaderNodeMixShader')
    mix.inputs[0].default_value = 0.25
    for k, shader in enumerate(shaders):
        tree.links.new(shader.outputs[0], mix.inputs[1 + k])
    output = next(node for node in tree.nodes if node.type == 'OUTPUT_MATERIAL')
    tree.links.new(mix.outputs[0], output.inputs['Surface'])
    exported, result = exported_material(material)
    assert result.warnings == []
    for side in exported.sides:
        assert side.reflectance.image == side.translucence.image == 0
        assert side.reflectance.image_weight == pytest.approx([0.75] * 3)
        assert side.translucence.image_weight == pytest.approx([0.25] * 3)
        assert not side.translucence.constant.any()
    assert exported.opacity == 1.0


def test_two_materials_by_face(new_object, new_material):
    item = new_object("Box", CUBE_VERTICES, CUBE_FACES, new_material("Red", (1, 0, 0)))
    item.data.materials.append(new_material("Blue", (0, 0, 1)))
    item.data.polygons[3].material_index = 1
    # An index past the last material: Blender uses the last one that exists.
    item.data.polygons[4].material_index = 7
    item.data.update()
    bpy.context.view_layer.update()
    scene = export().scene
    names = [scene.materials[index].name for index in scene.meshes[0].face_materials]
    assert names == ["Red", "Red", "Red", "Blue", "Blue", "Red"]


# --------------------------------------------------------------------------------------------------
# Lights and world, by the formulas of Cycles (docs/method.md)
# --------------------------------------------------------------------------------------------------


def only_light():
    lights = export().scene.lights
    assert len(lights) == 1
    return lights[0]


def test_point_light(new_light):
    new_light("Point", 'POINT', 40.0, (1, 2, 3), color=(1.0, 0.5, 0.25), shadow_soft_size=0.1)
    light = only_light()
    assert light.intensity == pytest.approx(np.array([40, 20, 10]) / (4 * math.pi))
    assert light.position.tolist() == [1, 2, 3] and light.radius == pytest.approx(0.1)
    sphere = (4, 0, 0) <= bpy.app.version < (4, 1, 0)
    assert light.shape == ('SPHERE' if sphere else 'DISK')
    assert light.world_to_light is None


def test_light_nodes_multiply(new_light):
    item = new_light("Point", 'POINT', 40.0)
    item.data.use_nodes = True
    node = next(node for node in item.data.node_tree.nodes if node.type == 'EMISSION')
    node.inputs['Strength'].default_value = 2.0
    node.inputs['Color'].default_value = (1.0, 0.0, 0.5, 1.0)
    assert only_light().intensity == pytest.approx(np.array([80, 0, 40]) / (4 * math.pi))


def test_spot_light(new_light):
    item = new_light("Spot", 'SPOT', 40.0, spot_size=1.0, spot_blend=0.3)
    item.rotation_euler = (0.0, math.pi / 2, 0.0)
    item.scale = (1.0, 2.0, 1.0)
    bpy.context.view_layer.update()
    light = only_light()
    assert (light.cone_angle, light.cone_blend) == pytest.approx((1.0, 0.3))
    # Cycles does not normalise the intensity for the cone. Up to Blender 3.4, the cosine to the
    # axis dims the light.
    assert light.intensity == pytest.approx(np.full(3, 40 / (4 * math.pi)))
    assert light.cone_dims == (bpy.app.version < (3, 5, 0))
    # The axis of a spot is -Z, which the rotation turns to -X. The scale makes the cone twice as
    # wide in Y, in versions that take the scale into account.
    across = 1.0 if bpy.app.version < (3, 5, 0) else 0.5
    assert light.world_to_light @ [-1, 0, 0] == pytest.approx([0, 0, -1], abs=1e-6)
    assert light.world_to_light @ [0, 1, 0] == pytest.approx([0, across, 0], abs=1e-6)


def test_sun_light(new_light):
    item = new_light("Sun", 'SUN', 3.0, angle=0.1)
    item.rotation_euler = (math.pi / 2, 0.0, 0.0)
    item.scale = (5.0, 5.0, 5.0)
    bpy.context.view_layer.update()
    light = only_light()
    assert light.irradiance == pytest.approx(np.full(3, 3 * sun_irradiance_factor(0.1)))
    assert light.angle == pytest.approx(0.1)
    assert light.direction == pytest.approx([0, -1, 0], abs=1e-6)


@pytest.mark.parametrize("shape, area_share", [
    ('SQUARE', 1.0), ('RECTANGLE', 1.0), ('DISK', math.pi / 4), ('ELLIPSE', math.pi / 4)])
@pytest.mark.parametrize("mirrored", [False, True])
def test_area_light(new_light, shape, area_share, mirrored):
    item = new_light("Area", 'AREA', 10.0, (0, 0, 1), shape=shape, size=2.0)
    item.data.size_y = 0.5
    item.scale = (-3.0 if mirrored else 3.0, 1.0, 1.0)
    bpy.context.view_layer.update()
    light = only_light()
    height = 0.5 if shape in ('RECTANGLE', 'ELLIPSE') else 2.0
    area = 6.0 * height * area_share
    factor = 4.0 if bpy.app.version < (4, 0, 0) else math.pi
    assert light.radiance == pytest.approx(np.full(3, 10.0 / (factor * area)))
    assert light.shape == ('ELLIPSE' if shape in ('DISK', 'ELLIPSE') else 'RECTANGLE')
    # The light faces down, even if it is mirrored.
    assert np.cross(light.axis_u, light.axis_v) == pytest.approx([0, 0, -6.0 * height / 4])


def test_area_light_of_each_version():
    power = np.full(3, 2.0)
    assert area_light_radiance(power, 0.5, True, (3, 6, 0)) == pytest.approx(np.full(3, 1.0))
    assert area_light_radiance(power, 0.5, True, (4, 0, 0)) == pytest.approx(
        np.full(3, 4.0 / math.pi))
    assert area_light_radiance(power, 0.5, False, (4, 5, 0)) == pytest.approx(
        np.full(3, 2.0 / math.pi))


def test_sun_of_each_version():
    assert sun_irradiance_factor(1.0, (4, 0, 0)) == 1.0
    assert sun_irradiance_factor(0.0, (3, 6, 0)) == 1.0
    # Mean of the cosine over a disk of radius r at distance 1, from rings of equal area.
    radius = math.tan(0.5)
    rings = radius ** 2 * (np.arange(10_000) + 0.5) / 10_000
    assert sun_irradiance_factor(1.0, (3, 6, 0)) == pytest.approx(
        (1 / np.sqrt(1 + rings)).mean(), rel=1e-6)


def test_lights_that_give_no_light(new_light):
    new_light("Hidden", 'POINT', 10.0).hide_render = True
    new_light("Off", 'POINT', 0.0)
    new_light("Flat", 'AREA', 10.0).scale = (1.0, 0.0, 1.0)
    bpy.context.view_layer.update()
    assert export().scene.lights == []


def test_spread(new_light):
    new_light("Narrow", 'AREA', 10.0, spread=1.0)
    assert only_light().spread == pytest.approx(1.0)


@pytest.mark.parametrize("kind", ['POINT', 'SPOT', 'SUN', 'AREA'])
def test_light_without_shadows(new_light, kind):
    light = new_light("Fill", kind, 10.0)
    assert only_light().casts_shadows
    # In versions where Cycles has a property of its own, use_shadow is that of Eevee.
    cycles = light.data.cycles
    if hasattr(cycles, 'cast_shadow'):
        light.data.use_shadow = False
        assert only_light().casts_shadows
        cycles.cast_shadow = False
    else:
        light.data.use_shadow = False
    assert not only_light().casts_shadows


def test_visibility(new_object):
    item = new_object("Square", SQUARE, [(0, 1, 2, 3)])
    for flag in ('visible_camera', 'visible_glossy', 'visible_transmission'):
        setattr(item, flag, False)
    bpy.context.view_layer.update()
    instance = export().scene.instances[0]
    assert instance.stops_direct and instance.exchanges
    item.visible_shadow = False
    bpy.context.view_layer.update()
    assert not export().scene.instances[0].stops_direct
    item.visible_shadow, item.visible_diffuse = True, False
    bpy.context.view_layer.update()
    instance = export().scene.instances[0]
    assert instance.stops_direct and not instance.exchanges


def test_world_colour(new_world):
    new_world((0.2, 0.4, 0.6)).inputs['Strength'].default_value = 2.0
    assert export().scene.world == pytest.approx([0.4, 0.8, 1.2])


@pytest.mark.skipif(bpy.app.version >= (5, 0, 0), reason="every world has nodes")
def test_world_without_nodes():
    bpy.context.scene.world = bpy.data.worlds.new("World")
    bpy.context.scene.world.color = (0.2, 0.4, 0.6)
    assert export().scene.world == pytest.approx([0.2, 0.4, 0.6])


def test_transforms_are_object_to_world(new_object):
    item = new_object("Square", SQUARE, [(0, 1, 2, 3)])
    item.matrix_world = Matrix.Translation((1, 2, 3)) @ Matrix.Rotation(0.5, 4, 'X')
    bpy.context.view_layer.update()
    transform = export().scene.instances[0].transform
    assert transform == pytest.approx(np.array(item.matrix_world)[:3])
