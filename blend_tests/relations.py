# SPDX-License-Identifier: GPL-3.0-or-later
"""What must not change the light of a scene, changed: a table for docs/stability.md.

    blender -b --factory-startup --python-exit-code 1 -P blend_tests/relations.py -- \\
        [--quick] [--only TEXT] [--noise] [SCENE ...]

SCENE is a name of scenes/, the path of a .blend, or `room:NAME` (lamp_rooms.py); without any it is
all scenes and all rooms. Each relation bakes a scene that was changed (scene_changes.py), or with
other settings, and compares it with the scene as it was:

    light      of each object the mean by area of LIGHTING, each channel: within 2 %, or twice the
               noise that is stated of the object in either bake, if that is more. Objects with less
               than 5 % of the scene's mean light are compared by 5 % of that mean. Faces that
               something lies against are left out: nobody sees them
    balance    energy neither absorbed nor escaped, of what is emitted: below 5e-3
    bundles    within twice (not where the method is another)

Of methods that approximate, light may be wrong where a warning says so. Relations that a scene has
nothing for are not counted. Failures are listed above the table; the exit code is then 1. `--noise`
bakes the rooms by several seeds instead (lamp_noise.py); `--quick` takes the relations of the tests
and coarse rooms. A new kind of lamp, material or setting adds its row.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent / "addon"), str(HERE)]
sys.dont_write_bytecode = True

import lamp_noise  # noqa: E402
import lamp_rooms  # noqa: E402
import raybundle  # noqa: E402
import scene_changes as changes  # noqa: E402
from surface_error import corner_areas, face_sizes, read_colors  # noqa: E402

SCENES = HERE.parent / "scenes"
LIGHT, NOISES, DARK, BALANCE, COST = 0.02, 2.0, 0.05, 5e-3, 2.0
SAME = 1e-5  # where only the threads are others
SETTINGS = {'output': 'LIGHTING', 'domain': 'CORNER', 'target_error': 0.01, 'max_bundles': 8192}


@dataclass(frozen=True)
class Relation:
    name: str
    change: Callable[[], None] = lambda: None
    # What it is compared with is the scene changed so.
    reference: Callable[[], None] | None = None
    settings: dict[str, object] = field(default_factory=dict)  # of the changed scene's bake
    factor: float = 1.0  # that the light must have
    tolerance: float = LIGHT
    costs_same: bool = True
    least_cost: float = 1.0 / COST  # bundles, of those before
    # What a warning says where light may be wrong; such a bake may also be refused.
    says: str = ""
    is_quick: bool = False


RANDOM = {'directions': 'RANDOM', 'target_error': 0.03}


def method(name: str, says: str = "noise is", costs_same: bool = False, **settings) -> Relation:
    return Relation(name, settings=settings, says=says, costs_same=costs_same)


RELATIONS = (
    Relation("turned by (0.4, 0.7, 1.1)", changes.turned(0.4, 0.7, 1.1), is_quick=True),
    Relation("turned by (90°, 0, 0)", changes.turned(np.pi / 2, 0.0, 0.0)),
    Relation("turned by (0, 0, 0.5)", changes.turned(0.0, 0.0, 0.5)),
    Relation("turned by 1e-3", changes.turned_slightly, is_quick=True),
    Relation("turned at random, 1", changes.turned_at_random(1)),
    Relation("turned at random, 2", changes.turned_at_random(2)),
    Relation("turned in the meshes", changes.turned_in_meshes, changes.apply_modifiers),
    Relation("moved by 1 km", changes.moved_far, is_quick=True),
    Relation("0.001 times as large", changes.scaled(1e-3)),
    Relation("1000 times as large", changes.scaled(1e3)),
    Relation("mirrored", changes.mirrored, is_quick=True),
    Relation("sheared in the meshes, not by parents", changes.sheared_in_meshes,
             changes.sheared_by_parents),
    Relation("vertices moved by 1e-7", changes.jittered(1e-7)),
    Relation("vertices moved by 1e-6", changes.jittered(1e-6), is_quick=True),
    Relation("faces in another order", changes.elements_reordered("faces"), is_quick=True),
    Relation("vertices in another order", changes.elements_reordered("verts")),
    Relation("objects in another order", changes.objects_reordered),
    Relation("materials in another order", changes.materials_reordered),
    Relation("quads triangulated", changes.triangulated, changes.apply_modifiers, is_quick=True),
    Relation("edges split", changes.edges_split, changes.apply_modifiers),
    Relation("joined", changes.joined, changes.apply_modifiers, is_quick=True),
    Relation("emissive meshes joined", changes.lamps_joined, changes.apply_modifiers),
    Relation("separated by loose parts", changes.separated_parts, changes.apply_modifiers),
    Relation("separated into halves", changes.separated_halves, changes.apply_modifiers),
    # What gets no colours of its own is not judged by its noise.
    Relation("instanced", changes.instanced, changes.apply_modifiers, least_cost=0.0),
    Relation("made real", changes.made_real),
    Relation("an object far away", changes.far_object_added, is_quick=True),
    Relation("a copy of the scene far away", changes.far_copy_added),
    Relation("black dust", changes.dust_added),
    Relation("1000 times the power", changes.power_scaled(1e3), factor=1e3),
    Relation("a thousandth of the power", changes.power_scaled(1e-3), factor=1e-3),
    Relation("each lamp two of half", changes.lamps_halved, is_quick=True),
    Relation("area lamps as emissive faces", changes.area_lamps_as_faces,
             changes.area_lamps_before_plates),
    Relation("the sum of light sets", changes.in_light_sets, is_quick=True),
    Relation("seed 1", settings={'seed': 1}),
    Relation("seed 2", settings={'seed': 2}),
    Relation("one thread", settings={'threads': 1}, tolerance=SAME, is_quick=True),
    Relation("three threads", settings={'threads': 3}, tolerance=SAME),
    method("solver MULTIPATH", solver='MULTIPATH', **RANDOM),
    method("solver STOCHASTIC_ITERATION", solver='STOCHASTIC_ITERATION', **RANDOM),
    method("solver RANDOM_WALK", solver='RANDOM_WALK', **RANDOM),
    method("first shot SHOOT", first_shot='SHOOT'),
    method("first shot EXTENDED", first_shot='EXTENDED'),
    method("projector FRAGMENT_LISTS", projector='FRAGMENT_LISTS', costs_same=True),
    method("projector PAINTER", "in a wrong order", projector='PAINTER'),
    method("projector PAINTER_NEWELL", "in a wrong order", projector='PAINTER_NEWELL'),
    method("projector PLANE", projector='PLANE', target_error=0.03),
    method("projector PLANES", projector='PLANES', target_error=0.03),
    method("directions RANDOM", **RANDOM),
    method("directions ADAPTIVE", solver='MULTIPATH', directions='ADAPTIVE', target_error=0.03),
)


# --------------------------------------------------------------------------------------------------
# A bake
# --------------------------------------------------------------------------------------------------


@dataclass
class Bake:
    """light and noise: by the name of the object that was, before it was joined or cut up."""

    light: dict[str, np.ndarray]  # (3,) mean by area of LIGHTING
    areas: dict[str, float]  # m^2
    noise: dict[str, float]  # stated, in the unit of the light
    balance: float
    bundles: int
    seconds: float
    warnings: list[str]

    def scene_mean(self) -> float:
        areas = np.array(list(self.areas.values()))
        return float(areas @ np.mean(list(self.light.values()), axis=1) / areas.sum())


_covered: dict[str, dict[str, np.ndarray]] = {}  # by scene


def open_scene(name: str, cells: int = lamp_rooms.FINE) -> None:
    """As it is, but that its faces remember whether they are covered."""
    _open_file(name, cells)
    bpy.context.view_layer.update()
    if name not in _covered:
        _covered[name] = changes.covered_faces()
    changes.mark_covered(_covered[name])


def _open_file(name: str, cells: int) -> None:
    kind, _, room = name.partition(":")
    if kind == "room":
        lamp_rooms.build(room, cells)
        return
    path = SCENES / f"{name}.blend"
    bpy.ops.wm.open_mainfile(filepath=str(path if path.is_file() else Path(name).resolve()))


def bake(**settings: object) -> Bake:
    """The open scene."""
    bpy.context.view_layer.update()
    started = time.perf_counter()
    report = raybundle.bake(bpy.context, **{**SETTINGS, **settings})
    seconds = time.perf_counter() - started
    scene = bpy.context.scene
    attributes = [entry['attribute'] for entry in report.light_sets] or [scene.raybundle.attribute]
    light: dict[str, np.ndarray] = {}
    areas: dict[str, float] = {}
    noise: dict[str, float] = {}
    for entry in report.objects:
        if not entry.status.startswith('baked'):
            continue
        item = bpy.data.objects[entry.name]
        values = sum(read_colors(item, name).astype(float) for name in attributes)
        sizes = face_sizes(item.data)
        weights = corner_areas(item) * np.repeat(1 - face_numbers(item, changes.COVERED), sizes)
        size = np.sqrt(weights @ (values ** 2).mean(axis=1) / max(weights.sum(), 1e-30))
        for name, own in _by_origin(item):
            area = weights[own].sum()
            if area <= 0.0:
                continue
            light[name] = light.get(name, 0.0) + weights[own] @ values[own]
            areas[name] = areas.get(name, 0.0) + area
            noise[name] = max(noise.get(name, 0.0), float(entry.error.get('noise', 0.0) * size))
    light = {name: total / areas[name] for name, total in light.items()}
    return Bake(light, areas, noise, report.energy['balance_error'], report.bundles, seconds,
                report.warnings)


def face_numbers(item: bpy.types.Object, attribute: str) -> np.ndarray:
    """(faces,) of an attribute, 0 where there is none."""
    numbers = np.zeros(len(item.data.polygons), np.int32)
    if attribute in item.data.attributes:
        item.data.attributes[attribute].data.foreach_get('value', numbers)
    return numbers


def _by_origin(item: bpy.types.Object) -> list[tuple[str, np.ndarray]]:
    """(corners,) masks of an object's corners by the object that they belonged to."""
    if changes.ORIGIN not in item.data.attributes:
        return [(item.name, np.ones(len(item.data.loops), bool))]
    names = bpy.context.scene[changes.ORIGINS]
    origins = np.repeat(face_numbers(item, changes.ORIGIN), face_sizes(item.data))
    return [(names[index], origins == index) for index in np.unique(origins)]


