# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the picture of the three topologies in the user guide.

    blender -b --factory-startup -P docs/images/make_adaptive.py -- docs/images/adaptive.png

A cube on a plane of one face, in the sun: KEEP, SUBDIVIDE and ADAPTIVE, with the edges of the mesh
that shows the light. Prints the vertices of each.
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
from build import cube_on_plane  # noqa: E402
from mesh_edges import add_edges  # noqa: E402

ATTRIBUTE = "Radiosity"
SIZE = 400, 340  # width and height, pixels
EDGE = 0.012  # m


def draw(topology: str, path: Path) -> None:
    """Bakes the scene and renders it with the edges of its meshes as grey bars."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    cube_on_plane.build(bpy.context)
    report = raybundle.bake(bpy.context, topology=topology, output='COMBINED')
    baked = [item.name for item in report.objects]
    print(topology, sum(len(bpy.data.objects[name].data.vertices) for name in baked), "vertices,",
          f"stated error {100 * report.error['total']:.1f} %")
    for name in baked:
        add_edges(bpy.data.objects[name], EDGE)
    attribute_picture.render(bpy.context, baked, ATTRIBUTE, path, SIZE)


def main(out: Path) -> None:
    raybundle.register()
    with tempfile.TemporaryDirectory() as folder:
        pictures = []
        for topology in ('KEEP', 'SUBDIVIDE', 'ADAPTIVE'):
            pictures.append(Path(folder) / f"{topology}.png")
            draw(topology, pictures[-1])
        picture_sheet.save(pictures, len(pictures), out)


if __name__ == "__main__":
    main(Path(sys.argv[sys.argv.index("--") + 1]).resolve())
