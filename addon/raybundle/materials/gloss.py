# SPDX-License-Identifier: GPL-3.0-or-later
"""The share of light that a glossy surface reflects: the albedo of Cycles' microfacets.

The albedo as a function of the angle of the light is a sum of the terms of diffuse_angles.py.

Sources: Walter et al., "Microfacet Models for Refraction through Rough Surfaces" (2007): GGX with
Smith's masking. It is sampled by its visible normals: Heitz, "Sampling the GGX Distribution of
Visible Normals" (2018). Fresnel's reflectance F rises from F0, for a view from straight above, to 1
like that of a dielectric: F = F0 + (1 - F0) f. From Blender 4.0 on, that of metals rises by
Schlick's fifth power, less a dip around 82 degrees if a tint multiplies it (Kutz, Hasan and
Edmondson, "Novel aspects of the Adobe Standard Material", 2023). In both cases the albedo is linear
in F0: A = (a - b) F0 + b, where a is the albedo for F = 1 and b the albedo for F = f.

Light that several facets reflect in turn is added as in Cycles' Multiscatter GGX (Turquin,
"Practical multiple scattering compensation for microfacet models", 2019): its amount follows from
the share that one facet does not reflect towards the eye.

Differs from Cycles: integrals are sums over midpoints, accurate to 1e-3
(blend_tests/test_gloss.py). The terms are a fit to these sums, accurate to 2 % up to 80 degrees.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import bpy
import numpy as np

from .diffuse_angles import TERMS, angle_terms

_ANGLES = 96  # number of angles of view, for equal shares of the projected solid angle
_RINGS, _IN_RING = 32, 8  # grid of visible normals, on one side of the plane of view and normal
# Mean of cosine / pi, the probability density of the directions of rays that leave a diffuse
# surface.
_DENSITY = 2.0 / (3.0 * math.pi)
_ABOVE = 0.9999  # cosine of the angle that is used for a view from straight above
# (1 - c)^5 and c (1 - c)^6 at c = 1/7, the angle at which the tint of a metal's edge has its full
# effect.
_DIP_EDGE, _DIP = (6.0 / 7.0)**5, (6.0 / 7.0)**6 / 7.0


@dataclass(frozen=True)
class GlossAlbedo:
    """The share of light that microfacets of one roughness reflect, for any F0.

    gloss_albedo creates it, either for light from all directions or for a view from straight above.
    """

    white: float  # for F = 1
    edge: float  # for F = f
    dip: float  # for F = c (1 - c)^6
    white_mean: float  # for F = 1 and light from all directions
    # (3, TERMS), for white, edge and dip. The albedo at an angle is the mean plus the sum of these
    # weights times the difference of each term from its own mean.
    angles: np.ndarray
    # (TERMS,): weights like those of `angles` for the light that several facets add, relative to
    # its mean, by the angle at which light arrives.
    several: np.ndarray
    rise: float  # mean of f over the light that one facet reflects
    rise_by_angle: np.ndarray  # (TERMS,): weights for `rise` by the angle of view

    def by_angle(self, f0: np.ndarray | float, tint: np.ndarray | float = 1.0) -> np.ndarray:
        """Returns how of(f0, tint=tint) depends on the angle, as weights like `angles`, (TERMS,
        *shape of f0)."""
        white, edge, dip = (part.reshape(TERMS, *[1] * np.ndim(f0)) for part in self.angles)
        return (white - edge) * f0 + edge - _dip_at(f0, tint) * dip

    def gain(self, f0: np.ndarray | float, multiple: bool, tint: np.ndarray | float = 1.0
             ) -> np.ndarray:
        """Returns the ratio of the albedo with light that several facets reflect in turn to the
        albedo without it. The result has the shape of f0. multiple: whether the distribution is
        Multiscatter GGX; otherwise the ratio is 1."""
        return self.of(f0, multiple, tint) / np.maximum(self.of(f0, tint=tint), 1e-6)

    def of(self, f0: np.ndarray | float, multiple: bool = False, tint: np.ndarray | float = 1.0
           ) -> np.ndarray:
        """Returns the albedo for f0, a number or an array. multiple: whether light that several
        facets reflect in turn is included. tint: of a metal's edge, 0 to 1."""
        dip = _dip_at(f0, tint)
        once = (self.white - self.edge) * f0 + self.edge - dip * self.dip
        if not multiple:
            return once
        # The mean of F: Schlick's mean less that of the dip, or f0 if the colour is the same at all
        # angles.
        fresnel = f0 + (1.0 - f0) / 21.0 - dip / 126.0 if self.edge > 0.0 else f0
        again = fresnel * self.white_mean / (1.0 - fresnel * (1.0 - self.white_mean))
        return once * (1.0 + again * (1.0 - self.white) / self.white)

    def covering(self, f0: np.ndarray | float, multiple: bool) -> np.ndarray:
        """Returns the share of light that does not reach the surface beneath a layer of this gloss,
        in Cycles from 4.0 on. Multiscatter GGX removes the light that it reflects. GGX, which loses
        light that meets several facets, removes as much as if it lost none."""
        return self.of(f0, True) if multiple else f0 + (1.0 - f0) * self.rise

    def covering_by_angle(self, f0: np.ndarray | float, multiple: bool) -> np.ndarray:
        """Returns how covering() depends on the angle of view, (TERMS, *shape of f0)."""
        if multiple:
            return self.by_angle(f0) * self.gain(f0, True)
        return self.rise_by_angle.reshape(TERMS, *[1] * np.ndim(f0)) * (1.0 - f0)


