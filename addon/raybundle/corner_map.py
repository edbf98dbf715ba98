# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps corners of an evaluated mesh to corners of the mesh that the user edits.

Modifiers may change the topology, and Python cannot access Blender's own index of the original
element. During the export, the original mesh therefore has two integer attributes with a code for
each vertex and each corner. Modifiers copy the codes of elements that they keep, and interpolate
codes for elements that they create. Codes are sparse numbers in no order, so that an interpolated
code is almost never the code of an element. An interpolated index often would be.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils.kdtree import KDTree

from .mesh_arrays import corner_vertices, read, topology, vertex_positions

VERTEX_CODE = ".raybundle_vertex"
CORNER_CODE = ".raybundle_corner"

# Blender interpolates integers in single precision, which keeps this number of bits if the weight
# is 1.
_CODE_BITS = 24

# One in this number of integers is a code, so an interpolated value is mistaken for a code with
# this probability. On meshes of more than 4096 elements, the limit of bits makes codes denser.
_CODES_PER_ELEMENT = 4096

# Faces count as facing the same way if the cosine between their normals is larger than this.
_SAME_WAY = 0.7


@dataclass(frozen=True)
class CornerMap:
    """Pairs of corners of an evaluated mesh and of its original mesh.

    An original corner gets the mean of the evaluated corners that it is paired with.
    """

    original_count: int  # number of corners of the original mesh
    # (k,): evaluated corner of each pair. None: both meshes have the same corners.
    evaluated: np.ndarray | None = None
    original: np.ndarray | None = None  # (k,): original corner of each pair
    copied: int = 0  # number of original corners that modifiers have also copied to other places
    untraced: int = 0  # number of original corners whose code the modifiers have not kept

    @property
    def is_identity(self) -> bool:
        return self.evaluated is None

    def to_original(self, values: np.ndarray) -> np.ndarray:
        """Converts values of evaluated corners, (evaluated corners, 3), to values of original
        corners, (original corners, 3). The value of a corner without a pair is 0."""
        if self.is_identity:
            return values
        return grouped_mean(values[self.evaluated], self.original, self.original_count)


class ElementCodes:
    """A context manager that gives original meshes their codes in the with block."""

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
            # New attributes have become the active ones.
            mesh.attributes.active_index = active


def same_topology(original: bpy.types.Mesh, evaluated: bpy.types.Mesh) -> bool:
    """Returns whether the corners of the two meshes correspond one to one."""
    return topology(original).matches(topology(evaluated))


def build_corner_map(original: bpy.types.Mesh, evaluated: bpy.types.Mesh) -> CornerMap:
    """Returns pairs of corners of two meshes, which are both in object space.

    If the topology differs, the original mesh must have had its codes (ElementCodes) when it was
    evaluated. If modifiers have created several corners from one, the best of them is chosen: first
    by whether its face faces the same way as the original, then by its distance to the original
    corner, then by its index. For Solidify this is the shell with the original's normals, for
    Mirror and Array the copy in the original's place.
    """
    count = len(original.loops)
    if same_topology(original, evaluated):
        return CornerMap(count)
    original_vertices = corner_vertices(original)
    evaluated_vertices = corner_vertices(evaluated)
    corners = _decoded(evaluated, CORNER_CODE, len(evaluated.loops), count)
    vertices = _decoded(evaluated, VERTEX_CODE, len(evaluated.vertices), len(original.vertices))
    corner_origin_vertices = vertices[evaluated_vertices]
    before, after = _Corners(original), _Corners(evaluated)
    missing = np.ones(count, bool)

    # Pair corners whose code was kept and whose vertex has the code of the same original vertex.
    exact = corners >= 0
    exact[exact] = original_vertices[corners[exact]] == corner_origin_vertices[exact]
    candidates = np.flatnonzero(exact)
    is_best = _are_best(candidates, corners[candidates], before, after)
    pairs = [(candidates[is_best], corners[candidates][is_best])]
    missing[corners[candidates]] = False
    copied = len(np.unique(corners[candidates][~is_best]))

    # Pair the others with all corners of their vertex, if its code was kept.
    if missing.any():
        candidates, targets = _pairs_with_equal_keys(corner_origin_vertices, original_vertices,
                                                     np.flatnonzero(missing))
        is_best = _are_best(candidates, targets, before, after)
        pairs.append((candidates[is_best], targets[is_best]))
        missing[targets] = False

    # Pair the rest with the nearest corner that faces the same way.
    rest = np.flatnonzero(missing)
    if len(rest) and len(evaluated.loops):
        pairs.append((_nearest_corners(before, after, rest), rest))
    return CornerMap(count, *map(np.concatenate, zip(*pairs)), copied, len(rest))


