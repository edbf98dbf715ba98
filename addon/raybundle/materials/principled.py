# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's Principled shader is to diffuse light, by version, apart from its base colour.

Before 4.0 the specular layer lies on top of a diffuse part that is Burley's, and sheen and clearcoat
are added to them. From 4.0 on the diffuse part is Lambert's, or later Oren and Nayar's, and what
lies on top (sheen, coat, the specular layer, in this order) is missing beneath; the specular
layer's reflectance follows the index of refraction.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
import numpy as np

from .diffuse_angles import MEANS, TERMS, DiffuseAngles, angle_terms, burley, oren_nayar
from .gloss import gloss_albedo, ior_of, seen_roughness
from .layers import Layer, burley_sheen, clearcoat, microfibers

# Names of the sockets that gloss and angles depend on, in the order of the first fields of
# PrincipledSockets, and what they count as where they vary or are missing.
GLOSS_SOCKETS = ((('Roughness',), 0.5), (('Specular IOR Level', 'Specular'), 0.5),
                 (('IOR',), 1.5), (('Diffuse Roughness',), 0.0))
# The same of the coat, the first arguments of PrincipledAlbedo.coated, and of sheen_on.
COAT_SOCKETS = ((('Coat Weight', 'Clearcoat'), 0.0),
                (('Coat Roughness', 'Clearcoat Roughness'), 0.03), (('Coat IOR',), 1.5))
SHEEN_SOCKETS = ((('Sheen Weight', 'Sheen'), 0.0), (('Sheen Roughness',), 0.5))
# Of their colours; sheen's is a number before 4.0.
COAT_TINT, SHEEN_TINT = (('Coat Tint',), 1.0), (('Sheen Tint',), 1.0)
# Of the specular layer, and of metals' edges; a number before 4.0.
SPECULAR_TINT = ('Specular Tint',), 1.0 if bpy.app.version >= (4, 0, 0) else 0.0
# Before 4.0, by which a tint has the base's hue: of sheen, and of the specular layer.
_LUMINANCE, _ROUGH_LUMINANCE = np.array([0.2126, 0.7152, 0.0722]), np.array([0.3, 0.6, 0.1])
_VIEWS = np.sqrt((np.arange(24) + 0.5) / 24)  # cosines, of equal shares of the projected solid angle


@dataclass(frozen=True)
class PrincipledSockets:
    """Values of a Principled shader's sockets and options that its gloss and angles depend on."""

    roughness: float
    specular: float  # Specular IOR Level, or Specular before Blender 4.0
    ior: float
    diffuse_roughness: float
    is_multiscatter: bool  # whether the distribution is Multiscatter GGX
    # (3,) or one number for all channels, linear RGB: by the base colour light is lost where it
    # meets several facets.
    base: np.ndarray | float
    tint: np.ndarray | float = SPECULAR_TINT[1]  # (3,) or one number: Specular Tint


