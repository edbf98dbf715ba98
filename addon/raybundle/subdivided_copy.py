# SPDX-License-Identifier: GPL-3.0-or-later
"""Finer copies of objects whose meshes are too coarse for their light (topology 'SUBDIVIDE').

The copy "<name> (Radiosity)" is shown instead of the original, which is hidden. The copy's property
raybundle.source is the original, so that the next bake replaces the copy and Clear removes it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import bpy
import numpy as np

from .corner_map import grouped_mean
from .mesh_arrays import corner_vertices, read
from .native import Subdivision
from .scene_data import MeshData

NAME_SUFFIX = " (Radiosity)"


@dataclass(frozen=True)
class SubdividedMesh:
    """A finer mesh of t triangles, and the positions of its corners on the source mesh."""

    data: MeshData  # of the finer mesh, in object space
    source_faces: np.ndarray  # (t,) int32, the source face that contains each triangle
    # (3 t, 3): for each corner, three corners of the source mesh, int32, and their weights,
    # float32, which sum to 1.
    source_corners: np.ndarray
    source_weights: np.ndarray
    source_corner_count: int

    def interpolated(self, values: np.ndarray) -> np.ndarray:
        """Interpolates values at the corners of the source mesh, (source corners, n), at the
        corners of the finer mesh, (3 t, n)."""
        return np.einsum('cj,cjn->cn', self.source_weights, values[self.source_corners])

    def at_source(self, values: np.ndarray) -> np.ndarray:
        """Returns the values at the corners of the source mesh, (source corners, 3), of values at
        the corners of the finer mesh, (3 t, 3). It is 0 at source corners without a triangle."""
        corner, which = np.nonzero(self.source_weights > 0.999)
        return grouped_mean(values[corner], self.source_corners[corner, which],
                            self.source_corner_count)


def subdivide(mesh: MeshData, transform: np.ndarray, max_edge: float) -> SubdividedMesh:
    """Returns a triangle mesh whose edges in the world are not longer than max_edge, m. transform:
    (3, 4), object to world. Raises RaybundleError if the native library cannot create the mesh."""
    world = mesh.vertices @ transform[:, :3].T + transform[:, 3]
    with Subdivision(world, mesh.corner_vertices, mesh.face_offsets, max_edge) as subdivision:
        vertices_of_corners = subdivision.triangles.reshape(-1)
        result = SubdividedMesh(mesh, subdivision.source_faces,
                                subdivision.source_corners.reshape(-1, 3),
                                subdivision.source_weights.reshape(-1, 3), mesh.corner_count)
        vertex_count = len(subdivision.vertices)
    # Interpolate in object space, because the transform may be flat and have no inverse.
    vertices = np.zeros((vertex_count, 3), np.float32)
    vertices[vertices_of_corners] = result.interpolated(mesh.vertices[mesh.corner_vertices])
    normals = result.interpolated(mesh.corner_normals)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-20)
    return replace(result, data=replace(
        mesh,
        vertices=vertices,
        corner_vertices=vertices_of_corners,
        face_offsets=np.arange(0, len(vertices_of_corners) + 1, 3, dtype=np.int32),
        face_materials=mesh.face_materials[result.source_faces],
        corner_normals=normals.astype(np.float32),
        # The source's edges do not exist in this mesh, but the normals still differ across sharp
        # edges.
        sharp_edges=np.empty((0, 2), np.int32),
        face_smooth=mesh.face_smooth[result.source_faces],
        uvs=None if mesh.uvs is None else result.interpolated(mesh.uvs),
        corner_colors=(None if mesh.corner_colors is None
                       else result.interpolated(mesh.corner_colors))))


def find_copies(scene: bpy.types.Scene) -> dict[bpy.types.Object, bpy.types.Object]:
    """Returns the subdivided copies in the scene by original."""
    return {item.raybundle.source: item for item in scene.objects if item.raybundle.source}


@contextmanager
def originals_shown(scene: bpy.types.Scene) -> Iterator[None]:
    """Shows the originals instead of their copies in the with block, in viewport and renders."""
    copies = find_copies(scene)
    states = [(item, item.hide_viewport, item.hide_render)
              for pair in copies.items() for item in pair]
    try:
        for original, copy in copies.items():
            _set_hidden(original, False)
            _set_hidden(copy, True)
        yield
    finally:
        for item, hide_viewport, hide_render in states:
            item.hide_viewport, item.hide_render = hide_viewport, hide_render


def create_copies(context: bpy.types.Context,
                  meshes: dict[bpy.types.Object, SubdividedMesh]
                  ) -> dict[bpy.types.Object, bpy.types.Object]:
    """Creates a finer copy of each object, hides the original and removes an earlier copy.

    meshes: by original object. Returns the copies by original.
    """
    # Blender does not evaluate hidden objects, so show all originals for one evaluation.
    with originals_shown(context.scene):
        depsgraph = context.evaluated_depsgraph_get()
        built = {original: _evaluated_copy(original.evaluated_get(depsgraph), subdivided)
                 for original, subdivided in meshes.items()}
    earlier = find_copies(context.scene)
    copies = {}
    for original, mesh in built.items():
        if original in earlier:
            _remove_copy(earlier[original])
        copies[original] = _place_copy(context, original, mesh)
        _set_hidden(original, True)
    return copies


def _evaluated_copy(evaluated: bpy.types.Object, subdivided: SubdividedMesh) -> bpy.types.Mesh:
    source = evaluated.to_mesh()
    try:
        mesh = _build_mesh(evaluated.name + NAME_SUFFIX, source, subdivided)
    finally:
        evaluated.to_mesh_clear()
    for slot in evaluated.original.material_slots:
        mesh.materials.append(slot.material)
    return mesh


def _place_copy(context: bpy.types.Context, original: bpy.types.Object, mesh: bpy.types.Mesh
                ) -> bpy.types.Object:
    copy = bpy.data.objects.new(original.name + NAME_SUFFIX, mesh)
    # Objects cannot be added to a collection of another file.
    collections = [item for item in original.users_collection if item.library is None]
    for collection in collections or [context.scene.collection]:
        collection.objects.link(copy)
    copy.parent = original.parent
    copy.parent_type = original.parent_type
    copy.parent_bone = original.parent_bone
    copy.matrix_parent_inverse = original.matrix_parent_inverse
    copy.rotation_mode = original.rotation_mode
    copy.matrix_world = original.matrix_world
    copy.raybundle.role = original.raybundle.role
    copy.raybundle.side = original.raybundle.side
    copy.raybundle.quality = original.raybundle.quality
    copy.raybundle.source = original
    return copy


def remove_copies(scene: bpy.types.Scene) -> int:
    """Removes all copies and shows their originals again. Returns the number of removed copies."""
    copies = find_copies(scene)
    for original, copy in copies.items():
        _set_hidden(original, False)
        _remove_copy(copy)
    return len(copies)


def _set_hidden(item: bpy.types.Object, hidden: bool) -> None:
    item.hide_viewport = hidden
    item.hide_render = hidden


def _remove_copy(copy: bpy.types.Object) -> None:
    mesh = copy.data
    bpy.data.objects.remove(copy)
    if mesh.users == 0:
        bpy.data.meshes.remove(mesh)


def _build_mesh(name: str, source: bpy.types.Mesh, subdivided: SubdividedMesh) -> bpy.types.Mesh:
    data = subdivided.data
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(data.vertices))
    mesh.vertices.foreach_set('co', data.vertices.ravel())
    mesh.loops.add(data.corner_count)
    mesh.loops.foreach_set('vertex_index', data.corner_vertices)
    mesh.polygons.add(data.face_count)
    mesh.polygons.foreach_set('loop_start', data.face_offsets[:-1])
    if bpy.app.version < (4, 1, 0):
        # Later versions derive the sizes from the starts and do not allow setting them.
        mesh.polygons.foreach_set('loop_total', np.diff(data.face_offsets))
    slots = read(source.polygons, 'material_index', np.int32)
    mesh.polygons.foreach_set('material_index', slots[subdivided.source_faces])
    mesh.polygons.foreach_set('use_smooth', data.face_smooth)
    mesh.update(calc_edges=True)
    _carry_uv_layers(source, mesh, subdivided)
    _carry_color_attributes(source, mesh, subdivided)
    if data.face_smooth.any():
        # Custom normals preserve the shading of the source, including sharp edges.
        if bpy.app.version < (4, 1, 0):
            mesh.use_auto_smooth = True
            mesh.auto_smooth_angle = np.pi
        mesh.normals_split_custom_set(data.corner_normals)
    return mesh


def _carry_uv_layers(source: bpy.types.Mesh, mesh: bpy.types.Mesh, subdivided: SubdividedMesh
                     ) -> None:
    for layer in source.uv_layers:
        new = mesh.uv_layers.new(name=layer.name, do_init=False)
        uvs = subdivided.interpolated(read(layer.data, 'uv', np.float32, 2))
        new.data.foreach_set('uv', uvs.astype(np.float32).ravel())
        new.active_render = layer.active_render
    if source.uv_layers:
        mesh.uv_layers.active_index = source.uv_layers.active_index


def _carry_color_attributes(source: bpy.types.Mesh, mesh: bpy.types.Mesh,
                            subdivided: SubdividedMesh) -> None:
    vertices = corner_vertices(source)
    for attribute in source.color_attributes:
        colors = read(attribute.data, 'color', np.float32, 4)
        if attribute.domain == 'POINT':
            colors = colors[vertices]
        new = mesh.color_attributes.new(attribute.name, attribute.data_type, 'CORNER')
        new.data.foreach_set('color', subdivided.interpolated(colors).astype(np.float32).ravel())
