# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs `calibrate` on all scenes, draws true over stated errors and prints how many are covered.

The script `calibration` builds what is needed and calls this one.

    /usr/bin/python3 native/bench/run_calibration.py [OUT_FOLDER] [--draw]

--draw: only draws the results that are in OUT_FOLDER.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path

import matplotlib
import numpy as np

sys.dont_write_bytecode = True
matplotlib.use("svg")

from figure_table import SCENES  # noqa: E402
from matplotlib import pyplot  # noqa: E402
from plot import COLORS, MARKERS, STYLE, plain_ticks  # noqa: E402
from run_figures import ROOT, export  # noqa: E402

CALIBRATE = ROOT / "build/release/native/bench/calibrate"
# Rooms of blend_tests/lamp_rooms.py: objects under a luminous box, a sky in the window, and a
# screen.
ROOMS = ("room_box", "room_sky", "room_screen")
# A bake is covered if its true error is at most this many times the stated error.
COVERING = 1.25
# Smaller errors count as zero, as in a furnace. They are not drawn and count as covered.
NOTHING = 1e-5
# Number of bundles of each half of the reference, for scenes in which the noise of the default
# number is not small compared with the measured error, because few lines pass between the two
# squares.
REFERENCE_BUNDLES = {'facing_squares': 20000}
# Title of each diagram -> keys of the stated and the true error that it compares.
KINDS = {
    "noise of the light on patches": ('patches', 'noise'),
    "surface error, all parts": ('total', 'surface'),
}


def calibrate(names: list[str], seeds: int, folder: Path) -> None:
    results = folder / "calibration.jsonl"
    results.unlink(missing_ok=True)
    for name in names:
        scene = export(name, folder)
        command = [str(CALIBRATE), str(scene), "--seeds", str(seeds), "--out", str(results)]
        if name in REFERENCE_BUNDLES:
            command += ["--reference-bundles", str(REFERENCE_BUNDLES[name])]
        done = subprocess.run(command)
        if done.returncode != 0:
            sys.exit(f"calibration: {name} failed")
        print(f"{name}: done", flush=True)


def errors(rows: list[dict], kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Returns the stated and the true relative errors, (n,) each, of the bakes whose true error is
    known."""
    stated, true = KINDS[kind]
    rows = [row for row in rows if true in row['true']]
    return (np.array([row['stated'][stated] for row in rows]),
            np.array([row['true'][true] for row in rows]))


def is_covered(stated: np.ndarray, true: np.ndarray) -> np.ndarray:
    return true <= np.maximum(COVERING * stated, NOTHING)


def covered_objects(objects: list[dict]) -> str:
    """Returns the share of objects, over all bakes, whose stated noise covers the true noise."""
    stated, true = (np.array([entry[key] for entry in objects]) for key in ('stated', 'true'))
    covered = is_covered(stated, true)
    return f"{100 * covered.mean():.1f} % of {len(covered)}" if len(covered) else ""


def draw(rows: list[dict], path: Path) -> None:
    scenes = list(dict.fromkeys(row['scene'] for row in rows))
    with matplotlib.rc_context(STYLE):
        picture, axes = pyplot.subplots(
            1, 3, figsize=(9.0, 3.4), layout='constrained', width_ratios=[1.0, 1.0, 0.4])
        for axis, kind in zip(axes, KINDS):
            for k, scene in enumerate(scenes):
                stated, true = errors([row for row in rows if row['scene'] == scene], kind)
                shown = stated > NOTHING
                axis.plot(100 * stated[shown], 100 * true[shown], MARKERS[k % len(MARKERS)],
                          color=COLORS[k % len(COLORS)], label=scene, markersize=2.5,
                          markeredgewidth=0.5, fillstyle='none')
            axis.set_xscale('log')
            axis.set_yscale('log')
            low = min(axis.get_xlim()[0], axis.get_ylim()[0])
            high = max(axis.get_xlim()[1], axis.get_ylim()[1])
            ends = np.array([low, high])
            axis.plot(ends, ends, color='0.6', linewidth=0.8)
            axis.plot(ends, COVERING * ends, color='0.6', linewidth=0.8, linestyle='--')
            axis.set_xlim(low, high)
            axis.set_ylim(low, high)
            for scale in (axis.xaxis, axis.yaxis):
                plain_ticks(scale)
            axis.set_xlabel("stated error (%)")
            axis.set_ylabel("true error (%)")
            axis.set_title(kind, fontsize=9)
        axes[2].axis('off')
        axes[2].legend(*axes[0].get_legend_handles_labels(), loc='center left')
        picture.savefig(path, metadata={'Date': None})
        pyplot.close(picture)


def print_table(rows: list[dict]) -> None:
    """Prints a Markdown table of means over the seeds, in per cent, and of the number of covered
    bakes."""
    print("| scene | target | noise: stated, true | covered | discretisation | mesh "
          "| surface: stated, true | covered | noise of objects: covered |")
    print("|---|---|---|---|---|---|---|---|---|")
    groups: dict[tuple[str, float], list[dict]] = {}
    for row in rows:
        groups.setdefault((row['scene'], row['target']), []).append(row)
    for (scene, target), group in groups.items():
        cells = [f"`{scene}`", f"{100 * target:.2g} %"]
        objects = [entry for row in group for entry in row.get('objects', [])]
        for kind in KINDS:
            stated, true = errors(group, kind)
            if kind != next(iter(KINDS)):
                cells += [f"{100 * np.mean([row['stated'][part] for row in group]):.2f}"
                          for part in ('discretisation', 'mesh')]
            cells += ([f"{100 * stated.mean():.2f}, {100 * true.mean():.2f}",
                       f"{is_covered(stated, true).sum()} of {len(group)}"] if len(true)
                      else ["", ""])
        cells.append(covered_objects(objects))
        print("| " + " | ".join(cells) + " |")
    objects = [entry for row in rows for entry in row.get('objects', [])]
    print(f"\nnoise of objects: {covered_objects(objects)} are covered")
    for kind in KINDS:
        stated, true = errors(rows, kind)
        shown = stated > NOTHING
        print(f"\n{kind}: {100 * is_covered(stated, true).mean():.1f} % of {len(true)} bakes are "
              f"covered; true over stated: median {np.median(true[shown] / stated[shown]):.2f}, "
              f"largest {(true[shown] / stated[shown]).max():.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(prog="calibration", description=__doc__)
    parser.add_argument("out", nargs="?", type=Path, default=ROOT / "build/calibration",
                        help="folder of scenes and results")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--scenes", nargs="+", choices=[*SCENES, *ROOMS],
                        default=[*SCENES, *ROOMS])
    parser.add_argument("--draw", action="store_true")
    parser.add_argument("--images", type=Path, default=ROOT / "docs/images")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    if not arguments.draw:
        calibrate(arguments.scenes, arguments.seeds, arguments.out)
    rows = [json.loads(line)
            for line in (arguments.out / "calibration.jsonl").read_text().splitlines()]
    draw(rows, arguments.images / "calibration.svg")
    print_table(rows)


if __name__ == "__main__":
    main()
