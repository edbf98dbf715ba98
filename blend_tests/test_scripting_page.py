# SPDX-License-Identifier: GPL-3.0-or-later
"""The examples of docs/scripting.md run, and do what the page says."""

import json
import re
from pathlib import Path

import bpy
import numpy as np
import pytest

from raybundle import preferences
from surface_error import read_colors
from test_light_sets import collection_of

pytestmark = pytest.mark.needs_library

PAGE = Path(__file__).parent.parent / "docs" / "scripting.md"
# Each example, with its heading.
EXAMPLES = [(section.partition("\n")[0], code)
            for section in re.split(r"^## ", PAGE.read_text(encoding="utf-8"), flags=re.M)
            for code in re.findall(r"```python\n(.*?)```", section, re.S)]


@pytest.fixture
def names(closed_box, new_object, new_light, new_material, monkeypatch, tmp_path):
    """Opens the scene that the page assumes, a lamp in a furnace without emission, and an empty
    folder. Returns the names that the first example defines."""
    addon = bpy.context.preferences.addons.new()
    addon.module = preferences.__package__
    monkeypatch.chdir(tmp_path)
    closed_box.data.materials[0] = new_material("Grey", (0.5,) * 3)
    new_object("Floor", [(-1, -1, -0.5), (1, -1, -0.5), (1, 1, -0.5), (-1, 1, -0.5)],
               [(0, 1, 2, 3)], new_material("White"))
    collection_of("Lamps", new_light("Lamp", 'POINT', 10.0))
    defined = {}
    run(EXAMPLES[0][1], defined)
    yield defined
    bpy.context.preferences.addons.remove(addon)


def run(code: str, names: dict[str, object]) -> None:
    exec(compile(code, str(PAGE), 'exec'), names)


def run_section(heading: str, names: dict[str, object]) -> None:
    """Runs the examples below a heading."""
    found = [code for other, code in EXAMPLES if other == heading]
    assert found
    for code in found:
        run(code, names)


def light(attribute: str = "Radiosity") -> np.ndarray:
    return read_colors(bpy.data.objects["Floor"], attribute)


@pytest.mark.parametrize("code", [code for _, code in EXAMPLES[1:]],
                         ids=[heading for heading, _ in EXAMPLES[1:]])
def test_an_example_runs(code, names):
    run(code, names)


def test_the_import_finds_the_module(names):
    assert names['raybundle'].__name__ == preferences.__package__


def test_settings_of_a_call_apply_to_one_bake(names):
    run_section("Baking", names)
    settings = bpy.context.scene.raybundle
    assert settings.output == 'LIGHTING' and settings.quality == 'DRAFT'
    assert bpy.data.objects["Floor"].raybundle.role == 'OCCLUDE'
    assert names['report'] == json.loads(settings.report)


def test_errors_have_a_message(names, capsys):
    run_section("Errors", names)
    assert "The colour attribute has no name" in capsys.readouterr().out


def test_a_bake_is_cancelled_at_the_deadline(names, capsys):
    code = next(code for heading, code in EXAMPLES if heading == "Progress and cancelling")
    assert "+ 10.0" in code
    run(code.replace("+ 10.0", "- 1.0"), names)
    assert "The bake was cancelled" in capsys.readouterr().out
    assert not bpy.data.objects["Floor"].data.color_attributes


def test_the_loop_reuses_the_lines(names):
    run_section("Relighting in a loop", names)
    assert 'UNCHANGED_GEOMETRY' in {item['id'] for item in names['report'].skipped}
    for power in (2, 3):
        assert light(f"Light {50 * power} W") == pytest.approx(power * light("Light 50 W"),
                                                               rel=1e-3)


def test_a_light_set_has_its_attribute(names):
    run_section("Light sets", names)
    # The lamp is the only light.
    assert light("Radiosity Evening") == pytest.approx(light(), rel=1e-3)


def test_the_light_is_exported_and_shown(names):
    run_section("Materials and export", names)
    assert Path("room.glb").read_bytes()[:4] == b"glTF"
    assert any(node.type == 'VERTEX_COLOR'
               for node in bpy.data.materials["White"].node_tree.nodes)


def test_all_files_of_a_folder_are_baked(names):
    rooms = Path("rooms").resolve()
    rooms.mkdir()
    for name in ("one", "two"):
        bpy.ops.wm.save_as_mainfile(filepath=str(rooms / f"{name}.blend"), copy=True)
    run_section("Many files, without a window", names)
    assert sorted(path.name for path in Path("baked").iterdir()) == ["one.blend", "two.blend"]
    bpy.ops.wm.open_mainfile(filepath=str(Path("baked").resolve() / "two.blend"))
    assert light().min() > 0.0
