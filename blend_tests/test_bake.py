# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes through the add-on: exact results, operators, invalid input, and data left unchanged."""

import importlib
import json

import bpy
import numpy as np
import pytest
import raybundle
from conftest import CUBE_FACES, CUBE_VERTICES, FURNACE_EMISSION_RADIANCE, FURNACE_LIGHT
from raybundle import native
from raybundle.native import ErrorCode
from surface_error import read_colors

bake_cache = importlib.import_module("raybundle.bake_cache")

pytestmark = pytest.mark.needs_library

SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]

# Rows of form factors that are counted from lines sum to 1 by construction. The remaining errors
# are the tolerance of the solver and single precision.
FURNACE_TOLERANCE = 1e-4

REPORT_KEYS = {"seconds", "patches", "bundles", "lines", "exchanges", "estimated_error", "error",
               "energy", "peak_memory_bytes", "objects", "warnings", "skipped"}
SECONDS_KEYS = {"total", "export", "patches", "first_shot", "bundles", "solve", "reconstruction",
                "write_back"}


def bake(**overrides):
    # Few patches and bundles, to save time. The tested results do not depend on them.
    overrides = {"max_patches": 2000, "max_bundles": 128, **overrides}
    return raybundle.bake(bpy.context, **overrides)


def statuses(report):
    return {item.name: item.status for item in report.objects}


@pytest.fixture
def floor_and_lamp(new_object, new_light, new_material):
    """Returns a square of 1 m in the plane z = 0, under a point light near its left edge."""
    item = new_object("Floor", SQUARE, [(0, 1, 2, 3)], new_material("White", (0.5, 0.5, 0.5)))
    new_light("Lamp", 'POINT', 10.0, (0.1, 0.5, 0.5), shadow_soft_size=0.0)
    return item


def point_light_on_floor(x, y):
    """Returns H / pi, W/(m^2 sr), of the lamp of floor_and_lamp at points (x, y) of the floor, m.

    H = I cos / d^2 with I = P / (4 pi).
    """
    squared = (x - 0.1) ** 2 + (y - 0.5) ** 2 + 0.25
    return 10.0 / (4.0 * np.pi) * 0.5 / squared ** 1.5 / np.pi


# --------------------------------------------------------------------------------------------------
# Exact answers
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("output, expected", [
    ('LIGHTING', FURNACE_LIGHT),
    # (E + rho H) / pi = B / pi, which equals LIGHTING in a furnace.
    ('COMBINED', FURNACE_LIGHT),
    ('DIRECT', FURNACE_EMISSION_RADIANCE),
    ('INDIRECT', FURNACE_LIGHT - FURNACE_EMISSION_RADIANCE),
])
@pytest.mark.parametrize("domain", ['CORNER', 'POINT'])
def test_furnace(closed_box, output, expected, domain):
    report = bake(output=output, domain=domain)
    values = read_colors(closed_box)
    assert len(values) == (24 if domain == 'CORNER' else 8)
    assert np.abs(values / expected - 1.0).max() < FURNACE_TOLERANCE
    assert report.energy['balance_error'] < 1e-3
    assert closed_box.data.color_attributes["Radiosity"].domain == domain


@pytest.mark.parametrize("seed", [0, 1])
def test_furnace_with_a_modifier(closed_box, seed):
    closed_box.modifiers.new("Subdivision", 'SUBSURF').levels = 2
    before = len(closed_box.data.attributes)
    bake(seed=seed)
    assert np.abs(read_colors(closed_box) / FURNACE_LIGHT - 1.0).max() < FURNACE_TOLERANCE
    assert len(closed_box.data.attributes) == before + 1


@pytest.mark.parametrize("domain", ['CORNER', 'POINT'])
def test_faces_of_a_modifier_that_no_written_corner_touches_are_spared(floor_and_lamp, domain):
    modifier = floor_and_lamp.modifiers.new("Subdivision", 'SUBSURF')
    modifier.subdivision_type, modifier.levels = 'SIMPLE', 4
    spared = bake(output='LIGHTING', domain=domain)
    found = read_colors(floor_and_lamp)
    bpy.context.view_layer.objects.active = floor_and_lamp
    bpy.ops.object.modifier_apply(modifier=modifier.name)
    whole = bake(output='LIGHTING', domain=domain)
    assert spared.patches == whole.patches
    # The subdivided face has 256 faces with 4 corners each. Only 4 of these corners are written.
    assert {item['why']: item['count'] for item in spared.skipped}[
        "no result is needed there"] == 4 * 256 - 4
    # With so few written corners, the light is gathered for each of them, at a point that lies
    # inside the face by a hundredth of the face's width. The tolerance covers this distance.
    exact = np.array([point_light_on_floor(x, y) for x, y, _ in SQUARE])
    assert found == pytest.approx(np.repeat(exact[:, None], 3, axis=1), rel=2e-3)


