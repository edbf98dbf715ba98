# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials that show the result of a bake, of which the next one must not be made.

To look at the light in a material and to bake again is the usual way of work. A node that reads a
result therefore says nothing about the surface: node_reader.py and shader_colors.py read it as no
bake (emission 0, a factor of 1), and where nothing else is left of the surface it is what the last
bake took it for (last_surfaces.py).
"""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ..color_attribute import error_name, rendered_attribute

# How nodes name the render colour attribute, which a bake makes its result.
RENDERED = ""


def result_names(attributes: Iterable[str]) -> frozenset[str]:
    """Of attributes that light is written to, and their errors."""
    names = set(attributes)
    return frozenset(names | {error_name(name) for name in names}) - {RENDERED}


def renders_result(mesh: bpy.types.Mesh, names: frozenset[str], is_target: bool) -> bool:
    """Whether what nodes read of the mesh without naming an attribute is a result, perhaps from the
    first bake on. is_target: it is to get one."""
    attribute = rendered_attribute(mesh)
    return is_target if attribute is None else attribute.name in names


def reads_result(node: bpy.types.Node, output: bpy.types.NodeSocket, names: frozenset[str]) -> bool:
    """Whether an output of a node is a result. Its alpha is none: bakes leave it as it is."""
    return output.name != 'Alpha' and _attribute_name(node) in names


def attributes_read(tree: bpy.types.NodeTree, seen: frozenset[str] = frozenset()) -> set[str]:
    """By all nodes of a tree and its groups."""
    names = {_attribute_name(node) for node in tree.nodes} - {None}
    for node in tree.nodes:
        group = getattr(node, 'node_tree', None)
        if group is not None and group.name_full not in seen:
            names |= attributes_read(group, seen | {group.name_full})
    return names


def _attribute_name(node: bpy.types.Node) -> str | None:
    if node.type == 'VERTEX_COLOR':
        return node.layer_name
    if node.type == 'ATTRIBUTE' and node.attribute_type == 'GEOMETRY':
        return node.attribute_name
    return None
