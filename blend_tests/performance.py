# SPDX-License-Identifier: GPL-3.0-or-later
r"""Prints the table of docs/performance.md: the goals, and what this machine reaches.

    blender -b --factory-startup -P blend_tests/performance.py -- \
        [--only ROW ...] [--runs 3] [--samples 1024] [--micro FILE.json] [--out FILE.json]

native/bench/performance runs this script with the results of the micro-benchmarks. Times are
medians of --runs, where Cycles and Raybundle run in turns. The error is the relative RMSE over RGB
at the vertices off contact edges, with `reconstruction` POINT, against two independent bakes of
Cycles with --samples. The noise of these references is eliminated, and they have area lights in
place of emissive faces (area_lamps.py). Raybundle's time at an error is interpolated between the
targets whose errors are next to it. The time of Cycles is its time without samples, plus the time
of the samples that reduce its noise to the error. Its error beside emissive faces is not counted.

The rows are: equal (rooms), lamps (rooms whose lamp is a mesh), open (sun and sky), others (the
remaining scenes), million (patches), slope (10k to 1M patches), relight, warm (a scripted bake of
cornell_box), threads, micro.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent / "addon"), str(HERE)]
sys.dont_write_bytecode = True

import command_line  # noqa: E402
import lamp_rooms  # noqa: E402
import raybundle  # noqa: E402
from area_lamps import area_lamps  # noqa: E402
from benchmark import bake_cycles, bake_raybundle  # noqa: E402
from cycles_reference import bakeable_objects, sample_emissive_meshes  # noqa: E402
from mesh_densities import make_plain  # noqa: E402
from small_objects import mean_product, squared_vertex_error  # noqa: E402
from surface_reference import Light  # noqa: E402

SCENES = HERE.parent / "scenes"
ROOMS = ("cornell_box", "big_room", "office", "two_rooms")
OPEN = ("open_court", "instances")
OTHERS = ("facing_squares", "furnace", "house_on_plain", "laid_table", "sphere_interior",
          "thin_wall")
LAMPS = ("bulb", "tube", "ring", "box", "wavy_panel")
# Area lights in place of the faces of these lamps would intersect the faces. Here the references
# use rays that meet the emission by chance. They are noisy and need this many times the samples.
WAVY = ("room:wavy_panel",)
WAVY_SAMPLES = 8
ERRORS = (0.02, 0.01)
# Targets of Raybundle. They hold for the noise of single parts of objects. The noise of the whole
# scene, which is compared, is 2 to 10 times smaller.
TARGETS = (0.25, 0.16, 0.1, 0.06, 0.04, 0.03, 0.0225, 0.015, 0.01, 0.0075, 0.005)
# Numbers of samples of Cycles. The difference of their times gives the time per sample, and the
# rest is the time without samples.
CYCLES_SAMPLES = (4, 64)
# Cells along an edge of each of the six sides of a room. Triangulated, its mesh has a million
# triangles.
MILLION_CELLS = 289


class Row:
    """A row of the table. reached: a number, or None with a note that gives the reason."""

    def __init__(self, what: str, wanted: str, reached: float | None, unit: str, note: str = ""
                 ) -> None:
        self.what, self.wanted, self.reached, self.unit = what, wanted, reached, unit
        self.note = note

    def __str__(self) -> str:
        found = "-" if self.reached is None else f"{self.reached:.3g} {self.unit}".strip()
        return f"| {self.what} | {self.wanted} | {found} | {self.note} |"


def open_scene(name: str):
    if name.startswith("room:"):
        lamp_rooms.build(name.partition(":")[2])
    else:
        bpy.ops.wm.open_mainfile(filepath=str(SCENES / f"{name}.blend"))
    settings = bpy.context.scene.raybundle
    settings.output = 'LIGHTING'
    return settings


def median_bake(objects, runs: int) -> tuple[float, dict]:
    """Returns the median time of bakes from nothing, s, and the report of the last one."""
    bakes = [bake_raybundle(objects) for _ in range(runs)]
    return float(np.median([seconds for seconds, _, _ in bakes])), bakes[-1][2]


# --------------------------------------------------------------------------------------------------
# Against Cycles at equal error
# --------------------------------------------------------------------------------------------------


def equal_error(name: str, wanted: str, options: argparse.Namespace) -> Iterator[Row]:
    settings = open_scene(name)
    # If objects share a mesh, Cycles leaves the light of the last object in all of them.
    make_plain()
    settings.reconstruction = 'POINT'
    # Area lights in place of a lamp's faces do not show the light that these faces give each other.
    objects = [item for item in bakeable_objects(bpy.context)
               if not (name.startswith("room:") and item.name.startswith("lamp"))]
    with nullcontext() if name in WAVY else area_lamps():
        sample_emissive_meshes(name not in WAVY)
        samples = options.samples * (WAVY_SAMPLES if name in WAVY else 1)
        references = [bake_cycles(objects, samples, seed)[1] for seed in (0, 1)]
    sample_emissive_meshes(True)
    own: dict[float, list[tuple[float, float]]] = {target: [] for target in TARGETS}
    cycles: dict[int, list[tuple[float, Light]]] = {count: [] for count in CYCLES_SAMPLES}
    for settings.seed in range(options.runs):
        for target, found in own.items():
            settings.target_error = target
            seconds, light, _ = bake_raybundle(objects)
            found.append((seconds, squared_vertex_error(objects, light, references)))
        for count, bakes in cycles.items():
            bakes.append(bake_cycles(objects, count, 2 + settings.seed))
    curve = [np.median(found, axis=0) for found in own.values()]
    few, many = CYCLES_SAMPLES
    seconds_of_few, seconds_of_many = (
        float(np.median([seconds for seconds, _ in bakes])) for bakes in cycles.values())
    per_sample = max(seconds_of_many - seconds_of_few, 0.0) / (many - few)
    square_of_cycles = float(np.median([
        squared_noise(objects, first, second, references)
        for (_, first), (_, second) in zip(cycles[many], cycles[many][1:])]))
    for error in ERRORS:
        times = times_of(error, curve)
        what = f"`{name}`, {100 * error:g} %: Cycles' time over Raybundle's"
        if not times:
            least = min(square ** 0.5 for _, square in curve)
            yield Row(what, wanted, None, "", f"least error {100 * least:.2f} %")
            continue
        samples = max(many * square_of_cycles / error ** 2, 1.0)
        needed = seconds_of_few + (samples - few) * per_sample
        yield Row(what, wanted, needed / min(times), "times",
                  f"{min(times):.3f} s; Cycles {needed:.2f} s")


def times_of(error: float, curve: list[np.ndarray]) -> list[float]:
    """Returns times in which the error is met, s.

    curve: time and squared error for each target, in descending order of the targets.
    """
    times = [seconds for seconds, square in curve if square ** 0.5 <= error]
    for (coarse, more), (fine, less) in zip(curve, curve[1:]):
        if more ** 0.5 > error >= less ** 0.5 and less > 0.0:
            part = np.log(more / error ** 2) / np.log(more / less)
            times.append(coarse + part * (fine - coarse))
    return times


def squared_noise(objects: list[bpy.types.Object], first: Light, second: Light,
                  references: list[Light]) -> float:
    """Returns the relative squared noise of each of two bakes that differ in their seed."""
    off = {name: values - second[name] for name, values in first.items()}
    return mean_product(objects, [off, off], references) / 2


# --------------------------------------------------------------------------------------------------
# Many patches
# --------------------------------------------------------------------------------------------------


def build_room(cells: int) -> None:
    """Builds a closed room of 6 x `cells` x `cells` quads as one mesh, with a lamp."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    t = np.linspace(-1.0, 1.0, cells + 1)
    u, v = (axis.ravel() for axis in np.meshgrid(t, t))
    # With the fronts inside: right-handed in the order of the corners below.
    sides = [(u, v, -np.ones_like(u)), (v, u, np.ones_like(u)), (-np.ones_like(u), u, v),
             (np.ones_like(u), v, u), (v, -np.ones_like(u), u), (u, np.ones_like(u), v)]
    points = np.concatenate([np.stack(side, axis=1) for side in sides])
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    quads = np.stack([corner, corner + 1, corner + cells + 2, corner + cells + 1], axis=1)
    faces = np.concatenate([quads + k * (cells + 1) ** 2 for k in range(6)])
    mesh = bpy.data.meshes.new("room")
    mesh.vertices.add(len(points))
    mesh.vertices.foreach_set('co', points.ravel())
    mesh.loops.add(faces.size)
    mesh.loops.foreach_set('vertex_index', faces.ravel())
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set('loop_start', 4 * np.arange(len(faces)))
    mesh.polygons.foreach_set('loop_total', np.full(len(faces), 4))
    mesh.update(calc_edges=True)
    mesh.materials.append(bpy.data.materials.new("grey"))
    lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", 'AREA'))
    lamp.data.size, lamp.data.energy, lamp.location = 0.5, 50.0, (0.2, 0.1, 0.9)
    for item in (bpy.data.objects.new("room", mesh), lamp):
        bpy.context.scene.collection.objects.link(item)
    settings = bpy.context.scene.raybundle
    settings.output, settings.max_patches = 'LIGHTING', 2_000_000
    settings.patch_size = 2.0 / cells