def test_outward_normals_are_named_and_the_back_side_can_be_baked(closed_box):
    closed_box.data.flip_normals()
    report = bake()
    assert "no light" in statuses(report)["Box"]
    assert any('"Box"' in text for text in report.warnings)
    assert np.abs(read_colors(closed_box)).max() == 0.0
    closed_box.raybundle.side = 'BACK'
    report = bake()
    assert statuses(report) == {"Box": "baked"}
    assert np.abs(read_colors(closed_box) / FURNACE_LIGHT - 1.0).max() < FURNACE_TOLERANCE


def test_irradiance_under_a_point_light(floor_and_lamp):
    # A flat square gets no light that it reflects itself. Least squares preserve the integral of
    # the light over the square, which is compared with a fine sum.
    bake(output='LIGHTING', max_patches=20_000)
    grid = (np.arange(400) + 0.5) / 400
    x, y = np.meshgrid(grid, grid)
    # The regularisation does not change the mean over a single face. Patches are
    # 1 % of the square.
    assert read_colors(floor_and_lamp).mean() == pytest.approx(point_light_on_floor(x, y).mean(),
                                                               rel=1e-2)


# --------------------------------------------------------------------------------------------------
# Operators and the report
# --------------------------------------------------------------------------------------------------


def test_operator_in_background(closed_box):
    assert bpy.ops.raybundle.bake() == {'FINISHED'}
    attributes = closed_box.data.color_attributes
    assert attributes[attributes.active_color_index].name == "Radiosity"
    assert attributes[attributes.render_color_index].name == "Radiosity"
    report = json.loads(bpy.context.scene.raybundle.report)
    assert REPORT_KEYS <= set(report)
    assert SECONDS_KEYS <= set(report["seconds"])
    for item in report["objects"]:
        assert set(item.pop("error")) == set(report["error"])
    assert report["objects"] == [{"name": "Box", "corners": 24, "status": "baked", "vertices": 8,
                                  "adaptive_vertices": 0}]
    assert report["seconds"]["total"] >= report["seconds"]["export"] > 0.0


def test_scene_settings_and_overrides(closed_box):
    settings = bpy.context.scene.raybundle
    settings.attribute, settings.data_type, settings.domain = "Light", 'BYTE_COLOR', 'POINT'
    report = bake()
    attribute = closed_box.data.color_attributes["Light"]
    assert (attribute.data_type, attribute.domain) == ('BYTE_COLOR', 'POINT')
    # The light is 1.25, which 8 bits cannot represent.
    assert any("brighter than 1" in text for text in report.warnings)
    bake(attribute="Other", data_type='FLOAT_COLOR')
    assert "Other" in closed_box.data.color_attributes
    assert settings.attribute == "Light"


@pytest.mark.parametrize("overrides, message", [
    ({"no_such": 1}, "no_such"), ({"solver": "MAGIC"}, "MAGIC"), ({"seed": "many"}, "many"),
    ({"target_error": -1.0}, "target_error"), ({"attribute": ""}, "name"),
])
def test_wrong_settings_are_refused(closed_box, overrides, message):
    with pytest.raises(raybundle.BakeError, match=message):
        bake(**overrides)
    assert len(closed_box.data.color_attributes) == 0


def test_progress_names_the_stages(closed_box):
    seen = []
    bake(progress=lambda stage, fraction: seen.append((stage, fraction)))
    stages = list(dict.fromkeys(stage for stage, _ in seen))
    assert set(stages) == {'export', *native.STAGES, 'write_back'}
    assert stages[0] == 'export' and stages[-1] == 'write_back'
    assert all(0.0 <= fraction <= 1.0 for _, fraction in seen)


@pytest.mark.parametrize("stage", ['export', *native.STAGES, 'write_back'])
def test_cancel_leaves_the_mesh_unchanged(closed_box, stage):
    with pytest.raises(raybundle.RaybundleError) as caught:
        bake(progress=lambda current, fraction: current != stage)
    assert caught.value.code == ErrorCode.CANCELLED
    assert len(closed_box.data.color_attributes) == 0
    assert bpy.context.scene.raybundle.report == ""
    # The cancelled bake must not affect the next one.
    bake()
    assert np.abs(read_colors(closed_box) / FURNACE_LIGHT - 1.0).max() < FURNACE_TOLERANCE


