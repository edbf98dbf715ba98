# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes light to the colour attributes of meshes, and removes it."""

from __future__ import annotations

import bpy
import numpy as np

# The longest name of an attribute: Blender cuts off or refuses longer ones, by version.
MOST_BYTES = 63


def write_light(mesh: bpy.types.Mesh, name: str, data_type: str, domain: str, light: np.ndarray
                ) -> None:
    """Writes light to a colour attribute, and makes that the active and the rendered one.

    domain: 'CORNER' or 'POINT'; data_type: 'FLOAT_COLOR' or 'BYTE_COLOR'; light: (n, 3),
    scene-linear, of n corners or vertices. An attribute of this name with another domain or type is
    replaced; the alpha of one that fits is kept. Raises ValueError if n is not the mesh's.
    """
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
    """The name of the attribute with the stated error of the light of this name."""
    return f"{name} Error"


def write_error(mesh: bpy.types.Mesh, name: str, domain: str, error: np.ndarray) -> None:
    """Writes the stated error of light to a float attribute of its own, which is replaced.

    name: of the light's attribute; domain: 'CORNER' or 'POINT'; error: (n,), of n corners or
    vertices.
    """
    clear_error(mesh, name)
    attribute = mesh.attributes.new(error_name(name), 'FLOAT', domain)
    attribute.data.foreach_set('value', np.ascontiguousarray(error, np.float32))
    mesh.update()


def clear_error(mesh: bpy.types.Mesh, name: str) -> None:
    """Removes the stated error of the light of this name, if the mesh has it."""
    attribute = mesh.attributes.get(error_name(name))
    if attribute is not None and attribute.data_type == 'FLOAT':
        mesh.attributes.remove(attribute)


def name_is_free(mesh: bpy.types.Mesh, name: str) -> bool:
    """Whether a colour attribute of this name can be written without losing something else."""
    if name in mesh.color_attributes:
        return True
    # UV maps share the names of attributes, but only Blender 3.5 and later list them there.
    return name not in mesh.attributes and name not in mesh.uv_layers


def activate(mesh: bpy.types.Mesh, name: str) -> bool:
    """Makes a colour attribute the active one (of the viewport) and the rendered one; returns
    whether the mesh has it."""
    for index, attribute in enumerate(mesh.color_attributes):
        if attribute.name == name:
            mesh.color_attributes.active_color_index = index
            mesh.color_attributes.render_color_index = index
            return True
    return False


def rendered_attribute(mesh: bpy.types.Mesh) -> bpy.types.Attribute | None:
    """The render colour attribute, which materials read without naming it; None if the mesh has
    none."""
    index = mesh.color_attributes.render_color_index
    # The index is -1 or past the end if there is none.
    return mesh.color_attributes[index] if 0 <= index < len(mesh.color_attributes) else None


def clear(mesh: bpy.types.Mesh, name: str) -> bool:
    """Removes the light of this name and its stated error; returns whether there was light."""
    clear_error(mesh, name)
    attribute = mesh.color_attributes.get(name)
    if attribute is None:
        return False
    mesh.color_attributes.remove(attribute)
    mesh.update()
    return True
