# SPDX-License-Identifier: GPL-3.0-or-later
"""How much light a glossy surface reflects in all: the albedo of Cycles' microfacets.

By the angle of the light, as a sum of the terms of diffuse_angles.py.

Source: Walter et al., "Microfacet Models for Refraction through Rough Surfaces" (2007), GGX with
Smith's masking; sampled by its visible normals, Heitz, "Sampling the GGX Distribution of Visible
Normals" (2018). Fresnel's reflectance runs from F0, seen from straight above, to 1 as that of a
dielectric does: F = F0 + (1 - F0) f; that of metals from Blender 4.0 on by Schlick's fifth power,
less a dip around 82 degrees, where a tint multiplies it (Kutz, Hasan and Edmondson, "Novel aspects of
the Adobe Standard Material", 2023). The albedo is linear in F0 then: A = (a - b) F0 + b, where a is
the albedo for F = 1 and b that for F = f.

What differs: integrals by midpoints, good to 1e-3 (blend_tests/test_gloss.py), and the terms fitted
to them, to 2 % up to 80 degrees; light that meets several facets is given back as Cycles'
Multiscatter GGX does it (Turquin, "Practical multiple scattering compensation for microfacet
models", 2019): by how much one facet keeps back towards the eye, most at grazing angles.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import bpy
import numpy as np

from .diffuse_angles import TERMS, angle_terms

_ANGLES = 96  # of view, equal shares of the projected solid angle
_RINGS, _IN_RING = 32, 8  # visible normals, on one side of the plane of view
# Of the rays that meet gloss after a diffuse bounce: mean of the cosine over pi, their density.
_DENSITY = 2.0 / (3.0 * math.pi)
_ABOVE = 0.9999  # cosine of the view from straight above
# The fifth power at the angle where the tint of a metal's edge counts, and c (1 - c)^6 there.
_DIP_EDGE, _DIP = (6.0 / 7.0)**5, (6.0 / 7.0)**6 / 7.0


@dataclass(frozen=True)
class GlossAlbedo:
    """For F = 1, for F = f, for F = c (1 - c)^6 and for F = 1 over all directions; shares of the
    light."""

    white: float
    edge: float
    dip: float
    white_mean: float
    # (3, TERMS), for the first three: the albedo at an angle is its mean plus the sum of these
    # times what the terms differ from their means.
    angles: np.ndarray
    # (TERMS,): likewise what several facets add, over its mean, by the angle at which light arrives.
    several: np.ndarray
    # Of what one facet mirrors, the mean f, and (TERMS,) that by the angle of view.
    rise: float
    rise_by_angle: np.ndarray

    def by_angle(self, f0: np.ndarray | float, tint: np.ndarray | float = 1.0) -> np.ndarray:
        """(TERMS,) and the shape of f0: of(f0) by the angle, as `angles`."""
        white, edge, dip = (part.reshape(TERMS, *[1] * np.ndim(f0)) for part in self.angles)
        return (white - edge) * f0 + edge - _dip_at(f0, tint) * dip

    def gain(self, f0: np.ndarray | float, multiple: bool, tint: np.ndarray | float = 1.0
             ) -> np.ndarray:
        """What light that meets several facets adds, as a factor."""
        return self.of(f0, multiple, tint) / np.maximum(self.of(f0, tint=tint), 1e-6)

    def of(self, f0: np.ndarray | float, multiple: bool = False, tint: np.ndarray | float = 1.0
           ) -> np.ndarray:
        """Albedo by F0. multiple: with light that meets several facets. tint: of a metal's edge."""
        dip = _dip_at(f0, tint)
        once = (self.white - self.edge) * f0 + self.edge - dip * self.dip
        if not multiple:
            return once
        # Schlick's mean, less that of the dip, or a colour that is the same at all angles.
        fresnel = f0 + (1.0 - f0) / 21.0 - dip / 126.0 if self.edge > 0.0 else f0
        again = fresnel * self.white_mean / (1.0 - fresnel * (1.0 - self.white_mean))
        return once * (1.0 + again * (1.0 - self.white) / self.white)

    def covering(self, f0: np.ndarray | float, multiple: bool) -> np.ndarray:
        """What is missing beneath such a layer, in Cycles from 4.0 on: what it mirrors, or, where
        it loses the light that meets several facets, as if it did not."""
        return self.of(f0, True) if multiple else f0 + (1.0 - f0) * self.rise

    def covering_by_angle(self, f0: np.ndarray | float, multiple: bool) -> np.ndarray:
        """(TERMS,) and the shape of f0."""
        if multiple:
            return self.by_angle(f0) * self.gain(f0, True)
        return self.rise_by_angle.reshape(TERMS, *[1] * np.ndim(f0)) * (1.0 - f0)


