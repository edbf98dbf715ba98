# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs ui_test.py in a Blender with a window, on a screen of its own (Xvfb, software OpenGL).

    python3 blend_tests/run_ui_test.py [--blender PATH] [--library PATH] [--out DIR]
                                       [--pace SECONDS]

Makes a zip of the add-on with the native library PATH, and gives Blender a new HOME and a copy of
the scene cornell_box. Needs xvfb-run and xdotool, and a Blender before 4.2, whose Preferences
install add-ons as the test does it. --pace is how long the user hesitates before each click and
each key. The exit code is 0 if the test passed, and 77 if it does not know this Blender.
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
WRITE_ZIP = ROOT / "native" / "packaging" / "write_zip"
LIBRARY = ROOT / "addon" / "raybundle" / "lib" / "libraybundle.so"
SCENE, LAMP = "cornell_box.blend", "lamp"
SECONDS = 220
SKIPPED = 77  # exit code of ui_test.py


def run(blender: str, library: Path, out: Path, pace: float = 0.0) -> int:
    """Runs the test and returns its exit code. Arguments: those of the command line."""
    missing = [name for name in (blender, "xvfb-run", "xdotool") if shutil.which(name) is None]
    if missing:
        print(f"ui: not found: {', '.join(missing)}")
        return 1
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        archive = subprocess.run(
            [sys.executable, WRITE_ZIP, library, folder], check=True,
            stdout=subprocess.PIPE, text=True).stdout.strip()
        file = shutil.copy(ROOT / "scenes" / SCENE, folder)
        code, output = run_blender(
            blender, folder, ROOT / "blend_tests" / "ui_test.py", archive, file, LAMP,
            "--out", out, "--pace", pace)
    # Blender may exit with 0 for other reasons. The test must also have printed that it passed.
    # An error in a panel or of an operator is only printed.
    if code == 0 and "ui_test: passed" in output \
            and "Traceback" not in output and "Error:" not in output:
        print(f"ui: passed; pictures of the windows are in {out}")
        return 0
    if code == SKIPPED:
        return code
    print(f"ui: failed with exit code {code}; pictures are in {out}")
    return 1


def run_blender(blender: str, home: Path, script: Path, *arguments: object) -> tuple[int, str]:
    """Runs a script in a Blender with a window and a user's folder `home`. Prints its output.
    Returns the exit code and the output."""
    command = ["xvfb-run", "-a", "-s", "-screen 0 1280x960x24", blender,
               "--python-exit-code", "1", "--window-geometry", "0", "0", "1280", "960",
               "-P", script, "--", *arguments]
    # Software OpenGL. Debian's Blender uses the first Python on the PATH. This must not be the
    # Python of a version manager or virtual environment that runs this script.
    folders = os.environ["PATH"].split(os.pathsep)
    if sys.prefix not in ("/usr", "/usr/local"):
        folders = [folder for folder in folders if not folder.startswith(sys.prefix)]
    environment = {name: value for name, value in os.environ.items()
                   if not name.startswith("BLENDER_")}
    environment |= {"LIBGL_ALWAYS_SOFTWARE": "1", "PATH": os.pathsep.join(folders),
                    "HOME": str(home)}
    # A separate session, so that Xvfb and Blender can be ended together.
    process = subprocess.Popen(list(map(str, command)), env=environment, start_new_session=True,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        output, _ = process.communicate(timeout=SECONDS)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGTERM)
        try:
            output, _ = process.communicate(timeout=10)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            output, _ = process.communicate()
        output += f"ui: no result after {SECONDS} s"
    print(output)
    return process.returncode, output


def main() -> None:
    parser = argparse.ArgumentParser(prog="run_ui_test.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--blender", default="blender")
    parser.add_argument("--library", type=Path, default=LIBRARY)
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "ui")
    parser.add_argument("--pace", type=float, default=0.0)
    options = parser.parse_args()
    out = options.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    sys.exit(run(options.blender, options.library, out, options.pace))


if __name__ == "__main__":
    main()
