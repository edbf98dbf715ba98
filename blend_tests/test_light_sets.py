# SPDX-License-Identifier: GPL-3.0-or-later
"""Light sets: a bake writes the light of several groups of lights to separate attributes.

All light sets use the same traced lines.
"""

import json

import bpy
import numpy as np
import pytest
import raybundle
from conftest import CUBE_FACES, CUBE_VERTICES
from raybundle import native
from surface_error import read_colors

pytestmark = pytest.mark.needs_library

# Both bakes solve the same system, to a relative residual of at most 1e-5, but may start from
# different guesses. The reflectance of 0.5 increases the error by a factor of at most 2.
SOLVER_TOLERANCE = 5e-5
# Error of float sums.
ROUNDING = 1e-6

FLOOR = [(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0)]
SKY = (0.05, 0.1, 0.2)  # radiance, W/(m^2 sr)
PANEL = [(1, 3.5, 1), (2, 3.5, 1), (2, 3.5, 2), (1, 3.5, 2)]


def bake(**overrides):
    # The number of bundles is fixed, so that all bakes have the same lines.
    return raybundle.bake(bpy.context, **{"max_patches": 2000, "max_bundles": 64,
                                          "target_error": 0.001, **overrides})


def difference(a, b):
    """Returns the largest difference, divided by the largest value of b."""
    assert b.max() > 0.0
    return np.abs(a - b).max() / b.max()


def collection_of(name, *items, parent=None):
    collection = bpy.data.collections.new(name)
    (parent or bpy.context.scene.collection).children.link(collection)
    for item in items:
        collection.objects.link(item)
    return collection


def add_set(name, collection=None, **values):
    item = bpy.context.scene.raybundle.light_sets.add()
    item.name, item.collection = name, collection
    for key, value in values.items():
        setattr(item, key, value)
    return item


@pytest.fixture
def court(new_object, new_light, new_material, new_world):
    """Builds a floor and a box under a sky, a red lamp, an emissive panel, a blue lamp and a sun.

    Returns the baked objects, the collections for two light sets, and the colour of the sky.
    """
    sky = new_world(SKY)
    floor = new_object("Floor", FLOOR, [(0, 1, 2, 3)], new_material("Grey", (0.5, 0.5, 0.5)))
    box = new_object("Box", [(0.5 * x, 0.5 * y, 0.5 * z) for x, y, z in CUBE_VERTICES], CUBE_FACES,
                     new_material("Light Grey", (0.5, 0.4, 0.3)), (2.0, 1.5, 0.8))
    panel = new_object("Panel", PANEL, [(0, 1, 2, 3)],
                       new_material("Glow", (0.1, 0.1, 0.1), (60.0, 10.0, 5.0)))
    red = new_light("Red", 'POINT', 60.0, (1, 1, 2), color=(1.0, 0.2, 0.1))
    blue = new_light("Blue", 'AREA', 60.0, (3, 3, 2.5), color=(0.2, 0.4, 1.0), size=0.5)
    new_light("Sun", 'SUN', 0.5, angle=0.01)
    # The lamp is in a collection inside the collection of the light set.
    warm = collection_of("Warm", panel)
    collection_of("Lamps", red, parent=warm)
    return {"items": [floor, box], "warm": warm, "cold": collection_of("Cold", blue),
            "sky": sky.inputs['Color']}


def add_both(court):
    add_set("warm", court["warm"])
    add_set("cold", court["cold"], world=True)


def lit_by(court, warm=False, cold=False, sun=False):
    """Switches the given groups of lights on and all others off."""
    bpy.data.objects["Red"].hide_render = not warm
    strength = bpy.data.materials["Glow"].node_tree.nodes["Emission"].inputs["Strength"]
    strength.default_value = float(warm)
    bpy.data.objects["Blue"].hide_render = not cold
    court["sky"].default_value = (*(SKY if cold else (0.0, 0.0, 0.0)), 1.0)
    bpy.data.objects["Sun"].hide_render = not sun


