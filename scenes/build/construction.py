"""Building blocks of the scenes: shapes, shaders, objects, lights, camera, world and settings.

A `Shape` consists of numpy arrays only. Nothing is added to Blender's data before `add_mesh`.
Lengths are in metres.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Sequence, Union

import bpy
import numpy as np
from mathutils import Vector

Colour = tuple[float, float, float]
Point = Sequence[float]

WHITE: Colour = (0.73, 0.73, 0.73)


# Shapes ------------------------------------------------------------------------------------------

@dataclass(frozen=True)
class FaceBlock:
    """Faces with equal numbers of corners and one material slot.

    corners: (faces, corners per face), indices of vertices.
    """

    corners: np.ndarray
    slot: int = 0


@dataclass(frozen=True)
class Shape:
    """Vertices and the faces between them.

    vertices: (n, 3), m. The corners of a face run anticlockwise as seen from its front.
    """

    vertices: np.ndarray
    blocks: list[FaceBlock] = field(default_factory=list)

    def moved(self, offset: Point) -> Shape:
        """Returns the shape moved by the offset."""
        return Shape(self.vertices + np.asarray(offset, dtype=float), self.blocks)

    def turned(self, degrees: float) -> Shape:
        """Returns the shape rotated anticlockwise about the z axis."""
        angle = math.radians(degrees)
        rotation = np.array([[math.cos(angle), -math.sin(angle), 0.0],
                             [math.sin(angle), math.cos(angle), 0.0],
                             [0.0, 0.0, 1.0]])
        return Shape(self.vertices @ rotation.T, self.blocks)

    def flipped(self) -> Shape:
        """Returns the shape with fronts and backs exchanged."""
        return Shape(self.vertices,
                     [FaceBlock(block.corners[:, ::-1], block.slot) for block in self.blocks])

    def with_slot(self, slot: int) -> Shape:
        """Returns the shape with all faces in one material slot."""
        return Shape(self.vertices, [FaceBlock(block.corners, slot) for block in self.blocks])

    def welded(self) -> Shape:
        """Returns the shape with vertices in one place (to a micrometre) merged."""
        _, kept, index = np.unique(np.round(self.vertices, 6), axis=0,
                                   return_index=True, return_inverse=True)
        index = index.reshape(-1)
        return Shape(self.vertices[kept],
                     [FaceBlock(index[block.corners], block.slot) for block in self.blocks])


# Factor for the number of cells along each edge of the grids that are built from here on.
density = 1.0


def join(shapes: Sequence[Shape]) -> Shape:
    """Returns one shape with the faces of all shapes. No vertices are welded."""
    offsets = np.cumsum([0] + [len(shape.vertices) for shape in shapes])
    return Shape(np.concatenate([shape.vertices for shape in shapes]),
                 [FaceBlock(block.corners + offset, block.slot)
                  for shape, offset in zip(shapes, offsets) for block in shape.blocks])


def grid(origin: Point, along_u: Point, along_v: Point, cells_u: int, cells_v: int) -> Shape:
    """Returns a parallelogram of quads whose front faces along ``along_u`` x ``along_v``.

    The numbers of cells are multiplied by `density`.
    """
    cells_u, cells_v = (max(1, round(cells * density)) for cells in (cells_u, cells_v))
    start, edge_u, edge_v = (np.asarray(value, dtype=float)
                             for value in (origin, along_u, along_v))
    u, v = np.meshgrid(np.arange(cells_u + 1) / cells_u, np.arange(cells_v + 1) / cells_v)
    vertices = start + u.reshape(-1, 1) * edge_u + v.reshape(-1, 1) * edge_v
    column, row = np.meshgrid(np.arange(cells_u), np.arange(cells_v))
    first = (row * (cells_u + 1) + column).reshape(-1)
    corners = np.stack([first, first + 1, first + cells_u + 2, first + cells_u + 1], axis=1)
    return Shape(vertices, [FaceBlock(corners)])


def box_sides(size: Point, cells: Sequence[int] = (1, 1, 1)) -> dict[str, Shape]:
    """Returns the six sides of a box with outward fronts. The centre of its base is the origin."""
    (x, y, z), (nx, ny, nz) = size, cells
    east, north = x / 2, y / 2
    return {
        "bottom": grid((-east, north, 0), (x, 0, 0), (0, -y, 0), nx, ny),
        "top": grid((-east, -north, z), (x, 0, 0), (0, y, 0), nx, ny),
        "south": grid((-east, -north, 0), (x, 0, 0), (0, 0, z), nx, nz),
        "north": grid((east, north, 0), (-x, 0, 0), (0, 0, z), nx, nz),
        "west": grid((-east, north, 0), (0, -y, 0), (0, 0, z), ny, nz),
        "east": grid((east, -north, 0), (0, y, 0), (0, 0, z), ny, nz),
    }


def box(size: Point, cells: Sequence[int] = (1, 1, 1), at: Point = (0, 0, 0),
        slots: dict[str, int] | None = None) -> Shape:
    """Returns a closed box with outward fronts, which stands on ``at``.

    slots: material slots by names of sides; 0 by default.
    """
    sides = box_sides(size, cells)
    slots = slots or {}
    shape = join([side.with_slot(slots.get(name, 0)) for name, side in sides.items()])
    return shape.welded().moved(at)


def room(size: Point, cells: Sequence[int]) -> dict[str, Shape]:
    """Returns floor, ceiling and four walls of a room, with the fronts inside.

    The centre of the floor is the origin.
    """
    names = {"bottom": "floor", "top": "ceiling", "south": "wall_south", "north": "wall_north",
             "west": "wall_west", "east": "wall_east"}
    return {names[name]: side.flipped() for name, side in box_sides(size, cells).items()}


def cylinder(radius: float, height: float, sides: int, at: Point = (0, 0, 0),
             bottom_slot: int = 0, top_slot: int = 0) -> Shape:
    """Returns a closed cylinder that stands on ``at``. Each of its ends is one n-gon."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(sides)], axis=1)
    index = np.arange(sides)
    after = (index + 1) % sides
    return Shape(np.concatenate([ring, ring + (0, 0, height)]), [
        FaceBlock(np.stack([index, after, after + sides, index + sides], axis=1)),
        FaceBlock(index[::-1].reshape(1, -1), bottom_slot),
        FaceBlock((index + sides).reshape(1, -1), top_slot),
    ]).moved(at)


