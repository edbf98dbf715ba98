# SPDX-License-Identifier: GPL-3.0-or-later
"""Rewrites the node trees of materials so that they emit one of their own properties.

Cycles then evaluates the property by baking the emission (cycles_bake.py). Each shader is replaced
by an emission shader of its reflectance, of the diffuse part of its reflectance, of its radiance,
its transmittance or its translucence. Mixes and sums of shaders are kept, because all these
properties are linear in them. The formulas are those of node_reader.py, built from nodes. Links to
a socket become links to the formula, except for the sockets that gloss depends on (principled.py):
constants replace their links.
"""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np

from .diffuse_angles import facet_shares, oren_nayar
from .layers import Layer
from .node_reader import CLOTH, CLOTH_ROUGHNESS, EDGE_TINT, GLOSSY, cloth_layer, glossy_albedo
from .principled import (COAT_SOCKETS, COAT_TINT, GLOSS_SOCKETS, SHEEN_SOCKETS, SHEEN_TINT,
                         SPECULAR_TINT, PrincipledAlbedo, PrincipledSockets, principled_albedo,
                         sheen_on)
from .shown_results import reads_result

REFLECTANCE, DIFFUSE, RADIANCE, TRANSMITTANCE, TRANSLUCENCE = (
    'REFLECTANCE', 'DIFFUSE', 'RADIANCE', 'TRANSMITTANCE', 'TRANSLUCENCE')
# In the order in which they are baked. DIFFUSE equals REFLECTANCE, and need not be baked, if no
# shader has gloss, is cloth, or is diffuse with a roughness.
PROPERTIES = (REFLECTANCE, DIFFUSE, RADIANCE, TRANSMITTANCE, TRANSLUCENCE)
_USUAL_COLOR = 0.5  # grey that replaces a varying colour in the formulas of gloss

# A value in a rewritten tree: an output of a node, or a constant number or colour (a tuple).
_Value = object


class ShaderColors:
    """Rewrites node trees for one property, in place. The trees must be copies.

    Node groups are copied too. `groups` lists the copies, and the caller removes them.
    """

    def __init__(self, wanted: str, light_path: dict[str, float], backfacing: bool = False,
                 filter_glossy: float | None = 1.0, results: frozenset[str] = frozenset()
                 ) -> None:
        self.wanted = wanted  # one of PROPERTIES
        self.results = results  # names of attributes that hold results of bakes (shown_results.py)
        self.filter_glossy = filter_glossy  # see gloss.filter_glossy_of
        self.light_path = light_path  # values of the Light Path node's outputs; others are 0
        self.backfacing = backfacing  # value of the Backfacing output
        self.groups: list[bpy.types.NodeTree] = []
        self.found = False  # whether any shader may have the property
        self.has_backfacing = False  # whether the trees depend on the side
        self.has_gloss = False  # whether DIFFUSE may differ from REFLECTANCE

    def rewrite(self, tree: bpy.types.NodeTree) -> None:
        """Rewrites a tree and the groups in it. Volume and displacement are unlinked."""
        for node in list(tree.nodes):
            if node.type == 'GROUP' and node.node_tree is not None:
                node.node_tree = node.node_tree.copy()
                self.groups.append(node.node_tree)
                self.rewrite(node.node_tree)
            elif node.type == 'LIGHT_PATH':
                for output in node.outputs:
                    _replace(tree, output, self.light_path.get(output.name, 0.0))
            elif node.type == 'NEW_GEOMETRY' and node.outputs['Backfacing'].is_linked:
                self.has_backfacing = True
                _replace(tree, node.outputs['Backfacing'], float(self.backfacing))
            elif node.type in ('ATTRIBUTE', 'VERTEX_COLOR'):
                # The result of a bake emits no light, and as a factor it has no effect.
                for output in node.outputs:
                    if reads_result(node, output, self.results):
                        _replace(tree, output, 0.0 if self.wanted == RADIANCE else 1.0)
            elif node.type == 'OUTPUT_MATERIAL':
                for name in ('Volume', 'Displacement'):
                    for link in list(node.inputs[name].links):
                        tree.links.remove(link)
            elif _is_shader(node):
                self._rewrite_shader(tree, node)

    def _rewrite_shader(self, tree: bpy.types.NodeTree, node: bpy.types.Node) -> None:
        self.has_gloss |= (node.type == 'BSDF_PRINCIPLED' or node.type in GLOSSY + CLOTH
                           or node.type == 'BSDF_DIFFUSE' and _is_rough(node))
        build = _SHADERS.get((node.type, self.wanted))
        # A muted shader passes nothing on.
        if build is not None and not node.mute:
            color = build(_Formula(tree, self.filter_glossy), node)
            if not isinstance(color, tuple) or any(color):
                self.found = True
                emission = tree.nodes.new('ShaderNodeEmission')
                _set(tree, emission.inputs['Color'], color)
                for link in list(node.outputs[0].links):
                    tree.links.new(emission.outputs[0], link.to_socket)
        tree.nodes.remove(node)


