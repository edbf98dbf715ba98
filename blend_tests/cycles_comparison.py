# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares small scenes baked by Cycles and by Raybundle, object by object.

Cycles bakes with different seeds, SAMPLES samples each, until the noise of the mean of all bakes is
below NOISE (bake_until_quiet). How many bakes that takes depends on the version of Cycles: each has
other random samples and shaders. Raybundle bakes with `reconstruction` POINT, whose values are
point samples at the vertices as those of Cycles are, so that the edge of a shadow inside a face
makes no difference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import bpy
import numpy as np
import raybundle
from cycles_reference import bake_objects
from surface_error import read_colors

SAMPLES = 64
NOISE = 0.003  # relative noise of the mean over an object, of all bakes together
# Fewer bakes would estimate their noise poorly. More would not end if Cycles did not converge.
LEAST_BAKES, MOST_BAKES = 4, 32
# Relative tolerance of the mean over an object, in each channel.
MEAN_TOLERANCE = 0.01

Bake = TypeVar('Bake')


def square(size: float, cells: int) -> tuple[list, list]:
    """Returns vertices, row by row, and faces of an upward square, centred on the origin."""
    steps = np.linspace(-size / 2, size / 2, cells + 1)
    row = cells + 1
    return ([(x, y, 0.0) for y in steps for x in steps],
            [(i, i + 1, i + row + 1, i + row)
             for j in range(cells) for i in range(j * row, j * row + cells)])


def bake_until_quiet(bake: Callable[[int], Bake], means: Callable[[Bake], np.ndarray]
                     ) -> list[Bake]:
    """Returns bakes of Cycles with the seeds 0, 1, ...: so many that the noise of their mean is
    below NOISE. Fails if MOST_BAKES do not suffice.

    bake: takes a seed. means: returns the light of a bake, for which the noise is computed, (n, 3)
    or (3,). The noise is the standard error of the mean of all bakes, relative to the brightest
    channel.
    """
    bakes: list[Bake] = []
    noise = np.inf
    while noise > NOISE and len(bakes) < MOST_BAKES:
        bakes.append(bake(len(bakes)))
        if len(bakes) < LEAST_BAKES:
            continue
        light = np.stack([means(item) for item in bakes]).astype(float)
        error = light.std(axis=0, ddof=1).max(axis=-1) / np.sqrt(len(bakes))
        noise = (error / np.maximum(light.mean(axis=0).max(axis=-1), 1e-30)).max()
    # `pytest -s` shows this.
    print(f"Cycles' noise {100 * noise:.2f} % after {len(bakes)} bakes")
    assert noise <= NOISE
    return bakes


def cycles_light(items: Sequence[bpy.types.Object], passes=("DIRECT", "INDIRECT"),
                 kind: str = "DIFFUSE", samples: int = SAMPLES) -> dict[str, np.ndarray]:
    """Returns the light that Cycles bakes: (corners, 3) by object name. Its noise is below
    NOISE. samples: of each bake."""
    bakes = bake_until_quiet(
        lambda seed: bake_objects(items, samples, seed, kind, frozenset(passes)),
        lambda light: np.stack([values.mean(axis=0) for values in light.values()]))
    return {name: np.mean([light[name] for light in bakes], axis=0) for name in bakes[0]}


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
