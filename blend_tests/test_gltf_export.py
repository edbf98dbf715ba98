# SPDX-License-Identifier: GPL-3.0-or-later
"""Export glTF writes the attribute itself, position by position, and leaves the scene as it was.

Files are read here by the specification alone: Khronos, "glTF 2.0 Specification".
"""

import json
import struct

import bpy
import numpy as np
import pytest
import raybundle
from conftest import CUBE_FACES, CUBE_VERTICES, create_material
from raybundle import gltf_export, light_in_material
from raybundle.gltf_export import ExportError, ExportSettings
from test_light_in_material import clear, state

if not gltf_export.exporter_options():
    pytest.skip("Blender's glTF exporter is not enabled", allow_module_level=True)

COMPONENTS = {5120: 'i1', 5121: 'u1', 5122: '<i2', 5123: '<u2', 5125: '<u4', 5126: '<f4'}
WIDTHS = {'SCALAR': 1, 'VEC2': 2, 'VEC3': 3, 'VEC4': 4}
# Half of the distance of two values of a format, from 0 to 1. Floats are rounded once more where
# they are divided by the scale and multiplied by it again.
HALF_QUANTUM = {'SHORT': 0.5 / 65535, 'BYTE': 0.5 / 255, 'FLOAT': 1e-7}


def read_glb(path):
    """Returns the document of a .glb file and a function that returns the values of an accessor,
    decoded: normalised integers are divided by the largest one."""
    data = path.read_bytes()
    magic, version, length, size, kind = struct.unpack_from('<4sIII4s', data)
    assert (magic, version, length, kind) == (b'glTF', 2, len(data), b'JSON')
    document = json.loads(data[20:20 + size])
    size_of_buffer, kind = struct.unpack_from('<I4s', data, 20 + size)
    assert kind == b'BIN\0' and 28 + size + size_of_buffer == len(data)
    buffer = data[28 + size:]

    def values(index):
        accessor = document['accessors'][index]
        view = document['bufferViews'][accessor['bufferView']]
        dtype, width = np.dtype(COMPONENTS[accessor['componentType']]), WIDTHS[accessor['type']]
        assert 'byteStride' not in view or view['byteStride'] == dtype.itemsize * width
        assert view['byteOffset'] % 4 == 0 and dtype.itemsize * width * accessor['count'] <= \
            view['byteLength']
        found = np.frombuffer(buffer, dtype, accessor['count'] * width,
                              view['byteOffset'] + accessor.get('byteOffset', 0))
        found = found.reshape(-1, width).astype(float)
        return found / np.iinfo(dtype).max if accessor.get('normalized') else found

    return document, values


def exported(document, values, item, semantic='COLOR_0'):
    """Returns position, normal and colour at all corners of all triangles of an object's mesh in
    a file, in Blender's axes. Colours are None without the attribute."""
    node = next(node for node in document['nodes'] if node['name'] == item.name)
    parts = []
    for primitive in document['meshes'][node['mesh']]['primitives']:
        corners = values(primitive['indices'])[:, 0].astype(int)
        attributes = primitive['attributes']
        vectors = [values(attributes[name])[corners][:, [0, 2, 1]] * [1.0, -1.0, 1.0]
                   for name in ('POSITION', 'NORMAL')]
        parts.append((*vectors, values(attributes[semantic])[corners]
                      if semantic in attributes else None))
    return [None if any(part is None for part in column) else np.concatenate(column)
            for column in zip(*parts)]


def corner_light(item, name="Radiosity"):
    """Returns position, normal and colour at the corners of the evaluated mesh, without
    Blender's exporter."""
    mesh = item.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    if bpy.app.version < (4, 1, 0):
        mesh.calc_normals_split()
    vertices = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get('vertex_index', vertices)
    positions = np.array([vertex.co for vertex in mesh.vertices])[vertices]
    normals = np.array([loop.normal for loop in mesh.loops])
    attribute = mesh.color_attributes[name]
    colors = np.empty(4 * len(attribute.data), np.float32)
    attribute.data.foreach_get('color', colors)
    colors = colors.reshape(-1, 4)
    return positions, normals, colors if attribute.domain == 'CORNER' else colors[vertices]