def uv_sphere(radius: float, segments: int, rings: int, at: Point = (0, 0, 0)) -> Shape:
    """Returns a sphere with outward fronts: quads, and triangle fans at the two poles."""
    longitude, colatitude = np.meshgrid(2 * np.pi * np.arange(segments) / segments,
                                        np.pi * np.arange(1, rings) / rings)
    belt = np.stack([np.sin(colatitude) * np.cos(longitude),
                     np.sin(colatitude) * np.sin(longitude), np.cos(colatitude)], axis=2)
    vertices = np.concatenate([[(0, 0, 1)], belt.reshape(-1, 3), [(0, 0, -1)]])
    index = np.arange(segments)
    after = (index + 1) % segments
    upper = (1 + segments * np.arange(rings - 2)).reshape(-1, 1)
    quads = np.stack([upper + index, upper + index + segments, upper + after + segments,
                      upper + after], axis=2).reshape(-1, 4)
    last = 1 + segments * (rings - 2)
    north = np.stack([np.zeros(segments, dtype=int), 1 + index, 1 + after], axis=1)
    south = np.stack([last + after, last + index,
                      np.full(segments, last + segments)], axis=1)
    return Shape(radius * vertices, [FaceBlock(north), FaceBlock(quads),
                                     FaceBlock(south)]).moved(at)


# Shaders -----------------------------------------------------------------------------------------

@dataclass(frozen=True)
class Diffuse:
    """A Lambertian surface."""

    colour: Colour


@dataclass(frozen=True)
class Emission:
    """A surface that emits the radiance ``colour * strength``, W/(m^2 sr), and reflects nothing."""

    colour: Colour
    strength: float


@dataclass(frozen=True)
class Principled:
    """A Principled BSDF without a specular part, which is Lambertian."""

    colour: Colour


@dataclass(frozen=True)
class Sum:
    """The sum of two shaders (Add Shader)."""

    first: Shader
    second: Shader


@dataclass(frozen=True)
class OneSided:
    """A shader on the front and another one on the back (Mix Shader by Backfacing)."""

    front: Shader
    back: Shader


Shader = Union[Diffuse, Emission, Principled, Sum, OneSided]