def _dip_at(f0: np.ndarray | float, tint: np.ndarray | float) -> np.ndarray:
    """Returns the weight of c (1 - c)^6 in F for which F has the given tint at the edge."""
    return (f0 + (1.0 - f0) * _DIP_EDGE) * (1.0 - tint) / _DIP


def filter_glossy_of(scene: bpy.types.Scene) -> float | None:
    """Returns Cycles' setting Filter Glossy. Returns None if Reflective Caustics is off, because
    light that left a diffuse surface is then not mirrored. If Cycles is not enabled, its defaults
    are returned."""
    cycles = getattr(scene, 'cycles', None)
    if not getattr(cycles, 'caustics_reflective', True):
        return None
    return getattr(cycles, 'blur_glossy', 1.0)


def seen_roughness(roughness: float, filter_glossy: float) -> float:
    """Returns the roughness, 0 to 1, that applies to light from diffuse surfaces.

    Filter Glossy makes alpha, the square of the roughness, at least half of sqrt(1 - p /
    filter_glossy), where p is the probability density of the ray's direction. The mean of p is
    used.
    """
    alpha = min(max(roughness, 0.0), 1.0)**2
    if filter_glossy > _DENSITY:
        alpha = max(alpha, 0.5 * math.sqrt(1.0 - _DENSITY / filter_glossy))
    return math.sqrt(alpha)


