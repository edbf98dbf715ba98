# SPDX-License-Identifier: GPL-3.0-or-later
"""Use in Material shows the baked attribute, changes no light, and can be taken out exactly."""

import bpy
import numpy as np
import pytest
import raybundle
from cycles_reference import prepare_scene
from raybundle import light_in_material
from raybundle.filled_slots import has_nodes
from scene_items import new_shader
from surface_error import read_colors

WAYS = ['EMISSION', 'COLORED', 'FACTOR']
GREY = (0.5, 0.4, 0.3)
# The second bake has the same lines as the first; what remains is the rounding of float sums.
SAME = 1e-6


def snapshot(tree):
    """Returns all that a node tree is: nodes with their values, links, active node, selection."""
    def plain(value):
        if hasattr(value, 'name_full'):
            return value.name_full
        return tuple(value) if hasattr(value, '__len__') and not isinstance(value, str) else value

    nodes = {}
    for node in tree.nodes:
        properties = {entry.identifier: plain(getattr(node, entry.identifier))
                      for entry in node.bl_rna.properties
                      if entry.type in ('BOOLEAN', 'INT', 'FLOAT', 'STRING', 'ENUM')}
        values = [(entry.identifier, plain(getattr(entry, 'default_value', None)))
                  for entry in (*node.inputs, *node.outputs)]
        nodes[node.name] = properties, values, sorted(node.keys())
    links = {(link.from_node.name, link.from_socket.identifier, link.to_node.name,
              link.to_socket.identifier, link.is_muted) for link in tree.links}
    return nodes, links, tree.nodes.active and tree.nodes.active.name


def slots(items):
    return [[(slot.link, slot.material and slot.material.name) for slot in item.material_slots]
            for item in items]


def state():
    materials = {material.name: (snapshot(material.node_tree) if material.node_tree else None,
                                 material.users, sorted(material.keys()))
                 for material in bpy.data.materials}
    return materials, slots(bpy.data.objects), {mesh.name: list(mesh.materials.keys())
                                                for mesh in bpy.data.meshes}


def paint(item, color=(0.25, 0.5, 2.0), domain='CORNER', name="Radiosity"):
    attribute = item.data.color_attributes.new(name, 'FLOAT_COLOR', domain)
    attribute.data.foreach_set('color', np.tile([*color, 1.0], len(attribute.data)))
    return item


SQUARE = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [(0, 1, 2, 3)]


@pytest.fixture
def square(new_object, new_material):
    return paint(new_object("Square", *SQUARE, new_material("Grey", GREY)))


def principled(name):
    """Returns a material of an image times a colour on a Principled shader, and a second output."""
    material = bpy.data.materials.new(name)
    shader = new_shader(material, 'ShaderNodeBsdfPrincipled')
    tree = material.node_tree
    texture = tree.nodes.new('ShaderNodeTexImage')
    reroute = tree.nodes.new('NodeReroute')
    tree.links.new(texture.outputs['Color'], reroute.inputs[0])
    tree.links.new(reroute.outputs[0], shader.inputs['Base Color'])
    second = tree.nodes.new('ShaderNodeOutputMaterial')
    second.target = 'EEVEE'
    tree.links.new(shader.outputs[0], second.inputs['Surface'])
    add = tree.nodes.new('ShaderNodeAddShader')
    glossy = tree.nodes.new('ShaderNodeBsdfGlossy')
    tree.links.new(shader.outputs[0], add.inputs[0])
    tree.links.new(glossy.outputs[0], add.inputs[1])
    first = next(node for node in tree.nodes if node.type == 'OUTPUT_MATERIAL' and node != second)
    first.target = 'CYCLES'
    tree.links.new(add.outputs[0], first.inputs['Surface'])
    tree.nodes.active = reroute
    return material


