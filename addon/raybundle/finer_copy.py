# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies of objects that have finer meshes (topologies 'SUBDIVIDE' and 'ADAPTIVE'), or simplified
ones.

The copy "<name> (Radiosity)" is shown instead of the original, which is hidden. The copy's property
raybundle.source is the original, so that the next bake replaces the copy and Clear removes it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import bpy

from . import carried_attributes
from .finer_mesh import FinerMesh
from .messages import Message, quoted

NAME_SUFFIX = " (Radiosity)"

_Meshes = dict[bpy.types.Object, FinerMesh]  # by original object
# Returns the meshes of copies, of the evaluated meshes of the originals and the finer meshes.
Change = Callable[[dict[bpy.types.Object, bpy.types.Mesh], _Meshes], _Meshes]


def find_copies(scene: bpy.types.Scene) -> dict[bpy.types.Object, bpy.types.Object]:
    """Returns the finer copies in the scene by original."""
    return {item.raybundle.source: item for item in scene.objects if item.raybundle.source}


@contextmanager
def originals_shown(scene: bpy.types.Scene) -> Iterator[None]:
    """Shows the originals instead of their copies in the with block, in viewport and renders."""
    copies = find_copies(scene)
    states = [(item, item.hide_viewport, item.hide_render)
              for pair in copies.items() for item in pair]
    try:
        for original, copy in copies.items():
            _set_hidden(original, False)
            _set_hidden(copy, True)
        yield
    finally:
        for item, hide_viewport, hide_render in states:
            item.hide_viewport, item.hide_render = hide_viewport, hide_render


def create_copies(context: bpy.types.Context, meshes: _Meshes, change: Change | None = None
                  ) -> tuple[dict[bpy.types.Object, bpy.types.Object], list[Message]]:
    """Creates a finer copy of each object, hides the original and removes an earlier copy.

    meshes: by original object. change: what is done to them first. Returns the copies by original,
    and warnings of what the copies do not have.
    """
    # Blender does not evaluate hidden objects, so show all originals for one evaluation.
    with originals_shown(context.scene):
        depsgraph = context.evaluated_depsgraph_get()
        with _evaluated_meshes(depsgraph, list(meshes)) as sources:
            if change is not None:
                meshes = change(sources, meshes)
            built = {original: _built_copy(original, sources[original], finer)
                     for original, finer in meshes.items()}
    earlier = find_copies(context.scene)
    copies, warnings = {}, []
    for original, (mesh, groups, missing) in built.items():
        if original in earlier:
            _remove_copy(earlier[original])
        copy = _place_copy(context, original, mesh)
        carried_attributes.write_vertex_groups(copy, original, groups)
        if not carried_attributes.carry_shape_keys(original, copy, meshes[original]):
            missing.append("shape keys")
        if missing:
            warnings.append(Message(
                "{copy} has no {what}, which {original} has: they cannot be carried over to other "
                "vertices", copy=quoted(copy.name), what=", ".join(missing),
                original=quoted(original.name)))
        copies[original] = copy
        _set_hidden(original, True)
    return copies, warnings


@contextmanager
def _evaluated_meshes(depsgraph: bpy.types.Depsgraph, originals: list[bpy.types.Object]
                      ) -> Iterator[dict[bpy.types.Object, bpy.types.Mesh]]:
    """Gives the evaluated mesh of each object, which exists in the with block."""
    evaluated = [original.evaluated_get(depsgraph) for original in originals]
    try:
        # Without this argument, the meshes have no vertex groups and only the active UV map.
        yield {item.original: item.to_mesh(preserve_all_data_layers=True, depsgraph=depsgraph)
               for item in evaluated}
    finally:
        for item in evaluated:
            item.to_mesh_clear()


def _built_copy(original: bpy.types.Object, source: bpy.types.Mesh, finer: FinerMesh
                ) -> tuple[bpy.types.Mesh, carried_attributes.Weights, list[str]]:
    """Returns the mesh of a copy, the weights of its vertex groups, and what it does not have."""
    mesh, missing = carried_attributes.build_mesh(original.name + NAME_SUFFIX, source, finer)
    groups = carried_attributes.read_vertex_groups(original, source, finer)
    for slot in original.material_slots:
        mesh.materials.append(slot.material)
    return mesh, groups, missing


def _place_copy(context: bpy.types.Context, original: bpy.types.Object, mesh: bpy.types.Mesh
                ) -> bpy.types.Object:
    copy = bpy.data.objects.new(original.name + NAME_SUFFIX, mesh)
    # Objects cannot be added to a collection of another file.
    collections = [item for item in original.users_collection if item.library is None]
    for collection in collections or [context.scene.collection]:
        collection.objects.link(copy)
    copy.parent = original.parent
    copy.parent_type = original.parent_type
    copy.parent_bone = original.parent_bone
    copy.matrix_parent_inverse = original.matrix_parent_inverse
    copy.rotation_mode = original.rotation_mode
    copy.matrix_world = original.matrix_world
    copy.raybundle.role = original.raybundle.role
    copy.raybundle.side = original.raybundle.side
    copy.raybundle.quality = original.raybundle.quality
    copy.raybundle.source = original
    return copy


def remove_copies(scene: bpy.types.Scene) -> int:
    """Removes all copies and shows their originals again. Returns the number of removed copies."""
    copies = find_copies(scene)
    for original, copy in copies.items():
        _set_hidden(original, False)
        _remove_copy(copy)
    return len(copies)


def _set_hidden(item: bpy.types.Object, hidden: bool) -> None:
    item.hide_viewport = hidden
    item.hide_render = hidden


def _remove_copy(copy: bpy.types.Object) -> None:
    mesh = copy.data
    bpy.data.objects.remove(copy)
    if mesh.users == 0:
        bpy.data.meshes.remove(mesh)
