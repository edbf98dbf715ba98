# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs ui_test.py in a Blender with a window, on a screen of its own (Xvfb, software OpenGL).

    python3 blend_tests/run_ui_test.py [--blender PATH] [--scene NAME] [--out DIR]

Needs xvfb-run and xdotool. The exit code is 0 if the test passed.
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
SECONDS = 180


def run(blender: str, scene: str, out: Path) -> int:
    """Runs the test and returns its exit code."""
    missing = [name for name in (blender, "xvfb-run", "xdotool") if shutil.which(name) is None]
    if missing:
        print(f"ui: not found: {', '.join(missing)}")
        return 1
    command = ["xvfb-run", "-a", "-s", "-screen 0 1280x960x24", blender, "--factory-startup",
               "--python-exit-code", "1", "--window-geometry", "0", "0", "1280", "960",
               str(ROOT / "scenes" / f"{scene}.blend"),
               "-P", str(ROOT / "blend_tests" / "ui_test.py"), "--", "--out", str(out)]
    # Software OpenGL. Debian's Blender uses the first Python on the PATH. This must not be the
    # Python of a version manager or virtual environment that runs this script.
    folders = os.environ["PATH"].split(os.pathsep)
    if sys.prefix not in ("/usr", "/usr/local"):
        folders = [folder for folder in folders if not folder.startswith(sys.prefix)]
    environment = {**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1", "PATH": os.pathsep.join(folders)}
    # A separate session, so that Xvfb and Blender can be ended together.
    process = subprocess.Popen(command, env=environment, start_new_session=True,
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
        print(f"{output}\nui: no result after {SECONDS} s")
        return 1
    print(output)
    # Blender may exit with 0 for other reasons. The test must also have printed that it passed.
    # An error in a panel is only printed.
    if process.returncode == 0 and "ui_test: Bake was clicked" in output \
            and "Traceback" not in output:
        print(f"ui: passed; the window is in {out / 'raybundle_panel.png'}")
        return 0
    print(f"ui: failed with exit code {process.returncode}; pictures are in {out}")
    return 1


def main() -> None:
    parser = argparse.ArgumentParser(prog="run_ui_test.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--blender", default="blender")
    parser.add_argument("--scene", default="cornell_box")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "ui")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    sys.exit(run(options.blender, options.scene, options.out.resolve()))


if __name__ == "__main__":
    main()
