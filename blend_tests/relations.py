# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks changes that must not change the light of a scene: a table for docs/stability.md.

    blender -b --factory-startup --python-exit-code 1 -P blend_tests/relations.py -- \\
        [--quick] [--only TEXT] [--noise] [SCENE ...]

SCENE is a name of a scene in scenes/, the path of a .blend file, or `room:NAME` (lamp_rooms.py). By
default all scenes and all rooms are baked, or with --quick some small scenes and all rooms. Each
relation bakes a scene that was changed (place_changes.py, mesh_changes.py, light_changes.py), or
with other settings, and compares it with the unchanged scene:

    light      mean of LIGHTING by area of each object, in each channel: equal within 2 %, or
               within twice the noise that is stated for the object in either bake, if that is
               more. Objects with less than 5 % of the scene's mean light are compared relative to
               5 % of that mean. Faces that another surface lies against are left out, because
               they are invisible. If noise is correlated on a whole wall, one mean in twenty is by
               chance off by more than twice its noise. A deviation that is slightly too large is
               therefore measured again, in the mean of four seeds
    balance    share of the emitted energy that is neither absorbed nor escapes: below 5e-3, or
               below 1.5e-2 for methods with a target of 3 %
    bundles    half to twice the number of the unchanged scene. Not checked for other methods and
               for light sets, each of which has a noise target of its own

If a method approximates, its light may be wrong where a warning says so. Relations that do not
apply to a scene are not counted. Failures are listed above the table, and the exit code is then 1.
`--noise` bakes the rooms with several seeds instead (lamp_noise.py). `--quick` uses the relations
of the tests and coarse rooms. A new kind of lamp, material or setting adds a row.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent / "addon"), str(HERE)]
sys.dont_write_bytecode = True

import command_line  # noqa: E402
import lamp_noise  # noqa: E402
import lamp_rooms  # noqa: E402
import light_changes  # noqa: E402
import mesh_changes  # noqa: E402
import place_changes  # noqa: E402
import raybundle  # noqa: E402
from object_light import SCENES, Bake, bake, open_scene  # noqa: E402
from scene_items import NotApplicable, apply_modifiers  # noqa: E402

LIGHT, NOISES, DARK, BALANCE, COST = 0.02, 2.0, 0.05, 5e-3, 2.0
SAME = 1e-5  # tolerance if only the number of threads differs
# A deviation of up to AGAIN times its limit is measured again with these additional seeds.
AGAIN, SEEDS = 3.0, (11, 12, 13)
SMALL = ("cornell_box", "instances", "thin_wall")
SETTINGS = {'output': 'LIGHTING', 'domain': 'CORNER', 'target_error': 0.01, 'max_bundles': 8192}


@dataclass(frozen=True)
class Relation:
    """A change of a scene or of settings, and what may differ after it."""

    name: str
    change: Callable[[], None] = lambda: None
    # Change that makes the scene with which the changed scene is compared. None: the scene as it
    # is.
    reference: Callable[[], None] | None = None
    # Settings of the bake of the changed scene.
    settings: dict[str, object] = field(default_factory=dict)
    factor: float = 1.0  # factor by which the light must change
    tolerance: float = LIGHT
    costs_same: bool = True
    least_cost: float = 1.0 / COST  # least number of bundles, as a share of those before
    # Texts in warnings with which the light may be wrong. A bake may then also be refused.
    says: tuple[str, ...] = ()
    is_quick: bool = False


RANDOM = {'directions': 'RANDOM'}
# Warnings of methods that ignore the angle of light and do not cut patches in narrow gaps.
LAMBERT = ("the angle at which light arrives", "gaps that are much narrower")


def method(name: str, *says: str, costs_same: bool = False, **settings) -> Relation:
    return Relation(name, settings=settings, says=says or ("noise is",), costs_same=costs_same)