def worst_difference(item, document, values, scale, semantic='COLOR_0'):
    """Returns the largest difference between COLOR_0 and the attribute / scale, over all corners
    of the mesh, each of which has to be in the file. Channels that the file lacks do not count."""
    positions, normals, colors = exported(document, values, item, semantic)
    worst = 0.0
    expected_colors = np.array(corner_light(item)[2], float)
    expected_colors[:, :3] /= scale
    for position, normal, color in zip(*corner_light(item)[:2], expected_colors):
        same = (np.abs(positions - position).max(axis=1) < 1e-5) \
            & (np.abs(normals - normal).max(axis=1) < 1e-3)
        assert same.any(), (position, normal)
        found = np.abs(colors[same] - color[:colors.shape[1]]).max(axis=1)
        # Faces of one plane meet in corners of equal position and normal: one of them is it.
        worst = max(worst, found.min())
    return worst


def paint(item, low=0.01, high=1.0, domain='CORNER', data_type='FLOAT_COLOR', name="Radiosity",
          seed=0, alpha=1.0):
    """Writes a random colour to each corner or vertex, the brightest of which is `high`."""
    attribute = item.data.color_attributes.new(name, data_type, domain)
    colors = np.random.default_rng(seed).uniform(low, high, (len(attribute.data), 4))
    colors[-1, 1] = high
    colors[:, 3] = alpha
    attribute.data.foreach_set('color', colors.astype(np.float32).ravel())
    index = item.data.color_attributes.find(name)
    item.data.color_attributes.active_color_index = index
    item.data.color_attributes.render_color_index = index
    return item


@pytest.fixture
def cube(new_object):
    """Returns a cube with two materials and a light of its own at each of its 24 corners."""
    item = new_object("Cube", CUBE_VERTICES, CUBE_FACES, create_material("Grey", (0.5, 0.4, 0.3)))
    item.data.materials.append(principled("Image"))
    item.data.polygons.foreach_set('material_index', [0, 1, 0, 1, 0, 1])
    return paint(item)


def principled(name, color=(0.2, 0.4, 0.6), emission=0.0):
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    shader = next(node for node in material.node_tree.nodes if node.type == 'BSDF_PRINCIPLED')
    shader.inputs['Base Color'].default_value = (*color, 1.0)
    if emission:
        key = next(key for key in ('Emission Color', 'Emission') if key in shader.inputs)
        shader.inputs[key].default_value = (1.0, 1.0, 1.0, 1.0)
        shader.inputs['Emission Strength'].default_value = emission
    return material


def export(path, **options):
    """Exports and returns the document, the reader of accessors and the report."""
    report = gltf_export.export(bpy.context, path, ExportSettings("Radiosity", **options))
    return (*read_glb(path), report)


def material_of(document, primitive):
    return document['materials'][primitive['material']]


# --------------------------------------------------------------------------------------------------
# Light
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("range_", ['AUTO', 'FULL'])
@pytest.mark.parametrize("high", [0.2, 7.5])
@pytest.mark.parametrize("kind", ['SHORT', 'BYTE', 'FLOAT'])
@pytest.mark.parametrize("domain", ['CORNER', 'POINT'])
def test_light_arrives_at_its_corner(new_object, tmp_path, domain, kind, high, range_):
    item = paint(new_object("Cube", CUBE_VERTICES, CUBE_FACES), high=high, domain=domain)
    document, values, report = export(tmp_path / "cube.glb", format=kind, range=range_)
    assert report.scale == pytest.approx(high if high > 1.0 or range_ == 'FULL' else 1.0)
    assert not report.warnings
    assert worst_difference(item, document, values, report.scale) <= HALF_QUANTUM[kind] * 1.001
    color = exported(document, values, item)[2]
    assert color.max() <= 1.0 and (color[:, 3] == 1.0).all()
    if report.scale != 1.0:
        assert color[:, :3].max() == pytest.approx(1.0)


@pytest.mark.parametrize("data_type", ['FLOAT_COLOR', 'BYTE_COLOR'])
def test_two_materials_and_bytes(cube, tmp_path, data_type):
    cube.data.color_attributes.remove(cube.data.color_attributes["Radiosity"])
    paint(cube, data_type=data_type)
    document, values, report = export(tmp_path / "cube.glb")
    assert len(document['meshes'][0]['primitives']) == 2
    assert worst_difference(cube, document, values, 1.0) <= HALF_QUANTUM['SHORT'] * 1.001


