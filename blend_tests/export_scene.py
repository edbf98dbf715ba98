# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a scene, as the native library gets it, as JSON for the programs of native/bench.

    blender -b --factory-startup [FILE.blend] -P blend_tests/export_scene.py -- OUT.json \\
        [--show COLLECTION ...] [--hide COLLECTION ...] [--room NAME]

The add-on exports the scene. --show and --hide first include collections in the view layer and
exclude collections from it: scenes/office.blend has its lamps in lamps_up and lamps_down. --room
exports a room of lamp_rooms.py instead of a file. The .blend file is never saved. The format is
that of SceneData and is read by native/bench/scene_file.cpp. It has one list per kind. Arrays are
flat, surfaces and their parts are objects, and indices are positions in the lists. Fields that are
None are left out.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import fields, is_dataclass
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent / "addon"), str(HERE)]
sys.dont_write_bytecode = True

import lamp_rooms  # noqa: E402
import raybundle  # noqa: E402
from raybundle.scene_data import (AreaLightData, PointLightData, SceneData,  # noqa: E402
                                  SunLightData)
from raybundle.scene_export import export_scene  # noqa: E402

LIGHT_KINDS = {PointLightData: 'POINT', SunLightData: 'SUN', AreaLightData: 'AREA'}


def to_json(data: SceneData) -> dict:
    return {
        'images': [{**record(image), 'width': image.pixels.shape[1],
                    'height': image.pixels.shape[0]} for image in data.images],
        'materials': [record(material) for material in data.materials],
        'meshes': [record(mesh) for mesh in data.meshes],
        'instances': [record(instance) for instance in data.instances],
        'lights': [{'kind': LIGHT_KINDS[type(light)], **record(light)} for light in data.lights],
        'world': flat(data.world),
    }


def record(item: object) -> dict:
    values = {field.name: getattr(item, field.name) for field in fields(item)}
    return {name: flat(value) for name, value in values.items() if value is not None}


def flat(value: object) -> object:
    if is_dataclass(value):
        return record(value)
    return value.ravel().tolist() if isinstance(value, np.ndarray) else value


def show_collections(layer: bpy.types.LayerCollection, show: list[str], hide: list[str]) -> None:
    found = set()
    pending = list(layer.children)
    while pending:
        child = pending.pop()
        pending.extend(child.children)
        if child.name in show or child.name in hide:
            child.exclude = child.name in hide
            found.add(child.name)
    if missing := (set(show) | set(hide)) - found:
        sys.exit(f"export_scene: there is no collection {', '.join(sorted(missing))}")


def main() -> None:
    parser = argparse.ArgumentParser(prog="export_scene")
    parser.add_argument("out", type=Path)
    parser.add_argument("--show", nargs="*", default=[], metavar="COLLECTION")
    parser.add_argument("--hide", nargs="*", default=[], metavar="COLLECTION")
    parser.add_argument("--room", choices=list(lamp_rooms.ROOMS))
    arguments = parser.parse_args(sys.argv[sys.argv.index("--") + 1:])
    if arguments.room:
        lamp_rooms.build(arguments.room)
    show_collections(bpy.context.view_layer.layer_collection, arguments.show, arguments.hide)
    export = export_scene(bpy.context)
    for warning in export.warnings:
        print(f"export_scene: {warning}", file=sys.stderr)
    arguments.out.write_text(json.dumps(to_json(export.scene)))


if __name__ == "__main__":
    raybundle.register()
    main()