# --------------------------------------------------------------------------------------------------
# A comparison
# --------------------------------------------------------------------------------------------------


@dataclass
class Result:
    relation: str
    scene: str
    skipped: str = ""  # why it is not counted
    worst: str = ""  # the object whose light is farthest off, for what it may be
    deviation: float = np.nan
    allowed: float = np.nan
    balance: float = np.nan
    bundles: tuple[int, int] = (0, 0)
    seconds: float = 0.0
    said: list[str] = field(default_factory=list)  # what is wrong and was warned of
    failures: list[str] = field(default_factory=list)

    def cost(self) -> float:
        """Bundles, of those before."""
        return self.bundles[1] / max(self.bundles[0], 1)


class Scene:
    """A scene and its bakes before any change, one for each reference."""

    def __init__(self, name: str, cells: int = lamp_rooms.FINE) -> None:
        self.name = name
        self._cells = cells
        self._references: dict[Callable[[], None] | None, Bake] = {}

    def measure(self, relation: Relation) -> Result:
        result = Result(relation.name, self.name)
        try:
            before = self._reference(relation.reference)
            open_scene(self.name, self._cells)
            relation.change()
            after = bake(**relation.settings)
        except changes.NotApplicable as reason:
            result.skipped = str(reason)
        except (raybundle.BakeError, raybundle.RaybundleError) as error:
            (result.said if relation.says else result.failures).append(f"refused: {error}")
        else:
            compare(relation, before, after, result)
        return result

    def _reference(self, change: Callable[[], None] | None) -> Bake:
        if change not in self._references:
            open_scene(self.name, self._cells)
            if change:
                change()
            self._references[change] = bake()
        return self._references[change]


