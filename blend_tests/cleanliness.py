# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the noise of each object at the default settings, where it is seen.

    blender -b --factory-startup -P blend_tests/cleanliness.py -- \\
        [SCENE ...] [--target 0.02 ...] [--seeds 1] [--converged 0.0015] [--work build/cleanliness]
        [--stated]

Bakes LIGHTING, and compares it at the corners of each object with a converged bake (with the target
--converged and another seed; it is kept in the folder --work until it is deleted). Differences are
relative to the light at the corner. Light below 5 % of the scene's mean counts as 5 %. The table
shows the 95th percentile of all objects together, that of the worst object, and the number of
objects above 3 and 4 %. With --stated nothing is compared. The table then shows, for each target,
the time of a bake, and the noise and the first warning about noise in its report. SCENE is the name
of a scene in scenes/, a file, or room:NAME (lamp_rooms.py). By default all scenes in scenes/ are
baked.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).parent
ROOT = HERE.parent
sys.path[:0] = [str(ROOT / "addon"), str(HERE)]
sys.dont_write_bytecode = True

import command_line  # noqa: E402
import lamp_rooms  # noqa: E402
import raybundle  # noqa: E402
from object_light import SCENES, open_file  # noqa: E402
from surface_error import corner_areas, read_colors  # noqa: E402

DARK = 0.05  # share of the scene's mean light; darker light counts as this share
CLEAN, MOST = 0.03, 0.04
SEED_OF_CONVERGED = 1000


@dataclass
class Baked:
    """The result of a bake."""

    light: dict[str, np.ndarray]  # (corners, 3) per object
    areas: dict[str, np.ndarray]  # (corners,) m^2
    bundles: int
    seconds: float
    noise: float
    noisiest: tuple[float, str]  # stated noise and name of the object with the most noise
    said: str  # first warning about noise


def bake(scene: str, target: float, seed: int, settings: dict[str, str]) -> Baked:
    open_file(scene, lamp_rooms.FINE)
    started = time.perf_counter()
    report = raybundle.bake(bpy.context, **{'output': 'LIGHTING', 'domain': 'CORNER',
                                            'target_error': target, 'seed': seed, **settings})
    seconds = time.perf_counter() - started
    items = [bpy.data.objects[entry.name] for entry in report.objects
             if entry.status.startswith('baked')]
    return Baked({item.name: read_colors(item).astype(float) for item in items},
                 {item.name: corner_areas(item) for item in items}, report.bundles, seconds,
                 report.error['noise'],
                 max((entry.error['noise'], entry.name) for entry in report.objects if entry.error),
                 next((text for text in report.warnings if "nois" in text), ""))


def converged(scene: str, target: float, settings: dict[str, str], work: Path
              ) -> dict[str, np.ndarray]:
    said = "".join(f"_{value}" for value in settings.values())
    kept = work / f"{Path(scene).stem.replace(':', '_')}_{target}{said}.npz"
    if not kept.is_file():
        baked = bake(scene, target, SEED_OF_CONVERGED, settings)
        print(f"    converged: {baked.bundles} bundles, {baked.seconds:.1f} s, "
              f"noise {100 * baked.noise:.2f} %", flush=True)
        work.mkdir(parents=True, exist_ok=True)
        np.savez(kept, **baked.light)
    with np.load(kept) as arrays:
        return {name: arrays[name] for name in arrays.files}


def differences(baked: Baked, reference: dict[str, np.ndarray]) -> dict[str, float]:
    """Returns the 95th percentile of each object's differences; '' is the key of that of all."""
    total = sum(areas.sum() for areas in baked.areas.values())
    mean = sum(baked.areas[name] @ reference[name].mean(axis=1) for name in reference) / total
    off = {name: np.abs(baked.light[name] - truth).max(axis=1)
           / np.maximum(truth.max(axis=1), DARK * mean) for name, truth in reference.items()}
    found = {name: float(np.percentile(values, 95)) for name, values in off.items()}
    found[''] = float(np.percentile(np.concatenate(list(off.values())), 95))
    return found


def state_targets(scenes: list[str], targets: list[float], settings: dict[str, str]) -> None:
    print("| scene | target | seconds | bundles | noise | noisiest object | said |"
          "\n|---|---|---|---|---|---|---|")
    for scene in scenes:
        for target in targets:
            baked = bake(scene, target, 1, settings)
            noise, name = baked.noisiest
            print(f"| `{scene}` | {100 * target:g} % | {baked.seconds:.2f} | {baked.bundles} "
                  f"| {100 * baked.noise:.2f} % | {100 * noise:.2f} % {name} | {baked.said} |",
                  flush=True)


def main() -> None:
    parser = command_line.parser(__file__, __doc__)
    parser.add_argument("scenes", nargs="*")
    parser.add_argument("--target", type=float, nargs="+", default=[0.02])
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--converged", type=float, default=0.0015)
    parser.add_argument("--set", nargs="*", default=[],
                        help="NAME=VALUE of both bakes, as output=DIRECT")
    parser.add_argument("--stated", action="store_true")
    parser.add_argument("--work", type=Path, default=ROOT / "build" / "cleanliness")
    options = parser.parse_args(command_line.arguments())
    settings = dict(text.split("=", 1) for text in options.set)
    scenes = options.scenes or sorted(path.stem for path in SCENES.glob("*.blend"))
    if not hasattr(bpy.types.Scene, "raybundle"):
        raybundle.register()
    if options.stated:
        state_targets(scenes, options.target, settings)
        return
    print("| scene | target | seconds | bundles | noise stated | all | worst | above 3 % | above 4 % |"
          "\n|---|---|---|---|---|---|---|---|---|")
    for scene in scenes:
        reference = converged(scene, options.converged, settings, options.work)
        for target in options.target:
            for seed in range(1, options.seeds + 1):
                baked = bake(scene, target, seed, settings)
                found = differences(baked, reference)
                everything = found.pop('')
                worst = max(found, key=found.get)
                above = [sum(value > limit for value in found.values()) for limit in (CLEAN, MOST)]
                print(f"| `{scene}` | {target} | {baked.seconds:.2f} | {baked.bundles} "
                      f"| {100 * baked.noise:.2f} % | {100 * everything:.1f} % "
                      f"| {100 * found[worst]:.1f} % {worst} | {above[0]} of {len(found)} "
                      f"| {above[1]} |", flush=True)


if __name__ == "__main__":
    main()
