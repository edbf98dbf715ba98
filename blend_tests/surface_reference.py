# SPDX-License-Identifier: GPL-3.0-or-later
"""The light that Cycles computes inside faces, as a reference for the light that colours show.

A renderer interpolates colours between the corners of a face, so that the error inside the face
may differ from that at its corners.
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from cycles_reference import ATTRIBUTE, prepare_scene
from mathutils.bvhtree import BVHTree
from surface_error import (SurfaceError, corner_areas, corner_vertices, face_means, face_sizes,
                           read_colors, surface_error, world_positions)

# Surfaces touch if their distance is less than this share of the diagonal of the scene.
TOUCH = 2e-5

Light = dict[str, np.ndarray]  # (corners, 3) or (points, 3) RGB, by object name


class SurfaceReference:
    """The light of Cycles at points inside faces: one point halfway from each corner to the centre.

    Values are irradiance / pi, W/(m^2 sr). Points are in the order of the corners.
    """

    def __init__(self, objects: Sequence[bpy.types.Object], samples: int, seed: int = 0) -> None:
        self._weights = {item.name: corner_areas(item) for item in objects}
        self._sizes = {item.name: face_sizes(item.data) for item in objects}
        # Cycles bakes all corners of a mesh. The inner faces, whose corners are the points, are
        # therefore an object of their own. The rims fill the rest, so that nothing is missing.
        twins, rims = ({item.name: _with_inner_points(item, is_rim) for item in objects}
                       for is_rim in (False, True))
        hidden = [item.hide_render for item in objects]
        for item in objects:
            item.hide_render = True
        values = _bake_points(list(twins.values()), samples, seed)
        self._values = {name: values[twin.name] for name, twin in twins.items()}
        for item, was_hidden in zip(objects, hidden):
            item.hide_render = was_hidden
        covered = _covered_points(twins, rims)
        for twin in (*twins.values(), *rims.values()):
            bpy.data.meshes.remove(twin.data)
        for item in objects:
            # Faces that reflect nothing have no value in Cycles. Points that another surface
            # covers are invisible, and the value of Cycles there is arbitrary.
            self._weights[item.name] = (self._weights[item.name]
                                        * self._values[item.name].any(axis=1)
                                        * ~covered[item.name])

    def points(self, name: str, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns, for the points of an object, the shown light, the light of Cycles, and weights.

        corners: (corners, 3) baked light of the object. The shown light is its interpolation at the
        points. The arrays are (points, 3), (points, 3) and (points,). Weights are areas in m^2, and
        0 at points that are not compared.
        """
        return self._interpolated(name, corners), self._values[name], self._weights[name]

    def truth(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Returns the light of Cycles at the points of an object, (points, 3), and their weights."""
        return self._values[name], self._weights[name]

    def mean(self, names: Sequence[str]) -> np.ndarray:
        """Returns the RGB mean of the light of Cycles over the area of all named objects, (3,)."""
        truth = np.concatenate([self._values[name] for name in names])
        area = np.concatenate([self._weights[name] for name in names])
        return area @ truth / area.sum()

    def means(self, light: Light) -> tuple[np.ndarray, np.ndarray]:
        """Returns two RGB means over the area of all objects: of the shown light and of Cycles.

        light: baked light per corner.
        """
        shown, _, area = (np.concatenate(parts) for parts in
                          zip(*(self.points(name, light[name]) for name in light)))
        return area @ shown / area.sum(), self.mean(list(light))

    def error(self, light: Light) -> SurfaceError:
        points = {name: self._interpolated(name, values) for name, values in light.items()}
        return joined_error(points, self._values, self._weights)

    def _interpolated(self, name: str, corners: np.ndarray) -> np.ndarray:
        """Returns (points, 3), the light at the points, in the order of the corners.

        Interpolation is bilinear in quads. In other faces it is linear between corner and centre.
        """
        sizes = self._sizes[name]
        ends = np.cumsum(sizes)
        starts = ends - sizes
        face = np.repeat(np.arange(len(sizes)), sizes)
        number = np.arange(len(corners)) - starts[face]
        after, before = (corners[starts[face] + (number + step) % sizes[face]] for step in (1, -1))
        mean = (np.add.reduceat(corners.astype(float), starts, axis=0) / sizes[:, None])[face]
        opposite = corners[starts[face] + (number + 2) % sizes[face]]
        bilinear = (9 * corners + 3 * after + 3 * before + opposite) / 16
        return np.where((sizes == 4)[face, None], bilinear, 0.5 * (corners + mean))


def _with_inner_points(item: bpy.types.Object, is_rim: bool) -> bpy.types.Object:
    """Returns a new object in place of the item, in which each face has a smaller face inside.

    The vertices of the smaller, inner faces are the points. The object has either only the inner
    faces or, with is_rim, only the quads between each inner face and the edges of its original
    face. In both cases it has all vertices: those of the item first, then the points.
    """
    vertices, sizes = corner_vertices(item.data), face_sizes(item.data)
    positions = np.empty(3 * len(item.data.vertices), np.float32)
    item.data.vertices.foreach_get('co', positions)
    positions = positions.reshape(-1, 3)
    centres = np.repeat(face_means(item, positions[vertices]), sizes, axis=0)
    inner = 0.5 * (positions[vertices] + centres)
    faces: list[list[int]] = []
    slots: list[int] = []
    for polygon in item.data.polygons:
        outside = list(polygon.vertices)
        inside = [len(positions) + corner for corner in polygon.loop_indices]
        count = len(outside)
        faces += [[outside[k], outside[(k + 1) % count], inside[(k + 1) % count], inside[k]]
                  for k in range(count)] if is_rim else [inside]
        slots += [polygon.material_index] * (count if is_rim else 1)
    mesh = bpy.data.meshes.new(f"{item.name}.{'rim' if is_rim else 'points'}")
    mesh.from_pydata(np.concatenate([positions, inner]).tolist(), [], faces)
    for material in item.data.materials:
        mesh.materials.append(material)
    mesh.polygons.foreach_set('material_index', slots)
    mesh.color_attributes.new(ATTRIBUTE, 'FLOAT_COLOR', 'POINT')
    mesh.color_attributes.active_color_index = 0
    mesh.update()
    twin = bpy.data.objects.new(mesh.name, mesh)
    twin.matrix_world = item.matrix_world
    bpy.context.scene.collection.objects.link(twin)
    # Index of the first vertex that is a point.
    twin["first_point"] = len(positions)
    return twin


def _covered_points(twins: dict[str, bpy.types.Object], rims: dict[str, bpy.types.Object]
                    ) -> dict[str, np.ndarray]:
    """Returns (points,) masks by object name: whether another object touches the point."""
    positions = {name: world_positions(twin) for name, twin in twins.items()}
    begins = dict(zip(twins, np.cumsum([0, *map(len, positions.values())]).tolist()))
    polygons = [(index, [begins[name] + vertex for vertex in polygon.vertices])
                for index, name in enumerate(twins) for part in (twins[name], rims[name])
                for polygon in part.data.polygons]
    every = np.concatenate(list(positions.values()))
    tree = BVHTree.FromPolygons(every.tolist(), [vertices for _, vertices in polygons])
    reach = TOUCH * float(np.linalg.norm(np.ptp(every, axis=0)))
    return {name: np.array([any(polygons[face][0] != index
                                for _, _, face, _ in tree.find_nearest_range(point, reach))
                            for point in positions[name][twin["first_point"]:].tolist()], bool)
            for index, (name, twin) in enumerate(twins.items())}


def _bake_points(twins: Sequence[bpy.types.Object], samples: int, seed: int) -> Light:
    scene = bpy.context.scene
    engine = scene.render.engine
    prepare_scene(scene, samples, seed)
    bpy.context.view_layer.update()
    for item in bpy.context.view_layer.objects:
        item.select_set(item in twins)
    bpy.context.view_layer.objects.active = twins[0]
    bpy.ops.object.bake(type='DIFFUSE', pass_filter={'DIRECT', 'INDIRECT'},
                        target='VERTEX_COLORS', use_selected_to_active=False, use_clear=True)
    scene.render.engine = engine
    return {twin.name: read_colors(twin, ATTRIBUTE)[twin["first_point"]:] for twin in twins}


def joined_error(light: Light, reference: Light, weights: dict[str, np.ndarray]) -> SurfaceError:
    """Returns the error of all objects together.

    light, reference: RGB by object name. weights: areas in the same order, by object name.
    """
    return surface_error(*(np.concatenate([entry[name] for name in light])
                           for entry in (light, reference, weights)))
