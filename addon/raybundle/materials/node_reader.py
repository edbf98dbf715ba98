# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the shaders of node trees of materials, lamps and the world as a Surface.

A Surface contains the quantities that radiosity uses: the reflectance, its diffuse part, the
directions in which the reflected light leaves, the transmitted light, and the emission. A tree is
read from its output towards its inputs. If a value cannot be read, the value of the socket (or the
mean of the image) is used and a warning names the node.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy
import numpy as np

from ..image_export import ImagePixels
from ..messages import Message
from ..scene_data import Warnings
from .color_expression import WHITE, ColorExpression, Result
from .color_reader import ColorReader, Reading
from .gloss import gloss_albedo, seen_roughness
from .layers import Layer, microfibers, velvet
from .node_links import default_color, default_value, follow, input_of
from .principled import (COAT_SOCKETS, COAT_TINT, GLOSS_SOCKETS, SHEEN_SOCKETS, SHEEN_TINT,
                         SPECULAR_TINT, PrincipledSockets, principled_albedo, sheen_on)
from .scattering import BURLEY, OREN_NAYAR, Scattering
from .surface import Surface

# Types of shaders that mirror and have no diffuse part.
GLOSSY = ('BSDF_GLOSSY', 'BSDF_ANISOTROPIC', 'BSDF_METALLIC')
# Types of shaders that correspond to one of the layers of layers.py.
CLOTH = ('BSDF_SHEEN', 'BSDF_VELVET')
# Names of a socket, by Blender version, and the value that is assumed if the input varies or is
# missing.
CLOTH_ROUGHNESS = ('Roughness', 'Sigma'), 0.5
EDGE_TINT = ('Edge Tint',), 1.0  # of the Metallic shader
MIRRORS = Message("mirrors light: it lights other surfaces as if its roughness were at least "
                  "0.45")


