# SPDX-License-Identifier: GPL-3.0-or-later
"""Each output, compared with its counterpart in Cycles, and the ways to write it.

| output | bake of Cycles |
|---|---|
| LIGHTING | Diffuse with Direct and Indirect, without Color |
| DIRECT | Diffuse with Direct, without Color |
| INDIRECT | LIGHTING less DIRECT: Indirect alone omits the light of lamps after a reflection |
| COMBINED | Combined: emission, and diffuse light with colour |
"""

import functools

import bpy
import numpy as np
import pytest
import raybundle
from cycles_comparison import assert_same_mean, cycles_light, raybundle_light, square

pytestmark = pytest.mark.needs_library


@pytest.fixture
def room(new_object, new_material, new_light):
    """Returns coloured objects: a floor, a wall and a board that emits. Adds a lamp."""
    floor = new_object("Floor", *square(3.0, 12), new_material("Green", (0.3, 0.8, 0.4)))
    wall = new_object("Wall", *square(2.4, 8), new_material("Red", (0.8, 0.2, 0.1)),
                      (-1.6, 0.0, 1.4))
    wall.rotation_euler = (0.0, np.pi / 2, 0.0)
    board = new_object("Board", *square(1.0, 4), new_material("Glow", (0.5, 0.5, 0.5),
                                                              (0.3, 0.2, 0.6)), (0.5, 0.2, 0.7))
    new_light("Light", 'AREA', 60.0, (0.4, -0.3, 2.0), size=0.5)
    bpy.context.view_layer.update()
    return [floor, wall, board]


def counterpart(output, items):
    if output == 'COMBINED':
        return cycles_light(items, ("EMIT", "DIRECT", "INDIRECT", "DIFFUSE", "COLOR"), "COMBINED",
                            samples=128)
    if output == 'DIRECT':
        return cycles_light(items, ("DIRECT",))
    both = cycles_light(items)
    if output == 'LIGHTING':
        return both
    direct = cycles_light(items, ("DIRECT",))
    return {name: both[name] - direct[name] for name in both}


@pytest.mark.parametrize("output", ['LIGHTING', 'DIRECT', 'INDIRECT', 'COMBINED'])
def test_output(room, output):
    expected = counterpart(output, room)
    # INDIRECT is a difference of two noisy bakes, with more noise than 1 % of its own size. Its
    # tolerance is relative to all light.
    scale = counterpart('LIGHTING', room) if output == 'INDIRECT' else None
    assert_same_mean(raybundle_light(room, output), expected, scale=scale)


def test_parts_sum_up_to_the_whole(room):
    both, direct, indirect = (raybundle_light(room, output)
                              for output in ('LIGHTING', 'DIRECT', 'INDIRECT'))
    for name, light in both.items():
        assert light == pytest.approx(direct[name] + indirect[name], abs=1e-5 * float(light.max()))


# --------------------------------------------------------------------------------------------------
# Ways to write the light
# --------------------------------------------------------------------------------------------------


def read(item):
    attribute = item.data.color_attributes["Radiosity"]
    values = np.empty(4 * len(attribute.data), np.float32)
    attribute.data.foreach_get('color', values)
    return values.reshape(-1, 4)


# For bakes that differ only in the way they are written. Coarse noise suffices, because equal seeds
# give equal noise.
bake_quickly = functools.partial(raybundle.bake, target_error=0.05)


@pytest.mark.parametrize("domain", ['CORNER', 'POINT'])
def test_bytes_hold_what_floats_hold(room, domain):
    bake_quickly(bpy.context, domain=domain, exposure=-3.0)
    floats = read(room[0])
    assert len(floats) == (576 if domain == 'CORNER' else 169)
    bake_quickly(bpy.context, domain=domain, exposure=-3.0, data_type='BYTE_COLOR')
    assert 0.0 < floats[:, :3].max() < 1.0
    # Rounding to 8 bits of sRGB is off by at most half a step of 1/255, times the largest slope of
    # the curve from sRGB to linear values, 2.3.
    assert np.abs(read(room[0]) - floats).max() <= 0.5 / 255 * 2.3


def test_exposure_is_in_stops_and_clamp_comes_after_it(room):
    bake_quickly(bpy.context)
    plain = read(room[0])[:, :3]
    bake_quickly(bpy.context, exposure=1.5)
    assert read(room[0])[:, :3] == pytest.approx(plain * 2.0 ** 1.5, rel=1e-6)
    bake_quickly(bpy.context, exposure=1.5, clamp=True)
    assert plain.max() * 2.0 ** 1.5 > 1.0
    assert read(room[0])[:, :3] == pytest.approx(np.clip(plain * 2.0 ** 1.5, 0.0, 1.0), rel=1e-6)


@pytest.mark.parametrize("data_type", ['FLOAT_COLOR', 'BYTE_COLOR'])
def test_alpha_stays(room, data_type):
    mesh = room[0].data
    attribute = mesh.color_attributes.new("Radiosity", data_type, 'CORNER')
    alpha = np.round(np.linspace(0.0, 255.0, len(attribute.data))) / 255
    colors = np.column_stack([np.zeros((len(alpha), 3)), alpha]).astype(np.float32)
    attribute.data.foreach_set('color', colors.ravel())
    bake_quickly(bpy.context, data_type=data_type)
    assert read(room[0])[:, 3] == pytest.approx(alpha, abs=1e-6)
    assert read(room[0])[:, :3].max() > 0.0


def clipping(report):
    return [text for text in report.warnings if "cut off" in text]


def test_bytes_that_clip_are_named(room):
    report = bake_quickly(bpy.context)
    assert not clipping(report)
    share = (read(room[2])[:, :3] > 1.0).any(axis=1).mean()
    assert share > 0.0
    texts = clipping(bake_quickly(bpy.context, data_type='BYTE_COLOR'))
    assert any(f'"Board": {100.0 * share:.3g} %' in text for text in texts)
    assert not clipping(bake_quickly(bpy.context, data_type='BYTE_COLOR', exposure=-6.0))
    # With `clamp`, the user has asked for this, so that no warning is needed.
    assert not clipping(bake_quickly(bpy.context, data_type='BYTE_COLOR', clamp=True))


@pytest.mark.parametrize("name, value", [("exposure", 99.0), ("exposure", "bright"),
                                         ("clamp", "perhaps")])
def test_values_out_of_range_are_refused(room, name, value):
    with pytest.raises(raybundle.BakeError, match=name):
        raybundle.bake(bpy.context, **{name: value})
