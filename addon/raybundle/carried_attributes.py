# SPDX-License-Identifier: GPL-3.0-or-later
"""What a mesh of the user has is carried over to a finer mesh on its faces: material slots, UV
maps, colours and all other attributes, normals, sharp edges, seams, creases, vertex groups and shape
keys.

Values that can be mixed are interpolated over the source's faces. Others, such as whole numbers,
are those of the nearest corner.
"""

from __future__ import annotations

import bpy
import numpy as np

from .finer_mesh import FinerMesh
from .mesh_arrays import corner_vertices, read

# By the type of an attribute: the property of its elements, its type and width, and whether values
# can be mixed.
_TYPES = {
    'FLOAT': ('value', np.float32, 1, True), 'INT': ('value', np.int32, 1, False),
    'INT8': ('value', np.int8, 1, False), 'BOOLEAN': ('value', bool, 1, False),
    'FLOAT_VECTOR': ('vector', np.float32, 3, True), 'FLOAT2': ('vector', np.float32, 2, True),
    'FLOAT_COLOR': ('color', np.float32, 4, True), 'BYTE_COLOR': ('color', np.float32, 4, True),
    'INT32_2D': ('value', np.int32, 2, False), 'INT16_2D': ('value', np.int16, 2, False),
    'QUATERNION': ('value', np.float32, 4, False), 'FLOAT4X4': ('value', np.float32, 16, False),
}
# Attributes that say what the mesh itself says, and those that build_mesh() sets by other means.
_OWN = frozenset(('position', 'material_index', 'sharp_face', 'sharp_edge', 'uv_seam',
                  'custom_normal'))
# Properties of edges that are no attributes in every version.
_OF_EDGES = {'use_edge_sharp': bool, 'use_seam': bool, 'use_freestyle_mark': bool,
             'crease': np.float32, 'bevel_weight': np.float32}
# Vertex groups with a smaller weight are left out, as Blender's own tools do.
_LEAST_WEIGHT = 1e-6

# The weights of vertex groups: for each group, vertices and their weights.
Weights = list[tuple[np.ndarray, np.ndarray]]


def build_mesh(name: str, source: bpy.types.Mesh, finer: FinerMesh
               ) -> tuple[bpy.types.Mesh, list[str]]:
    """Returns a new mesh with the faces of a finer mesh and what `source` has, which is the source
    of the finer mesh, and the names of the attributes that it does not have."""
    data = finer.data
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(data.vertices))
    mesh.vertices.foreach_set('co', data.vertices.ravel())
    mesh.loops.add(data.corner_count)
    mesh.loops.foreach_set('vertex_index', data.corner_vertices)
    mesh.polygons.add(data.face_count)
    mesh.polygons.foreach_set('loop_start', data.face_offsets[:-1])
    if bpy.app.version < (4, 1, 0):
        # Later versions derive the sizes from the starts and do not allow setting them.
        mesh.polygons.foreach_set('loop_total', np.diff(data.face_offsets))
    slots = read(source.polygons, 'material_index', np.int32)
    mesh.polygons.foreach_set('material_index', slots[finer.source_faces])
    mesh.polygons.foreach_set('use_smooth', data.face_smooth)
    mesh.update(calc_edges=True)
    _carry_edges(source, mesh, finer)
    _carry_uv_layers(source, mesh, finer)
    missing = [attribute.name for attribute in source.attributes
               if _is_carried(source, attribute) and not _carry(source, mesh, finer, attribute)]
    colors = source.color_attributes
    if colors.active_color is not None:
        mesh.color_attributes.active_color = mesh.color_attributes[colors.active_color.name]
    if 0 <= colors.render_color_index < len(mesh.color_attributes):
        mesh.color_attributes.render_color_index = mesh.color_attributes.find(
            colors[colors.render_color_index].name)
    if data.face_smooth.any():
        # Custom normals preserve the shading of the source, including sharp edges.
        if bpy.app.version < (4, 1, 0):
            mesh.use_auto_smooth = True
            mesh.auto_smooth_angle = np.pi
        mesh.normals_split_custom_set(data.corner_normals)
    return mesh, missing


