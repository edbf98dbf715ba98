# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the value of a node's input comes from, and the values of inputs without a link."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from .color_expression import WHITE

# Outputs of the Light Path node for a ray that a diffuse surface sends out, which is how a bake
# looks at surfaces; outputs that are not listed are 0.
LIGHT_PATH = {'Is Diffuse Ray': 1.0, 'Is Reflection Ray': 1.0, 'Ray Depth': 1.0,
               'Diffuse Depth': 1.0}


@dataclass(frozen=True)
class Source:
    """Where the value of an input comes from: an output of a node, or the input itself."""

    socket: bpy.types.NodeSocket  # the last input on the way upstream, whose own value may count
    path: tuple[bpy.types.Node, ...]  # the group nodes that enclose it, outermost first
    node: bpy.types.Node | None = None  # None: nothing is linked, the value of `socket` counts
    output: bpy.types.NodeSocket | None = None  # of the node


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
    """The input with the first of the names that the node has; Blender renames sockets. Raises
    StopIteration if there is none."""
    return next(node.inputs[name] for name in names if name in node.inputs)


def default_color(socket: bpy.types.NodeSocket) -> np.ndarray:
    """(3,) linear RGB: the socket's own value; a number is grey, a socket without value black."""
    value = getattr(socket, 'default_value', 0.0)
    return np.array(value[:3]) if hasattr(value, '__len__') else WHITE * float(value)


def default_value(socket: bpy.types.NodeSocket) -> float:
    """The socket's own value; of a colour the luminance, and 0 of a socket without value."""
    value = getattr(socket, 'default_value', 0.0)
    if hasattr(value, '__len__'):
        return float(np.array(value[:3]) @ [0.2126, 0.7152, 0.0722])
    return float(value)


def output_node(tree: bpy.types.NodeTree) -> bpy.types.Node | None:
    """The active output node that Cycles uses; None if the tree has none."""
    return tree.get_output_node('CYCLES') or tree.get_output_node('ALL')
