# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bake and an export write for Blender itself and for each engine.

Engines show vertex colours best as LIGHTING, the light on a white surface: the glTF material
multiplies it by the surface's colour and image. Blender 3.4's exporter mixes up the values of face
corners (fixed in 3.5), so that light is baked to vertices there. Floats keep light above 1; the
range is found by the export (gltf_export.py).
"""

from __future__ import annotations

import bpy

# Whether Blender's own exporter writes the values of face corners in their places.
EXPORTS_CORNERS = bpy.app.version >= (3, 5, 0)

_EXPORTED = {'output': 'LIGHTING', 'domain': 'CORNER' if EXPORTS_CORNERS else 'POINT',
             'data_type': 'FLOAT_COLOR', 'exposure': 0.0, 'clamp': False,
             'export_format': 'SHORT', 'export_range': 'AUTO'}

PRESETS: dict[str, dict[str, object]] = {
    'BLENDER': {**_EXPORTED, 'domain': 'CORNER'},
    'GLTF': _EXPORTED,
    # Godot stores 8 bits per channel in its meshes, of which the full range keeps most.
    'GODOT': {**_EXPORTED, 'export_format': 'BYTE', 'export_range': 'FULL'},
    'UNITY': _EXPORTED,
    'THREE': _EXPORTED,
}

_SETS = ("Sets the output Lighting as floats without exposure and clamp, one value per face corner "
         "(per vertex before Blender 3.5, whose exporter mixes up face corners)")
_SCALES = "divides light above 1 by the largest value, because glTF allows 0 to 1"

# Items of the property `engine`. Files store positions: add at the end.
ENUM_ENGINE = (
    ('BLENDER', "Blender",
     "For renders in Blender. Sets the output Lighting as floats without exposure and clamp, one "
     "value per face corner, because nothing is lost in Blender"),
    ('GLTF', "glTF",
     f"For any program that reads glTF. {_SETS}. The export writes 16 bits and {_SCALES}"),
    ('GODOT', "Godot",
     f"For Godot. {_SETS}. The export writes 8 bits, because Godot keeps 8 bits per channel, and "
     f"divides light by the largest value"),
    ('UNITY', "Unity", f"For Unity. {_SETS}. The export writes 16 bits and {_SCALES}"),
    ('THREE', "three.js",
     f"For web pages with three.js. {_SETS}. The export writes 16 bits and {_SCALES}"),
)


def apply_preset(settings: bpy.types.PropertyGroup, engine: str) -> None:
    """Sets the settings of scene.raybundle that an engine (a key of PRESETS) needs."""
    for name, value in PRESETS[engine].items():
        setattr(settings, name, value)