def _is_shader(node: bpy.types.Node) -> bool:
    """Returns whether the node is a shader and not a mix or sum of shaders or a group."""
    return (any(item.type == 'SHADER' for item in node.outputs)
            and not any(item.type == 'SHADER' for item in node.inputs)
            and node.type not in ('GROUP', 'GROUP_INPUT', 'REROUTE'))


def _replace(tree: bpy.types.NodeTree, output: bpy.types.NodeSocket, value: float) -> None:
    """Replaces an output by a constant in all links."""
    targets = [link.to_socket for link in output.links]
    if not targets:
        return
    node = tree.nodes.new('ShaderNodeValue')
    node.outputs[0].default_value = value
    for target in targets:
        tree.links.new(node.outputs[0], target)


def _set(tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket, value: _Value) -> None:
    """Sets the value of an input: links the input to an output, or sets the input's own value to a
    constant."""
    if isinstance(value, bpy.types.NodeSocket):
        tree.links.new(value, socket)
    elif isinstance(value, tuple):
        # Colours have four components, vectors three.
        socket.default_value = (*value, 1.0)[:len(socket.default_value)]
    else:
        socket.default_value = value


class _Formula:
    """Adds the nodes of a formula to a tree. Operations on constants add no nodes and return
    constants."""

    def __init__(self, tree: bpy.types.NodeTree, filter_glossy: float | None) -> None:
        self.tree = tree
        self.filter_glossy = filter_glossy

    def value(self, node: bpy.types.Node, *names: str) -> _Value:
        """Returns the number, clamped to 0 to 1, of the node's input with the first name that
        exists."""
        value = self.raw(node, *names)
        if not isinstance(value, bpy.types.NodeSocket):
            return min(max(value, 0.0), 1.0)
        return self._math('ADD', value, 0.0)

    def raw(self, node: bpy.types.Node, *names: str) -> _Value:
        """Returns the value of the node's input with the first name that exists, without a
        clamp."""
        socket = next(node.inputs[name] for name in names if name in node.inputs)
        if socket.is_linked and not socket.links[0].is_muted:
            return socket.links[0].from_socket
        value = socket.default_value
        return tuple(value)[:3] if hasattr(value, '__len__') else float(value)

    def times(self, a: _Value, b: _Value) -> _Value:
        """Returns the product of two numbers."""
        if not isinstance(a, bpy.types.NodeSocket) and not isinstance(b, bpy.types.NodeSocket):
            return a * b
        return self._math('MULTIPLY', a, b, clamp=False)

    def rest(self, a: _Value) -> _Value:
        """Returns 1 - a. a: a number."""
        if not isinstance(a, bpy.types.NodeSocket):
            return 1.0 - a
        return self._math('SUBTRACT', 1.0, a)

    def scaled(self, color: _Value, factor: _Value) -> _Value:
        """Returns a colour times a number."""
        if isinstance(color, tuple) and not isinstance(factor, bpy.types.NodeSocket):
            return tuple(component * factor for component in color)
        if factor == 0.0 or color == (0.0, 0.0, 0.0):
            return (0.0, 0.0, 0.0)
        node = self.tree.nodes.new('ShaderNodeVectorMath')
        node.operation = 'SCALE'
        _set(self.tree, node.inputs[0], color)
        _set(self.tree, node.inputs['Scale'], factor)
        return node.outputs[0]

    def plus(self, a: _Value, b: _Value) -> _Value:
        """Returns the sum of two colours."""
        if isinstance(a, tuple) and isinstance(b, tuple):
            return tuple(x + y for x, y in zip(a, b))
        return self.vector('ADD', a, b)

    def tinted(self, color: _Value, tint: np.ndarray) -> _Value:
        """Returns a colour times a constant colour, (3,), by channel."""
        if isinstance(color, tuple):
            return tuple(np.array(color) * tint)
        if np.ptp(tint) == 0.0:
            return self.scaled(color, float(tint[0]))
        return self.vector('MULTIPLY', color, tuple(tint))

    def vector(self, operation: str, a: _Value, b: _Value) -> _Value:
        """Adds a Vector Math node on two colours and returns its output. operation: its name in the
        node."""
        node = self.tree.nodes.new('ShaderNodeVectorMath')
        node.operation = operation
        _set(self.tree, node.inputs[0], a)
        _set(self.tree, node.inputs[1], b)
        return node.outputs[0]

    def _math(self, operation: str, a: _Value, b: _Value, clamp: bool = True) -> _Value:
        node = self.tree.nodes.new('ShaderNodeMath')
        node.operation, node.use_clamp = operation, clamp
        _set(self.tree, node.inputs[0], a)
        _set(self.tree, node.inputs[1], b)
        return node.outputs[0]


