# SPDX-License-Identifier: GPL-3.0-or-later
"""Fills material slots that are empty or whose material has no nodes, and empties them again.

Nodes that show light need a material that has nodes (light_in_material.py). A material that fills a
slot looks like what it replaces and refers to it, so that the slot can be restored.
"""

from __future__ import annotations

import bpy
import numpy as np

from .mesh_arrays import read

# Custom properties of the materials that fill slots: whether the slot was added too, and the
# material that was in the slot.
SLOT_TAG, SOURCE_TAG = "raybundle_slot", "raybundle_source"


def has_nodes(material: bpy.types.Material) -> bool:
    """Returns whether the material is defined by its nodes. From Blender 5.0 on all are."""
    return material.node_tree is not None and (bpy.app.version >= (5, 0, 0) or material.use_nodes)


def fill_slots(item: bpy.types.Object) -> None:
    """Puts a material with nodes, of the same look, into each slot that has none."""
    if not item.material_slots:
        item.data.materials.append(_stand_in(None, True))
    for slot in item.material_slots:
        material = slot.material
        if material is None or material.library is None and not has_nodes(material):
            slot.material = _stand_in(material, False)


def _stand_in(source: bpy.types.Material | None, adds_slot: bool) -> bpy.types.Material:
    """Returns a material that looks like one without nodes. source: None for an empty slot."""
    for material in bpy.data.materials:
        if (material.get(SLOT_TAG) == int(adds_slot) and material.get(SOURCE_TAG) == source
                and material.library is None):
            return material
    material = bpy.data.materials.new(f"{source.name if source else 'Grey'} (Radiosity)")
    material[SLOT_TAG] = int(adds_slot)
    if source is not None:
        material[SOURCE_TAG] = source
        material.diffuse_color = source.diffuse_color
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new('ShaderNodeBsdfDiffuse')
    # 0.8 is the grey of faces without a material.
    color = tuple(source.diffuse_color[:3]) if source else (0.8, 0.8, 0.8)
    shader.inputs['Color'].default_value = (*color, 1.0)
    output = tree.nodes.new('ShaderNodeOutputMaterial')
    output.location = (300.0, 0.0)
    tree.links.new(shader.outputs[0], output.inputs['Surface'])
    return material


def empty_slots() -> None:
    """Puts what was in the filled slots back, and removes the materials that filled them."""
    stand_ins = {material for material in bpy.data.materials
                 if SLOT_TAG in material and material.library is None}
    if not stand_ins:
        return
    for mesh in bpy.data.meshes:
        if mesh.library is None and any(entry in stand_ins for entry in mesh.materials):
            _empty_slots_of(mesh, stand_ins)
    for item in bpy.data.objects:
        for slot in item.material_slots if item.library is None else ():
            if slot.link == 'OBJECT' and slot.material in stand_ins:
                slot.material = slot.material.get(SOURCE_TAG)
    for material in stand_ins:
        if not material.users:
            bpy.data.materials.remove(material)


def _empty_slots_of(mesh: bpy.types.Mesh, stand_ins: set[bpy.types.Material]) -> None:
    for index in reversed(range(len(mesh.materials))):
        material = mesh.materials[index]
        if material not in stand_ins:
            continue
        if material[SLOT_TAG] and len(mesh.materials) == 1:
            _remove_only_slot(mesh)
        else:
            mesh.materials[index] = material.get(SOURCE_TAG)


def _remove_only_slot(mesh: bpy.types.Mesh) -> None:
    """Removes the slot, and keeps the slots that faces name. Unlike `clear`, `pop` leaves an empty
    slot in the objects."""
    indices = read(mesh.polygons, 'material_index', np.int32)
    mesh.materials.clear()
    if indices.any():
        mesh.polygons.foreach_set('material_index', indices)
