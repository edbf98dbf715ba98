# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees of materials, lights and the world -> colours and shaders of the simple kind that
radiosity needs: reflectance, what of it is diffuse, where it goes, and emission.

A tree is read from its output towards its inputs. What cannot be read takes the value of the socket
(or the mean of the image) and is named in the warnings.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import bpy
import numpy as np
from mathutils import Euler, Matrix

from ..image_export import ImagePixels, sphere_mean
from ..scene_data import Warnings
from .color_expression import IDENTITY_UV, WHITE, ColorExpression, Result, Texture
from .gloss import gloss_albedo, seen_roughness
from .layers import Layer, microfibers, velvet
from .principled import (COAT_SOCKETS, COAT_TINT, GLOSS_SOCKETS, SHEEN_SOCKETS, SHEEN_TINT,
                         SPECULAR_TINT, PrincipledSockets, principled_albedo, sheen_on)
from .scattering import BURLEY, OREN_NAYAR, Scattering
from .shown_results import reads_result
from .surface import Surface

# Values of the Light Path node as diffuse light sees a surface.
LIGHT_PATH = {'Is Diffuse Ray': 1.0, 'Is Reflection Ray': 1.0, 'Ray Depth': 1.0,
               'Diffuse Depth': 1.0}

# Nodes that change a colour in a way that is not linear: exact for constants is not attempted.
_COLOR_FILTERS = ('GAMMA', 'HUE_SAT', 'BRIGHTCONTRAST', 'INVERT', 'CURVE_RGB', 'VALTORGB',
                  'RGBTOBW', 'CLAMP')

_MATH: dict[str, Callable[[float, float], float]] = {
    'ADD': lambda a, b: a + b,
    'SUBTRACT': lambda a, b: a - b,
    'MULTIPLY': lambda a, b: a * b,
    'DIVIDE': lambda a, b: a / b if b else 0.0,
    'MINIMUM': min,
    'MAXIMUM': max,
    'GREATER_THAN': lambda a, b: float(a > b),
    'LESS_THAN': lambda a, b: float(a < b),
    'POWER': lambda a, b: a ** b if a > 0.0 else 0.0,
    'ABSOLUTE': lambda a, b: abs(a),
    'SQRT': lambda a, b: math.sqrt(max(a, 0.0)),
}


# Shaders that are gloss alone.
GLOSSY = ('BSDF_GLOSSY', 'BSDF_ANISOTROPIC', 'BSDF_METALLIC')
# Those that are a layer alone; names of the socket of its roughness, and what it usually is.
CLOTH = ('BSDF_SHEEN', 'BSDF_VELVET')
CLOTH_ROUGHNESS = ('Roughness', 'Sigma'), 0.5
EDGE_TINT = ('Edge Tint',), 1.0  # of metals
MIRRORS = "mirrors: what it sends to other surfaces spreads here as by a roughness of 0.45 or more"


@dataclass(frozen=True)
class _Source:
    """Where a socket's value comes from: an output of a node, or (node None) the socket itself."""

    socket: bpy.types.NodeSocket
    path: tuple[bpy.types.Node, ...]
    node: bpy.types.Node | None = None
    output: bpy.types.NodeSocket | None = None


@dataclass(frozen=True)
class Reading:
    """For what a node tree is read."""

    backfacing: bool = False  # whether the side is the back: value of the Backfacing output
    varying_emission: bool = False  # whether emission may be more than a constant colour
    filter_glossy: float | None = 1.0  # see gloss.filter_glossy_of
    # (3,) linear RGB in place of colours that cannot be read; None: the colour of the socket.
    unread_color: np.ndarray | None = None
    # Names of the attributes that hold results of a bake. As emission they count 0 and as a factor
    # 1; where one alone is a surface's colour, that of the socket is used.
    results: frozenset[str] = frozenset()


