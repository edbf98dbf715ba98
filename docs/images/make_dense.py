# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the picture of a dense mesh in the user guide.

    blender -b --factory-startup -P docs/images/make_dense.py -- docs/images/dense.png

A head of 7,872 faces in a room: the edges of its mesh; the light that its clusters exchange, which
is what a bake shows before it has gathered light at the vertices; and the result. Prints the
numbers of faces and patches.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "scenes"), str(Path(__file__).parent)]
sys.dont_write_bytecode = True

import attribute_picture  # noqa: E402
import picture_sheet  # noqa: E402
import raybundle  # noqa: E402
from build.construction import (  # noqa: E402
    Diffuse, add_area_light, add_mesh, add_point_light, material, room, set_camera, set_world)
from mesh_edges import add_edges  # noqa: E402
from raybundle.bake_run import BakeRun  # noqa: E402
from raybundle.messages import Message  # noqa: E402

ATTRIBUTE = "Radiosity"
SIZE = 400, 340  # width and height, pixels
EDGE = 0.004  # m


def build(is_smooth: bool) -> bpy.types.Object:
    """Builds the room in an empty file, and returns the head."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    paint = material("paint", Diffuse((0.7, 0.65, 0.6)))
    for side, mesh in room((4, 4, 3), (24, 24, 18)).items():
        add_mesh(side, mesh, paint)
    add_area_light("panel", (0, 0, 2.9), (0, 0, 0), (0.6, 0.6), power=60)
    add_point_light("lamp", (1.5, -1.5, 2.0), power=30, radius=0.05)
    set_world()
    bpy.ops.mesh.primitive_monkey_add(size=1.6, location=(0, 0.4, 0.85))
    head = bpy.context.object
    head.modifiers.new("Subdivision", 'SUBSURF').levels = 2
    bpy.ops.object.modifier_apply(modifier="Subdivision")
    head.data.polygons.foreach_set("use_smooth", [is_smooth] * len(head.data.polygons))
    head.data.materials.append(material("head", Diffuse((0.7, 0.3, 0.2))))
    set_camera((1.0, -1.8, 1.25), (0, 0.3, 0.85), lens=30)
    return head


def draw(baked: list[str], path: Path) -> None:
    attribute_picture.render(bpy.context, baked, ATTRIBUTE, path, SIZE)


def draw_clusters(path: Path) -> None:
    """Draws the light of a bake that is stopped when the exchange of light is done."""
    build(is_smooth=False)
    run = BakeRun(bpy.context, {'output': 'COMBINED'})
    while run.advance() and run.state.stage != 'reconstruction':
        time.sleep(0.005)
    assert run.shows_light, "no light was shown"
    run.stop(Message("The light so far is drawn"), keep=True)
    names = [target.object.name for target in run.prepared.export.targets]
    run.leave()
    draw(names, path)


def draw_result(path: Path, shows_edges: bool) -> None:
    head = build(is_smooth=True)
    report = raybundle.bake(bpy.context, output='COMBINED')
    print(f"{len(head.data.polygons):,} faces of the head, {report.patches:,} patches of all")
    if shows_edges:
        add_edges(head, EDGE)
    draw([item.name for item in report.objects], path)


def main(out: Path) -> None:
    raybundle.register()
    with tempfile.TemporaryDirectory() as folder:
        edges, clusters, result = (Path(folder) / f"{name}.png"
                                   for name in ("edges", "clusters", "result"))
        draw_result(edges, shows_edges=True)
        draw_clusters(clusters)
        draw_result(result, shows_edges=False)
        picture_sheet.save((edges, clusters, result), 3, out)


if __name__ == "__main__":
    main(Path(sys.argv[sys.argv.index("--") + 1]).resolve())
