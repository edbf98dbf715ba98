# SPDX-License-Identifier: GPL-3.0-or-later
"""Draft, Good and Final: three values of target_error, and what each would cost on a scene.

The quality is no setting of its own: it is read from target_error and sets target_error, so that
scripts and files that set target_error directly lose nothing. The cost is the time of the last full
bake, scaled by a law that docs/performance.md measures ("What a quality costs").
"""

from __future__ import annotations

import json
from typing import NamedTuple

import bpy

from .bake_report import BakeReport

# In the order of the buttons. CUSTOM is any other target_error. It has no button.
enum_quality = (
    ('DRAFT', "Draft", "Noise of 10 %: to place lamps and to try materials"),
    ('GOOD', "Good", "Noise of 2 %, which looks clean"),
    ('FINAL', "Final", "Noise of 0.5 %: for bright, smooth surfaces seen close up"),
    ('CUSTOM', "Custom", "The noise that you have set"),
)
TARGETS = {'DRAFT': 0.1, 'GOOD': 0.02, 'FINAL': 0.005}
_NAMES = [item[0] for item in enum_quality]

# The time of a stage grows with the power of 1 / target_error. Above a target of 2 % the power is
# smaller, because a bake has a least number of bundles and of rays.
_KNEE = 0.02
_POWERS = {'first_shot': (0.4, 0.95), 'bundles': (0.9, 1.4), 'solve': (0.9, 1.4)}
# Stages whose time does not depend on the target.
_FIXED = ('export', 'patches', 'reconstruction', 'write_back')
# Identifiers of skips: a bake that reused patches and lines, or the light of a draft, tells nothing
# of a full one's time.
_REUSED = {"UNCHANGED_GEOMETRY", "SCALED_DRAFT"}


class Factors(NamedTuple):
    """How exactly the light of an object is computed, compared with the scene."""

    noise: float  # factor on target_error
    patch_size: float  # factor on the edge length of patches


# The qualities of an object, by name.
enum_object_quality = (
    ('SCENE', "As Scene", "The noise and the patches of the scene"),
    ('COARSE', "Coarse", "Three times the noise of the scene and patches twice as long: for objects "
                         "far away or rarely seen"),
    ('FINE', "Fine", "Half the noise of the scene and patches half as long: for objects seen close "
                     "up. The bake takes longer"),
)
OBJECT_FACTORS = {'SCENE': Factors(1.0, 1.0), 'COARSE': Factors(3.0, 2.0),
                  'FINE': Factors(0.5, 0.5)}


def quality_of(target_error: float) -> str:
    """Returns the quality of a target: 'DRAFT', 'GOOD', 'FINAL' or 'CUSTOM'."""
    for name, target in TARGETS.items():
        if abs(target_error - target) < 1e-6:  # stored in single precision
            return name
    return 'CUSTOM'


def get_quality(settings: bpy.types.PropertyGroup) -> int:
    """Returns the position of the settings' quality in enum_quality."""
    return _NAMES.index(quality_of(settings.target_error))


def set_quality(settings: bpy.types.PropertyGroup, index: int) -> None:
    """Sets target_error to that of a quality, by position in enum_quality. 'CUSTOM' changes
    nothing."""
    if _NAMES[index] in TARGETS:
        settings.target_error = TARGETS[_NAMES[index]]


def get_percent(settings: bpy.types.PropertyGroup) -> float:
    return 100.0 * settings.target_error


def set_percent(settings: bpy.types.PropertyGroup, percent: float) -> None:
    settings.target_error = 0.01 * percent


def full_bake(report: BakeReport, target_error: float, earlier: str) -> dict:
    """Returns what a report keeps to estimate costs: target_error and seconds, by stage, of the
    last bake that computed everything. That is this bake, or if it reused lines, the one that the
    earlier report names. earlier: a report as JSON, or ""."""
    if any(item.get('id') in _REUSED for item in report.skipped):
        return json.loads(earlier).get('full_bake', {}) if earlier else {}
    return {'target_error': target_error, 'seconds': dict(report.seconds)}


def estimated_seconds(report: dict, target_error: float) -> float | None:
    """Returns the time that a full bake of the report's scene would take at another target, s.
    Returns None if the report does not tell. report: as a dictionary, may be empty."""
    bake = report.get('full_bake')
    if not bake or bake.get('target_error', 0.0) <= 0.0:
        return None
    seconds = bake['seconds']
    total = sum(seconds.get(stage, 0.0) for stage in _FIXED)
    for stage, powers in _POWERS.items():
        total += seconds.get(stage, 0.0) * (_relative_work(target_error, powers)
                                            / _relative_work(bake['target_error'], powers))
    return total


def _relative_work(target_error: float, powers: tuple[float, float]) -> float:
    """Returns the work of a stage relative to that at _KNEE. powers: above and below _KNEE."""
    above, below = powers
    return (_KNEE / target_error) ** (above if target_error > _KNEE else below)
