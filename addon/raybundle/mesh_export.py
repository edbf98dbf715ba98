# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts evaluated Blender meshes to `MeshData`, with foreach_get only.

Blender copies an attribute as a whole, but reads other properties element by element, at some tens
of nanoseconds each. Therefore data that Blender 4 stores as attributes is read as attributes, and
data that is equal for all elements is not read at all.
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np

from .color_attribute import rendered_attribute
from .materials.color_expression import Texture
from .materials.export import MaterialExport
from .mesh_arrays import HAS_ATTRIBUTES, corner_vertices, read, read_attribute, vertex_positions
from .messages import Message
from .scene_data import MeshData

# Limit of coordinates, m. The squares of larger coordinates are meaningless or overflow in single
# precision.
COORDINATE_LIMIT = 1e15

# A normal counts as turned if its cosine to the usual normal is smaller than _SAME_WAY (about 10
# degrees). A mesh has turned normals if more than _TURNED_SHARE of its corners have turned normals.
_SAME_WAY, _TURNED_SHARE = 0.985, 0.02


class MeshError(ValueError):
    """Raised if a mesh cannot be part of a bake. The message gives the reason and does not name the
    mesh."""


def export_mesh(mesh: bpy.types.Mesh, name: str, materials: Sequence[MaterialExport],
                default_material: MaterialExport, baked_uvs: np.ndarray | None = None) -> MeshData:
    """Returns the arrays of a mesh in object space.

    mesh: evaluated. name: for messages. materials: by slot. default_material: used if there are no
    slots. baked_uvs: (c, 2), for materials that Cycles has baked. Raises MeshError if the mesh has
    no faces, has coordinates that are not finite or are too large, or has an invalid order of
    faces.
    """
    if not len(mesh.polygons):
        raise MeshError(Message("it has no faces"))
    vertices = vertex_positions(mesh)
    # The comparison is also False for NaN.
    if not (np.abs(vertices) < COORDINATE_LIMIT).all():
        raise MeshError(Message("it has coordinates that are not finite or not below {limit}: "
                                "delete these vertices", limit=f"{COORDINATE_LIMIT:.0e}"))
    starts = read(mesh.polygons, 'loop_start', np.int32)
    face_offsets = np.append(starts, np.int32(len(mesh.loops)))
    sizes = np.diff(face_offsets)
    # Later versions of Blender store no sizes that could contradict the starts.
    if not HAS_ATTRIBUTES and not np.array_equal(sizes, read(mesh.polygons, 'loop_total',
                                                             np.int32)):
        raise MeshError(Message("its faces are stored out of order: remove the modifier or script "
                                "that made the mesh invalid"))
    materials = materials or (default_material,)
    slots = _face_slots(mesh, len(materials))
    face_materials = np.array([item.index for item in materials], np.int32)[slots]
    corner_slots = np.repeat(slots, sizes)
    vertices_of_corners, smooth = corner_vertices(mesh), _face_smooth(mesh)
    return MeshData(
        name, vertices, vertices_of_corners, face_offsets, face_materials,
        _corner_normals(mesh, vertices_of_corners, sizes, smooth), _sharp_edges(mesh), smooth,
        _uvs(mesh, materials, corner_slots, baked_uvs),
        _corner_colors(mesh, materials, corner_slots))


def has_turned_normals(mesh: bpy.types.Mesh, data: MeshData) -> bool:
    """Returns whether custom normals turn the shading of faces away from both the faces' own
    normals and the normals of their vertices. mesh: evaluated. data: exported from the mesh."""
    if not mesh.has_custom_normals:
        return False
    of_faces = np.repeat(read(mesh.polygons, 'normal', np.float32, 3), np.diff(data.face_offsets),
                         axis=0)
    usual = of_faces, _vertex_normals(data, of_faces)[data.corner_vertices]
    is_usual = np.any([np.einsum('ck,ck->c', data.corner_normals, normals) > _SAME_WAY
                       for normals in usual], axis=0)
    return bool(np.mean(~is_usual) > _TURNED_SHARE)


def _vertex_normals(data: MeshData, of_faces: np.ndarray) -> np.ndarray:
    """Returns the mean normal of the faces at each vertex, weighted by their angles there as in
    Blender, (v, 3). of_faces: (c, 3), normal of the face of each corner.

    Mesh.vertex_normals and Mesh.polygon_normals are no substitute: from 4.5 on, they contain the
    custom normals.
    """
    places = data.vertices[data.corner_vertices].astype(float)
    starts, last = data.face_offsets[:-1], data.face_offsets[1:] - 1
    following, previous = np.arange(1, len(places) + 1), np.arange(-1, len(places) - 1)
    following[last], previous[starts] = starts, last
    edges = places[[following, previous]] - places
    edges /= np.maximum(np.linalg.norm(edges, axis=-1, keepdims=True), 1e-30)
    angles = np.arccos(np.clip(np.einsum('ck,ck->c', *edges), -1.0, 1.0))
    sums = np.stack([np.bincount(data.corner_vertices, angles * part, len(data.vertices))
                     for part in of_faces.T], axis=1)
    return sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-30)