# --------------------------------------------------------------------------------------------------
# In and out
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("way", WAYS)
def test_take_out_restores_everything(square, new_object, way):
    empty = paint(new_object("Empty", *SQUARE))
    slot = paint(new_object("Slot", *SQUARE))
    slot.data.materials.append(None)
    own = paint(new_object("Own", *SQUARE, square.data.materials[0]))
    own.material_slots[0].link = 'OBJECT'
    own.material_slots[0].material = principled("Own")
    flat = bpy.data.materials.new("Flat")
    flat.diffuse_color = (0.1, 0.7, 0.2, 1.0)
    paint(new_object("Flat", *SQUARE, flat))
    paint(new_object("Several", *SQUARE, principled("Several")))
    before = state()
    assert bpy.ops.raybundle.use_in_material(way=way) == {'FINISHED'}
    during = state()
    assert during != before and empty.material_slots[0].material is not None
    for material in bpy.data.materials:
        if material.users and has_nodes(material):
            assert light_in_material.shows_light(material), material.name
    # A second press replaces what the first has inserted.
    bpy.ops.raybundle.use_in_material(way=way)
    assert {name: len(entry[0][0]) for name, entry in state()[0].items() if entry[0]} == \
        {name: len(entry[0][0]) for name, entry in during[0].items() if entry[0]}
    for other in WAYS:
        bpy.ops.raybundle.use_in_material(way=other)
    with light_in_material.surfaces_exported():
        pass
    assert bpy.ops.raybundle.take_out_of_material() == {'FINISHED'}
    assert state() == before


def test_all_outputs_that_renderers_use_show_the_light(new_object):
    item = paint(new_object("Square", *SQUARE, principled("Several")))
    bpy.ops.raybundle.use_in_material(way='EMISSION')
    outputs = [node for node in item.data.materials[0].node_tree.nodes
               if node.type == 'OUTPUT_MATERIAL']
    assert [node.inputs['Surface'].links[0].from_node[light_in_material.NODE_TAG]
            for node in outputs] == ['EMISSION'] * 2


def test_faces_without_slots_keep_their_slot_numbers(new_object):
    item = paint(new_object("Square", *SQUARE))
    item.data.polygons.foreach_set('material_index', [3])
    bpy.ops.raybundle.use_in_material(way='EMISSION')
    bpy.ops.raybundle.take_out_of_material()
    assert item.data.polygons[0].material_index == 3 and not item.material_slots


def test_a_colour_that_is_changed_in_between_is_kept(square):
    tree = square.data.materials[0].node_tree
    bpy.ops.raybundle.use_in_material(way='FACTOR')
    color = next(node for node in tree.nodes if node.type == 'BSDF_DIFFUSE').inputs['Color']
    mix = color.links[0].from_node
    own = next(entry for entry in mix.inputs if entry.identifier == 'B_Color')
    own.default_value = (0.1, 0.2, 0.3, 1.0)
    bpy.ops.raybundle.take_out_of_material()
    assert tuple(color.default_value)[:3] == pytest.approx((0.1, 0.2, 0.3))


@pytest.mark.parametrize("way", WAYS)
def test_changes_in_between_are_kept(square, way):
    tree = square.data.materials[0].node_tree
    bpy.ops.raybundle.use_in_material(way=way)
    rgb = tree.nodes.new('ShaderNodeRGB')
    bpy.ops.raybundle.take_out_of_material()
    assert rgb.name in tree.nodes
    assert len(tree.nodes) == 3 and len(tree.links) == 1


def test_an_export_sees_the_material_without_the_light(square):
    tree = square.data.materials[0].node_tree
    surface = next(node for node in tree.nodes if node.type == 'OUTPUT_MATERIAL').inputs['Surface']
    bpy.ops.raybundle.use_in_material(way='COLORED')
    shown = snapshot(tree)
    with pytest.raises(KeyError), light_in_material.surfaces_exported():
        mix = surface.links[0].from_node
        assert mix.inputs[1].links[0].from_node.type == 'BSDF_DIFFUSE'
        emission = mix.inputs[2].links[0].from_node
        assert not emission.inputs['Color'].is_linked
        assert tuple(emission.inputs['Color'].default_value)[:3] == pytest.approx(GREY)
        raise KeyError
    assert snapshot(tree) == shown


@pytest.mark.parametrize("way", WAYS)
def test_undo_takes_the_light_out(square, way):
    before = state()
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.raybundle.use_in_material('EXEC_DEFAULT', True, way=way) == {'FINISHED'}
    assert state() != before
    bpy.ops.ed.undo()
    assert state() == before
    bpy.ops.ed.redo()
    assert light_in_material.shows_light(bpy.data.materials["Grey"])


# --------------------------------------------------------------------------------------------------
# What is said
# --------------------------------------------------------------------------------------------------


