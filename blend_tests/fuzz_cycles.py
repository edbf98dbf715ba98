# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes random scenes (fuzz_scenes.py) at the defaults, and compares each object with Cycles.

    blender -b --factory-startup --python-exit-code 1 -P blend_tests/fuzz_cycles.py -- FIRST LAST \\
        [--samples 128] [--json FILE]

Prints a line for each seed from FIRST to LAST:

    light      deviation of the mean light of an object (LIGHTING, by area, the channel with the
               largest deviation) from that of Cycles, relative to the latter, or to 5 % of the
               scene's mean light if that is more. Shown for the object with the largest deviation
               relative to its limit. The limit is 6 %, or three times the noise of both if that is
               more: the noise that Raybundle states for the object, and that of Cycles, from two
               bakes with half of the samples each
    smooth     the same of objects that are shaded smooth. They do not count, because Cycles uses
               the normals of their vertices for lighting
    balance    error of the energy balance, at most 1 %
    bundles    at most 4000

Cycles bakes probes: faces of a quarter of each face, in its middle and just above it, which no ray
meets. Its values are therefore at four points inside of each quad, whose mean is that of the face,
and no value is on an edge. The light of emissive meshes is found without sampling them as lights.
If they are sampled, Cycles 3.4 is some per cent too dark beside them (docs/validation.md). Without
sampling, rare bright paths from a small emissive mesh are missing more often than two bakes show.
Moreover, four points miss a bright spot that is smaller than a face. An object whose deviation is
too large is therefore compared again, with sampled lamps and 64 points per face.
"""

from __future__ import annotations

import json
import sys
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path

import bmesh
import bpy
import numpy as np

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent / "addon"), str(HERE)]
sys.dont_write_bytecode = True

import command_line  # noqa: E402
import fuzz_scenes  # noqa: E402
import raybundle  # noqa: E402
from cycles_reference import bake_objects, sample_emissive_meshes  # noqa: E402
from scene_items import edited, new_shader  # noqa: E402
from surface_error import (  # noqa: E402
    corner_areas, corner_vertices, face_means, face_sizes, read_colors, world_positions)

LIGHT, NOISES, DARK, BALANCE, BUNDLES = 0.06, 3.0, 0.05, 0.01, 4000
HEIGHT = 1e-3  # height of a probe above its face, relative to the size of the face
# Kinds of rays that do not meet the probes. Without any kind of ray Cycles would leave an object
# out. One kind remains, which no scene here uses.
INVISIBLE = ("camera", "diffuse", "glossy", "transmission", "shadow")


@dataclass
class ObjectLight:
    """The deviation of an object's mean light from that of Cycles, and its limit, both relative."""

    name: str
    is_smooth: bool
    deviation: float
    allowed: float

    def is_wrong(self) -> bool:
        return not self.is_smooth and not self.deviation <= self.allowed


@dataclass
class Outcome:
    """The comparison of one scene."""

    seed: int
    kind: str
    objects: list[ObjectLight] = field(default_factory=list)
    balance: float = np.nan
    bundles: int = 0
    seconds: float = 0.0
    cycles_seconds: float = 0.0
    warnings: list[str] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)


# --------------------------------------------------------------------------------------------------
# Cycles
# --------------------------------------------------------------------------------------------------


def add_probe(item: bpy.types.Object) -> bpy.types.Object:
    """Adds a probe. Its corners are half-way from those of the object's faces to their centres."""
    mesh = item.data
    corners = world_positions(item)[corner_vertices(mesh)].astype(float)
    sizes = face_sizes(mesh)
    centres = np.repeat(face_means(item, corners), sizes, axis=0)
    normals = np.empty(3 * len(mesh.polygons), np.float32)
    mesh.polygons.foreach_get('normal', normals)
    to_world = np.linalg.inv(np.array(item.matrix_world)[:3, :3])
    normals = np.repeat(_unit(normals.reshape(-1, 3) @ to_world), sizes, axis=0)
    extent = np.repeat(np.sqrt(corner_areas(item) * sizes.repeat(sizes)), 1)[:, None]
    places = 0.5 * (corners + centres) + HEIGHT * extent * normals
    ends = np.cumsum(sizes)
    faces = [list(range(end - size, end)) for end, size in zip(ends.tolist(), sizes.tolist())]
    is_mirrored = item.matrix_world.determinant() < 0.0
    probe_mesh = bpy.data.meshes.new(f"{item.name}.probe")
    probe_mesh.from_pydata(places.tolist(), [], [face[::-1] if is_mirrored else face
                                                 for face in faces])
    if is_smooth(item):
        vertex_normals = np.empty(3 * len(mesh.loops), np.float32)
        mesh.calc_normals_split()
        mesh.loops.foreach_get('normal', vertex_normals)
        vertex_normals = vertex_normals.reshape(-1, 3) @ to_world
        mean = np.repeat(face_means(item, vertex_normals), sizes, axis=0)
        probe_mesh.polygons.foreach_set('use_smooth', np.ones(len(sizes), bool))
        probe_mesh.use_auto_smooth = True
        probe_mesh.normals_split_custom_set_from_vertices(
            _unit(0.5 * (vertex_normals + mean)).tolist())
    probe_mesh.materials.append(_white())
    probe = bpy.data.objects.new(probe_mesh.name, probe_mesh)
    for ray in INVISIBLE:
        setattr(probe, f"visible_{ray}", False)
    bpy.context.scene.collection.objects.link(probe)
    return probe


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1), 1e-30)[:, None]


