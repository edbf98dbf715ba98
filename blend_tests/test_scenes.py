# SPDX-License-Identifier: GPL-3.0-or-later
"""All scenes in scenes/ at the default settings: their reports, and exact solutions.

scenes/README.md states the exact solutions and how they are derived. Tolerances follow from the
default target_error, 2 % noise, and from the number of corners over which a mean averages it.
"""

from __future__ import annotations

import functools
import json
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
import pytest
from surface_error import (corner_areas, corner_vertices, face_means, read_colors, surface_error,
                           world_positions)

pytestmark = pytest.mark.needs_library

SCENES = Path(__file__).parent.parent / "scenes"
NAMES = sorted(path.stem for path in SCENES.glob("*.blend"))
CLOSED = ("furnace", "sphere_interior", "big_room", "office", "two_rooms", "thin_wall",
          "laid_table")

REPORT_KEYS = {"seconds", "patches", "bundles", "lines", "exchanges", "estimated_error", "energy",
               "peak_memory_bytes", "objects", "warnings", "skipped"}
SECONDS_KEYS = {"total", "export", "patches", "first_shot", "bundles", "solve", "reconstruction",
                "write_back"}
ENERGY_KEYS = {"emitted", "absorbed", "escaped", "balance_error"}


@dataclass(frozen=True)
class BakedObject:
    light: np.ndarray  # (corners, 3) LIGHTING, W/(m^2 sr)
    positions: np.ndarray  # (corners, 3) in the world, m
    areas: np.ndarray  # (corners,) m^2
    faces: np.ndarray  # (faces, 3) mean light of the corners of each face
    face_areas: np.ndarray  # (faces,) mean area of the corners of each face, m^2

    def mean(self) -> np.ndarray:
        """Returns (3,) the mean light over the area."""
        return self.areas @ self.light / self.areas.sum()


@dataclass(frozen=True)
class BakedScene:
    report: dict
    objects: dict[str, BakedObject]
    face_count: int
    properties: dict[str, list[float]]


@functools.lru_cache(maxsize=None)
def baked(name: str) -> BakedScene:
    bpy.ops.wm.open_mainfile(filepath=str(SCENES / f"{name}.blend"))
    assert bpy.ops.raybundle.bake() == {'FINISHED'}
    scene = bpy.context.scene
    report = json.loads(scene.raybundle.report)
    objects = {}
    face_count = 0
    for entry in report["objects"]:
        if not entry["status"].startswith("baked"):
            continue
        item = bpy.data.objects[entry["name"]]
        light, areas = read_colors(item, "Radiosity"), corner_areas(item)
        objects[item.name] = BakedObject(
            light, world_positions(item)[corner_vertices(item.data)], areas,
            face_means(item, light),
            face_means(item, np.repeat(areas[:, None], 3, axis=1))[:, 0])
        face_count += len(item.data.polygons)
    properties = {key: list(scene[key]) for key in scene.keys() if key.startswith("exact_")}
    return BakedScene(report, objects, face_count, properties)


# --------------------------------------------------------------------------------------------------
# Every scene
# --------------------------------------------------------------------------------------------------


def test_there_are_scenes():
    assert set(CLOSED) < set(NAMES) and len(NAMES) >= 12


@pytest.mark.parametrize("name", NAMES)
def test_report(name):
    scene = baked(name)
    report = scene.report
    assert REPORT_KEYS <= set(report)
    assert SECONDS_KEYS <= set(report["seconds"])
    assert ENERGY_KEYS <= set(report["energy"])
    assert all(value >= 0.0 for value in report["seconds"].values())
    stages = sum(value for key, value in report["seconds"].items() if key != "total")
    assert stages <= 1.01 * report["seconds"]["total"] + 1e-3
    # Each face has at least one patch, and the default limit of patches is kept.
    assert scene.face_count <= report["patches"] <= 100_000
    assert 2 <= report["bundles"] <= 4096
    assert report["lines"] >= report["bundles"]
    assert 0 < report["exchanges"] <= 2 * report["patches"] ** 2
    assert 0.0 <= report["error"]["noise"] <= 0.02 or report["bundles"] == 4096
    assert report["peak_memory_bytes"] > 0
    for entry in report["objects"]:
        assert set(entry) >= {"name", "corners", "status"} and entry["status"]
    for entry in report["skipped"]:
        assert set(entry) >= {"id", "what", "why", "count"}


@pytest.mark.parametrize("name", NAMES)
def test_every_mesh_object_is_baked(name):
    scene = baked(name)
    statuses = {entry["name"]: entry["status"] for entry in scene.report["objects"]}
    for item_name, status in statuses.items():
        if item_name == "divider_turned":
            assert "no light" in status
        elif name == "instances" and "pillar" in item_name:
            assert "reflect and block light" in status
        else:
            assert status == "baked", item_name
    for item_name, item in scene.objects.items():
        entry = next(entry for entry in scene.report["objects"] if entry["name"] == item_name)
        assert entry["corners"] == len(item.light)


@pytest.mark.parametrize("name", NAMES)
def test_light_is_finite_and_not_negative(name):
    for item_name, item in baked(name).objects.items():
        assert np.isfinite(item.light).all(), item_name
        assert item.light.min() >= 0.0, item_name
        if not item_name.endswith("_east") and item_name != "divider_turned":
            assert item.light.max() > 0.0, item_name