@dataclass(frozen=True)
class PrincipledAlbedo:
    """Shares of the light. With o = (1 - metallic) (1 - transmission) and m = metallic:

    reflectance = base (o diffuse + m metal) + o specular + m metal_edge, of which
    base o shown is the diffuse colour that is seen from straight above, of light by its angle as
    angles has it. What is mirrored depends on the angle by o specular_by_angle + m metal_by_angle.
    """

    angles: DiffuseAngles
    roughness: float  # of the gloss, as diffuse light sees it
    diffuse_roughness: float
    shown: np.ndarray  # (3,)
    diffuse: np.ndarray  # (3,)
    specular: np.ndarray = field(default_factory=lambda: np.zeros(3))
    specular_by_angle: np.ndarray = field(default_factory=lambda: np.zeros((TERMS, 3)))
    metal: np.ndarray = field(default_factory=lambda: np.zeros(3))
    metal_edge: np.ndarray = field(default_factory=lambda: np.zeros(3))
    metal_by_angle: np.ndarray = field(default_factory=lambda: np.zeros((TERMS, 3)))
    # (2, 3): the part of metal and metal_edge that several facets send back; (TERMS, 3): that by
    # the angle.
    several: np.ndarray = field(default_factory=lambda: np.zeros((2, 3)))
    several_by_angle: np.ndarray = field(default_factory=lambda: np.zeros((TERMS, 3)))
    # (TERMS, 3): how the layers let the diffuse light out (rb_set_material_leaving).
    leaving: np.ndarray = field(default_factory=lambda: np.zeros((TERMS, 3)))
    # (3,): what the coat leaves of emission and of light that goes through.
    uncoated: np.ndarray = field(default_factory=lambda: np.ones(3))

    def reflected_by_angle(self, base: np.ndarray, opaque: float, metallic: float) -> np.ndarray:
        """(TERMS, 3), of a whole surface."""
        under = self.diffuse / self.angles.albedo  # the share of light that the layers let through
        return (opaque * base * under * self.angles.reflected
                + metallic * self.several_by_angle + self.mirrored_by_angle(opaque, metallic))

    def mirrored_by_angle(self, opaque: float, metallic: float) -> np.ndarray:
        """(TERMS, 3), likewise."""
        return opaque * self.specular_by_angle + metallic * self.metal_by_angle

    def coated(self, weight: float, roughness: float, ior: float, tint: np.ndarray,
               filter_glossy: float | None) -> PrincipledAlbedo:
        """Under a coat. tint: (3,), of what passes through it. filter_glossy: as below."""
        weight = min(max(weight, 0.0), 1.0)
        if weight == 0.0:
            return self
        is_layered = bpy.app.version >= (4, 0, 0)
        under, above, leaving = np.ones(3), np.ones(3), self.leaving
        f0 = min(((ior - 1.0) / (ior + 1.0))**2, 0.99)
        if is_layered:
            layer = gloss_albedo(roughness, ior)
            from_above = gloss_albedo(roughness, ior, from_above=True)
            terms = angle_terms(_VIEWS) - MEANS
            # By how far light goes in the coat to each view.
            depths = 1.0 / np.sqrt(1.0 - (1.0 - _VIEWS[:, None]**2) / max(ior, 1.0)**2)
            tint = np.clip(tint, 0.0, 1.0)
            let_out = 1.0 - weight + weight * tint**depths
            if filter_glossy is not None:
                let_out *= 1.0 - weight * (layer.of(f0) + terms @ layer.by_angle(f0))[:, None]
            under = let_out.mean(axis=0)
            above = (1.0 - weight * from_above.of(f0)) * (1.0 - weight + weight * tint)
            leaving = leaving + np.linalg.lstsq(terms, let_out / under - 1.0, rcond=None)[0]
        mirrored, by_angle = 0.0, np.zeros(TERMS)
        if filter_glossy is not None:
            roughness = seen_roughness(roughness, filter_glossy)
            if is_layered:
                coat = gloss_albedo(roughness, ior)
                mirrored, by_angle = weight * float(coat.of(f0)), weight * coat.by_angle(f0)
            else:
                coat = clearcoat(roughness)
                mirrored, by_angle = weight * coat.albedo, weight * coat.by_angle
        gloss = self.specular * under + mirrored
        mean = (((self.specular * under).mean() * self.roughness + mirrored * roughness)
                / max(gloss.mean(), 1e-6))
        return PrincipledAlbedo(
            self.angles, mean, self.diffuse_roughness, self.shown * above, self.diffuse * under,
            gloss, self.specular_by_angle * under + by_angle[:, None],
            self.metal * under, self.metal_edge * under + mirrored,
            self.metal_by_angle * under + by_angle[:, None], self.several * under,
            self.several_by_angle * under, leaving, under)


def sheen_on(weight: float, roughness: float, tint: np.ndarray, base: np.ndarray, opaque: float
             ) -> tuple[Layer, np.ndarray]:
    """The layer on top of a whole surface, and its colour. tint, base: (3,)."""
    if bpy.app.version >= (4, 0, 0):
        return microfibers(roughness), min(max(weight, 0.0), 1.0) * np.maximum(tint, 0.0)
    # What is not metal and does not let light through has it.
    return burley_sheen(), max(weight, 0.0) * opaque * _in_hue(base, tint, _LUMINANCE)


def _in_hue(base: np.ndarray, share: np.ndarray | float, weights: np.ndarray) -> np.ndarray:
    """(3,), white and a share of the base's hue. weights: of its luminance."""
    luminance = float(weights @ base)
    hue = base / luminance if luminance > 0.0 else np.zeros(3)
    return 1.0 + share * (hue - 1.0)


def principled_albedo(sockets: PrincipledSockets, filter_glossy: float | None
                      ) -> PrincipledAlbedo:
    """filter_glossy: see gloss.filter_glossy_of."""
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
        # What it mirrors towards the eye is missing, of all colours, wherever light comes from.
        shown = shown - layer_above.covering(f0, multiple).max()
        angles = oren_nayar(diffuse_roughness, base)
    else:
        angles, diffuse_roughness = burley(roughness), roughness
    if filter_glossy is None:
        # To diffuse light there is no such layer.
        return PrincipledAlbedo(angles, roughness, diffuse_roughness, shown, angles.albedo)
    if is_layered:
        brightest = int(f0.argmax())
        under = 1.0 - layer.covering(f0, multiple)[brightest]
        leaving = leaving - layer.covering_by_angle(f0, multiple)[:, [brightest]] / under
    diffuse = under * angles.albedo
    gain = layer.gain(f0, multiple)
    seen = seen_roughness(roughness, filter_glossy)
    metal_ior, metal_tint = (None, tint) if is_layered else (specular_ior, 1.0)
    # What several facets add has the roughness of the socket.
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
