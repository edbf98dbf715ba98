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

# Names of the sockets that gloss and angles depend on, the first arguments of principled_albedo,
# and what they count as where they vary or are missing.
GLOSS_SOCKETS = ((('Roughness',), 0.5), (('Specular IOR Level', 'Specular'), 0.5),
                 (('IOR',), 1.5), (('Diffuse Roughness',), 0.0))
# The same of the coat, the first arguments of PrincipledAlbedo.coated, and of sheen_on.
COAT_SOCKETS = ((('Coat Weight', 'Clearcoat'), 0.0),
                (('Coat Roughness', 'Clearcoat Roughness'), 0.03), (('Coat IOR',), 1.5))
SHEEN_SOCKETS = ((('Sheen Weight', 'Sheen'), 0.0), (('Sheen Roughness',), 0.5))
# Of their colours; sheen's is a number before 4.0.
COAT_TINT, SHEEN_TINT = (('Coat Tint',), 1.0), (('Sheen Tint',), 1.0)
METAL_IOR = 1.5  # of the increase towards grazing angles
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_VIEWS = np.sqrt((np.arange(24) + 0.5) / 24)  # cosines, of equal shares of the projected solid angle


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
    # (2, 3): the part of metal and metal_edge that several facets send back. (TERMS, 3): it by the
    # angle at which light arrives, and over its mean by that at which it leaves.
    several: np.ndarray = field(default_factory=lambda: np.zeros((2, 3)))
    several_by_angle: np.ndarray = field(default_factory=lambda: np.zeros((TERMS, 3)))
    several_leaving: np.ndarray = field(default_factory=lambda: np.zeros((TERMS, 3)))
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
            let_out = ((1.0 - weight * (layer.of(f0) + terms @ layer.by_angle(f0))[:, None])
                       * (1.0 - weight + weight * tint**depths))
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
            self.several_by_angle * under, self.several_leaving, leaving, under)


def sheen_on(weight: float, roughness: float, tint: np.ndarray, base: np.ndarray, opaque: float
             ) -> tuple[Layer, np.ndarray]:
    """The layer on top of a whole surface, and its colour. tint, base: (3,)."""
    if bpy.app.version >= (4, 0, 0):
        return microfibers(roughness), min(max(weight, 0.0), 1.0) * np.maximum(tint, 0.0)
    # What is not metal and does not let light through has it, in white and the base's hue.
    luminance = float(_LUMINANCE @ base)
    hue = base / luminance if luminance > 0.0 else np.zeros(3)
    return burley_sheen(), max(weight, 0.0) * opaque * (1.0 + tint * (hue - 1.0))


def principled_albedo(roughness: float, specular: float, ior: float, diffuse_roughness: float,
                      multiple: bool, base: np.ndarray | float, filter_glossy: float | None
                      ) -> PrincipledAlbedo:
    """Values of the sockets (specular: Specular or Specular IOR Level); multiple: whether the
    distribution is Multiscatter GGX; base: the base colour, by which light is lost where it meets
    several facets. filter_glossy: see gloss.filter_glossy_of."""
    is_layered = bpy.app.version >= (4, 0, 0)
    f0 = 0.08 * specular
    if is_layered:
        f0 = 2.0 * specular * ((ior - 1.0) / (ior + 1.0))**2
    f0 = min(max(f0, 0.0), 0.99)
    base = np.broadcast_to(base, 3)
    layer, layer_above = (gloss_albedo(roughness, ior_of(f0), from_above, is_layered)
                          for from_above in (False, True))
    reflected, reflected_above = (float(albedo.of(f0, multiple))
                                  for albedo in (layer, layer_above))
    if is_layered:
        # What it mirrors towards the eye is missing, wherever the light comes from.
        under, shown = 1.0 - reflected, 1.0 - reflected_above
        angles = oren_nayar(diffuse_roughness, base)
    else:
        under = shown = 1.0
        angles, diffuse_roughness = burley(roughness), roughness
    shown, diffuse = np.full(3, shown), under * angles.albedo
    gain = layer.gain(f0, multiple)
    leaving = np.zeros((TERMS, 3))
    if is_layered:
        leaving = leaving - layer.by_angle(f0)[:, None] * gain / under
    if filter_glossy is None:
        return PrincipledAlbedo(angles, roughness, diffuse_roughness, shown, diffuse,
                                leaving=leaving)
    seen = seen_roughness(roughness, filter_glossy)
    metal_ior = METAL_IOR if is_layered else ior_of(f0)
    # What several facets add has the roughness of the socket.
    rough_metal = gloss_albedo(roughness, metal_ior, False, is_layered)
    metal_gain = rough_metal.gain(base, multiple)
    arriving, several_leaving = rough_metal.several
    layer, metal = (gloss_albedo(seen, of_ior, False, is_layered)
                    for of_ior in (ior_of(f0), metal_ior))
    once = np.array([np.full(3, metal.white - metal.edge), np.full(3, metal.edge)])
    several = once * (metal_gain - 1.0)
    return PrincipledAlbedo(
        angles, seen, diffuse_roughness, shown, diffuse, np.full(3, layer.of(f0) * gain),
        np.tile(layer.by_angle(f0)[:, None] * gain, 3), once[0] * metal_gain,
        once[1] * metal_gain, metal.by_angle(base), several,
        arriving[:, None] * (base * several[0] + several[1]), np.tile(several_leaving[:, None], 3),
        leaving)
