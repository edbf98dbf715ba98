# SPDX-License-Identifier: GPL-3.0-or-later
"""From the corners of an evaluated mesh back to the corners of the mesh the user edits.

Modifiers may change the topology, and Blender's own index of origin is not open to Python. So the
original mesh carries two integer attributes during the export, with a scattered code per vertex and
per corner. Modifiers copy the codes of elements they keep and interpolate (which is to say spoil)
those of elements they make; a scattered code is recognised as spoilt where a plain index would
often pass for another element's.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils.kdtree import KDTree

from .mesh_export import corner_vertices, read, topology, vertex_positions

VERTEX_CODE = ".raybundle_vertex"
CORNER_CODE = ".raybundle_corner"

# Integers of so many bits survive Blender's interpolation in single precision with a weight of 1.
_CODE_BITS = 24

# Of this many integers one is a code: so rarely is an interpolated code taken for an exact one. It
# is less rare on meshes of more than 4096 elements, for which the limit above is what counts.
_CODES_PER_ELEMENT = 4096


@dataclass(frozen=True)
class CornerMap:
    """Means over evaluated corners for each original corner, or one to one."""

    original_count: int
    evaluated: np.ndarray | None = None  # (k,) evaluated corner of each pair; None: one to one
    original: np.ndarray | None = None  # (k,) original corner of each pair
    filled: int = 0  # original corners whose value is that of a neighbour

    @property
    def is_identity(self) -> bool:
        return self.evaluated is None

    def to_original(self, values: np.ndarray) -> np.ndarray:
        """values: (evaluated corners, 3) -> (original corners, 3)."""
        if self.is_identity:
            return values
        return grouped_mean(values[self.evaluated], self.original, self.original_count)


class ElementCodes:
    """Puts the codes on original meshes and takes them off again; a context manager."""

    def __init__(self, meshes: Iterable[bpy.types.Mesh]) -> None:
        self._meshes = list(dict.fromkeys(meshes))
        self._active: list[int] = []

    def __enter__(self) -> ElementCodes:
        for mesh in self._meshes:
            _remove_codes(mesh)
            self._active.append(mesh.attributes.active_index)
            for name, domain, count in ((VERTEX_CODE, 'POINT', len(mesh.vertices)),
                                        (CORNER_CODE, 'CORNER', len(mesh.loops))):
                attribute = mesh.attributes.new(name, 'INT', domain)
                attribute.data.foreach_set('value', _codes(count))
        return self

    def __exit__(self, *exception: object) -> None:
        for mesh, active in zip(self._meshes, self._active):
            _remove_codes(mesh)
            # A new attribute becomes the active one.
            mesh.attributes.active_index = active


def same_topology(original: bpy.types.Mesh, evaluated: bpy.types.Mesh) -> bool:
    return topology(original).matches(topology(evaluated))


def build_corner_map(original: bpy.types.Mesh, evaluated: bpy.types.Mesh) -> CornerMap:
    """Both meshes in object space; codes must have been there when the mesh was evaluated."""
    count = len(original.loops)
    if same_topology(original, evaluated):
        return CornerMap(count)
    original_vertices = corner_vertices(original)
    evaluated_vertices = corner_vertices(evaluated)
    corners = _decoded(evaluated, CORNER_CODE, len(evaluated.loops), count)
    vertices = _decoded(evaluated, VERTEX_CODE, len(evaluated.vertices), len(original.vertices))
    corner_origin_vertices = vertices[evaluated_vertices]

    # Pair the corners that came through; a corner and its vertex must agree.
    exact = corners >= 0
    exact[exact] = original_vertices[corners[exact]] == corner_origin_vertices[exact]
    pairs_evaluated = [np.flatnonzero(exact)]
    pairs_original = [corners[exact]]
    missing = np.ones(count, bool)
    missing[corners[exact]] = False
    filled = int(missing.sum())

    # Give the others the corners of their vertex, if that came through.
    if filled:
        by_vertex, to_missing = _pairs_with_equal_keys(
            corner_origin_vertices, original_vertices, np.flatnonzero(missing))
        pairs_evaluated.append(by_vertex)
        pairs_original.append(to_missing)
        missing[to_missing] = False

    # Give what remains the nearest corner.
    rest = np.flatnonzero(missing)
    if len(rest) and len(evaluated.loops):
        pairs_evaluated.append(_nearest_corners(original, evaluated, rest))
        pairs_original.append(rest)
    return CornerMap(count, np.concatenate(pairs_evaluated), np.concatenate(pairs_original),
                     filled)


def grouped_mean(values: np.ndarray, groups: np.ndarray, group_count: int) -> np.ndarray:
    """(group_count, 3) float32, the mean of each group's values (k, 3); 0 where it has none."""
    counts = np.bincount(groups, minlength=group_count)
    sums = [np.bincount(groups, values[:, channel], group_count) for channel in range(3)]
    return (np.stack(sums, axis=1) / np.maximum(counts, 1)[:, None]).astype(np.float32)


