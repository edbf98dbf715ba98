"""The inside of a sphere: a cap emits, two belts reflect, and the light is uniform.

Inside a sphere every pair of patches has the form factor F_ij = A_j / A. Therefore
H = (sum A_j E_j / A) / (1 - sum A_j rho_j / A), which is uniform for any E and rho.
"""

from __future__ import annotations

import bmesh
import bpy
import numpy as np

from .construction import Diffuse, Emission, add_object, material, set_camera, set_world

RADIANCE = np.array((6.0, 5.4, 4.5))
UPPER = np.array((0.8, 0.7, 0.6))
LOWER = np.array((0.3, 0.4, 0.5))


def build(context: bpy.types.Context) -> None:
    """Fills the scene, and stores the exact light (irradiance / pi) for its tessellation."""
    strength = float(RADIANCE.max())
    mesh = bpy.data.meshes.new("sphere")
    shape = bmesh.new()
    bmesh.ops.create_icosphere(shape, subdivisions=5, radius=1.0)
    bmesh.ops.reverse_faces(shape, faces=shape.faces)
    shape.to_mesh(mesh)
    shape.free()
    mesh.materials.append(material("upper", Diffuse(tuple(UPPER))))
    mesh.materials.append(material("lower", Diffuse(tuple(LOWER))))
    mesh.materials.append(material("cap", Emission(tuple(RADIANCE / strength), strength)))

    centres, areas = np.empty(3 * len(mesh.polygons)), np.empty(len(mesh.polygons))
    mesh.polygons.foreach_get("center", centres)
    mesh.polygons.foreach_get("area", areas)
    height = centres.reshape(-1, 3)[:, 2]
    slots = np.select([height > 0.8, height > 0.0], [2, 0], 1).astype(np.int32)
    mesh.polygons.foreach_set("material_index", slots)
    add_object("sphere", mesh)

    share = np.bincount(slots, weights=areas, minlength=3) / areas.sum()
    exact = share[2] * RADIANCE / (1 - share[0] * UPPER - share[1] * LOWER)
    context.scene["exact_lighting"] = exact.tolist()
    set_world()
    set_camera((0, -0.9, 0), (0, 0.6, 0.15), lens=16, clip_start=0.01)
