# SPDX-License-Identifier: GPL-3.0-or-later
"""The error of baked light relative to a reference, and where on a mesh a comparison is meaningful.

Values are RGB per corner. Each corner is weighted by its share of the area of its face.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils.bvhtree import BVHTree

# Surfaces touch if they are nearer than this share of the longest edge at a vertex. Coordinates of
# touching objects differ by rounding, 1e-7 of the scene. Gaps that let light through are wider.
TOUCHING = 1e-3

# Share of the longest edge within which contacts are searched for. A vertex at exactly the length
# of an edge from a contact thus counts as off the contact, whatever its rounding.
REACH = 0.999

# Faces at an edge of a room's corner have a smaller cosine between their normals than this.
FLAT_COSINE = 0.999


@dataclass(frozen=True)
class SurfaceError:
    """Errors weighted by area, relative to the reference's RMS over RGB; the bias to its mean."""

    rmse: float
    bias: float  # mean / mean of the reference - 1
    maximum: float
    percentile_99: float
    corners: int

    def __str__(self) -> str:
        return (f"rmse {100 * self.rmse:.2f} %, bias {100 * self.bias:+.2f} %, "
                f"p99 {100 * self.percentile_99:.2f} %, max {100 * self.maximum:.2f} %, "
                f"{self.corners} corners")


def surface_error(values: np.ndarray, reference: np.ndarray, weights: np.ndarray) -> SurfaceError:
    """Returns the error of values.

    values, reference: (n, 3). weights: (n,) areas, 0 where values are not compared. Raises
    ValueError if all weights are 0.
    """
    used = weights > 0.0
    if not used.any():
        raise ValueError("there is nothing to compare")
    values, reference = (array[used].astype(float) for array in (values, reference))
    weights = weights[used].astype(float)
    weights /= weights.sum()
    difference = np.sqrt(((values - reference) ** 2).mean(axis=1))
    scale = np.sqrt(weights @ (reference ** 2).mean(axis=1))
    order = np.argsort(difference)
    rank = np.searchsorted(np.cumsum(weights[order]), 0.99)
    return SurfaceError(
        rmse=float(np.sqrt(weights @ difference ** 2) / scale),
        bias=float(weights @ values.mean(axis=1) / (weights @ reference.mean(axis=1)) - 1.0),
        maximum=float(difference.max() / scale),
        percentile_99=float(difference[order[min(rank, len(order) - 1)]] / scale),
        corners=len(values))


def read_colors(item: bpy.types.Object, attribute: str = "Radiosity") -> np.ndarray:
    """Returns (corners, 3) RGB of a colour attribute on face corners."""
    data = item.data.color_attributes[attribute].data
    colors = np.empty(4 * len(data), np.float32)
    data.foreach_get('color', colors)
    return colors.reshape(-1, 4)[:, :3].copy()


# --------------------------------------------------------------------------------------------------
# Geometry
# --------------------------------------------------------------------------------------------------


def corner_vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    """Returns (corners,) the index of each corner's vertex."""
    indices = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get('vertex_index', indices)
    return indices


def face_sizes(mesh: bpy.types.Mesh) -> np.ndarray:
    """Returns (faces,) the number of corners of each face."""
    sizes = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get('loop_total', sizes)
    return sizes


def world_positions(item: bpy.types.Object) -> np.ndarray:
    """Returns (vertices, 3) positions in the world, m."""
    positions = np.empty(3 * len(item.data.vertices), np.float32)
    item.data.vertices.foreach_get('co', positions)
    matrix = np.array(item.matrix_world)
    return positions.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def corner_areas(item: bpy.types.Object) -> np.ndarray:
    """Returns (corners,) each corner's share of the area of its face, in the world, m^2."""
    vectors = _face_area_vectors(item)
    sizes = face_sizes(item.data)
    return np.repeat(np.linalg.norm(vectors, axis=1) / sizes, sizes)


def face_means(item: bpy.types.Object, values: np.ndarray) -> np.ndarray:
    """Returns (faces, 3) the mean of the corners of each face."""
    sizes = face_sizes(item.data)
    starts = np.cumsum(sizes) - sizes
    return np.add.reduceat(values.astype(float), starts, axis=0) / sizes[:, None]


def is_defined(item: bpy.types.Object, reference: np.ndarray) -> np.ndarray:
    """Returns (corners,) whether Cycles has a value.

    On faces that reflect nothing its values are 0 at all corners.
    """
    lit = face_means(item, reference).any(axis=1)
    return np.repeat(lit, face_sizes(item.data))


