# SPDX-License-Identifier: GPL-3.0-or-later
"""Ways to change the open scene that leave its light as it is, or change it in a known way.

relations.py bakes a scene before and after one of them. A change that a scene offers nothing for
raises NotApplicable with the reason. Where objects are cut up or joined, each face remembers by an
attribute which object it came from (`remember_origins`), so that light can be compared by the
objects that were. Another attribute tells the faces that something lies against (`mark_covered`):
nobody sees them, and what is stored there is arbitrary.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import bmesh
import bpy
import numpy as np
from mathutils import Euler, Matrix, Vector
from mathutils.bvhtree import BVHTree
from surface_error import corner_vertices, face_means, face_sizes, world_positions

ORIGIN = "raybundle_origin"  # face attribute: index into scene[ORIGINS]
ORIGINS = "raybundle_origins"
COVERED = "raybundle_covered"  # face attribute: 1 where something lies against the face
TOUCH = 2e-5  # of the scene's diagonal: what is nearer lies against it
BLACK = "black"


class NotApplicable(Exception):
    """The scene has nothing that could be changed so; the text says what is missing."""


# --------------------------------------------------------------------------------------------------
# What there is
# --------------------------------------------------------------------------------------------------


def items() -> list[bpy.types.Object]:
    """The objects of the view layer; others are seen as instances at most."""
    return list(bpy.context.view_layer.objects)


def mesh_items() -> list[bpy.types.Object]:
    return [item for item in items() if item.type == 'MESH' and len(item.data.polygons)
            and item.visible_get() and not item.hide_render]


def lamps() -> list[bpy.types.Object]:
    return [item for item in items() if item.type == 'LIGHT' and item.visible_get()]


def emission_inputs(tree: bpy.types.NodeTree | None) -> list[bpy.types.NodeSocket]:
    """The strengths of what shines in a material or a world."""
    names = {'EMISSION': "Strength", 'BACKGROUND': "Strength",
             'BSDF_PRINCIPLED': "Emission Strength"}
    nodes = tree.nodes if tree else ()
    return [node.inputs[names[node.type]] for node in nodes if node.type in names]


def shines(tree: bpy.types.NodeTree | None) -> bool:
    for socket in emission_inputs(tree):
        colour = next(entry for entry in socket.node.inputs
                      if entry.name in ("Color", "Emission", "Emission Color"))
        if socket.default_value > 0.0 and (colour.is_linked or any(colour.default_value[:3])):
            return True
    return False


def is_emissive(item: bpy.types.Object) -> bool:
    return any(slot.material and shines(slot.material.node_tree) for slot in item.material_slots)


def diagonal() -> float:
    """Of the box around all meshes, m."""
    low, high = bounds()
    return float(np.linalg.norm(high - low))


def bounds() -> tuple[np.ndarray, np.ndarray]:
    corners = np.array([item.matrix_world @ Vector(corner)
                        for item in mesh_items() for corner in item.bound_box])
    return corners.min(axis=0), corners.max(axis=0)


def covered_faces() -> dict[str, np.ndarray]:
    """(faces,) by object name: whether another face lies against some of the face.

    Looked for at a tenth of the way from the corners to the centre, half-way and there; those that
    share a vertex with the face are its neighbours.
    """
    found = mesh_items()
    sizes = [face_sizes(item.data) for item in found]
    places = [world_positions(item) for item in found]
    begins = np.cumsum([0, *map(len, places)])
    # By corner, in all of them.
    vertices = np.concatenate([corner_vertices(item.data) + begin
                               for item, begin in zip(found, begins)])
    corners = np.concatenate(places).astype(float)[vertices]
    centres = np.concatenate([np.repeat(face_means(item, corner), size, axis=0)
                              for item, size, corner in zip(found, sizes, np.split(
                                  corners, np.cumsum([size.sum() for size in sizes])[:-1]))])
    all_sizes = np.concatenate(sizes)
    ends = np.cumsum(all_sizes)
    polygons = [vertices[end - size:end].tolist() for end, size in zip(ends, all_sizes)]
    tree = BVHTree.FromPolygons(np.concatenate(places).tolist(), polygons)
    rims = list(map(set, polygons))
    reach = np.minimum(TOUCH * diagonal(), 0.01 * np.linalg.norm(corners - centres, axis=1))
    owner = np.repeat(np.arange(len(all_sizes)), all_sizes)
    touched = np.zeros(len(corners), bool)
    for share in (0.1, 0.5, 1.0):
        points = ((1.0 - share) * corners + share * centres).tolist()
        touched |= [any(rims[own].isdisjoint(rims[face])
                        for _, _, face, _ in tree.find_nearest_range(point, near))
                    for own, point, near in zip(owner.tolist(), points, reach.tolist())]
    covered = np.logical_or.reduceat(touched, ends - all_sizes)
    faces = np.split(covered, np.cumsum([len(size) for size in sizes])[:-1])
    return {item.name: own for item, own in zip(found, faces)}


def mark_covered(covered: dict[str, np.ndarray]) -> None:
    """As `covered_faces` found them; what shares a mesh is covered where one of them is."""
    for name, faces in covered.items():
        mesh = bpy.data.objects[name].data
        attribute = mesh.attributes.get(COVERED) or mesh.attributes.new(COVERED, 'INT', 'FACE')
        before = np.empty(len(faces), np.int32)
        attribute.data.foreach_get('value', before)
        attribute.data.foreach_set('value', np.maximum(before, faces.astype(np.int32)))


# --------------------------------------------------------------------------------------------------
# Preparations
# --------------------------------------------------------------------------------------------------


def make_single_users() -> None:
    """Each mesh object gets a mesh of its own, and each lamp its light."""
    for item in items():
        if item.type in ('MESH', 'LIGHT') and item.data.users > 1:
            item.data = item.data.copy()


def apply_modifiers() -> None:
    bpy.context.view_layer.update()
    graph = bpy.context.evaluated_depsgraph_get()
    for item in mesh_items():
        if item.modifiers:
            mesh = bpy.data.meshes.new_from_object(item.evaluated_get(graph), depsgraph=graph)
            item.modifiers.clear()
            item.data = mesh
    make_single_users()


def remember_origins() -> None:
    """Modifiers and shared meshes are gone afterwards, for faces to have one origin each."""
    apply_modifiers()
    found = mesh_items()
    bpy.context.scene[ORIGINS] = [item.name for item in found]
    for index, item in enumerate(found):
        faces = len(item.data.polygons)
        attribute = item.data.attributes.new(ORIGIN, 'INT', 'FACE')
        attribute.data.foreach_set('value', np.full(faces, index, np.int32))


def edited(item: bpy.types.Object) -> Iterator[bmesh.types.BMesh]:
    """`for mesh in edited(item)`: its bmesh once, written back afterwards."""
    mesh = bmesh.new()
    mesh.from_mesh(item.data)
    yield mesh
    mesh.to_mesh(item.data)
    mesh.free()
    item.data.update()


def select(chosen: list[bpy.types.Object]) -> None:
    for item in items():
        item.select_set(item in chosen)
    bpy.context.view_layer.objects.active = chosen[0]


def black_material() -> bpy.types.Material:
    material = bpy.data.materials.new(BLACK)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new('ShaderNodeBsdfDiffuse')
    shader.inputs['Color'].default_value = (0.0, 0.0, 0.0, 1.0)
    tree.links.new(shader.outputs[0],
                   tree.nodes.new('ShaderNodeOutputMaterial').inputs['Surface'])
    return material


def add_mesh_item(name: str, vertices, faces, material: bpy.types.Material) -> bpy.types.Object:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(material)
    item = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(item)
    return item


# --------------------------------------------------------------------------------------------------
# Place, size and shape
# --------------------------------------------------------------------------------------------------


def transform(matrix: Matrix) -> None:
    """Everything, lamps and empties too, by the objects' matrices; not the world's directions."""
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
    """The vertices move, not the objects; lamps and empties have nothing else to move."""
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
    """By 1 km, along none of the axes."""
    transform(Matrix.Translation(Vector((600.0, -480.0, 640.0))))


def scaled(factor: float) -> Callable[[], None]:
    """Lamps of W get factor^2 of it: radiance stays. A sun's strength is W/m^2."""
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
    """The world's directions by an orthogonal matrix; one without any is the same from all sides.
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
    if back.determinant() < 0.0:  # Mapping scales before it turns
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


# x follows y: floors stay level, and what is flush with a ceiling stays so.
SHEAR = Matrix(((1.0, 0.4, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0),
                (0.0, 0.0, 0.0, 1.0)))


def _prepare_shear() -> None:
    """Lamps move with the rest, but keep their shape: they have no mesh to be sheared alike."""
    apply_modifiers()
    bpy.context.view_layer.update()
    for item in items():
        if item.type == 'LIGHT':
            matrix = item.matrix_world.copy()
            matrix.translation = SHEAR @ matrix.translation
            item.matrix_world = matrix
        elif item.type != 'MESH' and item.instance_type != 'NONE':
            bpy.data.objects.remove(item)  # a collection's content has meshes that others share


def sheared_by_parents() -> None:
    """By two empties: one turned and stretched, and one turned in it."""
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
    """Each vertex by up to this share of its mesh's size."""
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


