# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes of the open scene's place, size and shape that do not change its light.

relations.py bakes a scene before and after each of them. A change raises NotApplicable with the
reason if the scene has nothing that it could change.
"""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
from mathutils import Euler, Matrix, Vector
from scene_items import NotApplicable, apply_modifiers, items, lamps, make_single_users, mesh_items


def transform(matrix: Matrix) -> None:
    """Transforms all objects, lamps and empties included, but not the directions of the world."""
    bpy.context.view_layer.update()
    for item in items():
        if item.parent is None:
            item.matrix_world = matrix @ item.matrix_world


def _turn(matrix: Matrix) -> None:
    transform(matrix)
    turn_world(matrix.to_3x3())


def turned(*angles: float) -> Callable[[], None]:
    return lambda: _turn(Euler(angles).to_matrix().to_4x4())


def turned_slightly() -> None:
    _turn(Matrix.Rotation(1e-3, 4, Vector((1.0, 1.0, 1.0))))


def turned_at_random(seed: int) -> Callable[[], None]:
    angles = np.random.default_rng(seed).uniform(-np.pi, np.pi, 3)
    return turned(*angles.tolist())


def turned_in_meshes() -> None:
    """Rotates the vertices of meshes, not the objects. Lamps and empties are rotated as objects."""
    apply_modifiers()
    matrix = Euler((0.4, 0.7, 1.1)).to_matrix().to_4x4()
    bpy.context.view_layer.update()
    meshes = mesh_items()
    for item in meshes:
        item.data.transform(item.matrix_world.inverted() @ matrix @ item.matrix_world)
        item.data.update()
    for item in items():
        if item not in meshes:
            item.matrix_world = matrix @ item.matrix_world
    turn_world(matrix.to_3x3())


def moved_far() -> None:
    """Moves the scene by 1 km, not along an axis."""
    transform(Matrix.Translation(Vector((600.0, -480.0, 640.0))))


def scaled(factor: float) -> Callable[[], None]:
    """Returns a change that scales the scene.

    The power of lamps in W is multiplied by factor^2, so that radiances stay equal. The strength of
    a sun in W/m^2 does not change.
    """
    def change() -> None:
        make_single_users()
        transform(Matrix.Scale(factor, 4))
        for item in lamps():
            if item.data.type != 'SUN':
                item.data.energy *= factor ** 2
            if item.data.type in ('POINT', 'SPOT'):
                item.data.shadow_soft_size *= factor
    return change


def mirrored() -> None:
    matrix = Matrix.Identity(4)
    matrix[0][0] = -1.0
    _turn(matrix)


def turn_world(matrix: Matrix) -> None:
    """Transforms the directions of the world by an orthogonal matrix.

    Does nothing if the world does not depend on the direction.
    """
    world = bpy.context.scene.world
    tree = world.node_tree if world and world.use_nodes else None
    if tree is None or all(node.type in ('BACKGROUND', 'OUTPUT_WORLD', 'RGB', 'VALUE')
                           for node in tree.nodes):
        return
    place = tree.nodes.new('ShaderNodeTexCoord')
    mapping = tree.nodes.new('ShaderNodeMapping')
    tree.links.new(place.outputs['Generated'], mapping.inputs['Vector'])
    back = matrix.transposed()
    if back.determinant() < 0.0:  # the Mapping node scales before it rotates
        mapping.inputs['Scale'].default_value = (-1.0, 1.0, 1.0)
        back = back @ Matrix.Diagonal((-1.0, 1.0, 1.0))
    mapping.inputs['Rotation'].default_value = back.to_euler()
    for node in list(tree.nodes):
        if node.type == 'NEW_GEOMETRY' or node.type == 'TEX_COORD' and any(
                output.is_linked and output.name != 'Generated' for output in node.outputs):
            raise NotApplicable("the world's nodes read more than directions")
        if node.type == 'TEX_COORD' and node != place:
            for link in list(node.outputs['Generated'].links):
                tree.links.new(mapping.outputs['Vector'], link.to_socket)
        elif node.type.startswith('TEX_') and 'Vector' in node.inputs:
            if not node.inputs['Vector'].is_linked:
                tree.links.new(mapping.outputs['Vector'], node.inputs['Vector'])


# x depends on y: floors stay level, and surfaces flush with a ceiling stay flush.
SHEAR = Matrix(((1.0, 0.4, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0),
                (0.0, 0.0, 0.0, 1.0)))


def _prepare_shear() -> None:
    """Moves lamps as the shear does, but keeps their shape: they have no mesh to be sheared."""
    apply_modifiers()
    bpy.context.view_layer.update()
    for item in items():
        if item.type == 'LIGHT':
            matrix = item.matrix_world.copy()
            matrix.translation = SHEAR @ matrix.translation
            item.matrix_world = matrix
        elif item.type != 'MESH' and item.instance_type != 'NONE':
            bpy.data.objects.remove(item)  # the meshes of a collection's content are shared


def sheared_by_parents() -> None:
    """Shears all meshes by two parents: one rotated and scaled, and one rotated in the first."""
    _prepare_shear()
    left, stretch, right = np.linalg.svd(np.array(SHEAR)[:3, :3])
    if np.linalg.det(left) < 0.0:
        left, right = -left, -right
    outer, inner = (bpy.data.objects.new(name, None) for name in ("outer", "inner"))
    for empty in (outer, inner):
        bpy.context.scene.collection.objects.link(empty)
    outer.matrix_world = Matrix((left @ np.diag(stretch)).tolist()).to_4x4()
    inner.parent = outer
    inner.rotation_euler = Matrix(right.tolist()).to_euler()
    for item in mesh_items():
        if item.parent is None:
            item.parent = inner


def sheared_in_meshes() -> None:
    _prepare_shear()
    for item in mesh_items():
        item.data.transform(item.matrix_world.inverted() @ SHEAR @ item.matrix_world)
        item.data.update()


def jittered(share: float) -> Callable[[], None]:
    """Returns a change that moves each vertex at random by up to this share of its mesh's size."""
    def change() -> None:
        random = np.random.default_rng(3)
        for mesh in {item.data: None for item in mesh_items()}:
            places = np.empty(3 * len(mesh.vertices), np.float32)
            mesh.vertices.foreach_get('co', places)
            size = np.linalg.norm(np.ptp(places.reshape(-1, 3), axis=0))
            places += (share * size * random.uniform(-1, 1, len(places))).astype(np.float32)
            mesh.vertices.foreach_set('co', places)
            mesh.update()
    return change