@pytest.mark.parametrize("output, domain", [
    ('LIGHTING', 'CORNER'), ('COMBINED', 'POINT'), ('DIRECT', 'CORNER'), ('INDIRECT', 'POINT')])
def test_two_sets_are_two_separate_bakes_and_their_sum(court, output, domain):
    add_both(court)
    report = bake(output=output, domain=domain)
    together = [{name: read_colors(item, name) for name in
                 ("Radiosity", "Radiosity warm", "Radiosity cold")} for item in court["items"]]
    assert [(entry["name"], entry["attribute"]) for entry in report.light_sets] == [
        ("warm", "Radiosity warm"), ("cold", "Radiosity cold")]

    bpy.context.scene.raybundle.light_sets.clear()
    parts = {}
    for name, lit in (("cold", {"cold": True}), ("warm", {"warm": True}), ("sun", {"sun": True})):
        lit_by(court, **lit)
        assert bake(output=output, domain=domain, attribute=name).lines == report.lines
        parts[name] = [read_colors(item, name) for item in court["items"]]
    for index, found in enumerate(together):
        assert difference(found["Radiosity warm"], parts["warm"][index]) < SOLVER_TOLERANCE
        assert difference(found["Radiosity cold"], parts["cold"][index]) < SOLVER_TOLERANCE
        total = sum(parts[name][index] for name in parts)
        assert difference(found["Radiosity"], total) < SOLVER_TOLERANCE


def test_the_main_attribute_is_the_sum_and_stays_active(court):
    add_both(court)
    bpy.data.objects["Sun"].hide_render = True
    bake()
    for item in court["items"]:
        parts = read_colors(item, "Radiosity warm") + read_colors(item, "Radiosity cold")
        assert difference(read_colors(item), parts) < ROUNDING
        assert item.data.color_attributes.active_color.name == "Radiosity"


@pytest.mark.parametrize("reconstruction", ['AREA_AVERAGE', 'POINT'])
def test_all_lights_are_those_of_a_bake_without_sets(court, reconstruction):
    """The light of all light sets together equals that of a bake without light sets.

    The tolerance is the noise of the shadow rays. They differ between the two bakes, because the
    panel is bright enough for shadow rays in both. LEAST_SQUARES is not tested. It is not linear
    where its solution would be negative, which happens in the light of single sets on this floor of
    one face.
    """
    bake(attribute="Plain", target_error=0.02, reconstruction=reconstruction)
    add_both(court)
    bake(target_error=0.02, reconstruction=reconstruction)
    for item in court["items"]:
        plain = read_colors(item, "Plain")
        error = np.sqrt(((read_colors(item) - plain) ** 2).mean() / (plain ** 2).mean())
        assert error < 0.02


def test_relight_updates_all_sets_on_the_same_lines(court):
    add_both(court)
    settings = bpy.context.scene.raybundle
    settings.max_patches, settings.max_bundles = 2000, 64
    assert bpy.ops.raybundle.bake() == {'FINISHED'}
    before = json.loads(settings.report)
    floor = court["items"][0]
    warm, cold = read_colors(floor, "Radiosity warm"), read_colors(floor, "Radiosity cold")
    bpy.data.objects["Blue"].data.color = (0.1, 0.2, 0.5)
    court["sky"].default_value = (*(0.5 * value for value in SKY), 1.0)
    assert bpy.ops.raybundle.relight() == {'FINISHED'}
    after = json.loads(settings.report)
    assert after["lines"] == before["lines"]
    assert "UNCHANGED_GEOMETRY" in {entry["id"] for entry in after["skipped"]}
    assert difference(read_colors(floor, "Radiosity warm"), warm) < SOLVER_TOLERANCE
    assert difference(read_colors(floor, "Radiosity cold"), 0.5 * cold) < SOLVER_TOLERANCE


