# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads colours and values of node trees, as far as a ColorExpression can represent them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import bpy
import numpy as np
from mathutils import Euler, Matrix

from ..image_export import ImagePixels, sphere_mean
from ..messages import Message, quoted
from ..scene_data import Warnings
from .color_expression import IDENTITY_UV, WHITE, ColorExpression, Result, Texture
from .node_links import LIGHT_PATH, Source, default_color, default_value, follow, input_of
from .shown_results import reads_result

# Nodes that change a colour by a non-linear formula. ColorRamp and RGB to BW are evaluated for
# constant colours. For all others, the input colour is used unchanged.
_COLOR_FILTERS = ('GAMMA', 'HUE_SAT', 'BRIGHTCONTRAST', 'INVERT', 'CURVE_RGB', 'VALTORGB',
                  'RGBTOBW', 'CLAMP')
# Nodes whose output is a number.
_VALUE_NODES = ('VALUE', 'NEW_GEOMETRY', 'LIGHT_PATH', 'LIGHT_FALLOFF', 'MATH')

# The operations of the Math node that are evaluated.
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


@dataclass(frozen=True)
class Reading:
    """The side of a surface for which a node tree is read, and settings that apply to the
    reading."""

    backfacing: bool = False  # True: back side; value of the Backfacing output of Geometry
    varying_emission: bool = False  # False: emission is replaced by its mean
    filter_glossy: float | None = 1.0  # see gloss.filter_glossy_of
    # (3,) linear RGB, used in place of colours that cannot be read. None: the socket's own colour
    # is used.
    unread_color: np.ndarray | None = None
    # Names of the attributes that hold results of earlier bakes. A result counts as 0 if it is
    # emitted and as 1 if it is a factor. If a result alone is the colour of a surface, the socket's
    # own colour is used.
    results: frozenset[str] = frozenset()


# The colour that Cycles shows instead of an image that it cannot load.
_MISSING = np.array((1.0, 0.0, 1.0))


