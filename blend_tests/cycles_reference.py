"""Bakes the light of Cycles at the corners of meshes, as a reference.

    blender -b FILE.blend -P blend_tests/cycles_reference.py -- \\
        --samples 8192 --seed 0 --out FILE.npz [--objects NAME ...]

The values are those of the bake type Diffuse of Cycles with Direct and Indirect, but without Color:
irradiance / pi, scene-linear, as point samples exactly at the corners. A surface that reflects
nothing (black, or pure emission) has no diffuse light in Cycles. Its values are 0, however much
light arrives. The .blend file is never saved.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from shared_corners import each_place_once  # noqa: E402

ATTRIBUTE = "Cycles"
BOUNCES = 128


def bakeable_objects(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Returns the mesh objects of the view layer that are rendered and have faces."""
    return [item for item in context.view_layer.objects
            if item.type == "MESH" and len(item.data.polygons) > 0
            and not item.hide_render and item.visible_get()]


def prepare_scene(scene: bpy.types.Scene, samples: int, seed: int,
                  filter_glossy: float = 0.0) -> None:
    """Sets Cycles to an unbiased bake.

    Traces all bounces. Does not clamp, denoise or adapt the number of samples.

    filter_glossy: the setting Filter Glossy. Values above 0 make gloss rougher; 1 is the default of
    new scenes.
    """
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples, cycles.seed = samples, seed
    cycles.time_limit = 0.0
    cycles.use_animated_seed = False
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.use_fast_gi = False
    cycles.use_guiding = False
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = BOUNCES
    cycles.transmission_bounces = cycles.transparent_max_bounces = BOUNCES
    cycles.min_light_bounces = cycles.min_transparent_bounces = 0
    cycles.light_sampling_threshold = 0.0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.blur_glossy = filter_glossy
    scene.render.use_simplify = False


def target_attribute(mesh: bpy.types.Mesh) -> bpy.types.Attribute:
    """Returns the attribute of the mesh that the bake writes, and makes it active.

    Creates the attribute if it is missing or has another type or domain.
    """
    attributes = mesh.color_attributes
    existing = attributes.get(ATTRIBUTE)
    if existing is not None and (existing.data_type, existing.domain) != ("FLOAT_COLOR", "CORNER"):
        attributes.remove(existing)
        existing = None
    if existing is None:
        attributes.new(name=ATTRIBUTE, type="FLOAT_COLOR", domain="CORNER")
    attributes.active_color_index = attributes.find(ATTRIBUTE)
    return attributes[ATTRIBUTE]


def corner_values(mesh: bpy.types.Mesh) -> np.ndarray:
    """Returns the baked values, (corners, 3) RGB."""
    attribute = mesh.color_attributes[ATTRIBUTE]
    values = np.empty(4 * len(attribute.data), dtype=np.float32)
    attribute.data.foreach_get("color", values)
    return values.reshape(-1, 4)[:, :3].copy()


def rounds_of_distinct_meshes(objects: Sequence[bpy.types.Object]
                              ) -> list[list[bpy.types.Object]]:
    """Splits the objects into rounds of which none contains two objects that share a mesh.

    A second bake of a shared mesh would overwrite the values of the first.
    """
    rounds: list[dict[bpy.types.Mesh, bpy.types.Object]] = []
    for item in objects:
        free = next((entry for entry in rounds if item.data not in entry), None)
        if free is None:
            free = {}
            rounds.append(free)
        free[item.data] = item
    return [list(entry.values()) for entry in rounds]


def bake_objects(objects: Sequence[bpy.types.Object], samples: int, seed: int,
                 kind: str = "DIFFUSE", passes: frozenset[str] = frozenset({"DIRECT", "INDIRECT"}),
                 filter_glossy: float = 0.0) -> dict[str, np.ndarray]:
    """Returns the values that Cycles bakes, (corners, 3) RGB by object name.

    By default the values are irradiance / pi. kind and passes are the arguments type and
    pass_filter of Blender's bake operator. "INDIRECT" alone is no reference: without "DIRECT",
    Cycles (3.4) does not sample lights at all, not even after a reflection.

    The scene's render settings, the selection and the active colour attributes of the meshes are
    changed.
    """
    context = bpy.context
    prepare_scene(context.scene, samples, seed, filter_glossy)
    result: dict[str, np.ndarray] = {}
    for group in rounds_of_distinct_meshes(objects):
        for item in group:
            target_attribute(item.data)
        # In other passes, values may differ between corners at one place: colour and gloss do.
        has_places = kind == "DIFFUSE" and "COLOR" not in passes
        with each_place_once(group, ATTRIBUTE) if has_places else nullcontext(group) as baked:
            for item in context.view_layer.objects:
                item.select_set(item in baked)
            context.view_layer.objects.active = baked[0]
            bpy.ops.object.bake(type=kind, pass_filter=set(passes),
                                target="VERTEX_COLORS", use_selected_to_active=False,
                                use_clear=True)
        result.update((item.name, corner_values(item.data)) for item in group)
    return result


def save(path: Path, values: dict[str, np.ndarray], samples: int, seed: int, seconds: float
         ) -> None:
    """Writes the values, with the settings and the duration of the bake, to a compressed .npz file.

    The array of an object has the key ``object:NAME``.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(path, samples=samples, seed=seed, seconds=round(seconds, 1),
                        blender_version=bpy.app.version_string,
                        **{f"object:{name}": array for name, array in values.items()})


def load(path: Path) -> dict[str, np.ndarray]:
    """Returns the values in a file that `save` wrote, (corners, 3) by object name."""
    with np.load(path) as stored:
        return {key.partition(":")[2]: stored[key] for key in stored.files
                if key.startswith("object:")}


def sample_emissive_meshes(sampled: bool) -> None:
    """Sets whether Cycles samples the faces of emissive materials like lamps.

    Otherwise only rays that happen to meet the faces collect their light.
    """
    for material in bpy.data.materials:
        if hasattr(material.cycles, 'emission_sampling'):  # from 3.5 on
            material.cycles.emission_sampling = 'AUTO' if sampled else 'NONE'
        else:
            material.cycles.sample_as_light = sampled


def main(argv: Sequence[str]) -> None:
    """Runs the command line. argv: the arguments after `--`."""
    parser = argparse.ArgumentParser(prog="cycles_reference.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=8192)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--objects", nargs="*", metavar="NAME",
                        help="bake these only (default: every mesh object that is rendered)")
    options = parser.parse_args(argv)

    objects = bakeable_objects(bpy.context)
    if options.objects:
        missing = sorted(set(options.objects) - {item.name for item in objects})
        if missing:
            sys.exit(f"not a rendered mesh object of this scene: {', '.join(missing)}")
        objects = [item for item in objects if item.name in options.objects]
    if not objects:
        sys.exit("nothing to bake: the scene has no rendered mesh object with faces")

    start = time.perf_counter()
    values = bake_objects(objects, options.samples, options.seed)
    seconds = time.perf_counter() - start
    save(options.out, values, options.samples, options.seed, seconds)
    for name, array in values.items():
        print(f"{name}: {len(array)} corners, mean {array.mean(axis=0).round(4).tolist()}")
    print(f"{options.out}: {options.samples} samples in {seconds:.1f} s")


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])