class NodeReader:
    """Reads one tree for one side of the surface.

    What is only approximated goes to the warnings. What a node does and the reader cannot express
    goes to `inexact`, for there is another way to it (cycles_bake.py); by default it is a warning
    too.
    """

    def __init__(self, owner: str, images: ImagePixels, warnings: Warnings,
                 reading: Reading = Reading(), inexact: Warnings | None = None) -> None:
        self.owner = owner  # what warnings name, such as 'material "Wall"'
        self.images = images
        self.warnings = warnings
        self.reading = reading
        self.has_backfacing = False  # whether what was read depends on the side
        self.inexact = warnings if inexact is None else inexact
        self.unread: list[str] = []  # what is inexact, without the consequences
        self.color_result = Result.NONE  # the most that a shader's colour has of a result
        self.emits_result = False
        self.tells_emission = False  # whether a shader emits, or would if it were switched on
        self._result_values = 0  # how often a result was read as a value

    @property
    def shows_result(self) -> bool:
        return bool(self.color_result or self.emits_result or self._result_values)

    def shows_only_result(self, surface: Surface) -> bool:
        """Whether a surface that was read tells nothing of its own colour, and perhaps light."""
        if self.color_result == Result.ALONE:
            return True
        own = surface.diffuse, surface.translucence, surface.radiance
        return self.emits_result and not any(np.any(color.mean() > 0.0) for color in own)

    # ----------------------------------------------------------------------------------------------
    # Shaders
    # ----------------------------------------------------------------------------------------------

    def surface(self, socket: bpy.types.NodeSocket,
                path: tuple[bpy.types.Node, ...] = ()) -> Surface:
        """The shader linked to a socket; nothing linked is black, as in Cycles."""
        source = _follow(socket, path)
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
            self._warn(node, "lets light through: it goes straight on here, and nothing is "
                             "reflected")
            return Surface(transmittance=self._transmitted(node, node.inputs['Color'], path))
        if node.type == 'MIX_SHADER':
            factor = float(np.clip(self.value(node.inputs[0], path), 0.0, 1.0))
            # A branch that is not seen at all raises no warnings.
            parts = [self.surface(node.inputs[index], path).scaled(share)
                     for index, share in ((1, 1.0 - factor), (2, factor)) if share > 0.0]
            return self._sum(parts, node)
        if node.type == 'ADD_SHADER':
            return self._sum([self.surface(socket, path) for socket in node.inputs], node)
        if node.type in CLOTH:
            return self._cloth(node, path)
        if node.type == 'SUBSURFACE_SCATTERING':
            self._warn(node, "is read as a diffuse surface")
            return Surface.matt(self._own_color(node.inputs['Color'], path))
        self._warn(node, "is not diffuse: it reflects nothing and stops the light")
        return Surface()

    def _principled(self, node: bpy.types.Node, path: tuple[bpy.types.Node, ...]) -> Surface:
        # Sockets were renamed in 4.0.
        transmission = _input(node, 'Transmission Weight', 'Transmission')
        emission = _input(node, 'Emission Color', 'Emission')
        alpha = float(np.clip(self.value(node.inputs['Alpha'], path), 0.0, 1.0))
        radiance = self._radiance(emission, node.inputs['Emission Strength'], path)
        base = self._base_color(node, path)
        metallic = float(np.clip(self.value(node.inputs['Metallic'], path), 0.0, 1.0))
        if metallic > 0.0:
            self._warn(node, MIRRORS)
        through = float(np.clip(self.value(transmission, path), 0.0, 1.0)) * (1.0 - metallic)
        if through > 0.0:
            self._warn(node, "lets light through: it goes straight on here")
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
        """What is scattered under the surface has a colour of its own before 4.0."""
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
        color = self._own_color(_input(node, 'Color', 'Base Color'), path)
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
        """A value that is no reason to ask Cycles: where it varies, or no input has one of the
        names, it is the usual one."""
        if not any(name in node.inputs for name in names):
            return usual
        source = _follow(_input(node, *names), path)
        if source.node is None:
            return _default_value(source.socket)
        return source.output.default_value if source.node.type == 'VALUE' else usual

    def _values(self, node: bpy.types.Node, sockets: tuple[tuple[tuple[str, ...], float], ...],
                path: tuple[bpy.types.Node, ...]) -> list[float]:
        return [self._usual(node, names, usual, path) for names, usual in sockets]

    def _usual_color(self, node: bpy.types.Node, names: tuple[str, ...], usual: float,
                     path: tuple[bpy.types.Node, ...]) -> np.ndarray:
        """(3,), likewise."""
        if not any(name in node.inputs for name in names):
            return WHITE * usual
        source = _follow(_input(node, *names), path)
        if source.node is None:
            return _default_color(source.socket)
        return _default_color(source.output) if source.node.type == 'RGB' else WHITE * usual

    def _transmitted(self, node: bpy.types.Node, socket: bpy.types.NodeSocket,
                     path: tuple[bpy.types.Node, ...]) -> np.ndarray:
        color = self._own_color(socket, path)
        if not color.is_constant:
            self._inexact(node, f"has a varying {socket.name}: its mean is used")
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

    # ----------------------------------------------------------------------------------------------
    # Colours
    # ----------------------------------------------------------------------------------------------

    def color(self, socket: bpy.types.NodeSocket,
              path: tuple[bpy.types.Node, ...] = ()) -> ColorExpression:
        values = self._result_values
        color = self._read_color(_follow(socket, path))
        if self._result_values > values and not color.result:
            # As the share of a mix, say.
            color = replace(color, result=Result.FACTOR)
        return color

    def _read_color(self, source: _Source) -> ColorExpression:
        node, path = source.node, source.path
        if node is None:
            return ColorExpression(_default_color(source.socket))
        if reads_result(node, source.output, self.reading.results):
            return _only_result(source)
        if node.type == 'RGB':
            return ColorExpression(_default_color(node.outputs[0]))
        if node.type == 'TEX_IMAGE':
            return self._image(node, source.output, path)
        if node.type == 'TEX_ENVIRONMENT':
            return self._environment(node)
        if node.type in ('ATTRIBUTE', 'VERTEX_COLOR') and source.output.name == 'Color':
            return self._attribute(node)
        if node.type in ('MIX', 'MIX_RGB'):
            return self._mix(node, path)
        if node.type in _COLOR_FILTERS:
            return self._filter(node, path)
        if node.type in _VALUE_NODES:
            values = self._result_values
            value = self._node_value(source)
            return (ColorExpression(WHITE * value) if self._result_values == values
                    else _only_result(source))
        behind = self._result_behind(node, path)
        if behind == Result.ALONE:
            return _only_result(source)
        self._inexact(node, "cannot be read: the colour of the socket it is linked to is used")
        return ColorExpression(_default_color(source.socket) if self.reading.unread_color is None
                               else self.reading.unread_color, result=behind)

    def _own_color(self, socket: bpy.types.NodeSocket, path: tuple[bpy.types.Node, ...]
                   ) -> ColorExpression:
        """Of what a shader does with light."""
        color = self.color(socket, path)
        self.color_result = max(self.color_result, color.result)
        return color

    def _radiance(self, color: bpy.types.NodeSocket, strength: bpy.types.NodeSocket,
                  path: tuple[bpy.types.Node, ...]) -> ColorExpression:
        values, inexact, unread = self._result_values, len(self.inexact), len(self.unread)
        factor = self.value(strength, path)
        radiance = self._emission_color(color, path).scaled(factor) if factor else ColorExpression()
        if not radiance.result and self._result_values == values:
            # A Principled shader that was just added is white and switched off from 4.0 on.
            is_usual = (color.node.type == 'BSDF_PRINCIPLED' and bpy.app.version >= (4, 0, 0)
                        and factor == 0.0)
            self.tells_emission |= not is_usual and bool(
                color.is_linked or np.any(_default_color(color)))
            return radiance
        # The light of a bake is none of the scene's, whatever it is multiplied by.
        del self.inexact[inexact:], self.unread[unread:]
        self.emits_result = True
        return ColorExpression()

    def _result_behind(self, node: bpy.types.Node, path: tuple[bpy.types.Node, ...]) -> Result:
        """What a node that cannot be read has of a result: ALONE if nothing else that is linked
        goes into it."""
        has_result = has_others = False
        pending, seen = [(node, path)], set()
        while pending and self.reading.results:
            current, path = pending.pop()
            if current in seen:
                continue
            seen.add(current)
            sources = [_follow(socket, path) for socket in current.inputs]
            linked = [source for source in sources if source.node is not None]
            has_others |= (not linked and current.type != 'VALUE'
                           or current.type.startswith('TEX_'))
            for source in linked:
                if reads_result(source.node, source.output, self.reading.results):
                    has_result = True
                else:
                    pending.append((source.node, source.path))
        if not has_result:
            return Result.NONE
        return Result.FACTOR if has_others else Result.ALONE

    def _emission_color(self, socket: bpy.types.NodeSocket,
                        path: tuple[bpy.types.Node, ...]) -> ColorExpression:
        """Where only constants are possible (lights, the world), the mean of what varies."""
        color = self.color(socket, path)
        if color.is_constant or self.reading.varying_emission:
            return color
        self._warn(socket.node, f"has a varying {socket.name}: its mean is used")
        return ColorExpression(color.mean(), result=color.result)

    def _image(self, node: bpy.types.Node, output: bpy.types.NodeSocket,
               path: tuple[bpy.types.Node, ...]) -> ColorExpression:
        pixels = self.images.read(node.image) if node.image else None
        if pixels is None:
            self._warn(node, "has no image data: black is used")
            return ColorExpression()
        mean = pixels.mean(axis=(0, 1), dtype=np.float64)
        if output.name != 'Color':
            self._inexact(node, f"is used by its {output.name}: 1 is used")
            return ColorExpression(WHITE)
        if node.projection != 'FLAT':
            self._inexact(node, f"is projected as {node.projection}: the image's mean is used")
            return ColorExpression(mean)
        coordinates = self._coordinates(node.inputs['Vector'], path)
        if coordinates is None:
            self._inexact(node, "has coordinates that are not a UV map: the image's mean is used")
            return ColorExpression(mean)
        extension = node.extension
        if extension not in ('REPEAT', 'EXTEND', 'CLIP'):
            self._inexact(node, f"has extension {extension}: REPEAT is used")
            extension = 'REPEAT'
        layer, matrix = coordinates
        return ColorExpression(texture=Texture(node.image, extension, mean, layer, matrix),
                               texture_weight=WHITE)

    def _coordinates(self, socket: bpy.types.NodeSocket, path: tuple[bpy.types.Node, ...]
                     ) -> tuple[str, np.ndarray] | None:
        """Name of the UV map ("" for the active one) and affine map (2, 3) of an image's vector."""
        source = _follow(socket, path)
        node, path = source.node, source.path
        if node is None:
            return "", IDENTITY_UV
        if node.type == 'UVMAP':
            return node.uv_map, IDENTITY_UV
        if node.type == 'TEX_COORD' and source.output.name == 'UV':
            return "", IDENTITY_UV
        if node.type == 'ATTRIBUTE' and source.output.name == 'Vector':
            return node.attribute_name, IDENTITY_UV
        if node.type == 'MAPPING' and node.vector_type in ('POINT', 'TEXTURE'):
            sockets = [node.inputs.get(name) for name in ('Location', 'Rotation', 'Scale')]
            inner = self._coordinates(node.inputs['Vector'], path)
            if inner is None or any(item.is_linked for item in sockets):
                return None
            location, rotation, scale = (item.default_value for item in sockets)
            matrix = Matrix.LocRotScale(location, Euler(rotation), scale)
            if node.vector_type == 'TEXTURE':
                matrix = matrix.inverted_safe()
            layer, first = inner
            square = np.vstack([first, [0.0, 0.0, 1.0]])
            second = np.array(matrix)[:2][:, [0, 1, 3]]
            return layer, second @ square
        return None

    def _environment(self, node: bpy.types.Node) -> ColorExpression:
        pixels = self.images.read(node.image) if node.image else None
        if pixels is None:
            self._warn(node, "has no image data: black is used")
            return ColorExpression()
        self._warn(node, "varies with the direction: its mean over the sphere is used")
        if node.projection == 'MIRROR_BALL':
            return ColorExpression(pixels.mean(axis=(0, 1), dtype=np.float64))
        return ColorExpression(sphere_mean(pixels))

    def _attribute(self, node: bpy.types.Node) -> ColorExpression:
        if node.type == 'ATTRIBUTE' and node.attribute_type != 'GEOMETRY':
            self._inexact(node, "reads a property of the object: grey is used")
            return ColorExpression(WHITE * 0.5)
        name = node.layer_name if node.type == 'VERTEX_COLOR' else node.attribute_name
        return ColorExpression(attribute=name, attribute_weight=WHITE)

    def _mix(self, node: bpy.types.Node, path: tuple[bpy.types.Node, ...]) -> ColorExpression:
        if node.type == 'MIX_RGB':
            factor, first, second = node.inputs[:3]
        elif node.data_type == 'RGBA':
            # One node has a set of sockets per data type, told apart by identifier.
            sockets = {socket.identifier: socket for socket in node.inputs}
            factor, first, second = (
                sockets[name] for name in ('Factor_Float', 'A_Color', 'B_Color'))
        elif node.data_type == 'FLOAT':
            sockets = {socket.identifier: socket for socket in node.inputs}
            share = self.value(sockets['Factor_Float'], path)
            a, b = (self.value(sockets[name], path) for name in ('A_Float', 'B_Float'))
            return ColorExpression(WHITE * (a + (b - a) * share))
        else:
            self._inexact(node, f"mixes {node.data_type}: grey is used")
            return ColorExpression(WHITE * 0.5)
        share = float(np.clip(self.value(factor, path), 0.0, 1.0))
        a, b = self.color(first, path), self.color(second, path)
        if (Result.ALONE in (a.result, b.result)
                and node.blend_type not in ('MIX', 'ADD', 'SUBTRACT', 'MULTIPLY')):
            # The result counts as not there.
            return a if a.result == b.result else replace(
                b if a.result == Result.ALONE else a, result=Result.FACTOR)
        if node.blend_type == 'MIX':
            return self._plus(a.scaled(1.0 - share), b.scaled(share), node)
        if node.blend_type == 'ADD':
            return self._plus(a, b.scaled(share), node)
        if node.blend_type == 'SUBTRACT':
            return self._plus(a, b.scaled(-share), node)
        if node.blend_type == 'MULTIPLY':
            return self._plus(a.scaled(1.0 - share), self._times(a, b, node).scaled(share), node)
        self._inexact(node, f"blends by {node.blend_type}: its first colour is used")
        return replace(a, result=max(a.result, b.result))

    def _filter(self, node: bpy.types.Node, path: tuple[bpy.types.Node, ...]) -> ColorExpression:
        name = {'VALTORGB': 'Fac', 'CLAMP': 'Value'}.get(node.type, 'Color')
        color = self.color(_input(node, name, 'Factor'), path)
        if color.result == Result.ALONE:
            return color
        if node.type == 'VALTORGB' and color.is_constant:
            return ColorExpression(np.array(node.color_ramp.evaluate(color.constant.mean())[:3]),
                                   result=color.result)
        if node.type == 'VALTORGB':
            self._inexact(node, "maps a varying colour: its value for the mean is used")
            return ColorExpression(np.array(node.color_ramp.evaluate(color.mean().mean())[:3]),
                                   result=color.result)
        if node.type == 'RGBTOBW' and color.is_constant:
            return ColorExpression(WHITE * (color.constant @ [0.2126, 0.7152, 0.0722]),
                                   result=color.result)
        self._inexact(node, "is left out: the colour that goes into it is used")
        return color

    def _plus(self, a: ColorExpression, b: ColorExpression, node: bpy.types.Node
              ) -> ColorExpression:
        if not a.can_add(b):
            self._inexact(node, "joins two images or attributes: the mean of the second is used")
        return a.plus(b).simplified()

    def _times(self, a: ColorExpression, b: ColorExpression, node: bpy.types.Node
               ) -> ColorExpression:
        if Result.ALONE in (a.result, b.result):
            return _times_result(a, b)
        if a.is_constant:
            return replace(b.scaled(a.constant), result=max(a.result, b.result))
        if not b.is_constant:
            self._inexact(node, "multiplies two images or attributes: the mean of the second is "
                                "used")
        return replace(a.scaled(b.mean()), result=max(a.result, b.result))

    # ----------------------------------------------------------------------------------------------
    # Values
    # ----------------------------------------------------------------------------------------------

    def value(self, socket: bpy.types.NodeSocket, path: tuple[bpy.types.Node, ...] = ()) -> float:
        source = _follow(socket, path)
        if source.node is None:
            return _default_value(source.socket)
        return self._node_value(source)

    def _node_value(self, source: _Source) -> float:
        node, path = source.node, source.path
        if reads_result(node, source.output, self.reading.results):
            self._result_values += 1
            return 1.0
        if node.type == 'VALUE':
            return node.outputs[0].default_value
        if node.type == 'NEW_GEOMETRY' and source.output.name == 'Backfacing':
            self.has_backfacing = True
            return float(self.reading.backfacing)
        if node.type == 'LIGHT_PATH':
            return LIGHT_PATH.get(source.output.name, 0.0)
        if node.type == 'LIGHT_FALLOFF':
            if source.output.name != 'Quadratic' or self.value(node.inputs['Smooth'], path):
                self._warn(node, f"is used as {source.output.name} with Smooth: the light falls "
                                 f"off with the square of the distance")
            return self.value(node.inputs['Strength'], path)
        if node.type == 'MATH' and node.operation in _MATH:
            a, b = (self.value(socket, path) for socket in node.inputs[:2])
            result = _MATH[node.operation](a, b)
            return min(max(result, 0.0), 1.0) if node.use_clamp else result
        if node.type in ('RGB', 'MIX', 'MIX_RGB', 'CLAMP'):
            color = self.color(source.socket, path)
            self._result_values += bool(color.result)
            if color.result == Result.ALONE:
                return 1.0
            if color.is_constant:
                return float(color.constant @ [0.2126, 0.7152, 0.0722])
        behind = self._result_behind(node, path)
        self._result_values += bool(behind)
        if behind == Result.ALONE:
            return 1.0
        self._inexact(node, f"is no constant: the value of the socket {source.socket.name} is "
                            f"used")
        return _default_value(source.socket)

    def _warn(self, node: bpy.types.Node, what: str) -> None:
        self.warnings.add(f'{self.owner}: node "{node.name}" ({node.bl_label}) {what}')

    def _inexact(self, node: bpy.types.Node, what: str) -> None:
        self.unread.append(f'node "{node.name}" ({node.bl_label})')
        self.inexact.add(f'{self.owner}: {self.unread[-1]} {what}')