def test_light_that_is_cut_off_is_said(cube, tmp_path):
    paint(cube, high=3.0, name="Bright")
    report = gltf_export.export(bpy.context, tmp_path / "cube.glb",
                                ExportSettings("Bright", range='KEEP'))
    assert report.scale == 1.0 and report.cut > 0
    assert any("brighter than 1 and was cut off" in text for text in report.warnings)


def test_extras_undo_the_scale(cube, tmp_path):
    cube.data.color_attributes.remove(cube.data.color_attributes["Radiosity"])
    paint(cube, high=6.0)
    document, values, report = export(tmp_path / "cube.glb")
    extras = document['meshes'][0]['extras']['raybundle']
    assert extras == document['asset']['extras']['raybundle']
    assert extras == {'attribute': "Radiosity", 'scale': report.scale,
                      'exposure': pytest.approx(-np.log2(report.scale))}
    assert report.summary().startswith("Light of 1 mesh exported, divided by 6")
    # Every value of the file is a value of the attribute to half a quantum of 16 bits.
    light = np.unique(corner_light(cube)[2][:, :3])
    for value in exported(document, values, cube)[2][:, :3].ravel() * extras['scale']:
        # Values of 6 in single precision are 5e-7 apart.
        assert np.abs(light - value).min() <= HALF_QUANTUM['SHORT'] * 6.0 + 1e-6


@pytest.mark.skipif(bpy.app.version < (4, 0, 0),
                    reason="the importer of 3.4 does not run with NumPy 1.24")
@pytest.mark.parametrize("kind", ['SHORT', 'BYTE', 'FLOAT'])
def test_blender_reads_the_file(cube, tmp_path, kind):
    """Blender's importer is another reader of the file: it finds the light and unlit materials."""
    export(tmp_path / "cube.glb", format=kind)
    expected = [corner_light(cube)[0], corner_light(cube)[2]]
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(tmp_path / "cube.glb"))
    mesh = bpy.data.objects["Cube"].data
    [attribute] = mesh.color_attributes
    positions, _, colors = corner_light(bpy.data.objects["Cube"], attribute.name)
    # The importer stores 8 bits as sRGB, of which half a step is 0.0046 at most.
    assert attribute.data_type == 'BYTE_COLOR'
    tolerance = 1.001 * HALF_QUANTUM[kind] + 0.0046
    for position, color in zip(*expected):
        same = np.abs(positions - position).max(axis=1) < 1e-5
        assert np.abs(colors[same] - color).max(axis=1).min() <= tolerance
    for material in mesh.materials:
        assert any(node.type == 'LIGHT_PATH' for node in material.node_tree.nodes)


def test_alpha_is_kept(cube, tmp_path):
    cube.data.color_attributes.remove(cube.data.color_attributes["Radiosity"])
    paint(cube, alpha=0.25)
    document, values, _ = export(tmp_path / "cube.glb")
    assert exported(document, values, cube)[2][:, 3] == pytest.approx(0.25, abs=1e-5)


def test_alpha_above_one_is_said(cube, tmp_path):
    paint(cube, alpha=1.5, name="Packed")
    for kind, is_cut in (('SHORT', True), ('FLOAT', False)):
        report = gltf_export.export(bpy.context, tmp_path / "cube.glb",
                                    ExportSettings("Packed", format=kind))
        assert any("the alpha of 24 vertices" in text for text in report.warnings) == is_cut


def test_modifiers_are_applied(cube, tmp_path):
    cube.modifiers.new("Bevel", 'BEVEL').segments = 2
    document, values, report = export(tmp_path / "cube.glb")
    assert worst_difference(cube, document, values, 1.0) <= HALF_QUANTUM['SHORT'] * 1.001
    assert len(exported(document, values, cube)[0]) > 36


