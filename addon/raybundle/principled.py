# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's Principled shader is to diffuse light, by version, apart from its base colour.

Before 4.0 the specular layer lies on top of a diffuse part that is Burley's. From 4.0 on the
diffuse part is Lambert's, or later Oren and Nayar's, and what the specular layer reflects is
missing from it; the layer's reflectance follows the index of refraction.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from .diffuse_angles import MEANS, DiffuseAngles, burley, oren_nayar
from .gloss import gloss_albedo, ior_of

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
    angles has it. Of light that comes from there o specular_grazing + m metal_grazing less is
    mirrored.
    """

    angles: DiffuseAngles
    shown: float
    diffuse: np.ndarray  # (3,)
    specular: float = 0.0
    specular_grazing: float = 0.0
    metal: np.ndarray | float = 0.0
    metal_edge: np.ndarray | float = 0.0
    metal_grazing: np.ndarray | float = 0.0

    def reflected_by_angle(self, base: np.ndarray, opaque: float, metallic: float) -> np.ndarray:
        """(TERMS, 3), of a whole surface."""
        under = self.diffuse / self.angles.albedo  # the share of light that the layer lets through
        reflected = opaque * base * under * self.angles.reflected
        # What is mirrored rises as the third term does.
        mirrored = opaque * self.specular_grazing + metallic * self.metal_grazing
        reflected[2] += mirrored / MEANS[2]
        return reflected

    def coated(self, weight: float, roughness: float, ior: float, mirrors: bool
               ) -> PrincipledAlbedo:
        """Under a coat, which is there from 4.0 on: what it mirrors is missing from what lies
        beneath. Its tint is not read."""
        weight = min(max(weight, 0.0), 1.0)
        if weight == 0.0:
            return self
        f0 = min(((ior - 1.0) / (ior + 1.0))**2, 0.99)
        mirrored, above = (weight * float(gloss_albedo(roughness, ior, from_above).of(f0))
                           for from_above in (False, True))
        under, shown = 1.0 - mirrored, self.shown * (1.0 - above)
        if not mirrors:
            mirrored = above = 0.0
        return PrincipledAlbedo(
            self.angles, shown, self.diffuse * under,
            self.specular * under + mirrored, self.specular_grazing * under + mirrored - above,
            self.metal * under, self.metal_edge * under + mirrored,
            self.metal_grazing * under + mirrored - above)


def principled_albedo(roughness: float, specular: float, ior: float, diffuse_roughness: float,
                      multiple: bool, base: np.ndarray | float, mirrors: bool) -> PrincipledAlbedo:
    """Values of the sockets (specular: Specular or Specular IOR Level); multiple: whether the
    distribution is Multiscatter GGX; base: the base colour, by which light is lost where it meets
    several facets. mirrors: whether diffuse light sees gloss at all."""
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
        angles = burley(roughness)
    diffuse = under * angles.albedo
    if not mirrors:
        return PrincipledAlbedo(angles, shown, diffuse)
    metal, metal_above = (
        gloss_albedo(roughness, METAL_IOR if is_layered else ior_of(f0), from_above, is_layered)
        for from_above in (False, True))
    gain = metal.of(base, multiple) / np.maximum(metal.of(base), 1e-6)
    return PrincipledAlbedo(
        angles, shown, diffuse, reflected, reflected - reflected_above,
        (metal.white - metal.edge) * gain, metal.edge * gain,
        metal.of(base, multiple) - metal_above.of(base, multiple))
