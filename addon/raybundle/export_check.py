# SPDX-License-Identifier: GPL-3.0-or-later
"""Says what Blender's own glTF exporter, with its default options, will lose or change.

The findings are those of the exporter of the running Blender: 3.4 to 4.1 write the render colour
attribute as COLOR_0; 4.2 and later write what materials use, and white otherwise. Export glTF
(gltf_export.py) needs none of the remedies.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import bpy
import numpy as np

from .color_attribute import rendered_attribute
from .engine_presets import EXPORTS_CORNERS
from .filled_slots import has_nodes
from .gltf_export import EXPORTER_OFF, exporter_options
from .light_in_material import COLORED, EMISSION, NODE_TAG, emits
from .light_sets import written_attributes
from .mesh_arrays import read
from .messages import Message, quoted
from .warning_lines import listed

# Whether 16-bit colours above 1 may start again at 0 instead of being cut off: 4.2 has this fault,
# 4.5 has not.
_WRAPS = bpy.app.version < (4, 5, 0)
# Whether only the first material of a mesh with a single colour attribute gets the light: 5.2.0
# takes the others for materials that do not use it, and makes them white.
_WHITENS = bpy.app.version >= (5, 2, 0)


@dataclass(frozen=True)
class Finding:
    """One thing that an export loses or changes, and what to do."""

    what: Message  # with the remedy after a colon
    names: tuple[str, ...] = ()  # of the objects or materials concerned

    def text(self) -> Message:
        """Returns the finding as one line."""
        if not self.names:
            return self.what
        return Message("{name}: {reason}", reason=self.what,
                       name=listed([quoted(name) for name in self.names], 1))


def check(scene: bpy.types.Scene) -> list[Finding]:
    """Returns what the next export by Blender's exporter with its default options will lose or
    change of the light in the scene's objects. Empty: nothing."""
    options = exporter_options()
    if not options:
        return [Finding(EXPORTER_OFF)]
    attribute = scene.raybundle.attribute
    items = [item for item in scene.objects
             if item.type == 'MESH' and attribute in item.data.color_attributes
             and not item.data.is_editmode]
    if not items:
        return [Finding(Message("no object has the attribute {name}: bake first",
                                name=quoted(attribute)))]
    by_material = 'export_vertex_color' in options
    found = [*_of_values(items, attribute, by_material), *_of_objects(scene, items)]
    found += _of_materials(scene, items, attribute) if by_material \
        else _of_render(items, attribute)
    if _WHITENS:
        found += _of_whitened(items, attribute)
    found += [*_of_shading(items, scene), *_of_light_sets(scene, items, by_material)]
    return found


def _of_values(items: list[bpy.types.Object], attribute: str, by_material: bool
               ) -> Iterator[Finding]:
    attributes = [(item.name, item.data.color_attributes[attribute]) for item in items]
    corners = tuple(name for name, entry in attributes if entry.domain == 'CORNER')
    if corners and not EXPORTS_CORNERS:
        yield Finding(Message("the exporter of this Blender mixes up the values of face corners: "
                              "choose the domain Vertex and bake again, or press Export glTF"),
                      corners)
    colors = [(name, read(entry.data, 'color', np.float32, 4)) for name, entry in attributes]
    bright = {name for name, values in colors if (values[:, :3] > 1.0).any()}
    if bright:
        yield Finding(Message("light above 1 is outside of glTF's range, and engines may cut it "
                              "off: press Export glTF, which scales it, or lower the exposure and "
                              "bake again"), tuple(sorted(bright)))
    bare = tuple(item.name for item in items if item.name in bright and not _materials(item))
    if bare and by_material:
        yield Finding(Message(
            "without a material, light above 1 starts again at 0: press Export glTF or Use in "
            "Material" if _WRAPS else
            "without a material, light above 1 is cut off at 1: press Export glTF or Use in "
            "Material"), bare)
    clear = tuple(name for name, values in colors if (values[:, 3] != 1.0).any())
    if clear and by_material:
        yield Finding(Message("the alpha of the attribute is left out unless a material uses it: "
                              "press Export glTF to export it"), clear)


def _materials(item: bpy.types.Object) -> list[bpy.types.Material]:
    return [slot.material for slot in item.material_slots if slot.material]


def _of_render(items: list[bpy.types.Object], attribute: str) -> Iterator[Finding]:
    others = tuple(item.name for item in items
                   if rendered_attribute(item.data).name != attribute)
    if others:
        yield Finding(Message("another colour attribute is the render attribute, which is "
                              "exported: set {name} for rendering (the camera in the list of "
                              "colour attributes)", name=quoted(attribute)), others)


