# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the contact sheet of all scenes: each as it is baked at the defaults, and by Cycles.

    blender -b --factory-startup -P docs/images/make_contact_sheet.py -- \\
        docs/images/contact_sheet.jpg [--width 400] [--samples 256] [--scenes NAME ...]

In the order of their names, two scenes a row: on the left what is baked into vertex colours
(COMBINED), on the right Cycles with that many samples, without denoising, at the same exposure.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "addon"), str(Path(__file__).parent)]
sys.dont_write_bytecode = True

import attribute_picture  # noqa: E402
import picture_sheet  # noqa: E402
import raybundle  # noqa: E402

ATTRIBUTE = "Radiosity"
SCENES_A_ROW = 2


def open_scene(path: Path, width: int) -> bpy.types.Scene:
    bpy.ops.wm.open_mainfile(filepath=str(path))
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = width, width * 3 // 4
    scene.render.resolution_percentage = 100
    return scene


def bake_picture(path: Path, width: int, out: Path) -> float:
    """Bakes a scene and renders a picture of the result to `out`. Returns the exposure of the
    picture in stops."""
    scene = open_scene(path, width)
    report = raybundle.bake(bpy.context, output='COMBINED', attribute=ATTRIBUTE)
    baked = [item.name for item in report.objects if item.status.startswith('baked')]
    attribute_picture.render(bpy.context, baked, ATTRIBUTE, out)
    print(f"{path.stem}: baked in {report.seconds['total']:.2f} s", flush=True)
    return scene.view_settings.exposure


def cycles_picture(path: Path, width: int, samples: int, exposure: float, out: Path) -> None:
    scene = open_scene(path, width)
    scene.view_settings.exposure = exposure
    scene.render.engine = 'CYCLES'
    cycles = scene.cycles
    cycles.device = 'CPU'
    cycles.samples = samples
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.max_bounces = cycles.diffuse_bounces = 64
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    scene.render.image_settings.file_format = 'PNG'
    scene.render.filepath = str(out)
    started = time.perf_counter()
    bpy.ops.render.render(write_still=True)
    print(f"{path.stem}: Cycles in {time.perf_counter() - started:.0f} s", flush=True)


def main() -> None:
    names = sorted(path.stem for path in (ROOT / "scenes").glob("*.blend"))
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=Path)
    parser.add_argument("--width", type=int, default=400)
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--scenes", nargs="+", choices=names, default=names)
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1:])
    raybundle.register()
    pictures = []
    with tempfile.TemporaryDirectory() as folder:
        for name in options.scenes:
            path = ROOT / f"scenes/{name}.blend"
            baked, rendered = Path(folder) / f"{name}.png", Path(folder) / f"{name}.cycles.png"
            exposure = bake_picture(path, options.width, baked)
            cycles_picture(path, options.width, options.samples, exposure, rendered)
            pictures += [baked, rendered]
        picture_sheet.save(pictures, 2 * SCENES_A_ROW, options.out.resolve())


if __name__ == "__main__":
    main()
