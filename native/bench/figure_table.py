# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures that compare methods: the bakes that each figure needs, and the diagrams that it
shows.

A run is a line of settings for `compare`. Runs with the same label form one curve. To add a figure,
add a row to FIGURES.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass

# About the number of patches of the office in the thesis (3818), equal for all methods. Without
# contacts=0 only LINE_REUSE would cut patches beside narrow gaps.
PATCHES = "max_patches=4000 contacts=0"
# Lines per bundle in the thesis.
LINES = 10_000
SHARED = f"{PATCHES} lines_per_bundle={LINES}"

# Name of each exported scene -> name of its .blend file, collections to show, collections to hide.
SCENES: dict[str, tuple[str, list[str], list[str]]] = {
    'cornell_box': ('cornell_box', [], []),
    'office_down': ('office', ['lamps_down'], ['lamps_up']),
    'office_up': ('office', ['lamps_up'], ['lamps_down']),
    'big_room': ('big_room', [], []),
    'two_rooms': ('two_rooms', [], []),
    'facing_squares': ('facing_squares', [], []),
    'furnace': ('furnace', [], []),
    'house_on_plain': ('house_on_plain', [], []),
    'instances': ('instances', [], []),
    'laid_table': ('laid_table', [], []),
    'open_court': ('open_court', [], []),
    'sphere_interior': ('sphere_interior', [], []),
    'thin_wall': ('thin_wall', [], []),
}

ALL, UNLIT, INDIRECT = 'error', 'error_unlit', 'error_indirect'


@dataclass(frozen=True)
class Panel:
    """A diagram for each scene: y as a function of x. Both are keys of AXES in plot.py."""

    x: str
    y: str


@dataclass(frozen=True)
class Figure:
    name: str  # file name of the picture and of the results
    title: str
    claim: str  # what the thesis claims, for the summary
    scenes: tuple[str, ...]
    runs: list[str]
    panels: tuple[Panel, ...]
    seeds: int = 3
    error: str = ALL  # key of the error that is drawn
    draws_table: bool = False  # whether a table of speed-ups replaces the diagrams


def run(label: str, settings: str, **values: object) -> str:
    pairs = " ".join(f"{name}={value}" for name, value in values.items())
    return f"label={label} {settings} {pairs}"


def even(number: float) -> int:
    return max(2, 2 * round(number / 2))


def over_bundles(label: str, settings: str, counts: Iterable[int]) -> list[str]:
    return [run(label, settings, min_bundles=n, max_bundles=n) for n in counts]


MULTIPATH = "solver=MULTIPATH directions=RANDOM"
ITERATION = "solver=STOCHASTIC_ITERATION directions=RANDOM"
WALK = "solver=RANDOM_WALK directions=RANDOM"
REUSE = "solver=LINE_REUSE"

# --------------------------------------------------------------------------------------------------
# Chapter 3: first shots
# --------------------------------------------------------------------------------------------------

TOTAL_LINES = (50_000, 100_000, 200_000, 400_000, 800_000)
# Mean reflectance of the thesis' scene. The scenes here have a similar mean.
MEAN_REFLECTANCE = 0.577


def first_shots(ratio: float, share_of_lamps: float) -> list[str]:
    """Returns runs in which the sum of local and global lines is equal for all methods.

    ratio: ratio of local to global lines by eq. 3.1, for the plain first shot. share_of_lamps:
    measured share of the local lines of EXTENDED that start at the lamps.
    """
    runs = []
    for total in TOTAL_LINES:
        for label, kind, local_per_global, share in (
                ("first_shot+multipath", 'SHOOT', ratio, 1.0),
                ("extended+multipath", 'EXTENDED', 1.06, share_of_lamps)):
            local = total * local_per_global / (1.0 + local_per_global)
            lines = even(total - local)
            # Single global lines, as in the thesis: a bundle is one line.
            runs.append(run(label, f"{PATCHES} {MULTIPATH}", first_shot=kind, lines_per_bundle=1,
                            local_rays=round(share * local), min_bundles=lines, max_bundles=lines,
                            x=total))
        # Paths from the lamps: SHOOT creates the first line of each path, the walk the others. A
        # path has 1 / (1 - R) lines on average, and the share R of the first lines continues.
        first = total * (1.0 - MEAN_REFLECTANCE)
        walks = even(first * MEAN_REFLECTANCE / 1000)
        runs.append(run("local_walk", f"{PATCHES} {WALK}", first_shot='SHOOT',
                        local_rays=round(first), lines_per_bundle=1000, min_bundles=walks,
                        max_bundles=walks, x=total))
    return runs


FIRST_SHOT_PANELS = (Panel('x', 'noise'), Panel('seconds', 'noise'))

# --------------------------------------------------------------------------------------------------
# The other runs
# --------------------------------------------------------------------------------------------------


