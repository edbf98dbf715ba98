# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the value of a node's socket comes from, and the values of sockets that nothing is linked to.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from .color_expression import WHITE

# Values of the Light Path node as diffuse light sees a surface.
LIGHT_PATH = {'Is Diffuse Ray': 1.0, 'Is Reflection Ray': 1.0, 'Ray Depth': 1.0,
               'Diffuse Depth': 1.0}


@dataclass(frozen=True)
class Source:
    """Where a socket's value comes from: an output of a node, or (node None) the socket itself."""

    socket: bpy.types.NodeSocket
    path: tuple[bpy.types.Node, ...]
    node: bpy.types.Node | None = None
    output: bpy.types.NodeSocket | None = None


def follow(socket: bpy.types.NodeSocket, path: tuple[bpy.types.Node, ...]) -> Source:
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
            return Source(socket, path, node, output)
    return Source(socket, path)


def _group_output(tree: bpy.types.NodeTree, identifier: str) -> bpy.types.NodeSocket | None:
    for node in tree.nodes:
        if node.type == 'GROUP_OUTPUT' and node.is_active_output:
            return next((item for item in node.inputs if item.identifier == identifier), None)
    return None


def input_of(node: bpy.types.Node, *names: str) -> bpy.types.NodeSocket:
    return next(node.inputs[name] for name in names if name in node.inputs)


def default_color(socket: bpy.types.NodeSocket) -> np.ndarray:
    value = getattr(socket, 'default_value', 0.0)
    # A colour or a vector has components, a plain value is grey.
    return np.array(value[:3]) if hasattr(value, '__len__') else WHITE * float(value)


def default_value(socket: bpy.types.NodeSocket) -> float:
    value = getattr(socket, 'default_value', 0.0)
    if hasattr(value, '__len__'):
        return float(np.array(value[:3]) @ [0.2126, 0.7152, 0.0722])
    return float(value)


def output_node(tree: bpy.types.NodeTree) -> bpy.types.Node | None:
    """The active output that Cycles uses."""
    return tree.get_output_node('CYCLES') or tree.get_output_node('ALL')