_VALUE_NODES = ('VALUE', 'NEW_GEOMETRY', 'LIGHT_PATH', 'LIGHT_FALLOFF', 'MATH')


@dataclass(frozen=True)
class Glossy:
    """A Glossy shader's albedo of its colour, as diffuse light sees it."""

    once: np.ndarray  # (3,), by one facet, and (TERMS, 3) that by angle
    by_angle: np.ndarray
    again: np.ndarray  # (3,), what several facets add
    several: np.ndarray  # (TERMS,), see GlossAlbedo
    roughness: float


def glossy_albedo(node: bpy.types.Node, roughness: float, color: np.ndarray, filter_glossy: float,
                  tint: np.ndarray) -> Glossy:
    """color: (3,). tint: (3,), of the edge, which metals alone have. What several facets add has
    the roughness of the socket."""
    if node.distribution == 'SHARP':
        roughness = 0.0
    seen = seen_roughness(roughness, filter_glossy)
    albedos = []
    for value in (roughness, seen):
        albedo = gloss_albedo(value, None, correlated=bpy.app.version >= (4, 0, 0))
        if node.type != 'BSDF_METALLIC':
            # Of one colour at all angles.
            albedo = replace(albedo, edge=0.0, angles=albedo.angles * [[1.0], [0.0], [1.0]])
        albedos.append(albedo)
    of_socket, of_seen = albedos
    once = of_seen.of(color, tint=tint)
    gain = of_socket.gain(color, node.distribution == 'MULTI_GGX', tint)
    return Glossy(once, of_seen.by_angle(color, tint), once * (gain - 1.0), of_socket.several, seen)


