# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers on top of a surface: the light that Cycles' sheen, velvet and clearcoat reflect, by angle.

Sources: Zeltner, Burley and Chiang, "Practical Multiple-Scattering Sheen Using Linearly Transformed
Cosines" (2022), sheen from Blender 4.0 on; Burley, "Physically-Based Shading at Disney" (2012),
sheen and clearcoat before 4.0; Ashikhmin, Premoze and Shirley, "A Microfacet-Based BRDF Generator"
(2000), velvet.

The tables were measured in Cycles: the radiance of a flat sheet with a layer of weight 1 under a
uniform sky, and as seen from straight above under a sun, at 24 angles (equal shares of the
projected solid angle), fitted by the terms of diffuse_angles.py. Microfibers were measured in
Blender 4.5, the others in 3.4.

Clearcoat is computed from its formula. Cycles agrees for light of lamps. Its rays sample clearcoat
with a density that is not quite proportional to it, so that other light depends on the colour
beneath: over a red of 0.8 it is 3 % less.

native/src/surfaces/lobe.h contains the formulas for the directions in which cloth reflects light.
They are reciprocal: the reflected share depends on the angle of the light in the same way as the
visible light depends on the angle of view. Only microfibers have a separate table for the reflected
share, which is the integral of their formula.

Differs from Cycles: values between the roughnesses of the tables are interpolated.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from .diffuse_angles import MEANS, TERMS, angle_terms
from .gloss import fresnel

_FACETS = 48  # steps of the integral over facets in each of two dimensions; also number of views

# Each table consists of the roughnesses of its rows, and of rows of weights of the constant 1 and
# of the terms. This table gives the visible light of microfibers, by the angle of view.
_MICROFIBERS = np.linspace(0.0, 1.0, 11), np.array([
    [0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0003, -0.0070, 0.0249, 0.0308, -0.2526],
    [0.0026, -0.0571, 0.2131, 0.5591, -2.7775],
    [0.0003, 0.0119, -0.0027, 0.8121, -0.6203],
    [0.0047, 0.0265, 0.1003, 0.5727, 1.0590],
    [0.0193, 0.0696, 0.2983, 0.2771, 1.0567],
    [0.0514, 0.1621, 0.3494, 0.1021, 0.7062],
    [0.1047, 0.2448, 0.2983, 0.0228, 0.5153],
    [0.1762, 0.2741, 0.2520, -0.0095, 0.3164],
    [0.2581, 0.2638, 0.1947, -0.0073, 0.3183],
    [0.3421, 0.2172, 0.1753, 0.0026, 0.2641]])
# The light of microfibers that a view from straight above shows, by the angle of the light.
_MICROFIBERS_FROM_ABOVE = _MICROFIBERS[0], np.array([
    [0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 0.0001, 0.0, 0.0006, 0.0012],
    [0.0001, 0.0006, 0.0009, 0.0032, 0.0137],
    [0.0012, 0.0034, 0.0093, 0.0058, 0.0637],
    [0.0061, 0.0141, 0.0393, -0.0056, 0.1317],
    [0.0212, 0.0444, 0.0890, -0.0406, 0.1232],
    [0.0545, 0.1003, 0.1188, -0.0784, 0.0122],
    [0.1087, 0.1666, 0.1040, -0.0948, -0.0999],
    [0.1807, 0.2202, 0.0576, -0.0882, -0.1527],
    [0.2643, 0.2456, 0.0046, -0.0683, -0.1481]])
# The share of light that microfibers reflect, by the angle of the light, as weights of the terms
# without a constant.
_MICROFIBERS_ARRIVING = _MICROFIBERS[0], np.array([
    [0.0, 0.0, 0.0, 0.0],
    [-0.0025, 0.0092, 0.0142, -0.0983],
    [-0.0515, 0.1924, 0.4155, -2.2384],
    [-0.0270, 0.1570, 0.8214, -2.0859],
    [0.0352, 0.0698, 0.7866, 0.1488],
    [0.0819, 0.1618, 0.4428, 1.6522],
    [0.1331, 0.3447, 0.0493, 1.5226],
    [0.2141, 0.4118, -0.1753, 0.6497],
    [0.3008, 0.3176, -0.2197, -0.0071],
    [0.3485, 0.1639, -0.1733, -0.2243],
    [0.3462, 0.0444, -0.1153, -0.2212]])
_VELVET = _MICROFIBERS[0], np.array([
    [0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0035, -0.0755, 0.2721, 0.4400, -3.0410],
    [-0.0005, 0.0093, -0.0250, 1.2268, -1.5444],
    [-0.0003, 0.0030, 0.0627, 0.9442, 2.0082],
    [0.0022, -0.0270, 0.5816, 0.3725, 1.9871],
    [0.0064, 0.0772, 0.8876, -0.0210, 0.8249],
    [0.0198, 0.2621, 0.9185, -0.2089, -0.1750],
    [0.0472, 0.4334, 0.8308, -0.2833, -0.8535],
    [0.0883, 0.5399, 0.7459, -0.3175, -1.3235],
    [0.1395, 0.5742, 0.7088, -0.3454, -1.6666],
    [0.1967, 0.5513, 0.7170, -0.3748, -1.9067]])