def warnings(way):
    return light_in_material.use(bpy.context.scene, "Radiosity", way).warnings


def test_materials_of_objects_without_the_attribute_are_named(square, new_object):
    new_object("Bare", *SQUARE, square.data.materials[0])
    assert len(warnings('EMISSION')) == 1
    assert '"Grey" is also the material of "Bare" without the attribute "Radiosity"' in \
        warnings('EMISSION')[0]


def test_linked_materials_are_named_and_left(square, tmp_path, new_object):
    path = str(tmp_path / "library.blend")
    bpy.data.libraries.write(path, {square.data.materials[0]})
    with bpy.data.libraries.load(path, link=True) as (_, target):
        target.materials = ["Grey"]
    paint(new_object("Linked", *SQUARE, target.materials[0]))
    before = snapshot(target.materials[0].node_tree)
    assert any('"Grey" is linked from another file' in text for text in warnings('EMISSION'))
    assert snapshot(target.materials[0].node_tree) == before


def test_materials_that_cannot_show_the_light_are_named_and_left(square, new_object,
                                                                  new_material):
    lamp = paint(new_object("Lamp", *SQUARE, new_material("Lamp", GREY, (1.0, 1.0, 1.0))))
    void = bpy.data.materials.new("Void")
    if bpy.app.version < (5, 0, 0):
        void.use_nodes = True
    void.node_tree.nodes.clear()
    paint(new_object("Void", *SQUARE, void))
    before = snapshot(lamp.data.materials[0].node_tree)
    lines = warnings('COLORED')
    assert any('"Lamp" emits light and was left' in text for text in lines)
    assert any('"Void" has no Material Output node' in text for text in lines)
    assert snapshot(lamp.data.materials[0].node_tree) == before
    assert not any('"Lamp"' in text for text in warnings('EMISSION'))


def test_without_a_bake_the_button_is_off(new_object):
    item = new_object("Square", *SQUARE)
    assert not bpy.ops.raybundle.use_in_material.poll()
    with pytest.raises(RuntimeError, match="bake first"):
        bpy.ops.raybundle.use_in_material()
    paint(item)
    assert bpy.ops.raybundle.use_in_material.poll()


# --------------------------------------------------------------------------------------------------
# Renders
# --------------------------------------------------------------------------------------------------


def clear(material, kind):
    """Makes a material a quarter opaque, by Principled's alpha or by a mix with transparency."""
    tree = material.node_tree
    if kind == 'PRINCIPLED':
        shader = new_shader(material, 'ShaderNodeBsdfPrincipled')
        shader.inputs['Base Color'].default_value = (*GREY, 1.0)
        shader.inputs['Alpha'].default_value = 0.25
        return
    output = next(node for node in tree.nodes if node.type == 'OUTPUT_MATERIAL')
    mix = tree.nodes.new('ShaderNodeMixShader')
    mix.inputs[0].default_value = 0.25
    shader = output.inputs['Surface'].links[0].from_socket
    tree.links.new(tree.nodes.new('ShaderNodeBsdfTransparent').outputs[0], mix.inputs[1])
    tree.links.new(shader, mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs['Surface'])


