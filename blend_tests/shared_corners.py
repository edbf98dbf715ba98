# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' light at all corners of a mesh, of which those that have the same are baked once.

Cycles samples each corner, and those of one vertex with the same random numbers: where their faces
lie in one plane they have the same light, noise included. Inside a flat grid that is four times the
work. So a twin stands in for the object, in two parts: faces that have each place's light once,
which are baked, and the rest.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import bmesh
import bpy
import numpy as np
from surface_error import corner_vertices, face_sizes, read_colors


@contextmanager
def each_place_once(items: Sequence[bpy.types.Object], attribute: str
                    ) -> Iterator[list[bpy.types.Object]]:
    """What to bake, into this attribute, for the light at all corners of these objects. They have
    it afterwards."""
    twins: list[_Twin] = []
    baked: list[bpy.types.Object] = []
    for item in items:
        places = _places_of_corners(item.data)
        # Single faces and boxes have little to share.
        if _is_plain(item) and 2 * (places.max() + 1) < len(places):
            twins.append(_Twin(item, places))
            baked.append(twins[-1].baked)
        else:
            baked.append(item)
    bpy.context.view_layer.update()
    try:
        yield baked
        for twin in twins:
            twin.hand_over(attribute)
    finally:
        for twin in twins:
            twin.remove()
        bpy.context.view_layer.update()


class _Twin:
    """Of an object, which is hidden as long as its twin is there. places: by corner."""

    def __init__(self, item: bpy.types.Object, places: np.ndarray) -> None:
        self._item, self._places, self._was_hidden = item, places, item.hide_render
        sizes = face_sizes(item.data)
        chosen = _faces_of_each_place(places, sizes)
        self.baked, self._rest = _with_faces(item, chosen), _with_faces(item, ~chosen)
        self._baked_places = places[chosen.repeat(sizes)]
        item.hide_render = True

    def hand_over(self, attribute: str) -> None:
        """Writes what was baked to all corners of the object."""
        by_place = np.ones((self._places.max() + 1, 4), np.float32)
        by_place[self._baked_places, :3] = read_colors(self.baked, attribute)
        self._item.data.color_attributes[attribute].data.foreach_set(
            'color', by_place[self._places].ravel())

    def remove(self) -> None:
        self._item.hide_render = self._was_hidden
        for part in (self.baked, self._rest):
            bpy.data.meshes.remove(part.data)


def _is_plain(item: bpy.types.Object) -> bool:
    """Whether what is rendered is the mesh as it is, and no face depends on its neighbours."""
    mesh = item.data
    return not (item.modifiers or mesh.shape_keys or mesh.has_custom_normals or item.library
                or mesh.library or item.instance_type != 'NONE'
                or any(polygon.use_smooth for polygon in mesh.polygons))


def _places_of_corners(mesh: bpy.types.Mesh) -> np.ndarray:
    """(corners,) Equal for corners of one vertex whose faces lie in one plane, of one material."""
    slots = np.empty(len(mesh.polygons), np.int32)
    normals = np.empty(3 * len(mesh.polygons), np.float32)
    mesh.polygons.foreach_get('material_index', slots)
    mesh.polygons.foreach_get('normal', normals)
    faces = np.column_stack([np.rint(1e4 * normals.reshape(-1, 3)), slots]).astype(np.int32)
    _, places = np.unique(np.column_stack([corner_vertices(mesh),
                                           faces.repeat(face_sizes(mesh), axis=0)]),
                          axis=0, return_inverse=True)
    return places.reshape(-1)


def _faces_of_each_place(places: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """(faces,) A choice of them that has every place, few of them twice."""
    of_faces = [part.tolist() for part in np.split(places, np.cumsum(sizes)[:-1])]
    chosen = np.zeros(len(of_faces), bool)
    seen: set[int] = set()
    # First those that bring the most.
    for wanted in range(int(sizes.max()), 0, -1):
        for face, corners in enumerate(of_faces):
            if not chosen[face] and len(set(corners) - seen) >= wanted:
                chosen[face] = True
                seen.update(corners)
    return chosen


def _with_faces(item: bpy.types.Object, kept: np.ndarray) -> bpy.types.Object:
    """A copy beside the object that has some of its faces, and all vertices."""
    part = item.copy()
    part.data = item.data.copy()
    mesh = bmesh.new()
    mesh.from_mesh(part.data)
    bmesh.ops.delete(mesh, geom=[face for face, keep in zip(mesh.faces, kept) if not keep],
                     context='FACES_ONLY')
    mesh.to_mesh(part.data)
    mesh.free()
    for collection in item.users_collection:
        collection.objects.link(part)
    return part
