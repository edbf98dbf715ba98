# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's Principled shader is to diffuse light, by version, apart from its base colour.

Before 4.0 the specular layer lies on top of a diffuse part that is Burley's. From 4.0 on the
diffuse part is Lambert's, or later Oren and Nayar's, and what the specular layer reflects is
missing from it; the layer's reflectance follows the index of refraction.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
import numpy as np

from .diffuse_angles import TERMS, DiffuseAngles, burley, oren_nayar
from .gloss import gloss_albedo, ior_of, seen_roughness

# Names of the sockets that gloss and angles depend on, the first arguments of principled_albedo,
# and what they count as where they vary or are missing.
GLOSS_SOCKETS = ((('Roughness',), 0.5), (('Specular IOR Level', 'Specular'), 0.5),
                 (('IOR',), 1.5), (('Diffuse Roughness',), 0.0))
# The same of the coat, the first arguments of PrincipledAlbedo.coated.
COAT_SOCKETS = ((('Coat Weight',), 0.0), (('Coat Roughness',), 0.03), (('Coat IOR',), 1.5))
METAL_IOR = 1.5  # of the increase towards grazing angles


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
    shown: float
    diffuse: np.ndarray  # (3,)
    specular: float = 0.0
    specular_by_angle: np.ndarray = field(default_factory=lambda: np.zeros(TERMS))
    metal: np.ndarray | float = 0.0
    metal_edge: np.ndarray | float = 0.0
    metal_by_angle: np.ndarray = field(default_factory=lambda: np.zeros(TERMS))
    # (TERMS,): how the layer lets the diffuse light out (rb_set_material_leaving).
    leaving: np.ndarray = field(default_factory=lambda: np.zeros(TERMS))

    def reflected_by_angle(self, base: np.ndarray, opaque: float, metallic: float) -> np.ndarray:
        """(TERMS, 3), of a whole surface."""
        under = self.diffuse / self.angles.albedo  # the share of light that the layer lets through
        return (opaque * base * under * self.angles.reflected
                + self.mirrored_by_angle(opaque, metallic))

    def mirrored_by_angle(self, opaque: float, metallic: float) -> np.ndarray:
        """(TERMS, 3), likewise."""
        metal = np.broadcast_to(self.metal_by_angle.reshape(TERMS, -1), (TERMS, 3))
        return opaque * self.specular_by_angle[:, None] + metallic * metal

    def coated(self, weight: float, roughness: float, ior: float, filter_glossy: float | None
               ) -> PrincipledAlbedo:
        """Under a coat, which is there from 4.0 on: what it mirrors is missing from what lies
        beneath. Its tint is not read. filter_glossy: as below."""
        weight = min(max(weight, 0.0), 1.0)
        if weight == 0.0:
            return self
        f0 = min(((ior - 1.0) / (ior + 1.0))**2, 0.99)
        layer = gloss_albedo(roughness, ior)
        missing, above = (weight * float(albedo.of(f0))
                          for albedo in (layer, gloss_albedo(roughness, ior, from_above=True)))
        leaving = self.leaving - weight * layer.by_angle(f0) / (1.0 - missing)
        under, shown = 1.0 - missing, self.shown * (1.0 - above)
        mirrored, by_angle = 0.0, np.zeros(TERMS)
        if filter_glossy is not None:
            roughness = seen_roughness(roughness, filter_glossy)
            coat = gloss_albedo(roughness, ior)
            mirrored, by_angle = weight * float(coat.of(f0)), weight * coat.by_angle(f0)
        gloss = self.specular * under + mirrored
        mean = (self.specular * under * self.roughness + mirrored * roughness) / max(gloss, 1e-6)
        return PrincipledAlbedo(
            self.angles, mean, self.diffuse_roughness, shown, self.diffuse * under,
            gloss, self.specular_by_angle * under + by_angle,
            self.metal * under, self.metal_edge * under + mirrored,
            self.metal_by_angle * under
            + by_angle.reshape(-1, *[1] * (self.metal_by_angle.ndim - 1)), leaving)


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
    layer, layer_above = (gloss_albedo(roughness, ior_of(f0), from_above, is_layered)
                          for from_above in (False, True))
    reflected, reflected_above = (float(albedo.of(f0, multiple))
                                  for albedo in (layer, layer_above))
    if is_layered:
        # What it mirrors towards the eye is missing, wherever the light comes from.
        under, shown = 1.0 - reflected, 1.0 - reflected_above
        angles = oren_nayar(diffuse_roughness, np.broadcast_to(base, 3))
    else:
        under = shown = 1.0
        angles, diffuse_roughness = burley(roughness), roughness
    diffuse = under * angles.albedo
    gain = layer.gain(f0, multiple)
    leaving = -layer.by_angle(f0) * gain / under if is_layered else np.zeros(TERMS)
    if filter_glossy is None:
        return PrincipledAlbedo(angles, roughness, diffuse_roughness, shown, diffuse,
                                leaving=leaving)
    seen = seen_roughness(roughness, filter_glossy)
    metal_ior = METAL_IOR if is_layered else ior_of(f0)
    # What several facets add has the roughness of the socket.
    metal_gain = gloss_albedo(roughness, metal_ior, False, is_layered).gain(base, multiple)
    layer, metal = (gloss_albedo(seen, of_ior, False, is_layered)
                    for of_ior in (ior_of(f0), metal_ior))
    return PrincipledAlbedo(
        angles, seen, diffuse_roughness, shown, diffuse, float(layer.of(f0) * gain),
        layer.by_angle(f0) * gain, (metal.white - metal.edge) * metal_gain,
        metal.edge * metal_gain, metal.by_angle(base) * metal_gain, leaving)
