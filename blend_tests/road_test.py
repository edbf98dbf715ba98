# SPDX-License-Identifier: GPL-3.0-or-later
r"""Bakes every .blend file of a folder and compares it with Cycles, as a test with real files.

    blender -b --factory-startup --python-exit-code 1 -P blend_tests/road_test.py -- \
        FOLDER [--limit 120] [--samples 64] [--corners 20000] [--out TABLE.md]

Each file is baked at the defaults in a Blender process of its own (road_test_file.py). The bake may
take --limit seconds, and the comparison three times as long. The table has a row for each file:

    verdict    baked; refused, with the message; or a failure: crash, hang, traceback
    faces      number of faces of all meshes and their instances, as evaluated
    seconds    time of the bake, and its longest stage
    memory     peak of the native library, MB
    stated     total error in the report, and its parts: noise, discretisation, mesh
    mean, rms  difference from Cycles at the vertices of objects, except where surfaces touch, with
               reconstruction POINT, without the noise of Cycles: that of the worst object, that of
               the median object, and how many of the means are off by more than 6 %. Objects with
               modifiers, or with more than --corners corners, are not compared
    warnings   number of warnings in the report

The exit code is 1 after a crash, a hang or a traceback.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import bpy

OFF = 0.06  # a mean of an object that is off by more than this is counted
CHILD = Path(__file__).with_name("road_test_file.py")
HEADER = ("| file | verdict | faces | seconds (most in) | MB | stated error | mean: worst, median, how many "
          "| rms: worst, median | warnings |\n|---|---|---|---|---|---|---|---|---|")


def run(path: Path, options: argparse.Namespace) -> dict:
    """Bakes a file with road_test_file.py, and returns its result with a verdict."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "result.json"
        command = [bpy.app.binary_path, "-b", str(path), "--factory-startup",
                   "--python-exit-code", "3", "-P", str(CHILD), "--", str(out),
                   str(options.samples), str(options.corners)]
        text, code = "", None
        try:
            done = subprocess.run(command, capture_output=True, text=True, errors="replace",
                                  timeout=4 * options.limit, check=False)
            text, code = done.stdout + done.stderr, done.returncode
        except subprocess.TimeoutExpired as error:
            text = (error.stderr or b"").decode(errors="replace")
        result = json.loads(out.read_text()) if out.is_file() else {}
    result['verdict'] = verdict(result, text, code, options.limit)
    return result


def verdict(result: dict, text: str, code: int | None, limit: float) -> str:
    if 'refused' in result:
        return f"refused: {result['refused']}"
    if 'report' not in result:
        if code is None:
            return "**hang**"
        if code == 3:
            return f"**traceback**: {_error(text)}"
        last = (text.strip().splitlines() or [""])[-1]
        return (f"**crash** ({code}): {last}" if 'faces' in result
                else f"Blender ended before the bake ({code}): {last}")
    if result['wall'] > limit:
        return f"baked, but in more than {limit:g} s"
    if 'objects' not in result:
        return "baked; not compared in time" if code is None else \
            f"baked; comparison failed: {_error(text)}"
    return "baked"


def _error(text: str) -> str:
    lines = [line for line in text.splitlines()
             if "Error: " in line and not line.startswith("Error: ")]
    return lines[-1].strip() if lines else "?"


def row(name: str, result: dict) -> str:
    cells = [name, result['verdict'].replace("|", "/").replace("\n", " "),
             str(result.get('faces', ""))]
    report = result.get('report')
    if report is None:
        return "| " + " | ".join(cells + [""] * 6) + " |"
    stages = {stage: seconds for stage, seconds in report['seconds'].items() if stage != 'total'}
    longest = max(stages, key=stages.get)
    error = report['error']
    cells += [f"{result['wall']:.1f} ({longest})", f"{report['peak_memory_bytes'] / 1e6:.0f}",
              f"{100 * error['total']:.2g} %: " + ", ".join(
                  f"{100 * error[part]:.2g}" for part in ('noise', 'discretisation', 'mesh'))]
    objects = result.get('objects') or []
    for key in ('mean', 'rms'):
        ordered = sorted(objects, key=lambda entry: abs(entry[key]))
        cell = "" if not ordered else (f"{100 * ordered[-1][key]:.2g} % ({ordered[-1]['name']}), "
                                       f"{100 * abs(ordered[len(ordered) // 2][key]):.2g} %")
        if key == 'mean' and ordered:
            cell += f", {sum(abs(entry[key]) > OFF for entry in ordered)} of {len(ordered)}"
        cells.append(cell)
    cells.append(str(len(report['warnings'])))
    return "| " + " | ".join(cells) + " |"


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(prog="road_test.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--limit", type=float, default=120.0, help="seconds a bake may take")
    parser.add_argument("--samples", type=int, default=64, help="Cycles', in each of two bakes")
    parser.add_argument("--corners", type=int, default=20000, help="of an object that is compared")
    parser.add_argument("--out", type=Path, help="the table goes there too")
    options = parser.parse_args(arguments)
    files = sorted(options.folder.rglob("*.blend"))
    if not files:
        parser.error(f"{options.folder} has no .blend file")
    rows = [HEADER]
    failed = 0
    for index, path in enumerate(files):
        name = str(path.relative_to(options.folder))
        done = 20 * index // len(files)
        print(f"\r[{'#' * done}{'.' * (20 - done)}] {index} of {len(files)}, {name:<60.60}", end="",
              file=sys.stderr, flush=True)
        result = run(path, options)
        failed += "**" in result['verdict']
        rows.append(row(name, result))
        if options.out:
            options.out.write_text("\n".join(rows) + "\n")
    print(file=sys.stderr)
    print("\n".join(rows))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[sys.argv.index("--") + 1:]))
