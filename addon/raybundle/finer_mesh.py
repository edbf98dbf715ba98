# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that are finer than those of the user, for light that the user's vertices cannot show: cut
evenly (topology 'SUBDIVIDE'), or where the light needs it (topology 'ADAPTIVE'). simplified_mesh.py
removes vertices of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .corner_map import grouped_mean
from .native import AdaptedMesh, Subdivision
from .scene_data import MeshData


@dataclass(frozen=True)
class FinerMesh:
    """A mesh of c corners and f faces that lie on the faces of a source mesh, or close to them if it
    is simplified."""

    data: MeshData  # of the finer mesh, in object space
    source_faces: np.ndarray  # (f,) int32, the source face that contains each face
    # (c, 3): for each corner, three corners of the source mesh, int32, and their weights, float32,
    # which sum to 1.
    source_corners: np.ndarray
    source_weights: np.ndarray
    source_corner_count: int
    source_vertex_count: int
    # (c,) int32: the source's corner at which the source's edge begins on which the edge from the
    # corner to the next lies; -1: it lies on none. None: not known.
    source_edges: np.ndarray | None = None
    # Whether the first vertices are all those of the source.
    has_source_vertices: bool = False

    @classmethod
    def of(cls, mesh: MeshData) -> FinerMesh:
        """Returns a mesh as it is."""
        corners = np.arange(mesh.corner_count, dtype=np.int32)
        weights = np.zeros((mesh.corner_count, 3), np.float32)
        weights[:, 0] = 1.0
        return cls(mesh, np.arange(mesh.face_count, dtype=np.int32),
                   np.repeat(corners[:, None], 3, axis=1), weights, mesh.corner_count,
                   len(mesh.vertices), corners, has_source_vertices=True)

    def interpolated(self, values: np.ndarray) -> np.ndarray:
        """Interpolates values at the corners of the source mesh, (source corners, n), at the
        corners of the finer mesh, (c, n)."""
        return np.einsum('cj,cjn->cn', self.source_weights, values[self.source_corners])

    def nearest(self, values: np.ndarray) -> np.ndarray:
        """Returns values at the corners of the source mesh, (source corners, ...), at the corners
        of the finer mesh: those of the source corner with the largest weight."""
        which = self.source_weights.argmax(axis=1)
        return values[self.source_corners[np.arange(len(which)), which]]

    def at_source(self, values: np.ndarray) -> np.ndarray:
        """Returns the values at the corners of the source mesh, (source corners, 3), of values at
        the corners of the finer mesh, (c, 3). It is 0 at source corners without a face."""
        corner, which = np.nonzero(self.source_weights > 0.999)
        return grouped_mean(values[corner], self.source_corners[corner, which],
                            self.source_corner_count)


def subdivide(mesh: MeshData, transform: np.ndarray, max_edge: float) -> FinerMesh:
    """Returns a triangle mesh whose edges in the world are not longer than max_edge, m. transform:
    (3, 4), object to world. Raises RaybundleError if the native library cannot create the mesh."""
    world = mesh.vertices @ transform[:, :3].T + transform[:, 3]
    with Subdivision(world, mesh.corner_vertices, mesh.face_offsets, max_edge) as subdivision:
        vertices_of_corners = subdivision.triangles.reshape(-1)
        result = FinerMesh(mesh, subdivision.source_faces,
                           subdivision.source_corners.reshape(-1, 3),
                           subdivision.source_weights.reshape(-1, 3), mesh.corner_count,
                           len(mesh.vertices))
        vertex_count = len(subdivision.vertices)
    # Interpolate in object space, because the transform may be flat and have no inverse.
    vertices = np.zeros((vertex_count, 3), np.float32)
    vertices[vertices_of_corners] = result.interpolated(mesh.vertices[mesh.corner_vertices])
    return _with_attributes(result, vertices, vertices_of_corners,
                            np.arange(0, len(vertices_of_corners) + 1, 3, dtype=np.int32))


def adapted(mesh: MeshData, finer: AdaptedMesh) -> FinerMesh:
    """Returns the mesh that the native library has adapted to the light. mesh: its source."""
    return _with_attributes(
        FinerMesh(mesh, finer.source_faces, finer.source_corners, finer.source_weights,
                  mesh.corner_count, len(mesh.vertices), finer.source_edges,
                  has_source_vertices=True),
        finer.vertices, finer.corner_vertices, finer.face_offsets)


def _with_attributes(finer: FinerMesh, vertices: np.ndarray, corner_vertices: np.ndarray,
                     face_offsets: np.ndarray) -> FinerMesh:
    """Returns a finer mesh, whose data are still those of its source, with data of its own."""
    mesh = finer.data
    normals = finer.interpolated(mesh.corner_normals)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-20)
    return replace(finer, data=replace(
        mesh,
        vertices=vertices,
        corner_vertices=corner_vertices,
        face_offsets=face_offsets,
        face_materials=mesh.face_materials[finer.source_faces],
        corner_normals=normals.astype(np.float32),
        # The source's edges do not exist in this mesh, but the normals still differ across sharp
        # edges.
        sharp_edges=np.empty((0, 2), np.int32),
        face_smooth=mesh.face_smooth[finer.source_faces],
        uvs=None if mesh.uvs is None else finer.interpolated(mesh.uvs),
        corner_colors=(None if mesh.corner_colors is None
                       else finer.interpolated(mesh.corner_colors))))
