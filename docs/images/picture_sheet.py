# SPDX-License-Identifier: GPL-3.0-or-later
"""Joins pictures of equal size to a sheet of rows and columns."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np

GAP = 4  # pixels of white between two pictures


def _pixels(path: Path) -> np.ndarray:
    """Returns the pixels of an image file, (height, width, 4) float32 RGBA as stored, bottom row
    first."""
    image = bpy.data.images.load(str(path))
    values = np.empty(4 * image.size[0] * image.size[1], np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], 4)


def save(pictures: Sequence[Path], columns: int, path: Path) -> None:
    """Writes the pictures, row by row from the top, as JPEG if the name of `path` says so, else as
    PNG."""
    tiles = [_pixels(picture) for picture in pictures]
    height, width = tiles[0].shape[:2]
    rows = -(-len(tiles) // columns)
    sheet = np.ones((rows * (height + GAP) - GAP, columns * (width + GAP) - GAP, 4), np.float32)
    for k, tile in enumerate(tiles):
        row, column = rows - 1 - k // columns, k % columns
        y, x = row * (height + GAP), column * (width + GAP)
        sheet[y:y + height, x:x + width, :3] = tile[:, :, :3]
    image = bpy.data.images.new("sheet", sheet.shape[1], sheet.shape[0])
    image.pixels.foreach_set(sheet.ravel())
    image.filepath_raw = str(path)
    image.file_format = 'JPEG' if path.suffix == ".jpg" else 'PNG'
    image.save()
