# SPDX-License-Identifier: GPL-3.0-or-later
"""At the default target, the light of each single object is clean, not only the scene on average.

The first scene is a room under a lamp with a smooth sphere and a block, which are a small part of
the scene's area. Two bakes with different seeds determine the true noise of each object. The noise
that the report states must be at least two thirds of the true noise, if that is above 0.75 %. The
stated noise must be below the target, or a warning must name the object. The difference of the
bakes at a corner, divided by the square root of 2 and relative to the light there, must be below
4 % at its 95th percentile. Measured are 3.8 % on the sphere, most of it beside the point where the
sphere touches the floor, and 0.5 to 3.3 % on other objects. cleanliness.py measures all scenes in
this way, but against converged bakes.
"""

from __future__ import annotations

import functools

import bpy
import lamp_rooms  # noqa: F401  (makes `build` importable)
import numpy as np
import pytest
import raybundle
from build.construction import (Diffuse, Emission, Sum, add_mesh, box, grid, material, room, smooth,
                                uv_sphere)
from cleanliness import DARK, MOST
from object_light import open_file
from surface_error import corner_areas, read_colors, surface_error

TARGET = 0.02  # default of target_error

Light = dict[str, np.ndarray]  # (corners, 3) by object name

pytestmark = pytest.mark.needs_library


def _room_with_props() -> None:
    grey = material("grey", Diffuse((0.8, 0.8, 0.8)))
    for wall, shape in room((8, 8, 8), (16, 16, 16)).items():
        add_mesh(wall, shape, grey)
    block = add_mesh("block", box((2.4, 2.4, 5)), grey)
    block.location, block.rotation_euler = (-1.5, 1, 0), (0, 0, 0.3)
    smooth(add_mesh("sphere", uv_sphere(1.3, 64, 32, at=(1.5, -1, 1.3)), grey).data)
    add_mesh("lamp", grid((-0.8, -0.8, 7.8), (0, 1.6, 0), (1.6, 0, 0), 1, 1),
             material("lamp", Sum(Diffuse((0.8, 0.8, 0.8)), Emission((1, 1, 1), 20))))
    bpy.context.view_layer.update()


def _bake(seed: int) -> tuple[raybundle.BakeReport, Light]:
    report = raybundle.bake(bpy.context, output='LIGHTING', domain='CORNER', seed=seed)
    return report, {entry.name: read_colors(bpy.data.objects[entry.name]).astype(float)
                    for entry in report.objects}


def _differences(first: Light, second: Light) -> dict[str, tuple[float, float]]:
    """Returns two measures of the noise of a single bake, by object name.

    The first is the root mean square over the area, relative to that of the object's light. The
    second is the 95th percentile over the corners, relative to the light at each corner, where
    light below DARK times the mean of the scene counts as this much.
    """
    areas = {name: corner_areas(bpy.data.objects[name]) for name in first}
    mean = sum(areas[name] @ first[name].mean(axis=1) for name in first) / sum(
        area.sum() for area in areas.values())
    found = {}
    for name, light in first.items():
        off = (light - second[name]) / np.sqrt(2)
        seen = np.abs(off).max(axis=1) / np.maximum(light.max(axis=1), DARK * mean)
        found[name] = (np.sqrt((areas[name] @ off ** 2).sum() / (areas[name] @ light ** 2).sum()),
                       np.percentile(seen, 95))
    return found


def test_a_smooth_sphere_in_a_room_is_not_mottled():
    _room_with_props()
    report, first = _bake(1)
    _, second = _bake(2)
    differences = _differences(first, second)
    for entry in report.objects:
        name, stated = entry.name, entry.error['noise']
        true, worst = differences[name]
        assert true < 1.5 * max(stated, 0.005), (name, true, stated)
        assert stated < TARGET or any(f'"{name}"' in text and "noise" in text
                                      for text in report.warnings), (name, stated)
        assert worst < MOST, (name, worst)


@functools.lru_cache(maxsize=None)
def _house_bakes() -> tuple[raybundle.BakeReport, Light, Light]:
    """Returns the report of the first bake, and the light of both bakes."""
    (report, first), (_, second) = _bake(1), _bake(2)
    return report, first, second


def _house_on_plain() -> tuple[raybundle.BakeReport, Light, Light]:
    """Opens the scene, which provides the areas of objects, and returns _house_bakes()."""
    open_file('house_on_plain', 1)
    return _house_bakes()


def test_a_room_lit_through_its_windows_is_clean():
    """The noise of each object at its corners is below 8 %, at the 95th percentile.

    Only few of the lines from the sunny plain around the house pass through its windows, and the
    surfaces that local rays of the furniture meet have noise themselves. Five pairs of seeds have
    3.8 to 6.3 % on the worst object. With a single pass of rays it is 9.9 to 14.2 %.
    """
    report, first, second = _house_on_plain()
    # Some corners, such as those of the shelf far from the windows, keep 6 % of noise. A warning
    # must name each object with more than twice the target.
    noisy = [entry.name for entry in report.objects if entry.error['noise'] > 2 * TARGET]
    assert noisy and all(any("noisier" in text and f'"{name}"' in text for text in report.warnings)
                         for name in noisy)
    differences = _differences(first, second)
    for name in first:
        assert differences[name][1] < 0.08, (name, differences[name])


def test_a_small_house_is_as_precise_as_the_plain_around_it():
    _, first, second = _house_on_plain()
    names = [name for name in first if name != "plain"]
    error = surface_error(*(np.concatenate([part[name] for name in names])
                            for part in (first, second)),
                          np.concatenate([corner_areas(bpy.data.objects[name]) for name in names]))
    print(error)
    # The difference of two bakes is the square root of 2 times the noise of a single bake. That is
    # at most 2 % on the small objects. With lines of uniform density it would be 8 %.
    assert error.rmse < np.sqrt(2.0) * TARGET, str(error)


def test_gathering_corners_are_clean():
    """The corners of a mesh that gather their light do so with rays that no seed changes.

    An error of theirs therefore looks like light, and only a lower target shows it. At the 95th
    percentile, the pebble is 2.3 to 2.7 % off, and was 4.2 to 5.2 % off with half as many rays.
    """
    light = []
    for target in (TARGET, 0.2 * TARGET):
        open_file('instances', 1)
        raybundle.bake(bpy.context, output='LIGHTING', domain='CORNER', target_error=target)
        light.append(read_colors(bpy.data.objects["pebble"]).astype(float))
    first, finer = light
    off = np.abs(first - finer).max(axis=1) / np.maximum(finer.max(axis=1), DARK * finer.mean())
    assert np.percentile(off, 95) < 0.035, np.percentile(off, 95)