@pytest.mark.parametrize("name", NAMES)
def test_energy(name):
    energy = baked(name).report["energy"]
    assert energy["emitted"] > 0.0 and energy["absorbed"] > 0.0 and energy["escaped"] >= 0.0
    # In open scenes, the light that escapes is determined by lines too, and has their noise.
    assert energy["balance_error"] < (1e-3 if name in CLOSED else 2e-3)
    arrived = energy["absorbed"] + energy["escaped"]
    assert abs(arrived / energy["emitted"] - 1.0) == pytest.approx(energy["balance_error"],
                                                                   abs=1e-5)


@pytest.mark.parametrize("name", ["big_room", "office", "two_rooms", "thin_wall", "laid_table"])
def test_nothing_escapes_from_closed_rooms(name):
    energy = baked(name).report["energy"]
    # The furnace and the sphere are not tested, because the outer sides of their faces emit too.
    assert energy["escaped"] < 1e-4 * energy["emitted"]


# --------------------------------------------------------------------------------------------------
# Exact answers
# --------------------------------------------------------------------------------------------------


def test_furnace():
    scene = baked("furnace")
    light = scene.objects["walls"].light
    # Rows of form factors that are counted from lines sum to 1. The remaining errors are the
    # tolerance of the solver and single precision.
    assert np.abs(light / scene.properties["exact_lighting"] - 1.0).max() < 1e-4


def test_facing_squares():
    scene = baked("facing_squares")
    receiver = scene.objects["receiver"]
    exact = scene.properties["exact_mean_lighting"][0]
    # Least squares preserve the integral. The mean over 1600 patches has a tolerance of 0.5 %, a
    # quarter of the noise of a patch.
    assert receiver.mean() == pytest.approx(np.full(3, exact), rel=5e-3)
    # A single vertex has the noise of the patches around it (at a corner that of one patch) and the
    # error of the fit. The tolerance of 3 % is three times the noise, which is about 1 %.
    on_corner = (np.abs(receiver.positions[:, :2]) > 0.499).all(axis=1)
    in_centre = (np.abs(receiver.positions[:, :2]) < 1e-3).all(axis=1)
    assert on_corner.sum() == 4 and in_centre.sum() == 4
    assert receiver.light[on_corner].mean() == pytest.approx(0.13853160599489, rel=0.03)
    assert receiver.light[in_centre].mean() == pytest.approx(0.23945647046077, rel=0.03)


def test_sphere_interior():
    scene = baked("sphere_interior")
    sphere = scene.objects["sphere"]
    exact = np.array(scene.properties["exact_lighting"])
    # Values at single corners vary with the tilt of the flat faces. The mean over the area has the
    # error of the tessellation, 0.03 %, and what remains of 2 % noise over 5120 faces.
    assert sphere.mean() == pytest.approx(exact, rel=3e-3)
    # The RMSE over faces and RGB is the noise, which target_error bounds. The largest of 15360
    # errors is 4 to 5 standard deviations.
    error = surface_error(sphere.faces, np.tile(exact, (len(sphere.faces), 1)), sphere.face_areas)
    assert error.rmse < 0.02, str(error)
    assert np.abs(sphere.faces / exact - 1.0).max() < 0.1


def test_thin_wall_is_tight():
    scene = baked("thin_wall")
    lit = np.mean([item.mean() for name, item in scene.objects.items() if name.endswith("_west")])
    assert lit > 0.1
    dark = {name: item.light for name, item in scene.objects.items()
            if name.endswith("_east") or name == "divider_turned"}
    assert len(dark) == 7
    ceiling = scene.objects["ceiling"]
    centres = ceiling.positions.reshape(-1, 4, 3).mean(axis=1)
    dark["ceiling"] = ceiling.light.reshape(-1, 4, 3)[centres[:, 0] > 0.0]
    for name, light in dark.items():
        assert light.max() < 1e-4 * lit, name
    lit_ceiling = ceiling.light.reshape(-1, 4, 3)[centres[:, 0] < 0.0]
    assert lit_ceiling.min() > 0.01 * lit


def test_open_court_far_ground():
    ground = baked("open_court").objects["ground"]
    far = (np.abs(ground.positions[:, :2]) > 13.0).any(axis=1)
    expected = (0.5 * np.array((0.55, 0.75, 1.0))
                + 3.5 / np.pi * np.array((1.0, 0.93, 0.82)) * 0.749838)
    mean = ground.areas[far] @ ground.light[far] / ground.areas[far].sum()
    # The walls, at a distance of 7 to 10 m, hide less than 1 % of the sky, weighted by the cosine,
    # and reflect light themselves.
    assert mean == pytest.approx(expected, rel=0.01)
    assert np.abs(ground.light[far] / expected - 1.0).max() < 0.05


def test_two_rooms():
    scene = baked("two_rooms")
    west, east = scene.objects["wall_west"].mean(), scene.objects["wall_east"].mean()
    # The east room gets light only through the door.
    assert (0.0 < east).all() and (east < 0.2 * west).all()


def test_equal_places_of_instances_have_equal_light():
    scene = baked("instances")
    steps = [item for name, item in scene.objects.items() if name.startswith("step_")]
    assert len(steps) == 4 and all(item.light.max() > 0.0 for item in steps)
    assert any('"step"' in text for text in scene.report["warnings"])
