# SPDX-License-Identifier: GPL-3.0-or-later
"""Structs are passed to the native library with each member in its place."""

from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest
from raybundle import native
from raybundle.surface_data import ColorData, SurfaceData

TERMS = [name for name, _ in native._AngleFactors._fields_]
# Texts in the messages of the library about members whose name the message does not contain.
REASONS = {'reflectance.constant': "reflectance and emission must be finite",
           'emission.constant': "reflectance and emission must be finite",
           'gloss.masking': "unknown masking 99", 'diffuse.model': "unknown diffuse model 99"}


def spoiled(data: object) -> Iterator[tuple[str, object]]:
    """Yields, for each member of a dataclass and of dataclasses in it, a copy with a wrong value.

    Each pair is the name of the member, with dots, and a copy in which only this member is invalid.
    """
    for item in fields(data):
        value = getattr(data, item.name)
        if is_dataclass(value):
            wrong = [(f"{item.name}.{name}", part) for name, part in spoiled(value)]
        elif np.ndim(value) == 2:
            wrong = [(f"{item.name}.{term}", np.where(np.arange(4)[:, None] == k, np.nan, value))
                     for k, term in enumerate(TERMS)]
        elif np.ndim(value) == 1:
            wrong = [(item.name, np.full(3, np.nan))]
        else:
            wrong = [(item.name, np.nan if isinstance(value, float) else 99)]
        for name, part in wrong:
            yield name, replace(data, **{item.name: part})


@pytest.mark.needs_library
def test_every_member_of_a_surface_arrives():
    grey = SurfaceData(ColorData(np.full(3, 0.5)))
    members = list(spoiled(grey))
    assert len(members) == len({name for name, _ in members}) > 50
    with native.Scene() as scene:
        assert scene.add_material("Grey", grey, grey) == 0
        for name, wrong in members:
            reason = REASONS.get(name, "there is no image 99" if name.endswith(".image")
                                 else f"back {name}")
            with pytest.raises(native.RaybundleError, match='material "Fog"') as caught:
                scene.add_material("Fog", grey, wrong)
            assert caught.value.code == native.ErrorCode.INVALID_ARGUMENT
            assert reason in caught.value.message, name
        assert scene.add_material("Green", grey, grey) == 1


@pytest.mark.needs_library
def test_surfaces_of_another_shape_are_refused_by_name():
    grey = SurfaceData(ColorData(np.full(3, 0.5)))
    with native.Scene() as scene:
        with pytest.raises(ValueError, match="back.reflectance.constant"):
            scene.add_material("Grey", grey, SurfaceData(ColorData(np.full(4, 0.5))))
        with pytest.raises(ValueError, match="front.reflectance_by_angle"):
            scene.add_material("Grey", replace(grey, reflectance_by_angle=np.zeros(3)), grey)
