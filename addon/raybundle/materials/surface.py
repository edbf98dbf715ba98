# SPDX-License-Identifier: GPL-3.0-or-later
"""What a shader, or a sum of shaders, is to diffuse light, seen from one side."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from .color_expression import ColorExpression
from .diffuse_angles import TERMS, oren_nayar
from .layers import Layer
from .scattering import OREN_NAYAR, Scattering


@dataclass(frozen=True)
class Surface:
    """What a shader is to diffuse light, seen from one side."""

    reflectance: ColorExpression = field(default_factory=ColorExpression)
    radiance: ColorExpression = field(default_factory=ColorExpression)
    transmittance: np.ndarray = field(default_factory=lambda: np.zeros(3))  # (3,) straight through
    # What of the reflectance is a diffuse colour.
    diffuse: ColorExpression = field(default_factory=ColorExpression)
    # (TERMS, 3): how the reflectance depends on the light's angle (diffuse_angles.py).
    reflected_by_angle: np.ndarray = field(default_factory=lambda: np.zeros((TERMS, 3)))
    # (1 + TERMS, 3): what is seen of light by its angle, times the mean of the diffuse colour.
    shown_by_angle: np.ndarray = field(default_factory=lambda: np.zeros((1 + TERMS, 3)))
    # What leaves it, diffusely, of the light on the other side.
    translucence: ColorExpression = field(default_factory=ColorExpression)
    scattering: Scattering = field(default_factory=Scattering)

    @staticmethod
    def matt(color: ColorExpression, roughness: float = 0.0) -> Surface:
        mean = np.maximum(color.mean(), 0.0)
        angles = oren_nayar(roughness, mean)
        return Surface(color.scaled(angles.albedo), diffuse=color,
                       reflected_by_angle=mean * angles.reflected,
                       shown_by_angle=mean * angles.shown,
                       scattering=Scattering.matt(mean, OREN_NAYAR, roughness))

    @property
    def emission(self) -> np.ndarray:
        """(3,), the mean radiance."""
        return self.radiance.mean()

    def covered(self, layer: Layer, color: np.ndarray) -> Surface:
        """Beneath a layer. color: (3,), times the layer's albedo."""
        share = layer.taken(color)
        under, above = 1.0 - share * layer.albedo, 1.0 - share * layer.above
        return Surface(
            self.reflectance.scaled(under).plus(ColorExpression(color * layer.albedo)),
            self.radiance.scaled(under), self.transmittance * under,
            self.diffuse.scaled(above).plus(ColorExpression(color * layer.above)),
            self.reflected_by_angle * under + layer.arriving[:, None] * color,
            self.shown_by_angle * above + layer.shown[:, None] * color,
            self.translucence.scaled(under),
            self.scattering.covered(share, layer).plus(Scattering.clothed(color, layer)))

    def limited(self) -> Surface:
        """With parts that fit a reflectance of 1, where the whole, which the native library clamps,
        is more."""
        whole = self.reflectance.mean()
        if not np.any(whole > 1.0):
            return self
        share = 1.0 / np.maximum(whole, 1.0)
        return replace(self, reflected_by_angle=self.reflected_by_angle * share,
                       scattering=self.scattering.limited(share))

    def scaled(self, factor: float) -> Surface:
        return Surface(self.reflectance.scaled(factor), self.radiance.scaled(factor),
                       self.transmittance * factor, self.diffuse.scaled(factor),
                       self.reflected_by_angle * factor, self.shown_by_angle * factor,
                       self.translucence.scaled(factor), self.scattering.scaled(factor))
