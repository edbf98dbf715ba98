# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Last Bake, its warnings, and the buttons beside them."""

import json

import bpy
import numpy as np
import pytest
import raybundle
from drawn_layout import drawn
from raybundle import error_view, report_panel
from raybundle.report_data import left_out_objects, read_report, time_text, warning_lines
from raybundle.report_remedies import advised_settings, is_applied

SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)]
COARSE = ('object "floor": its faces, 1.5 m wide on average, are too coarse for its light. Edges '
          'of about 0.1 m would reduce the error to 5 %; subdivide the mesh, or choose the '
          'topology SUBDIVIDE with patch_size 0.05 m')
UNLIT = ('object "floor": almost no light reaches the baked sides of the faces, but the other '
         'sides are lit; flip the normals, or bake the other side')
SOLVER = ('material "glass": solver MULTIPATH does not send the light on; choose solver LINE_REUSE '
          'and first_shot GATHER')
CUT_OFF = ('"floor": 3 % of its values are brighter than 1 and were cut off: choose the data type '
           'Color to keep them, or lower the exposure')
# A report as the first release wrote it.
OLDEST = {'seconds': {'total': 1.0}, 'patches': 100, 'bundles': 64, 'objects': [], 'skipped': [],
          'warnings': [COARSE, SOLVER]}


def settings() -> bpy.types.PropertyGroup:
    return bpy.context.scene.raybundle


def store(*warnings: str, **values) -> list:
    """Stores a report with these warnings, and returns them as they are drawn."""
    settings().report = json.dumps({**OLDEST, 'warnings': warnings, **values})
    return warning_lines(read_report(bpy.context.scene))


def owned(*entries: tuple) -> list[dict]:
    """Returns the owners of warnings, each an identifier, a kind and names."""
    return [{'id': identifier, 'kind': kind, 'names': names} for identifier, kind, names in entries]


def buttons(panel: type = report_panel.RAYBUNDLE_PT_warnings) -> dict[str, bool]:
    """Returns the operators that a panel shows, and whether they are enabled."""
    return {arguments[0]: layout.enabled for method, arguments, _, layout, _ in
            drawn(panel).record if method == 'operator'}


@pytest.fixture
def floor(new_object, new_material):
    return new_object("floor", *SQUARE, new_material("glass"))


# --------------------------------------------------------------------------------------------------
# The panels
# --------------------------------------------------------------------------------------------------


def test_there_is_no_panel_without_a_report():
    for panel in (report_panel.RAYBUNDLE_PT_last_bake, report_panel.RAYBUNDLE_PT_warnings,
                  report_panel.RAYBUNDLE_PT_mesh_error, report_panel.RAYBUNDLE_PT_left_out,
                  report_panel.RAYBUNDLE_PT_skipped):
        assert not panel.poll(bpy.context)
    settings().report = "no JSON"
    assert not report_panel.RAYBUNDLE_PT_last_bake.poll(bpy.context)


def test_a_report_of_the_first_release_is_drawn(floor):
    settings().report = json.dumps(OLDEST)
    assert drawn(report_panel.RAYBUNDLE_PT_last_bake).texts() == [
        "Time", "1 s", "Patches", "100", "Bundles", "64"]
    assert "raybundle.apply_advice" in buttons()


@pytest.mark.needs_library
def test_a_bake_is_drawn_with_the_unit_of_the_field(closed_box):
    raybundle.bake(bpy.context, target_error=0.05)
    texts = drawn(report_panel.RAYBUNDLE_PT_last_bake).texts()
    assert texts[::2] == ["Time", "Stated Error", "Noise", "Discretisation", "Mesh", "Patches",
                          "Bundles"]
    assert all(text.endswith(" %") for text in texts[3:11:2])
    skipped = " ".join(drawn(report_panel.RAYBUNDLE_PT_skipped).texts())
    for item in read_report(bpy.context.scene)['skipped']:
        assert item['what'].split()[0] in skipped


