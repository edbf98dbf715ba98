# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets for engines: the light of a bake arrives in the file, position by position, with the
default options of Blender's exporter and with Export glTF. The check of exports tells the truth."""

import bpy
import numpy as np
import pytest
from conftest import CUBE_FACES, CUBE_VERTICES
from raybundle import engine_presets, export_check, gltf_export, light_in_material
from raybundle.engine_presets import PRESETS
from test_gltf_export import (HALF_QUANTUM, corner_light, exported, paint, principled, read_glb,
                              worst_difference)

BY_MATERIAL = 'export_vertex_color' in gltf_export.exporter_options()
ENGINES = [name for name in PRESETS if name != 'BLENDER']
# Blender's exporter writes floats, which are equal to those of the attribute.
EXACT = 1e-7


def default_export(path):
    bpy.ops.export_scene.gltf(filepath=str(path))
    return read_glb(path)


def findings():
    return [finding.text() for finding in export_check.check(bpy.context.scene)]


@pytest.fixture
def room(new_object, new_light):
    """Returns a cube and a floor under a lamp, whose light is below 1."""
    settings = bpy.context.scene.raybundle
    settings.max_patches, settings.max_bundles = 500, 16
    cube = new_object("Cube", CUBE_VERTICES, CUBE_FACES, principled("Blue"), (0.0, 0.0, 1.5))
    floor = new_object("Floor", [(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)], [(0, 1, 2, 3)])
    new_light("Lamp", 'AREA', 50.0, (0.5, 1.0, 6.0), size=1.0)
    return [cube, floor]


@pytest.mark.parametrize("engine", PRESETS)
def test_a_preset_sets_what_its_tooltip_says(engine):
    settings = bpy.context.scene.raybundle
    settings.output, settings.domain, settings.data_type = 'DIRECT', 'POINT', 'BYTE_COLOR'
    settings.exposure, settings.clamp = 1.0, True
    settings.engine = engine
    for name, value in PRESETS[engine].items():
        assert getattr(settings, name) == value
    definition = settings.bl_rna.properties['engine'].enum_items[engine]
    assert "Lighting" in definition.description and "because" in definition.description
    per_vertex = engine != 'BLENDER' and bpy.app.version < (3, 5, 0)
    assert settings.domain == ('POINT' if per_vertex else 'CORNER')
    if engine != 'BLENDER':
        bits = "8 bits" if settings.export_format == 'BYTE' else "16 bits"
        assert bits in definition.description
        assert ("per vertex" if per_vertex else "per face corner") in definition.description


@pytest.mark.needs_library
@pytest.mark.parametrize("engine", ENGINES)
def test_the_default_options_of_the_exporter_keep_the_light(room, tmp_path, engine):
    bpy.context.scene.raybundle.engine = engine
    bpy.ops.raybundle.bake()
    bpy.ops.raybundle.use_in_material()
    assert findings() == []
    document, values = default_export(tmp_path / "room.glb")
    for item in room:
        assert 0.05 < corner_light(item)[2][:, :3].max() < 1.0
        assert worst_difference(item, document, values, 1.0) <= EXACT
    for material in document['materials']:
        assert 'KHR_materials_unlit' in material['extensions']
    assert {tuple(np.round(material['pbrMetallicRoughness']['baseColorFactor'], 3))
            for material in document['materials']} == {(0.2, 0.4, 0.6, 1), (0.8, 0.8, 0.8, 1)}


@pytest.mark.needs_library
@pytest.mark.parametrize("engine", PRESETS)
def test_export_gltf_keeps_the_light(room, tmp_path, engine):
    settings = bpy.context.scene.raybundle
    settings.engine = engine
    bpy.data.lights["Lamp"].energy = 5000.0
    bpy.ops.raybundle.bake()
    path = tmp_path / "room.glb"
    assert bpy.ops.raybundle.export_gltf(filepath=str(path)) == {'FINISHED'}
    document, values = read_glb(path)
    scale = document['asset']['extras']['raybundle']['scale']
    assert scale == max(corner_light(item)[2][:, :3].max() for item in room) > 1.0
    for item in room:
        assert worst_difference(item, document, values, scale) <= \
            HALF_QUANTUM[settings.export_format] * 1.001


