# SPDX-License-Identifier: GPL-3.0-or-later
"""How the diffuse shaders of Cycles depend on the angle of the light.

Sources: Burley, "Physically-Based Shading at Disney" (2012), Principled before Blender 4.0. Oren
and Nayar, "Generalization of Lambert's Reflectance Model" (1994), in the form of Fujii, "A tiny
improvement of Oren-Nayar reflectance model" (2012): Diffuse, and Principled from 4.3 on. From 4.3
on light that meets several facets is added, as OpenPBR has it.

By the cosine c between the normal and the light, in the terms of rb_set_material_angles: 1 - c,
(1 - c)^2, (1 - c)^5 and c (1 - c)^5. What differs: surfaces send light as if they were Lambert's,
up to its amount; Oren and Nayar's albedo over c is a fit, good to 0.003.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np

TERMS = 4
MEANS = np.array([1 / 3, 1 / 6, 1 / 21, 1 / 84])  # over light from everywhere
# The terms nearest to Fujii's G, 0 for light from straight above; its mean is (2 pi - 5.6) / 3.
_FACETS = np.array([0.23559, 1.07833, -0.38869, -0.96628])
_FACETS_MEAN = float(_FACETS @ MEANS)


def angle_terms(cosines: np.ndarray) -> np.ndarray:
    """(n, TERMS) of (n,)."""
    rest = 1.0 - cosines
    return np.stack([rest, rest**2, rest**5, cosines * rest**5], axis=-1)


@dataclass(frozen=True)
class DiffuseAngles:
    """For a colour, and to be multiplied by it."""

    albedo: np.ndarray  # (3,), of light from everywhere
    reflected: np.ndarray  # (TERMS, 3): the albedo by angle, without what light from above has
    shown: np.ndarray  # (1 + TERMS, 3): seen from above, of light from above, and by angle


def lambert() -> DiffuseAngles:
    shown = np.zeros((1 + TERMS, 3))
    shown[0] = 1.0
    return DiffuseAngles(np.ones(3), np.zeros((TERMS, 3)), shown)


def burley(roughness: float) -> DiffuseAngles:
    roughness = min(max(roughness, 0.0), 1.0)
    # Over all directions; the parabola is within 1e-4 of the integral.
    albedo = 0.95295 + roughness * (0.10870 + 0.00352 * roughness)
    shown = lambert().shown
    shown[3], shown[4] = roughness - 0.5, roughness
    reflected = np.zeros((TERMS, 3))
    # What light from above lacks: there the albedo is what is seen from above.
    reflected[2] = (albedo - (1.0 + shown[3:, 0] @ MEANS[2:])) / MEANS[2]
    return DiffuseAngles(np.full(3, albedo), reflected, shown)


def facet_shares(roughness: float) -> tuple[float, float]:
    """Of Oren and Nayar's albedo over a colour c, p + q c^2 / (1 - c (1 - p)): p, by one facet, and
    q, by several."""
    once = _from_above(roughness) * (1.0 + roughness / math.pi * _FACETS_MEAN)
    return once, once * (1.0 - once) if bpy.app.version >= (4, 3, 0) else 0.0


def oren_nayar(roughness: float, color: np.ndarray) -> DiffuseAngles:
    """color: (3,), on which light that meets several facets depends."""
    roughness = min(max(roughness, 0.0), 1.0)
    # Less makes no difference, but divides by nothing.
    if roughness < 1e-6:
        return lambert()
    color = np.clip(color, 0.0, 1.0)
    above = _from_above(roughness)
    facets = roughness * above / math.pi * _FACETS[:, None]  # beyond that from above
    once, several = facet_shares(roughness)
    again = several * color**2 / (1.0 - color * (1.0 - once))
    # Several facets take, and send, in proportion to what one does not at the angle.
    sent_up = again * ((1.0 - above) / (1.0 - once)) / (1.0 - once)
    shown = lambert().shown
    shown[0] = above + sent_up * (1.0 - above)
    shown[1:] = -facets * sent_up
    return DiffuseAngles(once + again, facets * (1.0 - again / (1.0 - once)), shown)


def _from_above(roughness: float) -> float:
    """The albedo by one facet, of light from straight above."""
    return 1.0 / (1.0 + roughness * (0.5 - 2.0 / (3.0 * math.pi)))