def _color(formula: _Formula, node: bpy.types.Node) -> _Value:
    return formula.raw(node, 'Color')


def _emission(formula: _Formula, node: bpy.types.Node) -> _Value:
    return formula.scaled(formula.raw(node, 'Color'), formula.raw(node, 'Strength'))


# Sockets were renamed in 4.0.
_TRANSMISSION = ('Transmission Weight', 'Transmission')


def _usual(formula: _Formula, node: bpy.types.Node, names: tuple[str, ...], usual: float) -> float:
    if not any(name in node.inputs for name in names):
        return usual
    value = formula.raw(node, *names)
    return usual if isinstance(value, bpy.types.NodeSocket) else value


def _values(formula: _Formula, node: bpy.types.Node,
            sockets: tuple[tuple[tuple[str, ...], float], ...]) -> list[float]:
    return [_usual(formula, node, names, usual) for names, usual in sockets]


def _usual_color(formula: _Formula, node: bpy.types.Node, names: tuple[str, ...], usual: float
                 ) -> np.ndarray:
    value = _usual(formula, node, names, usual)
    return np.array(value) if isinstance(value, tuple) else np.full(3, value)


def _is_rough(node: bpy.types.Node) -> bool:
    socket = node.inputs['Roughness']
    return socket.is_linked or socket.default_value > 0.0


def _rough_diffuse(formula: _Formula, node: bpy.types.Node) -> _Value:
    color = formula.raw(node, 'Color')
    roughness = _usual(formula, node, *GLOSS_SOCKETS[0])
    if isinstance(color, tuple):
        return tuple(np.array(color) * oren_nayar(roughness, np.array(color)).albedo)
    once, again = facet_shares(roughness)
    if again == 0.0:
        return formula.scaled(color, once)
    # Add light that several facets reflect in turn; see diffuse_angles.facet_shares.
    rest = formula.vector('SUBTRACT', (1.0, 1.0, 1.0), formula.scaled(color, 1.0 - once))
    cube = formula.vector('MULTIPLY', color, formula.vector('MULTIPLY', color, color))
    return formula.plus(formula.scaled(color, once),
                        formula.scaled(formula.vector('DIVIDE', cube, rest), again))


