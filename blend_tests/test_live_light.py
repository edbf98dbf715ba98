# SPDX-License-Identifier: GPL-3.0-or-later
"""Live mode. Its timer needs a window; here, tests take its steps themselves."""

import sys
import time

import bpy
import numpy as np
import pytest
import raybundle
from conftest import CUBE_FACES, CUBE_VERTICES, FURNACE_LIGHT
from drawn_layout import drawn
from raybundle import bake_run, export_operators, live_light, panels, preferences
from raybundle.scene_export import export_scene
from surface_error import read_colors

pytestmark = pytest.mark.needs_library

bake_module = sys.modules["raybundle.bake"]  # raybundle.bake is the function


@pytest.fixture
def live():
    """Live mode, off and without memory of earlier tests."""
    live_light.live.__init__()
    yield live_light.live
    if bake_run.active() is not None:
        bake_run.active().leave()
    live_light.live.__init__()


@pytest.fixture
def room(new_object, new_material, new_light):
    """A room with a block and two lamps."""
    white = new_material("White", (0.7, 0.7, 0.7))
    item = new_object("Room", CUBE_VERTICES, [face[::-1] for face in CUBE_FACES], white)
    new_object("Block", [tuple(0.2 * x for x in v) for v in CUBE_VERTICES], CUBE_FACES, white,
               (0.3, 0.2, -0.5))
    new_light("Left", 'POINT', 30.0, (-0.6, 0.0, 0.6))
    new_light("Right", 'POINT', 10.0, (0.6, 0.1, 0.5))
    # Few patches, to save time.
    bpy.context.scene.raybundle.max_patches = 2000
    bpy.context.scene.raybundle.seed = 1
    return item


def until_at_rest(live, seconds=30.0):
    """Takes steps until nothing is left to do. Returns the number of drafts meanwhile."""
    drafts = live.drafts
    deadline = time.monotonic() + seconds
    while live.step(bpy.context) != live_light.IDLE_SECONDS:
        assert time.monotonic() < deadline, "live mode never rests"
        time.sleep(0.001)
    return live.drafts - drafts


def switch_on(live):
    bpy.context.scene.raybundle.live = True
    return until_at_rest(live)


def test_the_light_at_rest_is_that_of_a_bake(room, live):
    assert switch_on(live) == 1
    light = read_colors(room).copy()
    report = bpy.context.scene.raybundle.report
    assert report and live.message == ""
    raybundle.bake(bpy.context)
    assert np.allclose(read_colors(room), light, rtol=1e-5, atol=1e-6)


def change_power(scene):
    bpy.data.lights["Left"].energy *= 2.0


def change_color(scene):
    bpy.data.lights["Left"].color = (1.0, 0.2, 0.1)


def move_lamp(scene):
    bpy.data.objects["Right"].location.x = 0.2


def move_block(scene):
    bpy.data.objects["Block"].location.x = -0.3


def change_material(scene):
    node = bpy.data.materials["White"].node_tree.nodes["Diffuse BSDF"]
    node.inputs['Color'].default_value = (0.3, 0.5, 0.7, 1.0)


@pytest.mark.parametrize("change", [change_power, change_color, move_lamp, move_block,
                                    change_material])
def test_the_light_follows(room, live, change):
    switch_on(live)
    before = read_colors(room)[:, :3].copy()
    change(bpy.context.scene)
    bpy.context.view_layer.update()
    # The draft comes first. Its noise may be 0.3 of the light at the 95th percentile.
    while not live.drafts - 1:
        live.step(bpy.context)
    draft = read_colors(room)[:, :3].copy()
    assert until_at_rest(live) == 0
    light = read_colors(room)[:, :3].copy()
    bpy.ops.raybundle.clear()
    raybundle.bake(bpy.context)
    fresh = read_colors(room)[:, :3]
    scale = fresh.mean()
    # Both bakes have noise of at most 2 % of the light at the 95th percentile.
    assert np.percentile(np.abs(light - fresh), 95) < 0.03 * scale
    assert np.percentile(np.abs(draft - fresh), 95) < 0.3 * scale
    assert np.abs(light - before).max() > 0.05 * scale


@pytest.mark.parametrize("topology", ['KEEP', 'SUBDIVIDE', 'ADAPTIVE'])
def test_the_light_that_is_written_is_no_change(room, live, topology):
    bpy.context.scene.raybundle.topology = topology
    bpy.context.scene.raybundle.patch_size = 0.3
    assert switch_on(live) == 1
    bpy.context.view_layer.update()
    assert until_at_rest(live) == 0
    assert bake_run.active() is None


