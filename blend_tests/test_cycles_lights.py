# SPDX-License-Identifier: GPL-3.0-or-later
"""Each kind of light with its options, compared with Cycles of the running Blender.

The tests check units, shapes, orientation, shadows and visibility. A lamp shines on a floor of 4 m
with nothing in between, and LIGHTING is compared with the bake type Diffuse without Color
(cycles_reference.py). With 256 samples, the mean of Cycles over 441 vertices has less than 0.5 %
noise. A wrong factor or orientation changes this mean by more than the tolerance, 1 %. Single
vertices have noise from both programs (2 %), and least-squares values differ from point samples by
the curvature of the light over a square of 20 cm. The tolerance of the RMSE is therefore 5 %.

Spots have tolerances of 2 % and 10 %. Their edges are narrower than the squares of the floor, and
Blender 3.4 dims them by the cosine to the axis, which the export approximates by its mean.
"""

import bpy
import numpy as np
import pytest
import raybundle
from cycles_comparison import assert_same_mean, cycles_light, raybundle_light, square
from cycles_reference import bake_objects, prepare_scene

pytestmark = pytest.mark.needs_library

SAMPLES = 256
SIZE, DIVISIONS = 4.0, 20


@pytest.fixture
def floor(new_object, new_material):
    steps = np.linspace(-SIZE / 2, SIZE / 2, DIVISIONS + 1)
    vertices = [(x, y, 0.0) for y in steps for x in steps]
    row = DIVISIONS + 1
    faces = [(i, i + 1, i + row + 1, i + row)
             for y in range(DIVISIONS) for i in range(y * row, y * row + DIVISIONS)]
    # Cycles bakes diffuse light only on surfaces with some reflectance. The floor reflects light to
    # no other surface.
    return new_object("Floor", vertices, faces, new_material("White", (0.8, 0.8, 0.8)))


def compare(floor, mean_tolerance=0.01, rmse_tolerance=0.05):
    prepare_scene(bpy.context.scene, SAMPLES, 0)
    expected = bake_objects([floor], SAMPLES, 0)[floor.name]
    raybundle.bake(bpy.context, scope='VISIBLE', target_error=0.01)
    attribute = floor.data.color_attributes["Radiosity"]
    values = np.empty(4 * len(attribute.data), np.float32)
    attribute.data.foreach_get('color', values)
    actual = values.reshape(-1, 4)[:, :3]
    assert expected.mean() > 0.0
    assert actual.mean(axis=0) == pytest.approx(expected.mean(axis=0), rel=mean_tolerance)
    rmse = np.sqrt(((actual - expected) ** 2).mean() / (expected ** 2).mean())
    assert rmse < rmse_tolerance


@pytest.mark.parametrize("kind, energy, values, rotation, scale", [
    ('POINT', 100.0, {'shadow_soft_size': 0.0}, (0, 0, 0), (1, 1, 1)),
    ('POINT', 100.0, {'shadow_soft_size': 0.8, 'color': (1.0, 0.5, 0.2)}, (0, 0, 0), (1, 1, 1)),
    ('SPOT', 100.0, {'shadow_soft_size': 0.0, 'spot_size': 1.2, 'spot_blend': 1.0},
     (0.3, 0.2, 0), (1, 1, 1)),
    ('SPOT', 100.0, {'shadow_soft_size': 0.1, 'spot_size': 0.9, 'spot_blend': 1.0},
     (0, 0, 0.5), (2.0, 1.0, 1.0)),
    ('SUN', 2.0, {'angle': 0.0}, (0.7, 0.3, 0), (1, 1, 1)),
    ('SUN', 2.0, {'angle': 1.0}, (0.7, 0.3, 0), (1, 1, 1)),
    ('AREA', 50.0, {'shape': 'SQUARE', 'size': 0.8}, (0.4, 0.2, 0), (1, 1, 1)),
    ('AREA', 50.0, {'shape': 'RECTANGLE', 'size': 2.0, 'size_y': 0.3}, (0.3, 0, 0.6), (1, 1, 1)),
    ('AREA', 50.0, {'shape': 'DISK', 'size': 1.0}, (0, 0.4, 0), (-1, 1, 1)),
    ('AREA', 50.0, {'shape': 'ELLIPSE', 'size': 1.0, 'size_y': 0.5}, (0.3, 0, 0.6), (2, 1, 1)),
])
def test_light(floor, new_light, kind, energy, values, rotation, scale):
    light = new_light("Light", kind, energy, (0.3, -0.2, 1.5), **values)
    light.rotation_euler, light.scale = rotation, scale
    bpy.context.view_layer.update()
    compare(floor, *((0.02, 0.10) if kind == 'SPOT' else ()))

