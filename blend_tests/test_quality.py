# SPDX-License-Identifier: GPL-3.0-or-later
"""Draft, Good and Final, the noise in %, and the estimated times."""

import json

import bpy
import pytest
import raybundle
from raybundle import quality
from raybundle.bake_report import BakeReport

SECONDS = {'total': 10.0, 'export': 0.5, 'patches': 0.5, 'first_shot': 1.0, 'bundles': 3.0,
           'solve': 4.0, 'reconstruction': 0.5, 'write_back': 0.5}
FULL = {'full_bake': {'target_error': 0.02, 'seconds': SECONDS}}


def settings() -> bpy.types.PropertyGroup:
    return bpy.context.scene.raybundle


def test_good_is_the_default():
    assert settings().quality == 'GOOD'
    assert settings().target_percent == pytest.approx(2.0)


@pytest.mark.parametrize("name, target", quality.TARGETS.items())
def test_a_quality_sets_the_target_and_is_read_from_it(name, target):
    settings().quality = name
    assert settings().target_error == pytest.approx(target)
    settings().target_error = 0.03
    assert settings().quality == 'CUSTOM'
    settings().target_error = target
    assert settings().quality == name


def test_scripts_set_a_quality_by_name():
    raybundle.properties.assign(settings(), 'quality', 'DRAFT')
    assert settings().target_error == pytest.approx(0.1)
    with pytest.raises(ValueError, match="DRAFT, GOOD, FINAL"):
        raybundle.properties.assign(settings(), 'quality', 'BEST')


def test_custom_changes_nothing():
    settings().target_error = 0.03
    settings().quality = 'CUSTOM'
    assert settings().target_error == pytest.approx(0.03)


def test_the_noise_in_percent_is_the_target():
    settings().target_percent = 3.0
    assert settings().target_error == pytest.approx(0.03)
    settings().target_percent = 1e-3  # the limits are those of target_error
    assert settings().target_error == pytest.approx(0.0005)
    settings().target_error = 1.0
    assert settings().target_percent == pytest.approx(100.0)


def test_neither_is_a_setting_of_a_bake():
    assert not {'quality', 'target_percent'} & set(raybundle.properties.BakeSettings.names())


def test_the_time_at_the_same_target_is_that_of_the_bake():
    assert quality.estimated_seconds(FULL, 0.02) == pytest.approx(10.0)


def test_the_law_of_the_stages():
    # Four times less noise: first shot 4^0.95, bundles and solve 4^1.4.
    assert quality.estimated_seconds(FULL, 0.005) == pytest.approx(
        2.0 + 4.0 ** 0.95 + 7.0 * 4.0 ** 1.4)
    # Five times more: 5^-0.4 and 5^-0.9.
    assert quality.estimated_seconds(FULL, 0.1) == pytest.approx(
        2.0 + 5.0 ** -0.4 + 7.0 * 5.0 ** -0.9)


def test_estimates_are_the_same_from_either_end():
    draft = {name: SECONDS[name] for name in quality._FIXED}
    draft.update({name: SECONDS[name] * 5.0 ** -powers[0]
                  for name, powers in quality._POWERS.items()})
    report = {'full_bake': {'target_error': 0.1, 'seconds': draft}}
    for target in quality.TARGETS.values():
        assert quality.estimated_seconds(report, target) == pytest.approx(
            quality.estimated_seconds(FULL, target))


@pytest.mark.parametrize("report", [
    {}, {'seconds': SECONDS}, {'full_bake': {}}, {'full_bake': {'target_error': 0.0,
                                                                'seconds': SECONDS}}])
def test_nothing_is_estimated_without_a_full_bake(report):
    assert quality.estimated_seconds(report, 0.02) is None


@pytest.mark.parametrize("reused", ["UNCHANGED_GEOMETRY", "SCALED_DRAFT"])
def test_a_bake_that_reused_lines_keeps_the_earlier_time(reused):
    report = BakeReport(seconds={'total': 0.1}, skipped=[{'id': reused}])
    assert quality.full_bake(report, 0.01, json.dumps(FULL)) == FULL['full_bake']
    assert quality.full_bake(report, 0.01, "") == {}
    # The report of an earlier release
    assert quality.full_bake(report, 0.01, json.dumps({'seconds': SECONDS})) == {}


@pytest.mark.needs_library
def test_a_bake_stores_its_time_and_relighting_keeps_it(closed_box):
    raybundle.bake(bpy.context, target_error=0.05)
    stored = json.loads(settings().report)
    assert stored['full_bake'] == {'target_error': 0.05, 'seconds': stored['seconds']}
    bpy.ops.raybundle.relight()
    assert json.loads(settings().report)['full_bake'] == stored['full_bake']


@pytest.mark.needs_library
def test_patches_of_a_fine_object_are_half_as_long(closed_box):
    """A cube has 6 faces of 4 n^2 patches, but for rounding."""
    def patches(name: str) -> int:
        closed_box.raybundle.quality = name
        raybundle.bake(bpy.context, patch_size=0.1, max_bundles=16)
        return json.loads(settings().report)['patches']

    assert patches('FINE') == pytest.approx(4 * patches('SCENE'), rel=0.1)
    assert patches('COARSE') == pytest.approx(patches('SCENE') / 4, rel=0.1)


@pytest.mark.needs_library
def test_the_copy_of_a_fine_object_has_finer_faces(closed_box):
    def faces(name: str) -> int:
        closed_box.raybundle.quality = name
        raybundle.bake(bpy.context, patch_size=0.1, topology='SUBDIVIDE', max_bundles=16)
        copy, = (item for item in bpy.context.scene.objects
                 if item.raybundle.source == closed_box)
        assert copy.raybundle.quality == name
        return len(copy.data.polygons)

    assert faces('FINE') == pytest.approx(4 * faces('SCENE'), rel=0.1)
