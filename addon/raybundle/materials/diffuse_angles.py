# SPDX-License-Identifier: GPL-3.0-or-later
"""How the diffuse shaders of Cycles depend on the angle of the light.

Sources: Burley, "Physically-Based Shading at Disney" (2012), Principled before Blender 4.0. Oren
and Nayar, "Generalization of Lambert's Reflectance Model" (1994), in the form of Fujii, "A tiny
improvement of Oren-Nayar reflectance model" (2012): Diffuse, and Principled from 4.3 on. From 4.3
on light that meets several facets is added, as OpenPBR has it.

A quantity that depends on the cosine c between the normal and the light is written as a constant
plus a weighted sum of four terms: 1 - c, (1 - c)^2, (1 - c)^5 and c (1 - c)^5. The native library
uses the same terms. Differs from Cycles: the models set how much of the light is reflected, while
its distribution over directions is Lambert's; Oren and Nayar's albedo over c is a fit, good to
0.003.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np

TERMS = 4
# Means of the terms over light that is the same from all directions, weighted by the cosine.
MEANS = np.array([1 / 3, 1 / 6, 1 / 21, 1 / 84])
# Weights of the terms that fit Fujii's G, which is 0 for light from straight above and has the mean
# (2 pi - 5.6) / 3.
_FACETS = np.array([0.23559, 1.07833, -0.38869, -0.96628])
_FACETS_MEAN = float(_FACETS @ MEANS)


def angle_terms(cosines: np.ndarray) -> np.ndarray:
    """(n, TERMS): the terms at these cosines, (n,)."""
    rest = 1.0 - cosines
    return np.stack([rest, rest**2, rest**5, cosines * rest**5], axis=-1)


@dataclass(frozen=True)
class DiffuseAngles:
    """What a diffuse shader reflects by the angle of the light, relative to its colour."""

    albedo: np.ndarray  # (3,), share of light that is the same from all directions
    # (TERMS, 3): weights of the terms in the albedo of light at an angle; the constant follows from
    # the albedo.
    reflected: np.ndarray
    # (1 + TERMS, 3): what a view from straight above shows of the light, as constant and weights;
    # for Lambert's 1 and 0.
    shown: np.ndarray


def lambert() -> DiffuseAngles:
    """Lambert's: nothing depends on the angle."""
    shown = np.zeros((1 + TERMS, 3))
    shown[0] = 1.0
    return DiffuseAngles(np.ones(3), np.zeros((TERMS, 3)), shown)


def burley(roughness: float) -> DiffuseAngles:
    """Burley's diffuse model. roughness: clamped to 0 to 1."""
    roughness = min(max(roughness, 0.0), 1.0)
    # The mean over all directions: this parabola is within 1e-4 of the integral.
    albedo = 0.95295 + roughness * (0.10870 + 0.00352 * roughness)
    shown = lambert().shown
    shown[3], shown[4] = roughness - 0.5, roughness
    reflected = np.zeros((TERMS, 3))
    # For light from straight above the albedo must be what is seen from there under light from
    # everywhere (reciprocity): the term (1 - c)^5 makes up the difference.
    reflected[2] = (albedo - (1.0 + shown[3:, 0] @ MEANS[2:])) / MEANS[2]
    return DiffuseAngles(np.full(3, albedo), reflected, shown)


def facet_shares(roughness: float) -> tuple[float, float]:
    """p and q of Oren and Nayar's albedo, c (p + q c^2 / (1 - c (1 - p))) for the colour c.

    p is the share of light that one facet reflects; q stands for light that several reflect in
    turn.

    roughness: 0 to 1. q is 0 before Blender 4.3.
    """
    once = _from_above(roughness) * (1.0 + roughness / math.pi * _FACETS_MEAN)
    return once, once * (1.0 - once) if bpy.app.version >= (4, 3, 0) else 0.0


def oren_nayar(roughness: float, color: np.ndarray) -> DiffuseAngles:
    """Oren and Nayar's diffuse model. roughness: clamped to 0 to 1; color: (3,) linear RGB, on
    which the share of light that several facets reflect in turn depends."""
    roughness = min(max(roughness, 0.0), 1.0)
    # Smaller roughnesses make no difference, and 1 - once would be 0 below.
    if roughness < 1e-6:
        return lambert()
    color = np.clip(color, 0.0, 1.0)
    above = _from_above(roughness)
    facets = roughness * above / math.pi * _FACETS[:, None]  # by angle, apart from `above`
    once, several = facet_shares(roughness)
    again = several * color**2 / (1.0 - color * (1.0 - once))
    # At each angle, light that several facets reflect is in proportion to what one facet does not
    # reflect, both where it arrives and where it leaves.
    sent_up = again * ((1.0 - above) / (1.0 - once)) / (1.0 - once)
    shown = lambert().shown
    shown[0] = above + sent_up * (1.0 - above)
    shown[1:] = -facets * sent_up
    return DiffuseAngles(once + again, facets * (1.0 - again / (1.0 - once)), shown)


def _from_above(roughness: float) -> float:
    """Share of light from straight above that one facet reflects, for a colour of 1."""
    return 1.0 / (1.0 + roughness * (0.5 - 2.0 / (3.0 * math.pi)))
