# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies with fewer vertices: those that neither their light nor their shape needs are removed."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import bpy
import numpy as np

from .carried_attributes import marked_edges
from .finer_mesh import FinerMesh
from .mesh_arrays import read
from .native import Simplification

# The largest changes at any vertex, all relative to the target error: of light, relative to its RMS
# over the object; of the surface, relative to the diagonal of the object; of texture coordinates,
# relative to their extent.
_LIGHT, _DISTANCE, _UV = 2.0, 0.1, 0.5
# The largest change of each component of normals, which light that is added later needs.
_NORMAL = 0.2
_LEAST = 1e-12  # tolerances are positive


@dataclass
class Simplifier:
    """Simplifies meshes within the target error, and remembers what of their light is left."""

    target_error: float
    # By original object: all its light at the corners of its mesh, (c, n).
    light: dict[bpy.types.Object, np.ndarray]
    # By original object, after simplify(): the corners that are left, and the vertices, as indices
    # before; the RMS change of the light, relative to it; and the area of the object, m^2.
    corners: dict[bpy.types.Object, np.ndarray] = field(default_factory=dict)
    vertices: dict[bpy.types.Object, np.ndarray] = field(default_factory=dict)
    changes: dict[bpy.types.Object, float] = field(default_factory=dict)
    areas: dict[bpy.types.Object, float] = field(default_factory=dict)

    def simplify(self, sources: dict[bpy.types.Object, bpy.types.Mesh],
                 meshes: dict[bpy.types.Object, FinerMesh]) -> dict[bpy.types.Object, FinerMesh]:
        """Returns the meshes of objects without the vertices that are not needed. sources: the
        evaluated mesh of each object, which is the source of the finer mesh. Raises RaybundleError
        if the native library fails."""
        limits = {original: self._limits(original, sources[original], finer)
                  for original, finer in meshes.items()}
        # The library works outside of Python, on several objects at once.
        with ThreadPoolExecutor(os.cpu_count()) as threads:
            made = threads.map(lambda arguments: Simplification(*arguments), limits.values())
            return {original: self._simplified(original, meshes[original], simplification)
                    for original, simplification in zip(limits, made)}

    def _limits(self, original: bpy.types.Object, source: bpy.types.Mesh, finer: FinerMesh
                ) -> tuple:
        """Returns the arguments of Simplification."""
        data, light = finer.data, self.light[original]
        extent = float(np.linalg.norm(np.ptp(data.vertices, axis=0))) if len(data.vertices) else 0.0
        values = [light, data.corner_normals]
        tolerances = [np.full(light.shape[1], _LIGHT * self.target_error * _size(light)),
                      np.full(3, _NORMAL)]
        for layer in source.uv_layers:
            # Broken texture coordinates must not end a bake.
            uvs = finer.interpolated(np.nan_to_num(
                read(layer.data, 'uv', np.float32, 2), posinf=0.0, neginf=0.0))
            values.append(uvs)
            tolerances.append(np.full(
                2, _UV * self.target_error * np.ptp(uvs, axis=0).max(initial=0.0)))
        _, kinds = np.unique(np.column_stack([
            read(source.polygons, 'material_index', np.int32)[finer.source_faces],
            data.face_smooth]), axis=0, return_inverse=True)
        scale = abs(original.matrix_world.to_3x3().determinant()) ** (2 / 3)
        self.areas[original] = float(scale * read(source.polygons, 'area', np.float32).sum())
        return (data.vertices, data.corner_vertices, data.face_offsets, kinds.ravel(),
                marked_edges(source, finer), np.concatenate(values, axis=1),
                np.maximum(np.concatenate(tolerances), _LEAST),
                max(_DISTANCE * self.target_error * extent, _LEAST))

    def _simplified(self, original: bpy.types.Object, finer: FinerMesh, made: Simplification
                    ) -> FinerMesh:
        """Returns what is left of a mesh, and remembers which corners and vertices."""
        data, light = finer.data, self.light[original]
        with made:
            corners = made.source_corners
            kept, corner_vertices = np.unique(data.corner_vertices[corners], return_inverse=True)
            self.corners[original], self.vertices[original] = corners, kept
            change = made.changes[:light.shape[1]].max(initial=0.0)
            self.changes[original] = float(change / max(_size(light), _LEAST))
            return replace(
                finer, data=replace(
                    data, vertices=data.vertices[kept],
                    corner_vertices=corner_vertices.ravel().astype(np.int32),
                    face_offsets=made.face_offsets,
                    face_materials=data.face_materials[made.source_faces],
                    corner_normals=data.corner_normals[corners],
                    face_smooth=data.face_smooth[made.source_faces],
                    uvs=None if data.uvs is None else data.uvs[corners],
                    corner_colors=(None if data.corner_colors is None
                                   else data.corner_colors[corners])),
                source_faces=finer.source_faces[made.source_faces],
                source_corners=finer.source_corners[corners],
                source_weights=finer.source_weights[corners],
                source_edges=(None if finer.source_edges is None else np.where(
                    made.source_edges < 0, -1, finer.source_edges[made.source_edges])),
                has_source_vertices=False)

    def change(self) -> float:
        """Returns the RMS change of the light of all objects, relative to the light of each."""
        squares = sum(self.areas[item] * change ** 2 for item, change in self.changes.items())
        return float(np.sqrt(squares / max(sum(self.areas.values()), _LEAST)))

    def left(self, original: bpy.types.Object, light: np.ndarray, domain: str) -> np.ndarray:
        """Returns what is left of values at the corners or vertices of an object's mesh."""
        return light[(self.corners if domain == 'CORNER' else self.vertices)[original]]


def _size(light: np.ndarray) -> float:
    """Returns the RMS over the corners of the brightest channel of light, (c, n)."""
    return float(np.sqrt(np.mean(np.square(light), axis=0)).max(initial=0.0))