def many_patches(cells: int, runs: int) -> tuple[float, dict]:
    build_room(cells)
    return median_bake([bpy.data.objects["room"]], runs)


def million(_options: argparse.Namespace) -> Iterator[Row]:
    build_room(MILLION_CELLS)
    bpy.ops.object.select_all(action='SELECT')
    room = bpy.data.objects["room"]
    bpy.context.view_layer.objects.active = room
    room.modifiers.new("triangles", 'TRIANGULATE')
    bpy.ops.object.modifier_apply(modifier="triangles")
    # Resets the peak of the memory, so that it is that of this bake and not that of other rows.
    Path("/proc/self/clear_refs").write_text("5")
    seconds, report = median_bake([room], 1)
    note = (f"{report['patches']} patches, {report['bundles']} bundles, noise "
            f"{100 * report['error']['noise']:.2f} %; export {report['seconds']['export']:.2f} s")
    yield Row("a million patches from a million triangles, 2 %", "60 s", seconds, "s", note)
    yield Row("its memory", "4 GB", report["peak_memory_bytes"] / 1e9, "GB", "peak of the process")
    yield Row("its export", "2 s", report["seconds"]["export"], "s")


def slope(options: argparse.Namespace) -> Iterator[Row]:
    counts, times = [], []
    for cells in (41, 129, 408):
        seconds, report = many_patches(cells, 1 if cells > 200 else options.runs)
        counts.append(report["patches"])
        times.append(seconds)
    power = np.polyfit(np.log(counts), np.log(times), 1)[0]
    yield Row("cost from 10k to 1M patches at fixed error, as a power", "1", float(power), "",
              ", ".join(f"{count}: {seconds:.2f} s" for count, seconds in zip(counts, times)))