def compare(relation: Relation, before: Bake, after: Bake, result: Result) -> None:
    dark = DARK * before.scene_mean()
    is_warned = relation.says and any(relation.says in text for text in after.warnings)
    for name in before.light.keys() & after.light.keys():
        size = max(float(before.light[name].mean()), dark, 1e-30)
        deviation = np.abs(after.light[name] / relation.factor - before.light[name]).max() / size
        noise = max(before.noise[name], after.noise[name] / relation.factor) / size
        allowed = relation.tolerance
        if relation.tolerance > SAME:
            allowed = max(allowed, NOISES * noise)
        if not deviation <= allowed:
            text = f"{name} {100 * deviation:.3g} % off, {100 * allowed:.2g} % allowed"
            named = any(f'"{name}"' in warning and "too coarse" not in warning
                        for warning in after.warnings)
            says_so = is_warned or relation.says and named
            (result.said if says_so else result.failures).append(text)
        if not deviation / allowed <= result.deviation / result.allowed:
            result.worst, result.deviation, result.allowed = name, deviation, allowed
    if not before.light.keys() & after.light.keys():
        result.failures.append("nothing is baked")
    result.balance, result.seconds = after.balance, after.seconds
    result.bundles = (before.bundles, after.bundles)
    if not after.balance < BALANCE:
        result.failures.append(f"balance {after.balance:.2g} (before {before.balance:.2g})")
    if relation.costs_same and not relation.least_cost <= result.cost() <= COST:
        result.failures.append(f"{after.bundles} bundles instead of {before.bundles}")