def grouped_mean(values: np.ndarray, groups: np.ndarray, group_count: int) -> np.ndarray:
    """Returns the mean of each group's values, (group_count, 3) float32. It is 0 for a group
    without values. values: (k, 3). groups: (k,), the group of each value."""
    counts = np.bincount(groups, minlength=group_count)
    sums = [np.bincount(groups, values[:, channel], group_count) for channel in range(3)]
    return (np.stack(sums, axis=1) / np.maximum(counts, 1)[:, None]).astype(np.float32)


def _codes(count: int) -> np.ndarray:
    """Returns a code for each element, (count,) int32. Codes are distinct, positive, and only
    depend on the count."""
    numbers = np.arange(1, count + 1, dtype=np.uint64)
    bits = min((_CODES_PER_ELEMENT * count).bit_length(), _CODE_BITS)
    if count >= 2 ** bits:
        return numbers.astype(np.int32)
    # Each step is a permutation of the numbers of this many bits, which maps 0 to 0.
    for factor in (0x9E3779B1, 0x85EBCA77):
        numbers = (numbers * np.uint64(factor)) & np.uint64(2 ** bits - 1)
        numbers ^= numbers >> np.uint64(bits // 2)
    return numbers.astype(np.int32)


def _decoded(evaluated: bpy.types.Mesh, name: str, count: int, original_count: int) -> np.ndarray:
    """Returns the original element of each evaluated element, (count,), from the attribute `name`.
    The result is -1 where the value of the attribute is not a code."""
    attribute = evaluated.attributes.get(name)
    # Modifiers that build a new mesh, such as Remesh, drop attributes; others change their domain.
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
    """Returns all pairs (source, target) with equal keys, as two arrays. targets: positions in
    target_keys for which pairs are searched. Their keys are at least 0, so negative source keys,
    which stand for no element, match nothing."""
    order = np.argsort(source_keys, kind='stable')
    ordered = source_keys[order]
    first = np.searchsorted(ordered, target_keys[targets], side='left')
    counts = np.searchsorted(ordered, target_keys[targets], side='right') - first
    starts = np.cumsum(counts) - counts
    offsets = np.arange(counts.sum()) - np.repeat(starts, counts)
    return order[np.repeat(first, counts) + offsets], np.repeat(targets, counts)


class _Corners:
    """The corners of a mesh: positions, in object space, and normals of their faces, (c, 3)
    each."""

    def __init__(self, mesh: bpy.types.Mesh) -> None:
        self.places = vertex_positions(mesh)[corner_vertices(mesh)]
        sizes = read(mesh.polygons, 'loop_total', np.int32)
        faces = np.repeat(np.arange(len(sizes)), sizes)
        self.normals = read(mesh.polygons, 'normal', np.float32, 3)[faces]
        # Move each corner slightly into its face, so that the corners of one vertex differ.
        centres = grouped_mean(self.places, faces, len(sizes))[faces]
        self.inner_places = self.places + 0.1 * (centres - self.places)
        areas = read(mesh.polygons, 'area', np.float32)
        self.face_width = float(np.sqrt(areas.mean())) if len(areas) else 0.0


def _are_best(candidates: np.ndarray, targets: np.ndarray, before: _Corners, after: _Corners
              ) -> np.ndarray:
    """Returns for each pair of a candidate (evaluated corner) and a target (original corner)
    whether the pair is the best one of its target, (k,) bool. The result is also True if the
    candidate lies in the place of the best one, like the corners of the two triangles of a quad."""
    cosines = np.einsum('ij,ij->i', after.normals[candidates], before.normals[targets])
    turn = np.searchsorted((-_SAME_WAY, 0.0), -cosines)  # 0: the same way, 1: sideways, 2: away
    distances = np.linalg.norm(after.places[candidates] - before.places[targets], axis=1)
    # Distances that only differ by rounding count as equal.
    rounding = 1e-4 * before.face_width or 1.0
    order = np.lexsort((candidates, np.round(distances / rounding), turn, targets))
    groups, first = np.unique(targets[order], return_index=True)
    best = order[first][np.searchsorted(groups, targets)]
    apart = after.places[candidates] - after.places[candidates[best]]
    return (turn == turn[best]) & (np.linalg.norm(apart, axis=1) <= rounding)


def _nearest_corners(before: _Corners, after: _Corners, corners: np.ndarray) -> np.ndarray:
    """Returns for each of the given original corners the evaluated corner with the nearest position
    and normal, (k,). A distance equal to the mean width of a face has the same weight as normals
    that differ by 60 degrees."""
    width = before.face_width
    tree = KDTree(len(after.places))
    for index, point in enumerate((after.inner_places + width * after.normals).tolist()):
        tree.insert(point, index)
    tree.balance()
    wanted = (before.inner_places + width * before.normals)[corners]
    return np.array([tree.find(point)[1] for point in wanted.tolist()], np.int64)


def _remove_codes(mesh: bpy.types.Mesh) -> None:
    for name in (VERTEX_CODE, CORNER_CODE):
        attribute = mesh.attributes.get(name)
        if attribute is not None:
            mesh.attributes.remove(attribute)