def test_a_modifier_that_removes_the_light_is_said(cube, tmp_path):
    modifier = cube.modifiers.new("Nodes", 'NODES')
    group = bpy.data.node_groups.new("Box", 'GeometryNodeTree')
    if bpy.app.version < (4, 0, 0):
        group.outputs.new('NodeSocketGeometry', "Geometry")
    else:
        group.interface.new_socket("Geometry", in_out='OUTPUT', socket_type='NodeSocketGeometry')
    box = group.nodes.new('GeometryNodeMeshCube')
    group.links.new(box.outputs['Mesh'], group.nodes.new('NodeGroupOutput').inputs[0])
    modifier.node_group = group
    _, _, report = export(tmp_path / "cube.glb")
    assert any('"Cube" is exported without light' in text for text in report.warnings)


def test_other_attributes_are_not_exported(cube, tmp_path):
    paint(cube, name="Paint", seed=1)
    cube.data.attributes.new("_OWN", 'FLOAT', 'POINT')
    document, values, _ = export(tmp_path / "cube.glb")
    for primitive in document['meshes'][0]['primitives']:
        assert set(primitive['attributes']) == {'POSITION', 'NORMAL', 'COLOR_0'}
    # No accessor and no byte is left of what was removed.
    used = {index for primitive in document['meshes'][0]['primitives']
            for index in (*primitive['attributes'].values(), primitive['indices'])}
    assert used == set(range(len(document['accessors'])))
    lengths = [view['byteLength'] for view in document['bufferViews']]
    assert document['buffers'][0]['byteLength'] - sum(lengths) < 4 * len(lengths)


def test_objects_that_share_a_mesh_and_objects_without_light(cube, new_object, tmp_path):
    twin = bpy.data.objects.new("Twin", cube.data)
    bpy.context.scene.collection.objects.link(twin)
    bare = new_object("Bare", CUBE_VERTICES, CUBE_FACES, cube.data.materials[0])
    document, values, report = export(tmp_path / "cube.glb")
    assert report.meshes == 1
    assert worst_difference(twin, document, values, 1.0) <= HALF_QUANTUM['SHORT'] * 1.001
    assert exported(document, values, bare)[2] is None
    # Both use one material in Blender. Only that of the object with light is unlit.
    node = next(node for node in document['nodes'] if node['name'] == "Bare")
    assert 'extensions' not in material_of(
        document, document['meshes'][node['mesh']]['primitives'][0])
    node = next(node for node in document['nodes'] if node['name'] == "Twin")
    for primitive in document['meshes'][node['mesh']]['primitives']:
        assert 'KHR_materials_unlit' in material_of(document, primitive)['extensions']


def test_every_accessor_is_aligned(new_object, tmp_path):
    """A triangle has 6 bytes of indices, after which 2 bytes are filled up."""
    triangle = [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]
    items = [paint(new_object(name, *triangle)) for name in ("One", "Two")]
    document, values, _ = export(tmp_path / "triangles.glb")
    for item in items:
        assert worst_difference(item, document, values, 1.0) <= HALF_QUANTUM['SHORT'] * 1.001


def test_a_subdivided_copy_is_exported_without_its_hidden_original(cube, tmp_path):
    cube.data.color_attributes.remove(cube.data.color_attributes["Radiosity"])
    raybundle.bake(bpy.context, topology='SUBDIVIDE', max_patches=500, max_bundles=16)
    document, values, _ = export(tmp_path / "cube.glb")
    assert [node['name'] for node in document['nodes']] == ["Cube (Radiosity)"]


# --------------------------------------------------------------------------------------------------
# Materials
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("way", [None, 'EMISSION', 'COLORED', 'FACTOR'])
def test_unlit_materials_keep_the_colour_of_the_surface(new_object, tmp_path, way):
    item = paint(new_object("Cube", CUBE_VERTICES, CUBE_FACES, principled("Blue")))
    if way:
        light_in_material.use(bpy.context.scene, "Radiosity", way)
    document, values, _ = export(tmp_path / "cube.glb")
    [material] = document['materials']
    assert document['extensionsUsed'] == ['KHR_materials_unlit']
    assert material['extensions'] == {'KHR_materials_unlit': {}}
    surface = material['pbrMetallicRoughness']
    assert surface['baseColorFactor'] == pytest.approx([0.2, 0.4, 0.6, 1])
    # For engines that do not know the extension, as it recommends.
    assert surface['metallicFactor'] == 0.0 and surface['roughnessFactor'] == 0.9
    assert worst_difference(item, document, values, 1.0) <= HALF_QUANTUM['SHORT'] * 1.001