def test_use_and_export_are_no_changes(room, live, tmp_path):
    switch_on(live)
    light = read_colors(room).copy()
    for operator, options in ((bpy.ops.raybundle.export_gltf, {'filepath': str(tmp_path / "x.glb")}),
                              (bpy.ops.raybundle.use_in_material, {}),
                              (bpy.ops.raybundle.export_gltf, {'filepath': str(tmp_path / "x.glb")}),
                              (bpy.ops.raybundle.take_out_of_material, {})):
        assert operator(**options) == {'FINISHED'}
        bpy.context.view_layer.update()
        assert until_at_rest(live) == 0, operator.idname()
    assert np.array_equal(read_colors(room), light)
    change_power(bpy.context.scene)  # and is reported only by the operator
    bpy.ops.raybundle.use_in_material()
    assert until_at_rest(live) == 1


def test_relight_is_not_greyed_out_meanwhile(room, live):
    switch_on(live)
    assert bpy.ops.raybundle.relight.poll()
    change_power(bpy.context.scene)
    bpy.context.view_layer.update()
    while bake_run.active() is None:
        live.step(bpy.context)
    assert bpy.ops.raybundle.relight.poll()
    assert bpy.ops.raybundle.relight() == {'FINISHED'}


def test_it_waits_while_meshes_are_edited(room, live):
    switch_on(live)
    bpy.context.view_layer.objects.active = room
    bpy.ops.object.mode_set(mode='EDIT')
    change_power(bpy.context.scene)
    bpy.context.view_layer.update()
    for _ in range(5):
        live.step(bpy.context)
    assert bake_run.active() is None
    bpy.ops.object.mode_set(mode='OBJECT')
    assert until_at_rest(live) >= 1


def test_a_scene_that_cannot_be_baked_is_said_once(new_light, live):
    new_light("Lamp", 'POINT', 10.0)
    switch_on(live)
    assert "Nothing to bake" in live.message


def test_switched_off_it_leaves_the_light_alone(room, live):
    switch_on(live)
    bpy.context.scene.raybundle.live = False
    light = read_colors(room).copy()
    change_power(bpy.context.scene)
    bpy.context.view_layer.update()
    assert until_at_rest(live) == 0
    assert np.array_equal(read_colors(room), light)


def test_a_bake_ends_the_run_of_live_mode(closed_box, live):
    settings = bpy.context.scene.raybundle
    settings.skips_off, settings.max_bundles, settings.live = {'bundles'}, 2 ** 24, True
    while bake_run.active() is None or live._is_draft:
        live.step(bpy.context)
    settings.skips_off, settings.max_bundles = set(), 128
    assert bpy.ops.raybundle.bake.poll()
    assert bpy.ops.raybundle.bake() == {'FINISHED'}
    assert np.allclose(read_colors(closed_box)[:, :3], FURNACE_LIGHT, rtol=1e-3)
    until_at_rest(live)


SAYS_DRAFT = "The light is a draft: press Bake"


def test_a_draft_stays_if_the_user_bakes(room, live, user):
    user.live_bakes = False
    assert switch_on(live) == 1
    assert bake_run.active() is None and live.shows_draft(bpy.context.scene)
    assert SAYS_DRAFT in drawn(panels.RAYBUNDLE_PT_sidebar).texts()
    draft = read_colors(room).copy()
    raybundle.bake(bpy.context)
    assert until_at_rest(live) == 0
    assert not np.array_equal(read_colors(room), draft)
    assert SAYS_DRAFT not in drawn(panels.RAYBUNDLE_PT_sidebar).texts()


def test_the_bake_begins_after_the_delay(room, live, user):
    assert user.live_delay == pytest.approx(preferences.LIVE_DELAY) == live_light.rest_seconds()
    user.live_delay = 3600.0
    bpy.context.scene.raybundle.live = True
    while live.drafts == 0:
        live.step(bpy.context)
    for _ in range(5):
        assert live.step(bpy.context) < live_light.IDLE_SECONDS
        assert bake_run.active() is None
    # Light that will get better by itself is not called a draft.
    assert SAYS_DRAFT not in drawn(panels.RAYBUNDLE_PT_sidebar).texts()
    user.live_delay = 0.0
    assert until_at_rest(live) == 0
    assert not live.shows_draft(bpy.context.scene)


def test_a_draft_of_live_mode_that_was_switched_off_is_named(room, live, user):
    user.live_delay = 3600.0
    bpy.context.scene.raybundle.live = True
    while live.drafts == 0:
        live.step(bpy.context)
    bpy.context.scene.raybundle.live = False
    assert until_at_rest(live) == 0
    assert SAYS_DRAFT in drawn(panels.RAYBUNDLE_PT_sidebar).texts()
    bpy.ops.raybundle.clear()
    assert SAYS_DRAFT not in drawn(panels.RAYBUNDLE_PT_sidebar).texts()


