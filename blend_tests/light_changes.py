# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes of the lights in the open scene, or additions that give no light. Their effect is known.

relations.py bakes a scene before and after each of them. A change raises NotApplicable with the
reason if the scene has nothing that it could change.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import bpy
import numpy as np
from mathutils import Matrix, Vector
from scene_items import (
    NotApplicable, add_mesh_item, black_material, bounds, diagonal, emission_inputs, is_emissive,
    items, lamps, make_single_users, mesh_items, shines)


# --------------------------------------------------------------------------------------------------
# What is added
# --------------------------------------------------------------------------------------------------

_CUBE = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
_CUBE_FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
FAR = 100.0  # distance, in diagonals of the scene


def far_object_added() -> None:
    """Adds a black cube half as large as the scene, far below it."""
    size, (low, high) = diagonal(), bounds()
    centre = 0.5 * (low + high) - (0.0, 0.0, FAR * size)
    add_mesh_item("far", (centre + 0.5 * size * np.array(_CUBE)).tolist(), _CUBE_FACES,
                  black_material())


def far_copy_added() -> None:
    """Adds a copy of the whole scene, far away, so that neither lights the other."""
    bpy.context.view_layer.update()
    move = Matrix.Translation(Vector((FAR * diagonal(), 0.0, 0.0)))
    for item in items():
        if item.type in ('MESH', 'EMPTY') or item.type == 'LIGHT' and item.data.type != 'SUN':
            twin = item.copy()
            if twin.data:
                twin.data = item.data.copy()
            twin.parent = None
            twin.matrix_world = move @ item.matrix_world
            bpy.context.scene.collection.objects.link(twin)


def dust_added(grains: int = 300) -> None:
    """Adds black triangles of 5e-4 of the scene's size, with 4e-5 of its cross-section in all."""
    random = np.random.default_rng(11)
    low, high = bounds()
    places = np.repeat(random.uniform(low, high, (grains, 3)), 3, axis=0)
    places += 2.5e-4 * diagonal() * random.uniform(-1, 1, places.shape)
    add_mesh_item("dust", places.tolist(), np.arange(3 * grains).reshape(-1, 3).tolist(),
                  black_material())


# --------------------------------------------------------------------------------------------------
# Light
# --------------------------------------------------------------------------------------------------


def power_scaled(factor: float) -> Callable[[], None]:
    def change() -> None:
        for light in {item.data: None for item in lamps()}:
            light.energy *= factor
        trees = [material.node_tree for material in bpy.data.materials]
        world = bpy.context.scene.world
        for tree in (*trees, world.node_tree if world else None):
            for socket in emission_inputs(tree):
                if socket.is_linked:
                    raise NotApplicable("a strength is linked to other nodes")
                socket.default_value *= factor
    return change


def lamps_halved() -> None:
    """Replaces each lamp by two lamps of half its power in the same place."""
    if not lamps():
        raise NotApplicable("there are no lamps")
    make_single_users()
    for item in lamps():
        item.data.energy *= 0.5
        twin = item.copy()
        twin.data = item.data.copy()
        item.users_collection[0].objects.link(twin)


def _plates(shine: bool) -> None:
    """Replaces area lamps by emissive plates with black backs, or adds black plates behind them.

    Without `shine`, each lamp is placed just in front of a black plate. A plate blocks the light of
    other sources, as the body of a lamp does. Therefore both scenes have one. Both the plate and
    the lamp are a thousandth of their size in front of the former place of the lamp, so that
    surfaces in the plane of the lamp remain behind them.
    """
    found = [item for item in lamps() if item.data.type == 'AREA'
             and item.data.shape in ('SQUARE', 'RECTANGLE') and item.data.spread > 3.14]
    if not found:
        raise NotApplicable("there is no area lamp that is a rectangle")
    bpy.context.view_layer.update()
    make_single_users()
    for item in found:
        light = item.data
        across, up = light.size, light.size_y if light.shape == 'RECTANGLE' else light.size
        gap = 1e-3 * max(across, up)
        corners = [(-across / 2, -up / 2, -gap), (-across / 2, up / 2, -gap),
                   (across / 2, up / 2, -gap), (across / 2, -up / 2, -gap)]  # front along -z
        matrix = item.matrix_world.copy()
        if not shine:
            material = black_material()
        else:
            edges = [(matrix @ Vector(corners[k]) - matrix @ Vector(corners[1])).length
                     for k in (0, 2)]
            # Blender 4.0 corrected the factor from 1/4 to 1/pi.
            share = 4.0 if bpy.app.version < (4, 0, 0) else math.pi
            radiance = light.energy / (share * edges[0] * edges[1])
            material = one_sided_emission(tuple(light.color), radiance)
        plate = add_mesh_item(f"{item.name}.plate", corners, [(0, 1, 2, 3)], material)
        plate.matrix_world = matrix
        if shine:
            bpy.data.objects.remove(item)
        else:
            item.matrix_world = matrix @ Matrix.Translation(Vector((0.0, 0.0, -2.0 * gap)))


def one_sided_emission(colour: tuple[float, float, float], radiance: float) -> bpy.types.Material:
    """Returns a material that emits from the front and has a black back."""
    material = black_material()
    tree = material.node_tree
    output = next(node for node in tree.nodes if node.type == 'OUTPUT_MATERIAL')
    back = next(node for node in tree.nodes if node.type == 'BSDF_DIFFUSE')
    front = tree.nodes.new('ShaderNodeEmission')
    front.inputs['Color'].default_value = (*colour, 1.0)
    front.inputs['Strength'].default_value = radiance
    mix = tree.nodes.new('ShaderNodeMixShader')
    tree.links.new(tree.nodes.new('ShaderNodeNewGeometry').outputs['Backfacing'],
                   mix.inputs['Fac'])
    tree.links.new(front.outputs[0], mix.inputs[1])
    tree.links.new(back.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs['Surface'])
    return material


def area_lamps_before_plates() -> None:
    _plates(shine=False)


def area_lamps_as_faces() -> None:
    _plates(shine=True)


def in_light_sets() -> None:
    """Divides all lights into three sets: every second lamp, the other lamps, and the world."""
    scene = bpy.context.scene
    shining = lamps() + [item for item in mesh_items() if is_emissive(item)]
    world = scene.world
    has_world = world is not None and shines(world.node_tree)
    groups = [group for group in (shining[::2], shining[1::2]) if group]
    if len(groups) + has_world < 2:
        raise NotApplicable("there is one light only")
    for number, group in enumerate(groups):
        collection = bpy.data.collections.new(f"set {number}")
        for item in group:
            collection.objects.link(item)
        entry = scene.raybundle.light_sets.add()
        entry.name, entry.collection = collection.name, collection
    if has_world:
        entry = scene.raybundle.light_sets.add()
        entry.name, entry.world = "set of the world", True
