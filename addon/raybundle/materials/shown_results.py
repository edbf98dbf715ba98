# SPDX-License-Identifier: GPL-3.0-or-later
"""Recognises nodes that read the result of an earlier bake.

Users look at the baked light in a material and then bake again; the second bake must not take the
light for a colour of the surface or for an emission. node_reader.py and shader_colors.py therefore
read a result as if there were none: as emission it counts 0 and as a factor 1. Where a result is
all that a material shows, its own colours are those that the last bake used (last_surfaces.py).
"""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ..color_attribute import error_name, rendered_attribute

# The name by which nodes read the render colour attribute; a bake makes its result that attribute.
RENDERED = ""


def result_names(attributes: Iterable[str]) -> frozenset[str]:
    """The names of attributes that hold light, and of those that hold its stated error."""
    names = set(attributes)
    return frozenset(names | {error_name(name) for name in names}) - {RENDERED}


def renders_result(mesh: bpy.types.Mesh, names: frozenset[str], is_target: bool) -> bool:
    """Whether the mesh's render colour attribute, which nodes read without naming it, is a result.

    names: see result_names. is_target: whether this bake writes to the mesh; its result then
    becomes the render colour attribute of a mesh that has none.
    """
    attribute = rendered_attribute(mesh)
    return is_target if attribute is None else attribute.name in names


def reads_result(node: bpy.types.Node, output: bpy.types.NodeSocket, names: frozenset[str]) -> bool:
    """Whether an output of a node is a result. Alpha is not: bakes leave it as it was."""
    return output.name != 'Alpha' and _attribute_name(node) in names


def attributes_read(tree: bpy.types.NodeTree, seen: frozenset[str] = frozenset()) -> set[str]:
    """Names of the attributes that the nodes of a tree and of its groups read, "" for the render
    colour attribute. seen: full names of the groups that enclose the tree."""
    names = {_attribute_name(node) for node in tree.nodes} - {None}
    for node in tree.nodes:
        group = getattr(node, 'node_tree', None)
        if group is not None and group.name_full not in seen:
            names |= attributes_read(group, seen | {group.name_full})
    return names


def _attribute_name(node: bpy.types.Node) -> str | None:
    """The mesh attribute that a node reads; None if it reads none."""
    if node.type == 'VERTEX_COLOR':
        return node.layer_name
    if node.type == 'ATTRIBUTE' and node.attribute_type == 'GEOMETRY':
        return node.attribute_name
    return None