def pixel_areas() -> list[str]:
    total = 1_000_000
    runs = []
    for label, settings in (("multipath_literal", f"{MULTIPATH} thesis_literal=1"),
                            ("multipath", MULTIPATH), ("line_reuse", REUSE)):
        for lines in (100_000, 31_600, 10_000, 3_160, 1_000, 316, 100):
            n = even(total / lines)
            runs.append(run(label, f"{PATCHES} {settings}", lines_per_bundle=lines, min_bundles=n,
                            max_bundles=n))
    return runs


def bundle_counts() -> list[str]:
    counts = (30, 50, 70, 100, 150, 200, 300, 500)
    runs = []
    for label, settings in (("multipath", MULTIPATH), ("stochastic_iteration", ITERATION),
                            ("multipath_literal", f"{MULTIPATH} thesis_literal=1"),
                            ("line_reuse,random", f"{REUSE} directions=RANDOM"),
                            ("line_reuse", REUSE)):
        runs += over_bundles(label, f"{SHARED} {settings}", counts)
    return runs


def against_local_walk() -> list[str]:
    return (over_bundles("multipath", f"{SHARED} {MULTIPATH}", (25, 50, 100, 200, 400, 800))
            + over_bundles("local_walk", f"{SHARED} {WALK}", (2, 4, 8, 16, 32, 64, 128))
            + over_bundles("line_reuse", f"{SHARED} {REUSE}", (25, 50, 100, 200, 400)))


def adaptive() -> list[str]:
    counts = (50, 100, 200, 400)
    return (over_bundles("random", f"{SHARED} {MULTIPATH}", counts)
            + over_bundles("adaptive", f"{SHARED} solver=MULTIPATH directions=ADAPTIVE", counts))


def small_patches() -> list[str]:
    runs = []
    for small in ('CENTRE_SAMPLING', 'ROULETTE'):
        for label, settings in (("multipath", MULTIPATH), ("line_reuse", REUSE)):
            for lines in (100, 316, 1_000, 3_160, 10_000):
                runs.append(run(f"{label},{small.lower()}",
                                f"{PATCHES} {settings} small_patches={small}",
                                lines_per_bundle=lines, min_bundles=400, max_bundles=400))
    return runs


def thread_counts() -> list[int]:
    cores = len(os.sched_getaffinity(0))
    return sorted({1, cores} | {2 ** k for k in range(1, 8) if 2 ** k < cores})


def speed_up() -> list[str]:
    runs = []
    for threads in thread_counts():
        for n in (50, 100, 200):
            runs.append(run(f"{n}_bundles", f"{SHARED} {MULTIPATH} first_shot=SHOOT",
                            local_rays=1_000_000, min_bundles=n, max_bundles=n, threads=threads))
    return runs


def projectors(counts: tuple[int, ...]) -> list[str]:
    runs = []
    for label, kind in (("painter", 'PAINTER'), ("plane", 'PLANE'),
                        ("fragment_lists", 'FRAGMENT_LISTS')):
        runs += over_bundles(label, f"{SHARED} {MULTIPATH} projector={kind}", counts)
    return runs


def projectors_after_a_shot() -> list[str]:
    runs = []
    for label, kind in (("painter", 'PAINTER'), ("plane", 'PLANE')):
        runs += over_bundles(label, f"{SHARED} {MULTIPATH} projector={kind} first_shot=SHOOT "
                             "local_rays=100000", (100, 200, 400, 800, 1600))
    return runs


def coherence() -> list[str]:
    runs = []
    for label, coherent in (("without_coherence", 0), ("with_coherence", 1)):
        for planes in (1, 2, 4, 8, 16):
            runs.append(run(label, f"{SHARED} {MULTIPATH} projector=PLANES", plane_count=planes,
                            plane_coherence=coherent, min_bundles=100, max_bundles=100, x=planes))
    return runs


def placements() -> list[str]:
    counts = (50, 100, 200, 400, 800)
    runs = over_bundles("fragment_lists", f"{SHARED} {MULTIPATH}", counts)
    for placement in ('STRATIFIED', 'SYSTEMATIC', 'CLOSE_DISTANCE'):
        runs += over_bundles(placement.lower(), f"{SHARED} {MULTIPATH} projector=PLANES "
                             f"plane_count=4 plane_placement={placement}", counts)
    return runs