RELATIONS = (
    Relation("turned by (0.4, 0.7, 1.1)", place_changes.turned(0.4, 0.7, 1.1), is_quick=True),
    Relation("turned by (90°, 0, 0)", place_changes.turned(np.pi / 2, 0.0, 0.0)),
    Relation("turned by (0, 0, 0.5)", place_changes.turned(0.0, 0.0, 0.5)),
    Relation("turned by 1e-3", place_changes.turned_slightly, is_quick=True),
    Relation("turned at random, 1", place_changes.turned_at_random(1)),
    Relation("turned at random, 2", place_changes.turned_at_random(2)),
    Relation("turned in the meshes", place_changes.turned_in_meshes, apply_modifiers),
    Relation("moved by 1 km", place_changes.moved_far, is_quick=True),
    Relation("0.001 times as large", place_changes.scaled(1e-3)),
    Relation("1000 times as large", place_changes.scaled(1e3)),
    Relation("mirrored", place_changes.mirrored, is_quick=True),
    Relation("sheared in the meshes, not by parents", place_changes.sheared_in_meshes,
             place_changes.sheared_by_parents),
    Relation("vertices moved by 1e-7", place_changes.jittered(1e-7)),
    Relation("vertices moved by 1e-6", place_changes.jittered(1e-6), is_quick=True),
    Relation("faces in another order", mesh_changes.elements_reordered("faces"), is_quick=True),
    Relation("vertices in another order", mesh_changes.elements_reordered("verts")),
    Relation("objects in another order", mesh_changes.objects_reordered),
    Relation("materials in another order", mesh_changes.materials_reordered),
    Relation("quads triangulated", mesh_changes.triangulated, apply_modifiers, is_quick=True),
    Relation("edges split", mesh_changes.edges_split, apply_modifiers),
    Relation("joined", mesh_changes.joined, apply_modifiers, is_quick=True),
    Relation("emissive meshes joined", mesh_changes.lamps_joined, apply_modifiers),
    Relation("separated by loose parts", mesh_changes.separated_parts, apply_modifiers),
    Relation("separated into halves", mesh_changes.separated_halves, apply_modifiers),
    # Instances get no colours, and their noise does not count.
    Relation("instanced", mesh_changes.instanced, apply_modifiers, least_cost=0.0),
    Relation("made real", mesh_changes.made_real),
    Relation("an object far away", light_changes.far_object_added, is_quick=True),
    Relation("a copy of the scene far away", light_changes.far_copy_added),
    Relation("black dust", light_changes.dust_added),
    Relation("1000 times the power", light_changes.power_scaled(1e3), factor=1e3),
    Relation("a thousandth of the power", light_changes.power_scaled(1e-3), factor=1e-3),
    Relation("each lamp split into two", light_changes.lamps_halved, is_quick=True),
    Relation("area lamps as emissive faces", light_changes.area_lamps_as_faces,
             light_changes.area_lamps_before_plates),
    Relation("the sum of light sets", light_changes.in_light_sets, costs_same=False, is_quick=True),
    Relation("seed 1", settings={'seed': 1}),
    Relation("seed 2", settings={'seed': 2}),
    Relation("one thread", settings={'threads': 1}, tolerance=SAME, is_quick=True),
    Relation("three threads", settings={'threads': 3}, tolerance=SAME),
    method("solver MULTIPATH", *LAMBERT, solver='MULTIPATH', **RANDOM),
    # Its noise is correlated on whole walls: at a target of 0.01 the error of the balance is 3e-3
    # in the mean of seeds.
    method("solver STOCHASTIC_ITERATION", *LAMBERT, solver='STOCHASTIC_ITERATION',
           target_error=0.006, max_bundles=16384, **RANDOM),
    method("solver RANDOM_WALK", *LAMBERT, solver='RANDOM_WALK', **RANDOM),
    method("first shot SHOOT", *LAMBERT, first_shot='SHOOT'),
    method("first shot EXTENDED", *LAMBERT, first_shot='EXTENDED'),
    method("projector FRAGMENT_LISTS", projector='FRAGMENT_LISTS', costs_same=True),
    method("projector PAINTER", "in a wrong order", projector='PAINTER'),
    method("projector PAINTER_NEWELL", "in a wrong order", projector='PAINTER_NEWELL'),
    method("projector PLANE", projector='PLANE', target_error=0.03),
    method("projector PLANES", projector='PLANES', target_error=0.03),
    method("directions RANDOM", **RANDOM),
    method("directions ADAPTIVE", *LAMBERT, solver='MULTIPATH', directions='ADAPTIVE'),
)


# --------------------------------------------------------------------------------------------------
# A comparison
# --------------------------------------------------------------------------------------------------


@dataclass
class Result:
    """The comparison of a scene before and after one relation."""

    relation: str
    scene: str
    skipped: str = ""  # reason why it is not counted
    worst: str = ""  # object with the largest deviation relative to its limit
    deviation: float = np.nan
    allowed: float = np.nan
    balance: float = np.nan
    bundles: tuple[int, int] = (0, 0)
    seconds: float = 0.0
    said: list[str] = field(default_factory=list)  # deviations that a warning announced
    failures: list[str] = field(default_factory=list)

    def cost(self) -> float:
        """Returns the number of bundles as a multiple of those before."""
        return self.bundles[1] / max(self.bundles[0], 1)


