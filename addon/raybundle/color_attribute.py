# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes light to the colour attributes of meshes, and removes it."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

# Length limit of attribute names in bytes. Blender truncates or rejects longer names, depending on
# its version.
MOST_BYTES = 63


def write_light(mesh: bpy.types.Mesh, name: str, data_type: str, domain: str, light: np.ndarray
                ) -> None:
    """Writes light to a colour attribute, and makes this attribute the active one and the render
    one.

    domain: 'CORNER' or 'POINT'. data_type: 'FLOAT_COLOR' or 'BYTE_COLOR'. light: (n, 3),
    scene-linear, for n corners or vertices. An attribute of this name with another domain or type
    is replaced. The alpha of a matching attribute is kept. Raises ValueError if n differs from the
    mesh's number of elements.
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
        raise ValueError(f'"{mesh.name}": attribute "{name}" needs values of shape ({count}, 3), '
                         f'got {light.shape}')
    colors = np.ones(count * 4, np.float32)
    if not created:
        attribute.data.foreach_get('color', colors)
    colors.reshape(-1, 4)[:, :3] = light
    # `color` is scene-linear for both types. Blender itself converts it to the bytes' sRGB.
    attribute.data.foreach_set('color', colors)
    activate(mesh, name)
    mesh.update()


def error_name(name: str) -> str:
    """Returns the name of the attribute for the stated error of the light in attribute `name`."""
    return f"{name} Error"


def error_colors_name(name: str) -> str:
    """Returns the name of the colour attribute that shows the stated error of the light in
    attribute `name`."""
    return f"{name} Error Colors"


def write_error(mesh: bpy.types.Mesh, name: str, domain: str, error: np.ndarray) -> None:
    """Writes the stated error of light to a float attribute. An earlier attribute is replaced.

    name: of the light's attribute. domain: 'CORNER' or 'POINT'. error: (n,), for n corners or
    vertices.
    """
    clear_error(mesh, name)
    attribute = mesh.attributes.new(error_name(name), 'FLOAT', domain)
    attribute.data.foreach_set('value', np.ascontiguousarray(error, np.float32))
    mesh.update()


def clear_error(mesh: bpy.types.Mesh, name: str) -> None:
    """Removes the stated error of the light in attribute `name`, and the colours that show it, if
    the mesh has them."""
    colors = mesh.color_attributes.get(error_colors_name(name))
    if colors is not None:
        mesh.color_attributes.remove(colors)
    attribute = mesh.attributes.get(error_name(name))
    if attribute is not None and attribute.data_type == 'FLOAT':
        mesh.attributes.remove(attribute)


def name_is_free(mesh: bpy.types.Mesh, name: str) -> bool:
    """Returns whether a colour attribute of this name can be written without replacing other
    data."""
    if name in mesh.color_attributes:
        return True
    # UV maps share the names of attributes, but only Blender 3.5 and later list them as attributes.
    return name not in mesh.attributes and name not in mesh.uv_layers


@dataclass(frozen=True)
class KeptAttribute:
    """What a mesh had under the name of a colour attribute, to be put back later."""

    name: str
    domain: str
    data_type: str
    colors: np.ndarray | None  # (4 n,), scene-linear; None: the mesh did not have the attribute
    # Names of the colour attributes that were active in the viewport and in renders; None: none.
    active: str | None
    rendered: str | None

    @classmethod
    def of(cls, mesh: bpy.types.Mesh, name: str) -> KeptAttribute:
        """Copies the colour attribute of a mesh that is not in Edit Mode."""
        attribute = mesh.color_attributes.get(name)
        active = mesh.color_attributes.active_color
        rendered = rendered_attribute(mesh)
        colors = None
        if attribute is not None:
            colors = np.empty(4 * len(attribute.data), np.float32)
            attribute.data.foreach_get('color', colors)
        return cls(name, attribute.domain if attribute else "",
                   attribute.data_type if attribute else "", colors,
                   active.name if active else None, rendered.name if rendered else None)

    def put_back(self, mesh: bpy.types.Mesh) -> None:
        """Gives the mesh what it had. Its number of elements must not have changed."""
        colors = mesh.color_attributes
        attribute = colors.get(self.name)
        if attribute is not None and (self.colors is None or (
                attribute.domain, attribute.data_type) != (self.domain, self.data_type)):
            colors.remove(attribute)
            attribute = None
        if self.colors is not None:
            if attribute is None:
                attribute = colors.new(self.name, self.data_type, self.domain)
            attribute.data.foreach_set('color', self.colors)
        names = [item.name for item in colors]
        if self.active in names:
            colors.active_color_index = names.index(self.active)
        if self.rendered in names:
            colors.render_color_index = names.index(self.rendered)
        mesh.update()


def activate(mesh: bpy.types.Mesh, name: str) -> bool:
    """Makes a colour attribute the active one (of the viewport) and the render one. Returns whether
    the mesh has the attribute."""
    for index, attribute in enumerate(mesh.color_attributes):
        if attribute.name == name:
            mesh.color_attributes.active_color_index = index
            mesh.color_attributes.render_color_index = index
            return True
    return False


def show(mesh: bpy.types.Mesh, name: str) -> None:
    """Makes a colour attribute the active one (of the viewport). Renders keep theirs."""
    for index, attribute in enumerate(mesh.color_attributes):
        if attribute.name == name:
            mesh.color_attributes.active_color_index = index


def rendered_attribute(mesh: bpy.types.Mesh) -> bpy.types.Attribute | None:
    """Returns the render colour attribute, which materials read without naming it. Returns None if
    the mesh has none."""
    index = mesh.color_attributes.render_color_index
    # The index is -1 or past the end if there is none.
    return mesh.color_attributes[index] if 0 <= index < len(mesh.color_attributes) else None


def clear(mesh: bpy.types.Mesh, name: str) -> bool:
    """Removes the light in attribute `name` and its stated error. Returns whether the mesh had the
    light."""
    clear_error(mesh, name)
    attribute = mesh.color_attributes.get(name)
    if attribute is None:
        return False
    mesh.color_attributes.remove(attribute)
    mesh.update()
    return True
