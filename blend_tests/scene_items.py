# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects, lamps and emission of the open scene, and steps that several changes of them share.

If objects are cut up or joined, a face attribute stores the original object of each face
(`remember_origins`), so that light can be compared by original objects.
"""

from __future__ import annotations

from collections.abc import Iterator

import bmesh
import bpy
import numpy as np
from mathutils import Vector

ORIGIN = "raybundle_origin"  # face attribute: index in scene[ORIGINS]
ORIGINS = "raybundle_origins"


class NotApplicable(Exception):
    """The scene has nothing that this change could change. The text says what is missing."""


# --------------------------------------------------------------------------------------------------
# What there is
# --------------------------------------------------------------------------------------------------


def items() -> list[bpy.types.Object]:
    """Returns the objects of the view layer. Other objects can only be visible as instances."""
    return list(bpy.context.view_layer.objects)


def mesh_items() -> list[bpy.types.Object]:
    return [item for item in items() if item.type == 'MESH' and len(item.data.polygons)
            and item.visible_get() and not item.hide_render]


def lamps() -> list[bpy.types.Object]:
    return [item for item in items() if item.type == 'LIGHT' and item.visible_get()]


def emission_inputs(tree: bpy.types.NodeTree | None) -> list[bpy.types.NodeSocket]:
    """Returns the inputs for the strength of emission in the node tree of a material or a world."""
    names = {'EMISSION': "Strength", 'BACKGROUND': "Strength",
             'BSDF_PRINCIPLED': "Emission Strength"}
    nodes = tree.nodes if tree else ()
    return [node.inputs[names[node.type]] for node in nodes if node.type in names]


def shines(tree: bpy.types.NodeTree | None) -> bool:
    for socket in emission_inputs(tree):
        colour = next(entry for entry in socket.node.inputs
                      if entry.name in ("Color", "Emission", "Emission Color"))
        if socket.default_value > 0.0 and (colour.is_linked or any(colour.default_value[:3])):
            return True
    return False


def is_emissive(item: bpy.types.Object) -> bool:
    return any(slot.material and shines(slot.material.node_tree) for slot in item.material_slots)


def diagonal() -> float:
    """Returns the diagonal of the box around all meshes, m."""
    low, high = bounds()
    return float(np.linalg.norm(high - low))


def bounds() -> tuple[np.ndarray, np.ndarray]:
    corners = np.array([item.matrix_world @ Vector(corner)
                        for item in mesh_items() for corner in item.bound_box])
    return corners.min(axis=0), corners.max(axis=0)


# --------------------------------------------------------------------------------------------------
# Preparations
# --------------------------------------------------------------------------------------------------


def make_single_users() -> None:
    """Gives each mesh object a mesh of its own, and each lamp a light of its own."""
    for item in items():
        if item.type in ('MESH', 'LIGHT') and item.data.users > 1:
            item.data = item.data.copy()


def apply_modifiers() -> None:
    bpy.context.view_layer.update()
    graph = bpy.context.evaluated_depsgraph_get()
    for item in mesh_items():
        if item.modifiers:
            mesh = bpy.data.meshes.new_from_object(item.evaluated_get(graph), depsgraph=graph)
            item.modifiers.clear()
            item.data = mesh
    make_single_users()


def remember_origins() -> None:
    """Stores the original object of each face in an attribute.

    Applies modifiers and copies shared meshes first, so that each face has one origin.
    """
    apply_modifiers()
    found = mesh_items()
    bpy.context.scene[ORIGINS] = [item.name for item in found]
    for index, item in enumerate(found):
        faces = len(item.data.polygons)
        attribute = item.data.attributes.new(ORIGIN, 'INT', 'FACE')
        attribute.data.foreach_set('value', np.full(faces, index, np.int32))


def edited(item: bpy.types.Object) -> Iterator[bmesh.types.BMesh]:
    """Yields the object's bmesh once, and writes it back afterwards: `for mesh in edited(item)`."""
    mesh = bmesh.new()
    mesh.from_mesh(item.data)
    yield mesh
    mesh.to_mesh(item.data)
    mesh.free()
    item.data.update()


def select(chosen: list[bpy.types.Object]) -> None:
    for item in items():
        item.select_set(item in chosen)
    bpy.context.view_layer.objects.active = chosen[0]


def black_material() -> bpy.types.Material:
    material = bpy.data.materials.new("black")
    new_shader(material, 'ShaderNodeBsdfDiffuse').inputs['Color'].default_value = (0, 0, 0, 1)
    return material


def new_shader(material: bpy.types.Material, kind: str) -> bpy.types.Node:
    """Replaces all nodes of a material by a new shader of this kind, and returns the shader."""
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new(kind)
    tree.links.new(shader.outputs[0], tree.nodes.new('ShaderNodeOutputMaterial').inputs['Surface'])
    return shader


def add_mesh_item(name: str, vertices, faces, material: bpy.types.Material) -> bpy.types.Object:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(material)
    item = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(item)
    return item
