# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials that show the result of a bake do not change the light of the next bake.

This holds whichever attribute of a bake a material reads, and for every way to read it.
"""

import json

import bpy
import numpy as np
import pytest
import raybundle
from raybundle.materials.last_surfaces import LastSurfaces
from raybundle.scene_export import export_scene
from scene_items import new_shader
from surface_error import read_colors

pytestmark = pytest.mark.needs_library

# The second bake gets exactly the numbers of the first. It has the same lines, and starts from a
# solution that already fulfils the tolerance. The remaining differences are those of float sums.
SAME = 1e-6
GREY = (0.5, 0.4, 0.3)
LAMP = (20.0, 10.0, 5.0)  # radiance, W/(m^2 sr)


def bake(**overrides):
    # The number of bundles is fixed, so that all bakes have the same lines.
    return raybundle.bake(bpy.context, **{"output": 'LIGHTING', "max_patches": 500,
                                          "target_error": 0.001, "max_bundles": 64, **overrides})


@pytest.fixture
def corner(new_object, new_material, new_light):
    """Returns a floor, a wall and a panel that emits, each with its own material, under a lamp."""
    points = [(x, y, 0) for y in (-2, 0, 2) for x in (-2, 0, 2)]
    faces = [(i, i + 1, i + 4, i + 3) for i in (0, 1, 3, 4)]
    floor = new_object("Floor", points, faces, new_material("Grey", GREY))
    wall = new_object("Wall", [(x, 2, y + 2) for x, y, _ in points], faces,
                      new_material("Dark", (0.2, 0.3, 0.6)))
    panel = new_object("Panel", [(-1, 0, 2), (-1, 0.5, 2), (-0.5, 0.5, 2), (-0.5, 0, 2)],
                       [(0, 1, 2, 3)], new_material("Lamp", (0.1, 0.1, 0.1), LAMP))
    new_light("Light", 'AREA', 100.0, (0.5, 0, 3), size=1.0)
    return [floor, wall, panel]


def node_of(tree, kind):
    return next(node for node in tree.nodes if node.type == kind)


def reader(tree, name, kind='VERTEX_COLOR'):
    """Returns a socket with the colour of the attribute."""
    if kind == 'VERTEX_COLOR':
        node = tree.nodes.new('ShaderNodeVertexColor')
        node.layer_name = name
    else:
        node = tree.nodes.new('ShaderNodeAttribute')
        node.attribute_name = name
    return node.outputs['Color']


def new_mix(tree, first, second, blend='MULTIPLY', factor=1.0, is_old=False):
    """Returns the mix of two sockets or colours.

    is_old: uses the node that Blender 3.4 replaced.
    """
    if is_old:
        node = tree.nodes.new('ShaderNodeMixRGB')
        sockets, output = node.inputs, node.outputs[0]
    else:
        node = tree.nodes.new('ShaderNodeMix')
        node.data_type = 'RGBA'
        by_name = {item.identifier: item for item in node.inputs}
        sockets = [by_name[name] for name in ('Factor_Float', 'A_Color', 'B_Color')]
        output = next(item for item in node.outputs if item.identifier == 'Result_Color')
    node.blend_type = blend
    sockets[0].default_value = factor
    for socket, value in zip(sockets[1:], (first, second)):
        if isinstance(value, tuple):
            socket.default_value = (*value, 1.0)
        else:
            tree.links.new(value, socket)
    return output


# --------------------------------------------------------------------------------------------------
# Ways to show a result: each changes a material, whose colour the last bake used
# --------------------------------------------------------------------------------------------------


def as_emission(material, name, kind):
    shader = new_shader(material, 'ShaderNodeEmission')
    material.node_tree.links.new(reader(material.node_tree, name, kind), shader.inputs['Color'])


def as_emission_beside(material, name, kind):
    """Adds the result as emission to the shader of the material, which stays.

    The bake then no longer reads the material's own emission from its nodes.
    """
    tree = material.node_tree
    emission = tree.nodes.new('ShaderNodeEmission')
    tree.links.new(reader(tree, name, kind), emission.inputs['Color'])
    add = tree.nodes.new('ShaderNodeAddShader')
    output = node_of(tree, 'OUTPUT_MATERIAL').inputs['Surface']
    tree.links.new(output.links[0].from_socket, add.inputs[0])
    tree.links.new(emission.outputs[0], add.inputs[1])
    tree.links.new(add.outputs[0], output)


def as_strength(material, name, kind):
    shader = new_shader(material, 'ShaderNodeEmission')
    tree = material.node_tree
    separate = tree.nodes.new('ShaderNodeRGBToBW')
    tree.links.new(reader(tree, name, kind), separate.inputs[0])
    tree.links.new(separate.outputs[0], shader.inputs['Strength'])


def as_base_color(material, name, kind):
    """Links the result in place of the colour. The socket still contains the old colour."""
    tree = material.node_tree
    tree.links.new(reader(tree, name, kind), node_of(tree, 'BSDF_DIFFUSE').inputs['Color'])


def as_only_color(material, name, kind):
    shader = new_shader(material, 'ShaderNodeBsdfDiffuse')
    material.node_tree.links.new(reader(material.node_tree, name, kind), shader.inputs['Color'])


def as_principled_color(material, name, kind):
    shader = new_shader(material, 'ShaderNodeBsdfPrincipled')
    tree = material.node_tree
    ramp = tree.nodes.new('ShaderNodeGamma')
    tree.links.new(reader(tree, name, kind), ramp.inputs['Color'])
    tree.links.new(ramp.outputs[0], shader.inputs['Base Color'])


def as_principled_emission(material, name, kind):
    shader = new_shader(material, 'ShaderNodeBsdfPrincipled')
    shader.inputs['Base Color'].default_value = (0.0, 0.0, 0.0, 1.0)
    emission = next(shader.inputs[name] for name in ('Emission Color', 'Emission')
                    if name in shader.inputs)
    shader.inputs['Emission Strength'].default_value = 1.0
    tree = material.node_tree
    tree.links.new(reader(tree, name, kind), emission)


def as_exposed_color(material, name, kind):
    shader = new_shader(material, 'ShaderNodeBsdfDiffuse')
    tree = material.node_tree
    tree.links.new(new_mix(tree, reader(tree, name, kind), (2.0, 2.0, 2.0)),
                   shader.inputs['Color'])


def as_factor(material, name, kind, is_old=False):
    tree = material.node_tree
    color = node_of(tree, 'BSDF_DIFFUSE').inputs['Color']
    own = tuple(color.default_value)[:3]
    tree.links.new(new_mix(tree, reader(tree, name, kind), own, is_old=is_old), color)


def as_old_factor(material, name, kind):
    as_factor(material, name, kind, is_old=True)


def as_half_factor(material, name, kind):
    tree = material.node_tree
    color = node_of(tree, 'BSDF_DIFFUSE').inputs['Color']
    own = tuple(color.default_value)[:3]
    tree.links.new(new_mix(tree, own, reader(tree, name, kind), factor=0.5), color)


def as_vector_factor(material, name, kind):
    """Multiplies a varying colour by the result, in a node that only Cycles can evaluate."""
    shader = new_shader(material, 'ShaderNodeBsdfDiffuse')
    tree = material.node_tree
    noise = tree.nodes.new('ShaderNodeTexNoise')
    product = tree.nodes.new('ShaderNodeVectorMath')
    product.operation = 'MULTIPLY'
    tree.links.new(noise.outputs['Color'], product.inputs[0])
    tree.links.new(reader(tree, name, kind), product.inputs[1])
    tree.links.new(product.outputs[0], shader.inputs['Color'])


def group_of(show):
    """Returns a variant of `show` that reads the attribute in a node group."""
    def show_in_group(material, name, kind):
        show(material, name, kind)
        tree = material.node_tree
        source = node_of(tree, kind)
        group = bpy.data.node_groups.new("Light", 'ShaderNodeTree')
        if bpy.app.version < (4, 0, 0):
            group.outputs.new('NodeSocketColor', "Color")
        else:
            group.interface.new_socket("Color", in_out='OUTPUT', socket_type='NodeSocketColor')
        group.links.new(reader(group, name, kind), group.nodes.new('NodeGroupOutput').inputs[0])
        node = tree.nodes.new('ShaderNodeGroup')
        node.node_tree = group
        target = source.outputs['Color'].links[0].to_socket
        tree.links.new(node.outputs[0], target)
        tree.nodes.remove(source)

    show_in_group.__name__ = f"{show.__name__}_in_a_group"
    return show_in_group


KEEPING = [as_emission, as_strength, as_only_color, as_principled_color, as_principled_emission,
           as_exposed_color, group_of(as_emission)]
OWN = [as_emission_beside, as_base_color, as_factor, as_old_factor, as_half_factor,
       group_of(as_factor)]


def naming(report):
    lines = [text for text in report.warnings if "show the result of a bake" in text]
    assert len(lines) <= 1
    return lines[0] if lines else ""


def difference(items, before, name="Radiosity"):
    return max(np.abs(read_colors(item, name) - light).max() / light.max()
               for item, light in zip(items, before) if light.max() > 0.0)


@pytest.mark.parametrize("domain, kind", [('CORNER', 'VERTEX_COLOR'), ('POINT', 'ATTRIBUTE')])
@pytest.mark.parametrize("show", KEEPING + OWN, ids=lambda show: show.__name__)
def test_to_show_the_result_and_bake_again_gives_the_same_light(corner, show, domain, kind):
    first = bake(domain=domain)
    assert naming(first) == ""
    before = [read_colors(item) for item in corner]
    # Shows the result only on the first two objects. On the lamp, some of the ways would replace
    # its own emission.
    for item in corner[:2]:
        show(item.data.materials[0], "Radiosity", kind)
    for _ in range(2):
        report = bake(domain=domain)
        assert difference(corner, before) < SAME
        assert report.energy['emitted'] == pytest.approx(first.energy['emitted'], rel=SAME)
        line = naming(report)
        assert '"Grey"' in line and '"Dark"' in line and '"Lamp"' not in line


@pytest.mark.parametrize("show", KEEPING, ids=lambda show: show.__name__)
def test_a_lamp_that_shows_nothing_but_the_result_still_shines(corner, show):
    first = bake()
    before = [read_colors(item) for item in corner]
    show(corner[2].data.materials[0], "Radiosity", 'VERTEX_COLOR')
    report = bake()
    assert difference(corner, before) < SAME
    assert report.energy['emitted'] == pytest.approx(first.energy['emitted'], rel=SAME)


def test_other_materials_in_the_slots_and_a_saved_file(corner, tmp_path):
    """A new material shows the result on all objects, and is saved with the file."""
    bake()
    before = [read_colors(item) for item in corner]
    shown = bpy.data.materials.new("Shown")
    if bpy.app.version < (5, 0, 0):
        shown.use_nodes = True
    as_emission(shown, "Radiosity", 'VERTEX_COLOR')
    for item in corner:
        item.data.materials.clear()
        item.data.materials.append(shown)
    for material in list(bpy.data.materials):
        if material != shown:
            bpy.data.materials.remove(material)
    names = [item.name for item in corner]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shown.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shown.blend"))
    report = bake()
    # The lines are traced anew. Equal numbers give equal lines.
    assert difference([bpy.data.objects[name] for name in names], before) < SAME
    assert '"Shown"' in naming(report)


@pytest.mark.parametrize("topology", ['SUBDIVIDE', 'ADAPTIVE', 'KEEP'])
def test_finer_copies_that_show_the_result(corner, topology):
    # Few vertices, for the time that the target takes.
    bake(topology='SUBDIVIDE' if topology == 'KEEP' else topology, max_vertices=200)
    copies = [bpy.data.objects[f"{item.name} (Radiosity)"] for item in corner]
    before = [read_colors(item).mean(axis=0) for item in copies]
    for item in copies[:2]:
        as_only_color(item.data.materials[0], "Radiosity", 'VERTEX_COLOR')
    report = bake(topology=topology, max_vertices=200)
    assert not any("no earlier bake" in text for text in report.warnings)
    copies = [bpy.data.objects[f"{item.name} (Radiosity)"] for item in corner]
    for item, mean in zip(copies, before):
        # KEEP bakes the copies themselves, with other lines: noise of 64 bundles. The noise also
        # changes meshes that are adapted.
        assert read_colors(item).mean(axis=0) == pytest.approx(
            mean, rel=SAME if topology == 'SUBDIVIDE' else 0.02)


def test_what_an_image_was_stays_one(corner):
    """A colour comes from an image in the first bake, and in later ones the result replaces it."""
    image = bpy.data.images.new("Stripes", 4, 4, float_buffer=True)
    image.pixels = np.tile([0.8, 0.1, 0.1, 1.0, 0.1, 0.1, 0.8, 1.0], 8).tolist()
    floor = corner[0]
    floor.data.uv_layers.new()
    tree = floor.data.materials[0].node_tree
    texture = tree.nodes.new('ShaderNodeTexImage')
    texture.image = image
    color = node_of(tree, 'BSDF_DIFFUSE').inputs['Color']
    tree.links.new(texture.outputs[0], color)
    bake()
    before = [read_colors(item) for item in corner]
    tree.links.new(reader(tree, "Radiosity"), color)
    bake()
    assert difference(corner, before) < SAME
    # If the image no longer exists, its mean is used.
    bpy.data.images.remove(image)
    bake()
    assert 0.0 < difference(corner, before) < 0.1


def test_materials_that_cycles_bakes_do_not_see_the_result(corner):
    """Cycles bakes a pattern multiplied by the result as the pattern alone.

    A later bake therefore gives the same light.
    """
    for item in corner[:2]:
        as_vector_factor(item.data.materials[0], "Light", 'VERTEX_COLOR')
    first = bake(attribute="Light")
    before = [read_colors(item, "Light") for item in corner]
    assert any("baked by Cycles" in text for text in first.warnings)
    bake(attribute="Light")
    assert difference(corner, before, "Light") < SAME


def test_the_results_of_light_sets_errors_and_earlier_bakes(corner):
    settings = bpy.context.scene.raybundle.light_sets.add()
    settings.name = "panel"
    settings.collection = bpy.data.collections.new("Panel")
    bpy.context.scene.collection.children.link(settings.collection)
    settings.collection.objects.link(corner[2])
    options = {"attribute": "Light", "write_error": True}
    bake(**options)
    names = ("Light", "Light panel")
    before = {name: [read_colors(item, name) for item in corner] for name in names}
    for item, name in zip(corner, ("Light panel", "Light Error", "Light panel")):
        as_emission_beside(item.data.materials[0], name, 'ATTRIBUTE')
    report = bake(**options)
    for name in names:
        assert difference(corner, before[name], name) < SAME
    assert all(f'"{name}"' in naming(report) for name in ("Grey", "Dark", "Lamp"))
    # The next bake writes to another attribute. Results of earlier bakes still do not count as
    # light.
    options["attribute"] = "Other"
    as_emission(corner[0].data.materials[0], "Light", 'ATTRIBUTE')
    bake(**options)
    assert difference(corner, before["Light"], "Other") < SAME


def test_the_render_attribute_without_a_name(corner):
    """Nodes without an attribute name read the active render attribute.

    After the first bake this is the result.
    """
    floor, wall, panel = corner
    painted = floor.data.color_attributes.new("Painted", 'FLOAT_COLOR', 'POINT')
    painted.data.foreach_set('color', np.tile([0.2, 0.7, 0.4, 1.0], len(painted.data)))
    floor.data.color_attributes.render_color_index = 0
    for item in (floor, wall):
        tree = item.data.materials[0].node_tree
        tree.links.new(reader(tree, ""), node_of(tree, 'BSDF_DIFFUSE').inputs['Color'])
    first = bake()
    # The floor has a painted attribute. The wall has no attribute other than the future result.
    assert '"Dark"' in naming(first) and '"Grey"' not in naming(first)
    before = [read_colors(item) for item in corner]
    report = bake()
    assert difference(corner, before) < SAME
    assert '"Dark"' in naming(report) and '"Grey"' in naming(report)


def test_a_result_alone_before_the_first_bake_is_a_guess_that_is_said(corner):
    floor, wall, panel = corner
    as_base_color(floor.data.materials[0], "Radiosity", 'VERTEX_COLOR')
    as_emission(wall.data.materials[0], "Radiosity", 'VERTEX_COLOR')
    scene = export_scene(bpy.context).scene
    by_name = {material.name: material for material in scene.materials}
    for side in by_name["Grey"].sides:
        assert side.reflectance.constant == pytest.approx(GREY)
    for side in by_name["Dark"].sides:
        assert side.reflectance.constant == pytest.approx(np.full(3, 0.8))
    report = bake()
    before = [read_colors(item) for item in corner]
    for name in ("Grey", "Dark"):
        assert any(f'"{name}" shows only the result of a bake' in text
                   for text in report.warnings)
    bake()
    assert difference(corner, before) < SAME


def test_the_light_of_a_material_that_shows_the_result_in_its_colour_follows(corner):
    """Only the part of a material that the result hides is taken from the last bake."""
    bake()
    before = [read_colors(item, "Radiosity") for item in corner]
    tree = corner[2].data.materials[0].node_tree
    as_base_color(corner[2].data.materials[0], "Radiosity", 'VERTEX_COLOR')
    node_of(tree, 'EMISSION').inputs['Strength'].default_value = 2.0
    bpy.data.objects["Light"].hide_render = True
    bright = bake(attribute="Bright")
    node_of(tree, 'EMISSION').inputs['Strength'].default_value = 1.0
    dim = bake(attribute="Dim")
    assert bright.energy['emitted'] == pytest.approx(2.0 * dim.energy['emitted'], rel=1e-4)
    assert difference(corner, before, "Dim") > 0.1


def test_paint_of_another_name_is_a_colour_as_before(corner):
    floor = corner[0]
    painted = floor.data.color_attributes.new("Painted", 'FLOAT_COLOR', 'POINT')
    painted.data.foreach_set('color', np.tile([0.2, 0.7, 0.4, 1.0], len(painted.data)))
    as_base_color(floor.data.materials[0], "Painted", 'ATTRIBUTE')
    scene = export_scene(bpy.context).scene
    material = next(item for item in scene.materials if item.name == "Grey")
    assert material.front.reflectance.corner_color_weight == pytest.approx(np.ones(3))
    assert naming(bake()) == ""


def test_clear_forgets_the_names_and_not_the_surfaces(corner):
    bake()
    before = [read_colors(item) for item in corner]
    assert LastSurfaces(bpy.context.scene).attributes == {"Radiosity"}
    bpy.ops.raybundle.clear()
    assert LastSurfaces(bpy.context.scene).attributes == frozenset()
    as_only_color(corner[0].data.materials[0], "Radiosity", 'VERTEX_COLOR')
    bake()
    assert difference(corner, before) < SAME


@pytest.mark.parametrize("stored", ["no JSON", "[]", '{"surfaces": {"x": {}}, "attributes": 3}'])
def test_what_is_stored_may_be_anything(corner, stored):
    bpy.context.scene.raybundle.last_surfaces = stored
    corner[0].raybundle.last_surfaces = "x"
    as_only_color(corner[0].data.materials[0], "Radiosity", 'VERTEX_COLOR')
    bake()
    assert json.loads(bpy.context.scene.raybundle.last_surfaces)["attributes"] == ["Radiosity"]
