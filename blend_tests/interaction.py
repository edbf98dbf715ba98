# SPDX-License-Identifier: GPL-3.0-or-later
r"""Prints the table of docs/performance.md about bakes in the background: how long Blender waits.

    blender -b --factory-startup -P blend_tests/interaction.py -- [--runs 5] [--file FILE.blend ...] [--largest]

Without --file measures office, big_room and a room of 298,000 faces. The columns of the first table
are, in ms, the largest of --runs runs: how long Blender's window stands still for the export of the
scene, for one showing of interim light, and for the writing of the result; the time from the call
to the first light in the attributes; and from a stop to its end, in each stage. The second table
has the drafts per second of live mode while a lamp, a mesh lamp or its power changes. Drawing is
not part of it.
"""

from __future__ import annotations

import itertools
import random
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import bpy

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent / "addon"), str(HERE)]
sys.dont_write_bytecode = True

import command_line  # noqa: E402
import raybundle  # noqa: E402
from raybundle import bake_run, live_light, native  # noqa: E402

SCENES = HERE.parent / "scenes"
COLUMNS = ("export", "first light", "showing", "writing", *(f"stop: {s}" for s in native.STAGES))
LIVE_COLUMNS = ("power of a lamp", "place of a lamp", "emission", "place of a mesh")
LIVE_SECONDS = 3.0  # of changes, per column of the second table
# Seconds between two looks at a run, as in the add-on's operator.
LOOK_SECONDS = 0.01
# A stop comes at a random time of this length after a stage has begun, s.
LATEST_STOP = 0.3


def make_big_room() -> None:
    """Makes a room of 10 m with 57 smooth spheres: 298,000 triangles and three lamps."""
    bpy.ops.wm.read_homefile(use_empty=True)
    place = random.Random(1)
    bpy.ops.mesh.primitive_cube_add(size=10.0, location=(0.0, 0.0, 5.0))
    bpy.ops.object.mode_set(mode='EDIT')
    bpy.ops.mesh.subdivide(number_cuts=31)
    bpy.ops.mesh.flip_normals()
    bpy.ops.object.mode_set(mode='OBJECT')
    for _ in range(57):
        bpy.ops.mesh.primitive_ico_sphere_add(
            subdivisions=5, radius=0.3,
            location=(place.uniform(-4, 4), place.uniform(-4, 4), place.uniform(0.4, 8)))
        bpy.ops.object.shade_smooth()
    for x in (-3.0, 0.0, 3.0):
        bpy.ops.object.light_add(type='POINT', location=(x, 0.0, 9.0))
        bpy.context.object.data.energy = 500.0


def seconds_of(work) -> float:
    started = time.perf_counter()
    work()
    return time.perf_counter() - started


def first_light() -> Iterator[tuple[str, float]]:
    """Starts a bake, waits for its first light, and stops it. Yields columns and seconds."""
    started = time.perf_counter()
    run = bake_run.BakeRun(bpy.context)
    yield "export", time.perf_counter() - started
    while run.advance() and not run.shows_light:
        time.sleep(LOOK_SECONDS)
    yield "first light", time.perf_counter() - started
    if run.state.is_running:
        yield "showing", seconds_of(lambda: run._interim.show(run._run))
    run.stop("measured")
    run.leave()


def stop_in(stage: str, delay: float) -> Iterator[tuple[str, float]]:
    """Starts a bake, and stops it in a stage, `delay` seconds after the stage has begun or in the
    last look before it ends. Yields columns and seconds."""
    run = bake_run.BakeRun(bpy.context)
    stages = native.STAGES
    while run.advance() and stages.index(run.state.stage) < stages.index(stage):
        time.sleep(0.001)
    deadline = time.perf_counter() + delay
    while run.advance() and run.state.stage == stage and time.perf_counter() < deadline:
        time.sleep(0.001)
    if run.state.is_running:
        yield f"stop: {stage}", seconds_of(lambda: run.stop("measured"))
    run.leave()


def whole_bake() -> Iterator[tuple[str, float]]:
    yield "writing", raybundle.bake(bpy.context).seconds['write_back']


def measure(runs: int) -> dict[str, float]:
    """Returns the largest number of seconds by column."""
    largest: dict[str, float] = {}
    delays = random.Random(2)
    tries = [first_light for _ in range(runs)]
    tries += [lambda stage=stage: stop_in(stage, delays.uniform(0.0, LATEST_STOP))
              for stage in native.STAGES for _ in range(runs)]
    for attempt in [*tries, whole_bake]:
        for column, seconds in attempt():
            largest[column] = max(seconds, largest.get(column, 0.0))
        # Each run begins anew, as the first one does.
        bpy.ops.raybundle.clear()
    return largest


def live_rates() -> list[float]:
    """Returns the drafts per second by column of the second table, with a lamp added to the scene.
    The first draft after a pause, which gathers all lamps, does not count."""
    scene = bpy.context.scene
    bpy.ops.object.light_add(type='POINT', location=(0.3, 0.2, 1.0))
    lamp = bpy.context.object
    lamp.data.energy = 50.0
    emission = [node.inputs['Strength'] for material in bpy.data.materials if material.node_tree
                for node in material.node_tree.nodes if node.type == 'EMISSION']
    mesh = next(item for item in scene.objects if item.type == 'MESH')

    # Up and down in turn, so that no column changes what the next ones measure.
    factors = itertools.cycle((1.01, 1.0 / 1.01))

    def brighten() -> None:
        factor = next(factors)
        for socket in emission:
            socket.default_value *= factor

    def change_power() -> None:
        lamp.data.energy *= next(factors)

    def move(item: bpy.types.Object) -> None:
        item.location.x += 0.001

    scene.raybundle.live = True
    rates = []
    for change in (change_power, lambda: move(lamp), brighten, lambda: move(mesh)):
        first = None
        while first is None or time.perf_counter() < first + LIVE_SECONDS:
            change()
            bpy.context.view_layer.update()
            time.sleep(live_light.live.step(bpy.context))
            if first is None and live_light.live.drafts:
                first, live_light.live.drafts = time.perf_counter(), 0
        rates.append(live_light.live.drafts / (time.perf_counter() - first))
        while live_light.live.step(bpy.context) < live_light.IDLE_SECONDS:
            time.sleep(LOOK_SECONDS)
        live_light.live.drafts = 0
    return rates


def main() -> None:
    parser = command_line.parser(__file__, __doc__)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--file", type=Path, nargs="+", default=[])
    parser.add_argument("--largest", action="store_true", help="measure only the largest room")
    options = parser.parse_args(command_line.arguments())
    raybundle.register()
    rows = []
    paths = options.file or [SCENES / "office.blend", SCENES / "big_room.blend", None]
    for path in paths[-1:] if options.largest else paths:
        if path is None:
            make_big_room()
        else:
            bpy.ops.wm.open_mainfile(filepath=str(path))
        largest = measure(options.runs)
        name = path.stem if path is not None else "298,000 faces"
        # In the largest room a draft takes many seconds.
        rates = live_rates() if path is not None else []
        rows.append((name, [f"{1000.0 * largest[column]:.0f}" if column in largest else "-"
                            for column in COLUMNS], [f"{rate:.1f}" for rate in rates]))
    for number, columns in ((1, COLUMNS), (2, LIVE_COLUMNS)):
        print(f"| scene | {' | '.join(columns)} |\n|---|{'---|' * len(columns)}")
        for row in filter(lambda row: row[number], rows):
            print(f"| {row[0]} | {' | '.join(row[number])} |", flush=True)


if __name__ == "__main__":
    main()