def test_a_file_that_is_opened_begins_no_bake(room, live, tmp_path):
    bpy.context.scene.raybundle.live = True
    path = str(tmp_path / "live.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert not bpy.context.scene.raybundle.live
    assert until_at_rest(live) == 0


def test_the_export_of_a_draft_says_so(room, live, tmp_path, monkeypatch):
    switch_on(live)
    assert not said_of_export(tmp_path, monkeypatch)
    change_power(bpy.context.scene)
    bpy.context.view_layer.update()
    next_draft(live)
    assert said_of_export(tmp_path, monkeypatch) == [
        "The light in the file is a draft of live mode: press Bake, and export again"]


def said_of_export(folder, monkeypatch):
    """Exports the scene, and returns what is said about drafts."""
    said = []
    monkeypatch.setattr(export_operators, 'translated', lambda text: said.append(text) or text)
    assert bpy.ops.raybundle.export_gltf(filepath=str(folder / "room.glb")) == {'FINISHED'}
    return [text for text in said if "draft" in text]


# --------------------------------------------------------------------------------------------------
# Drafts after a change of lamps alone
# --------------------------------------------------------------------------------------------------


def add_lamp(scene):
    light = bpy.data.lights.new("Third", 'POINT')
    light.energy = 20.0
    scene.collection.objects.link(bpy.data.objects.new("Third", light))


def switch_lamp_off(scene):
    bpy.data.lights["Left"].energy = 0.0


def hide_block(scene):
    bpy.data.objects["Block"].hide_viewport = True


@pytest.fixture
def exports(monkeypatch):
    """Counts the exports of whole scenes."""
    found = []

    def export(*arguments):
        found.append(None)
        return export_scene(*arguments)

    monkeypatch.setattr(bake_module, 'export_scene', export)
    return found


@pytest.fixture
def native_scenes(monkeypatch):
    """The native scenes that were built."""
    build, found = bake_module.build_native_scene, []

    def noted(data):
        found.append(build(data))
        return found[-1]

    monkeypatch.setattr(bake_module, 'build_native_scene', noted)
    return found


def skips(report):
    return [item['id'] for item in report.skipped]


def next_draft(live):
    """Takes steps until the next draft is written."""
    drafts, deadline = live.drafts, time.monotonic() + 30.0
    while live.drafts == drafts:
        assert time.monotonic() < deadline, "there is no draft"
        live.step(bpy.context)
        time.sleep(0.001)


@pytest.mark.parametrize("change", [change_power, change_color, move_lamp])
def test_only_lamps_are_exported_again(room, live, exports, native_scenes, change):
    switch_on(live)
    exports.clear()
    native_scenes.clear()
    change(bpy.context.scene)
    bpy.context.view_layer.update()
    next_draft(live)
    assert exports == []
    assert native_scenes == []
    draft = read_colors(room).copy()
    # The library keeps the light of the draft only if a whole export gives it the same scene.
    prepared = bake_module.prepare(bpy.context, live_light.DRAFT, True)
    with prepared.native_scene:
        prepared.native_bake.execute(prepared.native_scene, lambda *_: True)
    report = bake_module.write_results(bpy.context, prepared)
    assert "SCALED_DRAFT" in skips(report)
    assert np.array_equal(read_colors(room), draft)


@pytest.mark.parametrize("change", [move_block, change_material, add_lamp, switch_lamp_off,
                                    hide_block])
def test_other_changes_need_a_whole_export(room, live, exports, change):
    switch_on(live)
    change_power(bpy.context.scene)
    bpy.context.view_layer.update()
    next_draft(live)
    exports.clear()
    change(bpy.context.scene)
    bpy.context.view_layer.update()
    next_draft(live)
    assert len(exports) == 1


def test_a_lamp_that_changes_after_something_else_needs_a_whole_export(room, live, exports):
    """The two changes come between two steps of live mode."""
    switch_on(live)
    exports.clear()
    change_material(bpy.context.scene)
    bpy.context.view_layer.update()
    move_lamp(bpy.context.scene)
    bpy.context.view_layer.update()
    next_draft(live)
    assert len(exports) == 1


def glow(scene):
    """Doubles the strength of the emission of the block."""
    node = bpy.data.materials["Glow"].node_tree.nodes["Emission"]
    node.inputs['Strength'].default_value *= 2.0


@pytest.mark.parametrize("change", [change_power, glow])
def test_light_is_scaled_while_strengths_change(room, live, new_material, user, change):
    user.live_bakes = False
    bpy.data.objects["Block"].data.materials[0] = new_material("Glow", emission=(1.0, 2.0, 3.0))
    switch_on(live)
    for step in range(3):
        change(bpy.context.scene)
        bpy.context.view_layer.update()
        next_draft(live)
        is_scaled = "SCALED_DRAFT" in bpy.context.scene.raybundle.report
        # The first draft after switching on takes the light of the source apart.
        assert is_scaled == (step > 0)
    scaled = read_colors(room).copy()
    raybundle.bake(bpy.context)
    light = read_colors(room)
    # The target of a draft is 30 %, and the scaled light is four times that which was computed.
    assert np.sqrt(np.mean((scaled - light) ** 2)) < 0.3 * np.sqrt(np.mean(light ** 2))
    assert scaled.mean() == pytest.approx(light.mean(), rel=0.1)
