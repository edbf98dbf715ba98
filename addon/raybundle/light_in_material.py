# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows baked light in the materials of the baked objects, and takes it out again.

Nodes are inserted into links: a mix of shaders before a material output, or a product before a
colour. One input of each inserted node is the link, or the value, that was there before. To take
the light out means to restore this input and to remove the inserted nodes, which carry the property
NODE_TAG. Nothing else is stored, so that changes that the user makes in between are kept. Slots
without a material that has nodes are filled meanwhile (filled_slots.py).

Camera rays see the light, and all other rays the original shader (by Light Path), so that shown
light lights nothing. glTF exporters recognise these nodes as an unlit material.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import bpy

from .filled_slots import empty_slots, fill_slots, has_nodes
from .messages import Message, quoted

# Custom property of the inserted nodes; its value is the way.
NODE_TAG = "raybundle_light"

EMISSION, COLORED, FACTOR = 'EMISSION', 'COLORED', 'FACTOR'
_SURFACE = 'SURFACE'  # the colour of the surface alone, for exporters

# An output and the input that it is linked to.
_Link = tuple[bpy.types.NodeSocket, bpy.types.NodeSocket]

# The colour of a surface by type of shader.
_COLORS = {'BSDF_PRINCIPLED': 'Base Color', 'BSDF_DIFFUSE': 'Color', 'BSDF_TRANSLUCENT': 'Color',
           'SUBSURFACE_SCATTERING': 'Color', 'EEVEE_SPECULAR': 'Base Color'}
_EMISSIONS = {'EMISSION': ('Color', 'Strength'),
              'BSDF_PRINCIPLED': ('Emission Color' if bpy.app.version >= (4, 0, 0) else 'Emission',
                                  'Emission Strength')}


@dataclass
class UseReport:
    """What was done with the materials of a scene."""

    materials: list[str] = field(default_factory=list)  # names of those that show the light now
    warnings: list[str] = field(default_factory=list)


def chosen_way(settings: bpy.types.PropertyGroup, shown_as: str = "") -> str:
    """Returns the way that a choice of how to show light stands for; "": the choice of the scene's
    settings. AUTO shows an output (LIGHTING, ...) as a render would: light on a white surface is
    multiplied by the colour of the surface."""
    shown_as = shown_as or settings.shown_as
    if shown_as != 'AUTO':
        return shown_as
    return EMISSION if settings.output == 'COMBINED' else COLORED


def use(scene: bpy.types.Scene, attribute: str, way: str) -> UseReport:
    """Shows a colour attribute in the materials of all objects of the scene that have it.

    way: EMISSION shows the attribute alone, COLORED the attribute times the colour of the surface,
    both unlit; FACTOR multiplies the colour of the surface, which lamps go on to light. Light that
    the materials show already is replaced.
    """
    take_out()
    report = UseReport()
    items = [item for item in scene.objects
             if item.type == 'MESH' and attribute in item.data.color_attributes]
    for item in items:
        if item.library is None and item.data.library is None:
            fill_slots(item)
    used: dict[bpy.types.Material, None] = {}
    for item in items:
        used.update(dict.fromkeys(slot.material for slot in item.material_slots if slot.material))
    for material in used:
        reason = _reason_to_leave(material, way)
        if reason is None:
            _insert(material.node_tree, attribute, way)
            report.materials.append(material.name)
        else:
            report.warnings.append(Message("{name} {reason}", name=quoted(material.name),
                                           reason=reason))
    report.warnings += _sharing_warnings(scene, attribute, used, report.materials)
    return report


def take_out() -> int:
    """Takes the light out of all materials of the file, and restores the slots that were filled.
    Returns the number of changed materials."""
    changed = 0
    for material in bpy.data.materials:
        if material.library is None and shows_light(material):
            _remove(material.node_tree)
            changed += 1
    empty_slots()
    return changed


def shows_light(material: bpy.types.Material) -> bool:
    """Returns whether nodes of `use` are in the material."""
    return material.node_tree is not None and bool(_tagged(material.node_tree))


