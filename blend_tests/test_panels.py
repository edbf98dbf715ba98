# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panels and menus show, and preferences and presets."""

import json
from types import SimpleNamespace

import bpy
import pytest
import raybundle
from drawn_layout import DrawnLayout, drawn
from raybundle import menus, object_roles, panels, preferences, presets, properties
from test_quality import FULL


def settings() -> bpy.types.PropertyGroup:
    return bpy.context.scene.raybundle


# --------------------------------------------------------------------------------------------------
# Render properties
# --------------------------------------------------------------------------------------------------


def test_the_quality_comes_first():
    layout = drawn(panels.RAYBUNDLE_PT_render)
    first = [arguments for method, arguments, *_ in layout.record if method == 'prop_enum']
    assert [arguments[1:] for arguments in first[:3]] == [
        ("quality", 'DRAFT'), ("quality", 'GOOD'), ("quality", 'FINAL')]
    calls = [method for method, *_ in layout.record]
    assert calls.index('prop_enum') < calls.index('operator')


def test_costs_are_shown_after_the_first_bake():
    assert "Times after first bake" in drawn(panels.RAYBUNDLE_PT_render).texts()
    settings().report = json.dumps(FULL)
    texts = drawn(panels.RAYBUNDLE_PT_render).texts()
    assert [text for text in texts if text.startswith("≈")] == ["≈ 4.2 s", "≈ 10 s", "≈ 54 s"]


def test_the_choice_how_light_is_shown_is_in_both_places():
    for panel in (panels.RAYBUNDLE_PT_render, panels.RAYBUNDLE_PT_sidebar):
        assert [arguments[2] for method, arguments, *_ in drawn(panel).record
                if method == 'prop_enum' and arguments[1] == "show_in"] == ['SOLID', 'MATERIALS']


def test_the_sidebar_and_the_preferences_are_drawn():
    assert {"raybundle.bake", "raybundle.preview"} <= set(
        drawn(panels.RAYBUNDLE_PT_sidebar).operators())
    assert {"raybundle.open_guide", "raybundle.copy_bug_report"} == set(
        drawn(preferences.RaybundlePreferences, live_bakes=True).operators())


def test_all_panels_are_drawn_with_what_this_blender_has(closed_box):
    settings().light_sets.add()
    bpy.context.view_layer.objects.active = closed_box
    for panel in (panels.RAYBUNDLE_PT_output, panels.RAYBUNDLE_PT_quality,
                  panels.RAYBUNDLE_PT_limits, panels.RAYBUNDLE_PT_light_sets,
                  panels.RAYBUNDLE_PT_object):
        assert drawn(panel).props()


def test_sub_panels_leave_a_place_after_the_output():
    orders = {panel.bl_label: panel.bl_order for panel in
              (panels.RAYBUNDLE_PT_output, panels.RAYBUNDLE_PT_quality,
               panels.RAYBUNDLE_PT_light_sets, panels.RAYBUNDLE_PT_method)}
    assert orders == {"Output": 10, "Quality": 30, "Light Sets": 40, "Method": 50}


def test_every_setting_of_a_bake_is_in_a_panel():
    shown = set()
    for panel in (panels.RAYBUNDLE_PT_render, panels.RAYBUNDLE_PT_output,
                  panels.RAYBUNDLE_PT_quality, panels.RAYBUNDLE_PT_limits):
        shown |= set(drawn(panel).props())
    missing = set(properties.BakeSettings.names()) - shown - set(panels.METHODS)
    # target_error is shown in %. Skips are switched off by scripts, to test that light is equal.
    assert missing == {'target_error', 'skips_off'}
    assert {'live', 'show_result'} <= shown


def test_methods_are_hidden_until_they_are_studied(user):
    assert not panels.RAYBUNDLE_PT_method.poll(bpy.context)
    user.study_methods = True
    assert panels.RAYBUNDLE_PT_method.poll(bpy.context)


def test_without_preferences_methods_are_hidden():
    assert preferences.get() is None
    assert not panels.RAYBUNDLE_PT_method.poll(bpy.context)


def test_hidden_methods_that_differ_are_named(user):
    assert not any("default" in text for text in drawn(panels.RAYBUNDLE_PT_render).texts())
    settings().solver = 'MULTIPATH'
    settings().plane_count = 7
    line, = (text for text in drawn(panels.RAYBUNDLE_PT_render).texts() if "default" in text)
    assert line == "Not the default: Solver, Planes"
    assert "raybundle.reset_methods" in drawn(panels.RAYBUNDLE_PT_render).operators()
    user.study_methods = True
    assert "raybundle.reset_methods" not in drawn(panels.RAYBUNDLE_PT_render).operators()


