# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes pictures of docs/install.md and docs/user_guide.md from a run of the test of Blender's
window.

    /usr/bin/python3 docs/images/make_window_pictures.py docs/images [--blender blender]

Needs xvfb-run, xdotool, python3-pil, and a Blender before 4.2. The pictures are parts of those that
the test keeps, with a frame around the widget in question.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

from PIL import Image, ImageDraw

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "blend_tests"))

import run_ui_test  # noqa: E402

# The picture of the test, the part of it in pixels from its upper left corner, and the width of the
# result.
PARTS = {
    "install_zip.png": ("preferences.png", (0, 0, 687, 206), 687),
    "install_enable.png": ("enabled.png", (0, 0, 687, 206), 687),
    "install_bake.png": ("baked.png", (330, 240, 1280, 800), 560),
    "relight_greyed.png": ("relight_greyed.png", (670, 650, 1280, 820), 610),
    "export_options.png": ("choose_glb.png", (880, 42, 1101, 182), 221),
}
FRAME, MARGIN = (255, 160, 0), 4


def make(source: Path, part: tuple[int, int, int, int], width: int, target: Path) -> None:
    """Cuts a part out of a picture, frames the widget that the test has noted, if any, and
    writes the part as a PNG file with 256 colours."""
    picture = Image.open(source).convert("RGB")
    if source.with_suffix(".json").exists():
        left, bottom, right, top = json.loads(source.with_suffix(".json").read_text())
        ImageDraw.Draw(picture).rounded_rectangle(
            (left - MARGIN, picture.height - top - MARGIN, right + MARGIN - 1,
             picture.height - bottom + MARGIN - 1), radius=MARGIN, outline=FRAME, width=2)
    picture = picture.crop(part)
    picture = picture.resize((width, picture.height * width // picture.width),
                             Image.Resampling.LANCZOS)
    palette = picture.quantize(256, kmeans=4)
    picture.quantize(palette=palette).save(target, optimize=True)


def main() -> None:
    parser = argparse.ArgumentParser(prog="make_window_pictures.py")
    parser.add_argument("out", type=Path)
    parser.add_argument("--blender", default="blender")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        if run_ui_test.run(options.blender, run_ui_test.LIBRARY, Path(folder)):
            sys.exit(1)
        for name, (source, part, width) in PARTS.items():
            make(Path(folder, source), part, width, options.out / name)


if __name__ == "__main__":
    main()
