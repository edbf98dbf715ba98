# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads Blender images as linear RGB pixels."""

from __future__ import annotations

import bpy
import numpy as np

# Limit of the pixels along a side. Larger images are reduced by averaging, because patches are
# larger than their pixels, and the native library copies the images.
MAX_SIZE = 2048


class ImagePixels:
    """The pixels of images. Each image is read once."""

    def __init__(self) -> None:
        self._pixels: dict[str, np.ndarray | None] = {}

    def read(self, image: bpy.types.Image) -> np.ndarray | None:
        """Returns the pixels of an image, (height, width, 3) float32, linear RGB, bottom row first.
        Returns None if the image has no pixels, for example because its file is missing."""
        if image.name_full not in self._pixels:
            self._pixels[image.name_full] = _read(image)
        return self._pixels[image.name_full]


def srgb_to_linear(values: np.ndarray) -> np.ndarray:
    """Converts sRGB values from 0 to 1 (IEC 61966-2-1) of any shape to linear values, float32."""
    return np.where(values <= 0.04045, values / 12.92,
                    ((np.maximum(values, 0.04045) + 0.055) / 1.055) ** 2.4).astype(np.float32)


_LINEAR_OF_BYTE = srgb_to_linear(np.arange(256) / 255.0)


def sphere_mean(pixels: np.ndarray) -> np.ndarray:
    """Returns the mean of an equirectangular image (height, width, 3) over the sphere, (3,). Rows
    near the poles have a small weight because they cover little of the sphere."""
    height = len(pixels)
    weights = np.sin((np.arange(height) + 0.5) * np.pi / height)
    return np.average(pixels.mean(axis=1), axis=0, weights=weights)


def _read(image: bpy.types.Image) -> np.ndarray | None:
    width, height = image.size
    channels = image.channels
    # If the file is missing, the sizes are 0.
    if width == 0 or height == 0 or channels == 0 or not image.has_data and not len(image.pixels):
        return None
    values = np.empty(width * height * channels, np.float32)
    image.pixels.foreach_get(values)
    pixels = values.reshape(height, width, channels)
    pixels = pixels[:, :, :3] if channels >= 3 else np.repeat(pixels[:, :, :1], 3, axis=2)
    # Blender returns the pixels of byte images as they are stored, but converts those of float
    # images to linear values.
    if not image.is_float and 'sRGB' in image.colorspace_settings.name:
        pixels = _LINEAR_OF_BYTE[(255.0 * pixels + 0.5).astype(np.uint8)]
    return np.ascontiguousarray(_reduced(pixels))


def _reduced(pixels: np.ndarray) -> np.ndarray:
    factor = -(-max(pixels.shape[:2]) // MAX_SIZE)
    if factor <= 1:
        return pixels
    height, width = (max(size // factor, 1) for size in pixels.shape[:2])
    rows, columns = min(factor, pixels.shape[0]), min(factor, pixels.shape[1])
    cropped = pixels[:height * rows, :width * columns]
    return cropped.reshape(height, rows, width, columns, 3).mean(axis=(1, 3))
