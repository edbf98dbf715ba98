# SPDX-License-Identifier: GPL-3.0-or-later
"""Light -> the colour attribute of a mesh."""

from __future__ import annotations

import bpy
import numpy as np

# Of a name: longer ones are cut off, or refused, by the version of Blender.
MOST_BYTES = 63


def write_light(mesh: bpy.types.Mesh, name: str, data_type: str, domain: str, light: np.ndarray
                ) -> None:
    """Write light (n, 3), scene-linear, n corners or vertices by domain, and make the attribute
    the active and the rendered one. An attribute of this name with another domain or type is
    replaced; the alpha of one that fits is kept."""
    attribute = mesh.color_attributes.get(name)
    if attribute is not None and (attribute.domain, attribute.data_type) != (domain, data_type):
        mesh.color_attributes.remove(attribute)
        attribute = None
    created = attribute is None
    if created:
        attribute = mesh.color_attributes.new(name, data_type, domain)
    count = len(attribute.data)
    if light.shape != (count, 3):
        raise ValueError(f'"{mesh.name}": {light.shape} values for the {count} elements of '
                         f'attribute "{name}"')
    colors = np.ones(count * 4, np.float32)
    if not created:
        attribute.data.foreach_get('color', colors)
    colors.reshape(-1, 4)[:, :3] = light
    # `color` is scene-linear for both types: Blender itself converts to the bytes' sRGB.
    attribute.data.foreach_set('color', colors)
    activate(mesh, name)
    mesh.update()


def error_name(name: str) -> str:
    """The attribute of the stated error beside the light of this name."""
    return f"{name} Error"


def write_error(mesh: bpy.types.Mesh, name: str, domain: str, error: np.ndarray) -> None:
    """Write error (n,), n corners or vertices by domain, to the attribute beside the light of this
    name; an attribute of that name is replaced."""
    clear_error(mesh, name)
    attribute = mesh.attributes.new(error_name(name), 'FLOAT', domain)
    attribute.data.foreach_set('value', np.ascontiguousarray(error, np.float32))
    mesh.update()


def clear_error(mesh: bpy.types.Mesh, name: str) -> None:
    attribute = mesh.attributes.get(error_name(name))
    if attribute is not None and attribute.data_type == 'FLOAT':
        mesh.attributes.remove(attribute)


def name_is_free(mesh: bpy.types.Mesh, name: str) -> bool:
    """Whether a colour attribute of this name can be written without losing something else."""
    if name in mesh.color_attributes:
        return True
    # UV maps are attributes too, but are listed as such from 3.5 on only.
    return name not in mesh.attributes and name not in mesh.uv_layers


def activate(mesh: bpy.types.Mesh, name: str) -> bool:
    """Make the attribute active (viewport) and rendered; False if there is none."""
    for index, attribute in enumerate(mesh.color_attributes):
        if attribute.name == name:
            mesh.color_attributes.active_color_index = index
            mesh.color_attributes.render_color_index = index
            return True
    return False


def rendered_attribute(mesh: bpy.types.Mesh) -> bpy.types.Attribute | None:
    """The render colour attribute."""
    index = mesh.color_attributes.render_color_index
    # The index is -1, or past the end, when there is none.
    return mesh.color_attributes[index] if 0 <= index < len(mesh.color_attributes) else None


def clear(mesh: bpy.types.Mesh, name: str) -> bool:
    """Remove the attribute and its error's; False if there is none."""
    clear_error(mesh, name)
    attribute = mesh.color_attributes.get(name)
    if attribute is None:
        return False
    mesh.color_attributes.remove(attribute)
    mesh.update()
    return True
