# SPDX-License-Identifier: GPL-3.0-or-later
"""The dependence of Cycles' diffuse shaders on the angle of the light.

Sources: Burley, "Physically-Based Shading at Disney" (2012), Principled before Blender 4.0. Oren
and Nayar, "Generalization of Lambert's Reflectance Model" (1994), in the form of Fujii, "A tiny
improvement of Oren-Nayar reflectance model" (2012): Diffuse, and Principled from 4.3 on. From 4.3
on, light that several facets reflect in turn is added, as in OpenPBR.

A quantity that depends on the cosine c between the normal and the light is written as a constant
plus a weighted sum of four terms: 1 - c, (1 - c)^2, (1 - c)^5 and c (1 - c)^5. The native library
uses the same terms.

Differs from Cycles: here the models only determine how much of the light is reflected; the
distribution of the reflected light over directions is Lambert's. The albedo of Oren and Nayar as a
function of c is a fit, accurate to 0.003.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np

TERMS = 4
# Means of the terms under uniform light from all directions, weighted by the cosine.
MEANS = np.array([1 / 3, 1 / 6, 1 / 21, 1 / 84])
# Weights of the terms that fit Fujii's G, which is 0 for light from straight above and has the mean
# (2 pi - 5.6) / 3.
_FACETS = np.array([0.23559, 1.07833, -0.38869, -0.96628])
_FACETS_MEAN = float(_FACETS @ MEANS)


def angle_terms(cosines: np.ndarray) -> np.ndarray:
    """Returns the terms, (n, TERMS), at cosines, (n,)."""
    rest = 1.0 - cosines
    return np.stack([rest, rest**2, rest**5, cosines * rest**5], axis=-1)


@dataclass(frozen=True)
class DiffuseAngles:
    """How the light that a diffuse shader reflects depends on the angle of the light, relative to
    the shader's colour."""

    albedo: np.ndarray  # (3,), reflected share of uniform light from all directions
    # (TERMS, 3): weights of the terms in the albedo of light at an angle. The constant follows from
    # the mean, `albedo`.
    reflected: np.ndarray
    # (1 + TERMS, 3): the reflected light that a view from straight above shows, as a constant and
    # weights. For Lambert's surface the constant is 1 and the weights are 0.
    shown: np.ndarray


def lambert() -> DiffuseAngles:
    """Returns Lambert's model, in which nothing depends on the angle."""
    shown = np.zeros((1 + TERMS, 3))
    shown[0] = 1.0
    return DiffuseAngles(np.ones(3), np.zeros((TERMS, 3)), shown)


def burley(roughness: float) -> DiffuseAngles:
    """Returns Burley's diffuse model. roughness: clamped to 0 to 1."""
    roughness = min(max(roughness, 0.0), 1.0)
    # The mean over all directions. This parabola is within 1e-4 of the integral.
    albedo = 0.95295 + roughness * (0.10870 + 0.00352 * roughness)
    shown = lambert().shown
    shown[3], shown[4] = roughness - 0.5, roughness
    reflected = np.zeros((TERMS, 3))
    # By reciprocity, the albedo of light from straight above must equal the value that a view from
    # straight above shows under uniform light. The term (1 - c)^5 makes up the difference.
    reflected[2] = (albedo - (1.0 + shown[3:, 0] @ MEANS[2:])) / MEANS[2]
    return DiffuseAngles(np.full(3, albedo), reflected, shown)


def facet_shares(roughness: float) -> tuple[float, float]:
    """Returns p and q of Oren and Nayar's albedo, c (p + q c^2 / (1 - c (1 - p))) for the colour c.

    p is the share of light that a single facet reflects. q is the factor of light that several
    facets reflect in turn, and is 0 before Blender 4.3. roughness: 0 to 1.
    """
    once = _from_above(roughness) * (1.0 + roughness / math.pi * _FACETS_MEAN)
    return once, once * (1.0 - once) if bpy.app.version >= (4, 3, 0) else 0.0


def oren_nayar(roughness: float, color: np.ndarray) -> DiffuseAngles:
    """Returns Oren and Nayar's diffuse model. roughness: clamped to 0 to 1. color: (3,) linear RGB,
    which determines the share of light that several facets reflect in turn."""
    roughness = min(max(roughness, 0.0), 1.0)
    # Smaller roughnesses make no visible difference, and 1 - once would be 0 below.
    if roughness < 1e-6:
        return lambert()
    color = np.clip(color, 0.0, 1.0)
    above = _from_above(roughness)
    # The part of the albedo that depends on the angle. The constant part is `above`.
    facets = roughness * above / math.pi * _FACETS[:, None]
    once, several = facet_shares(roughness)
    again = several * color**2 / (1.0 - color * (1.0 - once))
    # At each angle, light that several facets reflect is proportional to the share that one facet
    # does not reflect, both where the light arrives and where it leaves.
    sent_up = again * ((1.0 - above) / (1.0 - once)) / (1.0 - once)
    shown = lambert().shown
    shown[0] = above + sent_up * (1.0 - above)
    shown[1:] = -facets * sent_up
    return DiffuseAngles(once + again, facets * (1.0 - again / (1.0 - once)), shown)


def _from_above(roughness: float) -> float:
    """Returns the share of light from straight above that one facet reflects, for a colour of 1."""
    return 1.0 / (1.0 + roughness * (0.5 - 2.0 / (3.0 * math.pi)))
