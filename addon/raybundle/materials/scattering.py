# SPDX-License-Identifier: GPL-3.0-or-later
"""Where surfaces that are not Lambert's send the light of the sources.

By the direction it comes from: gloss as GGX mirrors it, cloth (layers.py) and several facets of
gloss by lobes of their own, the diffuse rest as Burley's or Oren and Nayar's model has it
(native/src/surfaces/lobe.h). What differs from Cycles: a surface has one gloss, one lobe of each
kind and one diffuse model, with the means of the roughnesses that it is mixed of.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from .color_expression import ColorExpression
from .diffuse_angles import TERMS
from .layers import LOBES, SEVERAL_FACETS, Layer

LAMBERT, BURLEY, OREN_NAYAR = range(3)  # rb_diffuse_model


@dataclass(frozen=True)
class Scattering:
    """Sums over the shaders of a surface."""

    gloss: ColorExpression = field(default_factory=ColorExpression)  # part of the reflectance
    # (TERMS, 3): of it, by the terms of diffuse_angles.py.
    by_angle: np.ndarray = field(default_factory=lambda: np.zeros((TERMS, 3)))
    rough_gloss: float = 0.0  # means of gloss times roughness, as diffuse light sees it
    # (LOBES, 2, 3): what of the reflectance each lobe sends, and that times the roughness.
    # (LOBES, TERMS, 3): by angle.
    lobes: np.ndarray = field(default_factory=lambda: np.zeros((len(LOBES), 2, 3)))
    lobes_by_angle: np.ndarray = field(default_factory=lambda: np.zeros((len(LOBES), TERMS, 3)))
    # (2, 2, 3): for Burley's model and for Oren and Nayar's, of which Lambert's is one, the mean
    # diffuse colour, and that times the roughness.
    diffuse: np.ndarray = field(default_factory=lambda: np.zeros((2, 2, 3)))
    # (TERMS, 3): that times how it leaves by angle (rb_set_material_leaving).
    leaving: np.ndarray = field(default_factory=lambda: np.zeros((TERMS, 3)))

    @staticmethod
    def mirror(gloss: ColorExpression, by_angle: np.ndarray, roughness: float) -> Scattering:
        return Scattering(gloss, by_angle, roughness * float(gloss.mean().mean()))

    @staticmethod
    def matt(color: np.ndarray, model: int, roughness: float,
             leaving: np.ndarray | float = 0.0) -> Scattering:
        """color: (3,), mean. leaving: (TERMS, 3), for a colour of 1."""
        diffuse = np.zeros((2, 2, 3))
        diffuse[0 if model == BURLEY else 1] = [color, roughness * color]
        return Scattering(diffuse=diffuse, leaving=color * leaving + np.zeros((TERMS, 3)))

    @staticmethod
    def clothed(color: np.ndarray, layer: Layer) -> Scattering:
        """color: (3,), times the layer's albedo."""
        return Scattering._of_lobe(layer.lobe, layer.albedo * color,
                                   layer.arriving[:, None] * color, layer.roughness)

    @staticmethod
    def several_facets(color: np.ndarray, by_angle: np.ndarray, roughness: float) -> Scattering:
        """What they add to gloss. color: (3,); by_angle: (TERMS, 3)."""
        return Scattering._of_lobe(SEVERAL_FACETS, color, by_angle, roughness)

    @staticmethod
    def _of_lobe(lobe: int, color: np.ndarray, by_angle: np.ndarray, roughness: float
                 ) -> Scattering:
        scattering = Scattering()
        scattering.lobes[lobe] = [color, roughness * color]
        scattering.lobes_by_angle[lobe] = by_angle
        return scattering

    def scaled(self, factor: float) -> Scattering:
        return Scattering(self.gloss.scaled(factor), factor * self.by_angle,
                          factor * self.rough_gloss, factor * self.lobes,
                          factor * self.lobes_by_angle, factor * self.diffuse,
                          factor * self.leaving)

    def limited(self, share: np.ndarray) -> Scattering:
        """share: (3,), of what is sent by angle and by lobes; the rest is taken relatively."""
        return replace(self, by_angle=self.by_angle * share, lobes=self.lobes * share,
                       lobes_by_angle=self.lobes_by_angle * share)

    def covered(self, share: float, layer: Layer) -> Scattering:
        """Without what a layer, of so much weight, sends back."""
        under = self.scaled(1.0 - share * layer.albedo)
        return replace(under, leaving=under.leaving
                       - share * layer.by_angle[:, None] * self.diffuse[:, 0].sum(axis=0))

    def plus(self, other: Scattering) -> Scattering:
        return Scattering(self.gloss.plus(other.gloss).simplified(), self.by_angle + other.by_angle,
                          self.rough_gloss + other.rough_gloss, self.lobes + other.lobes,
                          self.lobes_by_angle + other.lobes_by_angle,
                          self.diffuse + other.diffuse, self.leaving + other.leaving)

    def gloss_roughness(self) -> float:
        gloss = float(self.gloss.mean().mean())
        return min(self.rough_gloss / gloss, 1.0) if gloss > 0.0 else 0.0

    def lobe_roughness(self, lobe: int) -> float:
        weight, rough = self.lobes[lobe].mean(axis=1)
        return float(np.clip(rough / max(weight, 1e-6), 0.0, 1.0))

    def diffuse_model(self) -> tuple[int, float]:
        """The heavier one, and its roughness."""
        weights, rough = self.diffuse.mean(axis=2).T
        model = int(weights[1] >= weights[0])
        if weights[model] <= 0.0:
            return LAMBERT, 0.0
        roughness = float(np.clip(rough[model] / weights[model], 0.0, 1.0))
        if model == 0:
            return BURLEY, roughness
        return (OREN_NAYAR, roughness) if roughness > 0.0 else (LAMBERT, 0.0)

    def leaving_factors(self) -> np.ndarray:
        """(TERMS, 3), for rb_set_material_leaving."""
        return self.leaving / np.maximum(self.diffuse[:, 0].sum(axis=0), 1e-6)