class ColorReader:
    """Reads the colours and values of one node tree, for one side of a surface.

    Approximations that every bake makes are added to `warnings`. Colours that a ColorExpression
    cannot represent are added to `inexact`, because Cycles can bake them into images
    (cycles_bake.py). `inexact` is the same list as `warnings` if it is not given.
    """

    def __init__(self, owner: Message, images: ImagePixels, warnings: Warnings,
                 reading: Reading = Reading(), inexact: Warnings | None = None) -> None:
        self.owner = owner  # the subject of warnings, such as 'material "Wall"'
        self.images = images
        self.warnings = warnings
        self.reading = reading
        self.has_backfacing = False  # whether any value that was read depends on the side
        self.inexact = warnings if inexact is None else inexact
        self.unread: list[str] = []  # the nodes that `inexact` names
        self._result_values = 0  # how often the result of a bake was read as a number

    # ----------------------------------------------------------------------------------------------
    # Colours
    # ----------------------------------------------------------------------------------------------

    def color(self, socket: bpy.types.NodeSocket,
              path: tuple[bpy.types.Node, ...] = ()) -> ColorExpression:
        """Returns the colour of an input: the colour of the node that is linked to the input, or
        the input's own colour. path: see node_links.follow."""
        values = self._result_values
        color = self._read_color(follow(socket, path))
        if self._result_values > values and not color.result:
            # A result that is read as a number, such as the factor of a mix, counts as a factor.
            color = replace(color, result=Result.FACTOR)
        return color

    def _read_color(self, source: Source) -> ColorExpression:
        node, path = source.node, source.path
        if node is None:
            return ColorExpression(default_color(source.socket))
        if reads_result(node, source.output, self.reading.results):
            return _only_result(source)
        if node.type == 'RGB':
            return ColorExpression(default_color(node.outputs[0]))
        if node.type == 'TEX_IMAGE':
            return self._image(node, source.output, path)
        if node.type == 'TEX_ENVIRONMENT':
            return self._environment(node, source.output)
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
        self._inexact(node, Message("cannot be read: the colour of the socket that it is linked to "
                                    "is used"))
        return ColorExpression(default_color(source.socket) if self.reading.unread_color is None
                               else self.reading.unread_color, result=behind)

    def _result_behind(self, node: bpy.types.Node, path: tuple[bpy.types.Node, ...]) -> Result:
        """Returns how a node that cannot be read depends on the result of a bake: ALONE if only
        results are linked to it, FACTOR if other nodes are also linked, NONE if no result is
        linked."""
        has_result = has_others = False
        pending, seen = [(node, path)], set()
        while pending and self.reading.results:
            current, path = pending.pop()
            if current in seen:
                continue
            seen.add(current)
            sources = [follow(socket, path) for socket in current.inputs]
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

    def _image(self, node: bpy.types.Node, output: bpy.types.NodeSocket,
               path: tuple[bpy.types.Node, ...]) -> ColorExpression:
        pixels = self.images.read(node.image) if node.image else None
        if pixels is None:
            return self._missing_image(node, output)
        mean = pixels.mean(axis=(0, 1), dtype=np.float64)
        if output.name != 'Color':
            self._inexact(node, Message("has a linked output {output}, which counts as 1",
                                        output=output.name))
            return ColorExpression(WHITE)
        if node.projection != 'FLAT':
            self._inexact(node, Message("has the projection {projection}: the mean of the image is "
                                        "used", projection=node.projection))
            return ColorExpression(mean)
        coordinates = self._coordinates(node.inputs['Vector'], path)
        if coordinates is None:
            self._inexact(node, Message("has coordinates other than a UV map: the mean of the "
                                        "image is used"))
            return ColorExpression(mean)
        extension = node.extension
        if extension not in ('REPEAT', 'EXTEND', 'CLIP'):
            self._inexact(node, Message("has the extension {extension}: REPEAT is used",
                                        extension=extension))
            extension = 'REPEAT'
        layer, matrix = coordinates
        return ColorExpression(texture=Texture(node.image, extension, mean, layer, matrix),
                               texture_weight=WHITE)

    def _coordinates(self, socket: bpy.types.NodeSocket, path: tuple[bpy.types.Node, ...]
                     ) -> tuple[str, np.ndarray] | None:
        """Returns the coordinates at which an image is read: the name of a UV map ("" for the
        active render UV map), and a (2, 3) affine map of its coordinates. Returns None if the
        coordinates are not a UV map, or if inputs of the Mapping node are linked."""
        source = follow(socket, path)
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
            second = np.array(matrix, float)[:2][:, [0, 1, 3]]
            return layer, second @ square
        return None

    def _missing_image(self, node: bpy.types.Node, output: bpy.types.NodeSocket
                       ) -> ColorExpression:
        self._warn(node, Message("has no image, or its file is missing: the magenta of Cycles is "
                                 "used; restore the file, or choose an image"))
        return ColorExpression(_MISSING if output.name == 'Color' else WHITE)

    def _environment(self, node: bpy.types.Node, output: bpy.types.NodeSocket) -> ColorExpression:
        pixels = self.images.read(node.image) if node.image else None
        if pixels is None:
            return self._missing_image(node, output)
        self._warn(node, Message("varies with the direction: its mean over the sphere is used"))
        if node.projection == 'MIRROR_BALL':
            return ColorExpression(pixels.mean(axis=(0, 1), dtype=np.float64))
        return ColorExpression(sphere_mean(pixels))

    def _attribute(self, node: bpy.types.Node) -> ColorExpression:
        if node.type == 'ATTRIBUTE' and node.attribute_type != 'GEOMETRY':
            self._inexact(node, Message("reads a property of the object: grey is used"))
            return ColorExpression(WHITE * 0.5)
        name = node.layer_name if node.type == 'VERTEX_COLOR' else node.attribute_name
        return ColorExpression(attribute=name, attribute_weight=WHITE)

    def _mix(self, node: bpy.types.Node, path: tuple[bpy.types.Node, ...]) -> ColorExpression:
        if node.type == 'MIX_RGB':
            factor, first, second = node.inputs[:3]
        elif node.data_type == 'RGBA':
            # The node has sockets of the same names for each data type, which only the identifier
            # distinguishes.
            sockets = {socket.identifier: socket for socket in node.inputs}
            factor, first, second = (
                sockets[name] for name in ('Factor_Float', 'A_Color', 'B_Color'))
        elif node.data_type == 'FLOAT':
            sockets = {socket.identifier: socket for socket in node.inputs}
            share = self.value(sockets['Factor_Float'], path)
            a, b = (self.value(sockets[name], path) for name in ('A_Float', 'B_Float'))
            return ColorExpression(WHITE * (a + (b - a) * share))
        else:
            self._inexact(node, Message("mixes values of type {type}: grey is used",
                                        type=node.data_type))
            return ColorExpression(WHITE * 0.5)
        share = float(np.clip(self.value(factor, path), 0.0, 1.0))
        a, b = self.color(first, path), self.color(second, path)
        if (Result.ALONE in (a.result, b.result)
                and node.blend_type not in ('MIX', 'ADD', 'SUBTRACT', 'MULTIPLY')):
            # The result of a bake is not a colour of the surface, so the other colour is used.
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
        self._inexact(node, Message("has the blend mode {mode}: its first colour is used",
                                    mode=node.blend_type))
        return replace(a, result=max(a.result, b.result))

    def _filter(self, node: bpy.types.Node, path: tuple[bpy.types.Node, ...]) -> ColorExpression:
        name = {'VALTORGB': 'Fac', 'CLAMP': 'Value'}.get(node.type, 'Color')
        color = self.color(input_of(node, name, 'Factor'), path)
        if color.result == Result.ALONE:
            return color
        if node.type == 'VALTORGB' and color.is_constant:
            return ColorExpression(np.array(node.color_ramp.evaluate(color.constant.mean())[:3]),
                                   result=color.result)
        if node.type == 'VALTORGB':
            self._inexact(node, Message("maps a colour that varies: the mean colour is mapped "
                                        "instead"))
            return ColorExpression(np.array(node.color_ramp.evaluate(color.mean().mean())[:3]),
                                   result=color.result)
        if node.type == 'RGBTOBW' and color.is_constant:
            return ColorExpression(WHITE * (color.constant @ [0.2126, 0.7152, 0.0722]),
                                   result=color.result)
        self._inexact(node, Message("is ignored: its input colour is used"))
        return color

    def _plus(self, a: ColorExpression, b: ColorExpression, node: bpy.types.Node
              ) -> ColorExpression:
        if not a.can_add(b):
            self._inexact(node, Message("adds two images or attributes: the mean of the second is "
                                        "used"))
        return a.plus(b).simplified()

    def _times(self, a: ColorExpression, b: ColorExpression, node: bpy.types.Node
               ) -> ColorExpression:
        if Result.ALONE in (a.result, b.result):
            return _times_result(a, b)
        if a.is_constant:
            return replace(b.scaled(a.constant), result=max(a.result, b.result))
        if not b.is_constant:
            self._inexact(node, Message("multiplies two images or attributes: the mean of the "
                                        "second is used"))
        return replace(a.scaled(b.mean()), result=max(a.result, b.result))

    # ----------------------------------------------------------------------------------------------
    # Values
    # ----------------------------------------------------------------------------------------------

    def value(self, socket: bpy.types.NodeSocket, path: tuple[bpy.types.Node, ...] = ()) -> float:
        """Returns the value of an input as a number. If the linked value varies over the surface,
        the input's own value is returned. path: see node_links.follow."""
        source = follow(socket, path)
        if source.node is None:
            return default_value(source.socket)
        return self._node_value(source)

    def _node_value(self, source: Source) -> float:
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
                self._warn(node, Message("is not a Quadratic falloff with Smooth 0: the light "
                                         "falls off with the square of the distance"))
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
        self._inexact(node, Message("is not a constant: the value of the socket {socket} that it "
                                    "is linked to is used", socket=source.socket.name))
        return default_value(source.socket)

    def _warn(self, node: bpy.types.Node, what: Message) -> None:
        self.warnings.add(Message("{owner}: {node} {what}", owner=self.owner, node=_said(node),
                                  what=what))

    def _inexact(self, node: bpy.types.Node, what: Message) -> None:
        self.unread.append(_said(node))
        self.inexact.add(Message("{owner}: {node} {what}", owner=self.owner, node=self.unread[-1],
                                 what=what))


def _said(node: bpy.types.Node) -> Message:
    """Returns a node as a part of a sentence. Blender itself translates the type of the node."""
    return Message("node {name} ({type})", name=quoted(node.name), type=Message(node.bl_label))


def _only_result(source: Source) -> ColorExpression:
    return ColorExpression(default_color(source.socket), result=Result.ALONE)


def _times_result(a: ColorExpression, b: ColorExpression) -> ColorExpression:
    """Returns the product of two colours, at least one of which is the result of a bake."""
    result, other = (a, b) if a.result == Result.ALONE else (b, a)
    # A factor of 1 or more is not a reflectance. It only sets the brightness at which the result is
    # shown.
    if other.result == Result.ALONE or other.is_constant and other.constant.max() >= 1.0:
        return result
    return replace(other, result=Result.FACTOR)
