# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's Principled shader is to diffuse light, by version, apart from its base colour.

Before 4.0 (Burley, "Physically-Based Shading at Disney", 2012) the specular layer lies on top of a
diffuse part that reflects more where it is rough. From 4.0 on the diffuse part is Lambert's, and
what the specular layer reflects is missing from it; the layer's reflectance follows the index of
refraction.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from .gloss import gloss_albedo, ior_of

# Names of the sockets that gloss depends on, the first arguments of principled_albedo, and what they
# count as where they vary.
GLOSS_SOCKETS = ((('Roughness',), 0.5), (('Specular IOR Level', 'Specular'), 0.5),
                 (('IOR',), 1.5))
METAL_IOR = 1.5  # of the increase towards grazing angles


@dataclass(frozen=True)
class PrincipledAlbedo:
    """Shares of the light. With o = (1 - metallic) (1 - transmission) and m = metallic:

    reflectance = base (o diffuse + m metal) + o specular + m metal_edge, of which
    base o shown is the diffuse colour that is seen from straight above. Of light that comes from
    there base o diffuse_grazing + o specular_grazing + m metal_grazing less is reflected.
    """

    diffuse: float
    shown: float
    diffuse_grazing: float
    specular: float = 0.0
    specular_grazing: float = 0.0
    metal: np.ndarray | float = 0.0
    metal_edge: np.ndarray | float = 0.0
    metal_grazing: np.ndarray | float = 0.0


def principled_albedo(roughness: float, specular: float, ior: float, multiple: bool,
                      base: np.ndarray | float, mirrors: bool) -> PrincipledAlbedo:
    """Values of the sockets (specular: Specular or Specular IOR Level); multiple: whether the
    distribution is Multiscatter GGX; base: the base colour, by which a metal loses light where it
    meets several facets. mirrors: whether diffuse light sees gloss at all."""
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
        diffuse, shown, diffuse_grazing = 1.0 - reflected, 1.0 - reflected_above, 0.0
    else:
        diffuse, shown = burley_albedo(roughness), burley_albedo_from_above(roughness)
        diffuse_grazing = diffuse - shown
    if not mirrors:
        return PrincipledAlbedo(diffuse, shown, diffuse_grazing)
    metal, metal_above = (
        gloss_albedo(roughness, METAL_IOR if is_layered else ior_of(f0), from_above, is_layered)
        for from_above in (False, True))
    gain = metal.of(base, multiple) / np.maximum(metal.of(base), 1e-6)
    return PrincipledAlbedo(
        diffuse, shown, diffuse_grazing, reflected, reflected - reflected_above,
        (metal.white - metal.edge) * gain, metal.edge * gain,
        metal.of(base, multiple) - metal_above.of(base, multiple))


def burley_albedo(roughness: float) -> float:
    """The mean over all directions. The parabola is within 1e-4 of the integral."""
    roughness = min(max(roughness, 0.0), 1.0)
    return 0.95295 + roughness * (0.10870 + 0.00352 * roughness)


def burley_albedo_from_above(roughness: float) -> float:
    """In light from everywhere: 1 + the integral of 2 c (r - 1/2 + r c) (1 - c)^5, c from 0 to 1."""
    roughness = min(max(roughness, 0.0), 1.0)
    return 1.0 + (roughness - 0.5) / 21.0 + roughness / 84.0