def cloth_layer(node: bpy.types.Node, roughness: float) -> Layer:
    """Of a Sheen shader, or Velvet as it was before 4.0."""
    if node.type == 'BSDF_VELVET' or node.distribution == 'ASHIKHMIN':
        return velvet(roughness)
    return microfibers(roughness)


def output_node(tree: bpy.types.NodeTree) -> bpy.types.Node | None:
    """The active output that Cycles uses."""
    return tree.get_output_node('CYCLES') or tree.get_output_node('ALL')


def _follow(socket: bpy.types.NodeSocket, path: tuple[bpy.types.Node, ...]) -> _Source:
    """Go upstream through reroutes, muted nodes and groups. path: the group nodes we are inside."""
    while socket.is_linked:
        link = socket.links[0]
        if link.is_muted:
            break
        node, output = link.from_node, link.from_socket
        if node.mute:
            passed = [item.from_socket for item in node.internal_links
                      if item.to_socket == output]
            if not passed:
                break
            socket = passed[0]
        elif node.type == 'REROUTE':
            socket = node.inputs[0]
        elif node.type == 'GROUP' and node.node_tree:
            inner = _group_output(node.node_tree, output.identifier)
            if inner is None:
                break
            socket, path = inner, path + (node,)
        elif node.type == 'GROUP_INPUT' and path:
            group = path[-1]
            socket = next(item for item in group.inputs if item.identifier == output.identifier)
            path = path[:-1]
        else:
            return _Source(socket, path, node, output)
    return _Source(socket, path)