# --------------------------------------------------------------------------------------------------
# What the check says is what the exporter does
# --------------------------------------------------------------------------------------------------


@pytest.fixture
def cube(new_object):
    return new_object("Cube", CUBE_VERTICES, CUBE_FACES, principled("Blue"))


def show(way='EMISSION'):
    light_in_material.use(bpy.context.scene, "Radiosity", way)


def test_face_corners(cube, tmp_path):
    paint(cube)
    show()
    document, values = default_export(tmp_path / "cube.glb")
    difference = worst_difference(cube, document, values, 1.0)
    if engine_presets.EXPORTS_CORNERS:
        assert findings() == [] and difference <= EXACT
    else:
        assert difference > 0.1
        [line] = findings()
        assert '"Cube": the exporter of this Blender mixes up' in line and "Vertex" in line


def test_a_material_that_does_not_use_the_light(cube, tmp_path):
    paint(cube, domain='POINT')
    document, values = default_export(tmp_path / "cube.glb")
    difference = worst_difference(cube, document, values, 1.0)
    lines = [text for text in findings() if "COLOR_1" in text]
    if BY_MATERIAL:
        assert exported(document, values, cube)[2].min() == 1.0 and difference > 0.5
        assert len(lines) == 1 and '"Blue"' in lines[0]
        assert worst_difference(cube, document, values, 1.0, 'COLOR_1') <= HALF_QUANTUM['SHORT']
    else:
        assert not lines and difference <= EXACT


@pytest.mark.parametrize("way, unlit", [(None, False), ('FACTOR', False), ('EMISSION', True),
                                        ('COLORED', True)])
def test_lit_materials(cube, tmp_path, way, unlit):
    paint(cube, domain='POINT')
    if way:
        show(way)
    document, _ = default_export(tmp_path / "cube.glb")
    assert ('KHR_materials_unlit' in document['materials'][0].get('extensions', {})) == unlit
    assert any("is not unlit" in text for text in findings()) != unlit


def test_emission(new_object, tmp_path):
    paint(new_object("Lamp", CUBE_VERTICES, CUBE_FACES, principled("Lamp", emission=1.0)),
          domain='POINT')
    show('COLORED')
    document, _ = default_export(tmp_path / "lamp.glb")
    assert document['materials'][0]['emissiveFactor'] == [1.0, 1.0, 1.0]
    assert findings() == ['"Lamp": the material emits light and is exported without the baked '
                          'light: bake the output Combined to export both']
    bpy.context.scene.raybundle.output = 'COMBINED'
    show('EMISSION')
    document, _ = default_export(tmp_path / "lamp.glb")
    assert 'KHR_materials_unlit' in document['materials'][0]['extensions']
    assert findings() == []


def test_the_colour_of_the_surface_and_combined(cube, tmp_path):
    paint(cube, domain='POINT')
    bpy.context.scene.raybundle.output = 'COMBINED'
    document, _ = default_export(tmp_path / "cube.glb")
    assert document['materials'][0]['pbrMetallicRoughness']['baseColorFactor'][:3] != [1, 1, 1]
    assert any("Combined has already" in text for text in findings())
    show()
    document, _ = default_export(tmp_path / "cube.glb")
    assert 'baseColorFactor' not in document['materials'][0]['pbrMetallicRoughness']
    assert findings() == []


@pytest.mark.parametrize("has_material", [True, False])
def test_light_above_one(cube, tmp_path, has_material):
    paint(cube, low=0.9, high=3.0, domain='POINT')
    if has_material:
        show()
    else:
        cube.data.materials.clear()
    document, values = default_export(tmp_path / "cube.glb")
    assert any("outside of glTF's range" in text for text in findings())
    is_whole = worst_difference(cube, document, values, 1.0) <= EXACT
    lines = [text for text in findings() if "without a material, light above 1" in text]
    assert is_whole != bool(lines)
    if lines:
        low = exported(document, values, cube)[2][:, :3].min()
        # Light of 0.9 and more, of which only that which starts again can be below.
        assert ("starts again at 0" in lines[0]) == (low < 0.8)


