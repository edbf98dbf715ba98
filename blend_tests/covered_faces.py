# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces that another surface lies against. They are invisible, and their stored light is arbitrary.

A face attribute marks them, which stays with the faces when objects are joined or cut up.
"""

from __future__ import annotations

import bpy
import numpy as np
from mathutils.bvhtree import BVHTree
from surface_error import corner_vertices, face_means, face_sizes, world_positions

COVERED = "raybundle_covered"  # face attribute: 1 if something lies against the face
# Surfaces lie against each other if their distance is smaller than these shares of the diagonal of
# all objects and of the size of the face.
TOUCH, TOUCH_OF_FACE = 2e-5, 1e-2


def covered_faces(found: list[bpy.types.Object]) -> dict[str, np.ndarray]:
    """Returns (faces,) masks by object name: whether another face lies against some of the face.

    Other faces are searched for at a tenth of the way from each corner to the centre, half-way, and
    at the centre. Faces that share a vertex with the face are its neighbours and do not count.
    """
    sizes = [face_sizes(item.data) for item in found]
    places = [world_positions(item) for item in found]
    begins = np.cumsum([0, *map(len, places)])
    # Per corner of all objects.
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
    reach = np.minimum(TOUCH * np.linalg.norm(np.ptp(corners, axis=0)),
                       TOUCH_OF_FACE * np.linalg.norm(corners - centres, axis=1))
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
    """Stores the result of `covered_faces` in the meshes.

    A face of a shared mesh is marked if it is covered in one of the objects that share the mesh.
    """
    for name, faces in covered.items():
        mesh = bpy.data.objects[name].data
        attribute = mesh.attributes.get(COVERED) or mesh.attributes.new(COVERED, 'INT', 'FACE')
        before = np.empty(len(faces), np.int32)
        attribute.data.foreach_get('value', before)
        attribute.data.foreach_set('value', np.maximum(before, faces.astype(np.int32)))