# --------------------------------------------------------------------------------------------------
# Shapes and options, with point samples at the vertices, as Cycles has them
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind, energy, values, rotation, scale", [
    ('SPOT', 100.0, {'shadow_soft_size': 0.0, 'spot_size': 1.4, 'spot_blend': 0.0},
     (0.3, 0.2, 0), (1, 1, 1)),
    ('SPOT', 100.0, {'shadow_soft_size': 0.2, 'spot_size': 1.2, 'spot_blend': 0.15},
     (0.1, 0.3, 0), (1, 1.5, 1)),
    ('AREA', 50.0, {'shape': 'SQUARE', 'size': 1.0, 'spread': 2.4}, (0.2, 0.1, 0), (1, 1, 1)),
    ('AREA', 50.0, {'shape': 'RECTANGLE', 'size': 1.6, 'size_y': 0.4, 'spread': 1.2},
     (0.1, 0, 0.6), (1, 1, 1)),
    ('AREA', 50.0, {'shape': 'DISK', 'size': 1.0, 'spread': 0.6}, (0, 0.2, 0), (-1, 1, 1)),
    ('AREA', 50.0, {'shape': 'ELLIPSE', 'size': 1.0, 'size_y': 0.6, 'spread': 1.6},
     (0.3, 0, 0.6), (2, 1, 0.5)),
    ('AREA', 50.0, {'shape': 'RECTANGLE', 'size': 1.0, 'size_y': 0.5, 'spread': 0.2},
     (0, 0.1, 0), (1, -1, 1)),
])
def test_option(floor, new_light, kind, energy, values, rotation, scale):
    light = new_light("Light", kind, energy, (0.3, -0.2, 1.5), **values)
    light.rotation_euler, light.scale = rotation, scale
    bpy.context.view_layer.update()
    assert_same_mean(raybundle_light([floor]), cycles_light([floor]))


# Options of Blender 4.5 and later.
@pytest.mark.parametrize("name, value", [
    ('exposure', 1.5), ('normalize', False), ('use_temperature', True)])
def test_newer_option(floor, new_light, name, value):
    light = new_light("Light", 'AREA', 20.0, (0.3, -0.2, 1.5), size=0.6)
    if not hasattr(light.data, name):
        pytest.skip(f"this Blender has no {name}")
    setattr(light.data, name, value)
    assert_same_mean(raybundle_light([floor]), cycles_light([floor]))


@pytest.mark.parametrize("first_shot", ['GATHER', 'SHOOT'])
def test_spread_shoots_what_it_gathers(floor, new_light, first_shot):
    new_light("Light", 'AREA', 50.0, (0.3, -0.2, 1.5), size=1.0, spread=1.0)
    # With POINT, the vertices would gather direct light whatever the first shot is. The mean over
    # the floor averages out most of the 2 % noise of the patches.
    actual = raybundle_light([floor], first_shot=first_shot, reconstruction='LEAST_SQUARES',
                             target_error=0.02)
    assert_same_mean(actual, cycles_light([floor]))


# --------------------------------------------------------------------------------------------------
# Shadows and visibility
# --------------------------------------------------------------------------------------------------


@pytest.fixture
def room(floor, new_object, new_material):
    """Returns a floor, a wall beside it and a board above it, none of which touch."""
    white = new_material("Bright", (0.8, 0.8, 0.8))
    wall = new_object("Wall", *square(2.4, 8), white, (-1.5, 0.0, 1.4))
    wall.rotation_euler = (0.0, np.pi / 2, 0.0)
    board = new_object("Board", *square(1.2, 6), white, (0.4, 0.2, 0.8))
    bpy.context.view_layer.update()
    return [floor, wall, board]


def set_shadows(light, value):
    cycles = light.data.cycles
    setattr(*((cycles, 'cast_shadow') if hasattr(cycles, 'cast_shadow')
              else (light.data, 'use_shadow')), value)