def _carry_uv_layers(source: bpy.types.Mesh, mesh: bpy.types.Mesh, finer: FinerMesh) -> None:
    for layer in source.uv_layers:
        new = mesh.uv_layers.new(name=layer.name, do_init=False)
        uvs = finer.interpolated(read(layer.data, 'uv', np.float32, 2))
        new.data.foreach_set('uv', uvs.astype(np.float32).ravel())
        new.active_render = layer.active_render
    if source.uv_layers.active is not None:
        mesh.uv_layers.active = mesh.uv_layers[source.uv_layers.active.name]


def _carry_edges(source: bpy.types.Mesh, mesh: bpy.types.Mesh, finer: FinerMesh) -> None:
    if finer.source_edges is None:
        return
    edges, of_source = _edge_pairs(source, mesh, finer)
    for name, dtype in _OF_EDGES.items():
        if name not in bpy.types.MeshEdge.bl_rna.properties:
            continue
        values = read(source.edges, name, dtype)
        if values.any():
            carried = np.zeros(len(mesh.edges), dtype)
            carried[edges] = values[of_source]
            mesh.edges.foreach_set(name, carried)


def marked_edges(source: bpy.types.Mesh, finer: FinerMesh) -> np.ndarray:
    """Returns per corner of the finer mesh, (c,), whether the edge from it to the next corner has
    any property of its own, such as a seam or a crease."""
    values = [read(source.edges, name, dtype) != 0 for name, dtype in _OF_EDGES.items()
              if name in bpy.types.MeshEdge.bl_rna.properties]
    for attribute in source.attributes:
        if (attribute.domain == 'EDGE' and attribute.data_type in _TYPES
                and _is_carried(source, attribute)):
            name, dtype, width, _ = _TYPES[attribute.data_type]
            values.append(read(attribute.data, name, dtype, width).reshape(
                len(source.edges), -1).any(axis=1))
    found = np.zeros(finer.data.corner_count, bool)
    if finer.source_edges is not None and values:
        on_edge = finer.source_edges >= 0
        of_corners = read(source.loops, 'edge_index', np.int32)
        found[on_edge] = np.any(values, axis=0)[of_corners[finer.source_edges[on_edge]]]
    return found


def _edge_pairs(source: bpy.types.Mesh, mesh: bpy.types.Mesh, finer: FinerMesh
                ) -> tuple[np.ndarray, np.ndarray]:
    """Returns the edges of the finer mesh that lie on edges of the source, and these edges."""
    on_edge = finer.source_edges >= 0
    of_corners = read(source.loops, 'edge_index', np.int32)
    return (read(mesh.loops, 'edge_index', np.int32)[on_edge],
            of_corners[finer.source_edges[on_edge]])


def _is_carried(source: bpy.types.Mesh, attribute: bpy.types.Attribute) -> bool:
    return (not attribute.name.startswith('.') and attribute.name not in _OWN
            and attribute.name not in source.uv_layers
            and not getattr(attribute, 'is_internal', False))


def _carry(source: bpy.types.Mesh, mesh: bpy.types.Mesh, finer: FinerMesh,
           attribute: bpy.types.Attribute) -> bool:
    """Adds an attribute of the source to the finer mesh. Returns whether it could."""
    if attribute.data_type not in _TYPES or (
            attribute.domain == 'EDGE' and finer.source_edges is None):
        return False
    name, dtype, width, can_mix = _TYPES[attribute.data_type]
    values = read(attribute.data, name, dtype, width)
    if attribute.domain == 'FACE':
        carried = values[finer.source_faces]
    elif attribute.domain == 'EDGE':
        edges, of_source = _edge_pairs(source, mesh, finer)
        carried = np.zeros((len(mesh.edges), *values.shape[1:]), dtype)
        carried[edges] = values[of_source]
    elif attribute.domain == 'CORNER':
        carried = _at_corners(finer, values, can_mix)
    elif attribute.domain == 'POINT':
        carried = _at_vertices(source, finer, values, can_mix)
    else:
        return False
    new = mesh.attributes.new(attribute.name, attribute.data_type, attribute.domain)
    if new is None:
        return False
    new.data.foreach_set(name, np.ascontiguousarray(carried, dtype).ravel())
    return True