def test_the_study_of_methods_changes_no_setting(user):
    settings().solver = 'MULTIPATH'
    values = properties.read_settings(bpy.context.scene, {})
    user.study_methods = True
    assert properties.read_settings(bpy.context.scene, {}) == values
    assert values.solver == 'MULTIPATH'


def test_methods_are_reset():
    settings().solver = 'MULTIPATH'
    settings().target_error = 0.1
    assert bpy.ops.raybundle.reset_methods() == {'FINISHED'}
    assert (settings().solver, settings().quality) == ('LINE_REUSE', 'DRAFT')


# --------------------------------------------------------------------------------------------------
# Preferences
# --------------------------------------------------------------------------------------------------


def test_preferences_apply_where_the_scene_is_automatic(user):
    user.threads, user.memory_limit = 3, 512.0
    values = properties.read_settings(bpy.context.scene, {})
    assert (values.threads, values.memory_limit) == (3, 512.0)
    # Overrides of a script and values of the scene come first.
    assert properties.read_settings(bpy.context.scene, {'threads': 0}).threads == 0
    settings().threads, settings().memory_limit = 2, 4096.0
    values = properties.read_settings(bpy.context.scene, {})
    assert (values.threads, values.memory_limit) == (2, 4096.0)


def test_a_scene_returns_to_the_preferences(user):
    user.memory_limit = 512.0
    settings().threads, settings().memory_limit = 2, 100.0
    assert "raybundle.use_preferences" in drawn(panels.RAYBUNDLE_PT_limits).operators()
    assert bpy.ops.raybundle.use_preferences() == {'FINISHED'}
    values = properties.read_settings(bpy.context.scene, {})
    assert (values.threads, values.memory_limit) == (0, 512.0)
    assert "raybundle.use_preferences" not in drawn(panels.RAYBUNDLE_PT_limits).operators()


def test_the_panel_names_the_preferences_that_apply(user):
    assert drawn(panels.RAYBUNDLE_PT_limits).texts()[-1] == "Memory (MB)"
    user.threads, user.memory_limit = 3, 512.0
    assert drawn(panels.RAYBUNDLE_PT_limits).texts()[-2:] == [
        "Preferences: 3 threads", "Preferences: 512 MB"]


def test_preferences_change_nothing_by_default(user):
    values = properties.read_settings(bpy.context.scene, {})
    assert (values.threads, values.memory_limit) == (0, 0.0)


def test_the_bug_report_names_versions_and_settings(closed_box):
    settings().target_error = 0.1
    text = preferences.bug_report(bpy.context.scene)
    assert "Raybundle 0." in text and bpy.app.version_string in text
    assert "target_error = 0.1" in text
    assert closed_box.name not in text


def test_the_guide_is_found():
    assert bpy.ops.raybundle.open_guide.poll()


# --------------------------------------------------------------------------------------------------
# Objects and collections
# --------------------------------------------------------------------------------------------------