def _codes(count: int) -> np.ndarray:
    """(count,) int32, distinct, positive, always the same, in no order."""
    numbers = np.arange(1, count + 1, dtype=np.uint64)
    bits = min((_CODES_PER_ELEMENT * count).bit_length(), _CODE_BITS)
    if count >= 2 ** bits:
        return numbers.astype(np.int32)
    # Each step permutes the numbers of so many bits and leaves 0 where it is.
    for factor in (0x9E3779B1, 0x85EBCA77):
        numbers = (numbers * np.uint64(factor)) & np.uint64(2 ** bits - 1)
        numbers ^= numbers >> np.uint64(bits // 2)
    return numbers.astype(np.int32)


def _decoded(evaluated: bpy.types.Mesh, name: str, count: int, original_count: int) -> np.ndarray:
    """(count,) the original element of each evaluated one, -1 where there is none."""
    attribute = evaluated.attributes.get(name)
    # Modifiers that build a new mesh, such as Remesh, drop attributes; others move their domain.
    if attribute is None or len(attribute.data) != count or attribute.data_type != 'INT' \
            or original_count == 0:
        return np.full(count, -1)
    codes = _codes(original_count)
    element = np.full(codes.max() + 1, -1, np.int32)
    element[codes] = np.arange(original_count)
    values = read(attribute.data, 'value', np.int32)
    known = (values > 0) & (values < len(element))
    return np.where(known, element[np.where(known, values, 0)], -1)


def _pairs_with_equal_keys(source_keys: np.ndarray, target_keys: np.ndarray, targets: np.ndarray
                           ) -> tuple[np.ndarray, np.ndarray]:
    """All (source, target) pairs with the same key, for these targets; keys below 0 match none."""
    order = np.argsort(source_keys, kind='stable')
    ordered = source_keys[order]
    first = np.searchsorted(ordered, target_keys[targets], side='left')
    counts = np.searchsorted(ordered, target_keys[targets], side='right') - first
    starts = np.cumsum(counts) - counts
    offsets = np.arange(counts.sum()) - np.repeat(starts, counts)
    return order[np.repeat(first, counts) + offsets], np.repeat(targets, counts)


def _nearest_corners(original: bpy.types.Mesh, evaluated: bpy.types.Mesh, corners: np.ndarray
                     ) -> np.ndarray:
    """(k,) the evaluated corner nearest to each of these original corners."""
    points = _points_inside_faces(evaluated)
    tree = KDTree(len(points))
    for index, point in enumerate(points.tolist()):
        tree.insert(point, index)
    tree.balance()
    wanted = _points_inside_faces(original)[corners]
    return np.array([tree.find(point)[1] for point in wanted.tolist()], np.int64)


def _points_inside_faces(mesh: bpy.types.Mesh) -> np.ndarray:
    """(c, 3), each corner drawn a little into its face: corners of one vertex differ by face."""
    positions = vertex_positions(mesh)[corner_vertices(mesh)]
    sizes = read(mesh.polygons, 'loop_total', np.int32)
    faces = np.repeat(np.arange(len(sizes)), sizes)
    centres = grouped_mean(positions, faces, len(sizes))[faces]
    return positions + 0.1 * (centres - positions)


def _remove_codes(mesh: bpy.types.Mesh) -> None:
    for name in (VERTEX_CODE, CORNER_CODE):
        attribute = mesh.attributes.get(name)
        if attribute is not None:
            mesh.attributes.remove(attribute)
