# SPDX-License-Identifier: GPL-3.0-or-later
"""The albedo of gloss, compared with closed forms and with Cycles of the running Blender."""

import math

import bpy
import numpy as np
import pytest
from cycles_comparison import square
from cycles_reference import bake_objects
from raybundle.materials.diffuse_angles import MEANS
from raybundle.materials.gloss import gloss_albedo, ior_of
from raybundle.materials.principled import PrincipledSockets, principled_albedo


def fresnel_mean(n):
    """Returns the mean reflectance of a dielectric over all directions, weighted by the cosine.

    Evaluates Fresnel's formulas at 20000 midpoints. n: index of refraction.
    """
    cosine = np.sqrt((np.arange(20000) + 0.5) / 20000)
    g = np.sqrt(n**2 - 1.0 + cosine**2)
    a, b = (cosine - g) / (cosine + g), (n**2 * cosine - g) / (n**2 * cosine + g)
    return 0.5 * (a**2 + b**2).mean()


@pytest.mark.parametrize("ior", [1.2, 1.5, 2.0])
def test_smooth(ior):
    f0 = ((ior - 1.0) / (ior + 1.0))**2
    assert ior_of(f0) == pytest.approx(ior)
    # The albedo is a sum over 96 directions, whose midpoints miss a part of the steep rise at
    # grazing angles.
    assert gloss_albedo(0.0, ior).of(f0) == pytest.approx(fresnel_mean(ior), abs=1e-3)
    assert gloss_albedo(0.0, ior, from_above=True).of(f0) == pytest.approx(f0, rel=1e-3)
    assert gloss_albedo(0.0, ior).white == pytest.approx(1.0, abs=1e-4)


def test_rough_from_above():
    """The albedo of GGX with alpha = 1, for a view from straight above, has a closed form.

    All slopes up to 1 reflect light upwards. With u the squared cosine of the facet, c = 2 u - 1
    and G = 2 c / (1 + c), the integral of G over u from 1/2 to 1 is 1 - ln 2.
    """
    assert gloss_albedo(1.0, 1.5, from_above=True).white == pytest.approx(1.0 - math.log(2.0),
                                                                           abs=2e-3)


@pytest.mark.parametrize("roughness", [0.0, 0.3, 0.7, 1.0])
def test_white_loses_nothing_where_light_meets_several_facets(roughness):
    assert gloss_albedo(roughness, 1.5).of(1.0, multiple=True) == pytest.approx(1.0)


@pytest.mark.parametrize("roughness", [0.2, 0.5, 1.0])
@pytest.mark.parametrize("metallic", [0.0, 1.0])
def test_cycles_from_above(new_object, new_world, roughness, metallic):
    """The light that a sheet under a uniform sky reflects straight up, as Cycles bakes it."""
    base, f0 = 0.6, 0.08 * 0.5
    material = bpy.data.materials.new("Sheet")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    node = next(node for node in material.node_tree.nodes if node.type == 'BSDF_PRINCIPLED')
    node.inputs['Base Color'].default_value = (base, base, base, 1.0)
    node.inputs['Roughness'].default_value = roughness
    node.inputs['Metallic'].default_value = metallic
    node.inputs['IOR'].default_value = 1.5
    new_world((1.0, 1.0, 1.0))
    sheet = new_object("Sheet", *square(1.0, 8), material)
    passes = frozenset({"DIRECT", "INDIRECT", "COLOR"})
    found = bake_objects([sheet], 512, 0, "GLOSSY", passes)["Sheet"].mean()
    new = bpy.app.version >= (4, 0, 0)
    albedo = gloss_albedo(roughness, 1.5, from_above=True, correlated=new)
    expected = albedo.of(base if metallic else f0, node.distribution == 'MULTI_GGX')
    # The tolerance covers the noise of Cycles and its fit of multiple reflections.
    assert found == pytest.approx(expected, rel=0.02, abs=0.001)
    if not metallic:
        diffuse = bake_objects([sheet], 512, 0, "DIFFUSE", passes)["Sheet"].mean()
        found = principled_albedo(PrincipledSockets(
            roughness, 0.5, 1.5, 0.0, node.distribution == 'MULTI_GGX', base), 0.0)
        from_everywhere = found.angles.shown[0, 0] + MEANS @ found.angles.shown[1:, 0]
        assert diffuse == pytest.approx(base * found.shown * from_everywhere, rel=0.01)
