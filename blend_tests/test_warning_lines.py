# SPDX-License-Identifier: GPL-3.0-or-later
"""Warnings in the report with equal text about several owners are merged into one line."""

import bpy
import pytest
import raybundle
from raybundle.warning_lines import grouped, owners

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
    (['"A": 3 % of its values are cut off', '"B": 4 % of its values are cut off'],
     ['"A": 3 % of its values are cut off', '"B": 4 % of its values are cut off']),
    (['"A" is left out: it has no faces', '"B" is left out: it has no faces'],
     ['"A", "B" is left out: it has no faces']),
    # If a name contains quotes, its end in the line is not known. Such lines are not merged.
    (['material "a "quoted" name" is black', 'material "B" is black'],
     ['material "a "quoted" name" is black', 'material "B" is black']),
])
def test_lines(lines, expected):
    assert [group.text for group in grouped(lines)] == expected


def test_all_of_many_are_counted():
    group, = grouped(f'material "{k}"{MIRRORS}' for k in range(45))
    assert group.text.startswith('material "0", "1", ') and f'and 33 more{MIRRORS}' in group.text
    assert (group.kind, group.names) == ('material', tuple(map(str, range(45))))


@pytest.mark.parametrize("line, kind, names", [
    ('"Sphere" is left out: it has no faces', 'object', ("Sphere",)),
    ('object "A b": its faces are too coarse', 'object', ("A b",)),
    ('mesh "M" was shared by 3 baked objects', 'mesh', ("M",)),
    ('light "Sun": Raybundle ignores light linking', 'light', ("Sun",)),
    ('material "Wood": node "Noise" (Noise Texture) varies', 'material', ("Wood",)),
    ('some objects are noisier than twice the target of 2 %: object "A" (5 %), "B" (4.1 %) and 2 '
     'more (the report lists the noise of each object)', 'object', ("A", "B")),
    ('the largest part is in the light of Lamp on object "Crate". More bundles do not reduce it',
     'object', ("Crate",)),
    ('fewer than 20 lines meet each patch of "A", "B", so that the noise', 'object', ("A", "B")),
    ('Lights that are hidden only in the viewport give light. Lights: "L". Disable them', 'light',
     ("L",)),
    ('The viewport and renders show different geometry. Objects: "A" (Subsurf: levels 1 in '
     'viewport, 2 in renders), "B" (adaptive subdivision) and 3 more. Use', 'object', ("A", "B")),
    ('the materials "A", "B" and 5 more show the result of a bake', 'material', ("A", "B")),
    ('object "A": the strands of its particle system "Hair" neither block', 'object', ("A",)),
    ('world "World": its volume neither absorbs', "", ()),
    ('image "Wood" contains pixels', "", ()),
    ("max_bundles was reached at 64 bundles", "", ()),
])
def test_owners_of_a_line(line, kind, names):
    assert owners(line) == (kind, names)


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
    assert len(report.warning_owners) == len(report.warnings)
    assert report.warning_owners[report.warnings.index(line)] == {
        'id': 'DOUBLED_FACES', 'kind': 'object', 'names': ["Square 0", "Square 1", "Square 2"]}
    assert 'DOUBLED_FACES' in report.warning_ids
