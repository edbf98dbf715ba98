# SPDX-License-Identifier: GPL-3.0-or-later
r"""Compares run time and error of Raybundle's bake and Cycles' vertex bake, run in turns.

    blender -b --factory-startup -P blend_tests/benchmark.py -- \
        [--scenes cornell_box big_room] [--runs 5] [--set name=value ...] [--threads 0] \
        [--surface SAMPLES] [--out FILE.json]

Each run bakes once with Raybundle (output LIGHTING, without data of the previous run) and with
Cycles at 64, 256 and 1024 samples (Diffuse, direct and indirect, all objects at once, all bounces,
no denoising). Times are the times that a user waits, as medians over the runs. There are two
errors. Each is the relative RMSE over RGB of all objects, weighted by area:

vertex   against scenes/NAME.cycles.npz (see the README there), at the vertices off contact edges.
         Cycles computes point samples, as the reference does, and has only noise. Raybundle's
         values are those whose interpolation is nearest to the light on the faces. On coarse faces
         they differ from point samples. With --set reconstruction=POINT they are point samples
         too.
surface  the visible error: the values, interpolated over the faces, against Cycles at points inside
         the faces. --surface gives the number of samples of this reference. The reference is made
         first, which takes time.

The time that Cycles needs for an equal error is interpolated in the logarithms of time and error.
It is extrapolated with error ~ time^-1/2 as long as the error of Cycles is noise. If more samples
no longer reduce its error (the surface error at contacts and edges of shadows), there is no such
time. --out appends one line of JSON for each scene.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent / "addon"), str(HERE)]
sys.dont_write_bytecode = True

import command_line  # noqa: E402
import raybundle  # noqa: E402
from cycles_reference import (bakeable_objects, corner_values, load,  # noqa: E402
                              prepare_scene, target_attribute)
from raybundle import bake_cache  # noqa: E402
from raybundle.properties import assign  # noqa: E402
from surface_error import (SurfaceError, corner_areas, is_defined, off_contact_edges,  # noqa: E402
                           read_colors)
from surface_reference import Light, SurfaceReference, joined_error  # noqa: E402

SCENES = HERE.parent / "scenes"
CYCLES_SAMPLES = (64, 256, 1024)
ERRORS_OF_INTEREST = (0.05, 0.02, 0.01)
# Four times the samples halve noise. An error of which more than this share remains is not noise.
STILL_NOISE = 0.7
RAYBUNDLE = "Raybundle"


@dataclass
class Contestant:
    """A method that is compared: its times, s, and its errors, one for each run."""

    name: str
    seconds: list[float] = field(default_factory=list)
    vertex: list[SurfaceError] = field(default_factory=list)
    surface: list[SurfaceError] = field(default_factory=list)

    def median_seconds(self) -> float:
        return float(np.median(self.seconds))

    def median_error(self, kind: str) -> float:
        return float(np.median([error.rmse for error in getattr(self, kind)]))

    def json(self) -> dict:
        return {"name": self.name, "seconds": self.seconds,
                "vertex": [asdict(error) for error in self.vertex],
                "surface": [asdict(error) for error in self.surface]}


# --------------------------------------------------------------------------------------------------
# Bakes
# --------------------------------------------------------------------------------------------------


def bake_raybundle(objects: Sequence[bpy.types.Object]) -> tuple[float, Light, dict]:
    bake_cache.discard_all()
    started = time.perf_counter()
    if bpy.ops.raybundle.bake() != {'FINISHED'}:
        sys.exit("the bake was cancelled")
    seconds = time.perf_counter() - started
    scene = bpy.context.scene
    return (seconds, {item.name: read_colors(item, scene.raybundle.attribute) for item in objects},
            json.loads(scene.raybundle.report))


def bake_cycles(objects: Sequence[bpy.types.Object], samples: int, seed: int
                ) -> tuple[float, Light]:
    scene = bpy.context.scene
    engine = scene.render.engine
    prepare_scene(scene, samples, seed)
    for item in bpy.context.view_layer.objects:
        item.select_set(False)
    for item in objects:
        target_attribute(item.data)
        item.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]
    started = time.perf_counter()
    bpy.ops.object.bake(type='DIFFUSE', pass_filter={'DIRECT', 'INDIRECT'},
                        target='VERTEX_COLORS', use_selected_to_active=False, use_clear=True)
    seconds = time.perf_counter() - started
    scene.render.engine = engine
    return seconds, {item.name: corner_values(item.data) for item in objects}


# --------------------------------------------------------------------------------------------------
# References
# --------------------------------------------------------------------------------------------------


class VertexReference:
    """The light of Cycles at the corners, and the weights of the corners that are compared."""

    def __init__(self, name: str, objects: Sequence[bpy.types.Object]) -> None:
        self._values = load(SCENES / f"{name}.cycles.npz")
        off_contacts = off_contact_edges(objects)
        self._weights = {
            item.name: corner_areas(item) * off_contacts[item.name]
            * is_defined(item, self._values[item.name])
            for item in objects}

    def error(self, light: Light) -> SurfaceError:
        return joined_error(light, self._values, self._weights)


# --------------------------------------------------------------------------------------------------
# A scene
# --------------------------------------------------------------------------------------------------


def run_scene(name: str, options: argparse.Namespace) -> dict:
    bpy.ops.wm.open_mainfile(filepath=str(SCENES / f"{name}.blend"))
    settings = bpy.context.scene.raybundle
    settings.output, settings.threads = 'LIGHTING', options.threads
    for assignment in options.set:
        key, _, value = assignment.partition("=")
        assign(settings, key, value)
    bpy.context.scene.render.threads_mode = 'FIXED' if options.threads else 'AUTO'
    if options.threads:
        bpy.context.scene.render.threads = options.threads
    objects = bakeable_objects(bpy.context)
    references = {"vertex": VertexReference(name, objects)}
    if options.surface:
        references["surface"] = SurfaceReference(objects, options.surface)

    contestants = {key: Contestant(f"Cycles {key}" if key != RAYBUNDLE else key)
                   for key in (RAYBUNDLE, *CYCLES_SAMPLES)}
    reports = []
    for run in range(options.runs):
        for key, contestant in contestants.items():
            if key == RAYBUNDLE:
                settings.seed = run
                seconds, light, report = bake_raybundle(objects)
                reports.append(report)
            else:
                # The reference was made with seed 0.
                seconds, light = bake_cycles(objects, key, 1 + run)
            contestant.seconds.append(seconds)
            for kind, reference in references.items():
                getattr(contestant, kind).append(reference.error(light))

    stages = {stage: float(np.median([report["seconds"][stage] for report in reports]))
              for stage in reports[0]["seconds"]}
    result = {"scene": name, "runs": options.runs, "cores": os.cpu_count(),
              "threads": options.threads, "blender": bpy.app.version_string,
              "settings": options.set, "surface_samples": options.surface,
              "stages": stages, "bundles": [report["bundles"] for report in reports],
              "patches": reports[0]["patches"],
              "contestants": [entry.json() for entry in contestants.values()],
              "ratios": {kind: time_ratios(contestants, kind) for kind in references}}
    print_scene(result, contestants, list(references))
    return result


def time_ratios(contestants: dict, kind: str) -> dict[str, dict]:
    """Returns Cycles' time divided by Raybundle's, at Raybundle's error and at fixed errors.

    If there is no ratio, the note of the entry says why.
    """
    own = contestants[RAYBUNDLE]
    own_error = own.median_error(kind)
    cycles = [contestants[samples] for samples in CYCLES_SAMPLES]
    ratios = {}
    for name, error in (("own", own_error), *((f"{wanted:g}", wanted)
                                              for wanted in ERRORS_OF_INTEREST)):
        entry: dict = {"error": error, "ratio": None, "note": ""}
        seconds = _time_at(cycles, kind, error)
        if error < own_error:
            entry["note"] = "Raybundle's error is larger"
        elif seconds is None:
            entry["note"] = "Cycles does not reach it"
        else:
            entry["ratio"] = seconds / own.median_seconds()
        ratios[name] = entry
    return ratios


def _time_at(cycles: Sequence[Contestant], kind: str, error: float) -> float | None:
    """Returns the time in which Cycles has this error, s; None if more samples do not reach it."""
    errors = np.array([entry.median_error(kind) for entry in cycles])
    seconds = np.array([entry.median_seconds() for entry in cycles])
    if error > errors[0]:
        return float(seconds[0] * (errors[0] / error) ** 2)
    if error < errors[-1]:
        if errors[-1] > STILL_NOISE * errors[-2]:
            return None
        return float(seconds[-1] * (errors[-1] / error) ** 2)
    # np.interp requires ascending abscissae.
    return float(np.exp(np.interp(-np.log(error), -np.log(errors), np.log(seconds))))


def print_scene(result: dict, contestants: dict, kinds: Sequence[str]) -> None:
    threads = result["threads"] or result["cores"]
    print(f"\n{result['scene']}: {result['runs']} runs, medians; {threads} threads of "
          f"{result['cores']} cores; {result['patches']} patches, "
          f"{int(np.median(result['bundles']))} bundles; Blender {result['blender']}")
    print("  Raybundle's seconds: " + ", ".join(
        f"{stage} {seconds:.3f}" for stage, seconds in result["stages"].items()))
    print(f"  {'':<12} {'seconds':>8} {'fastest':>8} {'slowest':>8}" + "".join(
        f"   {kind + ' rmse':>13} {'bias':>7} {'p99':>7} {'max':>7}" for kind in kinds))
    for entry in contestants.values():
        line = (f"  {entry.name:<12} {entry.median_seconds():8.3f} {min(entry.seconds):8.3f} "
                f"{max(entry.seconds):8.3f}")
        for kind in kinds:
            errors = getattr(entry, kind)
            line += f"   {100 * entry.median_error(kind):11.2f} %" + "".join(
                f" {100 * float(np.median([getattr(error, name) for error in errors])):{form}} %"
                for name, form in (("bias", "+5.2f"), ("percentile_99", "5.1f"),
                                   ("maximum", "5.0f")))
        print(line)
    for kind in kinds:
        parts = []
        for name, entry in result["ratios"][kind].items():
            label = f"{100 * entry['error']:.3g} %" + (" (its own)" if name == "own" else "")
            parts.append(f"{label}: " + (entry["note"] or f"{entry['ratio']:.1f}"))
        print(f"  Cycles' time over Raybundle's for equal {kind} error: {'; '.join(parts)}")
    sys.stdout.flush()


def main(arguments: Sequence[str]) -> None:
    parser = command_line.parser(__file__, __doc__)
    parser.add_argument("--scenes", nargs="+", default=["cornell_box", "big_room"])
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--threads", type=int, default=0, help="of both; 0: all cores")
    parser.add_argument("--set", nargs="+", action="extend", default=[], metavar="name=value",
                        help="settings of scene.raybundle")
    parser.add_argument("--surface", type=int, default=0, metavar="SAMPLES",
                        help="also the surface error, against so many samples (0: not)")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args(arguments)
    raybundle.register()
    for name in options.scenes:
        result = run_scene(name, options)
        if options.out:
            with options.out.open("a") as file:
                file.write(json.dumps(result) + "\n")


if __name__ == "__main__":
    main(command_line.arguments())
