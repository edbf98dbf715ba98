# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures of all tests. The add-on of the source tree is registered once per run of pytest.

Each test starts with an empty .blend file.
"""

import sys
from pathlib import Path

import bpy
import pytest

sys.path.insert(0, str(Path(__file__).parent.parent / "addon"))
sys.dont_write_bytecode = True

import raybundle  # noqa: E402

# Closed box whose exact solution is known: radiance of its emission in W/(m^2 sr), reflectance.
FURNACE_EMISSION_RADIANCE = 0.5
FURNACE_REFLECTANCE = 0.6
# LIGHTING in the furnace, W/(m^2 sr): the exitance in a closed box is B = E / (1 - rho).
FURNACE_LIGHT = FURNACE_EMISSION_RADIANCE / (1.0 - FURNACE_REFLECTANCE)


def pytest_configure() -> None:
    raybundle.register()


def pytest_unconfigure() -> None:
    raybundle.unregister()


def _native_library_exists() -> bool:
    return sys.modules["raybundle.native"].library_path().is_file()


def pytest_collection_modifyitems(items: list) -> None:
    if _native_library_exists():
        return
    missing = pytest.mark.skip(reason="the native library is not built")
    for item in items:
        if item.get_closest_marker("needs_library"):
            item.add_marker(missing)


@pytest.fixture(autouse=True)
def empty_file():
    bpy.ops.wm.read_homefile(use_empty=True)
    yield


@pytest.fixture
def user():
    """The add-on's preferences of a user who enabled it."""
    addon = bpy.context.preferences.addons.new()
    addon.module = raybundle.__name__
    yield addon.preferences
    bpy.context.preferences.addons.remove(addon)


def create_material(name: str, reflectance=(0.8, 0.8, 0.8), emission=(0.0, 0.0, 0.0)):
    """Returns a new material of a Diffuse shader and, if it emits, an Emission shader.

    reflectance: RGB, 0 to 1. emission: RGB radiance, W/(m^2 sr).
    """
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new('ShaderNodeOutputMaterial')
    diffuse = tree.nodes.new('ShaderNodeBsdfDiffuse')
    diffuse.inputs['Color'].default_value = (*reflectance, 1.0)
    shader = diffuse.outputs[0]
    if any(emission):
        emit = tree.nodes.new('ShaderNodeEmission')
        emit.inputs['Color'].default_value = (*emission, 1.0)
        emit.inputs['Strength'].default_value = 1.0
        add = tree.nodes.new('ShaderNodeAddShader')
        tree.links.new(shader, add.inputs[0])
        tree.links.new(emit.outputs[0], add.inputs[1])
        shader = add.outputs[0]
    tree.links.new(shader, output.inputs['Surface'])
    return material


@pytest.fixture
def new_material():
    return create_material


def create_object(name: str, vertices, faces, material=None, location=(0.0, 0.0, 0.0)):
    """Returns a new mesh object in the scene. faces: tuples of vertex indices."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    if material is not None:
        mesh.materials.append(material)
    item = bpy.data.objects.new(name, mesh)
    item.location = location
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.update()
    return item


@pytest.fixture
def new_object():
    return create_object


@pytest.fixture
def new_light():
    def create(name: str, kind: str, energy: float, location=(0.0, 0.0, 0.0), **values):
        light = bpy.data.lights.new(name, kind)
        light.energy = energy
        for key, value in values.items():
            setattr(light, key, value)
        item = bpy.data.objects.new(name, light)
        item.location = location
        bpy.context.scene.collection.objects.link(item)
        bpy.context.view_layer.update()
        return item

    return create


def create_world(radiance=(0.05, 0.05, 0.05)):
    """Gives the scene a new world of this radiance, W/(m^2 sr). Returns its Background node."""
    world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0, 0):
        world.use_nodes = True
    bpy.context.scene.world = world
    node = next(node for node in world.node_tree.nodes if node.type == 'BACKGROUND')
    node.inputs['Color'].default_value = (*radiance, 1.0)
    node.inputs['Strength'].default_value = 1.0
    return node


@pytest.fixture
def new_world():
    return create_world


CUBE_VERTICES = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
# Vertex indices of each face. Normals point outwards.
CUBE_FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


@pytest.fixture
def closed_box(new_object, new_material):
    """Returns a furnace: a cube of 2 m with normals inwards, and uniform emission and reflectance.

    Inside, B = E / (1 - rho). LIGHTING is therefore H / pi = L_E / (1 - rho), with E = pi L_E.
    """
    grey, radiance = FURNACE_REFLECTANCE, FURNACE_EMISSION_RADIANCE
    material = new_material("Furnace", (grey,) * 3, (radiance,) * 3)
    return new_object("Box", CUBE_VERTICES, [face[::-1] for face in CUBE_FACES], material)
