# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender meshes -> arrays, by foreach_get only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from .color_expression import Texture
from .material_export import MaterialExport
from .scene_data import MeshData


# Squares of larger coordinates overflow in single precision.
COORDINATE_LIMIT = 1e15


class MeshError(ValueError):
    """A mesh that cannot take part; the message says why, without naming it."""


@dataclass(frozen=True)
class Topology:
    """What two meshes must share for their corners to correspond one to one."""

    vertex_count: int
    corner_vertices: np.ndarray  # (c,) int32
    face_sizes: np.ndarray  # (f,) int32

    def matches(self, other: Topology) -> bool:
        return (self.vertex_count == other.vertex_count
                and np.array_equal(self.corner_vertices, other.corner_vertices)
                and np.array_equal(self.face_sizes, other.face_sizes))


def read(collection: bpy.types.bpy_prop_collection, name: str, dtype: type, width: int = 1
         ) -> np.ndarray:
    """A property of all elements: (n,) or, for vectors, (n, width)."""
    values = np.empty(len(collection) * width, dtype)
    collection.foreach_get(name, values)
    return values.reshape(-1, width) if width > 1 else values


def topology(mesh: bpy.types.Mesh) -> Topology:
    return Topology(len(mesh.vertices), read(mesh.loops, 'vertex_index', np.int32),
                    read(mesh.polygons, 'loop_total', np.int32))


def vertex_positions(mesh: bpy.types.Mesh) -> np.ndarray:
    """(n, 3) float32."""
    return read(mesh.vertices, 'co', np.float32, 3)


def export_mesh(mesh: bpy.types.Mesh, name: str, materials: Sequence[MaterialExport],
                default_material: MaterialExport, baked_uvs: np.ndarray | None = None) -> MeshData:
    """mesh: evaluated; materials: by slot; baked_uvs: (c, 2), for those that Cycles baked.

    Raises MeshError for a mesh that cannot take part.
    """
    if not len(mesh.polygons):
        raise MeshError("has no faces")
    vertices = vertex_positions(mesh)
    # This is False for NaN too.
    if not (np.abs(vertices) < COORDINATE_LIMIT).all():
        raise MeshError("has coordinates that are not finite numbers, or too large to compute with")
    starts = read(mesh.polygons, 'loop_start', np.int32)
    sizes = read(mesh.polygons, 'loop_total', np.int32)
    face_offsets = np.append(starts, np.int32(len(mesh.loops)))
    if not np.array_equal(np.diff(face_offsets), sizes):
        raise MeshError("has faces out of order; a modifier or script left the mesh invalid")
    slots = read(mesh.polygons, 'material_index', np.int32)
    materials = materials or (default_material,)
    # Blender shows the last material where a face names one that does not exist.
    slots = np.clip(slots, 0, len(materials) - 1)
    face_materials = np.array([item.index for item in materials], np.int32)[slots]
    corner_slots = np.repeat(slots, sizes)
    return MeshData(
        name, vertices, read(mesh.loops, 'vertex_index', np.int32), face_offsets,
        face_materials, corner_normals(mesh), _sharp_edges(mesh),
        read(mesh.polygons, 'use_smooth', bool), _uvs(mesh, materials, corner_slots, baked_uvs),
        _corner_colors(mesh, materials, corner_slots))


def corner_normals(mesh: bpy.types.Mesh) -> np.ndarray:
    """(c, 3) float32, unit shading normals."""
    if bpy.app.version >= (4, 1, 0):
        return read(mesh.corner_normals, 'vector', np.float32, 3)
    mesh.calc_normals_split()
    normals = read(mesh.loops, 'normal', np.float32, 3)
    mesh.free_normals_split()
    return normals


def _sharp_edges(mesh: bpy.types.Mesh) -> np.ndarray:
    """(e, 2) int32, the vertices of the edges that are marked sharp."""
    sharp = read(mesh.edges, 'use_edge_sharp', bool)
    return read(mesh.edges, 'vertices', np.int32, 2)[sharp]


def _uvs(mesh: bpy.types.Mesh, materials: Sequence[MaterialExport], corner_slots: np.ndarray,
         baked_uvs: np.ndarray | None) -> np.ndarray | None:
    """(c, 2) as each corner's own material reads them; None if no material has an image."""
    textures = [(slot, item.texture) for slot, item in enumerate(materials) if item.texture]
    baked = [slot for slot, item in enumerate(materials) if item.baked_uvs]
    if not textures and not baked:
        return None
    uvs = np.zeros((len(corner_slots), 2), np.float32)
    if baked:
        corners = np.isin(corner_slots, baked)
        uvs[corners] = baked_uvs[corners]
    layers: dict[str, np.ndarray] = {}
    for slot, texture in textures:
        layer = _uv_layer(mesh, texture)
        # Without a UV map Cycles reads the image at (0, 0).
        if layer is None:
            continue
        if layer.name not in layers:
            layers[layer.name] = read(layer.data, 'uv', np.float32, 2)
        corners = corner_slots == slot
        uvs[corners] = (layers[layer.name][corners] @ texture.uv_matrix[:, :2].T
                        + texture.uv_matrix[:, 2])
    return uvs


def _uv_layer(mesh: bpy.types.Mesh, texture: Texture) -> bpy.types.MeshUVLoopLayer | None:
    if texture.uv_layer:
        return mesh.uv_layers.get(texture.uv_layer)
    return next((layer for layer in mesh.uv_layers if layer.active_render), None)


def _corner_colors(mesh: bpy.types.Mesh, materials: Sequence[MaterialExport],
                   corner_slots: np.ndarray) -> np.ndarray | None:
    """(c, 3) as each corner's own material reads them; None if no material has an attribute."""
    names = [(slot, item.attribute) for slot, item in enumerate(materials)
             if item.attribute is not None]
    if not names:
        return None
    colors = np.zeros((len(corner_slots), 3), np.float32)
    for slot, name in names:
        attribute = _color_attribute(mesh, name)
        # Without the attribute Cycles reads black.
        if attribute is None:
            continue
        values = read(attribute.data, 'color', np.float32, 4)[:, :3]
        if attribute.domain == 'POINT':
            values = values[read(mesh.loops, 'vertex_index', np.int32)]
        corners = corner_slots == slot
        colors[corners] = values[corners]
    return colors


def _color_attribute(mesh: bpy.types.Mesh, name: str) -> bpy.types.Attribute | None:
    if name:
        return mesh.color_attributes.get(name)
    index = mesh.color_attributes.render_color_index
    # The index is -1, or past the end, when there is none.
    return mesh.color_attributes[index] if 0 <= index < len(mesh.color_attributes) else None