class Scene:
    """A scene and its bakes before any change: one for each reference and seed."""

    def __init__(self, name: str, cells: int = lamp_rooms.FINE) -> None:
        self.name = name
        self._cells = cells
        self._references: dict[tuple[Callable[[], None] | None, int], Bake] = {}

    def measure(self, relation: Relation) -> Result:
        result = Result(relation.name, self.name)
        try:
            before, after = self._reference(relation.reference), self._bake(
                relation.change, relation.settings)
            wrong, result.worst, result.deviation, result.allowed = compare(relation, before, after)
            if relation.tolerance > SAME and 1.0 < result.deviation / result.allowed < AGAIN:
                pairs = [(before, after)] + [
                    (self._reference(relation.reference, seed),
                     self._bake(relation.change, {**relation.settings, 'seed': seed}))
                    for seed in SEEDS]
                mean_before, mean_after = (mean_of(list(bakes)) for bakes in zip(*pairs))
                wrong, result.worst, result.deviation, result.allowed = compare(
                    relation, mean_before, mean_after)
        except NotApplicable as reason:
            result.skipped = str(reason)
        except (raybundle.BakeError, raybundle.RaybundleError) as error:
            (result.said if relation.says else result.failures).append(f"refused: {error}")
        else:
            judge(relation, before, after, wrong, result)
        return result

    def _bake(self, change: Callable[[], None], settings: dict[str, object]) -> Bake:
        open_scene(self.name, self._cells)
        change()
        return bake(**{**SETTINGS, **settings})

    def _reference(self, change: Callable[[], None] | None, seed: int = 0) -> Bake:
        if (change, seed) not in self._references:
            self._references[change, seed] = self._bake(change or (lambda: None), {'seed': seed})
        return self._references[change, seed]


def mean_of(bakes: list[Bake]) -> Bake:
    """Returns the mean light of several seeds, with the noise of the first."""
    names = set.intersection(*(set(entry.light) for entry in bakes))
    return replace(bakes[0], light={name: np.mean([entry.light[name] for entry in bakes], axis=0)
                                    for name in names})


def compare(relation: Relation, before: Bake, after: Bake
            ) -> tuple[dict[str, str], str, float, float]:
    """Compares the light of objects before and after a change.

    Returns a text for each object whose deviation is too large, and of the worst object its name,
    its deviation and its limit, both relative.
    """
    dark = DARK * before.scene_mean()
    wrong: dict[str, str] = {}
    worst = ("", np.nan, np.nan)
    for name in sorted(before.light.keys() & after.light.keys()):
        size = max(float(before.light[name].mean()), dark, 1e-30)
        deviation = np.abs(after.light[name] / relation.factor - before.light[name]).max() / size
        noise = max(before.noise[name], after.noise[name] / relation.factor) / size
        allowed = relation.tolerance
        if relation.tolerance > SAME:
            allowed = max(allowed, NOISES * noise)
        if not deviation <= allowed:
            wrong[name] = f"{name} {100 * deviation:.3g} % off, {100 * allowed:.2g} % allowed"
        if not deviation / allowed <= worst[1] / worst[2]:
            worst = (name, float(deviation), float(allowed))
    return wrong, *worst


def judge(relation: Relation, before: Bake, after: Bake, wrong: dict[str, str], result: Result
          ) -> None:
    is_warned = any(says in text for says in relation.says for text in after.warnings)
    for name, text in wrong.items():
        is_named = relation.says and any(f'"{name}"' in warning and "too coarse" not in warning
                                         for warning in after.warnings)
        (result.said if is_warned or is_named else result.failures).append(text)
    if not before.light.keys() & after.light.keys():
        result.failures.append("nothing is baked")
    result.balance, result.seconds = after.balance, after.seconds
    result.bundles = (before.bundles, after.bundles)
    share = relation.settings.get('target_error', 0.0) / SETTINGS['target_error']
    if not after.balance < BALANCE * max(share, 1.0):
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
        outcome = f"holds, or warned of in {', '.join(said)}"
    return f"| {name} | {len(counted)} | {' | '.join(cells)} | {outcome} |"


def all_scenes(quick: bool) -> list[str]:
    files = [path.stem for path in sorted(SCENES.glob("*.blend"))]
    return ([name for name in files if name in SMALL or not quick]
            + [f"room:{name}" for name in lamp_rooms.ROOMS])


def main(arguments: list[str]) -> None:
    parser = command_line.parser(__file__, __doc__)
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--quick", action="store_true", help="those of the tests, coarse rooms")
    parser.add_argument("--only", default="", help="relations, or rooms, with this in their name")
    parser.add_argument("--noise", action="store_true", help="the rooms' noise by seeds instead")
    options = parser.parse_args(arguments)
    raybundle.register()
    names = options.scenes or all_scenes(options.quick)
    cells = lamp_rooms.COARSE if options.quick else lamp_rooms.FINE
    if options.noise:
        rooms = [name.partition(":")[2] for name in names
                 if name.startswith("room:") and options.only in name]
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
    print("\n| relation | scenes | light: largest deviation and its limit | "
          "largest balance error | bundles, relative to before | |\n|---|---|---|---|---|---|")
    for relation in chosen:
        print(row(relation.name, results[relation.name]), flush=True)
    failed = sum(bool(result.failures) for entries in results.values() for result in entries)
    if failed:
        sys.exit(f"{failed} relations failed")


if __name__ == "__main__":
    main(command_line.arguments())
