# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes badly broken files: the scenes of the repository with random changes.

    blender -b --factory-startup --python-exit-code 1 -P blend_tests/mutations.py -- [--first 0]
        [--files 100]

Numbers become 0, negative, tiny, huge, infinite or NaN. Nodes are added, connected at random and
removed. Meshes lose their shape, slots their materials, images their files. A bake must end with
finite light that is not negative, or be refused with a message. Each file has a seed of its own.
The seed is printed before Blender evaluates the file, so that a file that ends the process is
known. A file that ends the process before that shows an error of Blender.
"""

from __future__ import annotations

import math
import random
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import bpy

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent / "addon"), str(HERE)]
sys.dont_write_bytecode = True

import command_line  # noqa: E402
import raybundle  # noqa: E402
from surface_error import read_colors  # noqa: E402

SCENES = sorted((HERE.parent / "scenes").glob("*.blend"))
FLOATS = (0.0, -0.0, -1.0, 1e-30, 1e-7, 0.5, 1.0, 2.0, 100.0, 1e6, 1e20, 3e38, -3e38, math.inf,
          -math.inf, math.nan)
INTEGERS = (-1, 0, 1, 2, 3, 7)
# Properties that would only take a long time, or with which Blender crashes.
LEFT_ALONE = {'use_nodes', 'levels', 'render_levels', 'count', 'frame_current', 'paint_active_slot',
              'paint_clone_slot'}
# Blender crashes if a node type is added that it has not registered.
NODES = [name for name in dir(bpy.types) if name.startswith("ShaderNode")
         and name not in ("ShaderNode", "ShaderNodeTree", "ShaderNodeCustomGroup",
                          "ShaderNodeScript")
         and getattr(bpy.types, name).is_registered_node_type()]
MODIFIERS = ('ARRAY', 'BEVEL', 'BOOLEAN', 'BUILD', 'CAST', 'CURVE', 'DATA_TRANSFER', 'DECIMATE',
             'DISPLACE', 'EDGE_SPLIT', 'LATTICE', 'MASK', 'MIRROR', 'NORMAL_EDIT', 'SCREW',
             'SHRINKWRAP', 'SIMPLE_DEFORM', 'SMOOTH', 'SOLIDIFY', 'SUBSURF', 'TRIANGULATE',
             'UV_PROJECT', 'WARP', 'WAVE', 'WEIGHTED_NORMAL', 'WELD', 'WIREFRAME')
SLOW = 30.0  # s; a bake takes about 1 s


def number(chance: random.Random) -> float:
    return chance.choice(FLOATS) if chance.random() < 0.7 else chance.uniform(-10.0, 10.0)


def change_properties(data: bpy.types.bpy_struct, chance: random.Random, count: int = 1) -> None:
    # Properties whose names begin with bl_ belong to all nodes of a kind.
    properties = [p for p in data.bl_rna.properties if not p.is_readonly
                  and p.identifier not in LEFT_ALONE and not p.identifier.startswith("bl_")
                  and p.type in ('FLOAT', 'INT', 'BOOLEAN', 'ENUM')
                  and not getattr(p, "is_enum_flag", False)]
    for prop in chance.sample(properties, min(count, len(properties))):
        is_array = getattr(prop, "is_array", False)
        if prop.type == 'FLOAT' and is_array:
            value = [number(chance) if chance.random() < 0.5 else old
                     for old in getattr(data, prop.identifier)]
        elif is_array:
            continue
        else:
            value = (number(chance) if prop.type == 'FLOAT'
                     else chance.choice(INTEGERS) if prop.type == 'INT'
                     else chance.random() < 0.5 if prop.type == 'BOOLEAN'
                     else chance.choice(prop.enum_items.keys() or [""]))
        try:
            setattr(data, prop.identifier, value)
        except (TypeError, AttributeError, ValueError):
            pass  # the property does not accept this value


def change_inputs(node: bpy.types.Node, chance: random.Random) -> None:
    for socket in node.inputs:
        old = getattr(socket, "default_value", None)
        if chance.random() < 0.5 or old is None or isinstance(old, (str, bpy.types.ID)):
            continue
        socket.default_value = (chance.random() < 0.5 if isinstance(old, bool)
                                else chance.choice(INTEGERS) if isinstance(old, int)
                                else number(chance) if isinstance(old, float)
                                else [number(chance) for _ in old])


def wire(tree: bpy.types.NodeTree, chance: random.Random, outputs: list | None = None) -> None:
    outputs = outputs or [socket for node in tree.nodes for socket in node.outputs]
    inputs = [socket for node in tree.nodes for socket in node.inputs]
    if outputs and inputs:
        tree.links.new(chance.choice(outputs), chance.choice(inputs))


def change_tree(tree: bpy.types.NodeTree | None, chance: random.Random) -> None:
    if tree is None:
        return
    for _ in range(chance.randint(1, 4)):
        nodes = list(tree.nodes)
        kind = chance.random()
        if kind < 0.35:
            try:
                added = tree.nodes.new(chance.choice(NODES))
            except RuntimeError:
                continue  # the node does not belong in this kind of tree
            wire(tree, chance, list(added.outputs))
        elif kind < 0.6:
            wire(tree, chance)
        elif kind < 0.7 and tree.links:
            tree.links.remove(chance.choice(list(tree.links)))
        elif kind < 0.75 and nodes:
            tree.nodes.remove(chance.choice(nodes))
        elif nodes:
            node = chance.choice(nodes)
            change_properties(node, chance)
            change_inputs(node, chance)


def change_material(chance: random.Random) -> None:
    material = chance.choice(list(bpy.data.materials) or [bpy.data.materials.new("Material")])
    if chance.random() < 0.1 and bpy.app.version < (5, 0, 0):
        material.use_nodes = not material.use_nodes
    change_tree(material.node_tree, chance)
    change_properties(material, chance)


def change_light(chance: random.Random) -> None:
    if not bpy.data.lights or chance.random() < 0.4:
        light = bpy.data.lights.new("Light", chance.choice(('POINT', 'SUN', 'SPOT', 'AREA')))
        item = bpy.data.objects.new("Light", light)
        bpy.context.scene.collection.objects.link(item)
        change_properties(item, chance)
    light = chance.choice(list(bpy.data.lights))
    change_properties(light, chance, 3)
    if chance.random() < 0.3 and bpy.app.version < (5, 0, 0):
        light.use_nodes = True
        change_tree(light.node_tree, chance)


def change_object(chance: random.Random) -> None:
    item = chance.choice(list(bpy.context.scene.objects))
    change_properties(item, chance, 2)
    change_properties(item.raybundle, chance)


def change_parent(chance: random.Random) -> None:
    items = list(bpy.context.scene.objects)
    if len(items) > 1:
        child, parent = chance.sample(items, 2)
        child.parent = parent
        if parent.type in ('MESH', 'EMPTY'):
            parent.instance_type = chance.choice(('NONE', 'VERTS', 'FACES') if parent.type == 'MESH'
                                                 else ('NONE',))


def change_world(chance: random.Random) -> None:
    scene = bpy.context.scene
    if scene.world is None or chance.random() < 0.2:
        scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = chance.random() < 0.9
    change_tree(scene.world.node_tree, chance)


def mesh_objects() -> list[bpy.types.Object]:
    return [item for item in bpy.context.scene.objects if item.type == 'MESH']


def change_mesh(chance: random.Random) -> None:
    mesh = chance.choice(mesh_objects()).data
    for _ in range(3):
        chance.choice(mesh.vertices).co = [number(chance) if chance.random() < 0.3
                                           else chance.uniform(-5.0, 5.0) for _ in range(3)]
        chance.choice(mesh.polygons).material_index = chance.choice((0, 1, 7, 32767))
    if chance.random() < 0.2:
        # Makes a face that has a vertex twice, and a corner that does not fit its edge.
        chance.choice(mesh.loops).vertex_index = chance.randrange(len(mesh.vertices))


def change_modifiers(chance: random.Random) -> None:
    kind = chance.choice(MODIFIERS)
    modifier = chance.choice(mesh_objects()).modifiers.new("Modifier", kind)
    if kind not in ('ARRAY', 'BEVEL', 'SCREW', 'SUBSURF'):
        change_properties(modifier, chance, 2)


def change_slots(chance: random.Random) -> None:
    item = chance.choice(mesh_objects())
    if chance.random() < 0.3:
        item.data.materials.clear()
    elif chance.random() < 0.5:
        item.data.materials.append(None)
    elif item.material_slots:
        item.material_slots[0].link = 'OBJECT'


def change_image(chance: random.Random) -> None:
    image = bpy.data.images.new("Image", chance.choice((1, 2, 3)), chance.choice((1, 2, 5)),
                                float_buffer=chance.random() < 0.5)
    image.source = chance.choice(('GENERATED', 'FILE', 'SEQUENCE', 'TILED'))
    if chance.random() < 0.5:
        image.filepath = "//no_such.png"
    tree = chance.choice(list(bpy.data.materials)).node_tree
    if tree is not None:
        node = tree.nodes.new('ShaderNodeTexImage')
        node.image = image if chance.random() < 0.8 else None
        wire(tree, chance, list(node.outputs))


def change_settings(chance: random.Random) -> None:
    scene = bpy.context.scene
    for data in (scene.raybundle, scene.unit_settings, scene.view_settings, scene.cycles):
        change_properties(data, chance)


CHANGES: tuple[Callable[[random.Random], None], ...] = (
    change_material, change_material, change_material, change_light, change_light, change_object,
    change_parent, change_world, change_mesh, change_modifiers, change_slots, change_image,
    change_settings)


def bake_file(seed: int) -> str:
    """Returns the outcome of a bake: finished, refused, or the name of an error."""
    chance = random.Random(seed)
    path = chance.choice(SCENES)
    bpy.ops.wm.open_mainfile(filepath=str(path))
    for _ in range(chance.randint(1, 6)):
        chance.choice(CHANGES)(chance)
    print(f"file {seed}, of {path.name}", flush=True)
    bpy.context.view_layer.update()
    started = time.perf_counter()
    try:
        raybundle.bake(bpy.context, max_patches=300, max_bundles=8, local_rays=8)
    except (raybundle.BakeError, raybundle.RaybundleError) as error:
        return "refused" if str(error) else "no message"
    except Exception:
        traceback.print_exc()
        return "failed"
    attribute = bpy.context.scene.raybundle.attribute
    for item in bpy.context.scene.objects:
        if item.type == 'MESH' and attribute in item.data.color_attributes:
            light = read_colors(item, attribute)
            # Written so that NaN fails too, for which both comparisons are false.
            if not ((light >= 0.0) & (light < math.inf)).all():
                return "wrong light"
    return "finished" if time.perf_counter() - started < SLOW else "slow"


def main(arguments: list[str]) -> None:
    parser = command_line.parser(__file__, __doc__)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--files", type=int, default=100)
    options = parser.parse_args(arguments)
    raybundle.register()
    counts: Counter[str] = Counter()
    for seed in range(options.first, options.first + options.files):
        outcome = bake_file(seed)
        counts[outcome] += 1
        print(f"file {seed}: {outcome}", flush=True)
    print(f"{options.files} files: {dict(counts)}")
    if set(counts) - {"finished", "refused"}:
        sys.exit(1)


if __name__ == "__main__":
    main(command_line.arguments())
