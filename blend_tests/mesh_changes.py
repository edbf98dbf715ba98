# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes of the order and the division of the open scene's meshes that do not change its light.

relations.py bakes a scene before and after each of them. A change raises NotApplicable with the
reason if the scene has nothing that it could change.
"""

from __future__ import annotations

from collections.abc import Callable

import bmesh
import bpy
import numpy as np
from mathutils import Matrix
from scene_items import (
    NotApplicable, apply_modifiers, black_material, edited, is_emissive, items,
    make_single_users, mesh_items, remember_origins, select)


# --------------------------------------------------------------------------------------------------
# Order
# --------------------------------------------------------------------------------------------------


def elements_reordered(kind: str) -> Callable[[], None]:
    """Returns a change that orders elements of each mesh at random. kind: 'faces' or 'verts'."""
    def change() -> None:
        random = np.random.default_rng(5)
        make_single_users()
        for item in mesh_items():
            for mesh in edited(item):
                elements = getattr(mesh, kind)
                for element, index in zip(elements, random.permutation(len(elements)).tolist()):
                    element.index = index
                elements.sort()
    return change


def objects_reordered() -> None:
    """Puts the objects of all collections into another order."""
    random = np.random.default_rng(7)
    for collection in (bpy.context.scene.collection, *bpy.data.collections):
        found = list(collection.objects)
        for item in found:
            collection.objects.unlink(item)
        for index in random.permutation(len(found)).tolist():
            collection.objects.link(found[index])


def materials_reordered() -> None:
    """Reverses the order of each object's material slots, after an added slot that no face uses."""
    make_single_users()
    unused = black_material()
    for item in mesh_items():
        mesh = item.data
        slots = np.empty(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get('material_index', slots)
        materials = list(mesh.materials)
        if not materials:
            continue
        mesh.materials.clear()
        for material in (unused, *reversed(materials)):
            mesh.materials.append(material)
        slots = np.clip(slots, 0, len(materials) - 1)
        mesh.polygons.foreach_set('material_index', (len(materials) - slots).astype(np.int32))
        mesh.update()


# --------------------------------------------------------------------------------------------------
# Division
# --------------------------------------------------------------------------------------------------


def triangulated() -> None:
    apply_modifiers()
    for item in mesh_items():
        for mesh in edited(item):
            bmesh.ops.triangulate(mesh, faces=mesh.faces)


def edges_split() -> None:
    apply_modifiers()
    for item in mesh_items():
        for mesh in edited(item):
            bmesh.ops.split_edges(mesh, edges=mesh.edges)


def _join(chosen: list[bpy.types.Object]) -> None:
    if len(chosen) < 2:
        raise NotApplicable("there are no two to join")
    bpy.context.view_layer.update()
    for item in chosen:
        # Blender would flip the faces of mirrored objects.
        item.data.transform(item.matrix_world)
        if item.matrix_world.determinant() < 0.0:
            item.data.flip_normals()
        item.matrix_world = Matrix.Identity(4)
    select(chosen)
    bpy.ops.object.join()


def joined() -> None:
    remember_origins()
    _join(mesh_items())


def lamps_joined() -> None:
    remember_origins()
    _join([item for item in mesh_items() if is_emissive(item)])


def separated_parts() -> None:
    remember_origins()
    was_cut = False
    for item in mesh_items():
        select([item])
        bpy.ops.object.mode_set(mode='EDIT')
        bpy.ops.mesh.select_all(action='SELECT')
        was_cut |= bpy.ops.mesh.separate(type='LOOSE') == {'FINISHED'}
        bpy.ops.object.mode_set(mode='OBJECT')
    if not was_cut:
        raise NotApplicable("no mesh has loose parts")


def separated_halves() -> None:
    """Divides each object into two objects with the faces on either side of its middle."""
    remember_origins()
    was_cut = False
    for item in mesh_items():
        centres = np.empty(3 * len(item.data.polygons), np.float32)
        item.data.polygons.foreach_get('center', centres)
        centres = centres.reshape(-1, 3)
        longest = int(np.argmax(np.ptp(centres, axis=0)))
        along = centres[:, longest]
        is_first = along < 0.5 * (along.min() + along.max())
        if is_first.all() or not is_first.any():
            continue
        twin = item.copy()
        twin.data = item.data.copy()
        item.users_collection[0].objects.link(twin)
        for part, gone in ((item, is_first), (twin, ~is_first)):
            for mesh in edited(part):
                faces = [face for face, removed in zip(mesh.faces, gone.tolist()) if removed]
                bmesh.ops.delete(mesh, geom=faces, context='FACES')
        was_cut = True
    if not was_cut:
        raise NotApplicable("every mesh is one face")


def instanced() -> None:
    """Replaces every third object, and all emissive objects, by instances of a collection.

    Instances get no colours of their own, but give the same light.
    """
    apply_modifiers()
    found = mesh_items()
    chosen = [item for index, item in enumerate(found) if index % 3 == 2 or is_emissive(item)]
    if not chosen or len(chosen) == len(found):
        raise NotApplicable("there are too few objects")
    for item in chosen:
        kit = bpy.data.collections.new(item.name)
        for collection in item.users_collection:
            collection.objects.unlink(item)
        kit.objects.link(item)
        empty = bpy.data.objects.new(f"{item.name}.instance", None)
        empty.instance_type, empty.instance_collection = 'COLLECTION', kit
        bpy.context.scene.collection.objects.link(empty)


def made_real() -> None:
    """Makes instances real objects, and gives objects with a shared mesh copies of it."""
    instancers = [item for item in items()
                  if item.type == 'EMPTY' and item.instance_type == 'COLLECTION']
    shared = [item for item in mesh_items() if item.data.users > 1]
    if not instancers and not shared:
        raise NotApplicable("there are no instances")
    if instancers:
        select(instancers)
        bpy.ops.object.duplicates_make_real()
    make_single_users()
