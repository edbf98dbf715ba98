# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds of every kind, compared with Cycles of the running Blender.

A box stands on a floor under the open sky. LIGHTING is compared with the bake type Diffuse without
Color (cycles_reference.py). The tests compare means over the quarters of the floor and the faces of
the box, so that a wrong direction shows, at corners off the contact edge. The tolerance is 1 % of
the mean over all of them. Raybundle computes the light at the vertices too (POINT). The noise of
both is below 0.3 % in each mean: Cycles has 1024 samples at 36 vertices or more, each with about
1 % noise.
"""

import math

import bpy
import numpy as np
import pytest
import raybundle
from cycles_reference import bake_objects, prepare_scene
from raybundle import scene_export, world_export, world_panorama

needs_library = pytest.mark.needs_library

SAMPLES = 1024
SIZE, DIVISIONS = 4.0, 12
BOX = 0.5  # half the length of an edge, m


def grid(origin, a, b, count):
    steps = np.arange(count + 1) / count
    vertices = [tuple(np.array(origin) + s * np.array(a) + t * np.array(b))
                for t in steps for s in steps]
    row = count + 1
    faces = [(i, i + 1, i + row + 1, i + row)
             for y in range(count) for i in range(y * row, y * row + count)]
    return vertices, faces


@pytest.fixture
def court(new_object, new_material):
    """Returns the objects of the scene: the floor and the faces of the box."""
    half = SIZE / 2.0
    grey = new_material("Grey", (0.5, 0.5, 0.5))
    made = [new_object("Floor", *grid((-half, -half, 0), (SIZE, 0, 0), (0, SIZE, 0), DIVISIONS),
                       grey)]
    low, up = -BOX, (0.0, 0.0, 2.0 * BOX)
    for name, origin, a, b in (("South", (low, low, 0), (1, 0, 0), up),
                               ("East", (BOX, low, 0), (0, 1, 0), up),
                               ("North", (BOX, BOX, 0), (-1, 0, 0), up),
                               ("West", (low, BOX, 0), (0, -1, 0), up),
                               ("Top", (low, low, 1.0), (1, 0, 0), (0, 1, 0))):
        made.append(new_object(name, *grid(origin, a, b, 5), grey))
    return made


def groups(item):
    """Returns masks of corners off the contact of box and floor, by the name of the group."""
    indices = np.empty(len(item.data.loops), np.int32)
    item.data.loops.foreach_get('vertex_index', indices)
    positions = np.empty(3 * len(item.data.vertices), np.float32)
    item.data.vertices.foreach_get('co', positions)
    x, y, z = positions.reshape(-1, 3)[indices].T
    if item.name == "Floor":
        off = np.maximum(np.abs(x), np.abs(y)) > BOX + 0.2
        return {f"Floor {sx:+d} {sy:+d}": off & (sx * x > 0.1) & (sy * y > 0.1)
                for sx in (-1, 1) for sy in (-1, 1)}
    return {item.name: z > 0.3}


def corner_light(item):
    data = item.data.color_attributes["Radiosity"].data
    values = np.empty(4 * len(data), np.float32)
    data.foreach_get('color', values)
    return values.reshape(-1, 4)[:, :3]


def compare(court):
    bpy.context.scene.cycles.use_adaptive_sampling = False
    prepare_scene(bpy.context.scene, SAMPLES, 0)
    expected = bake_objects(court, SAMPLES, 0)
    report = raybundle.bake(bpy.context, scope='VISIBLE', target_error=0.01, output='LIGHTING',
                            reconstruction='POINT', patch_size=0.1)
    assert not any("world" in text for text in report.warnings)
    pairs = {}
    for item in court:
        for name, mask in groups(item).items():
            pairs[name] = (corner_light(item)[mask].mean(axis=0),
                           expected[item.name][mask].mean(axis=0))
    mean = np.mean([pair[1] for pair in pairs.values()], axis=0)
    assert mean.min() > 0.0
    differences = {name: np.abs(a - b).max() / mean.max() for name, (a, b) in pairs.items()}
    shown = {name: f"{a.mean():.4f} {b.mean():.4f}" for name, (a, b) in pairs.items()}
    assert max(differences.values()) < 0.01, f"ours and Cycles: {shown}"
    total = np.mean([pair[0] for pair in pairs.values()], axis=0)
    assert total == pytest.approx(mean, rel=0.01, abs=0.003 * float(mean.max()))


class Tree:
    """The node tree of a new world, which becomes that of the scene."""

    def __init__(self):
        self.world = bpy.data.worlds.new("World")
        self.world.use_nodes = True
        bpy.context.scene.world = self.world
        # By default Cycles builds a map of the bright parts of a world, which takes far longer than
        # the bake.
        self.world.cycles.sampling_method = 'MANUAL'
        self.world.cycles.sample_map_resolution = 512
        self.tree = self.world.node_tree
        self.background = next(node for node in self.tree.nodes if node.type == 'BACKGROUND')

    def add(self, kind, to=None, **inputs):
        node = self.tree.nodes.new(kind)
        for name, value in inputs.items():
            node.inputs[name].default_value = value
        self.tree.links.new(node.outputs[0], to or self.background.inputs['Color'])
        return node


def hdri():
    """Returns an environment image: a gradient, and a spot of 3 pixels with half of the light."""
    height, width = 64, 128
    values = np.ones((height, width, 4), np.float32)
    rise = np.linspace(0.1, 1.0, height)[:, None]
    values[..., 0], values[..., 1], values[..., 2] = rise, 0.5 * rise ** 2, 1.0 - 0.5 * rise
    values[44, 80:83, :3] = (300.0, 250.0, 200.0)
    image = bpy.data.images.new("HDRI", width, height, float_buffer=True)
    image.pixels.foreach_set(values.ravel())
    image.update()
    return image


@needs_library
def test_constant(court):
    tree = Tree()
    tree.background.inputs['Color'].default_value = (0.3, 0.5, 0.9, 1.0)
    compare(court)


@needs_library
@pytest.mark.parametrize("rotation", [None, (0.4, 0.3, 2.0)])
def test_environment_image(court, rotation):
    tree = Tree()
    texture = tree.add('ShaderNodeTexEnvironment')
    texture.image = hdri()
    if rotation is not None:
        mapping = tree.add('ShaderNodeMapping', texture.inputs['Vector'], Rotation=rotation)
        coordinates = tree.tree.nodes.new('ShaderNodeTexCoord')
        tree.tree.links.new(coordinates.outputs['Generated'], mapping.inputs['Vector'])
    compare(court)


@needs_library
def test_gradient_that_the_camera_does_not_see(court):
    tree = Tree()
    # The world is white for camera rays. For other rays it is a colour ramp over the elevation.
    mix = tree.add('ShaderNodeMixRGB', Color2=(9.0, 9.0, 9.0, 1.0))
    path = tree.tree.nodes.new('ShaderNodeLightPath')
    tree.tree.links.new(path.outputs['Is Camera Ray'], mix.inputs['Fac'])
    ramp = tree.add('ShaderNodeValToRGB', mix.inputs['Color1'])
    ramp.color_ramp.elements[0].color = (0.1, 0.05, 0.02, 1.0)
    ramp.color_ramp.elements[1].color = (0.4, 0.7, 1.0, 1.0)
    gradient = tree.add('ShaderNodeTexGradient', ramp.inputs['Fac'])
    mapping = tree.add('ShaderNodeMapping', gradient.inputs['Vector'], Rotation=(0.2, 1.2, 0.0))
    coordinates = tree.tree.nodes.new('ShaderNodeTexCoord')
    tree.tree.links.new(coordinates.outputs['Generated'], mapping.inputs['Vector'])
    compare(court)


def new_sky(tree, elevation, **values):
    sky = tree.add('ShaderNodeTexSky')
    # Blender 5.0 replaced this type of sky by two others.
    kinds = [item.identifier for item in sky.bl_rna.properties['sky_type'].enum_items]
    sky.sky_type = 'NISHITA' if 'NISHITA' in kinds else 'MULTIPLE_SCATTERING'
    sky.sun_elevation, sky.sun_rotation = elevation, 2.2
    for name, value in values.items():
        setattr(sky, name, value)
    return sky


@needs_library
@pytest.mark.parametrize("elevation, values", [
    (0.6, {}), (0.3, {'sun_size': math.radians(8.0)}), (0.6, {'sun_disc': False})])
def test_sky_texture(court, elevation, values):
    new_sky(Tree(), elevation, **values)
    compare(court)


@needs_library
def test_world_that_diffuse_surfaces_do_not_see(court, new_light):
    tree = Tree()
    tree.world.cycles_visibility.diffuse = False
    new_light("Sun", 'SUN', 1.0).rotation_euler = (0.5, 0.3, 0.0)
    # Compares only the floor. The walls get little other light than it reflects.
    compare(court[:1])


# --------------------------------------------------------------------------------------------------
# The evaluation of a world
# --------------------------------------------------------------------------------------------------


def exported():
    bpy.context.view_layer.update()
    return scene_export.export_scene(bpy.context)


def mean_radiance(scene):
    """Returns (3,) the mean radiance over all directions, including that of the image."""
    image = scene.world_image
    angles = world_panorama.solid_angles(*image.shape[:2])
    return scene.world + (image * angles[..., None]).sum(axis=(0, 1)) / (4.0 * np.pi)


def test_an_image_keeps_its_mean_and_place():
    tree = Tree()
    texture = tree.add('ShaderNodeTexEnvironment')
    image = texture.image = hdri()
    result = exported()
    assert result.warnings == []
    pixels = np.empty(4 * 64 * 128, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(64, 128, 4)[:, :, :3]
    expected = (pixels * world_panorama.solid_angles(64, 128)[..., None]).sum(axis=(0, 1))
    # Cycles interpolates between pixels, whose solid angles differ slightly.
    assert mean_radiance(result.scene) == pytest.approx(expected / (4.0 * np.pi), rel=2e-3)
    row, column = np.unravel_index(result.scene.world_image.sum(axis=2).argmax(),
                                   result.scene.world_image.shape[:2])
    height, width = result.scene.world_image.shape[:2]
    assert (row + 0.5) / height == pytest.approx(44.5 / 64, abs=0.01)
    assert (column + 0.5) / width == pytest.approx(81.5 / 128, abs=0.02)


def test_a_constant_behind_unread_nodes_stays_constant():
    tree = Tree()
    tree.add('ShaderNodeHueSaturation', Color=(0.2, 0.4, 0.6, 1.0), Value=2.0)
    scene = exported().scene
    assert scene.world_image is None
    assert scene.world == pytest.approx([0.4, 0.8, 1.2], rel=1e-3)


@pytest.mark.parametrize("elevation", [0.1, 1.5])
def test_the_sun_of_a_sky_is_a_light(elevation):
    new_sky(Tree(), elevation)
    scene = exported().scene
    sun, = scene.lights
    assert math.asin(sun.direction[2]) == pytest.approx(elevation, abs=5e-4)
    assert sun.angle == pytest.approx(math.radians(0.545), rel=1e-3)
    # The remaining sky is smooth, but that of 5.0 is brighter around a low sun. A disc would be 1e5
    # times as bright as the mean.
    brightest = 100.0 if bpy.app.version < (5, 0, 0) else 200.0
    assert scene.world_image.max() < brightest * mean_radiance(scene).max()


def test_bright_parts_of_a_sky_are_rendered_together(monkeypatch):
    new_sky(Tree(), 0.26)
    apart = [((0, 5), (0, 5)), ((5, 10), (0, 5)), ((0, 10), (5, 9)), ((40, 45), (40, 45))]
    assert sorted(world_panorama._joined(apart)) == [((0, 10), (0, 9)), ((40, 45), (40, 45))]
    fine = []
    panorama = world_panorama._Renderer.panorama

    def counted(self, width, part=None):
        fine.extend([part] if part else [])
        return panorama(self, width, part)

    monkeypatch.setattr(world_panorama._Renderer, 'panorama', counted)
    monkeypatch.setattr(world_panorama, '_MAX_TILES', 6)
    together = world_panorama.evaluate(bpy.context.scene.world, 1).pixels
    assert 1 <= len(fine) <= 3
    monkeypatch.setattr(world_panorama, '_joined', lambda parts: parts)
    tiles = world_panorama.evaluate(bpy.context.scene.world, 1).pixels
    # Joining renders the parts between the tiles with finer pixels as well. The result may differ
    # only by their noise.
    assert np.allclose(together, tiles, rtol=0.05)
    angles = world_panorama.solid_angles(*tiles.shape[:2])[..., None]
    assert (together * angles).sum() == pytest.approx((tiles * angles).sum(), rel=1e-3)


def test_nothing_is_left_behind_and_the_evaluation_is_kept(monkeypatch):
    tree = Tree()
    sky = new_sky(tree, 0.6)
    calls = []
    bpy.app.handlers.render_complete.append(lambda *_: calls.append(1))
    before = {name: sorted(item.name for item in getattr(bpy.data, name))
              for name in ('scenes', 'worlds', 'objects', 'cameras', 'images', 'node_groups')}
    first = exported().scene.world_image
    try:
        assert {name: sorted(item.name for item in getattr(bpy.data, name))
                for name in before} == before
        assert not calls and len(bpy.app.handlers.render_complete) == 1
        assert sky.sun_disc and sky.sun_size == pytest.approx(math.radians(0.545))
    finally:
        bpy.app.handlers.render_complete.clear()

    def refuse(*_arguments):
        raise RuntimeError("no render")

    monkeypatch.setattr(world_panorama, 'evaluate', refuse)
    tree.background.location.x += 10.0
    assert exported().scene.world_image is first
    # A change causes a new evaluation. A world that cannot be evaluated causes a warning.
    sky.air_density = 2.0
    result = exported()
    assert result.scene.world_image is None
    assert any('"World"' in text and "no render" in text for text in result.warnings)


def test_groups_are_evaluated_and_not_changed():
    group = bpy.data.node_groups.new("Group", 'ShaderNodeTree')
    if hasattr(group, 'interface'):
        group.interface.new_socket("Color", in_out='OUTPUT', socket_type='NodeSocketColor')
    else:
        group.outputs.new('NodeSocketColor', "Color")
    inner = group.nodes.new('ShaderNodeLightPath')
    output = group.nodes.new('NodeGroupOutput')
    texture = group.nodes.new('ShaderNodeTexGradient')
    mix = group.nodes.new('ShaderNodeMixRGB')
    mix.inputs['Color2'].default_value = (5.0, 0.0, 0.0, 1.0)
    group.links.new(texture.outputs['Color'], mix.inputs['Color1'])
    group.links.new(inner.outputs['Is Diffuse Ray'], mix.inputs['Fac'])
    group.links.new(mix.outputs['Color'], output.inputs[0])
    tree = Tree()
    node = tree.tree.nodes.new('ShaderNodeGroup')
    node.node_tree = group
    tree.tree.links.new(node.outputs[0], tree.background.inputs['Color'])
    scene = exported().scene
    assert scene.world == pytest.approx([5.0, 0.0, 0.0], abs=1e-3)
    assert bpy.data.node_groups[:] == [group] and len(group.nodes) == 4


@pytest.fixture(autouse=True)
def nothing_remembered():
    world_export._evaluated.clear()
    yield
