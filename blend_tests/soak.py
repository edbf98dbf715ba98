# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs many random bakes in one Blender: nothing may crash, leak memory or change its results.

    blender -b --factory-startup --python-exit-code 1 -P blend_tests/soak.py -- [--bakes 500] [--seed 1]

Scenes, materials, lights and settings are random. Some bakes are cancelled at a random moment, some
use the scene of the previous bake with additional lights. After every tenth bake a fixed scene is
baked. Its light must be equal to that of the first time to the last bit. From the second fifth of
the bakes to the last fifth, the median of the memory that is allocated at this point must not grow
by more than 2 %. If the allocator of Blender is jemalloc, as in Debian, it returns this number.
Otherwise the resident memory is used, which varies more, because it includes memory that the
allocator keeps for later.
"""

from __future__ import annotations

import ctypes
import resource
import sys
import time
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent / "addon"), str(HERE)]
sys.dont_write_bytecode = True

import command_line  # noqa: E402
import raybundle  # noqa: E402
from conftest import CUBE_FACES, CUBE_VERTICES  # noqa: E402
from raybundle.native import ErrorCode  # noqa: E402
from surface_error import read_colors  # noqa: E402

CONTROL_EVERY = 10
MOST_GROWTH = 0.02


def link(item: bpy.types.Object) -> bpy.types.Object:
    bpy.context.scene.collection.objects.link(item)
    return item


def add_material(random: np.random.Generator) -> bpy.types.Material:
    material = bpy.data.materials.new("Material")
    material.use_nodes = True
    shader = next(node for node in material.node_tree.nodes if node.type == 'BSDF_PRINCIPLED')
    shader.inputs['Base Color'].default_value = (*random.uniform(0, 1, 3), 1.0)
    shader.inputs['Roughness'].default_value = random.uniform()
    shader.inputs['Metallic'].default_value = random.choice((0.0, 0.0, random.uniform()))
    shader.inputs['Alpha'].default_value = random.choice((1.0, 1.0, random.uniform()))
    if random.uniform() < 0.3:
        texture = material.node_tree.nodes.new(
            random.choice(('ShaderNodeTexChecker', 'ShaderNodeTexNoise', 'ShaderNodeTexImage')))
        if texture.type == 'TEX_IMAGE':
            texture.image = bpy.data.images.new("Image", 8, 8, float_buffer=True)
            texture.image.pixels.foreach_set(random.uniform(0, 1, 256).astype(np.float32))
        material.node_tree.links.new(texture.outputs['Color'], shader.inputs['Base Color'])
    return material


def add_box(random: np.random.Generator, scale: np.ndarray, inward: bool) -> bpy.types.Object:
    mesh = bpy.data.meshes.new("Box")
    mesh.from_pydata((np.array(CUBE_VERTICES) * scale).tolist(), [],
                     [face[::-1] for face in CUBE_FACES] if inward else CUBE_FACES)
    mesh.uv_layers.new()
    mesh.materials.append(add_material(random))
    item = link(bpy.data.objects.new("Box", mesh))
    if random.uniform() < 0.4:
        modifier = item.modifiers.new("Cut", 'SUBSURF')
        modifier.subdivision_type, modifier.levels = 'SIMPLE', int(random.integers(1, 4))
        modifier.render_levels = modifier.levels
    return item


def add_light(random: np.random.Generator) -> bpy.types.Object:
    kind = str(random.choice(('POINT', 'SPOT', 'SUN', 'AREA')))
    light = bpy.data.lights.new("Light", kind)
    light.energy = random.uniform(0, 100)
    light.color = random.uniform(0, 1, 3)
    item = link(bpy.data.objects.new("Light", light))
    item.location = random.uniform(-1.5, 1.5, 3)
    item.rotation_euler = random.uniform(-3, 3, 3)
    return item


def build(random: np.random.Generator) -> None:
    """Builds a random room or open place with boxes, lamps and a world."""
    bpy.ops.wm.read_homefile(use_empty=True)
    if random.uniform() < 0.7:
        add_box(random, np.array([2.0, 2.0, 1.6]), True)
    for _ in range(random.integers(1, 6)):
        box = add_box(random, random.uniform(0.05, 0.6, 3), False)
        box.location = random.uniform(-1.5, 1.5, 3)
        box.rotation_euler = random.uniform(-3, 3, 3)
        if random.uniform() < 0.3:
            twin = link(bpy.data.objects.new("Twin", box.data))
            twin.location = random.uniform(-1.5, 1.5, 3)
    for _ in range(random.integers(0, 4)):
        add_light(random)
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    world.color = random.uniform(0, 1, 3)
    bpy.context.view_layer.update()


def settings(random: np.random.Generator) -> dict[str, object]:
    def one_of(*values: str) -> str:
        return str(random.choice(values))

    chosen = {"max_patches": int(10 ** random.uniform(2, 4)), "max_bundles": 256,
              "target_error": float(random.choice((0.1, 0.05, 0.02))),
              "seed": int(random.integers(1000)),
              "output": one_of('LIGHTING', 'COMBINED', 'DIRECT', 'INDIRECT'),
              "domain": one_of('CORNER', 'POINT'), "data_type": one_of('FLOAT_COLOR', 'BYTE_COLOR'),
              "reconstruction": one_of('LEAST_SQUARES', 'AREA_AVERAGE', 'POINT'),
              "refine": bool(random.integers(2)), "threads": int(random.integers(0, 3))}
    if random.uniform() < 0.15:
        chosen.update(solver=one_of('MULTIPATH', 'STOCHASTIC_ITERATION', 'RANDOM_WALK'),
                      directions='RANDOM')
    if random.uniform() < 0.2:
        chosen.update(topology='SUBDIVIDE')
    return chosen


def bake_at_random(random: np.random.Generator) -> str:
    """Bakes with random settings. Returns finished, cancelled, or refused (with a message)."""
    calls_left = int(random.integers(1, 25)) if random.uniform() < 0.2 else -1

    def progress(_stage: str, _fraction: float) -> bool:
        nonlocal calls_left
        calls_left -= 1
        return calls_left != 0

    try:
        report = raybundle.bake(bpy.context, progress=progress, **settings(random))
    except (raybundle.BakeError, raybundle.RaybundleError) as error:
        code = getattr(error, "code", None)
        if not str(error) or code not in (None, ErrorCode.CANCELLED, ErrorCode.INVALID_ARGUMENT):
            raise
        return "cancelled" if code == ErrorCode.CANCELLED else "refused"
    lit = [item for item in bpy.context.scene.objects
           if item.type == 'MESH' and "Radiosity" in item.data.color_attributes]
    if not lit or not all(np.isfinite(read_colors(item)).all() for item in lit):
        sys.exit(f"no colours, or some that are not finite; {report.objects}")
    return "finished"


def control_light() -> list[np.ndarray]:
    random = np.random.default_rng(12345)
    build(random)
    raybundle.bake(bpy.context, max_patches=5000, seed=1)
    return [read_colors(item) for item in bpy.context.scene.objects if item.type == 'MESH']


def resident_bytes() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize()


def allocated_bytes() -> int | None:
    """Returns the memory that the process has allocated and not freed, or None without jemalloc."""
    mallctl = getattr(ctypes.CDLL(None), "mallctl", None)
    if mallctl is None:
        return None
    # Updates the statistics that are read next.
    epoch = ctypes.c_uint64(1)
    mallctl(b"epoch", None, None, ctypes.byref(epoch), ctypes.c_size_t(8))
    allocated, size = ctypes.c_size_t(), ctypes.c_size_t(ctypes.sizeof(ctypes.c_size_t))
    failed = mallctl(b"stats.allocated", ctypes.byref(allocated), ctypes.byref(size), None,
                     ctypes.c_size_t(0))
    return None if failed else allocated.value


def growth(memory: list[int]) -> float:
    """Returns the relative growth from the median of the second fifth to that of the last fifth."""
    fifth = max(1, len(memory) // 5)
    return float(np.median(memory[-fifth:]) / np.median(memory[fifth:2 * fifth]) - 1.0)


def main(arguments: list[str]) -> None:
    parser = command_line.parser(__file__, __doc__)
    parser.add_argument("--bakes", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    raybundle.register()
    random = np.random.default_rng(options.seed)
    first = control_light()
    counts: dict[str, int] = {}
    # Bytes after every tenth bake.
    memory: dict[str, list[int]] = {"resident": []}
    if allocated_bytes() is not None:
        memory["allocated"] = []
    started = time.perf_counter()
    build(random)
    for k in range(1, options.bakes + 1):
        if random.uniform() < 0.6:
            build(random)
        else:
            add_light(random)
            bpy.context.view_layer.update()
        outcome = bake_at_random(random)
        counts[outcome] = counts.get(outcome, 0) + 1
        if k % CONTROL_EVERY:
            continue
        for was, now in zip(first, control_light()):
            if not np.array_equal(was, now):
                sys.exit(f"after {k} bakes the same scene has another light")
        memory["resident"].append(resident_bytes())
        if "allocated" in memory:
            memory["allocated"].append(allocated_bytes())
        build(random)
    print(f"{options.bakes} bakes in {time.perf_counter() - started:.0f} s: {counts}")
    for kind, sizes in memory.items():
        print(f"{kind} after every tenth, MB: " + " ".join(f"{size / 1e6:.1f}" for size in sizes))
        print(f"{kind}, last fifth over the second: {100 * growth(sizes):+.2f} %")
    decides = "allocated" if "allocated" in memory else "resident"
    if growth(memory[decides]) > MOST_GROWTH:
        sys.exit(f"{decides} memory grows")


if __name__ == "__main__":
    main(command_line.arguments())