# Burley's sheen has no roughness. It is Schlick's fifth power of the angle between light and half
# vector.
_BURLEY_SHEEN = np.array([0.0004, 0.0037, 0.0452, 0.0375, 0.0550])

# Order of the lobes in rb_surface.
MICROFIBERS, VELVET, BURLEY_SHEEN, SEVERAL_FACETS = LOBES = range(4)


@dataclass(frozen=True)
class Layer:
    """A layer of weight 1 and white colour, as shares of light (0 to 1) by angle."""

    # (1 + TERMS,): constant and weights of the visible share under uniform light, by the angle of
    # view.
    angles: np.ndarray
    # (1 + TERMS,): constant and weights of the share that a view from straight above shows in the
    # Diffuse pass, by the angle of the light.
    shown: np.ndarray = field(default_factory=lambda: np.zeros(1 + TERMS))
    lobe: int | None = None  # one of LOBES for cloth, else None
    roughness: float = 0.0  # 0 to 1
    _arriving: np.ndarray | None = None  # (TERMS,), see `arriving`; None: equal to by_angle
    covers: bool = False  # whether light that the layer reflects is missing beneath it

    @property
    def albedo(self) -> float:
        """Returns the reflected share of uniform light from all directions."""
        return float(self.angles[0] + MEANS @ self.angles[1:])

    @property
    def by_angle(self) -> np.ndarray:
        """Returns the weights of the visible share by the angle of view, (TERMS,)."""
        return self.angles[1:]

    @property
    def arriving(self) -> np.ndarray:
        """Returns the weights of the reflected share by the angle of the light, (TERMS,)."""
        return self.by_angle if self._arriving is None else self._arriving

    @property
    def above(self) -> float:
        """Returns the share of uniform light that a view from straight above shows as diffuse."""
        return float(self.shown[0] + MEANS @ self.shown[1:])

    def taken(self, color: np.ndarray) -> float:
        """Returns the share of light that is missing beneath the layer, as a multiple of the
        layer's albedo. The share is the same in all channels. color: (3,), colour of the layer."""
        return float(color.max()) if self.covers else 0.0


def microfibers(roughness: float) -> Layer:
    """Returns the sheen of Blender 4.0 and later. roughness: 0 to 1."""
    return Layer(_row(_MICROFIBERS, roughness), _row(_MICROFIBERS_FROM_ABOVE, roughness),
                 MICROFIBERS, roughness, _row(_MICROFIBERS_ARRIVING, roughness), covers=True)


def burley_sheen() -> Layer:
    """Returns the sheen before Blender 4.0. Its 0.03 % of light that a view from straight above
    shows is neglected."""
    return Layer(_BURLEY_SHEEN, lobe=BURLEY_SHEEN)


def velvet(sigma: float) -> Layer:
    """Returns the layer of the Velvet shader. sigma: 0 to 1. Cycles' Diffuse pass does not contain
    it, so `shown` is 0."""
    return Layer(_row(_VELVET, sigma), lobe=VELVET, roughness=sigma)


@lru_cache(maxsize=64)
def clearcoat(roughness: float) -> Layer:
    """Returns the clearcoat before Blender 4.0. roughness: the roughness that applies to diffuse
    light (gloss.seen_roughness). The integral is a sum over midpoints of the facets' directions."""
    alpha2 = min(max(roughness, 0.01)**4, 0.9999)
    steps = (np.arange(_FACETS) + 0.5) / _FACETS
    # Cosines of the facets' angles.
    facet = np.sqrt((1.0 - alpha2**(1.0 - steps)) / (1.0 - alpha2))[:, None]
    views = np.sqrt(steps)[:, None, None]
    between = (views * facet + np.sqrt((1.0 - views**2) * (1.0 - facet**2))
               * np.cos(2.0 * np.pi * steps))  # cosine between view and facet
    light = 2.0 * between * facet - views
    is_above = (light > 0.0) & (between > 0.0)
    masking = _smith(np.where(is_above, light, 1.0)) * _smith(views)
    mirrored = (fresnel(np.clip(between, 0.0, 1.0), 1.5) * masking * between / (views * facet))
    albedos = 0.25 * np.where(is_above, mirrored, 0.0).mean(axis=(1, 2))
    terms = angle_terms(views.ravel())
    return Layer(np.linalg.lstsq(np.insert(terms, 0, 1.0, axis=1), albedos, rcond=None)[0])


def _smith(cosine: np.ndarray) -> np.ndarray:
    """Returns Smith's masking of clearcoat, whose alpha is always 0.25. cosine: of view or
    light."""
    return 2.0 * cosine / (cosine + np.sqrt(0.0625 + 0.9375 * cosine**2))


def _row(table: tuple[np.ndarray, np.ndarray], roughness: float) -> np.ndarray:
    """Returns the row of a table for a roughness, interpolated between the rows of the table."""
    steps, rows = table
    return np.array([np.interp(roughness, steps, column) for column in rows.T])
