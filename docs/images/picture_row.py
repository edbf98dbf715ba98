# SPDX-License-Identifier: GPL-3.0-or-later
"""Joins pictures of equal size to one picture, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np

GAP = 4  # pixels of white between two pictures


def _pixels(path: Path) -> np.ndarray:
    """Returns (height, width, 4), bottom row first."""
    image = bpy.data.images.load(str(path))
    width, height = image.size
    values = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(height, width, 4)


def save_row(pictures: Sequence[Path], out: Path) -> None:
    """Writes the joined picture as PNG."""
    parts = []
    for picture in pictures:
        values = _pixels(picture)
        parts += [values, np.ones((values.shape[0], GAP, 4), np.float32)]
    row = np.concatenate(parts[:-1], axis=1)
    image = bpy.data.images.new("Row", row.shape[1], row.shape[0])
    image.pixels.foreach_set(np.ascontiguousarray(row).ravel())
    image.filepath_raw, image.file_format = str(out), 'PNG'
    image.save()
