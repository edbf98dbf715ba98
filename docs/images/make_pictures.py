# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the pictures of README.md from the present program.

    blender -b --factory-startup scenes/cornell_box.blend -P docs/images/make_pictures.py -- OUT_DIR

Writes before.png (the surfaces' own colours, nothing lit) and after.png (output COMBINED).
"""

from __future__ import annotations

import sys
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))

import attribute_picture  # noqa: E402
import raybundle  # noqa: E402
from raybundle.materials.export import MaterialExporter, SlotMaterial  # noqa: E402
from raybundle.scene_data import SceneData, Warnings  # noqa: E402

ATTRIBUTE = "Radiosity"


def show_own_colors(objects: list[bpy.types.Object]) -> None:
    """Replaces the baked light by the front's reflectance, which is constant per object."""
    exporter = MaterialExporter(SceneData(), Warnings())
    for item in objects:
        index = exporter.export(SlotMaterial(item.material_slots[0].material)).index
        color = np.append(exporter.scene.materials[index].front.reflectance.constant, 1.0)
        data = item.data.color_attributes[ATTRIBUTE].data
        data.foreach_set('color', np.tile(color, len(data)).astype(np.float32))


def main(out: Path) -> None:
    raybundle.register()
    # Rendering a picture replaces materials, so open the original file again for each picture.
    for name in ("after", "before"):
        bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
        report = raybundle.bake(bpy.context, output='COMBINED', attribute=ATTRIBUTE)
        baked = [item.name for item in report.objects if item.status.startswith('baked')]
        if name == "before":
            show_own_colors([bpy.data.objects[item] for item in baked])
        bpy.context.scene.render.resolution_x = 640
        bpy.context.scene.render.resolution_y = 640
        attribute_picture.render(bpy.context, baked, ATTRIBUTE, out / f"{name}.png")


if __name__ == "__main__":
    main(Path(sys.argv[sys.argv.index("--") + 1]).resolve())