def _group_output(tree: bpy.types.NodeTree, identifier: str) -> bpy.types.NodeSocket | None:
    for node in tree.nodes:
        if node.type == 'GROUP_OUTPUT' and node.is_active_output:
            return next((item for item in node.inputs if item.identifier == identifier), None)
    return None


def _input(node: bpy.types.Node, *names: str) -> bpy.types.NodeSocket:
    return next(node.inputs[name] for name in names if name in node.inputs)


def _only_result(source: _Source) -> ColorExpression:
    return ColorExpression(_default_color(source.socket), result=Result.ALONE)


def _times_result(a: ColorExpression, b: ColorExpression) -> ColorExpression:
    """Of which one at least is a result."""
    result, other = (a, b) if a.result == Result.ALONE else (b, a)
    # What no surface has as a colour makes the result brighter or leaves it as it is.
    if other.result == Result.ALONE or other.is_constant and other.constant.max() >= 1.0:
        return result
    return replace(other, result=Result.FACTOR)


def _default_color(socket: bpy.types.NodeSocket) -> np.ndarray:
    value = getattr(socket, 'default_value', 0.0)
    # A colour or a vector has components, a plain value is grey.
    return np.array(value[:3]) if hasattr(value, '__len__') else WHITE * float(value)


def _default_value(socket: bpy.types.NodeSocket) -> float:
    value = getattr(socket, 'default_value', 0.0)
    if hasattr(value, '__len__'):
        return float(np.array(value[:3]) @ [0.2126, 0.7152, 0.0722])
    return float(value)
