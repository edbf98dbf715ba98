# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake Channels writes parts of the light into R, G, B, A of one attribute, and nothing else."""

import bpy
import numpy as np
import pytest
import raybundle
from conftest import CUBE_FACES, CUBE_VERTICES
from raybundle.channel_bake import CHANNELS, bake_channels
from raybundle.materials.last_surfaces import LastSurfaces
from surface_error import read_colors

pytestmark = pytest.mark.needs_library

LUMINANCE = [0.2126, 0.7152, 0.0722]
# The same lines give the same light. What remains is the rounding of float sums.
SAME = 1e-5


def choose(*parts):
    for name, part in zip(CHANNELS, (*parts, 'NONE', 'NONE', 'NONE', 'NONE')):
        setattr(bpy.context.scene.raybundle, name, part)


def channels(item):
    """Returns (n, 4) of the scene's attribute."""
    data = item.data.color_attributes["Radiosity"].data
    colors = np.empty(4 * len(data), np.float32)
    data.foreach_get('color', colors)
    return colors.reshape(-1, 4)


@pytest.fixture
def corner(new_object, new_material, new_light):
    points = [(x, y, 0) for y in (-2, 0, 2) for x in (-2, 0, 2)]
    faces = [(i, i + 1, i + 4, i + 3) for i in (0, 1, 3, 4)]
    floor = new_object("Floor", points, faces, new_material("Grey", (0.5, 0.4, 0.3)))
    wall = new_object("Wall", [(x, 2, y + 2) for x, y, _ in points], faces,
                      new_material("Lamp", (0.2, 0.3, 0.6), (0.5, 0.2, 0.1)))
    new_light("Light", 'AREA', 100.0, (0.5, 0, 3), size=1.0)
    settings = bpy.context.scene.raybundle
    settings.max_patches, settings.max_bundles, settings.target_error = 500, 64, 0.01
    settings.max_vertices = 200  # few, for the time that the target takes
    return [floor, wall]


@pytest.mark.parametrize("topology", ['KEEP', 'SUBDIVIDE', 'ADAPTIVE'])
@pytest.mark.parametrize("domain", ['CORNER', 'POINT'])
def test_channels_are_the_luminance_of_bakes(corner, domain, topology):
    settings = bpy.context.scene.raybundle
    settings.domain, settings.topology = domain, topology
    light_set = settings.light_sets.add()
    light_set.name = "Lamp"
    light_set.collection = bpy.data.collections.new("Lamp")
    light_set.collection.objects.link(bpy.data.objects["Light"])
    choose('DIRECT', 'INDIRECT', 'SET_1', 'COMBINED')
    assert bpy.ops.raybundle.bake_channels() == {'FINISHED'}

    def items():
        return [bpy.data.objects[name] if topology == 'KEEP'
                else bpy.data.objects[f"{name} (Radiosity)"] for name in ("Floor", "Wall")]

    found = [channels(item) for item in items()]
    # Each bake replaces the copies.
    for item in items():
        assert [entry.name for entry in item.data.color_attributes] == ["Radiosity"]
    for position, output in enumerate(('DIRECT', 'INDIRECT', 'LIGHTING', 'COMBINED')):
        raybundle.bake(bpy.context, output=output)
        name = "Radiosity Lamp" if output == 'LIGHTING' else "Radiosity"
        for item, colors in zip(items(), found):
            expected = read_colors(item, name) @ LUMINANCE
            assert np.abs(colors[:, position] - expected).max() <= SAME * expected.max()


def test_ambient_occlusion(new_object, new_light, new_material, closed_box):
    """1 in the open, 0 in a closed box, whatever shines there."""
    plane = new_object("Plane", [(-1, -1, 5), (1, -1, 5), (1, 1, 5), (-1, 1, 5)], [(0, 1, 2, 3)])
    new_light("Light", 'POINT', 100.0, (0, 0, 7))
    choose('AO', 'LIGHTING')
    scene = bpy.context.scene
    world = scene.world
    bake_channels(bpy.context)
    assert scene.world == world and len(scene.raybundle.light_sets) == 0
    assert "White" not in bpy.data.worlds
    assert channels(plane)[:, 0] == pytest.approx(1.0, abs=1e-3)
    assert channels(closed_box)[:, 0] == pytest.approx(0.0, abs=1e-6)
    assert channels(closed_box)[:, 1].min() > 0.5
    # Empty channels.
    assert (channels(plane)[:, 2] == 0.0).all() and (channels(plane)[:, 3] == 1.0).all()


def test_ambient_occlusion_beside_a_high_wall(new_object):
    """A point beside a wall without an end sees half of the sky."""
    new_object("Floor", [(0, -1e-3, 0), (1e-3, -1e-3, 0), (1e-3, 1e-3, 0), (0, 1e-3, 0)],
               [(0, 1, 2, 3)])
    new_object("Wall", [(-1e-3, -50, -50), (-1e-3, 50, -50), (-1e-3, 50, 50), (-1e-3, -50, 50)],
               [(0, 1, 2, 3)]).raybundle.role = 'OCCLUDE'
    choose('AO')
    bake_channels(bpy.context)
    assert channels(bpy.data.objects["Floor"])[:, 0] == pytest.approx(0.5, abs=0.02)


def test_a_further_bake_gives_the_same_light(corner):
    first = raybundle.bake(bpy.context)
    before = [read_colors(item) for item in corner]
    choose('DIRECT', 'AO')
    bake_channels(bpy.context)
    assert "Radiosity" in LastSurfaces(bpy.context.scene).attributes
    second = raybundle.bake(bpy.context)
    assert second.energy['emitted'] == pytest.approx(first.energy['emitted'], rel=SAME)
    for item, light in zip(corner, before):
        assert np.abs(read_colors(item) - light).max() <= SAME * light.max()


def test_attributes_of_light_sets_are_kept(corner):
    light_set = bpy.context.scene.raybundle.light_sets.add()
    light_set.name, light_set.attribute, light_set.world = "Sky", "Night", True
    raybundle.bake(bpy.context)
    names = [entry.name for entry in corner[0].data.color_attributes]
    choose('SET_1', 'DIRECT')
    bake_channels(bpy.context)
    assert light_set.attribute == "Night"
    assert sorted(entry.name for entry in corner[0].data.color_attributes) == sorted(names)


def test_settings_are_restored_after_a_failure(corner):
    scene = bpy.context.scene
    light_set = scene.raybundle.light_sets.add()
    light_set.name, light_set.world = "Sky", True
    choose('AO')
    world = scene.world

    def cancel(stage, _fraction):
        return stage != 'bundles'

    with pytest.raises(raybundle.RaybundleError):
        bake_channels(bpy.context, cancel)
    assert scene.world == world and [item.name for item in scene.raybundle.light_sets] == ["Sky"]
    assert scene.raybundle.light_sets[0].enabled


def test_errors_say_what_to_do(new_object):
    new_object("Cube", CUBE_VERTICES, CUBE_FACES)
    for parts, reason in (((), "All channels are empty"), (('SET_2',), "light set number 2")):
        choose(*parts)
        assert not bpy.ops.raybundle.bake_channels.poll()
        with pytest.raises(raybundle.BakeError, match=reason):
            bake_channels(bpy.context)
