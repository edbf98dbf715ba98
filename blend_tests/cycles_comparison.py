# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares small scenes baked by Cycles and by Raybundle, object by object.

Cycles bakes with two seeds of SAMPLES samples each. The mean over an object contains thousands of
samples. The difference between the two seeds shows the noise of their mean, which is asserted to be
below NOISE. Raybundle bakes with `reconstruction` POINT, whose values are point samples at the
vertices as those of Cycles are, so that the edge of a shadow inside a face makes no difference.
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
import raybundle
from cycles_reference import bake_objects
from surface_error import read_colors

SAMPLES = 128
NOISE = 0.003  # relative noise of the mean over an object, of both seeds together
# Relative tolerance of the mean over an object, in each channel.
MEAN_TOLERANCE = 0.01


def square(size: float, cells: int) -> tuple[list, list]:
    """Returns vertices, row by row, and faces of an upward square, centred on the origin."""
    steps = np.linspace(-size / 2, size / 2, cells + 1)
    row = cells + 1
    return ([(x, y, 0.0) for y in steps for x in steps],
            [(i, i + 1, i + row + 1, i + row)
             for j in range(cells) for i in range(j * row, j * row + cells)])


def cycles_light(items: Sequence[bpy.types.Object], passes=("DIRECT", "INDIRECT"),
                 kind: str = "DIFFUSE", samples: int = SAMPLES) -> dict[str, np.ndarray]:
    """Returns the light that Cycles bakes: (corners, 3) by object name.

    Asserts that its noise is below NOISE.
    """
    first, second = (bake_objects(items, samples, seed, kind, frozenset(passes))
                     for seed in (0, 1))
    for name in first:
        mean = 0.5 * (first[name].mean() + second[name].mean())
        noise = 0.5 * abs(float(first[name].mean() - second[name].mean()))
        assert noise <= NOISE * mean, f"{name}: Cycles' noise is {100 * noise / mean:.2f} %"
    return {name: 0.5 * (first[name] + second[name]) for name in first}


def raybundle_light(items: Sequence[bpy.types.Object], output: str = 'LIGHTING', **settings
                    ) -> dict[str, np.ndarray]:
    """Returns the light that Raybundle bakes: (corners, 3) by object name."""
    values = {'target_error': 0.005, 'reconstruction': 'POINT', 'output': output, **settings}
    raybundle.bake(bpy.context, **values)
    return {item.name: read_colors(item) for item in items}


def assert_same_mean(actual: dict[str, np.ndarray], expected: dict[str, np.ndarray],
                     tolerance: float = MEAN_TOLERANCE, scale: dict | None = None) -> None:
    """Asserts that the means of objects agree in each channel.

    The tolerance is relative to the mean of `scale`, values by object name, or of `expected` by
    default.
    """
    for name, values in expected.items():
        mean = values.mean(axis=0)
        size = (scale or expected)[name].mean()
        difference = np.abs(actual[name].mean(axis=0) - mean).max()
        # `pytest -s` shows this.
        print(f"{name}: {mean.round(4).tolist()}, difference "
              f"{100 * difference / max(size, 1e-9):.2f} %")
        assert difference <= tolerance * size + 1e-6, \
            f"{name}: {actual[name].mean(axis=0)} and not {mean}"