def gloss_albedo(roughness: float, ior: float | None, from_above: bool = False,
                 correlated: bool = True) -> GlossAlbedo:
    """Returns the albedo of GGX microfacets.

    roughness: 0 to 1, as in Blender's sockets. ior: index of refraction of the dielectric whose
    Fresnel reflectance is used; None: the reflectance of metals from Blender 4.0 on. from_above:
    whether the albedo is for a view from straight above instead of the mean over all directions.
    correlated: whether masking and shadowing depend on each other, as in Cycles from 4.0 on.
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
    """Returns the means of white, edge and dip, (3,), followed by the members angles, several, rise
    and rise_by_angle of a GlossAlbedo."""
    cosines = np.sqrt((np.arange(_ANGLES) + 0.5) / _ANGLES)
    albedos = _integrals(cosines, roughness, ior, correlated)
    # The BSDF is reciprocal, so the loss at an angle is the same for view and light.
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
    """Returns the albedo for F = 1, F = f and F = c (1 - c)^6, (3, n), at cosines of the view,
    (n,). factor: weight of the light as a function of the cosine between the light and the normal;
    None: 1."""
    alpha = max(roughness * roughness, 1e-4)
    cosines = cosines[:, None, None]
    view_x, view_z = np.sqrt(1.0 - cosines**2), cosines

    # Sample visible normals as in Heitz, listing 1, with the view in the plane y = 0.
    length = np.sqrt((alpha * view_x)**2 + view_z**2)
    stretched_x, stretched_z = alpha * view_x / length, view_z / length
    # Place rings closer together towards the rim, whose facets mirror light at grazing angles.
    inward = 1.0 - (np.arange(_RINGS)[:, None] + 0.5) / _RINGS
    radius, share = 1.0 - inward**2, inward * (1.0 - inward**2)
    share /= share.mean()
    angle = np.pi * ((np.arange(_IN_RING) + 0.5) / _IN_RING - 0.5)
    t1, t2 = radius * np.cos(angle), radius * np.sin(angle)
    half = 0.5 * (1.0 + stretched_z)
    t2 = (1.0 - half) * np.sqrt(np.maximum(1.0 - t1**2, 0.0)) + half * t2
    up = np.sqrt(np.maximum(1.0 - t1**2 - t2**2, 0.0))
    # In Heitz's frame: T1 = y and T2 = V x T1.
    normal = np.stack(np.broadcast_arrays(
        alpha * (up * stretched_x - t2 * stretched_z), alpha * t1,
        np.maximum(up * stretched_z + t2 * stretched_x, 0.0)))
    normal /= np.linalg.norm(normal, axis=0)

    cosine = normal[0] * view_x + normal[2] * view_z
    light_z = 2.0 * cosine * normal[2] - view_z
    above = light_z > 0.0
    seen, lit = _masking(view_z, alpha), _masking(np.where(above, light_z, 1.0), alpha)
    weight = share * above * ((1.0 + seen) / (1.0 + seen + lit) if correlated
                              else 1.0 / (1.0 + lit))
    if factor is not None:
        weight = weight * factor(np.clip(light_z, 0.0, 1.0))
    cosine = np.clip(cosine, 0.0, 1.0)
    parts = weight, weight * _edge(cosine, ior), weight * cosine * (1.0 - cosine)**6
    return np.array([part.mean(axis=(1, 2)) for part in parts])


def _masking(cosine: np.ndarray, alpha: float) -> np.ndarray:
    """Returns Smith's Lambda of GGX."""
    tangent = (1.0 - cosine**2) / cosine**2
    return 0.5 * (np.sqrt(1.0 + alpha**2 * tangent) - 1.0)


def _edge(cosine: np.ndarray, ior: float | None) -> np.ndarray:
    """Returns f, the relative rise of Fresnel's reflectance: 0 for light from straight above, 1 at
    the edge."""
    if ior is None:
        return (1.0 - cosine)**5
    f0 = ((ior - 1.0) / (ior + 1.0))**2
    if f0 <= 0.0:
        return np.zeros_like(cosine)
    return (fresnel(cosine, ior) - f0) / (1.0 - f0)


def fresnel(cosine: np.ndarray, ior: float) -> np.ndarray:
    """Returns Fresnel's reflectance of a dielectric, 0 to 1. cosine: of the light, 0 to 1, any
    shape. ior: index of refraction, at least 1."""
    g = np.sqrt(ior**2 - 1.0 + cosine**2)
    a = (g - cosine) / (g + cosine)
    b = ((g + cosine) * cosine - 1.0) / ((g - cosine) * cosine + 1.0)
    return 0.5 * a**2 * (1.0 + b**2)


def ior_of(f0: float) -> float:
    """Returns the index of refraction for which the share f0 of light from straight above is
    reflected."""
    root = math.sqrt(min(max(f0, 0.0), 0.99))
    return (1.0 + root) / (1.0 - root)