def emits(material: bpy.types.Material) -> bool:
    """Returns whether a shader of the material emits light, other than light that is shown."""
    return has_nodes(material) and any(_emits(node) for node in _shaders(material.node_tree))


@contextmanager
def surfaces_exported() -> Iterator[set[str]]:
    """Bypasses the inserted nodes in the with block, and lets exporters see surface colours.

    Exporters read the colours of Principled shaders and of unlit materials. In the with block,
    other shaders are unlit in their own colour. Yields the names of their materials. Slots stay
    filled.
    """
    with _bypassed():
        changed: dict[str, bpy.types.NodeTree] = {}
        links: list[tuple[bpy.types.NodeTree, _Link]] = []
        try:
            for material in bpy.data.materials:
                if _needs_export_nodes(material):
                    tree = material.node_tree
                    changed[material.name] = tree
                    links += [(tree, (node.inputs['Surface'].links[0].from_socket,
                                      node.inputs['Surface'])) for node in _outputs(tree)
                              if node.inputs['Surface'].is_linked]
                    _insert(tree, "", _SURFACE)
            yield set(changed)
        finally:
            _relink(links)
            for tree in changed.values():
                _delete(tree, _tagged(tree, _SURFACE))


@contextmanager
def _bypassed() -> Iterator[None]:
    links: list[tuple[bpy.types.NodeTree, _Link]] = []
    try:
        for material in bpy.data.materials:
            if material.library is None and material.node_tree is not None:
                for node in _tagged(material.node_tree):
                    links += [(material.node_tree, link)
                              for link in _bypass(material.node_tree, node)]
        yield
    finally:
        _relink(links)


def _needs_export_nodes(material: bpy.types.Material) -> bool:
    if material.library is not None or not has_nodes(material):
        return False
    shaders = _shaders(material.node_tree)
    return (any(node.type in _COLORS for node in shaders) and not emits(material)
            and not any(node.type == 'BSDF_PRINCIPLED' for node in shaders))


# --------------------------------------------------------------------------------------------------
# What a material can show
# --------------------------------------------------------------------------------------------------


def _reason_to_leave(material: bpy.types.Material, way: str) -> Message | None:
    """Returns why the light cannot be shown in the material, and what to do. None: it can."""
    if material.library is not None or material.override_library is not None:
        return Message("is linked from another file and was left as it is: make it local, or use "
                       "the light in that file")
    tree = material.node_tree
    if not has_nodes(material):
        return Message("has no nodes and was left as it is: switch on Use Nodes")
    if not _outputs(tree):
        return Message("has no Material Output node and was left as it is: add one")
    if way == EMISSION:
        return None
    if way == COLORED and emits(material):
        return Message("emits light and was left as it is, because this light is not part of what "
                       "the attribute shows: bake the output Combined and show it as Light Alone")
    if not any(node.type in _COLORS for node in _shaders(tree)):
        return Message("has no shader with a surface colour outside of node groups and was left as "
                       "it is: bake the output Combined and show it as Light Alone")
    return None


def _sharing_warnings(scene: bpy.types.Scene, attribute: str,
                      used: dict[bpy.types.Material, None], shown: list[str]) -> list[str]:
    """Returns a line for each changed material that objects without the attribute have too."""
    sharing: dict[str, list[str]] = {}
    for item in scene.objects:
        if item.type != 'MESH' or attribute in item.data.color_attributes or item.hide_render:
            continue
        for slot in item.material_slots:
            if slot.material in used and slot.material.name in shown:
                sharing.setdefault(slot.material.name, []).append(item.name)
    return [Message("{name} is also the material of {objects} without the attribute {attribute}, "
                    "black now: bake them too, or give them another material", name=quoted(name),
                    objects=Message("{name} and {count} more objects", name=quoted(items[0]),
                                    count=len(items) - 1) if len(items) > 1 else quoted(items[0]),
                    attribute=quoted(attribute)) for name, items in sharing.items()]


def _outputs(tree: bpy.types.NodeTree) -> list[bpy.types.Node]:
    """Returns the output nodes that Eevee, Cycles and exporters use."""
    found = (tree.get_output_node(target) for target in ('ALL', 'EEVEE', 'CYCLES'))
    return list(dict.fromkeys(node for node in found if node is not None))


