# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing of colour attributes: name, domain, data type, colour space, alpha, and saved files."""

import bpy
import numpy as np
import pytest
from conftest import CUBE_FACES, CUBE_VERTICES
from raybundle import color_attribute

COUNTS = {'CORNER': 24, 'POINT': 8}


def light_values(count, largest=1.0):
    return np.linspace(0.0, largest, 3 * count, dtype=np.float32).reshape(count, 3)


def read_colors(mesh, name="Radiosity", kind='color'):
    attribute = mesh.color_attributes[name]
    values = np.empty(4 * len(attribute.data), np.float32)
    attribute.data.foreach_get(kind, values)
    return values.reshape(-1, 4)


@pytest.fixture
def box(new_object):
    return new_object("Box", CUBE_VERTICES, CUBE_FACES)


@pytest.mark.parametrize("domain", COUNTS)
@pytest.mark.parametrize("data_type", ['FLOAT_COLOR', 'BYTE_COLOR'])
def test_values_survive_save_and_reload(box, tmp_path, domain, data_type):
    light = light_values(COUNTS[domain])
    color_attribute.write_light(box.data, "Radiosity", data_type, domain, light)
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    mesh = bpy.data.objects["Box"].data
    attribute = mesh.color_attributes["Radiosity"]
    assert (attribute.domain, attribute.data_type) == (domain, data_type)
    colors = read_colors(mesh)
    # Rounding to 8 bits of sRGB is off by at most half a step of 1/255, times the largest slope of
    # the curve from sRGB to linear values, 2.3.
    tolerance = 0.0 if data_type == 'FLOAT_COLOR' else 0.5 / 255 * 2.3
    assert np.abs(colors[:, :3] - light).max() <= tolerance
    assert (colors[:, 3] == 1.0).all()
    index = mesh.color_attributes.find("Radiosity")
    assert mesh.color_attributes.active_color_index == index
    assert mesh.color_attributes.render_color_index == index


def test_floats_are_scene_linear_and_have_no_upper_limit(box):
    light = light_values(24, largest=100.0)
    color_attribute.write_light(box.data, "Radiosity", 'FLOAT_COLOR', 'CORNER', light)
    assert np.array_equal(read_colors(box.data)[:, :3], light)


def test_bytes_are_srgb_and_cut_off(box):
    light = np.full((24, 3), 0.5, np.float32)
    light[0] = 7.0
    color_attribute.write_light(box.data, "Radiosity", 'BYTE_COLOR', 'CORNER', light)
    if hasattr(box.data.color_attributes["Radiosity"].data[1], "color_srgb"):
        # 0.5 is 0.7354 in sRGB, stored as 188/255.
        stored = box.data.color_attributes["Radiosity"].data[1].color_srgb
        assert stored[0] == pytest.approx(188 / 255, abs=1e-3)
    colors = read_colors(box.data)
    assert colors[0, :3].tolist() == [1.0, 1.0, 1.0]
    assert colors[1, :3] == pytest.approx(np.full(3, 0.5), abs=0.5 / 255 * 2.3)


def test_alpha_of_a_fitting_attribute_is_kept(box):
    attribute = box.data.color_attributes.new("Radiosity", 'FLOAT_COLOR', 'CORNER')
    attribute.data.foreach_set('color', np.full(96, 0.25, np.float32))
    color_attribute.write_light(box.data, "Radiosity", 'FLOAT_COLOR', 'CORNER', light_values(24))
    colors = read_colors(box.data)
    assert (colors[:, 3] == 0.25).all() and np.array_equal(colors[:, :3], light_values(24))
    assert len(box.data.color_attributes) == 1


def test_another_domain_or_type_is_replaced(box):
    box.data.color_attributes.new("Paint", 'BYTE_COLOR', 'CORNER')
    for data_type, domain in (('FLOAT_COLOR', 'CORNER'), ('FLOAT_COLOR', 'POINT'),
                              ('BYTE_COLOR', 'POINT')):
        color_attribute.write_light(box.data, "Radiosity", data_type, domain,
                                    light_values(COUNTS[domain]))
        attribute = box.data.color_attributes["Radiosity"]
        assert (attribute.domain, attribute.data_type) == (domain, data_type)
    assert sorted(item.name for item in box.data.color_attributes) == ["Paint", "Radiosity"]


def test_a_wrong_number_of_values_is_refused(box):
    with pytest.raises(ValueError, match="Box"):
        color_attribute.write_light(box.data, "Radiosity", 'FLOAT_COLOR', 'CORNER',
                                    light_values(8))


def test_only_colours_are_replaced(box):
    box.data.uv_layers.new(name="UVMap")
    assert not color_attribute.name_is_free(box.data, "UVMap")
    assert not color_attribute.name_is_free(box.data, "position") or bpy.app.version < (3, 5, 0)
    assert color_attribute.name_is_free(box.data, "Radiosity")


def test_clear_removes_the_attribute_alone(box):
    box.data.color_attributes.new("Paint", 'BYTE_COLOR', 'CORNER')
    color_attribute.write_light(box.data, "Radiosity", 'FLOAT_COLOR', 'POINT', light_values(8))
    assert color_attribute.clear(box.data, "Radiosity")
    assert [item.name for item in box.data.color_attributes] == ["Paint"]
    assert not color_attribute.clear(box.data, "Radiosity")


def test_activate_names_what_is_missing(box):
    assert not color_attribute.activate(box.data, "Radiosity")
