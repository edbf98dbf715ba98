# SPDX-License-Identifier: GPL-3.0-or-later
"""Differences between the bake and Cycles are named in a warning, with what to do.

Lamps and worlds that the viewport or a view layer hides are treated as in Cycles.
"""

import bpy
import numpy as np
import pytest
import raybundle
from conftest import CUBE_FACES, CUBE_VERTICES
from cycles_reference import bake_objects
from raybundle.light_sets import LightSet
from raybundle.scene_export import export_scene
from surface_error import read_colors

SQUARE = [(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)]


@pytest.fixture
def floor(new_object, new_material, new_light):
    item = new_object("Floor", SQUARE, [(0, 1, 2, 3)], new_material("Grey", (0.5, 0.5, 0.5)))
    new_light("Lamp", 'POINT', 100.0, (0, 0, 2))
    return item


def warnings():
    bpy.context.view_layer.update()
    return export_scene(bpy.context).warnings


def test_a_plain_scene_is_without_a_word(floor):
    assert warnings() == []


def test_bumps_are_not_in_cycles_bake_either(floor):
    turn_normals(floor, 'ShaderNodeBump')
    assert warnings() == []


# --------------------------------------------------------------------------------------------------
# Differences that a warning names
# --------------------------------------------------------------------------------------------------


def add_hair(item):
    item.modifiers.new("Hair", 'PARTICLE_SYSTEM')
    settings = item.particle_systems[0].settings
    settings.type, settings.count = 'HAIR', 5


def add_curves(item):
    curves = bpy.data.hair_curves.new("Fur")
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Fur", curves))


def add_volume(item):
    volume = bpy.data.volumes.new("Cloud")
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Cloud", volume))


def add_points(item):
    points = bpy.data.pointclouds.new("Dots")
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Dots", points))


def output_of(tree):
    return next(node for node in tree.nodes if node.type.startswith('OUTPUT_'))


def displace(item):
    material = item.data.materials[0]
    tree = material.node_tree
    node = tree.nodes.new('ShaderNodeDisplacement')
    tree.links.new(node.outputs[0], output_of(tree).inputs['Displacement'])
    owner = material.cycles if hasattr(material.cycles, 'displacement_method') else material
    owner.displacement_method = 'DISPLACEMENT'


def turn_normals(item, kind='ShaderNodeNormalMap'):
    tree = item.data.materials[0].node_tree
    node = tree.nodes.new(kind)
    diffuse = next(node for node in tree.nodes if node.type == 'BSDF_DIFFUSE')
    tree.links.new(node.outputs['Normal'], diffuse.inputs['Normal'])


def cast_caustics(item):
    bpy.data.lights["Lamp"].cycles.is_caustics_light = True


def stand_before(item):
    bpy.context.scene.background_set = bpy.data.scenes.new("Scenery")


def fill(item):
    tree = item.data.materials[0].node_tree
    node = tree.nodes.new('ShaderNodeVolumeAbsorption')
    tree.links.new(node.outputs[0], output_of(tree).inputs['Volume'])


def fill_world(item):
    world = bpy.data.worlds.new("Fog")
    if bpy.app.version < (5, 0, 0):
        world.use_nodes = True
    bpy.context.scene.world = world
    node = world.node_tree.nodes.new('ShaderNodeVolumeAbsorption')
    world.node_tree.links.new(node.outputs[0], output_of(world.node_tree).inputs['Volume'])


def hold_out(item):
    collection = bpy.data.collections.new("Out")
    scene = bpy.context.scene
    scene.collection.children.link(collection)
    scene.collection.objects.unlink(item)
    collection.objects.link(item)
    bpy.context.view_layer.layer_collection.children["Out"].holdout = True


def subdivide(item):
    modifier = item.modifiers.new("Subdivision", 'SUBSURF')
    modifier.levels, modifier.render_levels = 1, 2