def _of_materials(scene: bpy.types.Scene, items: list[bpy.types.Object], attribute: str
                  ) -> Iterator[Finding]:
    """Yields a finding if a material does not use the attribute. Objects without any material get
    the render attribute."""
    unused, others = [], []
    for item in items:
        materials = _materials(item)
        if not materials and rendered_attribute(item.data).name != attribute:
            others.append(item.name)
        unused += [material.name for material in materials
                   if not _uses(material, item.data, attribute)
                   and not _keeps_emission(material, scene)]
    if unused:
        yield Finding(Message("the material does not use the light, so that COLOR_0 is white and "
                              "the light is in COLOR_1, which engines ignore: press Use in "
                              "Material or Export glTF"), tuple(dict.fromkeys(unused)))
    if others:
        yield Finding(Message("another colour attribute is the render attribute, which is "
                              "exported: set {name} for rendering", name=quoted(attribute)),
                      tuple(others))


def _of_whitened(items: list[bpy.types.Object], attribute: str) -> Iterator[Finding]:
    white = []
    for item in items:
        using = {slot for slot, entry in enumerate(item.material_slots)
                 if entry.material and _uses(entry.material, item.data, attribute)}
        used = using & set(read(item.data.polygons, 'material_index', np.int32).tolist())
        if used and (len(item.data.color_attributes) > 1 or len(used) > 1):
            white.append(item.name)
    if white:
        yield Finding(Message("the exporter of this Blender writes white instead of light on "
                              "meshes with several materials or colour attributes: press Export "
                              "glTF"), tuple(white))


def _uses(material: bpy.types.Material, mesh: bpy.types.Mesh, attribute: str) -> bool:
    """Returns whether a node of the material reads the attribute and is linked."""
    if not has_nodes(material):
        return False
    names = {attribute, ""} if rendered_attribute(mesh).name == attribute else {attribute}
    return any(node.outputs['Color'].is_linked and (
        node.layer_name if node.type == 'VERTEX_COLOR' else node.attribute_name) in names
        for node in material.node_tree.nodes if node.type in ('VERTEX_COLOR', 'ATTRIBUTE'))


def _of_shading(items: list[bpy.types.Object], scene: bpy.types.Scene) -> Iterator[Finding]:
    materials = dict.fromkeys(material for item in items for material in _materials(item))
    lit = tuple(material.name for material in materials if _is_lit(material)
                and not _keeps_emission(material, scene))
    lamps = tuple(material.name for material in materials if _is_lit(material)
                  and _keeps_emission(material, scene))
    if lamps:
        yield Finding(Message("the material emits light and is exported without the baked light: "
                              "bake the output Combined to export both"), lamps)
    bare = tuple(item.name for item in items if not _materials(item))
    if lit or bare:
        yield Finding(Message("the material is not unlit, so that engines light it again: press "
                              "Use in Material with Light Alone or Light Times Colour, or press "
                              "Export glTF"), lit + bare)
    if scene.raybundle.output == 'COMBINED' and lit:
        yield Finding(Message("the engine multiplies the light by the surface's colour, which "
                              "Combined has already: press Use in Material with Light Alone, or "
                              "press Export glTF"), lit)


def _is_lit(material: bpy.types.Material) -> bool:
    """Returns whether exporters see the material as lit. They also do if Use in Material has made a
    transparent material unlit."""
    if not has_nodes(material):
        return True
    inserted = [node for node in material.node_tree.nodes
                if node.get(NODE_TAG) in (EMISSION, COLORED)]
    return not inserted or any(node.type == 'BSDF_TRANSPARENT' for node in inserted)


def _keeps_emission(material: bpy.types.Material, scene: bpy.types.Scene) -> bool:
    """Returns whether the material emits light that the baked light does not contain, so that Use
    in Material leaves it as it is."""
    return scene.raybundle.output != 'COMBINED' and emits(material)


def _of_objects(scene: bpy.types.Scene, items: list[bpy.types.Object]) -> Iterator[Finding]:
    modified = tuple(item.name for item in items
                     if any(modifier.show_viewport and modifier.type != 'ARMATURE'
                            for modifier in item.modifiers))
    if modified:
        yield Finding(Message("modifiers are not applied: switch on Apply Modifiers in the "
                              "export"), modified)
    originals = tuple(item.raybundle.source.name for item in scene.objects
                      if item.raybundle.source)
    if originals:
        yield Finding(Message("the hidden original is exported too, in the same place as its "
                              "finer copy: switch on Visible Objects in the export"), originals)


def _of_light_sets(scene: bpy.types.Scene, items: list[bpy.types.Object], by_material: bool
                   ) -> Iterator[Finding]:
    attributes = [name for name in sorted(written_attributes(scene))
                  if any(name in item.data.color_attributes for item in items)]
    if attributes:
        yield Finding(Message(
            "light sets in attributes of their own are in COLOR_1 and further ones, which engines "
            "ignore: export each set in a file of its own: name its attribute in Attribute and "
            "press Export glTF" if by_material else
            "light sets in attributes of their own are not exported: export each set in a file of "
            "its own: name its attribute in Attribute and press Export glTF"), tuple(attributes))