def all_methods() -> list[str]:
    counts = (32, 128, 512, 1024, 4096)
    runs = []
    for label, settings in (
            ("line_reuse_(default)", REUSE),
            ("line_reuse,random", f"{REUSE} directions=RANDOM"),
            ("line_reuse,planes", f"{REUSE} projector=PLANES"),
            ("multipath", MULTIPATH),
            ("multipath,adaptive", "solver=MULTIPATH directions=ADAPTIVE"),
            ("multipath,painter", f"{MULTIPATH} projector=PAINTER"),
            ("multipath,newell", f"{MULTIPATH} projector=PAINTER_NEWELL"),
            ("multipath,plane", f"{MULTIPATH} projector=PLANE"),
            ("multipath,planes", f"{MULTIPATH} projector=PLANES"),
            ("stochastic_iteration", ITERATION)):
        # With more bundles LINE_REUSE would come too close to the reference. Newell's tests are
        # slow.
        most = 512 if "NEWELL" in settings else 1024 if "LINE_REUSE" in settings else 4096
        runs += over_bundles(label, f"{PATCHES} {settings}", [n for n in counts if n <= most])
    for n in counts[:4]:
        # The number of rays from the lamps grows with that of the bundles, so that neither
        # dominates the error.
        for label, kind in (("first_shot+multipath", 'SHOOT'), ("extended+multipath", 'EXTENDED')):
            runs.append(run(label, f"{PATCHES} {MULTIPATH}", first_shot=kind,
                            local_rays=4_000 * n, min_bundles=n, max_bundles=n))
        runs.append(run("random_walk", f"{PATCHES} {WALK}", lines_per_bundle=LINES,
                        min_bundles=even(n / 8), max_bundles=even(n / 8)))
    return runs


ERROR_AND_TIME = (Panel('bundles', 'noise'), Panel('bundles', 'seconds_bundles'))

FIGURES: tuple[Figure, ...] = (
    Figure('fig_3_7', "Figs 3.7 and 3.8: first shots, lamps to the ceiling",
           "the extended first shot and the local walk are alike, and better than the first shot",
           ('office_up',), first_shots(0.41, 0.67), FIRST_SHOT_PANELS),
    Figure('fig_3_9', "Fig. 3.9: first shots, lamps to the floor",
           "first shot and extended first shot are alike, and better than the local walk",
           ('office_down',), first_shots(0.85, 0.79), FIRST_SHOT_PANELS),
    Figure('fig_4_14', "Fig. 4.14: pixel area, one million lines in all",
           "the error is level below a pixel area of one mean patch; small bundles take longer",
           ('office_down',), pixel_areas(),
           (Panel('pixel_per_patch', 'noise'), Panel('pixel_per_patch', 'seconds_bundles')),
           error=INDIRECT),
    Figure('fig_4_17', "Figs 4.15 to 4.17: number of bundles",
           "multipath and stochastic iteration are alike in error and time; 100 to 200 bundles do",
           ('office_down',), bundle_counts(), ERROR_AND_TIME, error=INDIRECT, seeds=4),
    Figure('fig_4_19', "Figs 4.18 and 4.19: against local walks, where no lamp shines",
           "at equal time multipath lights the ceiling with much less noise than the local walk",
           ('big_room', 'office_down'), against_local_walk(), (Panel('seconds', 'noise'),),
           error=UNLIT),
    Figure('fig_4_20', "Fig. 4.20: adaptive directions, lamps to the ceiling",
           "much better than without at 200 bundles, at no cost worth mentioning",
           ('office_up',), adaptive(), ERROR_AND_TIME, seeds=8, error=INDIRECT),
    Figure('fig_4_24', "Fig. 4.24: patches smaller than a pixel",
           "roulette removes the error of small patches and costs 2 %",
           ('office_down',), small_patches(),
           (Panel('pixel_per_patch', 'noise'), Panel('pixel_per_patch', 'bias'),
            Panel('pixel_per_patch', 'seconds_bundles')), error=INDIRECT),
    Figure('table_5_1', "Table 5.1: speed-up",
           "efficiency on 2 processors: 0.91, 0.97 and 0.98 for 50, 100 and 200 bundles",
           ('office_down',), speed_up(), (), seeds=5, draws_table=True),
    Figure('fig_6_6', "Fig. 6.6: one representative plane against the painter",
           "the same error per bundle, a little more at contacts; 7 times faster on hardware",
           ('big_room',), projectors((50, 100, 200, 400, 800, 1600)), ERROR_AND_TIME,
           error=INDIRECT, seeds=2),
    Figure('fig_6_6_shot', "Fig. 6.6 with the noise of a first shot of 100,000 rays",
           "the same error per bundle",
           ('big_room',), projectors_after_a_shot(), (Panel('bundles', 'noise'),), seeds=3),
    Figure('fig_6_8', "Fig. 6.8: one representative plane against the painter",
           "6 times faster on hardware",
           ('office_down',), projectors((100, 300, 1000)), ERROR_AND_TIME, error=INDIRECT,
           seeds=2),
    Figure('fig_6_14', "Section 6.3: coherence between planes, 100 bundles",
           "coherence saves 50 % of the time with 4 planes",
           ('big_room', 'office_down'), coherence(),
           (Panel('planes', 'seconds_bundles'), Panel('planes', 'noise')), error=INDIRECT),
    Figure('fig_7_3_5', "Section 7.3.5: where planes are placed",
           "proposed there, not measured",
           ('office_down',), placements(), ERROR_AND_TIME, error=INDIRECT, seeds=2),
    Figure('all_methods', "All methods", "",
           ('cornell_box', 'office_up', 'office_down', 'big_room', 'two_rooms'), all_methods(),
           (Panel('seconds', 'noise'),), seeds=2),
)