def _at_corners(finer: FinerMesh, values: np.ndarray, can_mix: bool) -> np.ndarray:
    if not can_mix:
        return finer.nearest(values)
    return finer.interpolated(values.reshape(len(values), -1)).reshape(-1, *values.shape[1:])


def _at_vertices(source: bpy.types.Mesh, finer: FinerMesh, values: np.ndarray, can_mix: bool
                 ) -> np.ndarray:
    """Returns values at the vertices of the source at those of the finer mesh."""
    carried = np.zeros((len(finer.data.vertices), *values.shape[1:]), values.dtype)
    if finer.has_source_vertices:
        # They come first, also those without a face.
        carried[:len(values)] = values
    carried[finer.data.corner_vertices] = _at_corners(
        finer, values[corner_vertices(source)], can_mix)
    return carried


def read_vertex_groups(original: bpy.types.Object, source: bpy.types.Mesh, finer: FinerMesh
                       ) -> Weights:
    """Returns the weights of the object's vertex groups at the vertices of the finer mesh."""
    count = len(original.vertex_groups)
    if count == 0:
        return []
    weights = np.zeros((len(source.vertices), count), np.float32)
    # Blender gives no access to the weights of all vertices at once.
    for vertex in source.vertices:
        for group in vertex.groups:
            if group.group < count:
                weights[vertex.index, group.group] = group.weight
    carried = _at_vertices(source, finer, weights, can_mix=True)
    return [(np.flatnonzero(of_group > _LEAST_WEIGHT), of_group[of_group > _LEAST_WEIGHT])
            for of_group in carried.T]


def write_vertex_groups(copy: bpy.types.Object, original: bpy.types.Object, groups: Weights
                        ) -> None:
    """Gives a copy the vertex groups of its original, with the weights of read_vertex_groups()."""
    for of_original, (vertices, weights) in zip(original.vertex_groups, groups):
        group = copy.vertex_groups.new(name=of_original.name)
        group.lock_weight = of_original.lock_weight
        # Blender takes all vertices of equal weight at once.
        values, first = np.unique(np.sort(weights), return_index=True)
        for weight, alike in zip(values, np.split(vertices[np.argsort(weights)], first[1:])):
            group.add(alike.tolist(), float(weight), 'REPLACE')
    if groups:
        copy.vertex_groups.active_index = original.vertex_groups.active_index


def carry_shape_keys(original: bpy.types.Object, copy: bpy.types.Object, finer: FinerMesh) -> bool:
    """Gives a copy the shape keys of its original. Returns False if it cannot, because modifiers
    have changed the mesh after the shape keys."""
    keys = original.data.shape_keys
    if keys is None:
        return True
    if any(item.show_viewport or item.show_render for item in original.modifiers):
        return False
    for block in keys.key_blocks:
        positions = read(block.data, 'co', np.float32, 3)
        new = copy.shape_key_add(name=block.name, from_mix=False)
        new.data.foreach_set(
            'co', _at_vertices(original.data, finer, positions, can_mix=True).ravel())
        new.slider_min, new.slider_max = block.slider_min, block.slider_max
        new.value, new.mute, new.vertex_group = block.value, block.mute, block.vertex_group
    new_keys = copy.data.shape_keys
    for block in keys.key_blocks:
        new_keys.key_blocks[block.name].relative_key = (
            new_keys.key_blocks[block.relative_key.name])
    new_keys.use_relative = keys.use_relative
    new_keys.eval_time = keys.eval_time
    copy.active_shape_key_index = original.active_shape_key_index
    copy.show_only_shape_key = original.show_only_shape_key
    return True
