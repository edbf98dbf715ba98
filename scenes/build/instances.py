"""One mesh in many places: linked duplicates, a collection instance, modifiers, smooth shading."""

from __future__ import annotations

import math

import bpy

from .construction import (WHITE, Diffuse, add_area_light, add_mesh, add_object, box, cylinder,
                           grid, join, mark_sharp, material, new_mesh, set_camera, set_world,
                           smooth, uv_sphere)


def build(context: bpy.types.Context) -> None:
    """Fills the scene."""
    white = material("white", Diffuse(WHITE))
    orange = material("orange", Diffuse((0.75, 0.33, 0.08)))
    blue = material("blue", Diffuse((0.15, 0.3, 0.65)))
    green = material("green", Diffuse((0.2, 0.5, 0.2)))

    add_mesh("floor", grid((-4, -4, 0), (8, 0, 0), (0, 8, 0), 40, 40), white)
    add_mesh("wall", grid((-4, 4, 0), (8, 0, 0), (0, 0, 3), 40, 15), white)

    # An asymmetric step, so that its mirror image differs from it.
    step = new_mesh("step", join([box((0.8, 0.4, 0.3), (8, 4, 3), at=(0, -0.2, 0)),
                                  box((0.3, 0.4, 0.7), (3, 4, 7), at=(-0.25, 0.2, 0))]),
                    [orange])
    for name, location, turn, scale in (
            ("step_plain", (-2.6, -2.2, 0), 0, (1, 1, 1)),
            ("step_turned", (-0.9, -2.3, 0), 50, (1, 1, 1)),
            ("step_mirrored", (0.8, -2.2, 0), 0, (-1, 1, 1)),
            ("step_stretched", (2.6, -2.1, 0), -20, (1.6, 0.7, 1.4))):
        item = add_object(name, step)
        item.location, item.scale = location, scale
        item.rotation_euler = (0, 0, math.radians(turn))

    kit = bpy.data.collections.new("pillar_kit")
    context.scene.collection.children.link(kit)
    add_mesh("pillar", box((0.3, 0.3, 1.4), (3, 3, 14)), blue, collection=kit)
    add_mesh("capital", box((0.5, 0.5, 0.2), (5, 5, 2), at=(0, 0, 1.4)), white, collection=kit)
    context.view_layer.layer_collection.children[kit.name].exclude = True
    for name, location, scale in (("pillar_west", (-3.0, 2.6, 0), (1, 1, 1)),
                                  ("pillar_east", (3.0, 2.6, 0), (1, 1, 1.3))):
        empty = add_object(name, None)
        empty.instance_type = "COLLECTION"
        empty.instance_collection = kit
        empty.location, empty.scale = location, scale

    fence = add_mesh("fence", box((0.12, 0.05, 0.9), (1, 1, 6), at=(-2.2, 0.6, 0)), green)
    array = fence.modifiers.new("Array", "ARRAY")
    array.count = 8
    array.use_relative_offset, array.use_constant_offset = False, True
    array.constant_offset_displace = (0.25, 0, 0)

    pebble = add_mesh("pebble", box((0.9, 0.7, 0.6), (2, 2, 2), at=(1.0, 0.2, 0)), white)
    smooth(pebble.data)
    subdivision = pebble.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels = subdivision.render_levels = 2

    ball = add_mesh("ball_smooth", uv_sphere(0.45, 24, 12, at=(2.5, 0.6, 0.45)), blue)
    smooth(ball.data)
    shape = cylinder(0.4, 0.8, 24, at=(-0.2, 2.2, 0))
    drum = add_mesh("drum_sharp", shape, orange)
    upper = shape.vertices[:, 2] > 0.4
    mark_sharp(drum.data, upper, ~upper)
    smooth(drum.data)

    set_world((0.6, 0.75, 1.0), 0.35)
    add_area_light("area", (-2.5, -2.0, 4.5), (0, 0, 0), (1.5, 1.5), power=550.0)
    set_camera((4.6, -6.6, 4.0), (0.1, 0.0, 0.4), lens=32)
