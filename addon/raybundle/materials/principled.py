# SPDX-License-Identifier: GPL-3.0-or-later
"""The diffuse light that Blender's Principled shader reflects, by Blender version.

Before Blender 4.0 the diffuse part is Burley's, and the specular layer, sheen and clearcoat are
added to it. From 4.0 on the diffuse part is Lambert's, and from 4.3 on Oren and Nayar's. From 4.0
on, sheen, coat and the specular layer lie on top of it, in this order from above, and light that a
layer reflects is missing beneath it. The reflectance of the specular layer then follows from the
index of refraction.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
import numpy as np

from .diffuse_angles import MEANS, TERMS, DiffuseAngles, angle_terms, burley, oren_nayar
from .gloss import fresnel, gloss_albedo, ior_of, seen_roughness
from .layers import Layer, burley_sheen, clearcoat, microfibers

# Groups of sockets. Each socket has its names by Blender version, and the value that is assumed if
# the input varies or is missing. GLOSS_SOCKETS are the first fields of PrincipledSockets, in order.
GLOSS_SOCKETS = ((('Roughness',), 0.5), (('Specular IOR Level', 'Specular'), 0.5),
                 (('IOR',), 1.5), (('Diffuse Roughness',), 0.0))
# The sockets of the coat, in the order of the arguments of PrincipledAlbedo.coated.
COAT_SOCKETS = ((('Coat Weight', 'Clearcoat'), 0.0),
                (('Coat Roughness', 'Clearcoat Roughness'), 0.03), (('Coat IOR',), 1.5))
# The sockets of sheen, in the order of the arguments of sheen_on.
SHEEN_SOCKETS = ((('Sheen Weight', 'Sheen'), 0.0), (('Sheen Roughness',), 0.5))
# The colours of coat and sheen. Before 4.0 the tint of sheen is a number.
COAT_TINT, SHEEN_TINT = (('Coat Tint',), 1.0), (('Sheen Tint',), 1.0)
# The colour of the specular layer and of metals' edges. It is a number before 4.0.
SPECULAR_TINT = ('Specular Tint',), 1.0 if bpy.app.version >= (4, 0, 0) else 0.0
# From 4.5 on, the coat reflects light that several facets reflect in turn, and takes from the
# surface beneath it what it reflects. In earlier versions it takes what a smooth coat would
# reflect.
_IS_COAT_MULTISCATTER = bpy.app.version >= (4, 5, 0)
# Weights of the luminance that defines the hue of the base colour for tints before 4.0: for sheen,
# and for the specular layer.
_LUMINANCE, _ROUGH_LUMINANCE = np.array([0.2126, 0.7152, 0.0722]), np.array([0.3, 0.6, 0.1])
# Cosines of views that represent equal shares of the projected solid angle.
_VIEWS = np.sqrt((np.arange(24) + 0.5) / 24)


@dataclass(frozen=True)
class PrincipledSockets:
    """The values of a Principled shader's sockets and options that gloss and angles depend on."""

    roughness: float
    specular: float  # Specular IOR Level, or Specular before Blender 4.0
    ior: float
    diffuse_roughness: float
    is_multiscatter: bool  # whether the distribution is Multiscatter GGX
    # (3,) linear RGB or one number for all channels: the base colour. It determines the colour of
    # metals, and the light that is lost between several facets.
    base: np.ndarray | float
    tint: np.ndarray | float = SPECULAR_TINT[1]  # (3,) or one number: Specular Tint


