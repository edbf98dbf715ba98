# SPDX-License-Identifier: GPL-3.0-or-later
"""The properties of one side of a material as the native library receives them, without bpy.

The members have the names, units and ranges of those of rb_surface and its parts in
native/include/raybundle/raybundle.h; native.py copies them by name. Colours are (3,), linear RGB.
Factors by angle are (4, 3), weights of the terms of materials/diffuse_angles.py.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

CORRELATED, SEPARATE = range(2)  # rb_masking


def _black() -> np.ndarray:
    return np.zeros(3)


def _white() -> np.ndarray:
    return np.ones(3)


def _at_all_angles() -> np.ndarray:
    return np.zeros((4, 3))


@dataclass(frozen=True)
class ColorData:
    """rb_color: the colour constant + image_weight * image + corner_color_weight * corner
    colours."""

    constant: np.ndarray = field(default_factory=_black)
    image: int | None = None  # position in SceneData.images
    image_weight: np.ndarray = field(default_factory=_black)
    corner_color_weight: np.ndarray = field(default_factory=_black)

    def may_be_positive(self) -> bool:
        """Returns whether a channel is positive for some colour of the image and of the corners."""
        weights = (self.constant, self.image_weight, self.corner_color_weight)
        return any(np.any(weight > 0.0) for weight in weights)


@dataclass(frozen=True)
class PartData:
    """rb_part: the colour scale * reflectance + offset."""

    scale: np.ndarray = field(default_factory=_black)
    offset: np.ndarray = field(default_factory=_black)


@dataclass(frozen=True)
class ShownData:
    """rb_shown: the light that outputs show."""

    color: PartData = field(default_factory=lambda: PartData(_white()))
    from_above: np.ndarray = field(default_factory=_white)
    by_angle: np.ndarray = field(default_factory=_at_all_angles)


@dataclass(frozen=True)
class GlossData:
    """rb_gloss: the part of the reflectance that is mirrored."""

    part: PartData = field(default_factory=PartData)
    by_angle: np.ndarray = field(default_factory=_at_all_angles)
    roughness: float = 0.0
    masking: int = CORRELATED


@dataclass(frozen=True)
class LobeData:
    """rb_lobe: a part of the reflectance with its own lobe."""

    reflectance: np.ndarray = field(default_factory=_black)
    by_angle: np.ndarray = field(default_factory=_at_all_angles)
    roughness: float = 0.0


@dataclass(frozen=True)
class DiffuseData:
    """rb_diffuse: the directions of the diffuse part of the reflected light."""

    model: int = 0  # one of the models of materials/scattering.py
    roughness: float = 0.0
    leaving: np.ndarray = field(default_factory=_at_all_angles)


@dataclass(frozen=True)
class SurfaceData:
    """rb_surface: one side of a material."""

    reflectance: ColorData
    emission: ColorData = field(default_factory=ColorData)  # W/m^2
    translucence: ColorData = field(default_factory=ColorData)
    reflectance_by_angle: np.ndarray = field(default_factory=_at_all_angles)
    shown: ShownData = field(default_factory=ShownData)
    gloss: GlossData = field(default_factory=GlossData)
    microfibers: LobeData = field(default_factory=LobeData)
    velvet: LobeData = field(default_factory=LobeData)
    burley_sheen: LobeData = field(default_factory=LobeData)
    several_facets: LobeData = field(default_factory=LobeData)
    diffuse: DiffuseData = field(default_factory=DiffuseData)
