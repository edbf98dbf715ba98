# SPDX-License-Identifier: GPL-3.0-or-later
"""One side of a surface: how its shader, or sum of shaders, interacts with light."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from .color_expression import ColorExpression
from .diffuse_angles import TERMS, oren_nayar
from .layers import Layer
from .scattering import OREN_NAYAR, Scattering


@dataclass(frozen=True)
class Surface:
    """The light that one side of a surface reflects, emits and transmits. Colours are linear
    RGB."""

    # Share of uniform light from all directions that is reflected, 0 to 1, including gloss.
    reflectance: ColorExpression = field(default_factory=ColorExpression)
    radiance: ColorExpression = field(default_factory=ColorExpression)  # emitted, W/(m^2 sr)
    # (3,), share of the light that passes straight through, 0 to 1.
    transmittance: np.ndarray = field(default_factory=lambda: np.zeros(3))
    # The diffuse part of the reflectance, as a view from straight above shows it.
    diffuse: ColorExpression = field(default_factory=ColorExpression)
    # (TERMS, 3): dependence of the reflectance on the angle of the light (diffuse_angles.py).
    reflected_by_angle: np.ndarray = field(default_factory=lambda: np.zeros((TERMS, 3)))
    # (1 + TERMS, 3): share of light that a view from straight above shows, as a constant for light
    # from straight above and weights for the angle of the light. Computed for the mean diffuse
    # colour.
    shown_by_angle: np.ndarray = field(default_factory=lambda: np.zeros((1 + TERMS, 3)))
    # Share of the light on the other side that leaves this side diffusely, 0 to 1.
    translucence: ColorExpression = field(default_factory=ColorExpression)
    scattering: Scattering = field(default_factory=Scattering)  # directions of the reflected light

    @staticmethod
    def matt(color: ColorExpression, roughness: float = 0.0) -> Surface:
        """Returns a diffuse surface: Lambert's, or Oren and Nayar's if roughness (0 to 1) is not
        0."""
        mean = np.maximum(color.mean(), 0.0)
        angles = oren_nayar(roughness, mean)
        return Surface(color.scaled(angles.albedo), diffuse=color,
                       reflected_by_angle=mean * angles.reflected,
                       shown_by_angle=mean * angles.shown,
                       scattering=Scattering.matt(mean, OREN_NAYAR, roughness))

    @property
    def emission(self) -> np.ndarray:
        """Returns the mean emitted radiance, (3,) W/(m^2 sr)."""
        return self.radiance.mean()

    def covered(self, layer: Layer, color: np.ndarray) -> Surface:
        """Returns this surface with a layer on top. color: (3,) linear RGB, multiplies the layer's
        albedo."""
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
        """Returns this surface with its parts scaled down in channels whose mean reflectance is
        above 1. The native library clamps the reflectance, and its parts must not exceed it."""
        whole = self.reflectance.mean()
        if not np.any(whole > 1.0):
            return self
        share = 1.0 / np.maximum(whole, 1.0)
        return replace(self, reflected_by_angle=self.reflected_by_angle * share,
                       scattering=self.scattering.limited(share))

    def scaled(self, factor: float) -> Surface:
        """Returns the surface as a part of a mix: all its shares and its radiance times the
        factor."""
        return Surface(self.reflectance.scaled(factor), self.radiance.scaled(factor),
                       self.transmittance * factor, self.diffuse.scaled(factor),
                       self.reflected_by_angle * factor, self.shown_by_angle * factor,
                       self.translucence.scaled(factor), self.scattering.scaled(factor))