# --------------------------------------------------------------------------------------------------
# Tables
# --------------------------------------------------------------------------------------------------


def row(name: str, results: list[Result]) -> str:
    counted = [result for result in results if not result.skipped]
    if not counted:
        return f"| {name} | 0 | - | - | - | - | no scene has what it needs |"
    failed = [result.scene for result in counted if result.failures]
    said = [result.scene for result in counted if result.said and not result.failures]
    baked = [result for result in counted if result.worst]
    cells = ["-", "-", "-"]
    if baked:
        worst = max(baked, key=lambda result: np.nan_to_num(result.deviation / result.allowed,
                                                            nan=np.inf))
        costs = [result.cost() for result in baked]
        cells = [f"{100 * worst.deviation:.2g} % of {100 * worst.allowed:.2g} % "
                 f"({worst.scene}, {worst.worst})",
                 f"{max(result.balance for result in baked):.1e}",
                 f"{min(costs):.2g} to {max(costs):.2g}"]
    outcome = "holds"
    if failed:
        outcome = f"FAILS in {len(failed)}: {', '.join(failed)}"
    elif said:
        outcome = f"holds, or said in {', '.join(said)}"
    return f"| {name} | {len(counted)} | {' | '.join(cells)} | {outcome} |"


def all_scenes() -> list[str]:
    return ([path.stem for path in sorted(SCENES.glob("*.blend"))]
            + [f"room:{name}" for name in lamp_rooms.ROOMS])


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(prog="relations.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--quick", action="store_true", help="those of the tests, coarse rooms")
    parser.add_argument("--only", default="", help="relations with this in their name")
    parser.add_argument("--noise", action="store_true", help="the rooms' noise by seeds instead")
    options = parser.parse_args(arguments)
    raybundle.register()
    names = options.scenes or all_scenes()
    cells = lamp_rooms.COARSE if options.quick else lamp_rooms.FINE
    if options.noise:
        rooms = [name.partition(":")[2] for name in names if name.startswith("room:")]
        sys.exit(lamp_noise.print_table(rooms, options.quick))
    chosen = [relation for relation in RELATIONS if options.only in relation.name
              and (relation.is_quick or not options.quick)]
    results: dict[str, list[Result]] = {relation.name: [] for relation in chosen}
    for name in names:
        scene = Scene(name, cells)
        started = time.perf_counter()
        for relation in chosen:
            result = scene.measure(relation)
            results[relation.name].append(result)
            if result.failures:
                print(f"FAIL {name}: {relation.name}: {'; '.join(result.failures)}", flush=True)
        print(f"done {name} in {time.perf_counter() - started:.0f} s", flush=True)
    print("\n| relation | scenes | light, worst of what is allowed | balance, worst | "
          "bundles, of those before | |\n|---|---|---|---|---|---|")
    for relation in chosen:
        print(row(relation.name, results[relation.name]), flush=True)
    failed = sum(bool(result.failures) for entries in results.values() for result in entries)
    if failed:
        sys.exit(f"{failed} relations failed")


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])