class NodeReader(ColorReader):
    """Reads the shaders of one node tree, for one side of a surface.

    ColorReader describes the parameters, and how nodes that cannot be read are handled.
    """

    def __init__(self, owner: Message, images: ImagePixels, warnings: Warnings,
                 reading: Reading = Reading(), inexact: Warnings | None = None) -> None:
        super().__init__(owner, images, warnings, reading, inexact)
        # The highest Result of the colours of reflecting and transmitting shaders.
        self.color_result = Result.NONE
        self.emits_result = False  # whether a shader emits the result of a bake
        self.tells_emission = False  # whether a shader has an emission colour, at any strength

    @property
    def shows_result(self) -> bool:
        """Returns whether any value that was read depends on the result of a bake."""
        return bool(self.color_result or self.emits_result or self._result_values)

    def shows_only_result(self, surface: Surface) -> bool:
        """Returns whether the tree shows only the result of a bake, so that the surface's own
        colour is unknown. surface: the return value of surface() for the tree."""
        if self.color_result == Result.ALONE:
            return True
        own = surface.diffuse, surface.translucence, surface.radiance
        return self.emits_result and not any(np.any(color.mean() > 0.0) for color in own)

    def surface(self, socket: bpy.types.NodeSocket,
                path: tuple[bpy.types.Node, ...] = ()) -> Surface:
        """Returns the surface of the shader that is linked to an input. If nothing is linked, the
        surface is black, as in Cycles. path: see node_links.follow."""
        source = follow(socket, path)
        node, path = source.node, source.path
        if node is None:
            return Surface()
        if node.type == 'BSDF_DIFFUSE':
            return Surface.matt(self._own_color(node.inputs['Color'], path),
                                self._usual(node, *GLOSS_SOCKETS[0], path))
        if node.type == 'BSDF_PRINCIPLED':
            return self._principled(node, path)
        if node.type in GLOSSY:
            self._warn(node, MIRRORS)
            return self._glossy(node, path)
        if node.type in ('EMISSION', 'BACKGROUND'):
            return Surface(
                radiance=self._radiance(node.inputs['Color'], node.inputs['Strength'], path))
        if node.type == 'BSDF_TRANSPARENT':
            return Surface(transmittance=self._transmitted(node, node.inputs['Color'], path))
        if node.type == 'BSDF_TRANSLUCENT':
            return Surface(translucence=self._own_color(node.inputs['Color'], path))
        if node.type in ('BSDF_GLASS', 'BSDF_REFRACTION'):
            self._warn(node, Message("lets light through: the light passes straight through, and "
                                     "none is reflected"))
            return Surface(transmittance=self._transmitted(node, node.inputs['Color'], path))
        if node.type == 'MIX_SHADER':
            factor = float(np.clip(self.value(node.inputs[0], path), 0.0, 1.0))
            # A branch of weight 0 is not read, so that its nodes cause no warnings.
            parts = [self.surface(node.inputs[index], path).scaled(share)
                     for index, share in ((1, 1.0 - factor), (2, factor)) if share > 0.0]
            return self._sum(parts, node)
        if node.type == 'ADD_SHADER':
            return self._sum([self.surface(socket, path) for socket in node.inputs], node)
        if node.type in CLOTH:
            return self._cloth(node, path)
        if node.type == 'SUBSURFACE_SCATTERING':
            self._warn(node, Message("is read as a diffuse surface"))
            return Surface.matt(self._own_color(node.inputs['Color'], path))
        self._warn(node, Message("is not supported: it reflects nothing and blocks light"))
        return Surface()

    def _principled(self, node: bpy.types.Node, path: tuple[bpy.types.Node, ...]) -> Surface:
        # Sockets were renamed in 4.0.
        transmission = input_of(node, 'Transmission Weight', 'Transmission')
        emission = input_of(node, 'Emission Color', 'Emission')
        alpha = float(np.clip(self.value(node.inputs['Alpha'], path), 0.0, 1.0))
        radiance = self._radiance(emission, node.inputs['Emission Strength'], path)
        base = self._base_color(node, path)
        metallic = float(np.clip(self.value(node.inputs['Metallic'], path), 0.0, 1.0))
        if metallic > 0.0:
            self._warn(node, MIRRORS)
        through = float(np.clip(self.value(transmission, path), 0.0, 1.0)) * (1.0 - metallic)
        if through > 0.0:
            self._warn(node, Message("lets light through: the light passes straight through"))
        mean = np.clip(base.mean(), 0.0, 1.0)
        sockets = PrincipledSockets(
            *self._values(node, GLOSS_SOCKETS, path), node.distribution == 'MULTI_GGX', mean,
            self._usual_color(node, *SPECULAR_TINT, path))
        albedo = principled_albedo(sockets, self.reading.filter_glossy).coated(
            *self._values(node, COAT_SOCKETS, path), self._usual_color(node, *COAT_TINT, path),
            self.reading.filter_glossy)
        opaque = 1.0 - metallic - through
        several = metallic * albedo.several
        mirrored = base.scaled(metallic * albedo.metal - several[0]).plus(ColorExpression(
            opaque * albedo.specular + metallic * albedo.metal_edge - several[1]))
        shown = opaque * albedo.shown
        scattering = Scattering.mirror(
            mirrored, albedo.mirrored_by_angle(opaque, metallic), albedo.roughness).plus(
                Scattering.matt(
                    opaque * mean, OREN_NAYAR if bpy.app.version >= (4, 0, 0) else BURLEY,
                    albedo.diffuse_roughness, albedo.leaving)).plus(
                        Scattering.several_facets(
                            mean * several[0] + several[1], metallic * albedo.several_by_angle,
                            albedo.roughness))
        surface = Surface(
            mirrored.plus(base.scaled(opaque * albedo.diffuse + several[0])).plus(
                ColorExpression(several[1])), radiance.scaled(albedo.uncoated),
            through * mean * albedo.uncoated, base.scaled(shown),
            albedo.reflected_by_angle(mean, opaque, metallic),
            np.maximum(base.mean(), 0.0) * shown * albedo.angles.shown,
            scattering=scattering)
        surface = surface.covered(*sheen_on(*self._values(node, SHEEN_SOCKETS, path),
                                            self._usual_color(node, *SHEEN_TINT, path), mean,
                                            opaque)).scaled(alpha)
        return replace(surface, transmittance=surface.transmittance + WHITE * (1.0 - alpha))

    def _cloth(self, node: bpy.types.Node, path: tuple[bpy.types.Node, ...]) -> Surface:
        color = self._own_color(node.inputs['Color'], path)
        layer = cloth_layer(node, self._usual(node, *CLOTH_ROUGHNESS, path))
        surface = Surface().covered(layer, np.maximum(color.mean(), 0.0))
        return replace(surface, reflectance=color.scaled(layer.albedo),
                       diffuse=color.scaled(layer.above))

    def _base_color(self, node: bpy.types.Node, path: tuple[bpy.types.Node, ...]
                    ) -> ColorExpression:
        """Returns the base colour. Before Blender 4.0, subsurface scattering has a colour of its
        own, which is mixed in by its weight."""
        base = self._own_color(node.inputs['Base Color'], path)
        if 'Subsurface Color' not in node.inputs:
            return base
        share = float(np.clip(self.value(node.inputs['Subsurface'], path), 0.0, 1.0))
        if share == 0.0:
            return base
        under = self._own_color(node.inputs['Subsurface Color'], path)
        return self._plus(base.scaled(1.0 - share), under.scaled(share), node)

    def _glossy(self, node: bpy.types.Node, path: tuple[bpy.types.Node, ...]) -> Surface:
        if self.reading.filter_glossy is None:
            return Surface()
        color = self._own_color(input_of(node, 'Color', 'Base Color'), path)
        roughness = self._usual(node, *GLOSS_SOCKETS[0], path)
        mean = np.maximum(np.clip(color.mean(), 0.0, 1.0), 1e-6)
        gloss = glossy_albedo(node, roughness, mean, self.reading.filter_glossy,
                              self._usual_color(node, *EDGE_TINT, path))
        several_by_angle = gloss.several[:, None] * gloss.again
        return Surface(
            color.scaled((gloss.once + gloss.again) / mean),
            reflected_by_angle=gloss.by_angle + several_by_angle,
            scattering=Scattering.mirror(
                color.scaled(gloss.once / mean), gloss.by_angle, gloss.roughness).plus(
                    Scattering.several_facets(gloss.again, several_by_angle, gloss.roughness)))

    def _usual(self, node: bpy.types.Node, names: tuple[str, ...], usual: float,
               path: tuple[bpy.types.Node, ...]) -> float:
        """Returns the value of the input with the first of the names that exists. If the value
        varies, or if no input has one of the names, `usual` is returned, because these values alone
        are not worth a bake by Cycles."""
        if not any(name in node.inputs for name in names):
            return usual
        source = follow(input_of(node, *names), path)
        if source.node is None:
            return default_value(source.socket)
        return source.output.default_value if source.node.type == 'VALUE' else usual

    def _values(self, node: bpy.types.Node, sockets: tuple[tuple[tuple[str, ...], float], ...],
                path: tuple[bpy.types.Node, ...]) -> list[float]:
        return [self._usual(node, names, usual, path) for names, usual in sockets]

    def _usual_color(self, node: bpy.types.Node, names: tuple[str, ...], usual: float,
                     path: tuple[bpy.types.Node, ...]) -> np.ndarray:
        """Returns the colour of the input with the first of the names that exists, (3,) linear
        RGB. If the colour varies, or if there is no such input, grey of the value `usual` is
        returned."""
        if not any(name in node.inputs for name in names):
            return WHITE * usual
        source = follow(input_of(node, *names), path)
        if source.node is None:
            return default_color(source.socket)
        return default_color(source.output) if source.node.type == 'RGB' else WHITE * usual

    def _transmitted(self, node: bpy.types.Node, socket: bpy.types.NodeSocket,
                     path: tuple[bpy.types.Node, ...]) -> np.ndarray:
        color = self._own_color(socket, path)
        if not color.is_constant:
            self._inexact(node, Message("has a varying {socket}: its mean is used",
                                        socket=socket.name))
        return np.clip(color.mean(), 0.0, 1.0)

    def _sum(self, parts: list[Surface], node: bpy.types.Node) -> Surface:
        total = Surface()
        for part in parts:
            total = Surface(self._plus(total.reflectance, part.reflectance, node),
                            self._plus(total.radiance, part.radiance, node),
                            total.transmittance + part.transmittance,
                            total.diffuse.plus(part.diffuse).simplified(),
                            total.reflected_by_angle + part.reflected_by_angle,
                            total.shown_by_angle + part.shown_by_angle,
                            self._plus(total.translucence, part.translucence, node),
                            total.scattering.plus(part.scattering))
        return total

    def _own_color(self, socket: bpy.types.NodeSocket, path: tuple[bpy.types.Node, ...]
                   ) -> ColorExpression:
        """Returns the colour of a reflecting or transmitting shader, and updates color_result."""
        color = self.color(socket, path)
        self.color_result = max(self.color_result, color.result)
        return color

    def _radiance(self, color: bpy.types.NodeSocket, strength: bpy.types.NodeSocket,
                  path: tuple[bpy.types.Node, ...]) -> ColorExpression:
        """Returns colour times strength of an emission, W/(m^2 sr). Returns 0 if either is the
        result of a bake."""
        values, inexact, unread = self._result_values, len(self.inexact), len(self.unread)
        factor = self.value(strength, path)
        radiance = self._emission_color(color, path).scaled(factor) if factor else ColorExpression()
        if not radiance.result and self._result_values == values:
            # From Blender 4.0 on, a new Principled shader emits white with a strength of 0. This
            # colour is a default, not a choice of the user.
            is_usual = (color.node.type == 'BSDF_PRINCIPLED' and bpy.app.version >= (4, 0, 0)
                        and factor == 0.0)
            self.tells_emission |= not is_usual and bool(
                color.is_linked or np.any(default_color(color)))
            return radiance
        # A result is not a light source of the scene, whatever multiplies it. Nodes that could not
        # be read have no effect here, so their entries are removed.
        del self.inexact[inexact:], self.unread[unread:]
        self.emits_result = True
        return ColorExpression()

    def _emission_color(self, socket: bpy.types.NodeSocket,
                        path: tuple[bpy.types.Node, ...]) -> ColorExpression:
        """Returns the colour of an emission. Unless reading.varying_emission is set, a varying
        colour is replaced by its mean, with a warning, because lamps and the world have one
        radiance."""
        color = self.color(socket, path)
        if color.is_constant or self.reading.varying_emission:
            return color
        self._warn(socket.node, Message("has a varying {socket}: its mean is used",
                                        socket=socket.name))
        return ColorExpression(color.mean(), result=color.result)


