# SPDX-License-Identifier: GPL-3.0-or-later
"""Fingerprints of materials, which detect whether an earlier bake by Cycles is still valid."""

from __future__ import annotations

import hashlib

import bpy
import numpy as np

# Properties of nodes that only affect the node editor.
_LOOKS = {'location', 'width', 'width_hidden', 'height', 'dimensions', 'select', 'hide',
          'color', 'use_custom_color', 'parent', 'internal_links', 'inputs', 'outputs', 'label',
          'bl_label', 'bl_description', 'bl_icon', 'location_absolute'}


def material_fingerprint(material: bpy.types.Material | None) -> str:
    """Returns a text that differs if any property differs that may change the material's
    appearance: nodes, values, links, groups, images with their pixels, objects that nodes refer
    to."""
    if material is None:
        return "none"
    if material.node_tree is None:
        return repr(tuple(material.diffuse_color))
    return _tree(material.node_tree, set())


def _tree(tree: bpy.types.NodeTree, seen: set[str]) -> str:
    if tree.name_full in seen:
        return tree.name_full
    seen = seen | {tree.name_full}
    parts = []
    for node in tree.nodes:
        parts.append(node.bl_idname + _struct(node, seen, 0))
        parts += [f"{socket.identifier}={_value(socket.default_value)}"
                  for socket in (*node.inputs, *node.outputs) if hasattr(socket, 'default_value')]
    parts += [f"{link.from_node.name}.{link.from_socket.identifier}>"
              f"{link.to_node.name}.{link.to_socket.identifier}{link.is_muted}"
              for link in tree.links]
    return "\n".join(parts)


def _value(value: object) -> str:
    if isinstance(value, bpy.types.ID):
        return value.name_full
    return repr(tuple(value)) if hasattr(value, '__len__') and not isinstance(value, str) \
        else repr(value)


def _struct(struct: bpy.types.bpy_struct, seen: set[str], depth: int) -> str:
    """Returns the properties of a node and of the structs in it (ramps, curves, images, groups) as
    a text. depth: nesting depth, 0 for the node itself."""
    parts = []
    for prop in struct.bl_rna.properties:
        name = prop.identifier
        # Inside structs the same names are significant, such as the colour of a ramp's element.
        if (name == 'rna_type' or depth == 0 and name in _LOOKS or depth > 4
                or name.startswith(('show_', 'bl_'))):
            continue
        value = getattr(struct, name, None)
        if prop.type == 'COLLECTION':
            parts += [_struct(item, seen, depth + 1) for item in value]
        elif prop.type != 'POINTER':
            parts.append(f"{name}={_value(value)}")
        elif isinstance(value, bpy.types.NodeTree):
            parts.append(_tree(value, seen))
        elif isinstance(value, bpy.types.Image):
            parts.append(_image(value))
        elif isinstance(value, bpy.types.Object):
            parts.append(f"{value.name_full}{[tuple(row) for row in value.matrix_world]}")
        elif isinstance(value, bpy.types.ID):
            parts.append(value.name_full)
        elif value is not None:
            parts.append(_struct(value, seen, depth + 1))
    return "{" + ";".join(parts) + "}"


def _image(image: bpy.types.Image) -> str:
    digest = hashlib.blake2b(digest_size=16)
    if image.size[0] and (image.has_data or len(image.pixels)):
        pixels = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
        digest.update(pixels.data)
    return (f"{image.name_full}:{image.colorspace_settings.name}:{image.alpha_mode}:"
            f"{digest.hexdigest()}")
