# SPDX-License-Identifier: GPL-3.0-or-later
"""Lays out the faces of a mesh in one image, each with a resolution that depends on its size.

Each face is mapped by an affine map of its plane, so that all triangulations of the face
interpolate the same coordinates. The cells of the faces have powers of two as side lengths and are
packed in rows, the highest and then the widest first, so that no cell crosses the end of a row.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Number of pixels between a face and the edge of its cell. The margin of the bake fills these
# pixels, so that interpolation at the edge of a face does not reach the pixels of another face.
BORDER = 2
_LEAST_PIXELS = 4  # smallest number of pixels along either side of a face
_MOST_PIXELS = 1024  # largest number of pixels along either side of a face
_LARGEST_IMAGE = 4096


@dataclass(frozen=True)
class FaceAtlas:
    """An image with a cell for each face. Sizes are in pixels."""

    width: int
    height: int
    uvs: np.ndarray  # (c, 2) float32, per corner; -1 (outside the image) for faces without a cell


def face_atlas(positions: np.ndarray, face_offsets: np.ndarray, wanted: np.ndarray,
               pixel: float) -> FaceAtlas:
    """Returns a layout of faces.

    positions: (c, 3) m, of the corners. face_offsets: (f + 1,), the first corner of each face, and
    c. wanted: (f,) bool, the faces that get a cell. pixel: size of a pixel on the surface, m; it is
    increased if the image would be larger than 4096 pixels.
    """
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
    """Returns the two axes of each face's plane, (f, 3) each, m.

    The axes are the two edges at the face's first corner, so that triangles and parallelograms fill
    their cells. For n-gons, and if these edges are nearly parallel, the axes are the first edge and
    a vector perpendicular to it.
    """
    first = positions[starts]
    a = positions[starts + 1] - first
    b = positions[starts + sizes - 1] - first
    # Newell's normal, whose length is twice the area.
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
    """Returns the affine coordinates of each corner in the two axes of its face, (c, 2)."""
    a, b = (np.repeat(axis, sizes, axis=0) for axis in _axes(positions, starts, sizes))
    d = positions - np.repeat(positions[starts], sizes, axis=0)
    aa, ab, bb, da, db = (np.einsum('ij,ij->i', x, y)
                          for x, y in ((a, a), (a, b), (b, b), (d, a), (d, b)))
    det = aa * bb - ab * ab
    det = np.where(det > 1e-12 * aa * bb, det, np.inf)
    return np.stack([(bb * da - ab * db) / det, (aa * db - ab * da) / det], axis=1)


def _pack(cells: np.ndarray) -> tuple[np.ndarray, int, int]:
    """Packs cells into an image. cells: (n, 2), sides in pixels, which are powers of two. Returns
    the lower left corners of the cells, (n, 2), and the width and height of the image."""
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