def _base_color(formula: _Formula, node: bpy.types.Node) -> _Value:
    base = formula.raw(node, 'Base Color')
    # Before 4.0, subsurface scattering has a colour of its own.
    if 'Subsurface Color' not in node.inputs:
        return base
    share = formula.value(node, 'Subsurface')
    if share == 0.0:
        return base
    return formula.plus(formula.scaled(base, formula.rest(share)),
                        formula.scaled(formula.raw(node, 'Subsurface Color'), share))


def _principled_albedo(formula: _Formula, node: bpy.types.Node) -> PrincipledAlbedo:
    sockets = PrincipledSockets(
        *_values(formula, node, GLOSS_SOCKETS), node.distribution == 'MULTI_GGX',
        float(_mean_base(formula, node).mean()), _usual_color(formula, node, *SPECULAR_TINT))
    return principled_albedo(sockets, formula.filter_glossy).coated(
        *_values(formula, node, COAT_SOCKETS), _usual_color(formula, node, *COAT_TINT),
        formula.filter_glossy)


def _mean_base(formula: _Formula, node: bpy.types.Node) -> np.ndarray:
    base = _base_color(formula, node)
    return np.array(base) if isinstance(base, tuple) else np.full(3, _USUAL_COLOR)


def _principled_shares(formula: _Formula, node: bpy.types.Node) -> tuple[_Value, _Value]:
    """Returns two shares of the surface: the share that is neither metal nor transmits light, and
    the share that is metal."""
    metallic = formula.value(node, 'Metallic')
    opaque = formula.times(formula.rest(metallic),
                           formula.rest(formula.value(node, *_TRANSMISSION)))
    return opaque, metallic


def _principled_reflectance(formula: _Formula, node: bpy.types.Node) -> _Value:
    albedo, base = _principled_albedo(formula, node), _base_color(formula, node)
    opaque, metal = _principled_shares(formula, node)
    color = formula.plus(
        formula.plus(formula.scaled(formula.tinted(base, albedo.diffuse), opaque),
                     formula.scaled(formula.tinted(base, albedo.metal), metal)),
        formula.plus(formula.scaled(tuple(albedo.specular), opaque),
                     formula.scaled(tuple(albedo.metal_edge), metal)))
    layer, sheen = _sheen(formula, node)
    return formula.scaled(_covered(formula, color, layer, sheen, layer.albedo),
                          formula.value(node, 'Alpha'))


def _principled_diffuse(formula: _Formula, node: bpy.types.Node) -> _Value:
    opaque, _ = _principled_shares(formula, node)
    base = formula.tinted(_base_color(formula, node), _principled_albedo(formula, node).shown)
    layer, sheen = _sheen(formula, node)
    return formula.scaled(
        _covered(formula, formula.scaled(base, opaque), layer, sheen, layer.above),
        formula.value(node, 'Alpha'))


def _sheen(formula: _Formula, node: bpy.types.Node) -> tuple[Layer, np.ndarray]:
    opaque, _ = _principled_shares(formula, node)
    return sheen_on(*_values(formula, node, SHEEN_SOCKETS),
                    _usual_color(formula, node, *SHEEN_TINT), _mean_base(formula, node),
                    1.0 if isinstance(opaque, bpy.types.NodeSocket) else opaque)


def _covered(formula: _Formula, color: _Value, layer: Layer, sheen: np.ndarray, albedo: float
             ) -> _Value:
    """Returns a colour under sheen. sheen: (3,), the colour of the layer. albedo: of the layer,
    over all directions or as seen from straight above."""
    return formula.plus(formula.scaled(color, 1.0 - layer.taken(sheen) * albedo),
                        tuple(sheen * albedo))