def compare_parts(items):
    direct, both = (cycles_light(items, passes, samples=SAMPLES // 2)
                    for passes in (("DIRECT",), ("DIRECT", "INDIRECT")))
    assert_same_mean(raybundle_light(items), both)
    assert_same_mean(raybundle_light(items, 'DIRECT'), direct, scale=both)


@pytest.mark.parametrize("kind, values", [
    ('POINT', {'energy': 100.0, 'shadow_soft_size': 0.1}), ('AREA', {'energy': 100.0, 'size': 0.5}),
    ('SUN', {'energy': 2.0, 'angle': 0.1})])
def test_light_without_shadows(room, new_light, kind, values):
    light = new_light("Light", kind, values.pop('energy'), (0.5, 0.0, 1.8), **values)
    light.rotation_euler = (0.3, 0.2, 0.0)
    set_shadows(light, False)
    compare_parts(room)


@pytest.mark.parametrize("which", [1, 2])
@pytest.mark.parametrize("flag", ['visible_camera', 'visible_diffuse', 'visible_shadow',
                                  'is_shadow_catcher'])
def test_visibility_to_a_lamp(room, new_light, which, flag):
    new_light("Light", 'POINT', 100.0, (0.5, 0.0, 1.8), shadow_soft_size=0.1)
    setattr(room[which], flag, flag.startswith('is_'))
    if is_black_in_cycles(room[which]):
        compare_named(room, room[which], "shadow catcher")
    else:
        compare_parts(room)


@pytest.mark.parametrize("flag", ['visible_diffuse', 'visible_shadow'])
def test_visibility_to_the_world(room, new_world, flag):
    new_world((0.4, 0.6, 0.9))
    setattr(room[1], flag, False)
    compare_parts(room)


def is_black_in_cycles(item):
    return item.is_holdout or item.is_shadow_catcher and bpy.app.version >= (4, 0, 0)


def compare_named(items, black, what):
    """Compares the light of `items`, of which Cycles bakes one, `black`, as black.

    To the other objects, Cycles treats `black` as an ordinary object. Raybundle must name `black`
    in a warning that contains `what`.
    """
    report = raybundle.bake(bpy.context)
    assert any(f'"{black.name}"' in text and what in text for text in report.warnings)
    expected = cycles_light(items)
    assert (expected.pop(black.name) == 0.0).all()
    assert_same_mean(raybundle_light(items), expected)


def test_holdout_is_named(room, new_light):
    new_light("Light", 'POINT', 100.0, (0.5, 0.0, 1.8), shadow_soft_size=0.1)
    room[2].is_holdout = True
    compare_named(room, room[2], "holdout")


@pytest.mark.parametrize("change", [
    lambda light: setattr(light, 'visible_diffuse', False),
    lambda light: setattr(light, 'hide_render', True),
    lambda light: setattr(light.data.cycles, 'is_portal', True)])
def test_light_that_gives_no_light(floor, new_light, change):
    # The second lamp is needed because Cycles (4.2, 5.0) crashes if it bakes without any light.
    new_light("Other", 'POINT', 10.0, (0.5, 0.0, 1.5), shadow_soft_size=0.1)
    change(new_light("Light", 'AREA', 10.0, (0.0, 0.0, 1.5)))
    bpy.context.view_layer.update()
    compare(floor)


def test_lamp_that_diffuse_light_does_not_see(floor, new_object, new_material):
    lamp = new_object("Lamp", *square(0.8, 1), new_material("Lamp", (0, 0, 0), (6.0, 5.0, 4.0)),
                      (0.3, -0.2, 1.5))
    lamp.visible_diffuse = False
    assert (raybundle_light([floor])["Floor"] == 0.0).all()
    assert (cycles_light([floor])["Floor"] == 0.0).all()


def test_bounces_of_a_light_are_named(floor, new_light):
    new_light("Light", 'POINT', 50.0, (0.0, 0.0, 1.5)).data.cycles.max_bounces = 0
    report = raybundle.bake(bpy.context)
    assert any('"Light"' in text and "Max Bounces of 0" in text for text in report.warnings)


# --------------------------------------------------------------------------------------------------
# Nodes, world, emission
# --------------------------------------------------------------------------------------------------


def test_light_with_nodes(floor, new_light):
    light = new_light("Light", 'POINT', 50.0, (0.0, 0.0, 1.5), shadow_soft_size=0.1)
    light.data.use_nodes = True
    node = next(node for node in light.data.node_tree.nodes if node.type == 'EMISSION')
    node.inputs['Color'].default_value = (0.2, 0.6, 1.0, 1.0)
    node.inputs['Strength'].default_value = 3.0
    compare(floor)


def test_world(floor, new_world):
    new_world((0.3, 0.5, 0.9)).inputs['Strength'].default_value = 1.5
    compare(floor)


@pytest.mark.parametrize("flipped", [False, True])
def test_emission_of_a_mesh_has_two_sides(floor, new_object, new_material, flipped):
    corners = [(-0.5, -0.4, 1.5), (0.5, -0.4, 1.5), (0.5, 0.4, 1.2), (-0.5, 0.4, 1.2)]
    face = (0, 1, 2, 3) if flipped else (3, 2, 1, 0)
    lamp = new_object("Lamp", corners, [face], new_material("Lamp", (0, 0, 0), (5.0, 3.0, 1.0)))
    lamp.raybundle.role = 'OCCLUDE'
    compare(floor)


# The small lamp is gathered like a light source. The light of the large one is left to the bundles,
# as reflected light is.
@pytest.mark.parametrize("size", [0.8, 2.2])
@pytest.mark.parametrize("flipped", [False, True])
def test_emission_of_one_side(floor, new_object, new_material, flipped, size):
    # A Mix shader with Backfacing as its factor: the front emits, and the back is black.
    material = new_material("Lamp", (0, 0, 0), (4.0, 2.0, 1.0))
    nodes, links = material.node_tree.nodes, material.node_tree.links
    output = next(node for node in nodes if node.type == 'OUTPUT_MATERIAL')
    lit = output.inputs['Surface'].links[0].from_socket
    black = nodes.new('ShaderNodeBsdfDiffuse')
    black.inputs['Color'].default_value = (0, 0, 0, 1)
    geometry, mix = nodes.new('ShaderNodeNewGeometry'), nodes.new('ShaderNodeMixShader')
    links.new(geometry.outputs['Backfacing'], mix.inputs[0])
    links.new(lit, mix.inputs[1])
    links.new(black.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], output.inputs['Surface'])
    lamp = new_object("Lamp", *square(size, 1), material, (0.3, -0.2, 1.2))
    if not flipped:
        lamp.data.flip_normals()
    lamp.raybundle.role = 'OCCLUDE'
    ceiling = new_object("Ceiling", *square(SIZE, DIVISIONS), floor.data.materials[0],
                         (0.0, 0.0, 2.6))
    ceiling.data.flip_normals()
    # One of the floor and the ceiling gets the light of the lamp. The other one, which is dark,
    # only gets light that is reflected past the lamp, and needs more samples than in other tests.
    # With 4 bakes of 450 samples under the small lamp, their mean has a standard deviation of
    # 0.10 %. Under the large lamp, 4 times as many samples are needed.
    lit, dark = (ceiling, floor) if flipped else (floor, ceiling)
    expected = {**cycles_light([lit]), **cycles_light([dark], samples=450 if size < 1 else 1800)}
    means = {name: light.mean() for name, light in expected.items()}
    assert (means["Floor"] > 3 * means["Ceiling"]) != flipped
    assert (means["Ceiling"] > 3 * means["Floor"]) == flipped
    # The noise of Raybundle in the mean of the dark object is 0.04 %.
    assert_same_mean(raybundle_light([floor, ceiling]), expected)


@pytest.mark.parametrize("falloff, is_named", [('Quadratic', False), ('Linear', True)])
def test_falloff_nodes(floor, new_light, falloff, is_named):
    light = new_light("Light", 'POINT', 50.0, (0.0, 0.0, 1.5), shadow_soft_size=0.1)
    light.data.use_nodes = True
    tree = light.data.node_tree
    emission = next(node for node in tree.nodes if node.type == 'EMISSION')
    node = tree.nodes.new('ShaderNodeLightFalloff')
    node.inputs['Strength'].default_value = 2.0
    tree.links.new(node.outputs[falloff], emission.inputs['Strength'])
    warnings = raybundle.bake(bpy.context).warnings
    assert any('"Light"' in text and "falls off" in text for text in warnings) == is_named
    if not is_named:
        assert_same_mean(raybundle_light([floor]), cycles_light([floor]))