def test_the_colours_of_all_shaders_arrive(new_object, tmp_path):
    """Exporters themselves only read the Principled shader."""
    flat = bpy.data.materials.new("Flat")
    flat.diffuse_color = (0.1, 0.7, 0.2, 1.0)
    expected = {"Diffuse": (0.5, 0.4, 0.3), "Principled": (0.2, 0.4, 0.6)}
    materials = [create_material("Diffuse", expected["Diffuse"]),
                 principled("Principled", expected["Principled"])]
    if bpy.app.version < (5, 0, 0):  # from then on all materials have nodes
        expected["Flat"] = (0.1, 0.7, 0.2)
        materials.append(flat)
    for material in materials:
        paint(new_object(material.name, CUBE_VERTICES, CUBE_FACES, material))
    for way in (None, 'COLORED', 'FACTOR'):
        if way:
            light_in_material.use(bpy.context.scene, "Radiosity", way)
        document, _, _ = export(tmp_path / "cube.glb")
        found = {material['name'].removesuffix(" (Radiosity)"):
                 tuple(material['pbrMetallicRoughness']['baseColorFactor'][:3])
                 for material in document['materials']}
        assert found == {name: pytest.approx(color) for name, color in expected.items()}


@pytest.mark.parametrize("way", [None, 'COLORED'])
@pytest.mark.parametrize("kind", ['PRINCIPLED', 'MIX'])
def test_transparency_is_kept(cube, tmp_path, kind, way):
    material = cube.data.materials[0]
    clear(material, kind)
    if way:
        light_in_material.use(bpy.context.scene, "Radiosity", way)
    document, _, _ = export(tmp_path / "cube.glb")
    found = next(entry for entry in document['materials'] if entry['name'] == "Grey")
    assert found['pbrMetallicRoughness']['baseColorFactor'] == pytest.approx([0.5, 0.4, 0.3, 0.25])
    assert found['extensions'] == {'KHR_materials_unlit': {}}
    assert found['alphaMode'] == 'BLEND'


def test_without_colour_the_surface_is_white(cube, tmp_path):
    document, _, _ = export(tmp_path / "cube.glb", with_color=False)
    for material in document['materials']:
        assert material['pbrMetallicRoughness']['baseColorFactor'] == [1.0, 1.0, 1.0, 1.0]


def test_objects_without_material_are_grey_as_in_blender(new_object, tmp_path):
    paint(new_object("Cube", CUBE_VERTICES, CUBE_FACES))
    document, _, _ = export(tmp_path / "cube.glb")
    [material] = document['materials']
    assert material['pbrMetallicRoughness']['baseColorFactor'] == [0.8, 0.8, 0.8, 1.0]
    assert 'KHR_materials_unlit' in material['extensions']


def test_emission_is_kept_and_said(new_object, tmp_path):
    paint(new_object("Cube", CUBE_VERTICES, CUBE_FACES, principled("Lamp", emission=1.0)))
    document, _, report = export(tmp_path / "cube.glb")
    assert any('"Lamp" emits light' in text for text in report.warnings)
    assert document['materials'][0]['emissiveFactor'] == [1.0, 1.0, 1.0]
    document, _, report = export(tmp_path / "cube.glb", with_color=False)
    assert 'emissiveFactor' not in document['materials'][0] and not report.warnings


def test_the_image_of_a_surface_is_kept_with_colour(new_object, tmp_path):
    image = bpy.data.images.new("Stripes", 4, 4)
    image.pack()
    material = principled("Image")
    tree = material.node_tree
    texture = tree.nodes.new('ShaderNodeTexImage')
    texture.image = image
    shader = next(node for node in tree.nodes if node.type == 'BSDF_PRINCIPLED')
    tree.links.new(texture.outputs['Color'], shader.inputs['Base Color'])
    item = paint(new_object("Cube", CUBE_VERTICES, CUBE_FACES, material))
    item.data.uv_layers.new()
    light_in_material.use(bpy.context.scene, "Radiosity", 'COLORED')
    document, _, _ = export(tmp_path / "cube.glb")
    assert 'baseColorTexture' in document['materials'][0]['pbrMetallicRoughness']
    assert len(document['images']) == 1
    document, _, _ = export(tmp_path / "cube.glb", with_color=False)
    assert 'baseColorTexture' not in document['materials'][0]['pbrMetallicRoughness']
    # The file does not keep an image that nothing uses.
    assert 'images' not in document and 'textures' not in document