def material(name: str, shader: Shader) -> bpy.types.Material:
    """Returns a new material with this shader."""
    result = bpy.data.materials.new(name)
    result.use_nodes = True
    tree = result.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(_shader_socket(tree, shader, -250, 0), output.inputs["Surface"])
    result.diffuse_color = (*_display_colour(shader), 1.0)
    return result


def _shader_socket(tree: bpy.types.NodeTree, shader: Shader, x: float, y: float
                   ) -> bpy.types.NodeSocket:
    """Adds the nodes of a shader at this place in the node editor. Returns their output socket."""
    if isinstance(shader, Diffuse):
        node = tree.nodes.new("ShaderNodeBsdfDiffuse")
        node.inputs["Color"].default_value = (*shader.colour, 1.0)
    elif isinstance(shader, Emission):
        node = tree.nodes.new("ShaderNodeEmission")
        node.inputs["Color"].default_value = (*shader.colour, 1.0)
        node.inputs["Strength"].default_value = shader.strength
    elif isinstance(shader, Principled):
        node = tree.nodes.new("ShaderNodeBsdfPrincipled")
        node.inputs["Base Color"].default_value = (*shader.colour, 1.0)
        node.inputs["Roughness"].default_value = 1.0
        specular = node.inputs.get("Specular IOR Level") or node.inputs["Specular"]
        specular.default_value = 0.0
    elif isinstance(shader, Sum):
        node = tree.nodes.new("ShaderNodeAddShader")
        tree.links.new(_shader_socket(tree, shader.first, x - 250, y + 150), node.inputs[0])
        tree.links.new(_shader_socket(tree, shader.second, x - 250, y - 150), node.inputs[1])
    else:
        node = tree.nodes.new("ShaderNodeMixShader")
        geometry = tree.nodes.new("ShaderNodeNewGeometry")
        geometry.location = (x - 250, y + 400)
        tree.links.new(geometry.outputs["Backfacing"], node.inputs["Fac"])
        tree.links.new(_shader_socket(tree, shader.front, x - 250, y + 100), node.inputs[1])
        tree.links.new(_shader_socket(tree, shader.back, x - 250, y - 150), node.inputs[2])
    node.location = (x, y)
    return node.outputs[0]


def _display_colour(shader: Shader) -> Colour:
    """Returns the colour that the solid view shows."""
    if isinstance(shader, Sum):
        return _display_colour(shader.first)
    if isinstance(shader, OneSided):
        return _display_colour(shader.front)
    return shader.colour


# Objects -----------------------------------------------------------------------------------------

def new_mesh(name: str, shape: Shape, materials: Sequence[bpy.types.Material]
             ) -> bpy.types.Mesh:
    """Returns a new flat-shaded mesh with the faces of the shape."""
    mesh = bpy.data.meshes.new(name)
    faces = [corners for block in shape.blocks for corners in block.corners.tolist()]
    mesh.from_pydata(shape.vertices.tolist(), [], faces)
    for entry in materials:
        mesh.materials.append(entry)
    slots = np.concatenate([np.full(len(block.corners), block.slot, dtype=np.int32)
                            for block in shape.blocks])
    mesh.polygons.foreach_set("material_index", slots)
    mesh.update()
    mesh.validate()
    return mesh


def add_object(name: str, data: bpy.types.ID | None,
               collection: bpy.types.Collection | None = None) -> bpy.types.Object:
    """Returns a new object with this data, linked to the collection or else to the scene's."""
    result = bpy.data.objects.new(name, data)
    (collection or bpy.context.scene.collection).objects.link(result)
    return result


def add_mesh(name: str, shape: Shape, *materials: bpy.types.Material,
             collection: bpy.types.Collection | None = None) -> bpy.types.Object:
    """Returns a new object with a mesh of its own."""
    return add_object(name, new_mesh(name, shape, materials), collection)


def smooth(mesh: bpy.types.Mesh) -> None:
    """Shades all faces smooth. Edges that are marked sharp stay sharp."""
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), dtype=bool))
    if hasattr(mesh, "use_auto_smooth"):
        mesh.use_auto_smooth = True
        mesh.auto_smooth_angle = math.pi
    mesh.update()


