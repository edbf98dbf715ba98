# SPDX-License-Identifier: GPL-3.0-or-later
r"""Bakes a .blend file in the background; the script behind the ./bake command.

    blender -b --factory-startup FILE.blend --python-exit-code 1 -P addon/bake_file.py -- \
        [--out DIR] [--set name=value ...]

Writes DIR/NAME.baked.blend, DIR/NAME.json (the report) and DIR/NAME.png (a picture of the vertex
colours). Leaves with exit code 1 and one line on an error. A picture that cannot be made is none: a
line of the summary says why.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))

import attribute_picture  # noqa: E402
import raybundle  # noqa: E402
from raybundle.properties import assign, enum_skip  # noqa: E402

# Seconds between two lines of progress within a stage.
PROGRESS_SECONDS = 1.0


def main(arguments: list[str]) -> None:
    options = _parse(arguments)
    if not bpy.data.filepath:
        raise raybundle.BakeError("There is no file to bake: name a .blend file before -P")
    raybundle.register()
    name = Path(bpy.data.filepath).stem
    out = options.out.resolve()
    _check_writable(out)
    scene = bpy.context.scene
    for assignment in options.set:
        _apply(scene, assignment)

    report = raybundle.bake(bpy.context, ProgressLines())
    _write_whole(out / f"{name}.json", report.to_json(indent=2) + "\n")
    # No backup of the result of an earlier run is kept beside the file.
    bpy.context.preferences.filepaths.save_version = 0
    # Paths of textures and libraries relative to the original must also work from the new place.
    bpy.ops.wm.save_as_mainfile(filepath=str(out / f"{name}.baked.blend"), relative_remap=True,
                                compress=True, copy=True)
    # The picture changes the open file, which is therefore not saved after this.
    baked = {item.name for item in report.objects if item.status.startswith('baked')}
    no_picture = _draw_picture(baked, scene.raybundle.attribute, out / f"{name}.png")
    _print_summary(report, out, name, no_picture)


def _check_writable(out: Path) -> None:
    """Raises OSError if the folder cannot be written to, before time is spent on a bake."""
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=out):
        pass


def _draw_picture(baked: set[str], attribute: str, path: Path) -> str:
    """Writes the picture. Returns the reason if there is none, else an empty string."""
    try:
        # The picture of an earlier bake must not stay.
        path.unlink(missing_ok=True)
        attribute_picture.render(bpy.context, baked, attribute, path)
        return "" if path.is_file() else "Blender wrote no image"
    except Exception as error:  # of any kind: the bake is saved already
        return (str(error).strip() or type(error).__name__).splitlines()[0]


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="bake", description="Bake a .blend file")
    parser.add_argument("--out", type=Path, default=Path("out"), metavar="DIR",
                        help="folder for the results (default: out)")
    parser.add_argument("--set", nargs="+", action="extend", default=[], metavar="name=value",
                        help="settings of scene.raybundle, such as target_error=0.01")
    return parser.parse_args(arguments)


def _apply(scene: bpy.types.Scene, assignment: str) -> None:
    name, equals, value = assignment.partition("=")
    if not equals:
        raise raybundle.BakeError(f'--set "{assignment}": expected name=value')
    names = [item.identifier for item in type(scene.raybundle).bl_rna.properties
             if item.identifier not in ('rna_type', 'name', 'report') and not item.is_hidden]
    names += [f"skip.{item[0]}" for item in enum_skip]
    if name not in names:
        raise raybundle.BakeError(f'--set "{name}": unknown setting, choose one of '
                                  f'{", ".join(names)}')
    assign(scene.raybundle, name, value)


class ProgressLines:
    """Prints a line when a stage begins and after each second of the stage."""

    def __init__(self) -> None:
        self._stage = ""
        self._printed = 0.0

    def __call__(self, stage: str, fraction: float) -> None:
        now = time.monotonic()
        if stage == self._stage and now < self._printed + PROGRESS_SECONDS:
            return
        self._stage, self._printed = stage, now
        print(f"{stage:<14} {100.0 * fraction:3.0f} %", flush=True)


def _write_whole(path: Path, text: str) -> None:
    """Writes a file. On failure an existing file stays as it was."""
    part = path.with_name(path.name + ".part")
    try:
        part.write_text(text)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _print_summary(report: raybundle.BakeReport, out: Path, name: str, no_picture: str) -> None:
    if 'ENERGY_BALANCE' in report.warning_ids:
        # Lost or created light is worse than all else, so this warning is printed before the rest.
        print(f"warning: {report.warnings[0]}")
    print(report.summary())
    stages = ", ".join(f"{stage} {seconds:.2f}" for stage, seconds in report.seconds.items()
                       if stage != 'total')
    print(f"  seconds: {stages}")
    print("  stated error: " + ", ".join(f"{part} {100.0 * share:.2g} %"
                                         for part, share in report.error.items()))
    print(f"  energy balance error: {report.energy['balance_error']:.1e}")
    for item in report.objects:
        if item.status != 'baked':
            print(f"  {item.name}: {item.status}")
        else:
            print(f"  {item.name}: stated error {100.0 * item.error['total']:.2g} %")
    for warning in report.warnings:
        print(f"  warning: {warning}")
    if no_picture:
        print(f"  no picture: {no_picture}")
    for suffix in ("baked.blend", "json") if no_picture else ("baked.blend", "png", "json"):
        print(f"  wrote {out / f'{name}.{suffix}'}")


if __name__ == "__main__":
    given = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    try:
        main(given)
    except (raybundle.BakeError, raybundle.RaybundleError, ValueError, OSError,
            RuntimeError) as error:  # RuntimeError: of Blender's operators
        print(f"bake: {error}", file=sys.stderr, flush=True)
        # Otherwise Blender would print a traceback and continue.
        os._exit(1)