def test_an_exception_in_progress_reaches_the_caller(closed_box):
    def fail(stage, fraction):
        if stage == 'bundles':
            raise ZeroDivisionError("on purpose")

    with pytest.raises(ZeroDivisionError, match="on purpose"):
        bake(progress=fail)
    assert len(closed_box.data.color_attributes) == 0


def test_relight_uses_the_lines_again(closed_box):
    with pytest.raises(RuntimeError, match="bake first"):
        bpy.ops.raybundle.relight()
    assert bpy.ops.raybundle.bake() == {'FINISHED'}
    emission = next(node for node in closed_box.data.materials[0].node_tree.nodes
                    if node.type == 'EMISSION')
    emission.inputs['Strength'].default_value = 2.0
    assert bpy.ops.raybundle.relight() == {'FINISHED'}
    assert np.abs(read_colors(closed_box) / (2.0 * FURNACE_LIGHT) - 1.0).max() < FURNACE_TOLERANCE
    report = json.loads(bpy.context.scene.raybundle.report)
    assert report["seconds"]["bundles"] == 0.0
    assert "UNCHANGED_GEOMETRY" in {item["id"] for item in report["skipped"]}


def test_a_new_file_has_nothing_to_relight(closed_box):
    bake()
    assert bake_cache.has_result(bpy.context.scene)
    bpy.ops.wm.read_homefile(use_empty=True)
    assert not bake_cache.has_result(bpy.context.scene)


def test_clear_and_preview(closed_box):
    closed_box.data.color_attributes.new("Paint", 'BYTE_COLOR', 'CORNER')
    bpy.ops.raybundle.bake()
    closed_box.data.color_attributes.active_color_index = 0
    assert bpy.ops.raybundle.preview() == {'FINISHED'}
    attributes = closed_box.data.color_attributes
    assert attributes[attributes.active_color_index].name == "Radiosity"
    assert bpy.ops.raybundle.clear() == {'FINISHED'}
    assert [item.name for item in attributes] == ["Paint"]
    assert bpy.context.scene.raybundle.report == ""
    assert not bake_cache.has_result(bpy.context.scene)


@pytest.mark.parametrize("domain, count", [('CORNER', 4), ('POINT', 4)])
def test_error_attribute(floor_and_lamp, domain, count):
    mesh = floor_and_lamp.data
    bake(domain=domain)
    assert "Radiosity Error" not in mesh.attributes
    report = bake(domain=domain, write_error=True)
    attribute = mesh.attributes["Radiosity Error"]
    assert (attribute.domain, attribute.data_type) == (domain, 'FLOAT')
    errors = np.empty(count, np.float32)
    attribute.data.foreach_get('value', errors)
    # The scene is one face under a lamp. The error of the report is relative to the light. The
    # corners' errors agree with it within a factor of 3, because the light and its error are spread
    # over the shares of the corners almost evenly.
    light = read_colors(floor_and_lamp)
    relative = np.sqrt((errors ** 2).mean() / (light ** 2).mean())
    assert 0.3 < relative / report.error['total'] < 3.0
    assert any('"Floor"' in text and "too coarse" in text for text in report.warnings)
    # A bake without write_error removes the attribute, and so does the operator Clear.
    bake(domain=domain)
    assert "Radiosity Error" not in mesh.attributes
    bake(domain=domain, write_error=True)
    assert bpy.ops.raybundle.clear() == {'FINISHED'}
    assert "Radiosity Error" not in mesh.attributes


def test_error_attribute_of_a_subdivided_copy(floor_and_lamp):
    bake(domain='POINT', topology='SUBDIVIDE', write_error=True)
    copies = [item for item in bpy.context.scene.objects
              if item.raybundle.source == floor_and_lamp]
    assert len(copies[0].data.attributes["Radiosity Error"].data) == len(copies[0].data.vertices)


def test_report_states_the_error(closed_box):
    report = bake()
    for error in (report.error, report.objects[0].error):
        assert set(error) == {'noise', 'discretisation', 'mesh', 'total'}
        assert max(error.values()) < FURNACE_TOLERANCE


def test_same_seed_same_result_for_any_number_of_threads(floor_and_lamp, new_object):
    new_object("Wall", [(1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)], [(0, 3, 2, 1)])
    results = []
    for threads in (1, 2):
        bake_cache.discard_all()
        bake(threads=threads, seed=7)
        results.append(read_colors(floor_and_lamp))
    assert np.abs(results[0] - results[1]).max() <= 1e-5 * results[0].max()