def _white() -> bpy.types.Material:
    found = bpy.data.materials.get("white probe")
    if found is None:
        found = bpy.data.materials.new("white probe")
        new_shader(found, 'ShaderNodeBsdfDiffuse')
    return found


def is_smooth(item: bpy.types.Object) -> bool:
    return any(polygon.use_smooth for polygon in item.data.polygons)


@dataclass(frozen=True)
class CyclesLight:
    """The light that Cycles bakes at the corners of an object's probe."""

    areas: np.ndarray  # (corners,) areas, m^2
    halves: np.ndarray  # (2, corners, 3): independent bakes with half of the samples each

    def mean(self) -> np.ndarray:
        return self.areas @ self.halves.mean(axis=0) / self.areas.sum()

    def noise(self) -> np.ndarray:
        """Returns (3,) the noise of the mean. The random numbers of the values are independent."""
        difference = self.halves[0] - self.halves[1]
        return 0.5 * np.sqrt(self.areas ** 2 @ difference ** 2) / self.areas.sum()


def cycles_light(items: list[bpy.types.Object], samples: int, lamps_are_sampled: bool = False,
                 cuts: int = 0) -> dict[str, CyclesLight]:
    """Returns the light of Cycles by object name.

    cuts: number of cuts of each edge, for more points in each face.
    """
    sample_emissive_meshes(lamps_are_sampled)
    copies = [_cut(item, cuts) for item in items]
    areas = [corner_areas(copy) for copy in copies]
    probes = [add_probe(copy) for copy in copies]
    for copy in copies:
        bpy.data.meshes.remove(copy.data)
    bpy.context.view_layer.update()
    bakes = [bake_objects(probes, samples // 2, seed) for seed in (1, 2)]
    result = {}
    for item, probe, own in zip(items, probes, areas):
        # The faces of a mirrored object have the reverse order of corners. The values are matched
        # by vertex.
        vertices = corner_vertices(probe.data)
        halves = np.empty((2, len(vertices), 3))
        for half, bake in zip(halves, bakes):
            half[vertices] = bake[probe.name]
        result[item.name] = CyclesLight(own, halves)
        bpy.data.meshes.remove(probe.data)
    return result


def _cut(item: bpy.types.Object, cuts: int) -> bpy.types.Object:
    copy = item.copy()
    copy.data = item.data.copy()
    if cuts:
        for mesh in edited(copy):
            bmesh.ops.subdivide_edges(mesh, edges=mesh.edges[:], cuts=cuts, use_grid_fill=True)
    return copy


# --------------------------------------------------------------------------------------------------
# Comparison
# --------------------------------------------------------------------------------------------------


def measure(seed: int, samples: int = 128) -> Outcome:
    outcome = Outcome(seed, fuzz_scenes.build(seed))
    items = [item for item in bpy.context.scene.objects if item.type == 'MESH']
    started = time.perf_counter()
    try:
        report = raybundle.bake(bpy.context, output='LIGHTING', domain='CORNER')
    except (raybundle.BakeError, raybundle.RaybundleError) as error:
        outcome.failures.append(f"refused: {error}")
        return outcome
    outcome.seconds = time.perf_counter() - started
    outcome.balance, outcome.bundles = report.energy['balance_error'], report.bundles
    outcome.warnings = [text for text in report.warnings if "too coarse" not in text]
    baked = {entry.name: entry.error.get('noise', 0.0) for entry in report.objects}
    started = time.perf_counter()
    outcome.objects = compare(items, baked, cycles_light(items, samples))
    if any(entry.is_wrong() for entry in outcome.objects):
        again = compare(items, baked, cycles_light(items, samples, True, cuts=3))
        outcome.objects = [second if first.is_wrong() else first
                           for first, second in zip(outcome.objects, again)]
    outcome.cycles_seconds = time.perf_counter() - started
    outcome.failures += [f"{entry.name} {100 * entry.deviation:.3g} % off"
                         for entry in outcome.objects if entry.is_wrong()]
    if not outcome.balance <= BALANCE:
        outcome.failures.append(f"balance {outcome.balance:.2g}")
    if outcome.bundles > BUNDLES:
        outcome.failures.append(f"{outcome.bundles} bundles")
    return outcome


def compare(items: list[bpy.types.Object], stated: dict[str, float],
            expected: dict[str, CyclesLight]) -> list[ObjectLight]:
    """Compares the light of objects with that of Cycles.

    stated: relative noise by object name. expected: light of Cycles by object name.
    """
    means = {name: light.mean() for name, light in expected.items()}
    areas = np.array([light.areas.sum() for light in expected.values()])
    dark = DARK * float(areas @ [mean.mean() for mean in means.values()] / areas.sum())
    result = []
    for item in items:
        name, areas = item.name, corner_areas(item)
        weight, light = areas / areas.sum(), read_colors(item).astype(float)
        size = max(float(means[name].mean()), dark, 1e-30)
        deviation = np.abs(weight @ light - means[name]).max() / size
        noise = expected[name].noise().max() / size
        own = stated.get(name, 0.0) * np.sqrt(weight @ (light ** 2).mean(axis=1)) / size
        result.append(ObjectLight(name, is_smooth(item), float(deviation),
                                  max(LIGHT, NOISES * float(np.hypot(noise, own)))))
    return result


def worst(objects: list[ObjectLight]) -> str:
    if not objects:
        return "-"
    found = max(objects, key=lambda entry: entry.deviation / entry.allowed)
    return f"{100 * found.deviation:.2g} % of {100 * found.allowed:.2g} % ({found.name})"


def line(outcome: Outcome) -> str:
    flat = [entry for entry in outcome.objects if not entry.is_smooth]
    smooth = [entry for entry in outcome.objects if entry.is_smooth]
    verdict = f"FAIL: {'; '.join(outcome.failures)}" if outcome.failures else "PASS"
    return (f"seed {outcome.seed} {outcome.kind}: light {worst(flat)}, smooth {worst(smooth)}, "
            f"balance {outcome.balance:.1e}, {outcome.bundles} bundles, {outcome.seconds:.1f} s "
            f"(Cycles {outcome.cycles_seconds:.1f} s): {verdict}")


def summary(outcomes: list[Outcome]) -> str:
    failed = [outcome for outcome in outcomes if outcome.failures]
    largest = max((entry.deviation for outcome in outcomes for entry in outcome.objects
                   if not entry.is_smooth), default=np.nan)
    return (f"{len(outcomes)} scenes: {len(failed)} failed"
            f"{' (' + ', '.join(str(outcome.seed) for outcome in failed) + ')' if failed else ''}; "
            f"flat objects up to {100 * largest:.2g} % off, balance up to "
            f"{max(outcome.balance for outcome in outcomes):.1e}, bundles up to "
            f"{max(outcome.bundles for outcome in outcomes)}")


def main(arguments: list[str]) -> None:
    parser = command_line.parser(__file__, __doc__)
    parser.add_argument("first", type=int)
    parser.add_argument("last", type=int)
    parser.add_argument("--samples", type=int, default=128)
    parser.add_argument("--json", type=Path, help="all figures, written to this file")
    options = parser.parse_args(arguments)
    raybundle.register()
    outcomes = []
    for seed in range(options.first, options.last + 1):
        outcomes.append(measure(seed, options.samples))
        print(line(outcomes[-1]), flush=True)
        if options.json:
            options.json.write_text(json.dumps([asdict(outcome) for outcome in outcomes], indent=1))
    print(summary(outcomes))
    if any(outcome.failures for outcome in outcomes):
        sys.exit(1)


if __name__ == "__main__":
    main(command_line.arguments())