# --------------------------------------------------------------------------------------------------
# Order
# --------------------------------------------------------------------------------------------------


def elements_reordered(kind: str) -> Callable[[], None]:
    """kind: faces or verts of each mesh, at random."""
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
    """They come in another order from their collections."""
    random = np.random.default_rng(7)
    for collection in (bpy.context.scene.collection, *bpy.data.collections):
        found = list(collection.objects)
        for item in found:
            collection.objects.unlink(item)
        for index in random.permutation(len(found)).tolist():
            collection.objects.link(found[index])


def materials_reordered() -> None:
    """The slots of each object the other way round, behind one that no face has."""
    make_single_users()
    unused = black_material()
    for item in mesh_items():
        mesh = item.data
        slots = np.empty(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get('material_index', slots)
        materials = list(mesh.materials)
        mesh.materials.clear()
        for material in (unused, *reversed(materials)):
            mesh.materials.append(material)
        slots = np.clip(slots, 0, max(len(materials) - 1, 0))
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
        # Blender would turn the faces of mirrored ones.
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
    """Each object becomes two, of the faces on either side of its middle."""
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
    """Every third object and all that shine are shown by way of a collection: they get no colours
    of their own, but give the same light."""
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
    """Instances become objects, and shared meshes copies."""
    instancers = [item for item in items()
                  if item.type == 'EMPTY' and item.instance_type == 'COLLECTION']
    shared = [item for item in mesh_items() if item.data.users > 1]
    if not instancers and not shared:
        raise NotApplicable("there are no instances")
    if instancers:
        select(instancers)
        bpy.ops.object.duplicates_make_real()
    make_single_users()


# --------------------------------------------------------------------------------------------------
# What is added
# --------------------------------------------------------------------------------------------------

_CUBE = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
_CUBE_FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
FAR = 100.0  # diagonals of the scene


def far_object_added() -> None:
    """A black cube half as large as the scene, far below."""
    size, (low, high) = diagonal(), bounds()
    centre = 0.5 * (low + high) - (0.0, 0.0, FAR * size)
    add_mesh_item("far", (centre + 0.5 * size * np.array(_CUBE)).tolist(), _CUBE_FACES,
                  black_material())


def far_copy_added() -> None:
    """The whole scene once more, far away: neither lights the other."""
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
    """Black triangles of half a thousandth of the scene: 4e-5 of its cross-section together."""
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
    """Each lamp becomes two of half its power in the same place."""
    if not lamps():
        raise NotApplicable("there are no lamps")
    make_single_users()
    for item in lamps():
        item.data.energy *= 0.5
        twin = item.copy()
        twin.data = item.data.copy()
        item.users_collection[0].objects.link(twin)


def _plates(shine: bool) -> None:
    """Instead of each area lamp a plate, its back black; or the lamp just in front of a black one.

    The plate takes light from others as a lamp's body does, so both have one, and both are a
    thousandth of their size in front of where the lamp was: what lies in its plane stays behind.
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
            # Blender 4.0 corrected 1/4 to 1/pi.
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
    """It shines from the front; the back is black."""
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
    """All that shines in three sets: every other lamp, the others, and the world."""
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
