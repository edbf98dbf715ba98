# SPDX-License-Identifier: GPL-3.0-or-later
"""Follows links between nodes to the source of an input's value, and returns values of unlinked
inputs."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from .color_expression import WHITE

# Values of the outputs of the Light Path node for a ray that leaves a diffuse surface, because a
# bake evaluates surfaces for these rays. Outputs that are not listed are 0.
LIGHT_PATH = {'Is Diffuse Ray': 1.0, 'Is Reflection Ray': 1.0, 'Ray Depth': 1.0,
               'Diffuse Depth': 1.0}


@dataclass(frozen=True)
class Source:
    """The source of an input's value: an output of a node, or the input itself."""

    socket: bpy.types.NodeSocket  # the last input on the way upstream, which may provide the value
    path: tuple[bpy.types.Node, ...]  # the group nodes that enclose `node`, outermost first
    node: bpy.types.Node | None = None  # None: nothing is linked, `socket` provides the value
    output: bpy.types.NodeSocket | None = None  # the output of `node`


def follow(socket: bpy.types.NodeSocket, path: tuple[bpy.types.Node, ...]) -> Source:
    """Follows the link of an input upstream, through reroutes, muted nodes and node groups.

    path: the group nodes that enclose the input, outermost first; () in the outermost tree.
    """
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
            return Source(socket, path, node, output)
    return Source(socket, path)


def _group_output(tree: bpy.types.NodeTree, identifier: str) -> bpy.types.NodeSocket | None:
    for node in tree.nodes:
        if node.type == 'GROUP_OUTPUT' and node.is_active_output:
            return next((item for item in node.inputs if item.identifier == identifier), None)
    return None


def input_of(node: bpy.types.Node, *names: str) -> bpy.types.NodeSocket:
    """Returns the input with the first of the names that the node has. Several names are needed
    because Blender renames sockets. Raises StopIteration if there is none."""
    return next(node.inputs[name] for name in names if name in node.inputs)


def default_color(socket: bpy.types.NodeSocket) -> np.ndarray:
    """Returns the socket's own value as a colour, (3,) linear RGB. A number gives grey, a socket
    without a value black."""
    value = getattr(socket, 'default_value', 0.0)
    return np.array(value[:3]) if hasattr(value, '__len__') else WHITE * float(value)


def default_value(socket: bpy.types.NodeSocket) -> float:
    """Returns the socket's own value as a number: the luminance of a colour, and 0 for a socket
    without a value."""
    value = getattr(socket, 'default_value', 0.0)
    if hasattr(value, '__len__'):
        return float(np.array(value[:3]) @ [0.2126, 0.7152, 0.0722])
    return float(value)


def output_node(tree: bpy.types.NodeTree) -> bpy.types.Node | None:
    """Returns the active output node that Cycles uses. Returns None if the tree has none."""
    return tree.get_output_node('CYCLES') or tree.get_output_node('ALL')
