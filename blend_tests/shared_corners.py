# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes the light of Cycles at all corners of a mesh, but corners with equal light only once.

Cycles samples each corner separately. Corners at one vertex get the same random numbers, so that
corners of faces in one plane get the same light, noise included. In a flat grid this is four times
the work that is needed. During the bake, each object is therefore replaced by two parts: faces that
contain each distinct corner, which are baked, and the remaining faces.
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
    """Yields the objects to bake instead of `items` within a `with` statement.

    At the end, the baked values of the attribute are copied to all corners of the items, and the
    items are visible again. `attribute`: name of a colour attribute that all items have.
    """
    twins: list[_Twin] = []
    baked: list[bpy.types.Object] = []
    for item in items:
        places = _places_of_corners(item.data)
        # Replaces only meshes with more than two corners per place. Single faces and boxes would
        # gain little.
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
    """The two parts that replace an object, which is hidden as long as they exist.

    places: (corners,) index of the place of each corner, see _places_of_corners().
    """

    def __init__(self, item: bpy.types.Object, places: np.ndarray) -> None:
        self._item, self._places, self._was_hidden = item, places, item.hide_render
        sizes = face_sizes(item.data)
        chosen = _faces_of_each_place(places, sizes)
        self.baked, self._rest = _with_faces(item, chosen), _with_faces(item, ~chosen)
        self._baked_places = places[chosen.repeat(sizes)]
        item.hide_render = True

    def hand_over(self, attribute: str) -> None:
        """Copies the baked values of the attribute to all corners of the object."""
        by_place = np.ones((self._places.max() + 1, 4), np.float32)
        by_place[self._baked_places, :3] = read_colors(self.baked, attribute)
        self._item.data.color_attributes[attribute].data.foreach_set(
            'color', by_place[self._places].ravel())

    def remove(self) -> None:
        self._item.hide_render = self._was_hidden
        for part in (self.baked, self._rest):
            bpy.data.meshes.remove(part.data)


def _is_plain(item: bpy.types.Object) -> bool:
    """Returns whether the object is rendered as its plain mesh, with flat shading only.

    The light of each face is then independent of its neighbours.
    """
    mesh = item.data
    return not (item.modifiers or mesh.shape_keys or mesh.has_custom_normals or item.library
                or mesh.library or item.instance_type != 'NONE'
                or any(polygon.use_smooth for polygon in mesh.polygons))


def _places_of_corners(mesh: bpy.types.Mesh) -> np.ndarray:
    """Returns (corners,) the index of each corner's place.

    Two corners have the same place if they have the same vertex, and their faces the same normal
    (to 1e-4) and the same material.
    """
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
    """Returns (faces,) a selection of faces that contains each place, and few places twice."""
    of_faces = [part.tolist() for part in np.split(places, np.cumsum(sizes)[:-1])]
    chosen = np.zeros(len(of_faces), bool)
    seen: set[int] = set()
    # Greedy: selects the faces with the largest number of new places first.
    for wanted in range(int(sizes.max()), 0, -1):
        for face, corners in enumerate(of_faces):
            if not chosen[face] and len(set(corners) - seen) >= wanted:
                chosen[face] = True
                seen.update(corners)
    return chosen


def _with_faces(item: bpy.types.Object, kept: np.ndarray) -> bpy.types.Object:
    """Returns a copy of the object with only the faces in `kept`, and with all vertices.

    kept: (faces,) bool. The copy is in the collections of the object.
    """
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