def _dip_at(f0: np.ndarray | float, tint: np.ndarray | float) -> np.ndarray:
    return (f0 + (1.0 - f0) * _DIP_EDGE) * (1.0 - tint) / _DIP


def filter_glossy_of(scene: bpy.types.Scene) -> float | None:
    """Cycles' setting Filter Glossy; None: diffuse light sees no gloss (Reflective Caustics is off).
    Both are missing where that add-on is off."""
    cycles = getattr(scene, 'cycles', None)
    if not getattr(cycles, 'caustics_reflective', True):
        return None
    return getattr(cycles, 'blur_glossy', 1.0)


def seen_roughness(roughness: float, filter_glossy: float) -> float:
    """As diffuse light sees it: Filter Glossy makes alpha, the square of the roughness, at least
    half of sqrt(1 - p / filter_glossy), p the density of the ray's direction (in the mean here)."""
    alpha = min(max(roughness, 0.0), 1.0)**2
    if filter_glossy > _DENSITY:
        alpha = max(alpha, 0.5 * math.sqrt(1.0 - _DENSITY / filter_glossy))
    return math.sqrt(alpha)


def gloss_albedo(roughness: float, ior: float | None, from_above: bool = False,
                 correlated: bool = True) -> GlossAlbedo:
    """roughness: 0 to 1, of Blender's sockets. ior: of the dielectric whose Fresnel's it has; None:
    as metals from 4.0 on.

    The mean over all directions of view or that from straight above. correlated: masking and
    shadowing depend on each other, as in Cycles from 4.0 on.
    """
    roughness = round(min(max(roughness, 0.0), 1.0), 3)
    ior = None if ior is None else round(max(ior, 1.0), 3)
    means, angles, several, rise, rise_by_angle = _means(roughness, ior, correlated)
    values = means
    if from_above:
        values = _integrals(np.array([_ABOVE]), roughness, ior, correlated)[:, 0]
        rise = values[1] / values[0]
    return GlossAlbedo(*map(float, values), float(means[0]), angles, several, float(rise),
                       rise_by_angle)


@lru_cache(maxsize=1024)
def _means(roughness: float, ior: float | None, correlated: bool
           ) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, np.ndarray]:
    cosines = np.sqrt((np.arange(_ANGLES) + 0.5) / _ANGLES)
    albedos = _integrals(cosines, roughness, ior, correlated)
    # The BSDF is the same with light and view exchanged.
    lost = 1.0 / albedos[0] - 1.0
    several = _integrals(cosines, roughness, ior, correlated,
                         lambda light: np.interp(light, cosines, lost))[0]
    terms = angle_terms(cosines)
    terms -= terms.mean(axis=0)

    def fit(values: np.ndarray) -> np.ndarray:
        return np.linalg.lstsq(terms, values - values.mean(), rcond=None)[0]

    rise = albedos[1] / albedos[0]
    return (albedos.mean(axis=1), np.array([fit(part) for part in albedos]),
            fit(several) / max(several.mean(), 1e-6), float(rise.mean()), fit(rise))