def test_clear_removes_the_attributes_of_all_sets(court):
    add_both(court)
    bake()
    # Clear must find the attributes although one set has been renamed and the other disabled.
    sets = bpy.context.scene.raybundle.light_sets
    sets[0].name, sets[1].enabled = "hot", False
    other = court["items"][0].data.color_attributes.new("Mine", 'FLOAT_COLOR', 'CORNER')
    assert other is not None
    assert bpy.ops.raybundle.clear() == {'FINISHED'}
    assert [attribute.name for attribute in court["items"][0].data.color_attributes] == ["Mine"]
    assert len(court["items"][1].data.color_attributes) == 0


def test_sets_are_saved_with_the_file(court, tmp_path):
    add_both(court)
    bake()
    wanted = read_colors(court["items"][0], "Radiosity cold")
    path = str(tmp_path / "sets.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    warm, cold = bpy.context.scene.raybundle.light_sets
    assert (warm.name, warm.collection.name, warm.world) == ("warm", "Warm", False)
    assert (cold.name, cold.collection.name, cold.world) == ("cold", "Cold", True)
    floor = bpy.data.objects["Floor"]
    assert np.array_equal(read_colors(floor, "Radiosity cold"), wanted)
    bake()
    assert difference(read_colors(floor, "Radiosity cold"), wanted) < SOLVER_TOLERANCE


def test_a_set_without_lights_is_black_and_named(court):
    add_set("nothing")
    add_set("hidden", court["warm"])
    bpy.data.objects["Red"].hide_render = True
    bpy.data.objects["Panel"].hide_render = True
    report = bake()
    for name in ("nothing", "hidden"):
        assert any(f'light set "{name}"' in warning for warning in report.warnings)
        assert not read_colors(court["items"][0], f"Radiosity {name}").any()
    assert read_colors(court["items"][0]).max() > 0.0


def emit_image(material):
    image = bpy.data.images.new("Glow", 2, 2, float_buffer=True)
    image.pixels[:] = [40.0, 20.0, 10.0, 1.0] * 4
    tree = material.node_tree
    texture = tree.nodes.new('ShaderNodeTexImage')
    texture.image = image
    tree.links.new(texture.outputs['Color'], tree.nodes["Emission"].inputs['Color'])


def emit_attribute(material):
    mesh = bpy.data.objects["Panel"].data
    layer = mesh.color_attributes.new("Glow", 'FLOAT_COLOR', 'CORNER')
    layer.data.foreach_set('color', [40.0, 20.0, 10.0, 1.0] * len(mesh.loops))
    tree = material.node_tree
    attribute = tree.nodes.new('ShaderNodeVertexColor')
    attribute.layer_name = "Glow"
    tree.links.new(attribute.outputs['Color'], tree.nodes["Emission"].inputs['Color'])


@pytest.mark.parametrize("emit", (emit_image, emit_attribute))
def test_objects_that_emit_an_image_or_an_attribute_belong_to_sets(court, emit):
    """An image or attribute of uniform colour gives the same light as the colour."""
    add_set("warm", court["warm"])
    bpy.data.objects["Red"].hide_render = True
    glow = bpy.data.materials["Glow"].node_tree.nodes["Emission"].inputs['Color']
    glow.default_value = (40.0, 20.0, 10.0, 1.0)
    # Both bakes have the same lines and shadow rays, so that their noise is equal at each corner.
    bake()
    expected = [read_colors(item, "Radiosity warm") for item in court["items"]]
    emit(bpy.data.materials["Glow"])
    bake()
    for item, light in zip(court["items"], expected):
        assert difference(read_colors(item, "Radiosity warm"), light) < 0.02


def test_disabled_sets_are_not_baked(court):
    add_both(court)
    bpy.context.scene.raybundle.light_sets[0].enabled = False
    report = bake()
    names = {attribute.name for attribute in court["items"][0].data.color_attributes}
    assert names == {"Radiosity", "Radiosity cold"}
    assert [entry["name"] for entry in report.light_sets] == ["cold"]


def test_instances_of_a_collection_belong_to_the_set_of_their_empty(court, new_light):
    lamp = new_light("Hung", 'POINT', 20.0, (0, 0, 2))
    source = bpy.data.collections.new("Lamp")
    source.objects.link(lamp)
    bpy.context.scene.collection.objects.unlink(lamp)
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection = 'COLLECTION', source
    bpy.context.scene.collection.objects.link(empty)
    add_set("hung", collection_of("Hung", empty))
    bake()
    assert read_colors(court["items"][0], "Radiosity hung").max() > 0.0


def test_copies_and_means_have_the_sets_too(court):
    add_both(court)
    bake(topology='SUBDIVIDE', patch_size=0.3)
    copies = [item for item in bpy.context.scene.objects if item.raybundle.source]
    assert copies
    for item in copies:
        assert "Radiosity cold" in item.data.color_attributes
    bpy.ops.raybundle.clear()
    twin = bpy.data.objects.new("Twin", court["items"][1].data)
    twin.location = (1.0, 3.0, 0.8)
    bpy.context.scene.collection.objects.link(twin)
    bake(shared_meshes='AVERAGE')
    assert read_colors(twin, "Radiosity warm").max() > 0.0


# --------------------------------------------------------------------------------------------------
# Errors of the user
# --------------------------------------------------------------------------------------------------


def expect_error(*texts):
    with pytest.raises((raybundle.BakeError, raybundle.RaybundleError)) as raised:
        bake()
    for text in texts:
        assert text in str(raised.value)


def test_names_that_clash(court):
    add_set("a", court["warm"])
    second = add_set("a", court["cold"])
    expect_error('Two light sets have the name "a"')
    second.name, second.attribute = "b", "Radiosity a"
    expect_error('"b"', '"Radiosity a"', '"a"')
    second.attribute = "Radiosity"
    expect_error('"b"', '"Radiosity"', "light of all")
    second.name, second.attribute = "", ""
    expect_error("has no name")
    second.name = "x" * 60
    expect_error("longer than")
    second.name = "b"
    court["items"][0].data.attributes.new("Radiosity b", 'FLOAT', 'POINT')
    expect_error('"Floor"', '"Radiosity b"')
    assert "Radiosity" not in court["items"][0].data.color_attributes


def test_a_light_in_two_sets(court):
    add_both(court)
    court["cold"].objects.link(bpy.data.objects["Red"])
    expect_error('"Red"', '"warm"', '"cold"')
    court["cold"].objects.unlink(bpy.data.objects["Red"])
    court["cold"].objects.link(bpy.data.objects["Panel"])
    expect_error('"Panel"', '"warm"', '"cold"')
    court["cold"].objects.unlink(bpy.data.objects["Panel"])
    # An object that does not emit may be in two sets.
    for name in ("warm", "cold"):
        court[name].objects.link(court["items"][0])
    bake()
    bpy.context.scene.raybundle.light_sets[0].world = True
    expect_error("The world", '"warm"', '"cold"')


def test_other_solvers_refuse(court):
    add_both(court)
    with pytest.raises(raybundle.RaybundleError, match="light sets") as raised:
        bake(solver='MULTIPATH', directions='RANDOM')
    assert raised.value.code == native.ErrorCode.INVALID_ARGUMENT


def test_operators_add_and_remove():
    settings = bpy.context.scene.raybundle
    assert not bpy.ops.raybundle.light_set_remove.poll()
    for _ in range(3):
        assert bpy.ops.raybundle.light_set_add() == {'FINISHED'}
    assert [item.name for item in settings.light_sets] == ["Set 1", "Set 2", "Set 3"]
    settings.light_set_index = 1
    bpy.ops.raybundle.light_set_remove()
    bpy.ops.raybundle.light_set_add()
    assert [item.name for item in settings.light_sets] == ["Set 1", "Set 3", "Set 2"]
    for _ in range(3):
        bpy.ops.raybundle.light_set_remove()
    assert len(settings.light_sets) == 0 and settings.light_set_index == 0
