# SPDX-License-Identifier: GPL-3.0-or-later
"""A place in one image for each face of a mesh, of a resolution that follows the face's size.

Each face is mapped by an affine map of its plane, so that whoever cuts it into triangles
interpolates the same coordinates. Cells have sides of powers of two and are packed in rows, the
highest and widest first: then none crosses the end of a row.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Pixels between the edge of a cell and its face: filled by the bake's margin, so that looking up
# between pixels at the edge of a face meets no other face.
BORDER = 2
_LEAST_PIXELS = 4  # along the shorter side of a face
_MOST_PIXELS = 1024
_LARGEST_IMAGE = 4096


@dataclass(frozen=True)
class FaceAtlas:
    width: int
    height: int
    uvs: np.ndarray  # (c, 2) float32; outside the image for faces that have no place


def face_atlas(positions: np.ndarray, face_offsets: np.ndarray, wanted: np.ndarray,
               pixel: float) -> FaceAtlas:
    """positions: (c, 3) of the corners, m; wanted: (f,) bool; pixel: m."""
    starts, sizes = face_offsets[:-1], np.diff(face_offsets)
    faces = np.flatnonzero(wanted)
    faces_of_corners = np.repeat(np.arange(len(starts)), sizes)
    plane = _plane_coordinates(positions.astype(np.float64), starts, sizes)
    low = np.minimum.reduceat(plane, starts)[faces]
    extent = np.maximum(np.maximum.reduceat(plane, starts)[faces] - low, 1e-12)
    lengths = _axis_lengths(positions.astype(np.float64), starts, sizes)[faces] * extent
    while True:
        inner = np.clip(np.ceil(lengths / pixel), _LEAST_PIXELS, _MOST_PIXELS).astype(np.int64)
        cells = 2 ** np.ceil(np.log2(inner + 2 * BORDER)).astype(np.int64)
        origin, width, height = _pack(cells)
        if max(width, height) <= _LARGEST_IMAGE or pixel > lengths.max():
            break
        pixel *= 1.5
    place = np.full((len(starts), 6), np.nan)
    place[faces] = np.hstack([origin + BORDER, inner / extent, low])
    at = place[faces_of_corners]
    uvs = (at[:, :2] + at[:, 2:4] * (plane - at[:, 4:])) / [width, height]
    return FaceAtlas(width, height, np.nan_to_num(uvs, nan=-1.0).astype(np.float32))


def _axes(positions: np.ndarray, starts: np.ndarray, sizes: np.ndarray
          ) -> tuple[np.ndarray, np.ndarray]:
    """(f, 3) each: the edges at the first corner, which fill the cells of triangles and
    parallelograms; of faces whose edges there are parallel or that are n-gons, the first edge and
    one across it."""
    first = positions[starts]
    a = positions[starts + 1] - first
    b = positions[starts + sizes - 1] - first
    # Newell's normal: twice the area.
    nexts = np.arange(len(positions)) + 1
    nexts[starts + sizes - 1] = starts
    normal = np.add.reduceat(np.cross(positions, positions[nexts]), starts)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.where(length > 0.0, normal / np.maximum(length, 1e-30), [0.0, 0.0, 1.0])
    across = np.cross(normal, a)
    turn = np.abs(np.einsum('ij,ij->i', np.cross(a, b), normal))
    slanted = turn < 0.2 * np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
    use_across = (slanted | (sizes > 4)) & (sizes > 3)
    return a, np.where(use_across[:, None], across, b)


def _axis_lengths(positions: np.ndarray, starts: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    return np.stack([np.linalg.norm(axis, axis=1) for axis in _axes(positions, starts, sizes)],
                    axis=1)


def _plane_coordinates(positions: np.ndarray, starts: np.ndarray, sizes: np.ndarray
                       ) -> np.ndarray:
    """(c, 2), each corner in the affine coordinates of its face's axes."""
    a, b = (np.repeat(axis, sizes, axis=0) for axis in _axes(positions, starts, sizes))
    d = positions - np.repeat(positions[starts], sizes, axis=0)
    aa, ab, bb, da, db = (np.einsum('ij,ij->i', x, y)
                          for x, y in ((a, a), (a, b), (b, b), (d, a), (d, b)))
    det = aa * bb - ab * ab
    det = np.where(det > 1e-12 * aa * bb, det, np.inf)
    return np.stack([(bb * da - ab * db) / det, (aa * db - ab * da) / det], axis=1)


def _pack(cells: np.ndarray) -> tuple[np.ndarray, int, int]:
    """(n, 2) lower corners of cells with sides of powers of two, and the size of the image."""
    area = float(np.prod(cells, axis=1).sum())
    width = int(max(cells[:, 0].max(), 2 ** np.ceil(0.5 * np.log2(area))))
    order = np.lexsort((-cells[:, 0], -cells[:, 1]))
    origin = np.empty((len(cells), 2), np.int64)
    bottom = 0
    for size in np.unique(cells[:, 1])[::-1]:
        of_size = order[cells[order, 1] == size]
        ends = np.cumsum(cells[of_size, 0])
        begins = ends - cells[of_size, 0]
        origin[of_size, 0] = begins % width
        origin[of_size, 1] = bottom + size * (begins // width)
        bottom += size * int(-(-ends[-1] // width))
    return origin, width, int(bottom)
