# SPDX-License-Identifier: GPL-3.0-or-later
"""The script behind the ./bake command, run as the command runs it: in a Blender of its own."""

import json
import subprocess
from pathlib import Path

import bpy
import numpy as np
import pytest

pytestmark = [pytest.mark.needs_library,
              pytest.mark.skipif(not bpy.app.binary_path, reason="Blender is a module here")]

SCRIPT = Path(__file__).parent.parent / "addon" / "bake_file.py"


def bake_file(path, *arguments):
    return subprocess.run(
        [bpy.app.binary_path, "-b", "--factory-startup", str(path), "--python-exit-code", "1",
         "-P", str(SCRIPT), "--", *map(str, arguments)],
        capture_output=True, text=True, timeout=120)


@pytest.fixture
def saved_box(closed_box, tmp_path):
    # Without a camera: the script places one.
    path = tmp_path / "box.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def test_writes_blend_picture_and_report(saved_box, tmp_path):
    original = saved_box.read_bytes()
    out = tmp_path / "out"
    result = bake_file(saved_box, "--out", out, "--set", "max_patches=500", "domain=POINT",
                       "--set", "attribute=Light")
    assert result.returncode == 0, result.stderr
    assert "1 objects baked" in result.stdout and "bundles" in result.stdout
    assert saved_box.read_bytes() == original
    report = json.loads((out / "box.json").read_text())
    for item in report["objects"]:
        assert set(item.pop("error")) == set(report["error"])
    assert report["objects"] == [{"name": "Box", "corners": 24, "status": "baked"}]

    picture = bpy.data.images.load(str(out / "box.png"))
    assert picture.size[0] <= 960 and picture.size[1] <= 720
    pixels = np.array(picture.pixels[:]).reshape(-1, 4)[:, :3]
    # The background is black, the box is lit.
    assert pixels.min() < 0.1 and pixels.max() > 0.5

    bpy.ops.wm.open_mainfile(filepath=str(out / "box.baked.blend"))
    item = bpy.data.objects["Box"]
    attribute = item.data.color_attributes["Light"]
    assert (attribute.domain, attribute.data_type) == ('POINT', 'FLOAT_COLOR')
    # What the picture needs is not in the file.
    assert [material.name for material in bpy.data.materials] == ["Furnace"]
    assert len(bpy.data.cameras) == 0
    assert json.loads(bpy.context.scene.raybundle.report)["patches"] == report["patches"]


# Said by Blender where /etc/mtab is missing, as in a bare container.
BLENDERS_OWN_LINE = "could not get a list of mounted file-systems"


@pytest.mark.parametrize("arguments, message", [
    (["--set", "skip.nothing=0"], "skip.nothing"),
    (["--set", "no_such=1"], "no_such"),
    (["--set", "solver=MAGIC"], "MAGIC"),
    (["--set", "seed"], "name=value"),
])
def test_errors_are_one_line_and_exit_code_1(saved_box, tmp_path, arguments, message):
    result = bake_file(saved_box, "--out", tmp_path / "out", *arguments)
    assert result.returncode == 1
    lines = [line for line in result.stderr.splitlines()
             if line.strip() and line != BLENDERS_OWN_LINE]
    assert len(lines) == 1 and lines[0].startswith("bake: ") and message in lines[0]
    assert not list((tmp_path / "out").glob("*"))


def test_a_file_with_nothing_to_bake(tmp_path):
    path = tmp_path / "empty.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    result = bake_file(path, "--out", tmp_path / "out")
    assert result.returncode == 1 and "bake: Nothing to bake" in result.stderr
