# SPDX-License-Identifier: GPL-3.0-or-later
"""Rooms with one kind of lamp each, which relations.py and lamp_noise.py bake beside the scenes.

Each is a room of 4 x 4 x 3 m, whose walls are separate objects with the fronts inside, with a box
that does not fit the floor's grid and a rotated cube in the air. The rooms differ only in what
gives light. A new kind of lamp adds a function and a row in ROOMS.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "scenes"))

from build.construction import (  # noqa: E402
    Diffuse, Emission, FaceBlock, Shape, Sum, add_mesh, add_object, add_point_light, box, cylinder,
    grid, material, room, set_world, uv_sphere)
from surface_error import corner_vertices  # noqa: E402

SIZE = (4.0, 4.0, 3.0)
WALL, LAMP_REFLECTANCE = 0.6, 0.5
FINE, COARSE = 4, 2  # cells of the walls per metre


def build(name: str, cells: int = FINE) -> None:
    """Fills an empty file with the room of this name.

    cells: cells of the walls per metre.
    """
    bpy.ops.wm.read_homefile(use_empty=True)
    set_world()
    grey = material("grey", Diffuse((WALL, WALL, WALL)))
    for wall, shape in room(SIZE, [round(cells * edge) for edge in SIZE]).items():
        add_mesh(wall, shape, grey)
    red = material("red", Diffuse((0.7, 0.3, 0.2)))
    add_mesh("box", box((0.9, 0.7, 0.8), (cells, cells, cells), at=(0.53, 0.41, 0.0)), red)
    cube = add_mesh("cube", box((0.3, 0.3, 0.3), (2, 2, 2)), grey)
    cube.location, cube.rotation_euler = (-0.9, -0.7, 1.0), (0.3, 0.2, 0.5)
    ROOMS[name]()
    bpy.context.view_layer.update()


# --------------------------------------------------------------------------------------------------
# Lamps
# --------------------------------------------------------------------------------------------------


def _light(kind: str, location: tuple[float, float, float], power: float, **values
           ) -> bpy.types.Object:
    """Adds a lamp that shines down. power: W, or W/m^2 for a sun."""
    data = bpy.data.lights.new("lamp", kind)
    data.energy = power
    for name, value in values.items():
        setattr(data, name, value)
    item = add_object("lamp", data)
    item.location = location
    return item


def _mesh_lamp(shape: Shape, radiance: float, name: str = "lamp") -> bpy.types.Object:
    """Adds an object that emits from both sides and reflects. radiance: W/(m^2 sr)."""
    grey = (LAMP_REFLECTANCE,) * 3
    return add_mesh(name, shape, material(name, Sum(Diffuse(grey), Emission((1, 1, 1), radiance))))


def _window() -> None:
    """Removes the middle of the south wall."""
    wall = bpy.data.objects["wall_south"]
    positions = np.empty(3 * len(wall.data.vertices), np.float32)
    wall.data.vertices.foreach_get('co', positions)
    positions = positions.reshape(-1, 3)
    faces = np.array([tuple(polygon.vertices) for polygon in wall.data.polygons])
    centres = positions[faces].mean(axis=1)
    hole = (np.abs(centres[:, 0]) < 1.0) & (np.abs(centres[:, 2] - 1.75) < 0.75)
    add_mesh("wall_south_open", Shape(positions, [FaceBlock(faces[~hole])]), *wall.data.materials)
    bpy.data.objects.remove(wall)


def _area(height: float) -> Callable[[], None]:
    return lambda: _light('AREA', (0, 0, height), 60.0, size=1.0)


def _sun() -> None:
    _window()
    sun = _light('SUN', (0, 0, 5), 20.0, angle=math.radians(0.53))
    sun.rotation_euler = (math.radians(55), 0, math.radians(-15))


def _sky() -> None:
    """Adds a window and a sky whose radiance depends on the direction."""
    _window()
    tree = bpy.context.scene.world.node_tree
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sky_type = 'HOSEK_WILKIE' if bpy.app.version < (5, 0, 0) else 'SINGLE_SCATTERING'
    background = next(node for node in tree.nodes if node.type == 'BACKGROUND')
    background.inputs["Strength"].default_value = 3.0
    tree.links.new(sky.outputs["Color"], background.inputs["Color"])


def _panel(low: tuple[float, float], high: tuple[float, float], height: float,
           name: str = "lamp") -> None:
    (x, y), (east, north) = low, high
    _mesh_lamp(grid((x, y, height), (0, north - y, 0), (east - x, 0, 0), 1, 1), 6.0, name)


def _panel_on_wall() -> None:
    """Adds a panel exactly in the plane of the wall."""
    _mesh_lamp(grid((-0.5, 2, 1), (0, 0, 1), (1, 0, 0), 1, 1).flipped(), 10.0)


def _two_panels() -> None:
    _panel((-0.6, -0.6), (0.0, 0.6), 2.7, "lamp_west")
    _panel((0.0, -0.6), (0.6, 0.6), 2.7, "lamp_east")


def _subdivided() -> None:
    """Adds two panels, and objects whose modifiers make many faces from few vertices."""
    _two_panels()
    grey = material("prop", Diffuse((0.5, 0.5, 0.6)))
    ball = add_mesh("ball", uv_sphere(0.35, 8, 6, at=(0, 0, 0)), grey)
    ball.location = (-0.6, 0.8, 0.36)
    ball.data.polygons.foreach_set('use_smooth', np.ones(len(ball.data.polygons), bool))
    for item, levels in ((ball, 3), (bpy.data.objects["cube"], 2)):
        modifier = item.modifiers.new("Subdivision", 'SUBSURF')
        modifier.levels = modifier.render_levels = levels


def coloured_dots(texels: int) -> np.ndarray:
    """Returns an image of 8 x 8 dots in linear colours, (texels, texels, 3).

    texels: a multiple of 8.
    """
    dots = np.random.default_rng(1).random((8, 8, 3)) ** 3
    return dots.repeat(texels // 8, axis=0).repeat(texels // 8, axis=1)


def shine_by_image(item: bpy.types.Object, pixels: np.ndarray, places: np.ndarray) -> None:
    """Gives the emission of an object's first material the colours of an image.

    pixels: (height, width, 3) linear colours, rows from the bottom. places: (vertices, 2) positions
    in the image, 0 to 1.
    """
    height, width, _ = pixels.shape
    image = bpy.data.images.new("screen", width, height, float_buffer=True)  # with linear colours
    image.pixels = np.concatenate([pixels, np.ones((height, width, 1))], axis=2).ravel()
    image.pack()
    item.data.uv_layers.new().data.foreach_set(
        'uv', places[corner_vertices(item.data)].astype(np.float32).ravel())
    tree = item.data.materials[0].node_tree
    texture = tree.nodes.new('ShaderNodeTexImage')
    texture.image = image
    emission = next(node for node in tree.nodes if node.type == 'EMISSION')
    tree.links.new(texture.outputs['Color'], emission.inputs['Color'])


def _screen() -> None:
    """Adds a screen in front of the wall that shines into the room."""
    shape = grid((-0.6, 1.9, 1.0), (0, 0, 0.8), (1.2, 0, 0), 1, 1).flipped()
    item = _mesh_lamp(shape, 40.0)
    shine_by_image(item, coloured_dots(32), (shape.vertices[:, [0, 2]] - (-0.6, 1.0)) / (1.2, 0.8))


def _part_of_wall() -> None:
    wall = bpy.data.objects["wall_north"].data
    wall.materials.append(material("lamp", Emission((1, 1, 1), 10.0)))
    centres = np.empty(3 * len(wall.polygons), np.float32)
    wall.polygons.foreach_get('center', centres)
    across, _, up = centres.reshape(-1, 3).T
    wall.polygons.foreach_set('material_index', ((np.abs(across) < 0.5) & (np.abs(up - 1.5) < 0.5))
                              .astype(np.int32))


def _polygon(corners: int = 24, radius: float = 0.5) -> None:
    angle = -2.0 * np.pi * np.arange(corners) / corners
    rim = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(corners, 2.6)], axis=1)
    _mesh_lamp(Shape(rim, [FaceBlock(np.arange(corners)[None])]), 10.0)


def _tube() -> None:
    item = _mesh_lamp(cylinder(0.05, 2.0, 24, at=(0, 0, -1)), 20.0)
    item.location, item.rotation_euler = (0, 0, 2.8), (math.pi / 2, 0, 0)


def _ring(around: int = 48, across: int = 12) -> None:
    major, minor = np.meshgrid(2 * np.pi * np.arange(around) / around,
                               2 * np.pi * np.arange(across) / across, indexing="ij")
    radius = 0.4 + 0.03 * np.cos(minor)
    vertices = np.stack([radius * np.cos(major), radius * np.sin(major),
                         2.5 + 0.03 * np.sin(minor)], axis=2).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    following, above = (i + 1) % around, (j + 1) % across
    corners = np.stack([i * across + j, following * across + j, following * across + above,
                        i * across + above], axis=2).reshape(-1, 4)
    _mesh_lamp(Shape(vertices, [FaceBlock(corners)]), 40.0)


def _wavy_panel() -> None:
    shape = grid((-0.5, -0.5, 2.6), (0, 1, 0), (1, 0, 0), 8, 8)
    x, y, _ = shape.vertices.T
    shape.vertices[:, 2] += 0.08 * np.sin(5.0 * x) * np.cos(4.0 * y)
    _mesh_lamp(shape, 6.0)


ROOMS: dict[str, Callable[[], object]] = {
    "area_flush": _area(SIZE[2]),  # in the plane of the ceiling
    "area_near": _area(SIZE[2] - 0.05),
    "point_near_wall": lambda: add_point_light("lamp", (0, 1.99, 1.5), 60.0, 0.0),
    "spot_near_wall": lambda: _light('SPOT', (0, 1.98, 2.6), 200.0, shadow_soft_size=0.0,
                                     spot_size=1.4, spot_blend=0.2),
    "sun": _sun,
    "sky": _sky,
    "panel": lambda: _panel((-0.5, -0.4), (0.5, 0.4), 2.5),
    "panel_on_wall": _panel_on_wall,
    "two_panels": _two_panels,
    "part_of_wall": _part_of_wall,
    "box": lambda: _mesh_lamp(box((0.4, 0.4, 0.4), at=(0, 0, 2.3)), 6.0),
    "polygon": _polygon,
    "bulb": lambda: _mesh_lamp(uv_sphere(0.1, 32, 16, at=(0, 0, 2.2)), 50.0),
    "tube": _tube,
    "ring": _ring,
    "wavy_panel": _wavy_panel,
    "subdivided": _subdivided,
    "screen": _screen,
}
