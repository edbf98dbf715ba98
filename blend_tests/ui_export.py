# SPDX-License-Identifier: GPL-3.0-or-later
"""Step of ui_test.py: exports the light by its button."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import bpy
from ui_bake import colors
from ui_window import FILES, MAIN, UiError, confirm_file, until


def export(out: Path) -> Iterator[float]:
    """Exports the light beside the .blend file, and reads it back. Yields pauses, s."""
    path = Path(bpy.data.filepath).with_suffix(".glb")
    button = yield from MAIN.find("bpy.ops.raybundle.export_gltf(", out)
    yield from MAIN.click(button.centre)
    yield from FILES.opened()
    yield from confirm_file(path, out / "choose_glb.png")
    yield from until(path.is_file, f"{path} was not written")
    # It imports the add-on.
    from test_gltf_export import HALF_QUANTUM, read_glb, worst_difference
    document, values = read_glb(path)
    scale = document['asset']['extras']['raybundle']['scale']
    light = colors()
    if not light.keys() <= {node['name'] for node in document['nodes']}:
        raise UiError("objects are missing in the file")
    # The reader takes long for many corners.
    item = bpy.data.objects[min(light, key=lambda name: len(light[name]))]
    quantum = HALF_QUANTUM[bpy.context.scene.raybundle.export_format]
    if worst_difference(item, document, values, scale) > quantum * 1.001:
        raise UiError(f'the file has other light on "{item.name}" than the attribute')