# --------------------------------------------------------------------------------------------------
# What gets the light
# --------------------------------------------------------------------------------------------------


def test_selected_scope(floor_and_lamp, new_object):
    other = new_object("Other", SQUARE, [(0, 1, 2, 3)], location=(0, 0, -1))
    for item in bpy.context.scene.objects:
        item.select_set(item == other)
    report = bake(scope='SELECTED')
    assert statuses(report) == {"Other": "baked"}
    assert len(floor_and_lamp.data.color_attributes) == 0
    # The floor still casts its shadow on the other square: without the floor there is more light.
    shadowed = read_colors(other).mean()
    floor_and_lamp.raybundle.role = 'IGNORE'
    bake(scope='SELECTED')
    assert read_colors(other).mean() > 2.0 * shadowed


def shared_squares(floor):
    """Returns a second object with the floor's mesh, 2 m further away from the lamp."""
    other = bpy.data.objects.new("Far", floor.data)
    other.location = (2.0, 0.0, 0.0)
    bpy.context.scene.collection.objects.link(other)
    bpy.context.view_layer.update()
    return other


def test_single_user_copies_have_their_own_light(floor_and_lamp):
    far = shared_squares(floor_and_lamp)
    report = bake(shared_meshes='SINGLE_USER')
    assert far.data != floor_and_lamp.data
    assert read_colors(floor_and_lamp).mean() > 3.0 * read_colors(far).mean() > 0.0
    assert any("shared by 2" in text for text in report.warnings)
    # The second bake has the same geometry, because each object has its copy: no lines are traced.
    report = bake(shared_meshes='SINGLE_USER')
    assert report.seconds['bundles'] == 0.0
    # The only warnings are that one face is too coarse for a lamp so near.
    assert all("too coarse" in text for text in report.warnings)


def test_averaged_instances_show_their_mean(floor_and_lamp):
    far = shared_squares(floor_and_lamp)
    report = bake(shared_meshes='AVERAGE')
    assert far.data == floor_and_lamp.data
    averaged = read_colors(far)
    assert any("mean light" in text for text in report.warnings)
    bake(shared_meshes='SINGLE_USER')
    mean = 0.5 * (read_colors(floor_and_lamp) + read_colors(far))
    # Both bakes use the same lines, so that only rounding differs.
    assert averaged == pytest.approx(mean, rel=1e-4)


def test_two_scenes_keep_their_own_lines(closed_box):
    bake()
    first = bpy.context.scene
    assert bake_cache.has_result(first)
    assert not bake_cache.has_result(bpy.data.scenes.new("Second"))


# --------------------------------------------------------------------------------------------------
# Subdivided copies
# --------------------------------------------------------------------------------------------------


def test_subdivided_copy_stands_in_for_the_original(floor_and_lamp, new_material):
    original = floor_and_lamp
    original.data.materials.append(new_material("Second", (0.2, 0.2, 0.2)))
    layer = original.data.uv_layers.new(name="Chart")
    uvs = np.array(SQUARE, np.float32)[:, :2] * [2.0, 3.0]
    layer.data.foreach_set('uv', uvs.astype(np.float32).ravel())
    original.location, original.scale = (0.0, 0.0, 0.0), (2.0, 1.0, 1.0)
    parent = bpy.data.objects.new("Parent", None)
    parent.location = (0.0, 0.0, -1.0)
    bpy.context.scene.collection.objects.link(parent)
    original.parent = parent
    bpy.context.view_layer.update()
    report = bake(topology='SUBDIVIDE', patch_size=0.1)

    copy = bpy.data.objects["Floor (Radiosity)"]
    mesh = copy.data
    assert statuses(report)["Floor (Radiosity)"] == "baked"
    assert len(original.data.color_attributes) == 0
    assert original.hide_render and not original.visible_get() and copy.visible_get()
    assert copy.parent == parent and copy.users_collection == original.users_collection
    assert np.array(copy.matrix_world) == pytest.approx(np.array(original.matrix_world), abs=1e-6)
    assert [item.name for item in mesh.materials] == ["White", "Second"]
    # The object is 2 m by 1 m in the world. The copy has edges of at most 0.2 m and the whole area.
    points = np.array([copy.matrix_world @ item.co for item in mesh.vertices])
    edges = np.array([item.vertices for item in mesh.edges])
    assert np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1).max() <= 0.2 + 1e-6
    assert sum(item.area for item in mesh.polygons) == pytest.approx(1.0, rel=1e-5)
    # UVs are interpolated linearly over the square, and the front side still faces up.
    corner_vertices = [item.vertex_index for item in mesh.loops]
    local = np.array([item.co for item in mesh.vertices])[corner_vertices]
    carried = np.array([item.uv for item in mesh.uv_layers["Chart"].data])
    assert carried == pytest.approx(local[:, :2] * [2.0, 3.0], abs=1e-5)
    assert all(item.normal.z > 0.99 for item in mesh.polygons)


