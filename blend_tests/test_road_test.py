# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of road_test.py: rows of files that are baked, are refused, or are no .blend files."""

import shutil
from pathlib import Path

import bpy
import pytest
import road_test

SCENES = Path(__file__).parent.parent / "scenes"


@pytest.mark.needs_library
@pytest.mark.skipif(not bpy.app.binary_path, reason="it starts Blender as a program")
def test_a_folder(tmp_path, capsys):
    shutil.copy(SCENES / "cornell_box.blend", tmp_path)
    (tmp_path / "none.blend").write_text("this is no .blend file")
    table = tmp_path / "table.md"
    code = road_test.main([str(tmp_path), "--samples", "8", "--out", str(table)])
    lines = table.read_text().splitlines()
    assert code == 0 and len(lines) == 4 and table.read_text() in capsys.readouterr().out
    cells = [cell.strip() for cell in lines[2].split("|")]
    assert cells[1:3] == ["cornell_box.blend", "baked"] and cells[7].endswith(" of 7")
    assert "none.blend | Blender ended before the bake (1)" in lines[3]


@pytest.mark.parametrize("result, text, code, expected", [
    ({}, "", None, "**hang**"),
    ({}, "no .blend file", 1, "Blender ended before the bake (1): no .blend file"),
    ({'faces': 6}, "\nWriting: crash.txt\n", -11, "**crash** (-11): Writing: crash.txt"),
    ({}, "Error: Python: Traceback\nKeyError: 'x'\nError: script failed", 3,
     "**traceback**: KeyError: 'x'"),
    ({'refused': "no light"}, "", 0, "refused: no light"),
    ({'report': {}, 'wall': 9.0, 'objects': []}, "", 0, "baked"),
    ({'report': {}, 'wall': 9.0}, "", None, "baked; not compared in time"),
    ({'report': {}, 'wall': 99.0, 'objects': []}, "", 0, "baked, but in more than 60 s"),
])
def test_verdicts(result, text, code, expected):
    assert road_test.verdict(result, text, code, 60.0) == expected