def _integrals(cosines: np.ndarray, roughness: float, ior: float | None, correlated: bool,
               factor: Callable[[np.ndarray], np.ndarray] | None = None) -> np.ndarray:
    """(3, n), for F = 1, F = f and F = c (1 - c)^6, at some cosines of the view, (n,). factor: by
    the cosine of the light; None: 1."""
    alpha = max(roughness * roughness, 1e-4)
    cosines = cosines[:, None, None]
    view_x, view_z = np.sqrt(1.0 - cosines**2), cosines

    # Heitz, listing 1; the view has no y.
    length = np.sqrt((alpha * view_x)**2 + view_z**2)
    stretched_x, stretched_z = alpha * view_x / length, view_z / length
    # Closer towards the rim, where what they mirror is near the surface.
    inward = 1.0 - (np.arange(_RINGS)[:, None] + 0.5) / _RINGS
    radius, share = 1.0 - inward**2, inward * (1.0 - inward**2)
    share /= share.mean()
    angle = np.pi * ((np.arange(_IN_RING) + 0.5) / _IN_RING - 0.5)
    t1, t2 = radius * np.cos(angle), radius * np.sin(angle)
    half = 0.5 * (1.0 + stretched_z)
    t2 = (1.0 - half) * np.sqrt(np.maximum(1.0 - t1**2, 0.0)) + half * t2
    up = np.sqrt(np.maximum(1.0 - t1**2 - t2**2, 0.0))
    # T1 is y, T2 = V x T1.
    normal = np.stack(np.broadcast_arrays(
        alpha * (up * stretched_x - t2 * stretched_z), alpha * t1,
        np.maximum(up * stretched_z + t2 * stretched_x, 0.0)))
    normal /= np.linalg.norm(normal, axis=0)

    cosine = normal[0] * view_x + normal[2] * view_z
    light_z = 2.0 * cosine * normal[2] - view_z
    above = light_z > 0.0
    seen, lit = _masking(view_z, alpha), _masking(np.where(above, light_z, 1.0), alpha)
    weight = share * above * ((1.0 + seen) / (1.0 + seen + lit) if correlated else 1.0 / (1.0 + lit))
    if factor is not None:
        weight = weight * factor(np.clip(light_z, 0.0, 1.0))
    cosine = np.clip(cosine, 0.0, 1.0)
    parts = weight, weight * _edge(cosine, ior), weight * cosine * (1.0 - cosine)**6
    return np.array([part.mean(axis=(1, 2)) for part in parts])


def _masking(cosine: np.ndarray, alpha: float) -> np.ndarray:
    """Smith's Lambda."""
    tangent = (1.0 - cosine**2) / cosine**2
    return 0.5 * (np.sqrt(1.0 + alpha**2 * tangent) - 1.0)


def _edge(cosine: np.ndarray, ior: float | None) -> np.ndarray:
    """f: how far Fresnel's reflectance is from that at right angles to 1."""
    if ior is None:
        return (1.0 - cosine)**5
    f0 = ((ior - 1.0) / (ior + 1.0))**2
    if f0 <= 0.0:
        return np.zeros_like(cosine)
    return (fresnel(cosine, ior) - f0) / (1.0 - f0)


def fresnel(cosine: np.ndarray, ior: float) -> np.ndarray:
    """Reflectance of a dielectric."""
    g = np.sqrt(ior**2 - 1.0 + cosine**2)
    a = (g - cosine) / (g + cosine)
    b = ((g + cosine) * cosine - 1.0) / ((g - cosine) * cosine + 1.0)
    return 0.5 * a**2 * (1.0 + b**2)


def ior_of(f0: float) -> float:
    """Index of refraction whose reflectance at right angles is f0."""
    root = math.sqrt(min(max(f0, 0.0), 0.99))
    return (1.0 + root) / (1.0 - root)
