# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the native library's scene from a `SceneData`."""

from __future__ import annotations

from collections.abc import Sequence

from . import native
from .quality import OBJECT_FACTORS
from .scene_data import (AreaLightData, LightData, LightSetData, MeshData, PointLightData,
                         SceneData)


def build_native_scene(data: SceneData) -> native.Scene:
    """Returns a native scene, which the caller closes. Its ids of instances and of lights are
    positions in the lists of data. Raises RaybundleError if the native library rejects any of the
    data."""
    scene = native.Scene()
    for image in data.images:
        scene.add_image(image.name, image.pixels, image.extension)
    for material in data.materials:
        scene.add_material(material.name, material.front, material.back, material.opacity,
                           material.opacity_image)
    for mesh in data.meshes:
        _add_mesh(scene, mesh)
    for instance in data.instances:
        identifier = scene.add_instance(instance.mesh, instance.name, instance.transform,
                                        instance.role, instance.side)
        scene.set_instance_visibility(identifier, instance.stops_direct, instance.exchanges)
        factors = OBJECT_FACTORS[instance.quality]
        scene.set_instance_quality(identifier, factors.noise, factors.patch_size)
        if instance.result_corners is not None:
            scene.set_result_corners(identifier, instance.result_corners)
    _add_lights(scene, data.lights)
    scene.set_world(data.world)
    if data.world_image is not None:
        scene.set_world_image(data.world_image)
    for light_set in data.light_sets:
        _add_light_set(scene, light_set)
    return scene


def replace_lights(scene: native.Scene, data: SceneData) -> None:
    """Gives a native scene the lights of data, from which it must differ in nothing else. Raises
    RaybundleError if the native library rejects a light."""
    scene.remove_lights()
    _add_lights(scene, data.lights)
    for identifier, light_set in enumerate(data.light_sets):
        for light in light_set.lights:
            scene.set_light_set(light, identifier)


def _add_mesh(scene: native.Scene, mesh: MeshData) -> None:
    identifier = scene.add_mesh(mesh.name, mesh.vertices, mesh.corner_vertices, mesh.face_offsets,
                                mesh.face_materials)
    scene.set_mesh_corner_normals(identifier, mesh.corner_normals)
    scene.set_mesh_sharp_edges(identifier, mesh.sharp_edges)
    if mesh.uvs is not None:
        scene.set_mesh_uvs(identifier, mesh.uvs)
    if mesh.corner_colors is not None:
        scene.set_mesh_corner_colors(identifier, mesh.corner_colors)


def _add_lights(scene: native.Scene, lights: Sequence[LightData]) -> None:
    for light in lights:
        _add_light(scene, light)


def _add_light(scene: native.Scene, light: LightData) -> None:
    if isinstance(light, PointLightData):
        identifier = scene.add_point_light(light.name, light.position, light.intensity,
                                           light.radius, light.shape)
        if light.world_to_light is not None:
            scene.set_light_cone(identifier, light.world_to_light, light.cone_angle,
                                 light.cone_blend, light.cone_dims)
    elif isinstance(light, AreaLightData):
        identifier = scene.add_area_light(light.name, light.centre, light.axis_u, light.axis_v,
                                          light.radiance, light.shape)
        scene.set_light_spread(identifier, light.spread)
    else:
        identifier = scene.add_sun_light(light.name, light.direction, light.irradiance, light.angle)
    scene.set_light_shadows(identifier, light.casts_shadows)


def _add_light_set(scene: native.Scene, light_set: LightSetData) -> None:
    identifier = scene.add_light_set(light_set.name)
    for light in light_set.lights:
        scene.set_light_set(light, identifier)
    for instance in light_set.instances:
        scene.set_instance_light_set(instance, identifier)
    if light_set.world:
        scene.set_world_light_set(identifier)
