# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the picture of simplified meshes in the user guide.

    blender -b --factory-startup -P docs/images/make_simplified.py -- docs/images/simplified.png

The Cornell box as it is, and simplified, each with the edges of its meshes and without them. Prints
the vertices of both.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "scenes"), str(Path(__file__).parent)]
sys.dont_write_bytecode = True

import attribute_picture  # noqa: E402
import picture_sheet  # noqa: E402
import raybundle  # noqa: E402
from mesh_edges import add_edges  # noqa: E402

ATTRIBUTE = "Radiosity"
SIZE = 300, 300  # width and height, pixels
EDGE = 0.006  # m


def draw(simplify: bool, with_edges: bool, path: Path) -> None:
    """Bakes the scene and renders it."""
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "scenes" / "cornell_box.blend"))
    report = raybundle.bake(bpy.context, simplify=simplify, output='COMBINED')
    baked = [item.name for item in report.objects]
    print("simplified" if simplify else "as it is", sum(item.vertices for item in report.objects),
          f"vertices, stated error {100 * report.error['total']:.1f} %")
    if with_edges:
        for name in baked:
            add_edges(bpy.data.objects[name], EDGE)
    attribute_picture.render(bpy.context, baked, ATTRIBUTE, path, SIZE)


def main(out: Path) -> None:
    raybundle.register()
    with tempfile.TemporaryDirectory() as folder:
        pictures = []
        for simplify in (False, True):
            for with_edges in (True, False):
                pictures.append(Path(folder) / f"{simplify}{with_edges}.png")
                draw(simplify, with_edges, pictures[-1])
        picture_sheet.save(pictures, len(pictures), out)


if __name__ == "__main__":
    main(Path(sys.argv[sys.argv.index("--") + 1]).resolve())