def off_contact_edges(items: Sequence[bpy.types.Object]) -> dict[str, np.ndarray]:
    """Returns (corners,) masks by object name: whether a corner's vertex is off all contact edges.

    At a contact edge the point sample of Cycles is arbitrary, because it may be on either side of
    the contact. A vertex is off contact edges if two conditions hold:

    - No other surface (another object, or another loose part of its own mesh) touches its own
      surface within the longest edge at the vertex. A nearer contact crosses a face at the vertex.
      The light on this face jumps where the mesh has no edge, as on a floor beside a box that does
      not fit the floor's grid. The neighbours of a vertex on a room's edge, one edge away, are off
      this contact. A surface that is near but does not touch, such as a lamp below a ceiling, is no
      contact.
    - No concave edge of its own mesh ends at the vertex.
    """
    parts = [part for item in items for part in _loose_parts(item)]
    result = {}
    for item in items:
        off = ~_on_concave_edge(item)
        for part in parts:
            if part.item == item:
                off[part.vertices] &= ~_near_contact(part, parts)
        result[item.name] = off[corner_vertices(item.data)]
    return result


@dataclass(frozen=True)
class _Part:
    """A connected piece of a mesh."""

    item: bpy.types.Object
    vertices: np.ndarray  # indices in the mesh
    positions: np.ndarray
    longest_edges: np.ndarray  # per vertex
    tree: BVHTree


def _near_contact(part: _Part, parts: Sequence[_Part]) -> np.ndarray:
    near = np.zeros(len(part.vertices), bool)
    bounds = [(other, other.positions.min(axis=0), other.positions.max(axis=0))
              for other in parts if other is not part]
    for index, point in enumerate(part.positions):
        edge = part.longest_edges[index]
        for other, low, high in bounds:
            if (point < low - edge).any() or (point > high + edge).any():
                continue
            found = other.tree.find_nearest(point.tolist(), REACH * edge)[0]
            if found is not None and part.tree.find_nearest(found, TOUCHING * edge)[0] is not None:
                near[index] = True
                break
    return near


def _loose_parts(item: bpy.types.Object) -> list[_Part]:
    mesh = item.data
    positions = world_positions(item)
    edges = _edge_vertices(mesh)
    lengths = np.linalg.norm(positions[edges[:, 0]] - positions[edges[:, 1]], axis=1)
    longest = np.zeros(len(positions))
    for end in (0, 1):
        np.maximum.at(longest, edges[:, end], lengths)
    labels = np.arange(len(positions))
    while True:
        lowest = labels.copy()
        for end in (0, 1):
            np.minimum.at(lowest, edges[:, end], labels[edges[:, 1 - end]])
        # Labels are indices of vertices. Following them reduces the number of rounds.
        lowest = lowest[lowest]
        if (lowest == labels).all():
            break
        labels = lowest
    faces = [list(polygon.vertices) for polygon in mesh.polygons]
    parts = []
    for label in np.unique(labels[corner_vertices(mesh)]):
        vertices = np.flatnonzero(labels == label)
        own = {vertex: index for index, vertex in enumerate(vertices.tolist())}
        polygons = [[own[vertex] for vertex in face] for face in faces if face[0] in own]
        tree = BVHTree.FromPolygons(positions[vertices].tolist(), polygons)
        parts.append(_Part(item, vertices, positions[vertices], longest[vertices], tree))
    return parts


def _on_concave_edge(item: bpy.types.Object) -> np.ndarray:
    """Returns (vertices,) whether two faces at one of the vertex's edges face each other."""
    mesh = item.data
    positions = world_positions(item)
    sizes = face_sizes(mesh)
    faces = np.repeat(np.arange(len(sizes)), sizes)
    normals = _face_area_vectors(item)
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-30)[:, None]
    centres = face_means(item, positions[corner_vertices(mesh)])
    corner_edges = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get('edge_index', corner_edges)
    order = np.argsort(corner_edges, kind='stable')
    same = corner_edges[order[1:]] == corner_edges[order[:-1]]
    first, second = faces[order[:-1][same]], faces[order[1:][same]]
    bent = (normals[first] * normals[second]).sum(axis=1) < FLAT_COSINE
    # The centre of the neighbour is above the plane of the face.
    above = (normals[first] * (centres[second] - centres[first])).sum(axis=1) > 0.0
    concave = np.zeros(len(positions), bool)
    concave[_edge_vertices(mesh)[corner_edges[order[:-1][same]][bent & above]]] = True
    return concave


def _edge_vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    edges = np.empty(2 * len(mesh.edges), np.int32)
    mesh.edges.foreach_get('vertices', edges)
    return edges.reshape(-1, 2)


def _face_area_vectors(item: bpy.types.Object) -> np.ndarray:
    """Returns (faces, 3) normals times areas, m^2."""
    positions = world_positions(item)[corner_vertices(item.data)]
    sizes = face_sizes(item.data)
    ends = np.cumsum(sizes)
    following = np.arange(1, len(positions) + 1)
    following[ends - 1] = ends - sizes
    first = np.repeat(positions[ends - sizes], sizes, axis=0)
    crosses = np.cross(positions - first, positions[following] - first)
    return 0.5 * np.add.reduceat(crosses, ends - sizes, axis=0)