def test_the_noisiest_object_is_named():
    def entry(name, noise):
        return {'name': name, 'corners': 4, 'status': "baked",
                'error': {'noise': noise} if noise else {}}
    store(objects=[entry("A", 0.02), entry("B", 0.0312), entry("C", None)])
    assert drawn(report_panel.RAYBUNDLE_PT_last_bake).texts()[2:4] == [
        "Noisiest", "3.1 %, B"]
    store(objects=[entry("A", 0.02)])
    assert "Noisiest" not in drawn(report_panel.RAYBUNDLE_PT_last_bake).texts()


def mesh_entry(name: str, error: float, vertices: int, adaptive: int) -> dict:
    return {'name': name, 'corners': 4, 'status': "baked", 'error': {'noise': 0.01, 'mesh': error},
            'vertices': vertices, 'adaptive_vertices': adaptive}


def test_meshes_that_lose_light_are_listed(floor):
    panel = report_panel.RAYBUNDLE_PT_mesh_error
    store(objects=[mesh_entry("B", 0.031, 1200, 0), mesh_entry("floor", 0.16, 4, 1310),
                   mesh_entry("C", 0.019, 8, 8), mesh_entry("A", 0.031, 1200, 1200),
                   {'name': "D", 'corners': 0, 'status': "hidden in renders", 'error': {}}])
    assert settings().target_error == pytest.approx(0.02) and panel.poll(bpy.context)
    layout = drawn(panel)
    assert [text for text in layout.texts() if text] == [
        "floor", "16 %", "4 \N{RIGHTWARDS ARROW} 1,310", "A", "3.1 %", "1,200", "B", "3.1 %",
        "1,200"]
    enabled = [made.enabled for method, _, _, made, _ in layout.record if method == 'operator']
    assert enabled == [True, False, False]
    assert layout.props() == ["count_adaptive"]
    assert drawn(panel, method='draw_header_preset').texts() == ["3  "]
    # One button chooses the topology.
    assert [arguments[1:] for method, arguments, *_ in layout.record if method == 'prop_enum'] == [
        ("topology", 'ADAPTIVE')]
    settings().target_error = 0.2
    assert not panel.poll(bpy.context)
    store(objects=[{'name': "old", 'corners': 4, 'status': "baked", 'error': {'mesh': 0.3}}])
    assert drawn(panel).texts()[:3] == ["old", "30 %", "0"]


def test_many_meshes_that_lose_light_are_counted():
    store(objects=[mesh_entry(str(k), 0.1, 4, 0) for k in range(60)])
    assert "and 10 more" in drawn(report_panel.RAYBUNDLE_PT_mesh_error).texts()


def test_warnings_are_in_lines():
    store(COARSE)
    texts = drawn(report_panel.RAYBUNDLE_PT_warnings).texts()
    assert len(texts) > 3 and max(map(len, texts)) < 80
    header = drawn(report_panel.RAYBUNDLE_PT_warnings, method='draw_header_preset')
    assert header.texts() == ["1  "]


def test_objects_left_out_are_listed_with_the_reason(floor):
    store(objects=[{'name': "floor", 'corners': 0, 'status': "hidden in renders", 'error': {}},
                   {'name': "B", 'corners': 4, 'status': "baked", 'error': {}}])
    assert left_out_objects(read_report(bpy.context.scene)) == [("floor", "hidden in renders")]
    assert drawn(report_panel.RAYBUNDLE_PT_left_out).texts()[0] == "floor: hidden in renders"
    assert buttons(report_panel.RAYBUNDLE_PT_left_out) == {"raybundle.select_named": True}


def test_many_objects_left_out_are_counted():
    store(objects=[{'name': str(k), 'corners': 0, 'status': "hidden", 'error': {}}
                   for k in range(60)])
    assert drawn(report_panel.RAYBUNDLE_PT_left_out).texts()[-1] == "and 10 more"


@pytest.mark.parametrize("seconds, text", [
    (0.0123, "0.012 s"), (0.5, "0.5 s"), (1.999, "2 s"), (12.4, "12 s"), (99.9, "100 s"),
    (150.0, "2 min"), (5000.0, "83 min"), (7300.0, "2.0 h")])
def test_times(seconds, text):
    assert time_text(seconds) == text


