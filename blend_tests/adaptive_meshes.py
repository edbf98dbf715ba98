# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertices and surface error of the topologies ADAPTIVE and SUBDIVIDE.

    blender -b --factory-startup -P blend_tests/adaptive_meshes.py -- [--samples 256]

The scenes are a cube on a plane in the sun (built by scenes/build.py), open_court and cornell_box,
the latter two with every flat surface as a single face, so that no topology inherits vertices.
The truth is the light of Cycles at points inside the faces of a mesh that is finer than the tested
ones. Two bakes of Cycles with different seeds give the squared error without their noise: the mean
of the product of the differences from both. Prints a table in Markdown for each scene. Its last
column is the number of vertices that SUBDIVIDE needs for the same error, by the power law between
the two nearest of its bakes, relative to that of ADAPTIVE.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import bmesh
import bpy
import numpy as np
from mathutils.bvhtree import BVHTree

HERE = Path(__file__).parent
ROOT = HERE.parent
sys.path[:0] = [str(ROOT / "addon"), str(HERE)]
sys.dont_write_bytecode = True

import raybundle  # noqa: E402
from surface_error import (  # noqa: E402
    corner_vertices, face_means, face_sizes, read_colors, world_positions)
from surface_reference import SurfaceReference  # noqa: E402

TARGETS = (0.04, 0.02, 0.01, 0.005)
# The file, patch sizes of SUBDIVIDE, m, and that of the mesh of the truth.
SCENES = {
    "cube_on_plane": (
        ROOT / "build/scenes/cube_on_plane.blend", (0.4, 0.2, 0.1, 0.05, 0.025), 0.03),
    "open_court": (ROOT / "scenes/open_court.blend", (1.0, 0.5, 0.25, 0.12), 0.15),
    "cornell_box": (ROOT / "scenes/cornell_box.blend", (0.3, 0.15, 0.08, 0.04), 0.05),
}
# Points of the truth per object, at most: a random choice of them.
MOST_POINTS = 30_000


@dataclass(frozen=True)
class Points:
    """The truth at points of one object: positions, two independent estimates, and areas."""

    places: np.ndarray  # (n, 3), m, in the world
    light: tuple[np.ndarray, np.ndarray]  # each (n, 3)
    area: np.ndarray  # (n,)


def open_scene(path: Path) -> None:
    """Opens a file and joins the faces of its flat surfaces."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    for mesh in bpy.data.meshes:
        edited = bmesh.new()
        edited.from_mesh(mesh)
        bmesh.ops.dissolve_limit(edited, angle_limit=0.01, verts=edited.verts, edges=edited.edges)
        edited.to_mesh(mesh)
        edited.free()


def copies() -> dict[str, bpy.types.Object]:
    """Returns the finer copies in the scene by the name of the original."""
    return {item.raybundle.source.name: item for item in bpy.context.scene.objects
            if item.raybundle.source}


def find_truth(path: Path, patch_size: float, samples: int) -> dict[str, Points]:
    """Returns the truth of a scene by object name."""
    open_scene(path)
    raybundle.bake(bpy.context, topology='SUBDIVIDE', patch_size=patch_size, max_bundles=2)
    items = copies()
    references = [SurfaceReference(list(items.values()), samples, seed) for seed in (1, 2)]
    truth = {}
    random = np.random.default_rng(1)
    for name, item in items.items():
        corners = world_positions(item)[corner_vertices(item.data)]
        centres = np.repeat(face_means(item, corners), face_sizes(item.data), axis=0)
        (first, area), (second, _) = (reference.truth(item.name) for reference in references)
        used = np.flatnonzero(area > 0.0)
        share = min(1.0, MOST_POINTS / max(len(used), 1))
        used = random.choice(used, int(share * len(used)), replace=False)
        truth[name] = Points(0.5 * (corners + centres)[used], (first[used], second[used]),
                             area[used] / share)
    return truth


def shown_light(item: bpy.types.Object, places: np.ndarray) -> np.ndarray:
    """Returns the light that an object shows at points on it, (n, 3)."""
    item.data.calc_loop_triangles()
    corners = np.empty(3 * len(item.data.loop_triangles), np.int32)
    item.data.loop_triangles.foreach_get('loops', corners)
    corners = corners.reshape(-1, 3)
    positions = world_positions(item)
    vertices = corner_vertices(item.data)[corners]
    tree = BVHTree.FromPolygons(positions.tolist(), vertices.tolist())
    triangle = np.array([tree.find_nearest(place)[2] for place in places.tolist()])
    a, b, c = (positions[vertices[triangle, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    weights = np.stack([np.einsum('nk,nk->n', normal, np.cross(q - p, places - p))
                        for p, q in ((b, c), (c, a), (a, b))], axis=1)
    weights = np.maximum(weights, 0.0)
    weights /= weights.sum(axis=1, keepdims=True)
    return np.einsum('nk,nkc->nc', weights, read_colors(item)[corners[triangle]])


def measure(truth: dict[str, Points], **settings: object) -> tuple[int, float, float]:
    """Bakes the open scene. Returns the vertices of all copies, the relative RMS error of the shown
    light, and the seconds of the bake."""
    report = raybundle.bake(bpy.context, output='LIGHTING', **settings)
    items = copies()
    squares = scale = 0.0
    for name, points in truth.items():
        if len(points.places) == 0:
            continue
        shown = shown_light(items[name], points.places)
        first, second = points.light
        squares += points.area @ ((shown - first) * (shown - second)).sum(axis=1)
        scale += points.area @ (first * second).sum(axis=1)
    vertices = sum(len(item.data.vertices) for item in items.values())
    bpy.ops.raybundle.clear()
    return vertices, float(np.sqrt(max(squares, 0.0) / scale)), report.seconds['total']


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=256, help="samples of each bake of Cycles")
    parser.add_argument("--scenes", nargs="+", default=list(SCENES), choices=list(SCENES))
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])
    raybundle.register()
    for name in options.scenes:
        path, patch_sizes, finest = SCENES[name]
        truth = find_truth(path, finest, options.samples)
        open_scene(path)
        print(f"\n| {name} | vertices | surface error | time | SUBDIVIDE at this error |\n"
              "|---|---|---|---|---|", flush=True)
        even = []
        for patch_size in patch_sizes:
            vertices, error, seconds = measure(
                truth, topology='SUBDIVIDE', patch_size=patch_size, max_patches=1_000_000)
            even.append((error, vertices))
            print(f"| SUBDIVIDE {patch_size:g} m | {vertices} | {100 * error:.2f} % | "
                  f"{seconds:.1f} s | |", flush=True)
        errors, counts = np.log(np.array(sorted(even))).T
        for target in TARGETS:
            vertices, error, seconds = measure(truth, topology='ADAPTIVE', target_error=target)
            near = min(max(int(np.searchsorted(errors, np.log(error))), 1), len(errors) - 1)
            slope = (counts[near] - counts[near - 1]) / (errors[near] - errors[near - 1])
            needed = np.exp(counts[near] + slope * (np.log(error) - errors[near]))
            print(f"| ADAPTIVE {100 * target:g} % | {vertices} | {100 * error:.2f} % | "
                  f"{seconds:.1f} s | {needed / vertices:.1f} times as many |", flush=True)


if __name__ == "__main__":
    main()