# --------------------------------------------------------------------------------------------------
# Again
# --------------------------------------------------------------------------------------------------


def relight(options: argparse.Namespace) -> Iterator[Row]:
    settings = open_scene("cornell_box")
    # 20 000 patches.
    settings.patch_size = 0.039
    bake_raybundle(bakeable_objects(bpy.context))
    lamp = next(slot.material for item in bpy.data.objects if item.name.startswith("lamp")
                for slot in item.material_slots)
    node = next(node for node in lamp.node_tree.nodes if node.type == 'EMISSION')
    times = []
    for k in range(options.runs):
        node.inputs["Color"].default_value = (1.0, 0.5 + 0.1 * k, 0.2, 1.0)
        bpy.context.view_layer.update()
        started = time.perf_counter()
        bpy.ops.raybundle.bake()
        times.append(time.perf_counter() - started)
    report = json.loads(settings.report)
    yield Row("relight after a lamp's colour changed, 20k patches", "0.03 s",
              float(np.median(times)), "s", f"{report['patches']} patches; " + ", ".join(
                  f"{stage} {seconds:.3f}" for stage, seconds in report["seconds"].items()))


def warm(options: argparse.Namespace) -> Iterator[Row]:
    open_scene("cornell_box")
    seconds, report = median_bake(bakeable_objects(bpy.context), options.runs + 2)
    yield Row("warm scripted bake of cornell_box to 2 %", "0.3 s", seconds, "s",
              f"{report['bundles']} bundles, noise {100 * report['error']['noise']:.2f} %")


