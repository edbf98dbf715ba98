"""Builds the scenes: ``blender -b --factory-startup -P scenes/build.py -- [NAME ...]``.

Without names all scenes of this folder are built. Each is saved beside this file as NAME.blend.
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import bpy

FOLDER = Path(__file__).resolve().parent
if str(FOLDER) not in sys.path:
    sys.path.insert(0, str(FOLDER))

construction = importlib.import_module("build.construction")

SCENES = ("cornell_box", "furnace", "facing_squares", "sphere_interior", "big_room", "office",
          "two_rooms", "open_court", "thin_wall", "instances", "house_on_plain", "laid_table")
# Scenes for the measurements in docs/performance.md. They are built only if they are named, and
# saved in UNSTORED_FOLDER, because most of them are large.
UNSTORED = ("props_hall", "tree_terrain", "lamp_level", "cube_on_plane")
UNSTORED_FOLDER = FOLDER.parent / "build" / "scenes"


def build_scene(name: str, folder: Path = FOLDER, density: float = 1.0) -> Path:
    """Builds one scene in an empty file, saves it in the folder and returns the path of the file.

    density: factor for the number of cells of all grids along each edge; 1 for the scenes of this
    folder.
    """
    construction.density = density
    bpy.ops.wm.read_factory_settings(use_empty=True)
    context = bpy.context
    context.scene.name = name
    construction.set_render_settings(context.scene)
    construction.show_vertex_colours(bpy.data.screens)
    importlib.import_module(f"build.{name}").build(context)
    path = folder / f"{name}.blend"
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, copy=True)
    return path


def summary(path: Path) -> str:
    """Returns one line about the open scene: its objects and faces, and those in a render."""
    graph = bpy.context.evaluated_depsgraph_get()
    own = [item for item in bpy.context.view_layer.objects
           if item.type == "MESH" and not item.hide_render]
    shown = [instance.object for instance in graph.object_instances
             if instance.object.type == "MESH"]
    return (f"{path.name}: {len(own)} mesh objects with "
            f"{sum(len(item.data.polygons) for item in own)} faces; in a render: {len(shown)} with "
            f"{sum(len(item.data.polygons) for item in shown)} faces; {path.stat().st_size} bytes")


def main(names: list[str]) -> None:
    """Builds the named scenes, or all scenes if there are no names. Exits if a name is unknown."""
    unknown = sorted(set(names) - {*SCENES, *UNSTORED})
    if unknown:
        sys.exit(f"unknown scene: {', '.join(unknown)}; the scenes are: "
                 f"{', '.join(SCENES + UNSTORED)}")
    UNSTORED_FOLDER.mkdir(parents=True, exist_ok=True)
    for name in names or SCENES:
        folder = UNSTORED_FOLDER if name in UNSTORED else FOLDER
        print(summary(build_scene(name, folder)))


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])
