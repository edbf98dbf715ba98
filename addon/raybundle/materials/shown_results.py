# SPDX-License-Identifier: GPL-3.0-or-later
"""Recognises nodes that read the result of an earlier bake.

Users show the baked light in a material and then bake again. The second bake must not use the light
as a colour of the surface or as an emission. node_reader.py and shader_colors.py therefore read a
result as if there were none: it counts as 0 if it is emitted and as 1 if it is a factor. If a
material shows only a result, the colours of the surface are those that the last bake used
(last_surfaces.py).
"""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ..color_attribute import error_colors_name, error_name, rendered_attribute

# The name by which nodes read the render colour attribute. A bake makes its result the render
# colour attribute.
RENDERED = ""


def result_names(attributes: Iterable[str]) -> frozenset[str]:
    """Returns the names of the attributes that contain light, and of the attributes that contain
    its stated error."""
    names = set(attributes)
    of_errors = {error(name) for name in names for error in (error_name, error_colors_name)}
    return frozenset(names | of_errors) - {RENDERED}


def renders_result(mesh: bpy.types.Mesh, names: frozenset[str], is_target: bool) -> bool:
    """Returns whether the mesh's render colour attribute, which nodes read without naming it, is a
    result.

    names: see result_names. is_target: whether the current bake writes to the mesh. If the mesh has
    no render colour attribute, the result becomes it.
    """
    attribute = rendered_attribute(mesh)
    return is_target if attribute is None else attribute.name in names


def reads_result(node: bpy.types.Node, output: bpy.types.NodeSocket, names: frozenset[str]) -> bool:
    """Returns whether an output of a node is a result. Alpha is not a result, because bakes do not
    change it."""
    return output.name != 'Alpha' and _attribute_name(node) in names


def attributes_read(tree: bpy.types.NodeTree, seen: frozenset[str] = frozenset()) -> set[str]:
    """Returns the names of the attributes that the nodes of a tree and of its groups read. "" is
    the render colour attribute. seen: full names of the groups that enclose the tree."""
    names = {_attribute_name(node) for node in tree.nodes} - {None}
    for node in tree.nodes:
        group = getattr(node, 'node_tree', None)
        if group is not None and group.name_full not in seen:
            names |= attributes_read(group, seen | {group.name_full})
    return names


def _attribute_name(node: bpy.types.Node) -> str | None:
    """Returns the name of the mesh attribute that a node reads. Returns None if the node reads
    none."""
    if node.type == 'VERTEX_COLOR':
        return node.layer_name
    if node.type == 'ATTRIBUTE' and node.attribute_type == 'GEOMETRY':
        return node.attribute_name
    return None
