# SPDX-License-Identifier: GPL-3.0-or-later
"""Warnings in the report with equal text about several owners are merged into one line."""

import bpy
import pytest
import raybundle
from raybundle.warning_lines import grouped

MIRRORS = ': node "Glossy BSDF" (Glossy BSDF) reflects like a mirror: it counts as matt'
COPY_MIRRORS = MIRRORS.replace('"Glossy BSDF"', '"Glossy BSDF.001"')


@pytest.mark.parametrize("lines, expected", [
    ([], []),
    (["no owner", "no owner"], ["no owner"]),
    ([f'material "A"{MIRRORS}'], [f'material "A"{MIRRORS}']),
    ([f'material "A"{MIRRORS}', "other", f'material "B"{COPY_MIRRORS}'],
     [f'material "A", "B"{MIRRORS}', "other"]),
    ([f'material "A"{MIRRORS}', f'light "A"{MIRRORS}'],
     [f'material "A"{MIRRORS}', f'light "A"{MIRRORS}']),
    (['object "A": 3 faces lie on others', 'object "B": 4 faces lie on others'],
     ['object "A", "B": 7 faces lie on others']),
    (['"A" is left out: it has no faces', '"B" is left out: it has no faces'],
     ['"A", "B" is left out: it has no faces']),
    # If a name contains quotes, its end in the line is not known. Such lines are not merged.
    (['material "a "quoted" name" is black', 'material "B" is black'],
     ['material "a "quoted" name" is black', 'material "B" is black']),
])
def test_lines(lines, expected):
    assert grouped(lines) == expected


def test_all_of_many_are_counted():
    line, = grouped(f'material "{k}"{MIRRORS}' for k in range(45))
    assert line.startswith('material "0", "1", ') and f'and 33 more{MIRRORS}' in line


@pytest.mark.needs_library
def test_a_bake_says_it_once(new_object, new_material, new_light):
    new_light("Lamp", 'POINT', 100.0, (0, 0, 2))
    for k in range(3):
        item = new_object(f"Square {k}", [(3 * k, 0, 0), (3 * k + 2, 0, 0), (3 * k + 2, 2, 0),
                                          (3 * k, 2, 0)], [(0, 1, 2, 3), (0, 1, 2, 3)])
        item.data.materials.append(new_material(f"Grey {k}", (0.5, 0.5, 0.5)))
    report = raybundle.bake(bpy.context)
    line, = (text for text in report.warnings if "lie on others" in text)
    assert line.startswith('object "Square 0", "Square 1", "Square 2": 3 faces')
