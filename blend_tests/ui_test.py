# SPDX-License-Identifier: GPL-3.0-or-later
"""Uses the add-on by mouse and keyboard in a Blender with a window, from the zip to an export.
run_ui_test.py starts this script.

    blender -P blend_tests/ui_test.py -- ZIP FILE.blend LAMP --out DIR [--pace SECONDS]

HOME must be a new folder. Installs the zip in the Preferences, opens the file, bakes it, and goes
on with everything that a user does with the result. LAMP is the name of an object that emits light
and that the 3D view shows. Each step is checked by the state of Blender and the pixels of the
window, pictures of which are saved in DIR. SECONDS is how long the user hesitates before each click
and each key. Prints how long the way to the lit room took. The exit code is 0 or 1, or 77 if this
Blender installs add-ons in another way (from 4.2 on).
"""

from __future__ import annotations

import argparse
import os
import sys
import time
import traceback
from collections.abc import Iterator
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
sys.dont_write_bytecode = True

import ui_bake  # noqa: E402
import ui_export  # noqa: E402
import ui_install  # noqa: E402
import ui_live  # noqa: E402
import ui_window  # noqa: E402
from ui_window import MAIN, UiError  # noqa: E402

SKIPPED = 77


def steps(options: argparse.Namespace) -> Iterator[float]:
    """Runs the test. Yields the pauses between its steps, s."""
    out = options.out
    yield from ui_install.close_splash(out)
    began = time.monotonic()
    yield from ui_install.install(options.archive, out)
    installed = time.monotonic()
    yield from ui_install.open_file(options.file, out)
    opened = time.monotonic()
    yield from ui_bake.bake(out)
    now = time.monotonic()
    say(f"from the zip to the lit room {now - began:.1f} s: install {installed - began:.1f} s, "
        f"open {opened - installed:.1f} s, bake {now - opened:.1f} s")
    ui_bake.check_result()
    for step in (ui_bake.undo_and_redo(), ui_bake.escape(out), ui_bake.stop_and_keep(out),
                 ui_bake.save_and_reopen(out), ui_live.live(out, options.lamp),
                 ui_export.export(out)):
        yield from step
        say(f"{step.__name__} passed after {time.monotonic() - began:.1f} s")


def say(message: str) -> None:
    print(f"ui_test: {message}", flush=True)


def leave(code: int, message: str) -> None:
    say(message)
    sys.stdout.flush()
    # A normal exit would open a dialog that asks whether to save the file.
    os._exit(code)


def run(script: Iterator[float], out: Path) -> None:
    """Runs a script of steps in a timer, and ends Blender after it."""
    def advance() -> float | None:
        try:
            return next(script)
        except StopIteration:
            leave(0, "passed")
        except Exception as error:
            MAIN.picture(out / "failure.png")
            if not isinstance(error, UiError):
                traceback.print_exc()
            leave(1, f"failed: {error}")
        return None

    bpy.app.timers.register(advance, first_interval=1.0, persistent=True)


def main() -> None:
    parser = argparse.ArgumentParser(prog="ui_test.py")
    parser.add_argument("archive", type=Path)
    parser.add_argument("file", type=Path)
    parser.add_argument("lamp")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--pace", type=float, default=0.0)
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1:])
    options.out.mkdir(parents=True, exist_ok=True)
    if bpy.app.background:
        leave(1, "needs a window: start it without -b")
    if bpy.app.version >= (4, 2, 0):
        leave(SKIPPED, "skipped, because it knows only the Preferences of Blender before 4.2")
    ui_window.pace = options.pace
    # Software OpenGL would draw each picture of the 3D view eight times.
    bpy.context.preferences.system.viewport_aa = 'FXAA'
    run(steps(options), options.out)


if __name__ == "__main__":
    main()
