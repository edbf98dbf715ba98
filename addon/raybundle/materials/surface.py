# SPDX-License-Identifier: GPL-3.0-or-later
"""One side of a surface: what its shader, or sum of shaders, does with light."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from .color_expression import ColorExpression
from .diffuse_angles import TERMS, oren_nayar
from .layers import Layer
from .scattering import OREN_NAYAR, Scattering


@dataclass(frozen=True)
class Surface:
    """What one side of a surface reflects, emits and lets through. Colours are linear RGB."""

    # Share of the light from all directions that is reflected, 0 to 1, gloss included.
    reflectance: ColorExpression = field(default_factory=ColorExpression)
    radiance: ColorExpression = field(default_factory=ColorExpression)  # emitted, W/(m^2 sr)
    # (3,), share of the light that passes straight through, 0 to 1.
    transmittance: np.ndarray = field(default_factory=lambda: np.zeros(3))
    # The diffuse part of the reflectance, as a view from straight above shows it.
    diffuse: ColorExpression = field(default_factory=ColorExpression)
    # (TERMS, 3): how the reflectance depends on the angle of the light (diffuse_angles.py).
    reflected_by_angle: np.ndarray = field(default_factory=lambda: np.zeros((TERMS, 3)))
    # (1 + TERMS, 3): what a view from straight above shows of light from straight above, and how
    # that depends on the angle of the light; for the mean of the diffuse colour.
    shown_by_angle: np.ndarray = field(default_factory=lambda: np.zeros((1 + TERMS, 3)))
    # Share of the light on the other side that leaves this side diffusely, 0 to 1.
    translucence: ColorExpression = field(default_factory=ColorExpression)
    scattering: Scattering = field(default_factory=Scattering)  # where reflected light goes

    @staticmethod
    def matt(color: ColorExpression, roughness: float = 0.0) -> Surface:
        """A diffuse surface: Lambert's, or Oren and Nayar's if roughness (0 to 1) is not 0."""
        mean = np.maximum(color.mean(), 0.0)
        angles = oren_nayar(roughness, mean)
        return Surface(color.scaled(angles.albedo), diffuse=color,
                       reflected_by_angle=mean * angles.reflected,
                       shown_by_angle=mean * angles.shown,
                       scattering=Scattering.matt(mean, OREN_NAYAR, roughness))

    @property
    def emission(self) -> np.ndarray:
        """(3,) W/(m^2 sr), the mean of the emitted radiance."""
        return self.radiance.mean()

    def covered(self, layer: Layer, color: np.ndarray) -> Surface:
        """This surface with a layer on top. color: (3,) linear RGB, by which the layer's albedo is
        multiplied."""
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
        """The same surface, with its parts scaled down in channels where the mean reflectance is
        above 1: the native library clamps the reflectance, and its parts must not exceed it."""
        whole = self.reflectance.mean()
        if not np.any(whole > 1.0):
            return self
        share = 1.0 / np.maximum(whole, 1.0)
        return replace(self, reflected_by_angle=self.reflected_by_angle * share,
                       scattering=self.scattering.limited(share))

    def scaled(self, factor: float) -> Surface:
        """The surface as a part of a mix: all its shares and its radiance times the factor."""
        return Surface(self.reflectance.scaled(factor), self.radiance.scaled(factor),
                       self.transmittance * factor, self.diffuse.scaled(factor),
                       self.reflected_by_angle * factor, self.shown_by_angle * factor,
                       self.translucence.scaled(factor), self.scattering.scaled(factor))
