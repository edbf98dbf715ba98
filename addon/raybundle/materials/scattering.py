# SPDX-License-Identifier: GPL-3.0-or-later
"""The directions in which a surface that is not Lambert's reflects light, by the direction of the
light.

Gloss is mirrored by GGX microfacets. Cloth (layers.py), and light that several facets reflect in
turn, have lobes of their own. The diffuse rest follows the model of Burley or of Oren and Nayar
(native/src/surfaces/lobe.h). Differs from Cycles: a surface has one gloss, one lobe of each kind
and one diffuse model. If a material mixes several of one kind, the mean of their roughnesses is
used.
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
    """The parts of a side's reflectance by the way they are reflected, summed over the side's
    shaders.

    Roughnesses are stored as sums of part times roughness, so that their means can be computed.
    """

    gloss: ColorExpression = field(default_factory=ColorExpression)  # the mirrored part
    # (TERMS, 3): dependence of the mirrored part on the angle of the light (diffuse_angles.py).
    by_angle: np.ndarray = field(default_factory=lambda: np.zeros((TERMS, 3)))
    rough_gloss: float = 0.0  # sum of mirrored part (mean of channels) times roughness
    # (LOBES, 2, 3): the part that each lobe reflects, and the sum of part times roughness.
    lobes: np.ndarray = field(default_factory=lambda: np.zeros((len(LOBES), 2, 3)))
    # (LOBES, TERMS, 3): dependence of each lobe's part on the angle of the light.
    lobes_by_angle: np.ndarray = field(default_factory=lambda: np.zeros((len(LOBES), TERMS, 3)))
    # (2, 2, 3): for Burley's model, and for that of Oren and Nayar (Lambert's surface is the case
    # of roughness 0): the mean diffuse colour, and the sum of colour times roughness.
    diffuse: np.ndarray = field(default_factory=lambda: np.zeros((2, 2, 3)))
    # (TERMS, 3): diffuse colour times the dependence of the light that the layers above transmit on
    # the angle.
    leaving: np.ndarray = field(default_factory=lambda: np.zeros((TERMS, 3)))

    @staticmethod
    def mirror(gloss: ColorExpression, by_angle: np.ndarray, roughness: float) -> Scattering:
        """Returns gloss without other parts. by_angle: (TERMS, 3). roughness: 0 to 1, applies to
        diffuse light."""
        return Scattering(gloss, by_angle, roughness * float(gloss.mean().mean()))

    @staticmethod
    def matt(color: np.ndarray, model: int, roughness: float,
             leaving: np.ndarray | float = 0.0) -> Scattering:
        """Returns a diffuse part without other parts. color: (3,), its mean. model: BURLEY or
        OREN_NAYAR. roughness: 0 to 1. leaving: (TERMS, 3), dependence of the leaving light on the
        angle, for a colour of 1."""
        diffuse = np.zeros((2, 2, 3))
        diffuse[0 if model == BURLEY else 1] = [color, roughness * color]
        return Scattering(diffuse=diffuse, leaving=color * leaving + np.zeros((TERMS, 3)))

    @staticmethod
    def clothed(color: np.ndarray, layer: Layer) -> Scattering:
        """Returns a layer of cloth without other parts. color: (3,), multiplies the layer's
        albedo."""
        return Scattering._of_lobe(layer.lobe, layer.albedo * color,
                                   layer.arriving[:, None] * color, layer.roughness)

    @staticmethod
    def several_facets(color: np.ndarray, by_angle: np.ndarray, roughness: float) -> Scattering:
        """Returns the light that several facets of gloss reflect in turn. color: (3,), part of the
        reflectance. by_angle: (TERMS, 3), dependence on the angle. roughness: 0 to 1."""
        return Scattering._of_lobe(SEVERAL_FACETS, color, by_angle, roughness)

    @staticmethod
    def _of_lobe(lobe: int, color: np.ndarray, by_angle: np.ndarray, roughness: float
                 ) -> Scattering:
        scattering = Scattering()
        scattering.lobes[lobe] = [color, roughness * color]
        scattering.lobes_by_angle[lobe] = by_angle
        return scattering

    def scaled(self, factor: float) -> Scattering:
        """Returns all parts times a factor, as in a mix of shaders."""
        return Scattering(self.gloss.scaled(factor), factor * self.by_angle,
                          factor * self.rough_gloss, factor * self.lobes,
                          factor * self.lobes_by_angle, factor * self.diffuse,
                          factor * self.leaving)

    def limited(self, share: np.ndarray) -> Scattering:
        """Returns this scattering with the absolute parts (lobes and the dependences on the angle)
        multiplied by share, (3,). Gloss and the diffuse colour are only used relative to the
        reflectance and do not change."""
        return replace(self, by_angle=self.by_angle * share, lobes=self.lobes * share,
                       lobes_by_angle=self.lobes_by_angle * share)

    def covered(self, share: float, layer: Layer) -> Scattering:
        """Returns this scattering under a layer, which removes `share` times its albedo of the
        light."""
        under = self.scaled(1.0 - share * layer.albedo)
        return replace(under, leaving=under.leaving
                       - share * layer.by_angle[:, None] * self.diffuse[:, 0].sum(axis=0))

    def plus(self, other: Scattering) -> Scattering:
        """Returns the scattering of the sum of two shaders."""
        return Scattering(self.gloss.plus(other.gloss).simplified(), self.by_angle + other.by_angle,
                          self.rough_gloss + other.rough_gloss, self.lobes + other.lobes,
                          self.lobes_by_angle + other.lobes_by_angle,
                          self.diffuse + other.diffuse, self.leaving + other.leaving)

    def gloss_roughness(self) -> float:
        """Returns the mean roughness over the gloss, 0 to 1."""
        gloss = float(self.gloss.mean().mean())
        return min(self.rough_gloss / gloss, 1.0) if gloss > 0.0 else 0.0

    def lobe_roughness(self, lobe: int) -> float:
        """Returns the mean roughness over the light that a lobe reflects, 0 to 1. lobe: one of
        LOBES."""
        weight, rough = self.lobes[lobe].mean(axis=1)
        return float(np.clip(rough / max(weight, 1e-6), 0.0, 1.0))

    def diffuse_model(self) -> tuple[int, float]:
        """Returns LAMBERT, BURLEY or OREN_NAYAR, whichever has the larger diffuse colour, and its
        mean roughness, 0 to 1."""
        weights, rough = self.diffuse.mean(axis=2).T
        model = int(weights[1] >= weights[0])
        if weights[model] <= 0.0:
            return LAMBERT, 0.0
        roughness = float(np.clip(rough[model] / weights[model], 0.0, 1.0))
        if model == 0:
            return BURLEY, roughness
        return (OREN_NAYAR, roughness) if roughness > 0.0 else (LAMBERT, 0.0)

    def leaving_factors(self) -> np.ndarray:
        """Returns the dependence of the diffuse light on the angle at which it leaves, for a
        diffuse colour of 1, (TERMS, 3)."""
        return self.leaving / np.maximum(self.diffuse[:, 0].sum(axis=0), 1e-6)