@dataclass(frozen=True)
class Glossy:
    """Shares of diffuse light, linear RGB, that a shader of one of the types GLOSSY reflects."""

    once: np.ndarray  # (3,), light that is reflected by one facet
    by_angle: np.ndarray  # (TERMS, 3), dependence of `once` on the angle of the light
    again: np.ndarray  # (3,), light that is reflected by several facets in turn
    several: np.ndarray  # (TERMS,), dependence of `again` on the angle; see GlossAlbedo
    roughness: float  # 0 to 1, applies to diffuse light


def glossy_albedo(node: bpy.types.Node, roughness: float, color: np.ndarray, filter_glossy: float,
                  tint: np.ndarray) -> Glossy:
    """Returns the shares of diffuse light that a shader of one of the types GLOSSY reflects.

    roughness: 0 to 1, of the socket. color: (3,) linear RGB, 0 to 1. filter_glossy: Cycles'
    setting, which increases the roughness for light that one facet reflects. Light that several
    facets reflect keeps the roughness of the socket. tint: (3,), of the edge, only used for the
    Metallic shader.
    """
    if node.distribution == 'SHARP':
        roughness = 0.0
    seen = seen_roughness(roughness, filter_glossy)
    albedos = []
    for value in (roughness, seen):
        albedo = gloss_albedo(value, None, correlated=bpy.app.version >= (4, 0, 0))
        if node.type != 'BSDF_METALLIC':
            # The shader has the same colour at all angles.
            albedo = replace(albedo, edge=0.0, angles=albedo.angles * [[1.0], [0.0], [1.0]])
        albedos.append(albedo)
    of_socket, of_seen = albedos
    once = of_seen.of(color, tint=tint)
    gain = of_socket.gain(color, node.distribution == 'MULTI_GGX', tint)
    return Glossy(once, of_seen.by_angle(color, tint), once * (gain - 1.0), of_socket.several, seen)


def cloth_layer(node: bpy.types.Node, roughness: float) -> Layer:
    """Returns the layer of a Sheen shader, or of a Velvet shader before Blender 4.0. roughness: 0
    to 1, or Velvet's Sigma."""
    if node.type == 'BSDF_VELVET' or node.distribution == 'ASHIKHMIN':
        return velvet(roughness)
    return microfibers(roughness)
