# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes the open file for road_test.py at the defaults, and compares it with Cycles.

    blender -b FILE.blend --factory-startup -P blend_tests/road_test_file.py -- RESULT.json SAMPLES CORNERS

RESULT.json is written before the bake, after it was done or refused, and with the comparison. The
.blend file is not saved.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent / "addon"), str(HERE)]
sys.dont_write_bytecode = True

import raybundle  # noqa: E402
from cycles_reference import bake_objects  # noqa: E402
from surface_error import is_defined, off_contact_edges, read_colors  # noqa: E402

ATTRIBUTE = "RoadTest"
# Share of the scene's mean light; differences of darker objects are relative to this share.
DARK = 0.05


def baked_faces() -> int:
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return sum(len(instance.object.data.polygons) for instance in depsgraph.object_instances
               if instance.object.type == 'MESH')


def compare(names: list[str], samples: int, most: int) -> list[dict]:
    """Compares the light of objects with Cycles at their vertices.

    Compares objects without modifiers, with at most `most` corners, of which there are no
    instances: Cycles may bake the light of an instance instead. Leaves out vertices on edges where
    surfaces touch, because a single point decides there. Leaves out channels in which the diffuse
    colour is 0 (all channels of black surfaces and metals, two of a pure red): Cycles divides the
    light by the colour, and gives such a channel the mean of the others. mean and rms are
    differences from two bakes of Cycles without their noise, relative to Cycles' mean, or to DARK
    of the scene's mean if that is more.
    """
    depsgraph = bpy.context.evaluated_depsgraph_get()
    instanced = {instance.object.original for instance in depsgraph.object_instances
                 if instance.is_instance}
    items = [item for item in map(bpy.data.objects.get, names)
             if not item.modifiers and len(item.data.loops) <= most and item.data.users == 1
             and item not in instanced]
    raybundle.bake(bpy.context, output='LIGHTING', domain='CORNER', data_type='FLOAT_COLOR',
                   attribute=ATTRIBUTE, reconstruction='POINT')
    ours = {item.name: read_colors(item, ATTRIBUTE).astype(float) for item in items}
    seen = off_contact_edges(items)
    bakes = [bake_objects(items, samples, seed) for seed in (0, 1)] if items else []
    colors = bake_objects(items, 1, 0, passes=frozenset({"COLOR"})) if items else {}
    scene = np.mean([light.mean() for light in bakes[0].values()]) if items else 0.0
    result = []
    for item in items:
        name = item.name
        used = seen[name] & is_defined(item, bakes[0][name] + bakes[1][name])
        used = used[:, None] & (colors[name] > 0.0)
        if not used.any():
            continue
        own, first, second = (light[name][used] for light in (ours, *bakes))
        cycles = 0.5 * (first + second)
        size = max(float(cycles.mean()), DARK * float(scene), 1e-30)
        noise = float(np.mean((first - second)**2)) / 4
        rms = max(float(np.mean((own - cycles)**2)) - noise, 0.0)
        result.append({'name': name, 'mean': float(own.mean() - cycles.mean()) / size,
                       'rms': rms**0.5 / size, 'noise': (noise / own.size)**0.5 / size})
    return result


def main(path: Path, samples: int, corners: int) -> None:
    raybundle.register()
    if bpy.context.object is not None and bpy.context.object.mode != 'OBJECT':
        bpy.ops.object.mode_set(mode='OBJECT')  # otherwise its mesh would be empty
    bpy.context.view_layer.update()
    result: dict[str, object] = {'blender': bpy.app.version_string, 'faces': baked_faces()}

    def save() -> None:
        path.write_text(json.dumps(result))

    save()
    started = time.perf_counter()
    try:
        report = raybundle.bake(bpy.context, output='LIGHTING', domain='CORNER',
                                data_type='FLOAT_COLOR', attribute=ATTRIBUTE)
    except (raybundle.BakeError, raybundle.RaybundleError) as error:
        result['refused'] = str(error)
        save()
        return
    result |= {'wall': time.perf_counter() - started, 'report': json.loads(report.to_json())}
    save()
    names = [entry.name for entry in report.objects if entry.status.startswith("baked")]
    started = time.perf_counter()
    result['objects'] = compare(names, samples, corners)
    result['cycles_wall'] = time.perf_counter() - started
    save()


if __name__ == "__main__":
    out, samples_, corners_ = sys.argv[sys.argv.index("--") + 1:]
    main(Path(out), int(samples_), int(corners_))
