# SPDX-License-Identifier: GPL-3.0-or-later
"""A short run of relations.py, which defines what is checked: the Cornell box and coarse rooms.

Seeds are fixed, so that the result of each relation is reproducible.
"""

import lamp_noise
import lamp_rooms
import pytest
import relations

pytestmark = pytest.mark.needs_library

QUICK = [relation for relation in relations.RELATIONS if relation.is_quick]
# Relations for each scene, in addition to a turn about all axes: those most likely to fail there.
CHOSEN = {
    # The only lamp is a mesh, so that the two excluded relations do not apply.
    "cornell_box": [relation.name for relation in QUICK if relation.name not in
                    ("each lamp split into two", "the sum of light sets")],
    "room:area_flush": ["each lamp split into two", "mirrored"],
    "room:panel": ["vertices moved by 1e-6", "quads triangulated"],
    "room:panel_on_wall": ["joined"],
    "room:two_panels": ["emissive meshes joined", "the sum of light sets"],
    "room:ring": ["faces in another order"],
    "room:sun": ["an object far away"],
    "room:subdivided": ["faces in another order", "mirrored", "the sum of light sets"],
}
TURN = "turned by (0.4, 0.7, 1.1)"
CASES = [(scene, relation) for scene, names in CHOSEN.items()
         for relation in relations.RELATIONS if relation.name in (TURN, *names)]


@pytest.fixture(scope="module")
def scenes():
    """Returns the scenes by name. Each keeps its bakes before any change."""
    return {name: relations.Scene(name, lamp_rooms.COARSE) for name in CHOSEN}


@pytest.mark.parametrize("scene, relation", CASES,
                         ids=[f"{scene}, {relation.name}" for scene, relation in CASES])
def test_relation(scenes, scene, relation):
    result = scenes[scene].measure(relation)
    if result.skipped:
        pytest.skip(result.skipped)
    assert result.failures == []


@pytest.mark.parametrize("room", ["area_near", "tube", "subdivided"])
def test_noise(room):
    target = lamp_noise.TARGETS[0]
    assert lamp_noise.measure(room, target, cells=lamp_rooms.COARSE).failures(target) == []


def test_all_relations_have_names_of_their_own():
    names = [relation.name for relation in relations.RELATIONS]
    assert len(set(names)) == len(names)
    assert {name for entry in CHOSEN.values() for name in entry} <= set(names)
