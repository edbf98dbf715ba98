# SPDX-License-Identifier: GPL-3.0-or-later
"""Area lights that replace emissive faces give the same light (area_lamps.py).

The lamp is far from the floor, where Cycles samples emissive faces without a bias.
"""

import bpy
import numpy as np
import pytest
from area_lamps import area_lamps
from cycles_comparison import square
from cycles_reference import bake_objects
from scene_items import new_shader

SAMPLES = 1024


@pytest.mark.parametrize("looks_down", [True, False])
@pytest.mark.parametrize("sides", [4, 24])
def test_far_from_a_lamp(new_object, new_material, sides, looks_down):
    floor = new_object("Floor", *square(2.0, 4), new_material("White", (0.8, 0.8, 0.8)))
    # The face emits on both sides, and one of them faces the floor.
    corners = [(0.2 * np.cos(angle), 0.2 * np.sin(angle), 2.0)
               for angle in 2.0 * np.pi * np.arange(sides) / sides][::-1 if looks_down else 1]
    material = bpy.data.materials.new("Lamp")
    emission = new_shader(material, 'ShaderNodeEmission')
    emission.inputs['Color'].default_value = (1.0, 0.5, 0.2, 1.0)
    emission.inputs['Strength'].default_value = 30.0
    new_object("Lamp", corners, [tuple(range(sides))], material)
    bpy.context.view_layer.update()

    meshes = bake_objects([floor], SAMPLES, 0)["Floor"].mean(axis=0)
    with area_lamps():
        lights = bake_objects([floor], SAMPLES, 1)["Floor"].mean(axis=0)
    # Each mean has a noise of about 0.1 %. A disk replaces the lamp of 24 corners, which makes a
    # smaller difference.
    assert np.allclose(lights, meshes, rtol=0.005)
    assert np.allclose(bake_objects([floor], SAMPLES, 0)["Floor"].mean(axis=0), meshes, rtol=1e-6)
    assert not [item for item in bpy.data.objects if item.type == 'LIGHT']