def mark_sharp(mesh: bpy.types.Mesh, *groups: np.ndarray) -> None:
    """Marks the edges sharp whose two vertices are both in one of the groups.

    groups: (vertices,) masks.
    """
    ends = np.empty(2 * len(mesh.edges), dtype=np.int32)
    mesh.edges.foreach_get("vertices", ends)
    inside = [group[ends].reshape(-1, 2).all(axis=1) for group in groups]
    mesh.edges.foreach_set("use_edge_sharp", np.any(inside, axis=0))
    mesh.update()


def point_at(item: bpy.types.Object, location: Point, target: Point) -> None:
    """Places a camera or a light and turns it towards the target."""
    item.location = location
    direction = Vector(target) - Vector(location)
    item.rotation_euler = direction.to_track_quat("-Z", "Y").to_euler()


def set_camera(location: Point, target: Point, lens: float = 24.0,
               clip_start: float = 0.1) -> bpy.types.Object:
    """Adds the scene's camera. Surfaces nearer than ``clip_start`` (m) are not in its picture."""
    data = bpy.data.cameras.new("camera")
    data.lens = lens
    data.clip_start = clip_start
    result = add_object("camera", data)
    point_at(result, location, target)
    bpy.context.scene.camera = result
    return result


def add_point_light(name: str, location: Point, power: float, radius: float
                    ) -> bpy.types.Object:
    """Adds a point light. Its power is in W, its radius in m."""
    data = bpy.data.lights.new(name, "POINT")
    data.energy = power
    data.shadow_soft_size = radius
    result = add_object(name, data)
    result.location = location
    return result


def add_area_light(name: str, location: Point, target: Point, size: tuple[float, float],
                   power: float) -> bpy.types.Object:
    """Adds a rectangular area light that faces the target. Its power is in W, its size in m."""
    data = bpy.data.lights.new(name, "AREA")
    data.shape = "RECTANGLE"
    data.size, data.size_y = size
    data.energy = power
    result = add_object(name, data)
    point_at(result, location, target)
    return result


def add_sun(name: str, towards: Point, irradiance: float, colour: Colour) -> bpy.types.Object:
    """Adds a sun with the angular diameter of the real one, 0.53 degrees.

    towards: direction from the scene to the sun. irradiance: W/m^2, on a surface that faces the
    sun.
    """
    data = bpy.data.lights.new(name, "SUN")
    data.energy = irradiance
    data.color = colour
    data.angle = math.radians(0.53)
    result = add_object(name, data)
    point_at(result, towards, (0, 0, 0))
    return result


def set_world(colour: Colour = (0, 0, 0), strength: float = 1.0) -> None:
    """Gives the scene a world of the constant radiance ``colour * strength``."""
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    background = tree.nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = (*colour, 1.0)
    background.inputs["Strength"].default_value = strength
    background.location = (-250, 0)
    output = tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(background.outputs[0], output.inputs["Surface"])
    world.color = colour
    bpy.context.scene.world = world


def set_sky() -> None:
    """Gives the scene a world that varies with the direction: Blender's sky, without its sun."""
    set_world(strength=0.3)
    tree = bpy.context.scene.world.node_tree
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sun_disc = False
    sky.sun_elevation = math.radians(50)
    sky.location = (-500, 0)
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    tree.links.new(sky.outputs[0], background.inputs["Color"])


def set_render_settings(scene: bpy.types.Scene) -> None:
    """Sets up Cycles without denoising, with all diffuse bounces that matter and sRGB output."""
    scene.render.engine = "CYCLES"
    scene.render.filepath = "//"
    scene.render.resolution_x, scene.render.resolution_y = 960, 720
    cycles = scene.cycles
    cycles.samples = 64
    cycles.use_denoising = False
    cycles.use_preview_denoising = False
    cycles.max_bounces = cycles.diffuse_bounces = 64
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    scene.view_settings.view_transform = "Standard"
    scene.view_settings.look = "None"
    scene.view_settings.exposure = 0.0
    scene.view_settings.gamma = 1.0


def show_vertex_colours(screens: Sequence[bpy.types.Screen]) -> None:
    """Makes every 3D view of the file open on the camera, with vertex colours without shading."""
    for screen in screens:
        for area in screen.areas:
            for space in area.spaces:
                if space.type != "VIEW_3D":
                    continue
                space.shading.light = "FLAT"
                space.shading.color_type = "VERTEX"
                if space.region_3d is not None:
                    space.region_3d.view_perspective = "CAMERA"