@dataclass(frozen=True)
class PrincipledAlbedo:
    """The shares of diffuse light that a Principled shader reflects. The sockets Base Color,
    Metallic and Transmission weight these shares.

    With o = (1 - metallic) (1 - transmission) and m = metallic, each channel has

    reflectance = base (o diffuse + m metal) + o specular + m metal_edge.

    A view from straight above shows the diffuse colour base * o * shown. `angles` describes how
    this colour depends on the angle of the light. The dependence of the mirrored light on the angle
    of the light is o specular_by_angle + m metal_by_angle.
    """

    angles: DiffuseAngles  # of the diffuse part without layers
    roughness: float  # 0 to 1, of the gloss, applies to diffuse light
    diffuse_roughness: float  # 0 to 1
    shown: np.ndarray  # (3,)
    diffuse: np.ndarray  # (3,), under the layers
    specular: np.ndarray = field(default_factory=lambda: np.zeros(3))
    specular_by_angle: np.ndarray = field(default_factory=lambda: np.zeros((TERMS, 3)))
    metal: np.ndarray = field(default_factory=lambda: np.zeros(3))
    metal_edge: np.ndarray = field(default_factory=lambda: np.zeros(3))
    metal_by_angle: np.ndarray = field(default_factory=lambda: np.zeros((TERMS, 3)))
    # (2, 3): the parts of `metal` and of `metal_edge` that several facets reflect in turn.
    several: np.ndarray = field(default_factory=lambda: np.zeros((2, 3)))
    # (TERMS, 3): dependence of the light that several facets reflect on the angle.
    several_by_angle: np.ndarray = field(default_factory=lambda: np.zeros((TERMS, 3)))
    # (TERMS, 3): dependence of the diffuse light that the layers transmit on the angle at which it
    # leaves.
    leaving: np.ndarray = field(default_factory=lambda: np.zeros((TERMS, 3)))
    # (3,): share of the emission, and of the light that passes through the surface, that the coat
    # transmits.
    uncoated: np.ndarray = field(default_factory=lambda: np.ones(3))

    def reflected_by_angle(self, base: np.ndarray, opaque: float, metallic: float) -> np.ndarray:
        """Returns how the reflectance depends on the angle of the light, (TERMS, 3). base: (3,)
        linear RGB. opaque: o. metallic: m."""
        under = self.diffuse / self.angles.albedo  # share of light that the layers transmit
        return (opaque * base * under * self.angles.reflected
                + metallic * self.several_by_angle + self.mirrored_by_angle(opaque, metallic))

    def mirrored_by_angle(self, opaque: float, metallic: float) -> np.ndarray:
        """Returns how the part that one facet mirrors depends on the angle of the light, (TERMS,
        3). opaque: o. metallic: m."""
        return opaque * self.specular_by_angle + metallic * self.metal_by_angle

    def coated(self, weight: float, roughness: float, ior: float, tint: np.ndarray,
               filter_glossy: float | None) -> PrincipledAlbedo:
        """Returns this albedo with a coat on top.

        weight: clamped to 0 to 1. roughness: 0 to 1. ior: the coat's index of refraction. tint:
        (3,), which multiplies the light that passes through the coat. filter_glossy: see
        gloss.filter_glossy_of.
        """
        weight = min(max(weight, 0.0), 1.0)
        if weight == 0.0:
            return self
        is_layered = bpy.app.version >= (4, 0, 0)
        under, above, leaving = np.ones(3), np.ones(3), self.leaving
        ior = max(ior, 1.0)
        f0 = min(((ior - 1.0) / (ior + 1.0))**2, 0.99)
        if is_layered:
            covered, covered_above = _covered_by_coat(roughness, ior, f0)
            # The length of the path through the coat to each view, relative to the coat's
            # thickness.
            depths = 1.0 / np.sqrt(1.0 - (1.0 - _VIEWS[:, None]**2) / ior**2)
            tint = np.clip(tint, 0.0, 1.0)
            let_out = 1.0 - weight + weight * tint**depths
            if filter_glossy is not None:
                let_out *= 1.0 - weight * covered[:, None]
            under = let_out.mean(axis=0)
            above = (1.0 - weight * covered_above) * (1.0 - weight + weight * tint)
            leaving = leaving + np.linalg.lstsq(angle_terms(_VIEWS) - MEANS, let_out / under - 1.0,
                                                rcond=None)[0]
        mirrored, by_angle = 0.0, np.zeros(TERMS)
        if filter_glossy is not None:
            seen = seen_roughness(roughness, filter_glossy)
            if is_layered:
                coat = gloss_albedo(seen, ior)
                gain = gloss_albedo(roughness, ior).gain(f0, _IS_COAT_MULTISCATTER)
                mirrored, by_angle = weight * gain * coat.of(f0), weight * gain * coat.by_angle(f0)
            else:
                coat = clearcoat(seen)
                mirrored, by_angle = weight * coat.albedo, weight * coat.by_angle
            roughness = seen
        gloss = self.specular * under + mirrored
        mean = (((self.specular * under).mean() * self.roughness + mirrored * roughness)
                / max(gloss.mean(), 1e-6))
        return PrincipledAlbedo(
            self.angles, mean, self.diffuse_roughness, self.shown * above, self.diffuse * under,
            gloss, self.specular_by_angle * under + by_angle[:, None],
            self.metal * under, self.metal_edge * under + mirrored,
            self.metal_by_angle * under + by_angle[:, None], self.several * under,
            self.several_by_angle * under, leaving, under)


