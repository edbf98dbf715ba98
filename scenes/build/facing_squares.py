"""Two squares of 1 m, 1 m apart, face to face: one emits, the other one reflects."""

from __future__ import annotations

import bpy

from .construction import (Diffuse, Emission, add_mesh, grid, material, set_camera, set_world)

FORM_FACTOR = 0.19982489569838746
"""The form factor from one square to the other: parallel squares of side a at a distance of a."""


def build(context: bpy.types.Context) -> None:
    """Fills the scene, and stores the exact mean light (irradiance / pi) of the receiver in it."""
    emitter = material("emitter", Emission((1, 1, 1), 1.0))
    receiver = material("receiver", Diffuse((0.8, 0.8, 0.8)))
    add_mesh("receiver", grid((-0.5, -0.5, 0), (1, 0, 0), (0, 1, 0), 10, 10), receiver)
    add_mesh("emitter", grid((-0.5, 0.5, 1), (1, 0, 0), (0, -1, 0), 10, 10), emitter)
    context.scene["exact_mean_lighting"] = [FORM_FACTOR] * 3
    set_world()
    set_camera((1.1, -1.9, 0.75), (0, 0, 0.4), lens=35)
