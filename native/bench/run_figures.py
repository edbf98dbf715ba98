# SPDX-License-Identifier: GPL-3.0-or-later
"""Exports the scenes, runs the comparisons of figure_table.py and draws them. See `figures`."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

sys.dont_write_bytecode = True

from figure_table import FIGURES, SCENES, Figure  # noqa: E402
from plot import draw  # noqa: E402

ROOT = Path(__file__).parent.parent.parent
COMPARE = ROOT / "build/release/native/bench/compare"
EXPORT = ROOT / "blend_tests/export_scene.py"
# At least 10 times the number of bundles of any run whose error is close to that of the reference.
REFERENCE_BUNDLES = 8192
SMOKE_REFERENCE_BUNDLES = 64
SECONDS_PER_BAKE = 60


def export(name: str, folder: Path) -> Path:
    """Exports a scene, or the room `room_NAME` of lamp_rooms.py, as JSON and returns the path.

    Does nothing if the JSON file is newer than its source.
    """
    target = folder / f"{name}.json"
    if name in SCENES:
        blend, show, hide = SCENES[name]
        source = ROOT / f"scenes/{blend}.blend"
        opened, options = [str(source)], ["--show", *show, "--hide", *hide]
    else:
        source, opened = ROOT / "blend_tests/lamp_rooms.py", []
        options = ["--room", name.removeprefix("room_")]
    if target.exists() and target.stat().st_mtime > source.stat().st_mtime:
        return target
    command = [os.environ.get("BLENDER", "blender"), "-b", "--factory-startup",
               "--python-exit-code", "1", *opened, "-P", str(EXPORT), "--", str(target), *options]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"figures: cannot export {name}:\n{done.stdout}{done.stderr}")
    return target


def first_of_each_curve(runs: list[str]) -> list[str]:
    return list({line.split()[0]: line for line in reversed(runs)}.values())


def compare(figure: Figure, folder: Path, is_smoke: bool) -> bool:
    """Writes FOLDER/NAME.jsonl, where NAME is that of the figure. Returns whether every run
    succeeded."""
    runs, results = folder / f"{figure.name}.runs", folder / f"{figure.name}.jsonl"
    lines = first_of_each_curve(figure.runs) if is_smoke else figure.runs
    runs.write_text("\n".join(lines) + "\n")
    results.unlink(missing_ok=True)
    scenes = [str(export(name, folder)) for name in figure.scenes]
    code = subprocess.run([
        str(COMPARE), *scenes, "--runs", str(runs), "--seeds",
        str(1 if is_smoke else figure.seeds), "--tag", figure.name, "--work",
        str(folder / "references"), "--out", str(results), "--reference-bundles",
        str(SMOKE_REFERENCE_BUNDLES if is_smoke else REFERENCE_BUNDLES), "--limit",
        str(SECONDS_PER_BAKE)]).returncode
    if code > 1:
        sys.exit(f"figures: {figure.name} failed")
    return code == 0


def main() -> None:
    names = [figure.name for figure in FIGURES]
    parser = argparse.ArgumentParser(prog="figures", description=__doc__)
    parser.add_argument("out", nargs="?", type=Path, default=ROOT / "build/figures",
                        help="folder of scenes, references and results")
    parser.add_argument("--only", nargs="+", choices=names, default=names, metavar="FIGURE",
                        help=" ".join(names))
    parser.add_argument("--images", type=Path, default=ROOT / "docs/images",
                        help="folder of the pictures")
    parser.add_argument("--smoke", action="store_true",
                        help="one run of each curve, to see that all of them go: no figures to use")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    all_well = True
    started = time.monotonic()
    for figure in FIGURES:
        if figure.name not in arguments.only:
            continue
        before = time.monotonic()
        all_well &= compare(figure, arguments.out, arguments.smoke)
        now = time.monotonic()
        print(f"{figure.name}: {now - before:.0f} s ({now - started:.0f} s so far)", flush=True)
    draw(arguments.out, arguments.images, arguments.only)
    if not all_well:
        sys.exit("figures: some combinations failed; see above")


if __name__ == "__main__":
    main()