def _covered_by_coat(roughness: float, ior: float, f0: float) -> tuple[np.ndarray, float]:
    """Returns the share of light that does not reach the surface beneath a coat of weight 1: at
    _VIEWS, and for a view from straight above. f0: the coat's reflectance at normal incidence."""
    if not _IS_COAT_MULTISCATTER:
        return fresnel(_VIEWS, ior), f0
    coat = gloss_albedo(roughness, ior)
    by_angle = (angle_terms(_VIEWS) - MEANS) @ coat.covering_by_angle(f0, True)
    return (coat.covering(f0, True) + by_angle,
            float(gloss_albedo(roughness, ior, from_above=True).covering(f0, True)))


def sheen_on(weight: float, roughness: float, tint: np.ndarray, base: np.ndarray, opaque: float
             ) -> tuple[Layer, np.ndarray]:
    """Returns the sheen of a Principled shader: the layer, and the colour (3,) that multiplies its
    albedo.

    weight, roughness: of the sockets. tint, base: (3,) linear RGB. opaque: 0 to 1, the share of the
    surface that is neither metal nor transmits light. Before Blender 4.0, only this share has
    sheen.
    """
    if bpy.app.version >= (4, 0, 0):
        return microfibers(roughness), min(max(weight, 0.0), 1.0) * np.maximum(tint, 0.0)
    return burley_sheen(), max(weight, 0.0) * opaque * _in_hue(base, tint, _LUMINANCE)


def _in_hue(base: np.ndarray, share: np.ndarray | float, weights: np.ndarray) -> np.ndarray:
    """Returns white, moved by `share` towards the hue of the base colour, (3,). weights: (3,), of
    the luminance by which the base colour is divided to obtain its hue."""
    luminance = float(weights @ base)
    hue = base / luminance if luminance > 0.0 else np.zeros(3)
    return 1.0 + share * (hue - 1.0)


def principled_albedo(sockets: PrincipledSockets, filter_glossy: float | None
                      ) -> PrincipledAlbedo:
    """Returns the diffuse light that the shader reflects, without coat and sheen. filter_glossy:
    see gloss.filter_glossy_of."""
    is_layered = bpy.app.version >= (4, 0, 0)
    roughness, diffuse_roughness = sockets.roughness, sockets.diffuse_roughness
    multiple = sockets.is_multiscatter
    f0 = 0.08 * sockets.specular
    if is_layered:
        f0 = 2.0 * sockets.specular * ((sockets.ior - 1.0) / (sockets.ior + 1.0))**2
    f0 = min(max(f0, 0.0), 0.99)
    base = np.broadcast_to(sockets.base, 3)
    specular_ior = ior_of(f0)
    tint = np.clip(np.broadcast_to(sockets.tint, 3), 0.0, 1.0)
    f0 = f0 * (tint if is_layered else _in_hue(base, tint, _ROUGH_LUMINANCE))
    layer, layer_above = (gloss_albedo(roughness, specular_ior, from_above, is_layered)
                          for from_above in (False, True))
    under, shown, leaving = 1.0, np.ones(3), np.zeros((TERMS, 3))
    if is_layered:
        # Light that the layer mirrors towards the eye is missing beneath it, equally in all
        # channels and regardless of the direction of the light.
        shown = shown - layer_above.covering(f0, multiple).max()
        angles = oren_nayar(diffuse_roughness, base)
    else:
        angles, diffuse_roughness = burley(roughness), roughness
    if filter_glossy is None:
        # Light that left a diffuse surface does not meet the specular layer.
        return PrincipledAlbedo(angles, roughness, diffuse_roughness, shown, angles.albedo)
    if is_layered:
        brightest = int(f0.argmax())
        under = 1.0 - layer.covering(f0, multiple)[brightest]
        leaving = leaving - layer.covering_by_angle(f0, multiple)[:, [brightest]] / under
    diffuse = under * angles.albedo
    gain = layer.gain(f0, multiple)
    seen = seen_roughness(roughness, filter_glossy)
    metal_ior, metal_tint = (None, tint) if is_layered else (specular_ior, 1.0)
    # Light that several facets reflect has the roughness of the socket, not that of Filter Glossy.
    rough_metal = gloss_albedo(roughness, metal_ior, False, is_layered)
    layer, metal = (gloss_albedo(seen, ior, False, is_layered)
                    for ior in (specular_ior, metal_ior))
    black, white = (metal.of(np.full(3, value), tint=metal_tint) for value in (0.0, 1.0))
    once = np.array([white - black, black])
    several = once * (rough_metal.gain(base, multiple, metal_tint) - 1.0)
    return PrincipledAlbedo(
        angles, seen, diffuse_roughness, shown, diffuse, layer.of(f0) * gain,
        layer.by_angle(f0) * gain, *(once + several), metal.by_angle(base, metal_tint), several,
        rough_metal.several[:, None] * (base * several[0] + several[1]), leaving)