def render(samples=4):
    """Returns the linear pixels in the middle of a picture of the square from above, (3,)."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0.0, 0.0, 2.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    bounces = scene.cycles.max_bounces
    prepare_scene(scene, samples, seed=0)
    scene.cycles.max_bounces = bounces
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.view_settings.view_transform = 'Raw' if bpy.app.version < (4, 0, 0) else 'Standard'
    scene.render.image_settings.file_format = 'OPEN_EXR'
    scene.render.image_settings.color_depth = '32'
    scene.render.filepath = bpy.app.tempdir + "shown.exr"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.array(image.pixels[:]).reshape(8, 8, 4)[3:5, 3:5, :3].mean(axis=(0, 1))
    bpy.data.images.remove(image)
    return pixels


@pytest.mark.parametrize("domain", ['CORNER', 'POINT'])
def test_cycles_shows_the_value_of_the_attribute(square, new_light, domain):
    square.data.color_attributes.remove(square.data.color_attributes["Radiosity"])
    paint(square, domain=domain)
    # An unlit material is not lit again.
    new_light("Sun", 'SUN', 10.0, (0, 0, 3))
    bpy.ops.raybundle.use_in_material(way='EMISSION')
    assert render() == pytest.approx([0.25, 0.5, 2.0], rel=1e-5)


def test_cycles_shows_light_times_colour(square, new_light):
    new_light("Sun", 'SUN', 10.0, (0, 0, 3))
    bpy.ops.raybundle.use_in_material(way='COLORED')
    assert render() == pytest.approx(np.array([0.25, 0.5, 2.0]) * GREY, rel=1e-5)


@pytest.mark.parametrize("kind", ['PRINCIPLED', 'MIX'])
def test_transparency_is_kept(square, kind):
    clear(square.data.materials[0], kind)
    before = state()
    bpy.ops.raybundle.use_in_material(way='COLORED')
    # 4 pixels of 1024 samples, each of which is opaque by a chance of 1 in 4: 2.7 % of noise.
    assert render(1024) == pytest.approx(0.25 * np.array([0.25, 0.5, 2.0]) * GREY, rel=0.1)
    with light_in_material.surfaces_exported():
        pass
    bpy.ops.raybundle.take_out_of_material()
    bpy.context.scene.collection.objects.unlink(bpy.data.objects["Camera"])
    assert state()[0] == before[0]


def test_cycles_multiplies_the_colour_that_lamps_light(square, new_world):
    """Under a world of radiance 1 a surface shows its colour, which Cycles does not clamp."""
    new_world((1.0, 1.0, 1.0))
    bpy.context.scene.cycles.max_bounces = 0
    bpy.ops.raybundle.use_in_material(way='FACTOR')
    assert render() == pytest.approx(np.array([0.25, 0.5, 2.0]) * GREY, rel=1e-4)


def test_the_combined_output_of_a_bake_is_shown(closed_box):
    """Inside a furnace Cycles shows the baked radiance."""
    raybundle.bake(bpy.context, output='COMBINED', max_patches=500)
    light = read_colors(closed_box).mean(axis=0)
    bpy.context.scene.raybundle.output = 'COMBINED'
    bpy.ops.raybundle.use_in_material()
    closed_box.location = (0.0, 0.0, 2.0)  # the camera is in its middle
    assert render() == pytest.approx(light, rel=0.01)


# --------------------------------------------------------------------------------------------------
# Another bake
# --------------------------------------------------------------------------------------------------


@pytest.mark.needs_library
@pytest.mark.parametrize("output", ['LIGHTING', 'COMBINED'])
@pytest.mark.parametrize("way", WAYS)
def test_another_bake_gives_the_same_light(new_object, new_material, new_light, way, output):
    points = [(x, y, 0) for y in (-2, 0, 2) for x in (-2, 0, 2)]
    faces = [(i, i + 1, i + 4, i + 3) for i in (0, 1, 3, 4)]
    lamp = new_material("Lamp", (0.1, 0.1, 0.1), (20.0, 10.0, 5.0))
    items = [new_object("Floor", points, faces, principled("Shiny")),
             new_object("Wall", [(x, 2, y + 2) for x, y, _ in points], faces),
             new_object("Side", [(2, x, y + 2) for x, y, _ in points], faces,
                        new_material("Blue", (0.2, 0.3, 0.6))),
             new_object("Panel", [(-1, 0, 2), (-1, 0.5, 2), (-0.5, 0.5, 2), (-0.5, 0, 2)],
                        [(0, 1, 2, 3)], lamp)]
    image = bpy.data.images.new("Red", 4, 4, float_buffer=True)
    image.pixels = np.tile([0.8, 0.1, 0.1, 1.0], 16).tolist()
    tree = items[0].data.materials[0].node_tree
    next(node for node in tree.nodes if node.type == 'TEX_IMAGE').image = image
    items[0].data.uv_layers.new()
    new_light("Light", 'AREA', 100.0, (0.5, 0, 3), size=1.0)

    def bake():
        report = raybundle.bake(bpy.context, output=output, max_patches=500, max_bundles=64,
                                target_error=0.001)
        return report, [read_colors(item) for item in items]

    first, before = bake()
    bpy.ops.raybundle.use_in_material(way=way)
    for _ in range(2):
        second, after = bake()
        assert second.energy['emitted'] == pytest.approx(first.energy['emitted'], rel=SAME)
        for light, expected in zip(after, before):
            assert np.abs(light - expected).max() <= SAME * expected.max()