# --------------------------------------------------------------------------------------------------
# The scene stays as it was
# --------------------------------------------------------------------------------------------------


def mesh_state(mesh):
    return ([(entry.name, entry.data_type, entry.domain) for entry in mesh.attributes],
            mesh.attributes.active_index, mesh.color_attributes.active_color_index,
            mesh.color_attributes.render_color_index)


def scene_state():
    return (state(), {mesh.name: mesh_state(mesh) for mesh in bpy.data.meshes},
            {item.name: item.select_get() for item in bpy.context.view_layer.objects})


@pytest.mark.parametrize("way", [None, 'EMISSION', 'COLORED', 'FACTOR'])
def test_the_scene_stays_as_it_was(cube, new_object, tmp_path, way):
    paint(cube, name="Paint", seed=1)
    cube.data.color_attributes.render_color_index = 0
    paint(new_object("Empty", CUBE_VERTICES, CUBE_FACES))
    if way:
        light_in_material.use(bpy.context.scene, "Radiosity", way)
    before = scene_state()
    export(tmp_path / "cube.glb")
    assert scene_state() == before


def test_after_a_failure_scene_and_file_stay_as_they_were(cube, tmp_path, monkeypatch):
    light_in_material.use(bpy.context.scene, "Radiosity", 'COLORED')
    path = tmp_path / "cube.glb"
    path.write_bytes(b"earlier")
    before = scene_state()
    with pytest.raises(ExportError, match="could not be written"):
        export(tmp_path / "no folder" / "cube.glb")
    monkeypatch.setattr(gltf_export, '_run_exporter', fail)
    with pytest.raises(KeyError):
        export(path)
    assert scene_state() == before
    assert path.read_bytes() == b"earlier"


def fail(*_arguments):
    raise KeyError


def test_errors_say_what_to_do(new_object, tmp_path, monkeypatch):
    new_object("Cube", CUBE_VERTICES, CUBE_FACES)
    with pytest.raises(ExportError, match="bake first"):
        export(tmp_path / "cube.glb")
    monkeypatch.setattr(gltf_export, 'exporter_options', set)
    with pytest.raises(ExportError, match="enable the add-on"):
        export(tmp_path / "cube.glb")


# --------------------------------------------------------------------------------------------------
# The operator
# --------------------------------------------------------------------------------------------------


def test_the_operator_takes_the_settings_of_the_scene(cube, tmp_path):
    settings = bpy.context.scene.raybundle
    settings.export_format, settings.export_range = 'BYTE', 'FULL'
    settings.output = 'COMBINED'
    path = tmp_path / "cube"
    assert bpy.ops.raybundle.export_gltf(filepath=str(path)) == {'FINISHED'}
    document, _ = read_glb(tmp_path / "cube.glb")
    primitive = document['meshes'][0]['primitives'][0]
    accessor = document['accessors'][primitive['attributes']['COLOR_0']]
    assert accessor['componentType'] == 5121 and accessor['normalized']
    assert document['materials'][0]['pbrMetallicRoughness']['baseColorFactor'] == [1, 1, 1, 1]
    assert bpy.ops.raybundle.export_gltf(filepath=str(path), format='SHORT',
                                         surface_color='WITH') == {'FINISHED'}
    document, _ = read_glb(tmp_path / "cube.glb")
    assert document['materials'][0]['pbrMetallicRoughness'].get('baseColorFactor') != [1, 1, 1, 1]


def test_a_name_with_a_dot_keeps_it(cube, tmp_path):
    bpy.ops.raybundle.export_gltf(filepath=str(tmp_path / "room.v2"))
    assert [path.name for path in tmp_path.iterdir()] == ["room.v2.glb"]


def test_the_operator_reports_errors(tmp_path):
    with pytest.raises(RuntimeError, match="bake first"):
        bpy.ops.raybundle.export_gltf(filepath=str(tmp_path / "empty.glb"))