def mirror_in_renders(item):
    item.modifiers.new("Mirror", 'MIRROR').show_viewport = False


def override(item):
    bpy.context.view_layer.material_override = item.data.materials[0]


def hide_copy(item):
    copy = item.copy()
    copy.name = "Hidden"
    bpy.context.scene.collection.objects.link(copy)
    copy.hide_set(True)


def set_cycles(**values):
    def change(item):
        for name, value in values.items():
            setattr(bpy.context.scene.cycles, name, value)
    change.__name__ = "_".join(values)
    return change


def offset_terminator(item):
    item.cycles.shadow_terminator_offset = 0.3


@pytest.mark.parametrize("change, parts", [
    (add_hair, ('"Floor"', "strands", "convert")),
    (add_volume, ('"Cloud"', "convert")),
    (displace, ('"Grey"', "displacement", "Displace modifier")),
    (turn_normals, ('"Grey"', "normal maps")),
    (cast_caustics, ('"Lamp"', "Caustics")),
    (stand_before, ('"Scenery"', "background set")),
    (fill, ('"Grey"', "volume")),
    (fill_world, ('"Fog"', "volume")),
    (hold_out, ('"Floor"', "holdout")),
    (subdivide, ('"Floor" (Subdivision: levels 1 in viewport, 2 in renders)', "same settings")),
    (mirror_in_renders, ('"Floor" (Mirror: only in renders)', "same settings")),
    (override, ('"Grey"', "material override")),
    (hide_copy, ('"Hidden"', "hidden in the viewport")),
    (offset_terminator, ('"Floor"', "terminator")),
    # Exposure is in stops: a factor of 1.41 is half a stop.
    (set_cycles(film_exposure=2.0 ** 0.5), ("Exposure of 1.41", "set Raybundle's exposure to 0.5")),
    (set_cycles(use_fast_gi=True), ("Fast GI",)),
    (set_cycles(diffuse_bounces=2), ("2 times",)),
    (set_cycles(sample_clamp_direct=1.0), ("clamps",)),
], ids=lambda value: getattr(value, '__name__', ""))
def test_what_is_not_as_in_cycles_is_named_in_one_line(floor, change, parts):
    change(floor)
    lines = warnings()
    assert len(lines) == 1
    for part in parts:
        assert part in lines[0]


@pytest.mark.parametrize("change, name", [
    pytest.param(add_curves, "Fur", marks=pytest.mark.skipif(
        not hasattr(bpy.data, 'hair_curves'), reason="no hair curves")),
    pytest.param(add_points, "Dots", marks=pytest.mark.skipif(
        not hasattr(bpy.data, 'pointclouds') or not hasattr(bpy.data.pointclouds, 'new'),
        reason="no point clouds"))])
def test_kinds_of_objects_that_are_no_meshes_are_named(floor, change, name):
    change(floor)
    bpy.context.view_layer.update()
    result = export_scene(bpy.context)
    assert [text for text in result.warnings if f'"{name}"' in text and "convert" in text]
    assert name in result.statuses


def test_the_lines_about_many_objects_are_one(new_object, floor):
    for index in range(8):
        hide_copy(floor)
        subdivide(new_object(f"Box {index}", CUBE_VERTICES, CUBE_FACES))
    lines = warnings()
    assert len(lines) == 2 and all("and 5 more" in line for line in lines)


def test_a_material_of_a_volume_alone_is_air(floor):
    fill(floor)
    tree = floor.data.materials[0].node_tree
    for link in list(output_of(tree).inputs['Surface'].links):
        tree.links.remove(link)
    assert export_scene(bpy.context).scene.materials[0].opacity == 0.0


# --------------------------------------------------------------------------------------------------
# Settings that are followed as in Cycles
# --------------------------------------------------------------------------------------------------


