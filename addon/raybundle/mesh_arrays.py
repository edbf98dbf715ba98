# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the elements of a Blender mesh as numpy arrays with foreach_get."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

# Whether Blender stores the vertices of corners, material slots and sharpness as attributes.
HAS_ATTRIBUTES = bpy.app.version >= (4, 1, 0)

# Properties of mesh elements that Blender declares as unsigned.
_UNSIGNED = frozenset(('vertex_index', 'vertices', 'loop_start', 'loop_total'))


@dataclass(frozen=True)
class Topology:
    """The properties that two meshes must share for their corners to correspond one to one."""

    vertex_count: int
    corner_vertices: np.ndarray  # (c,) int32, vertex of each corner
    face_sizes: np.ndarray  # (f,) int32, number of corners of each face

    def matches(self, other: Topology) -> bool:
        return (self.vertex_count == other.vertex_count
                and np.array_equal(self.corner_vertices, other.corner_vertices)
                and np.array_equal(self.face_sizes, other.face_sizes))


def read(collection: bpy.types.bpy_prop_collection, name: str, dtype: type, width: int = 1
         ) -> np.ndarray:
    """Returns a property of all elements of a collection as an array of dtype. The shape is (n,),
    or (n, width) for vectors of width components."""
    values = np.empty(len(collection) * width, dtype)
    # Blender copies a property that is never negative at once only into unsigned integers.
    # Otherwise it converts each element by itself, which takes twelve times as long.
    unsigned = values.view(np.uint32) if dtype == np.int32 and name in _UNSIGNED else values
    collection.foreach_get(name, unsigned)
    return values.reshape(-1, width) if width > 1 else values


def read_attribute(mesh: bpy.types.Mesh, name: str, domain: str, data_type: str, dtype: type
                    ) -> np.ndarray | None:
    """Returns one of Blender's built-in attributes, (n,). Returns None if the mesh does not have
    the attribute in this domain and type, which means that all elements have the default value."""
    attribute = mesh.attributes.get(name)
    if attribute is None or (attribute.domain, attribute.data_type) != (domain, data_type):
        return None
    return read(attribute.data, 'value', dtype)


def corner_vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    """Returns the vertex of each corner, (c,) int32."""
    if HAS_ATTRIBUTES:
        vertices = read_attribute(mesh, '.corner_vert', 'CORNER', 'INT', np.int32)
        if vertices is not None:
            return vertices
    return read(mesh.loops, 'vertex_index', np.int32)


def topology(mesh: bpy.types.Mesh) -> Topology:
    """Returns the topology of an original or evaluated mesh."""
    return Topology(len(mesh.vertices), corner_vertices(mesh),
                    read(mesh.polygons, 'loop_total', np.int32))


def vertex_positions(mesh: bpy.types.Mesh) -> np.ndarray:
    """Returns the positions of the vertices in object space, (n, 3) float32."""
    return read(mesh.vertices, 'co', np.float32, 3)