def threads(options: argparse.Namespace) -> Iterator[Row]:
    settings = open_scene("cornell_box")
    settings.target_error, settings.min_bundles = 0.005, 2048
    objects = bakeable_objects(bpy.context)
    times: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(options.runs):
        for settings.threads, found in times.items():
            found.append(bake_raybundle(objects)[2]["seconds"]["bundles"])
    yield Row("bundles: one core's time over two cores'", "1.9",
              float(np.median(times[1]) / np.median(times[2])), "times")


def micro(options: argparse.Namespace) -> Iterator[Row]:
    if options.micro is None:
        return
    rows = {row["name"]: row for row in json.loads(options.micro.read_text())["benchmarks"]}
    thesis, project = rows["Project10k"], rows["Project"]
    yield Row("bundle of 100 x 100 lines, 20k patches, a core", "0.1 ms",
              thesis["real_time"] * 1e-3, "ms", f"{thesis['patches']:.0f} patches")
    yield Row("fragments per second and core", "200 million", project["fragments"] * 1e-6,
              "million")
    exchanges = 2 * project["exchanges"]
    yield Row("exchanges both ways per second over Embree's closest hits", "30",
              exchanges / rows["ClosestHits"]["items_per_second"], "times",
              f"{exchanges * 1e-6:.1f} and "
              f"{rows['ClosestHits']['items_per_second'] * 1e-6:.1f} million")
    yield Row("bytes per pair of sides that exchange", "8", rows["Solve"]["bytes per pair"], "")


def equal(options: argparse.Namespace) -> Iterator[Row]:
    for name in ROOMS:
        yield from equal_error(name, "100", options)


def lamps_of_mesh(options: argparse.Namespace) -> Iterator[Row]:
    for name in LAMPS:
        yield from equal_error(f"room:{name}", "60", options)


def sun_and_sky(options: argparse.Namespace) -> Iterator[Row]:
    for name in OPEN:
        yield from equal_error(name, "10", options)


def others(options: argparse.Namespace) -> Iterator[Row]:
    for name in OTHERS:
        yield from equal_error(name, "1", options)


PARTS: dict[str, Callable[[argparse.Namespace], Iterator[Row]]] = {
    "micro": micro, "warm": warm, "relight": relight, "threads": threads, "equal": equal,
    "lamps": lamps_of_mesh, "open": sun_and_sky, "others": others, "slope": slope,
    "million": million}


def main(arguments: Sequence[str]) -> None:
    parser = command_line.parser(__file__, __doc__)
    parser.add_argument("--only", nargs="+", default=list(PARTS), choices=list(PARTS))
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--samples", type=int, default=1024)
    parser.add_argument("--micro", type=Path, help="results of native/bench/micro, as JSON")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args(arguments)
    raybundle.register()
    print(f"{os.cpu_count()} cores, Blender {bpy.app.version_string}")
    print("| what | to reach | reached | |\n|---|---|---|---|")
    rows = []
    for part in options.only:
        for row in PARTS[part](options):
            print(row, flush=True)
            rows.append(vars(row))
    if options.out:
        options.out.write_text(json.dumps(
            {"cores": os.cpu_count(), "blender": bpy.app.version_string, "rows": rows}, indent=1))


if __name__ == "__main__":
    main(command_line.arguments())