def test_what_renders_hide_is_listed_and_named_where_nothing_is_left(new_object, floor):
    box = new_object("Box", CUBE_VERTICES, CUBE_FACES)
    cutter = new_object("Cutter", CUBE_VERTICES, CUBE_FACES)
    box.hide_render = cutter.hide_render = True
    cutter.display_type = 'WIRE'
    bpy.context.view_layer.update()
    export = export_scene(bpy.context)
    assert export.statuses == {"Box": "hidden in renders", "Cutter": "hidden in renders"}
    assert [text for text in export.warnings if '"Box"' in text] == list(export.warnings)
    floor.hide_render = True
    with pytest.raises(raybundle.BakeError, match='"Box": hidden in renders'):
        raybundle.bake(bpy.context)


def collection_of(item):
    scene = bpy.context.scene
    collection = bpy.data.collections.new("Lamps")
    scene.collection.children.link(collection)
    scene.collection.objects.unlink(item)
    collection.objects.link(item)
    bpy.context.view_layer.update()
    return collection, bpy.context.view_layer.layer_collection.children["Lamps"]


def by_eye(item):
    item.hide_set(True)


def in_viewports(item):
    item.hide_viewport = True


def collection_by_eye(item):
    collection_of(item)[1].hide_viewport = True


def collection_in_viewports(item):
    collection_of(item)[0].hide_viewport = True


def as_an_instance_by_eye(item):
    """Puts the lamp into a collection, of which a hidden object is an instance."""
    collection, layer_collection = collection_of(item)
    layer_collection.exclude = True
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection = 'COLLECTION', collection
    bpy.context.scene.collection.objects.link(empty)
    empty.hide_set(True)


HIDING = [by_eye, in_viewports, collection_by_eye, collection_in_viewports, as_an_instance_by_eye]


@pytest.mark.parametrize("hide", HIDING, ids=lambda hide: hide.__name__)
def test_a_lamp_that_only_the_viewport_hides_shines(floor, hide):
    lamp = bpy.data.objects["Lamp"]
    lamp.parent = bpy.data.objects.new("Parent", None)
    lamp.parent.location = (0.5, 0.0, 0.0)
    bpy.context.scene.collection.objects.link(lamp.parent)
    bpy.context.view_layer.update()
    before = export_scene(bpy.context).scene.lights
    scenes, objects = len(bpy.data.scenes), len(bpy.data.objects)
    hide(lamp)
    hidden = lamp.hide_get(), lamp.hide_viewport
    bpy.context.view_layer.update()
    result = export_scene(bpy.context)
    assert len(result.scene.lights) == len(before) == 1
    assert result.scene.lights[0].position == pytest.approx(before[0].position)
    assert result.scene.lights[0].position == pytest.approx([0.5, 0.0, 2.0])
    assert result.scene.lights[0].intensity == pytest.approx(before[0].intensity)
    # The export leaves the file as it was.
    assert (lamp.hide_get(), lamp.hide_viewport) == hidden
    assert len(bpy.data.scenes) == scenes
    assert len(bpy.data.objects) <= objects + 1


@pytest.mark.parametrize("hide", [
    lambda item: setattr(item, 'hide_render', True),
    lambda item: setattr(collection_of(item)[0], 'hide_render', True),
    lambda item: setattr(collection_of(item)[1], 'exclude', True)])
@pytest.mark.parametrize("in_viewport", [False, True])
def test_a_lamp_that_renders_hide_does_not(floor, hide, in_viewport):
    lamp = bpy.data.objects["Lamp"]
    lamp.hide_viewport = in_viewport
    hide(lamp)
    bpy.context.view_layer.update()
    assert export_scene(bpy.context).scene.lights == []


def test_hidden_lamps_belong_to_their_light_sets(floor):
    lamp = bpy.data.objects["Lamp"]
    collection = collection_of(lamp)[0]
    lamp.hide_set(True)
    light_sets = [LightSet("warm", "Warm", frozenset(collection.objects), False)]
    scene = export_scene(bpy.context, None, light_sets).scene
    assert scene.light_sets[0].lights == [0]


