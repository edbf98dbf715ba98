# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive patches, compared with Cycles: the edge of a shadow crosses patches of the ground.

A box stands on the ground, and the sun is the only light. Walls that face away from the sun only
get light that the ground reflects. Few lines transport this light, with 2 % noise at this target
for any size of patches. The tolerance is therefore 6 % on these walls, and 1 % elsewhere.
"""

import json

import bpy
import numpy as np
import pytest
from cycles_comparison import cycles_light, raybundle_light, square

pytestmark = pytest.mark.needs_library

SAMPLES = 512
SHADOWED = ("North", "West")


@pytest.fixture
def box_in_the_sun(new_object, new_material, new_light):
    white = new_material("White", (0.8, 0.8, 0.8))
    items = [new_object("Ground", *square(6.0, 24), white)]
    sides = {"East": (0.5, 0.0), "North": (0.0, 0.5), "West": (-0.5, 0.0), "South": (0.0, -0.5)}
    for name, (x, y) in sides.items():
        wall = new_object(name, *square(1.0, 8), white, (x, y, 0.5))
        wall.rotation_euler = (np.pi / 2, 0.0, np.arctan2(x, -y))
        items.append(wall)
    items.append(new_object("Top", *square(1.0, 8), white, (0.0, 0.0, 1.0)))
    sun = new_light("Sun", 'SUN', 2.0, angle=0.01)
    sun.rotation_euler = (0.8, 0.0, 0.5)
    bpy.context.view_layer.update()
    return items


def test_box_in_the_sun(box_in_the_sun):
    actual = raybundle_light(box_in_the_sun, refine=True)
    report = json.loads(bpy.context.scene.raybundle.report)
    assert sum(entry["tiles"] for entry in report["refined"]) > 10
    for name, light in cycles_light(box_in_the_sun, samples=SAMPLES).items():
        expected = pytest.approx(light.mean(), rel=0.06 if name in SHADOWED else 0.01)
        assert actual[name].mean() == expected, name


def test_without_refinement_nothing_is_cut(box_in_the_sun):
    raybundle_light(box_in_the_sun, refine=False)
    report = json.loads(bpy.context.scene.raybundle.report)
    assert report["refined"] == []
