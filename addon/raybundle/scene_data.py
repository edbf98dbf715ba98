# SPDX-License-Identifier: GPL-3.0-or-later
"""The exported scene as plain arrays, without bpy. It connects Blender and the native library.

Indices of meshes, materials, images, instances and lights are positions in the lists of SceneData.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields

import numpy as np

from .surface_data import SurfaceData

# About this number of vertices is part of the key of a mesh.
_KEY_VERTICES = 64


@dataclass(frozen=True)
class ImageData:
    """An image of a material."""

    name: str
    pixels: np.ndarray  # (height, width, 3) float32, linear RGB, bottom row first
    extension: str  # 'REPEAT', 'EXTEND' or 'CLIP'


@dataclass(frozen=True)
class MaterialData:
    name: str
    front: SurfaceData
    back: SurfaceData
    opacity: float = 1.0  # share of the light that does not pass straight through
    opacity_image: int | None = None  # the mean of its channels multiplies `opacity`

    @property
    def sides(self) -> tuple[SurfaceData, SurfaceData]:
        return self.front, self.back


@dataclass(frozen=True)
class MeshData:
    """A mesh of n vertices, c corners and f faces, in object space."""

    name: str
    vertices: np.ndarray  # (n, 3) float32, m
    corner_vertices: np.ndarray  # (c,) int32, the vertex of each corner
    face_offsets: np.ndarray  # (f + 1,) int32, the first corner of each face, and c
    face_materials: np.ndarray  # (f,) int32, index in SceneData.materials
    corner_normals: np.ndarray  # (c, 3) float32, unit length
    sharp_edges: np.ndarray  # (e, 2) int32, the two vertices of each edge
    face_smooth: np.ndarray  # (f,) bool, whether the face is shaded smooth
    uvs: np.ndarray | None = None  # (c, 2) float32, coordinates at which materials read images
    # (c, 3) float32, linear RGB, for materials that read an attribute
    corner_colors: np.ndarray | None = None

    @property
    def counts(self) -> tuple[int, int, int]:
        """Returns the numbers of vertices, of corners and of faces."""
        return len(self.vertices), self.corner_count, self.face_count

    @property
    def corner_count(self) -> int:
        return len(self.corner_vertices)

    @property
    def face_count(self) -> int:
        return len(self.face_offsets) - 1

    def key(self) -> tuple:
        """Returns a key that meshes with equal content share, and hardly any others."""
        return *self.counts, self.vertices[::1 + len(self.vertices) // _KEY_VERTICES].tobytes()

    def equals(self, other: MeshData) -> bool:
        """Returns whether the content is equal, the name aside."""
        return all(np.array_equal(getattr(self, item.name), getattr(other, item.name))
                   for item in fields(self) if item.name != 'name')


@dataclass(frozen=True)
class InstanceData:
    """A mesh that is placed in the world by a matrix."""

    mesh: int
    name: str
    transform: np.ndarray  # (3, 4) float64, object to world
    role: str  # 'BAKE' or 'OCCLUDE'
    side: str  # 'FRONT' or 'BACK'
    quality: str = 'SCENE'  # a key of quality.OBJECT_FACTORS
    stops_direct: bool = True  # whether the instance blocks the direct light of lamps
    # Whether the instance reflects light to other objects and blocks their light.
    exchanges: bool = True
    result_corners: np.ndarray | None = None  # (k,), corners whose light is written; None: all


@dataclass(frozen=True)
class PointLightData:
    """A point or spot lamp."""

    name: str
    position: np.ndarray  # (3,) m
    intensity: np.ndarray  # (3,) W/sr
    radius: float  # m
    shape: str  # 'DISK' (facing the receiver) or 'SPHERE'
    # (3, 3), for a spot lamp, which shines along its -Z axis
    world_to_light: np.ndarray | None = None
    cone_angle: float = 0.0  # radians, full opening of a spot lamp
    cone_blend: float = 0.0  # 0 to 1, share of the cone in which the light fades
    cone_dims: bool = False  # whether the intensity falls off with the cosine to the axis
    casts_shadows: bool = True


@dataclass(frozen=True)
class SunLightData:
    """A sun lamp, or a sun in the world's sky."""

    name: str
    direction: np.ndarray  # (3,) towards the sun
    irradiance: np.ndarray  # (3,) W/m^2 at normal incidence
    angle: float  # radians, full diameter
    casts_shadows: bool = True


@dataclass(frozen=True)
class AreaLightData:
    """An area lamp."""

    name: str
    centre: np.ndarray  # (3,) m
    axis_u: np.ndarray  # (3,) m, half axis
    axis_v: np.ndarray  # (3,) m, half axis
    radiance: np.ndarray  # (3,) W/(m^2 sr)
    shape: str  # 'RECTANGLE' or 'ELLIPSE'
    spread: float = math.pi  # radians, full opening; does not change the emitted power
    casts_shadows: bool = True


LightData = PointLightData | SunLightData | AreaLightData


@dataclass
class LightSetData:
    """A named group of lights."""
    name: str
    world: bool = False  # whether the light of the world is part of the set
    lights: list[int] = field(default_factory=list)  # indices
    instances: list[int] = field(default_factory=list)  # indices of emissive instances


@dataclass
class SceneData:
    """The whole scene as the native library receives it."""

    images: list[ImageData] = field(default_factory=list)
    materials: list[MaterialData] = field(default_factory=list)
    meshes: list[MeshData] = field(default_factory=list)
    instances: list[InstanceData] = field(default_factory=list)
    lights: list[LightData] = field(default_factory=list)
    world: np.ndarray = field(default_factory=lambda: np.zeros(3))  # (3,) W/(m^2 sr)
    # (height, width, 3) W/(m^2 sr), equirectangular as in Cycles, bottom row first. It is added to
    # `world`.
    world_image: np.ndarray | None = None
    light_sets: list[LightSetData] = field(default_factory=list)

    def emits(self, instance: int) -> bool:
        """Returns whether an instance has a material that may emit light. An image or corner
        colours that may emit can still be black."""
        used = np.unique(self.meshes[self.instances[instance].mesh].face_materials)
        return any(side.emission.may_be_positive() for index in used
                   for side in self.materials[index].sides)

    def diagonal(self) -> float:
        """Returns the diagonal of the bounding box of all instances in the world, m. Returns 0 if
        there are no instances."""
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for instance in self.instances:
            vertices = self.meshes[instance.mesh].vertices
            corners = box_corners(vertices.min(axis=0), vertices.max(axis=0))
            placed = corners @ instance.transform[:, :3].T + instance.transform[:, 3]
            low, high = np.minimum(low, placed.min(axis=0)), np.maximum(high, placed.max(axis=0))
        return float(np.linalg.norm(high - low)) if self.instances else 0.0


def box_corners(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Returns the corners of the axis-aligned box from low, (3,), to high, (3,), as (8, 3)."""
    return np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1])
                     for z in (low[2], high[2])])


class Warnings(list):
    """Messages for the report. add() keeps each message once."""

    def add(self, message: str) -> None:
        if message not in self:
            self.append(message)
