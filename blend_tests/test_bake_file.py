# SPDX-License-Identifier: GPL-3.0-or-later
"""The script of the ./bake command (bake_file.py), run in a Blender process of its own."""

import json
import os
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
    # The file has no camera, so that the script must place one.
    path = tmp_path / "box.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def test_writes_blend_picture_and_report(saved_box, tmp_path):
    original = saved_box.read_bytes()
    out = tmp_path / "out"
    result = bake_file(saved_box, "--out", out, "--set", "max_patches=500", "domain=POINT",
                       "--set", "attribute=Light")
    assert result.returncode == 0, result.stderr
    assert "1 object baked" in result.stdout and "bundles" in result.stdout
    assert saved_box.read_bytes() == original
    report = json.loads((out / "box.json").read_text())
    for item in report["objects"]:
        assert set(item.pop("error")) == set(report["error"])
    assert report["objects"] == [{"name": "Box", "corners": 24, "status": "baked", "vertices": 8,
                                  "adaptive_vertices": 0}]

    picture = bpy.data.images.load(str(out / "box.png"))
    assert picture.size[0] <= 960 and picture.size[1] <= 720
    pixels = np.array(picture.pixels[:]).reshape(-1, 4)[:, :3]
    # The background of the picture is black, and the box is lit.
    assert pixels.min() < 0.1 and pixels.max() > 0.5

    bpy.ops.wm.open_mainfile(filepath=str(out / "box.baked.blend"))
    item = bpy.data.objects["Box"]
    attribute = item.data.color_attributes["Light"]
    assert (attribute.domain, attribute.data_type) == ('POINT', 'FLOAT_COLOR')
    # The file must not contain the camera and the material with which the picture is rendered.
    assert [material.name for material in bpy.data.materials] == ["Furnace"]
    assert len(bpy.data.cameras) == 0
    assert json.loads(bpy.context.scene.raybundle.report)["patches"] == report["patches"]


# Blender prints this line where /etc/mtab is missing, as in a minimal container.
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


# --------------------------------------------------------------------------------------------------
# Typical files of users
# --------------------------------------------------------------------------------------------------


def save_edited(path):
    bpy.context.view_layer.objects.active = bpy.data.objects["Box"]
    bpy.ops.object.mode_set(mode='EDIT')
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def save_bare(path):
    """Saves a file without camera, light and materials.

    It contains an object that is linked from another file, and an instance of a collection that
    contains this object.
    """
    item = bpy.data.objects["Box"]
    item.data.materials.clear()
    library = path.with_name("library.blend")
    bpy.data.libraries.write(str(library), {item})
    with bpy.data.libraries.load(str(library), link=True) as (_, linked):
        linked.objects = ["Box"]
    collection = bpy.data.collections.new("Linked")
    collection.objects.link(linked.objects[0])
    bpy.context.scene.collection.objects.link(linked.objects[0])
    instancer = bpy.data.objects.new("Instancer", None)
    instancer.instance_type, instancer.instance_collection = 'COLLECTION', collection
    bpy.context.scene.collection.objects.link(instancer)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


@pytest.mark.parametrize("save", [save_edited, save_bare])
def test_a_picture_of_files_as_people_have_them(closed_box, tmp_path, save):
    path, out = tmp_path / "file.blend", tmp_path / "out"
    save(path)
    result = bake_file(path, "--out", out, "--set", "max_patches=500")
    assert result.returncode == 0, result.stderr
    assert "Traceback" not in result.stderr and "no picture" not in result.stdout
    assert "1 object baked" in result.stdout and f"wrote {out / 'file.png'}" in result.stdout
    assert {path.suffix for path in out.iterdir()} == {".blend", ".json", ".png"}


def test_a_picture_that_cannot_be_made_is_a_line(saved_box, tmp_path):
    out = tmp_path / "out"
    # A folder of this name prevents the picture from being written.
    (out / "box.png").mkdir(parents=True)
    result = bake_file(saved_box, "--out", out, "--set", "max_patches=500")
    assert result.returncode == 0, result.stderr
    assert "Traceback" not in result.stderr
    assert "1 object baked" in result.stdout
    lines = [line for line in result.stdout.splitlines() if line.startswith("  no picture: ")]
    assert len(lines) == 1 and "box.png" in lines[0]
    assert "wrote " + str(out / "box.png") not in result.stdout
    assert json.loads((out / "box.json").read_text())["patches"] > 0


def test_a_folder_that_cannot_be_written_is_said_before_the_bake(saved_box):
    result = bake_file(saved_box, "--out", saved_box / "out")
    assert result.returncode == 1
    lines = [line for line in result.stderr.splitlines() if line.startswith("bake: ")]
    assert len(lines) == 1 and str(saved_box) in lines[0]
    assert "bundles" not in result.stdout


def test_blender_starts_in_a_shell_with_another_python(tmp_path):
    # An empty Python environment comes first on PATH, like an active virtual environment.
    folder = tmp_path / "venv" / "bin"
    folder.mkdir(parents=True)
    (folder.parent / "pyvenv.cfg").write_text("home = /usr/bin\nversion = 3.11\n")
    for name in ("python", "python3"):
        (folder / name).symlink_to("/usr/bin/python3")
    environment = {**os.environ, "PATH": f"{folder}:{os.environ['PATH']}",
                   "VIRTUAL_ENV": str(folder.parent), "PYTHONHOME": str(folder.parent),
                   "PYTHONPATH": str(folder), "BLENDER": bpy.app.binary_path}
    script = (f'. {SCRIPT.parent.parent / "setup.sh"}; use_own_environment; '
              'exec "$blender" -b --factory-startup --python-exit-code 1 --python-expr '
              '"import numpy; print(\'numpy is there\')"')
    result = subprocess.run(["bash", "-c", script], env=environment, capture_output=True, text=True,
                            timeout=60)
    assert result.returncode == 0 and "numpy is there" in result.stdout, result.stderr