def test_subdivided_copy_is_replaced_and_cleared(floor_and_lamp):
    for _ in range(2):
        bake(topology='SUBDIVIDE', patch_size=0.1)
        assert sorted(item.name for item in bpy.data.objects) == [
            "Floor", "Floor (Radiosity)", "Lamp"]
    # The lamp is close to the left edge, and the finer mesh shows the variation of its light.
    copy = bpy.data.objects["Floor (Radiosity)"]
    assert read_colors(copy).max() > 4.0 * read_colors(copy).min()
    # A bake that fails leaves the copy in place.
    with pytest.raises(raybundle.RaybundleError):
        bake(topology='SUBDIVIDE', patch_size=0.1, progress=lambda *_: False)
    assert copy.visible_get() and not floor_and_lamp.visible_get()
    assert bpy.ops.raybundle.clear() == {'FINISHED'}
    assert sorted(item.name for item in bpy.data.objects) == ["Floor", "Lamp"]
    assert floor_and_lamp.visible_get() and not floor_and_lamp.hide_render
    assert [item.name for item in bpy.data.meshes] == ["Floor"]


def test_subdivided_furnace_with_smooth_shading(closed_box):
    closed_box.data.polygons.foreach_set('use_smooth', [True] * 6)
    closed_box.data.update()
    bake(topology='SUBDIVIDE', patch_size=0.25, max_patches=20_000)
    copy = bpy.data.objects["Box (Radiosity)"]
    assert len(copy.data.polygons) > 12
    assert all(item.use_smooth for item in copy.data.polygons)
    assert np.abs(read_colors(copy) / FURNACE_LIGHT - 1.0).max() < FURNACE_TOLERANCE


# --------------------------------------------------------------------------------------------------
# Bad input
# --------------------------------------------------------------------------------------------------


def test_bad_objects_are_named_and_the_rest_is_baked(closed_box, new_object):
    bad = new_object("Bad", SQUARE, [(0, 1, 2, 3)])
    bad.data.vertices[0].co.x = float("nan")
    new_object("Empty", [], [])
    report = bake()
    assert statuses(report)["Box"] == "baked"
    assert "not finite" in statuses(report)["Bad"] and "no faces" in statuses(report)["Empty"]
    for name in ("Bad", "Empty"):
        assert any(f'"{name}"' in text for text in report.warnings)
        assert len(bpy.data.objects[name].data.color_attributes) == 0
    assert np.abs(read_colors(closed_box) / FURNACE_LIGHT - 1.0).max() < FURNACE_TOLERANCE


def test_zero_area_faces(closed_box):
    mesh = closed_box.data
    mesh.clear_geometry()
    faces = [face[::-1] for face in CUBE_FACES]
    mesh.from_pydata([*CUBE_VERTICES, (0, 0, 0), (0, 0, 0), (0, 0, 0)], [], [*faces, (8, 9, 10)])
    bake()
    values = read_colors(closed_box)
    assert len(values) == 27 and np.isfinite(values).all()
    assert np.abs(values[:24] / FURNACE_LIGHT - 1.0).max() < FURNACE_TOLERANCE


def test_nothing_to_bake(new_object):
    with pytest.raises(raybundle.BakeError, match="Nothing to bake"):
        bake()
    new_object("Hollow", SQUARE, [])
    with pytest.raises(raybundle.BakeError, match='"Hollow": it has no faces'):
        bake()
    with pytest.raises(RuntimeError, match='"Hollow"'):
        bpy.ops.raybundle.bake()


def test_no_light_is_black_and_says_so(new_object):
    item = new_object("Floor", SQUARE, [(0, 1, 2, 3)])
    report = bake()
    assert any("no light" in text for text in report.warnings)
    assert np.abs(read_colors(item)).max() == 0.0