# --------------------------------------------------------------------------------------------------
# Advice
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("text, advised", [
    (COARSE, {'topology': 'SUBDIVIDE', 'patch_size': 0.05}),
    (COARSE.rpartition("SUBDIVIDE")[0] + "ADAPTIVE", {'topology': 'ADAPTIVE'}),
    (SOLVER, {'solver': 'LINE_REUSE', 'first_shot': 'GATHER'}),
    (CUT_OFF, {'data_type': 'FLOAT_COLOR'}),
    (UNLIT, {}),
    ("lines met surfaces in a wrong order; choose projector AUTO and small_patches "
     "CENTRE_SAMPLING", {'projector': 'AUTO', 'small_patches': 'CENTRE_SAMPLING'}),
    # A choice that this release does not have.
    ("choose solver MAGIC", {}),
])
def test_advice_of_texts(text, advised):
    line, = store(text)
    assert advised_settings(line, settings()) == advised


@pytest.mark.parametrize("reached, present, advised", [
    (64, 64, 256), (64, 1000, 1000), (2 ** 23, 2 ** 23, 2 ** 24)])
def test_more_bundles_are_advised(reached, present, advised):
    line, = store(f"max_bundles was reached at {reached} bundles: the noise is 5 %; the target is "
                  f"2 %. Increase max_bundles to reach the target")
    settings().max_bundles = present
    assert advised_settings(line, settings()) == {'max_bundles': advised}


@pytest.mark.parametrize("target, present, advised", [
    (10, 0.1, 0.05), (10, 0.02, 0.02), (0.06, 0.0006, 0.0005)])
def test_half_the_noise_is_advised(target, present, advised):
    line, = store(f'some objects are noisier than twice the target of {target} %: object "shelf" '
                  f'(23 %); lower target_error, or increase max_bundles if the bake reached it')
    settings().target_error = present
    assert advised_settings(line, settings()) == {'target_error': pytest.approx(advised)}


def test_less_noise_is_not_advised_if_it_is_out_of_reach():
    line, = store('some objects are noisier than twice the target of 2 %: object "shelf" (5 %). '
                  'Only few lines bring light to these objects, so that a lower target_error takes '
                  'long and gains little; add lamps, or accept the noise')
    assert advised_settings(line, settings()) == {}


def test_a_patch_size_is_never_increased():
    line, = store(COARSE)
    settings().topology = 'SUBDIVIDE'
    settings().patch_size = 0.02
    assert advised_settings(line, settings())['patch_size'] == pytest.approx(0.02)


def test_advice_is_applied_once(floor):
    line, = store(COARSE)
    assert buttons()["raybundle.apply_advice"]
    assert bpy.ops.raybundle.apply_advice(index=0) == {'FINISHED'}
    assert settings().topology == 'SUBDIVIDE'
    assert settings().patch_size == pytest.approx(0.05)
    assert is_applied(advised_settings(line, settings()), settings())
    assert not buttons()["raybundle.apply_advice"]


@pytest.mark.parametrize("name", ["apply_advice", "show_material", "select_named",
                                  "bake_other_side"])
@pytest.mark.parametrize("index", [-1, 5])
def test_a_report_that_has_changed_is_no_error(name, index):
    store()
    assert getattr(bpy.ops.raybundle, name)(index=index) <= {'FINISHED', 'CANCELLED'}


def test_the_side_is_changed(floor):
    store(UNLIT)
    assert buttons()["raybundle.bake_other_side"]
    bpy.ops.raybundle.bake_other_side(index=0)
    assert floor.raybundle.side == 'BACK'


# --------------------------------------------------------------------------------------------------
# Selection
# --------------------------------------------------------------------------------------------------


def test_named_objects_are_selected(floor, new_object):
    other = new_object("other", *SQUARE)
    other.select_set(True)
    store(COARSE)
    assert bpy.ops.raybundle.select_named(index=0) == {'FINISHED'}
    assert bpy.context.selected_objects == [floor]
    assert bpy.context.view_layer.objects.active == floor