@pytest.mark.needs_library
def test_cycles_bakes_the_light_of_hidden_lamps(new_object, new_material, new_light):
    """Raybundle and Cycles have the same light from a hidden lamp.

    Directly below the lamp, the light is P / (4 pi^2 d^2).
    """
    points = [(0.5 * x, 0.5 * y, 0) for y in range(-4, 5) for x in range(-4, 5)]
    faces = [(9 * y + x, 9 * y + x + 1, 9 * y + x + 10, 9 * y + x + 9)
             for y in range(8) for x in range(8)]
    floor = new_object("Floor", points, faces, new_material("Grey", (0.5, 0.5, 0.5)))
    lamp = new_light("Lamp", 'POINT', 100.0, (0, 0, 2), shadow_soft_size=0.0)
    lamp.hide_set(True)
    bpy.context.view_layer.update()
    report = raybundle.bake(bpy.context, output='LIGHTING', domain='POINT', reconstruction='POINT')
    light = read_colors(floor)[40]
    assert light == pytest.approx(np.full(3, 100.0 / (4.0 * np.pi * 4.0) / np.pi), rel=1e-3)
    assert any('"Lamp"' in text and "give light" in text for text in report.warnings)
    # The light of a lamp without size has no noise in Cycles.
    reference = bake_objects([floor], 4, 0)["Floor"]
    corner = np.array(faces).ravel().tolist().index(40)
    assert reference[corner] == pytest.approx(light, rel=2e-3)


def test_a_view_layer_without_the_environment(floor, new_world):
    new_world((0.3, 0.4, 0.5))
    assert export_scene(bpy.context).scene.world == pytest.approx([0.3, 0.4, 0.5])
    bpy.context.view_layer.use_sky = False
    assert not export_scene(bpy.context).scene.world.any()


def test_glass_without_refractive_caustics(floor, new_material):
    tree = floor.data.materials[0].node_tree
    glass = tree.nodes.new('ShaderNodeBsdfGlass')
    tree.links.new(glass.outputs[0], output_of(tree).inputs['Surface'])
    bpy.context.scene.cycles.caustics_refractive = True
    assert not any("Refractive Caustics" in text for text in warnings())
    bpy.context.scene.cycles.caustics_refractive = False
    assert any("Refractive Caustics" in text and '"Grey"' in text for text in warnings())


def set_normals(item, normals):
    """Sets custom normals. normals: one vector per corner."""
    mesh = item.data
    for polygon in mesh.polygons:
        polygon.use_smooth = True
    if bpy.app.version < (4, 1, 0):
        mesh.use_auto_smooth = True
    mesh.normals_split_custom_set(normals)


def test_custom_normals_that_turn_faces(floor):
    set_normals(floor, [(0, 0, 1)] * 4)
    assert warnings() == []
    set_normals(floor, [(0.5, 0, 0.8660254)] * 4)
    assert ['"Floor"' in text and "custom normals" in text for text in warnings()] == [True]


@pytest.mark.parametrize("are_usual", [True, False])
def test_custom_normals_of_a_smooth_box(floor, new_object, new_material, are_usual):
    """Custom normals that equal those of the vertices change nothing.

    The box is long, so that these normals depend on how the normals of the faces are weighted: with
    the angles, which are equal here, and not with the areas.
    """
    vertices = np.array(CUBE_VERTICES) * (5.0, 0.5, 0.5) + (0, 0, 3)
    box = new_object("Box", vertices.tolist(), CUBE_FACES, new_material("Black", (0, 0, 0)))
    outwards = np.array(CUBE_VERTICES) / np.sqrt(3.0)
    normals = outwards if are_usual else outwards * (-1, 1, 1)
    corners = [vertex for face in CUBE_FACES for vertex in face]
    set_normals(box, normals[corners].tolist())
    assert ['"Box"' in text and "custom normals" in text for text in warnings()] == (
        [] if are_usual else [True])