def _shaders(tree: bpy.types.NodeTree) -> list[bpy.types.Node]:
    """Returns the shaders that the outputs show, without inserted ones and those in node groups."""
    shaders, seen = [], set()
    waiting = [node.inputs['Surface'] for node in _outputs(tree)]
    while waiting:
        socket = waiting.pop(0)
        for link in socket.links:
            node = link.from_node
            if node in seen or NODE_TAG in node and node.type != 'MIX_SHADER':
                continue
            seen.add(node)
            if node.type in ('MIX_SHADER', 'ADD_SHADER', 'REROUTE'):
                waiting += [entry for entry in node.inputs if entry.type in ('SHADER', 'CUSTOM')
                            or node.type == 'REROUTE']
            else:
                shaders.append(node)
    return shaders


def _emits(node: bpy.types.Node) -> bool:
    if node.type not in _EMISSIONS:
        return False
    color, strength = (node.inputs[name] for name in _EMISSIONS[node.type])
    return ((color.is_linked or any(color.default_value[:3]))
            and (strength.is_linked or strength.default_value > 0.0))


# --------------------------------------------------------------------------------------------------
# Nodes
# --------------------------------------------------------------------------------------------------


def _tagged(tree: bpy.types.NodeTree, *ways: str) -> list[bpy.types.Node]:
    ways = ways or (EMISSION, COLORED, FACTOR)
    return [node for node in tree.nodes if node.get(NODE_TAG) in ways]


def _insert(tree: bpy.types.NodeTree, attribute: str, way: str) -> None:
    shaders, outputs = _shaders(tree), _outputs(tree)
    colors = [node.inputs[_COLORS[node.type]] for node in shaders if node.type in _COLORS]
    if way == _SURFACE:
        light = colors[0]
    else:
        # A Color Attribute node, because the glTF exporters of all versions recognise it.
        source = _new_node(tree, 'ShaderNodeVertexColor', way, outputs[0], -700.0, -250.0)
        source.layer_name = attribute
        light = source.outputs['Color']
    if way == FACTOR:
        for color in colors:
            tree.links.new(_product(tree, light, color, way), color)
    else:
        if way == COLORED:
            light = _product(tree, light, colors[0], way)
        for output in outputs:
            _insert_emission(tree, light, output, way)


def _insert_emission(tree: bpy.types.NodeTree, light: bpy.types.NodeSocket,
                     output: bpy.types.Node, way: str) -> None:
    """Lets camera rays see the light, and other rays what the output has shown before. light: an
    output, or an input whose link or value is used."""
    surface = output.inputs['Surface']
    alpha = _alpha(tree, surface)
    path = _new_node(tree, 'ShaderNodeLightPath', way, output, -350.0, 450.0)
    emission = _new_node(tree, 'ShaderNodeEmission', way, output, -350.0, -250.0)
    mix = _new_node(tree, 'ShaderNodeMixShader', way, output, -150.0, 150.0)
    _connect(tree, light, emission.inputs['Color'])
    tree.links.new(path.outputs['Is Camera Ray'], mix.inputs[0])
    if surface.is_linked:
        tree.links.new(surface.links[0].from_socket, mix.inputs[1])
    if alpha is None or way == _SURFACE:
        tree.links.new(emission.outputs[0], mix.inputs[2])
    else:
        tree.links.new(_transparent(tree, alpha, emission, output, way), mix.inputs[2])
    if alpha is not None and way == _SURFACE:
        # Exporters look for transparency before the Light Path.
        tree.links.new(_transparent(tree, alpha, mix, output, way), surface)
    else:
        tree.links.new(mix.outputs[0], surface)


