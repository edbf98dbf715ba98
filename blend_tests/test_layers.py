# SPDX-License-Identifier: GPL-3.0-or-later
"""The albedo of sheen, velvet and clearcoat, compared with integrals and with Cycles."""

import bpy
import numpy as np
import pytest
from cycles_comparison import square
from cycles_reference import bake_objects
from raybundle.materials.diffuse_angles import angle_terms
from raybundle.materials.layers import burley_sheen, clearcoat, microfibers, velvet

NEW = bpy.app.version >= (4, 0, 0)


@pytest.mark.parametrize("view", [0.9, 0.5, 0.2])
def test_burley_sheen(view):
    """The albedo of Burley's sheen is the integral of (1 - cos d)^5 cos i over directions of light.

    d is the angle between the light and the half vector. The integral is a sum over midpoints of
    200 x 200 equal shares of the projected solid angle.
    """
    steps = (np.arange(200) + 0.5) / 200
    light, angle = np.sqrt(steps)[:, None], 2 * np.pi * steps
    between = view * light + np.sqrt((1 - view**2) * (1 - light**2)) * np.cos(angle)
    expected = np.pi * ((1 - np.sqrt((1 + between) / 2))**5).mean()
    terms = np.append(1.0, angle_terms(np.array([view]))[0])
    # The table is a fit with errors of up to 1e-4.
    assert terms @ burley_sheen().angles == pytest.approx(expected, abs=2e-4)


@pytest.mark.parametrize("layer", [microfibers, velvet, clearcoat])
@pytest.mark.parametrize("roughness", [0.0, 0.15, 0.4, 0.77, 1.0])
def test_less_is_sent_back_than_arrives(layer, roughness):
    views = angle_terms(np.linspace(0.1, 1.0, 20))
    found = layer(roughness)
    albedos = found.angles[0] + views @ found.by_angle
    assert albedos.min() > -0.005 and albedos.max() < 1.0
    assert 0.0 <= found.above <= found.albedo


def cloth(kind, roughness):
    material = bpy.data.materials.new("Cloth")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    output = next(node for node in tree.nodes if node.type == 'OUTPUT_MATERIAL')
    if kind == 'CLEARCOAT':
        node = next(node for node in tree.nodes if node.type == 'BSDF_PRINCIPLED')
        node.inputs['Base Color'].default_value = (0.0, 0.0, 0.0, 1.0)
        node.inputs['Specular'].default_value = 0.0
        node.inputs['Clearcoat'].default_value = 1.0
        node.inputs['Clearcoat Roughness'].default_value = roughness
        return material
    node = tree.nodes.new('ShaderNodeBsdf' + ('Sheen' if NEW else 'Velvet'))
    node.inputs['Color'].default_value = (1.0, 1.0, 1.0, 1.0)
    node.inputs['Roughness' if NEW else 'Sigma'].default_value = roughness
    if NEW:
        node.distribution = 'ASHIKHMIN' if kind == 'VELVET' else 'MICROFIBER'
    tree.links.new(node.outputs[0], output.inputs['Surface'])
    return material


@pytest.mark.parametrize("roughness", [0.35, 0.5, 1.0])
@pytest.mark.parametrize("kind", ['MICROFIBERS', 'VELVET'])
def test_cycles_from_above(new_object, new_world, kind, roughness):
    """The light that a sheet under a uniform sky reflects straight up."""
    if not NEW and kind == 'MICROFIBERS':
        pytest.skip("not in this Blender")
    new_world((1.0, 1.0, 1.0))
    sheet = new_object("Sheet", *square(1.0, 8), cloth(kind, roughness))
    pass_type = 'DIFFUSE' if kind == 'MICROFIBERS' else 'GLOSSY'
    found = bake_objects([sheet], 1024, 0, pass_type,
                         frozenset({"DIRECT", "INDIRECT", "COLOR"}))["Sheet"].mean()
    layer = {'MICROFIBERS': microfibers, 'VELVET': velvet}[kind](roughness)
    # Values are interpolated between roughnesses 0.1 apart. The largest error of the fit is 0.003.
    assert layer.angles[0] == pytest.approx(found, rel=0.03, abs=0.003)
    if kind == 'MICROFIBERS':
        assert layer.above == pytest.approx(found, rel=0.03, abs=0.001)


@pytest.mark.skipif(NEW, reason="not in this Blender")
@pytest.mark.parametrize("roughness", [0.5, 1.0])
def test_clearcoat_from_above(new_object, new_light, roughness):
    """Suns at 24 angles with equal shares of the projected solid angle replace a uniform sky."""
    sheet = new_object("Sheet", *square(1.0, 2), cloth('CLEARCOAT', roughness))
    sun = new_light("Sun", 'SUN', np.pi, angle=0.0)
    bpy.context.scene.cycles.light_sampling_threshold = 0.0
    cosines = np.sqrt((np.arange(24) + 0.5) / 24)
    found = []
    for cosine in cosines:
        sun.rotation_euler.x = np.arccos(cosine)
        light = bake_objects([sheet], 4, 0, "GLOSSY", frozenset({"DIRECT", "COLOR"}))
        found.append(light["Sheet"].mean() / cosine)
    # For lobes that are not narrow, the mean of 24 suns is accurate to 1 %, and the fit to 2e-4.
    assert clearcoat(roughness).angles[0] == pytest.approx(np.mean(found), rel=0.01, abs=2e-4)
