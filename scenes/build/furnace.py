"""The furnace: a closed box whose walls emit and reflect equally, so that its light is uniform."""

from __future__ import annotations

import bpy

from .construction import (Diffuse, Emission, Sum, add_mesh, box, material, set_camera,
                           set_world)

EMITTED, REFLECTANCE = 0.5, 0.5


def build(context: bpy.types.Context) -> None:
    """Fills the scene, and stores the exact light (irradiance / pi) as a property of it."""
    walls = material("walls", Sum(Emission((1, 1, 1), EMITTED), Diffuse((REFLECTANCE,) * 3)))
    add_mesh("walls", box((3, 2, 2), (12, 8, 8)).flipped(), walls)
    context.scene["exact_lighting"] = [EMITTED / (1 - REFLECTANCE)] * 3
    set_world()
    set_camera((-1.3, -0.9, 1.2), (1.3, 0.9, 0.9), lens=20)