def test_another_attribute_for_rendering(cube, tmp_path):
    paint(cube, domain='POINT')
    paint(cube, domain='POINT', name="Paint", seed=1)
    document, values = default_export(tmp_path / "cube.glb")
    is_whole = worst_difference(cube, document, values, 1.0) <= EXACT
    assert not is_whole
    assert any("another colour attribute is the render" in text for text in findings()) \
        != BY_MATERIAL
    if BY_MATERIAL:
        show()
        document, values = default_export(tmp_path / "cube.glb")
        is_whole = worst_difference(cube, document, values, 1.0) <= EXACT
        assert is_whole == (findings() == [])
        assert is_whole or ['"Cube": the exporter of this Blender writes white' in text
                            for text in findings()] == [True]


@pytest.mark.parametrize("used", [1, 2])
def test_several_materials(cube, tmp_path, used):
    """The second material is used by the last face, or by none."""
    paint(cube, domain='POINT')
    cube.data.materials.append(principled("Red"))
    cube.data.polygons[-1].material_index = used - 1
    show()
    document, values = default_export(tmp_path / "cube.glb")
    lights = [values(primitive['attributes']['COLOR_0'])[:, :3]
              for primitive in document['meshes'][0]['primitives']]
    assert len(lights) == used
    is_whole = not any((light == 1.0).all() for light in lights)
    assert is_whole == (findings() == [])
    assert is_whole or ['"Cube": the exporter of this Blender writes white' in text
                        for text in findings()] == [True]


def test_alpha(cube, tmp_path):
    paint(cube, domain='POINT', alpha=0.5)
    show()
    document, values = default_export(tmp_path / "cube.glb")
    has_alpha = exported(document, values, cube)[2].shape[1] == 4
    assert has_alpha != any("alpha" in text for text in findings())


def test_modifiers(cube, tmp_path):
    paint(cube, domain='POINT')
    show()
    cube.modifiers.new("Bevel", 'BEVEL')
    document, values = default_export(tmp_path / "cube.glb")
    assert len(exported(document, values, cube)[0]) == 36
    assert any('"Cube": modifiers are not applied' in text for text in findings())


@pytest.mark.needs_library
def test_originals_of_subdivided_copies_and_light_sets(room, tmp_path):
    settings = bpy.context.scene.raybundle
    settings.engine, settings.topology = 'GLTF', 'SUBDIVIDE'
    light_set = settings.light_sets.add()
    light_set.name = "Lamp"
    bpy.ops.raybundle.bake()
    bpy.ops.raybundle.use_in_material()
    document, values = default_export(tmp_path / "room.glb")
    names = {node['name'] for node in document['nodes']}
    assert {"Cube", "Cube (Radiosity)"} <= names
    assert any("the hidden original is exported too" in text for text in findings())
    primitive = next(mesh for mesh in document['meshes']
                     if mesh['name'].endswith("(Radiosity)"))['primitives'][0]
    assert ('COLOR_1' in primitive['attributes']) == BY_MATERIAL
    assert any("light sets in attributes of their own" in text for text in findings())


def test_nothing_is_baked_and_no_exporter(cube, monkeypatch):
    assert findings() == ['no object has the attribute "Radiosity": bake first']
    monkeypatch.setattr(export_check, 'exporter_options', set)
    assert "enable the add-on" in findings()[0]


def test_the_operator_keeps_what_it_found_for_the_panel(cube):
    assert bpy.ops.raybundle.check_export() == {'FINISHED'}
    settings = bpy.context.scene.raybundle
    assert "bake first" in settings.export_check
    # What the panel shows follows the buttons beside it.
    paint(cube, domain='POINT')
    bpy.ops.raybundle.use_in_material()
    assert settings.export_check == "[]"
    bpy.ops.raybundle.take_out_of_material()
    assert "not unlit" in settings.export_check
