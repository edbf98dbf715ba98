# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts Blender's lamps to radiance, intensity or irradiance, as Cycles of the same version
does."""

from __future__ import annotations

import math
from dataclasses import replace

import bpy
import numpy as np
from mathutils import Matrix

from .image_export import ImagePixels
from .left_out import NO_CAUSTICS, NO_LINKING, has_light_linking
from .materials.node_links import output_node
from .materials.node_reader import NodeReader
from .messages import Message, quoted
from .scene_data import AreaLightData, LightData, PointLightData, SunLightData, Warnings

# Blender's default of a lamp's Max Bounces, which no path reaches.
_ALL_BOUNCES = 1024


def export_instance(instance: bpy.types.DepsgraphObjectInstance, images: ImagePixels,
                    warnings: Warnings) -> LightData | None:
    """Returns a lamp as export_light() does, by its evaluated instance. Returns None for portals
    and lamps without Diffuse visibility too, which do not light diffuse surfaces."""
    item = instance.object
    if is_portal(item.data) or not item.visible_diffuse:
        return None
    return export_light(item, instance.matrix_world, images, warnings)


def export_light(light_object: bpy.types.Object, matrix_world: Matrix, images: ImagePixels,
                 warnings: Warnings) -> LightData | None:
    """Returns a lamp in world space and physical units. Returns None if the lamp emits nothing.

    light_object: evaluated. matrix_world: of the lamp's instance. Strengths that are negative or
    not finite count as 0. Adds warnings of these strengths and of options that are ignored.
    """
    light = light_object.data
    name = light_object.name
    given = _strength(light, name, images, warnings)
    strength = np.where(np.isfinite(given), np.maximum(given, 0.0), 0.0)
    if not np.array_equal(strength, given):
        warnings.add(Message("light {name}: light that is negative or not a finite number counts "
                             "as 0", name=quoted(name)))
    if not np.any(strength > 0.0):
        return None
    _warn_of_unread_options(light_object, warnings)
    exported = _shape(light, name, matrix_world, strength)
    return exported and replace(exported, casts_shadows=_casts_shadows(light))


def _shape(light: bpy.types.Light, name: str, matrix_world: Matrix, strength: np.ndarray
           ) -> LightData | None:
    """Returns the lamp by its type. strength: (3,) W, or W/m^2 for a sun."""
    if light.type in ('POINT', 'SPOT'):
        return _point_light(light, name, matrix_world, strength)
    if light.type == 'SUN':
        direction = np.array(matrix_world.col[2][:3])
        return SunLightData(name, direction / max(np.linalg.norm(direction), 1e-30),
                            strength * sun_irradiance_factor(light.angle), light.angle)
    return _area_light(light, name, matrix_world, strength)


def area_light_radiance(power: np.ndarray, area: float, normalize: bool = True,
                        version: tuple[int, int, int] = bpy.app.version) -> np.ndarray:
    """Returns the radiance of an area light, (3,) W/(m^2 sr).

    power: (3,) W. area: m^2. normalize: whether the power is that of the whole area, which can be
    switched off from Blender 4.5 on. The factor is 1/4 before Blender 4.0, and since then 1/pi,
    which is correct.
    """
    radiance = power / (area * (4.0 if version < (4, 0, 0) else math.pi))
    return radiance if normalize else radiance * area


def sun_irradiance_factor(angle: float, version: tuple[int, int, int] = bpy.app.version
                          ) -> float:
    """Returns the ratio of irradiance, at normal incidence, to the strength of a sun. angle:
    angular diameter, radians.

    Before Blender 4.0 the strength is that of a flat disk, so that the factor is the mean cosine
    over the disk. From 4.0 on the factor is 1.
    """
    if version >= (4, 0, 0) or angle <= 0.0:
        return 1.0
    radius = math.tan(min(angle, math.pi - 1e-3) / 2.0)
    # 2 (sqrt(1 + r^2) - 1) / r^2, without the cancellation for small r.
    return 2.0 / (math.sqrt(1.0 + radius * radius) + 1.0)


def _strength(light: bpy.types.Light, name: str, images: ImagePixels, warnings: Warnings
              ) -> np.ndarray:
    """Returns the product of colour, power, exposure, temperature and nodes, (3,) W, or W/m^2 for a
    sun."""
    # Without `float`, arrays of Blender's colours and matrices are float32 from 5.0 on, in which
    # large strengths overflow.
    strength = np.array(light.color, float) * light.energy
    # Lamps have an exposure from 4.5 on.
    strength = strength * 2.0 ** getattr(light, 'exposure', 0.0)
    if getattr(light, 'use_temperature', False):
        strength = strength * np.array(light.temperature_color, float)
    if light.use_nodes and light.node_tree:
        output = output_node(light.node_tree)
        if output is None:
            return np.zeros(3)
        reader = NodeReader(Message("light {name}", name=quoted(name)), images, warnings)
        strength = strength * reader.surface(output.inputs['Surface']).emission
    return strength


def is_portal(light: bpy.types.Light) -> bool:
    """Returns whether an area lamp is a portal. A portal emits nothing. It only helps Cycles to
    sample the light of the world."""
    return getattr(_cycles_settings(light), 'is_portal', False)


def _cycles_settings(light: bpy.types.Light) -> bpy.types.PropertyGroup | None:
    # Read the original, because changes of these settings by scripts do not reach the evaluated
    # lamp.
    return getattr(light.original, 'cycles', None)


def _casts_shadows(light: bpy.types.Light) -> bool:
    cycles = _cycles_settings(light)
    # As long as Cycles has its own property, use_shadow belongs to Eevee.
    if hasattr(cycles, 'cast_shadow'):
        return cycles.cast_shadow
    return getattr(light, 'use_shadow', True)


def _warn_of_unread_options(light_object: bpy.types.Object, warnings: Warnings) -> None:
    name = quoted(light_object.name)
    bounces = getattr(_cycles_settings(light_object.data), 'max_bounces', _ALL_BOUNCES)
    if bounces < _ALL_BOUNCES:
        warnings.add(Message("light {name}: Raybundle ignores its Max Bounces of {bounces} and "
                             "reflects its light without limit: set Max Bounces to {all} to "
                             "compare", name=name, bounces=bounces, all=_ALL_BOUNCES))
    if getattr(_cycles_settings(light_object.data), 'is_caustics_light', False):
        warnings.add(Message("light {name}: {what}", name=name, what=NO_CAUSTICS))
    if has_light_linking(light_object):
        warnings.add(Message("light {name}: {what}", name=name, what=NO_LINKING))


def _point_light(light: bpy.types.Light, name: str, matrix_world: Matrix, strength: np.ndarray
                 ) -> PointLightData:
    # Before 4.0, a lamp with a radius is a disk that faces the receiver. In 4.0 it is a sphere, and
    # since 4.1 an option selects the shape.
    if bpy.app.version < (4, 0, 0):
        soft = True
    elif bpy.app.version < (4, 1, 0):
        soft = False
    else:
        soft = light.use_soft_falloff
    intensity = strength / (4.0 * math.pi)
    position = np.array(matrix_world.translation, float)
    shape = 'DISK' if soft else 'SPHERE'
    if light.type == 'POINT':
        return PointLightData(name, position, intensity, light.shadow_soft_size, shape)
    if bpy.app.version < (3, 5, 0):
        # Only the direction of the object's -Z axis matters, even if the object is scaled or
        # mirrored, and the light falls off with the cosine to this axis.
        axis = matrix_world.col[2].to_3d().normalized()
        across = matrix_world.col[0].to_3d()
        across = (across - across.dot(axis) * axis).normalized()
        world_to_light = np.array([across, axis.cross(across), axis])
    else:
        # The object's scale deforms the cone and does not change the intensity in it.
        world_to_light = np.array(matrix_world.to_3x3().inverted_safe(), float)
    return PointLightData(name, position, intensity, light.shadow_soft_size, shape,
                          world_to_light, light.spot_size, light.spot_blend,
                          cone_dims=bpy.app.version < (3, 5, 0))


def _area_light(light: bpy.types.Light, name: str, matrix_world: Matrix, strength: np.ndarray
                ) -> AreaLightData | None:
    size_u = light.size
    size_v = light.size_y if light.shape in ('RECTANGLE', 'ELLIPSE') else light.size
    matrix = np.array(matrix_world, float)[:3, :3]
    axis_u, axis_v = matrix[:, 0] * size_u / 2.0, matrix[:, 1] * size_v / 2.0
    # The lamp shines along the object's -Z axis, even if the object is mirrored.
    if np.cross(axis_u, axis_v) @ matrix[:, 2] > 0.0:
        axis_v = -axis_v
    area = 4.0 * np.linalg.norm(axis_u) * np.linalg.norm(axis_v)
    ellipse = light.shape in ('DISK', 'ELLIPSE')
    if ellipse:
        area *= math.pi / 4.0
    if area <= 0.0:
        return None
    radiance = area_light_radiance(strength, area, getattr(light, 'normalize', True))
    return AreaLightData(name, np.array(matrix_world.translation, float), axis_u, axis_v, radiance,
                         'ELLIPSE' if ellipse else 'RECTANGLE', light.spread)