def _under_layers(formula: _Formula, node: bpy.types.Node) -> np.ndarray:
    """Returns the share of emission and of transmitted light that coat and sheen transmit, (3,)."""
    layer, sheen = _sheen(formula, node)
    return (_principled_albedo(formula, node).uncoated
            * (1.0 - layer.taken(sheen) * layer.albedo))


def _cloth(formula: _Formula, node: bpy.types.Node) -> _Value:
    return formula.scaled(formula.raw(node, 'Color'), _cloth_layer(formula, node).albedo)


def _cloth_diffuse(formula: _Formula, node: bpy.types.Node) -> _Value:
    return formula.scaled(formula.raw(node, 'Color'), _cloth_layer(formula, node).above)


def _cloth_layer(formula: _Formula, node: bpy.types.Node) -> Layer:
    return cloth_layer(node, _usual(formula, node, *CLOTH_ROUGHNESS))


def _glossy(formula: _Formula, node: bpy.types.Node) -> _Value:
    if formula.filter_glossy is None:
        return (0.0, 0.0, 0.0)
    color = formula.raw(node, 'Base Color' if 'Base Color' in node.inputs else 'Color')
    mean = max(float(np.mean(color)) if isinstance(color, tuple) else _USUAL_COLOR, 1e-6)
    gloss = glossy_albedo(node, _usual(formula, node, *GLOSS_SOCKETS[0]), np.full(3, mean),
                          formula.filter_glossy, _usual_color(formula, node, *EDGE_TINT))
    return formula.tinted(color, (gloss.once + gloss.again) / mean)


def _principled_radiance(formula: _Formula, node: bpy.types.Node) -> _Value:
    strength = formula.times(formula.raw(node, 'Emission Strength'), formula.value(node, 'Alpha'))
    color = formula.tinted(formula.raw(node, 'Emission Color', 'Emission'),
                           _under_layers(formula, node))
    return formula.scaled(color, strength)


def _principled_transmittance(formula: _Formula, node: bpy.types.Node) -> _Value:
    alpha = formula.value(node, 'Alpha')
    through = formula.times(formula.value(node, *_TRANSMISSION),
                            formula.rest(formula.value(node, 'Metallic')))
    return formula.plus(
        formula.scaled((1.0, 1.0, 1.0), formula.rest(alpha)),
        formula.scaled(
            formula.tinted(formula.raw(node, 'Base Color'), _under_layers(formula, node)),
            formula.times(alpha, through)))


# The formula of a property by type of shader. A shader that is not listed has the value 0.
_SHADERS: dict[tuple[str, str], Callable[[_Formula, bpy.types.Node], _Value]] = {
    ('BSDF_DIFFUSE', REFLECTANCE): _rough_diffuse,
    ('BSDF_DIFFUSE', DIFFUSE): _color,
    ('SUBSURFACE_SCATTERING', REFLECTANCE): _color,
    ('SUBSURFACE_SCATTERING', DIFFUSE): _color,
    ('EMISSION', RADIANCE): _emission,
    ('BSDF_TRANSPARENT', TRANSMITTANCE): _color,
    ('BSDF_GLASS', TRANSMITTANCE): _color,
    ('BSDF_REFRACTION', TRANSMITTANCE): _color,
    ('BSDF_TRANSLUCENT', TRANSLUCENCE): _color,
    ('BSDF_PRINCIPLED', REFLECTANCE): _principled_reflectance,
    ('BSDF_PRINCIPLED', DIFFUSE): _principled_diffuse,
    ('BSDF_PRINCIPLED', RADIANCE): _principled_radiance,
    ('BSDF_PRINCIPLED', TRANSMITTANCE): _principled_transmittance,
    **{(kind, REFLECTANCE): _glossy for kind in GLOSSY},
    **{(kind, REFLECTANCE): _cloth for kind in CLOTH},
    **{(kind, DIFFUSE): _cloth_diffuse for kind in CLOTH},
}