@pytest.fixture
def two_boxes(new_object):
    items = [new_object(name, [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
             for name in ("A", "B")]
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Empty", None))
    return items


def test_roles_of_the_selection(two_boxes):
    a, b = two_boxes
    a.select_set(True)
    b.select_set(False)
    assert bpy.ops.raybundle.set_role(role='OCCLUDE') == {'FINISHED'}
    assert (a.raybundle.role, b.raybundle.role) == ('OCCLUDE', 'BAKE')


def test_roles_and_sides_of_a_collection(two_boxes):
    assert bpy.ops.raybundle.set_role(role='IGNORE', target='COLLECTION') == {'FINISHED'}
    assert bpy.ops.raybundle.set_side(side='BACK', target='COLLECTION') == {'FINISHED'}
    assert bpy.ops.raybundle.set_quality(quality='FINE', target='COLLECTION') == {'FINISHED'}
    assert {(item.raybundle.role, item.raybundle.side, item.raybundle.quality)
            for item in two_boxes} == {('IGNORE', 'BACK', 'FINE')}
    assert bpy.data.objects["Empty"].raybundle.role == 'BAKE'


def test_the_panel_of_a_collection(two_boxes):
    layout = drawn(object_roles.RAYBUNDLE_PT_collection)
    assert layout.texts()[0] == "Objects with surfaces: 2"
    pressed = [options['text'] for method, _, options, *_ in layout.record
               if method == 'operator' and options['depress']]
    assert pressed == ["Bake", "Front", "As Scene"]
    two_boxes[0].raybundle.role = 'OCCLUDE'
    layout = drawn(object_roles.RAYBUNDLE_PT_collection)
    assert not any(options['depress'] for method, _, options, *_ in layout.record
                   if method == 'operator' and options['text'] in ("Bake", "Occlude"))


def test_without_surfaces_there_is_nothing_to_set():
    assert not bpy.ops.raybundle.set_role.poll()


# --------------------------------------------------------------------------------------------------
# Menus and presets
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("menu", [menus.RAYBUNDLE_MT_render, menus.RAYBUNDLE_MT_object])
def test_menus_have_the_operators(menu):
    names = ("bake", "relight", "clear", "preview", "use_in_material", "take_out_of_material",
             "export_gltf", "check_export", "bake_channels")
    assert {f"raybundle.{name}" for name in names} <= set(drawn(menu).operators())


def test_the_menus_of_blender_have_an_entry():
    for menu, entry in ((bpy.types.TOPBAR_MT_render, "RAYBUNDLE_MT_render"),
                        (bpy.types.VIEW3D_MT_object, "RAYBUNDLE_MT_object")):
        drawing = [function for function in menu.draw._draw_funcs
                   if function.__module__ == menus.__name__]
        assert len(drawing) == 1
        layout = DrawnLayout()
        drawing[0](type("Menu", (), {'layout': layout}), bpy.context)
        assert entry in [arguments[0] for method, arguments, *_ in layout.record
                         if method == 'menu']


def test_a_preset_is_stored_and_restored(tmp_path, monkeypatch):
    monkeypatch.setenv("BLENDER_USER_SCRIPTS", str(tmp_path))
    monkeypatch.setattr(bpy.utils, "user_resource",
                        lambda kind, path="", create=False: _folder(tmp_path / path))
    # Blender replaces the label of the menu by the name of the preset.
    monkeypatch.setattr(presets.RAYBUNDLE_PT_presets, "bl_label", "Raybundle Presets")
    settings().quality = 'FINAL'
    settings().domain = 'POINT'
    settings().memory_limit = 100.0
    assert bpy.ops.raybundle.preset_add(name="My Light") == {'FINISHED'}
    path, = tmp_path.rglob("My_Light.py")
    assert path.parent.name == "raybundle"
    for name in ("target_error", "domain", "memory_limit"):
        settings().property_unset(name)
    bpy.ops.script.execute_preset(filepath=str(path), menu_idname="RAYBUNDLE_PT_presets")
    assert (settings().quality, settings().domain) == ('FINAL', 'POINT')
    # It belongs to the computer, and remains automatic.
    assert not settings().is_property_set('memory_limit')


def _folder(path) -> str:
    path.mkdir(parents=True, exist_ok=True)
    return str(path)


def test_the_menu_without_presets_only_adds_one(monkeypatch):
    monkeypatch.setattr(bpy.utils, "preset_paths", lambda folder: [])
    layout = DrawnLayout()
    stand_in = SimpleNamespace(layout=layout, preset_add_operator="raybundle.preset_add")
    presets.RAYBUNDLE_PT_presets.draw(stand_in, bpy.context)
    assert (layout.props(), layout.operators()) == (["preset_name"], ["raybundle.preset_add"])


def test_presets_have_every_setting_but_those_of_the_computer():
    stored = {name.partition(".")[2] for name in presets.RAYBUNDLE_OT_preset_add.preset_values}
    assert set(properties.BakeSettings.names()) - stored == presets._LEFT_OUT


# --------------------------------------------------------------------------------------------------
# Relight
# --------------------------------------------------------------------------------------------------


@pytest.mark.needs_library
def test_relight_is_greyed_out_when_there_is_nothing_to_relight(closed_box, tmp_path):
    assert not bpy.ops.raybundle.relight.poll()
    raybundle.bake(bpy.context)
    assert bpy.ops.raybundle.relight.poll()
    path = str(tmp_path / "baked.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    # The report is in the file, but the lines are not.
    assert settings().report
    assert not bpy.ops.raybundle.relight.poll()
    with pytest.raises(RuntimeError, match="bake first"):
        bpy.ops.raybundle.relight()