def _alpha(tree: bpy.types.NodeTree, surface: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """Returns the input for the opacity of a surface: that of a mix with transparency before the
    output, or that of a Principled shader. Returns None for opaque surfaces."""
    node = surface.links[0].from_node if surface.is_linked else None
    if node is not None and node.type == 'MIX_SHADER' and node.inputs[1].is_linked \
            and node.inputs[1].links[0].from_node.type == 'BSDF_TRANSPARENT':
        return node.inputs[0]
    for node in _shaders(tree):
        if node.type == 'BSDF_PRINCIPLED':
            alpha = node.inputs['Alpha']
            return alpha if alpha.is_linked or alpha.default_value < 1.0 else None
    return None


def _transparent(tree: bpy.types.NodeTree, alpha: bpy.types.NodeSocket, shader: bpy.types.Node,
                 output: bpy.types.Node, way: str) -> bpy.types.NodeSocket:
    """Returns the output of a mix of transparency and a shader by an opacity."""
    clear = _new_node(tree, 'ShaderNodeBsdfTransparent', way, output, -350.0, -400.0)
    mix = _new_node(tree, 'ShaderNodeMixShader', way, output, -150.0, -150.0)
    _connect(tree, alpha, mix.inputs[0])
    tree.links.new(clear.outputs[0], mix.inputs[1])
    tree.links.new(shader.outputs[0], mix.inputs[2])
    return mix.outputs[0]


def _product(tree: bpy.types.NodeTree, light: bpy.types.NodeSocket, color: bpy.types.NodeSocket,
             way: str) -> bpy.types.NodeSocket:
    """Returns the output of a node of the light times the link or the value of an input."""
    node = _new_node(tree, 'ShaderNodeMix', way, color.node, -200.0, 0.0)
    node.data_type, node.blend_type = 'RGBA', 'MULTIPLY'
    factor, first, second = _mix_inputs(node)
    factor.default_value = 1.0
    tree.links.new(light, first)
    _connect(tree, color, second)
    return next(entry for entry in node.outputs if entry.identifier == 'Result_Color')


def _connect(tree: bpy.types.NodeTree, source: bpy.types.NodeSocket,
             target: bpy.types.NodeSocket) -> None:
    """Links an input to an output, or gives it the value and the link of another input."""
    if not source.is_output:
        target.default_value = source.default_value
        if not source.is_linked:
            return
        source = source.links[0].from_socket
    tree.links.new(source, target)


def _mix_inputs(node: bpy.types.Node) -> list[bpy.types.NodeSocket]:
    """Returns factor, A and B of a Mix node of colours. Other types have inputs of equal names."""
    inputs = {entry.identifier: entry for entry in node.inputs}
    return [inputs[name] for name in ('Factor_Float', 'A_Color', 'B_Color')]


def _new_node(tree: bpy.types.NodeTree, kind: str, way: str, beside: bpy.types.Node, x: float,
              y: float) -> bpy.types.Node:
    node = tree.nodes.new(kind)
    node[NODE_TAG] = way
    node.label = "Radiosity"
    node.select = False
    node.location = (beside.location.x + x, beside.location.y + y)
    return node


def _bypass(tree: bpy.types.NodeTree, node: bpy.types.Node) -> list[_Link]:
    """Links the targets of an inserted node to what was there before. Returns the replaced
    links."""
    if node.type == 'MIX_SHADER':
        earlier = node.inputs[1]
    elif node.type == 'MIX':
        earlier = _mix_inputs(node)[2]
    else:
        return []
    links = [(link.from_socket, link.to_socket) for output in node.outputs
             for link in output.links if NODE_TAG not in link.to_node]
    for output, target in links:
        if earlier.is_linked:
            tree.links.new(earlier.links[0].from_socket, target)
            continue
        for link in list(target.links):
            tree.links.remove(link)
        if node.type == 'MIX' and target.type == 'RGBA':
            target.default_value = earlier.default_value
    return links


def _relink(links: list[tuple[bpy.types.NodeTree, _Link]]) -> None:
    for tree, (output, target) in links:
        tree.links.new(output, target)


def _remove(tree: bpy.types.NodeTree) -> None:
    """Restores what was before the light was inserted."""
    inserted = _tagged(tree)
    for node in inserted:
        _bypass(tree, node)
    _delete(tree, inserted)


def _delete(tree: bpy.types.NodeTree, nodes: list[bpy.types.Node]) -> None:
    for node in nodes:
        tree.nodes.remove(node)