def test_reflectance_of_one_is_clamped_and_named(closed_box, new_material):
    closed_box.data.materials[0] = new_material("Snow", (1.0, 1.0, 1.0), (0.01, 0.01, 0.01))
    report = bake()
    assert any('Snow' in text for text in report.warnings)
    # Reflectance is clamped to 0.999, so that the light is L_E / 0.001. The tolerance is that of
    # the solver, with a solution of 1000 times the emission.
    assert read_colors(closed_box) == pytest.approx(np.full((24, 3), 10.0), rel=1e-2)


def test_a_warning_of_lost_light_comes_first(new_object, new_material, new_world):
    new_world((1.0, 1.0, 1.0))
    # Between white boards, which absorb next to nothing, two bundles create or lose light.
    white = new_material("White", (1.0, 1.0, 1.0))
    for k in range(2):
        boards = [(x + 2.06 * k, y, z) for x, y, z in CUBE_VERTICES]
        new_object(f"Board {k}", boards, CUBE_FACES, white)
    cloud = bpy.data.volumes.new("Cloud")
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Cloud", cloud))
    report = bake(max_bundles=2, patch_size=0.2)
    assert report.energy['balance_error'] > 0.01
    assert "energy balance" in report.warnings[0]
    assert any("Cloud" in text for text in report.warnings[1:])


def test_edit_mode_is_left_and_entered_again(closed_box):
    bpy.context.view_layer.objects.active = closed_box
    bpy.ops.object.mode_set(mode='EDIT')
    assert bpy.ops.raybundle.bake() == {'FINISHED'}
    assert bpy.context.mode == 'EDIT_MESH'
    bpy.ops.object.mode_set(mode='OBJECT')
    assert np.abs(read_colors(closed_box) / FURNACE_LIGHT - 1.0).max() < FURNACE_TOLERANCE


def test_a_name_that_is_taken_is_refused(closed_box):
    closed_box.data.uv_layers.new(name="UVMap")
    with pytest.raises(raybundle.BakeError, match='"Box".*"UVMap"'):
        bake(attribute="UVMap")
    assert [item.name for item in closed_box.data.uv_layers] == ["UVMap"]


def test_linked_data_is_lit_but_not_written(closed_box, new_object, tmp_path):
    path = str(tmp_path / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (source, target):
        target.objects = ["Box"]
    bpy.context.scene.collection.objects.link(bpy.data.objects["Box"])
    inside = new_object("Inside", SQUARE, [(0, 1, 2, 3)])
    bpy.context.view_layer.update()
    report = bake()
    assert "linked" in statuses(report)["Box"] and statuses(report)["Inside"] == "baked"
    assert len(bpy.data.objects["Box"].data.color_attributes) == 0
    # The light that the linked box emits reaches the square inside the box.
    assert read_colors(inside).min() > 0.0


@pytest.mark.parametrize("content, message", [
    (None, "is missing.*cmake"), (b"not a library", "cannot be loaded")])
def test_missing_or_broken_library(closed_box, tmp_path, monkeypatch, content, message):
    path = tmp_path / "libraybundle.so"
    if content is not None:
        path.write_bytes(content)
    monkeypatch.setattr(native, "_library", None)
    monkeypatch.setattr(native, "library_path", lambda: path)
    with pytest.raises(raybundle.RaybundleError, match=message):
        bake()
    with pytest.raises(RuntimeError, match="libraybundle.so"):
        bpy.ops.raybundle.bake()
    assert len(closed_box.data.color_attributes) == 0


def test_library_of_another_version(closed_box, monkeypatch):
    found = f"interface version {native.ABI_VERSION}, .* needs 999"
    monkeypatch.setattr(native, "_library", None)
    monkeypatch.setattr(native, "ABI_VERSION", 999)
    with pytest.raises(raybundle.RaybundleError, match=found):
        bake()


def test_arrays_of_wrong_shape_or_type_are_refused():
    with native.Scene() as scene:
        with pytest.raises(ValueError, match="vertices"):
            scene.add_mesh("Mesh", np.zeros((3, 2)), np.arange(3), np.array([0, 3]), None)
        with pytest.raises(TypeError, match="corner_vertices"):
            scene.add_mesh("Mesh", np.zeros((3, 3)), np.zeros(3), np.array([0, 3]), None)
        with pytest.raises(raybundle.RaybundleError) as caught:
            scene.add_mesh("Mesh", np.zeros((3, 3)), np.array([0, 1, 900]), np.array([0, 3]), None)
        assert caught.value.code == ErrorCode.INVALID_ARGUMENT and "Mesh" in str(caught.value)