def _face_slots(mesh: bpy.types.Mesh, count: int) -> np.ndarray:
    """Returns the material slot of each face, clamped to 0 to count - 1, (f,) int32."""
    slots = None
    if count > 1:
        slots = (read_attribute(mesh, 'material_index', 'FACE', 'INT', np.int32)
                 if HAS_ATTRIBUTES else read(mesh.polygons, 'material_index', np.int32))
    if slots is None:
        return np.zeros(len(mesh.polygons), np.int32)
    # If the slot of a face does not exist, Blender shows the last material.
    return np.clip(slots, 0, count - 1)


def _face_smooth(mesh: bpy.types.Mesh) -> np.ndarray:
    """Returns whether each face is shaded smooth, (f,) bool."""
    if not HAS_ATTRIBUTES:
        return read(mesh.polygons, 'use_smooth', bool)
    sharp = read_attribute(mesh, 'sharp_face', 'FACE', 'BOOLEAN', bool)
    return np.ones(len(mesh.polygons), bool) if sharp is None else ~sharp


def _corner_normals(mesh: bpy.types.Mesh, vertices_of_corners: np.ndarray, sizes: np.ndarray,
                    smooth: np.ndarray) -> np.ndarray:
    """Returns the unit shading normal of each corner in object space, (c, 3) float32.

    vertices_of_corners: (c,). sizes: (f,), number of corners of each face. smooth: (f,) bool.
    """
    if bpy.app.version >= (4, 1, 0):
        return read(mesh.corner_normals, 'vector', np.float32, 3)
    if mesh.use_auto_smooth:
        # Normals that are split at sharp edges or set by the user.
        mesh.calc_normals_split()
        normals = read(mesh.loops, 'normal', np.float32, 3)
        mesh.free_normals_split()
        return normals
    if smooth.all():
        return read(mesh.vertex_normals, 'vector', np.float32, 3)[vertices_of_corners]
    normals = np.repeat(read(mesh.polygon_normals, 'vector', np.float32, 3), sizes, axis=0)
    if smooth.any():
        corners = np.repeat(smooth, sizes)
        normals[corners] = read(mesh.vertex_normals, 'vector', np.float32,
                                3)[vertices_of_corners[corners]]
    return normals


def _sharp_edges(mesh: bpy.types.Mesh) -> np.ndarray:
    """Returns the two vertices of each edge that is marked sharp, (e, 2) int32. Before 4.1, Blender
    shades across these edges unless the mesh has Auto Smooth, but light is never blended there."""
    sharp = (read_attribute(mesh, 'sharp_edge', 'EDGE', 'BOOLEAN', bool)
             if HAS_ATTRIBUTES else read(mesh.edges, 'use_edge_sharp', bool))
    if sharp is None or not sharp.any():
        return np.empty((0, 2), np.int32)
    return read(mesh.edges, 'vertices', np.int32, 2)[sharp]


def _uvs(mesh: bpy.types.Mesh, materials: Sequence[MaterialExport], corner_slots: np.ndarray,
         baked_uvs: np.ndarray | None) -> np.ndarray | None:
    """Returns the coordinates at which the material of each corner reads its images, (c, 2)
    float32. Returns None if no material has an image. corner_slots: (c,), slot of each corner."""
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
        # Without a UV map, Cycles reads the image at (0, 0).
        if layer is None:
            continue
        if layer.name not in layers:
            layers[layer.name] = read(layer.data, 'uv', np.float32, 2)
        corners = corner_slots == slot
        uvs[corners] = (layers[layer.name][corners] @ texture.uv_matrix[:, :2].T
                        + texture.uv_matrix[:, 2])
    return uvs


def _uv_layer(mesh: bpy.types.Mesh, texture: Texture) -> bpy.types.MeshUVLoopLayer | None:
    """Returns the UV map at which a texture is read. Returns None if the mesh has no such map."""
    if texture.uv_layer:
        return mesh.uv_layers.get(texture.uv_layer)
    return next((layer for layer in mesh.uv_layers if layer.active_render), None)


def _corner_colors(mesh: bpy.types.Mesh, materials: Sequence[MaterialExport],
                   corner_slots: np.ndarray) -> np.ndarray | None:
    """Returns the values of the attribute that the material of each corner reads, (c, 3) float32,
    linear RGB. Returns None if no material reads an attribute. corner_slots: (c,), slot of each
    corner."""
    names = [(slot, item.attribute) for slot, item in enumerate(materials)
             if item.attribute is not None]
    if not names:
        return None
    colors = np.zeros((len(corner_slots), 3), np.float32)
    for slot, name in names:
        attribute = _color_attribute(mesh, name)
        # Without the attribute, Cycles reads black.
        if attribute is None:
            continue
        values = read(attribute.data, 'color', np.float32, 4)[:, :3]
        if attribute.domain == 'POINT':
            values = values[corner_vertices(mesh)]
        corners = corner_slots == slot
        colors[corners] = values[corners]
    return colors


def _color_attribute(mesh: bpy.types.Mesh, name: str) -> bpy.types.Attribute | None:
    """Returns the colour attribute of a name, or the render colour attribute for "". Returns None
    if there is none."""
    return mesh.color_attributes.get(name) if name else rendered_attribute(mesh)