def test_all_owners_of_a_group_are_selected(new_object):
    for k in range(20):
        new_object(f"o{k}", *SQUARE)
    names = [f"o{k}" for k in range(20)]
    store('object "o0", "o1" and 18 more: 40 faces lie on others',
          warning_owners=owned(('DOUBLED_FACES', 'object', names)))
    bpy.ops.raybundle.select_named(index=0)
    assert sorted(item.name for item in bpy.context.selected_objects) == sorted(names)


def test_an_object_that_was_left_out_is_selected(floor):
    store()
    assert bpy.ops.raybundle.select_named(object_name="floor") == {'FINISHED'}
    assert floor.select_get()


def test_a_hidden_object_is_not_selected_and_no_error(floor):
    store(COARSE)
    floor.hide_set(True)
    assert bpy.ops.raybundle.select_named(index=0) == {'CANCELLED'}


def test_buttons_of_deleted_objects_are_greyed_out(floor):
    store(COARSE, UNLIT, SOLVER)
    settings().solver = 'MULTIPATH'
    assert all(buttons().values())
    bpy.data.objects.remove(floor)
    bpy.data.materials.remove(bpy.data.materials["glass"])
    shown = buttons()
    assert not shown["raybundle.select_named"] and not shown["raybundle.show_material"]
    assert not shown["raybundle.bake_other_side"]
    assert shown["raybundle.apply_advice"] and shown["raybundle.show_error"]


def test_a_material_is_shown(floor, new_material):
    floor.data.materials.append(new_material("other"))
    floor.active_material_index = 1
    store(SOLVER)
    assert bpy.ops.raybundle.show_material(index=0) == {'FINISHED'}
    assert floor.select_get() and floor.active_material.name == "glass"


def test_the_users_of_a_mesh_are_selected(floor):
    copy = bpy.data.objects.new("copy", floor.data)
    bpy.context.scene.collection.objects.link(copy)
    bpy.context.view_layer.update()
    store('mesh "floor" shows the mean light of the 2 objects that share it')
    bpy.ops.raybundle.select_named(index=0)
    assert set(bpy.context.selected_objects) == {floor, copy}


# --------------------------------------------------------------------------------------------------
# The error as colours
# --------------------------------------------------------------------------------------------------


def test_the_error_is_switched_on_if_it_was_not_written(floor):
    assert bpy.ops.raybundle.show_error() == {'FINISHED'}
    assert settings().write_error


def test_the_colours_of_an_error(floor):
    error = floor.data.attributes.new("Radiosity Error", 'FLOAT', 'CORNER')
    error.data.foreach_set('value', [0.0, 1.0, 2.0, 3.0])
    floor.data.color_attributes.new("Radiosity", 'FLOAT_COLOR', 'CORNER')
    most = error_view.write_error_colors([floor.data], "Radiosity")
    assert most == pytest.approx(np.percentile([0, 1, 2, 3], 98))
    attributes = floor.data.color_attributes
    colors = np.empty(16, np.float32)
    attributes["Radiosity Error Colors"].data.foreach_get('color', colors)
    assert np.abs(colors.reshape(4, 4)[:, :3] - [
        (0, 0, 0), (1, 3 / most - 1, 0), (1, 1, 6 / most - 2), (1, 1, 1)]).max() < 0.01
    assert attributes[attributes.active_color_index].name == "Radiosity Error Colors"
    assert attributes[attributes.render_color_index].name != "Radiosity Error Colors"


@pytest.mark.needs_library
def test_the_error_is_shown_and_cleared(closed_box):
    raybundle.bake(bpy.context, write_error=True)
    assert bpy.ops.raybundle.show_error() == {'FINISHED'}
    assert "Radiosity Error Colors" in closed_box.data.color_attributes
    raybundle.bake(bpy.context, write_error=True)
    assert "Radiosity Error Colors" not in closed_box.data.color_attributes
    bpy.ops.raybundle.show_error()
    bpy.ops.raybundle.clear()
    assert not closed_box.data.color_attributes


def test_a_name_that_is_too_long_is_no_error(floor):
    settings().attribute = "x" * 57
    floor.data.attributes.new("x" * 57 + " Error", 'FLOAT', 'CORNER')
    assert bpy.ops.raybundle.show_error() == {'CANCELLED'}
