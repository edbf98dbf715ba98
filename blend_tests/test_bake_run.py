# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes that run in the background while Blender stays usable. The operator that drives them needs
a window and is tested by ui_test.py; here, tests drive the run themselves."""

import time
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

import raybundle
from conftest import CUBE_FACES, CUBE_VERTICES, FURNACE_LIGHT
from drawn_layout import DrawnLayout
from raybundle import bake_progress, bake_run, color_attribute, native
from raybundle.progress_panel import draw_progress
from surface_error import read_colors

pytestmark = pytest.mark.needs_library


@pytest.fixture
def two_boxes(closed_box, new_object):
    """Two furnaces that share no mesh."""
    other = new_object("Other", CUBE_VERTICES, [face[::-1] for face in CUBE_FACES],
                       closed_box.data.materials[0])
    other.location.x = 5.0
    bpy.context.view_layer.update()
    return closed_box, other


@pytest.fixture
def start():
    """Starts runs, and leaves the last one after the test."""
    runs = []

    def begin(**settings):
        for name, value in settings.items():
            setattr(bpy.context.scene.raybundle, name, value)
        runs.append(bake_run.BakeRun(bpy.context))
        return runs[-1]

    yield begin
    for run in runs:
        run.leave()


# A run with these settings lasts until it is stopped.
ENDLESS = {'skips_off': {'bundles'}, 'max_bundles': 2 ** 24}


def to_the_end(run):
    while run.advance():
        time.sleep(0.001)
    report = run.finish(bpy.context)
    run.leave()
    return report


def until_light_shows(run, item):
    """Waits until an object shows the light of bundles. The first light to be shown is that of
    lamps alone, of which there are none."""
    while run.advance() and not (run.shows_light and read_colors(item)[:, :3].min() > 0.5):
        time.sleep(0.001)
    assert run.shows_light and run.state.is_running


def attribute(item):
    return item.data.color_attributes.get("Radiosity")


def test_a_run_gives_the_light_of_a_bake(two_boxes, start):
    raybundle.bake(bpy.context, seed=3)
    expected = [read_colors(item) for item in two_boxes]
    bpy.ops.raybundle.clear()
    report = to_the_end(start(seed=3))
    assert report.seconds['total'] > 0.0
    assert bpy.context.scene.raybundle.report == report.to_json()
    for item, light in zip(two_boxes, expected):
        assert np.array_equal(read_colors(item), light)
    assert bake_run.active() is None


@pytest.mark.parametrize("settings, light", [
    ({}, FURNACE_LIGHT), ({'domain': 'POINT'}, FURNACE_LIGHT),
    ({'data_type': 'BYTE_COLOR', 'clamp': True}, 1.0), ({'output': 'COMBINED'}, FURNACE_LIGHT),
    ({'exposure': 1.0}, 2.0 * FURNACE_LIGHT),
    ({'topology': 'SUBDIVIDE', 'patch_size': 0.2}, FURNACE_LIGHT)])
def test_light_shows_while_the_run_goes_on(two_boxes, start, settings, light):
    run = start(**ENDLESS, **settings)
    until_light_shows(run, two_boxes[1])
    for item in two_boxes:
        # Solved to convergence on any number of lines, a furnace has its exact light.
        assert np.allclose(read_colors(item)[:, :3], light, rtol=0.01)
    assert bake_run.active() is run


def test_a_stop_restores_what_the_attributes_held(two_boxes, start):
    painted, bare = two_boxes
    mesh = painted.data
    for name, domain, data_type in (("Paint", 'POINT', 'BYTE_COLOR'),
                                    ("Radiosity", 'POINT', 'BYTE_COLOR')):
        colors = mesh.color_attributes.new(name, data_type, domain)
        colors.data.foreach_set('color', np.linspace(0.0, 1.0, 32))
    color_attribute.activate(mesh, "Paint")
    before = read_colors(painted).copy()
    run = start(**ENDLESS)
    until_light_shows(run, two_boxes[1])
    assert attribute(painted).domain == 'CORNER' and attribute(bare) is not None
    assert mesh.color_attributes.active_color.name == "Radiosity"
    run.stop("enough")
    assert not run.advance() and run.stopped_because == "enough" and not run.is_kept
    kept = attribute(painted)
    assert (kept.domain, kept.data_type) == ('POINT', 'BYTE_COLOR')
    assert np.array_equal(read_colors(painted), before)
    assert mesh.color_attributes.active_color.name == "Paint"
    assert color_attribute.rendered_attribute(mesh).name == "Paint"
    assert len(bare.data.color_attributes) == 0


def test_a_stop_may_keep_the_light_so_far(two_boxes, start):
    raybundle.bake(bpy.context)
    run = start(**ENDLESS, seed=1)
    until_light_shows(run, two_boxes[1])
    run.stop("enough", keep=True)
    assert run.is_kept
    # The report belongs to other light.
    assert bpy.context.scene.raybundle.report == ""
    for item in two_boxes:
        assert np.allclose(read_colors(item)[:, :3], FURNACE_LIGHT, rtol=0.01)


def test_the_stop_operator_stops_the_run(two_boxes, start):
    assert not bpy.ops.raybundle.stop.poll()
    run = start(**ENDLESS)
    assert bpy.ops.raybundle.stop.poll()
    assert not bpy.ops.raybundle.bake.poll()
    assert not bpy.ops.raybundle.clear.poll()
    assert bpy.ops.raybundle.stop() == {'FINISHED'}
    assert run.stopped_because and not run.is_kept


@pytest.mark.parametrize("stage", native.STAGES)
def test_a_run_can_be_stopped_in_every_stage(two_boxes, start, stage):
    # Fine patches, so that each stage takes some milliseconds.
    run = start(patch_size=0.02, max_patches=200000, seed=1,
                **({} if stage == 'reconstruction' else ENDLESS))
    while run.advance() and native.STAGES.index(run.state.stage) < native.STAGES.index(stage):
        pass
    run.stop("enough")
    with pytest.raises(raybundle.RaybundleError):
        run.state = run._run.state()
    assert all(attribute(item) is None for item in two_boxes)
    run.leave()
    raybundle.bake(bpy.context, patch_size=0.5, skips_off=set())


def test_undo_and_redo_stop_a_run_and_lose_nothing(two_boxes, start):
    names = [item.name for item in two_boxes]
    bpy.ops.ed.undo_push(message="before")
    two_boxes[0].location.z = 1.0
    bpy.ops.ed.undo_push(message="moved")
    run = start(**ENDLESS)
    until_light_shows(run, two_boxes[1])
    bpy.ops.ed.undo()
    assert "Undo" in run.stopped_because
    run.leave()
    for name in names:
        assert len(bpy.data.objects[name].data.color_attributes) == 0
    assert bpy.data.objects[names[0]].location.z == 0.0


def test_a_new_file_stops_a_run(two_boxes, start, tmp_path):
    run = start(**ENDLESS)
    until_light_shows(run, two_boxes[1])
    bpy.ops.wm.read_homefile(use_empty=True)
    assert "file" in run.stopped_because
    assert bake_run.active() is None


def test_a_saved_file_has_no_interim_light(two_boxes, start, tmp_path):
    run = start(**ENDLESS)
    until_light_shows(run, two_boxes[1])
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    assert not run.stopped_because
    with bpy.data.libraries.load(path) as (_source, target):
        target.meshes = [item.data.name for item in two_boxes]
    assert [len(mesh.color_attributes) for mesh in target.meshes] == [0, 0]
    until_light_shows(run, two_boxes[1])


def test_a_removed_object_is_named_and_nothing_is_written(two_boxes, start):
    removed, other = two_boxes
    run = start()
    bpy.data.objects.remove(removed)
    with pytest.raises(raybundle.BakeError, match='"Box" was removed'):
        to_the_end(run)
    assert len(other.data.color_attributes) == 0


def test_a_change_of_the_scene_is_said(two_boxes, start):
    run = start(target_error=0.002)
    two_boxes[0].location.z = 1.0
    bpy.context.view_layer.update()
    report = to_the_end(run)
    assert any("was changed while the bake ran" in warning for warning in report.warnings)
    assert "was changed while the bake ran" in bpy.context.scene.raybundle.report
    # Interim light is no change of the scene.
    assert not any("was changed" in warning for warning in to_the_end(start(seed=1)).warnings)


@pytest.mark.parametrize("topology", ['KEEP', 'SUBDIVIDE', 'ADAPTIVE'])
def test_another_scene_may_be_shown_at_the_end(two_boxes, start, topology):
    run = start(topology=topology, patch_size=0.3)
    baked = bpy.context.scene
    bpy.context.window.scene = bpy.data.scenes.new("Other")
    if topology == 'KEEP':
        to_the_end(run)
        assert attribute(two_boxes[0]) is not None and baked.raybundle.report
    else:
        with pytest.raises(raybundle.BakeError, match="another scene"):
            to_the_end(run)
        assert all(attribute(item) is None for item in two_boxes)


def test_a_bake_beside_a_run_is_refused(two_boxes, start):
    start(**ENDLESS)
    with pytest.raises(raybundle.RaybundleError, match="still using"):
        raybundle.bake(bpy.context)


def test_meshes_in_edit_mode_are_left_alone_until_the_end(two_boxes, start):
    box = two_boxes[0]
    bpy.context.view_layer.objects.active = box
    run = start(target_error=0.002)
    bpy.ops.object.mode_set(mode='EDIT')
    report = to_the_end(run)
    assert bpy.context.mode == 'EDIT_MESH'
    bpy.ops.object.mode_set(mode='OBJECT')
    assert {item.status for item in report.objects} == {'baked'}
    assert attribute(box) is not None


def test_the_progress_never_goes_back(two_boxes, start):
    run = start(target_error=0.002)
    fractions = [run.progress.fraction]
    while run.advance():
        fractions.append(run.progress.fraction)
        assert run.progress.text(run.state)
    assert fractions == sorted(fractions)
    assert 0.0 <= fractions[0] <= fractions[-1] <= 1.0


@pytest.mark.parametrize("noise, text", [
    (None, "0 %"), (0.0042, "0 %, noise 0.42 %"), (0.0999, "0 %, noise 10 %"),
    (0.5, "0 %, noise 50 %"), (1.0, "0 %, noise 100 %"), (12.3456, "0 %, noise 1235 %")])
def test_the_noise_so_far_is_in_plain_digits(noise, text):
    state = native.RunState(True, 'bundles', 0.0, noise, 0)
    assert bake_progress.BakeProgress({}).text(state) == text


def test_a_narrow_panel_shows_the_whole_progress(two_boxes, start, monkeypatch):
    run = start(**ENDLESS)
    text = "14 %, noise 0.94 %, 38 s left"
    monkeypatch.setattr(run.progress, 'text', lambda _state: text)
    layout = DrawnLayout()
    context = SimpleNamespace(region=SimpleNamespace(width=192),
                              preferences=bpy.context.preferences)
    assert draw_progress(layout, context)
    assert layout.operators() == ["raybundle.stop"] * 2
    # Names side by side would be cut off.
    assert 'row' not in {method for method, *_ in layout.record}
    if bpy.app.version < (4, 0, 0):
        lines = layout.texts()[1:-2]
        assert len(lines) > 1
        assert " ".join(lines).replace("\N{NO-BREAK SPACE}", " ") == text


def test_no_channels_are_baked_while_a_bake_runs(two_boxes, start):
    assert bpy.ops.raybundle.bake_channels.poll()
    run = start()
    assert not bpy.ops.raybundle.bake_channels.poll()
    run.leave()
    assert bpy.ops.raybundle.bake_channels.poll()
