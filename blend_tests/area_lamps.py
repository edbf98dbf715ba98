# SPDX-License-Identifier: GPL-3.0-or-later
"""Area lights in place of emissive faces, for references by Cycles.

Cycles 3.4 samples large emissive meshes with an error that more samples do not reduce: beside the
lamps of `big_room` its light is 3 to 9 % below the integral (docs/validation.md). It samples area
lights by their solid angle, without this error.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np
from mathutils import Matrix, Vector
from raybundle.light_export import area_light_radiance

GAP = 1e-3  # distance of a light from the face that it replaces, m


@contextmanager
def area_lamps() -> Iterator[None]:
    """Replaces emissive faces by area lights within a `with` statement.

    This holds for faces whose material has exactly one Emission node, with constant inputs. A
    rectangle is replaced by a rectangular light of equal size. Any other face, which should be
    nearly a regular polygon, is replaced by a disk of equal area. Each face gets a light on its
    front. It also gets one on its back, unless its mesh is closed or its material mixes the
    Emission node with another shader for the other side.
    """
    nodes = {material: node for material in bpy.data.materials
             if (node := _emission_node(material)) is not None}
    lights = [_place_light(item, face, nodes[material], side)
              for item in bpy.context.view_layer.objects if item.type == 'MESH'
              for is_closed in (_is_closed(item.data),)
              for face in item.data.polygons
              if (material := _material(item, face)) in nodes
              for side in ((1.0,) if is_closed or _is_mixed(nodes[material]) else (1.0, -1.0))]
    strengths = {node: node.inputs['Strength'].default_value for node in nodes.values()}
    for node in strengths:
        node.inputs['Strength'].default_value = 0.0
    bpy.context.view_layer.update()
    try:
        yield
    finally:
        for node, strength in strengths.items():
            node.inputs['Strength'].default_value = strength
        for light in lights:
            bpy.data.lights.remove(light.data)
        bpy.context.view_layer.update()


def _emission_node(material: bpy.types.Material) -> bpy.types.Node | None:
    if not material.use_nodes:
        return None
    nodes = [node for node in material.node_tree.nodes if node.type == 'EMISSION']
    return nodes[0] if len(nodes) == 1 else None


def _material(item: bpy.types.Object, face: bpy.types.MeshPolygon) -> bpy.types.Material | None:
    return item.material_slots[face.material_index].material if item.material_slots else None


def _is_closed(mesh: bpy.types.Mesh) -> bool:
    edges = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get('edge_index', edges)
    return bool(np.all(np.bincount(edges, minlength=len(mesh.edges)) == 2))


def _is_mixed(emission: bpy.types.Node) -> bool:
    return any(link.to_node.type == 'MIX_SHADER' for link in emission.outputs[0].links)


def _place_light(item: bpy.types.Object, face: bpy.types.MeshPolygon, node: bpy.types.Node,
                 side: float) -> bpy.types.Object:
    """Adds the light that replaces one side of a face. side: 1 for the front, -1 for the back."""
    corners = [item.matrix_world @ item.data.vertices[index].co for index in face.vertices]
    first, second = corners[1] - corners[0], corners[-1] - corners[0]
    normal = side * first.cross(second).normalized()
    area = sum((a - corners[0]).cross(b - corners[0]).length / 2
               for a, b in zip(corners[1:], corners[2:]))
    data = bpy.data.lights.new("lamp", 'AREA')
    if len(corners) == 4 and abs(first.dot(second)) < 1e-4 * area:
        data.shape, data.size, data.size_y = 'RECTANGLE', first.length, second.length
    else:
        data.shape, data.size = 'DISK', 2.0 * (area / np.pi) ** 0.5
    data.color = node.inputs['Color'].default_value[:3]
    data.energy = (node.inputs['Strength'].default_value
                   / float(area_light_radiance(np.ones(3), area)[0]))
    light = bpy.data.objects.new("lamp", data)
    # An area light emits along its -Z axis.
    right = first.normalized()
    turn = Matrix((right, (-normal).cross(right), -normal)).transposed()
    light.matrix_world = (Matrix.Translation(sum(corners, Vector()) / len(corners) + GAP * normal)
                          @ turn.to_4x4())
    bpy.context.scene.collection.objects.link(light)
    return light
