# SPDX-License-Identifier: GPL-3.0-or-later
"""Faults outside of the add-on, and badly made scenes: no data of the user is lost."""

import resource
import signal
import subprocess
from pathlib import Path

import bpy
import numpy as np
import pytest
import raybundle
from conftest import CUBE_FACES, CUBE_VERTICES, FURNACE_LIGHT
from soak import resident_bytes
from surface_error import read_colors

pytestmark = pytest.mark.needs_library

SCRIPT = Path(__file__).parent.parent / "addon" / "bake_file.py"

in_blender = pytest.mark.skipif(not bpy.app.binary_path, reason="Blender is a module here")


def bake(**overrides):
    return raybundle.bake(bpy.context, **{"max_patches": 2000, "max_bundles": 64, **overrides})


def is_furnace(values):
    # The tolerance is that of the solver and of single precision.
    return np.abs(values / FURNACE_LIGHT - 1.0).max() < 1e-3


# --------------------------------------------------------------------------------------------------
# Numbers
# --------------------------------------------------------------------------------------------------


def add_light(kind, **properties):
    light = bpy.data.lights.new("Lamp", kind)
    for name, value in properties.items():
        setattr(light, name, value)
    item = bpy.data.objects.new("Lamp", light)
    bpy.context.scene.collection.objects.link(item)
    return item


@pytest.mark.parametrize("kind, properties", [
    ('POINT', {"color": (1.0, 1.0, 3e38)}), ('SUN', {"energy": 1e20}),
    ('AREA', {"energy": 1e30}), ('AREA', {"size": 1e20}), ('POINT', {"shadow_soft_size": 1e20})])
def test_lights_beyond_the_range_of_numbers_are_refused(closed_box, kind, properties):
    add_light(kind, **properties)
    with pytest.raises(raybundle.RaybundleError, match='"Lamp"'):
        bake()
    assert len(closed_box.data.color_attributes) == 0


@pytest.mark.parametrize("name", ["exposure", "target_error", "patch_size"])
def test_a_setting_that_is_no_number_is_refused(closed_box, name):
    # The limits of a property do not exclude NaN.
    setattr(bpy.context.scene.raybundle, name, float("nan"))
    if not np.isfinite(getattr(bpy.context.scene.raybundle, name)):
        with pytest.raises(raybundle.BakeError, match=name):
            raybundle.bake(bpy.context)
        assert len(closed_box.data.color_attributes) == 0


@pytest.mark.parametrize("roughness", [1e-30, 0.5, 1.0])
@pytest.mark.parametrize("red", [0.9, 2.0, 1e20])
def test_colours_above_1_send_no_negative_light(new_object, new_material, red, roughness):
    material = new_material("Red", (red, 0.0, 0.0))
    diffuse = next(node for node in material.node_tree.nodes if node.type == 'BSDF_DIFFUSE')
    diffuse.inputs['Roughness'].default_value = roughness
    floor = new_object("Floor", [(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)], [(0, 1, 2, 3)],
                       material)
    box = new_object("Box", CUBE_VERTICES, CUBE_FACES, material)
    box.location.z = 1.5
    add_light('SUN', energy=10.0)
    bake()
    for item in (floor, box):
        assert (read_colors(item) >= 0.0).all()
    assert read_colors(floor).max() > 1.0


def test_a_slot_that_a_script_emptied_after_the_evaluation(closed_box):
    tree = closed_box.data.materials[0].node_tree
    noise = tree.nodes.new('ShaderNodeTexNoise')
    tree.links.new(noise.outputs['Color'], next(node for node in tree.nodes
                                                if node.type == 'BSDF_DIFFUSE').inputs['Color'])
    bpy.context.view_layer.update()
    closed_box.material_slots[0].link = 'OBJECT'
    bake()
    assert np.isfinite(read_colors(closed_box)).all()


# --------------------------------------------------------------------------------------------------
# Names and transforms
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["x" * 63, "Wände über Öl", "部屋の箱", "🦊",
                                  'a "quoted" \\ name', " "])
def test_names_are_kept_as_they_are(closed_box, name):
    closed_box.name = closed_box.data.name = name
    closed_box.data.materials[0].name = name
    report = bake(attribute=name)
    assert [item.name for item in report.objects] == [closed_box.name]
    assert is_furnace(read_colors(closed_box, name))


def test_a_name_of_an_attribute_that_is_too_long_loses_nothing(closed_box):
    closed_box.data.color_attributes.new("Mine", 'FLOAT_COLOR', 'CORNER')
    with pytest.raises(raybundle.BakeError, match="üü"):
        bake(attribute="ü" * 60)
    with pytest.raises(raybundle.BakeError, match="xx Error"):
        bake(attribute="x" * 60, write_error=True)
    assert [attribute.name for attribute in closed_box.data.color_attributes] == ["Mine"]
    bake(attribute="x" * 63)
    assert closed_box.data.color_attributes.keys() == ["Mine", "x" * 63]


@pytest.mark.parametrize("scale", [(-1, 1, 1), (-1, -1, -1), (1e-3, 1e-3, 1e-3), (1e4, 1e4, 1e4)])
def test_scaled_and_mirrored_objects(closed_box, scale):
    closed_box.scale = scale
    bpy.context.view_layer.update()
    bake()
    assert is_furnace(read_colors(closed_box))


@pytest.mark.parametrize("scale", [(0, 0, 0), (1, 1, 0), (0, 0, 1)])
def test_an_object_without_volume_spoils_nothing(closed_box, new_object, scale):
    flat = new_object("Flat", 0.2 * np.array(CUBE_VERTICES), CUBE_FACES,
                      closed_box.data.materials[0])
    flat.scale = scale
    bpy.context.view_layer.update()
    report = bake()
    assert any('"Flat"' in warning for warning in report.warnings)
    assert is_furnace(read_colors(closed_box))
    assert np.isfinite(read_colors(flat)).all()


def test_instances_of_instances_of_instances(closed_box, new_object):
    """Three levels of collections, each with three instances of the collection below: 27 cubes."""
    inner = bpy.data.collections.new("Level 0")
    cube = new_object("Cube", 0.02 * np.array(CUBE_VERTICES), CUBE_FACES,
                      closed_box.data.materials[0])
    bpy.context.scene.collection.objects.unlink(cube)
    inner.objects.link(cube)
    for level in range(3):
        outer = bpy.data.collections.new(f"Level {level + 1}")
        for k in range(3):
            empty = bpy.data.objects.new(f"Empty {level} {k}", None)
            empty.instance_type, empty.instance_collection = 'COLLECTION', inner
            empty.location[level] = 0.3 * (k - 1)
            outer.objects.link(empty)
        inner = outer
    root = bpy.data.objects.new("Root", None)
    root.instance_type, root.instance_collection = 'COLLECTION', inner
    bpy.context.scene.collection.objects.link(root)
    bpy.context.view_layer.update()
    bake()
    assert is_furnace(read_colors(closed_box))


# --------------------------------------------------------------------------------------------------
# Many bakes
# --------------------------------------------------------------------------------------------------


def test_memory_stays_the_same(closed_box):
    for seed in range(8):
        bake(seed=seed)
    before = resident_bytes()
    for seed in range(32):
        bake(seed=seed)
    # A leak of the lines of each bake alone, about 1 MB, would exceed this.
    assert resident_bytes() < before + 8e6


def test_two_scenes_in_turns(closed_box):
    first = bpy.context.scene
    second = bpy.data.scenes.new("Second")
    box = bpy.data.objects.new("Box 2", closed_box.data.copy())
    second.collection.objects.link(box)
    for _ in range(3):
        for scene, item in ((first, closed_box), (second, box)):
            with bpy.context.temp_override(scene=scene, view_layer=scene.view_layers[0]):
                raybundle.bake(bpy.context, max_patches=2000, max_bundles=64)
            assert is_furnace(read_colors(item))


def test_undo_after_a_bake(closed_box):
    bpy.ops.ed.undo_push(message="before")
    name = closed_box.name
    assert bpy.ops.raybundle.bake() == {'FINISHED'}
    bpy.ops.ed.undo_push(message="baked")
    bpy.ops.ed.undo()
    item = bpy.data.objects[name]
    assert "Radiosity" not in item.data.color_attributes
    bpy.ops.ed.redo()
    assert is_furnace(read_colors(bpy.data.objects[name]))
    bake(seed=3)
    assert is_furnace(read_colors(bpy.data.objects[name]))


def open_another_file(item):
    bpy.ops.wm.read_homefile(use_empty=True)


def undo(item):
    bpy.ops.ed.undo()


def remove_object(item):
    bpy.data.objects.remove(item)


def remove_mesh(item):
    bpy.data.meshes.remove(item.data)


def add_faces(item):
    mesh = item.data
    vertices = [vertex.co[:] for vertex in mesh.vertices]
    faces = [polygon.vertices[:] for polygon in mesh.polygons]
    mesh.clear_geometry()
    mesh.from_pydata(vertices, [], faces + faces)


def enter_edit_mode(item):
    bpy.context.view_layer.objects.active = item
    bpy.ops.object.mode_set(mode='EDIT')


def clear_bake(item):
    bpy.ops.raybundle.clear()


@pytest.mark.parametrize("stage", ['bundles', 'write_back'])
@pytest.mark.parametrize("change", [open_another_file, undo, remove_object, remove_mesh, add_faces,
                                    enter_edit_mode, clear_bake])
def test_a_change_of_the_file_during_a_bake(closed_box, new_object, stage, change):
    # This object, which is not changed, would be written first.
    other = new_object("A", CUBE_VERTICES, [face[::-1] for face in CUBE_FACES],
                       closed_box.data.materials[0])
    other.location.x = 5.0
    bpy.ops.ed.undo_push(message="before")
    bake()
    bpy.ops.ed.undo_push(message="baked")
    for item in bpy.data.objects:
        item.data.color_attributes["Radiosity"].data.foreach_set('color', np.full(24 * 4, 0.25))
    bpy.ops.ed.undo_push(message="painted")
    bpy.data.objects["Box"].location.z = 1.0
    bpy.ops.ed.undo_push(message="moved")
    done = []

    def change_once(current, fraction):
        if current == stage and not done:
            done.append(change)
            change(bpy.data.objects["Box"])

    with pytest.raises(raybundle.BakeError, match="nothing was written"):
        bake(seed=1, progress=change_once)
    assert done
    if bpy.context.mode != 'OBJECT':
        bpy.ops.object.mode_set(mode='OBJECT')
    if change in (remove_object, remove_mesh, add_faces, enter_edit_mode):
        assert np.all(read_colors(bpy.data.objects["A"]) == 0.25)
    if change is not open_another_file:
        bake(seed=2)
        assert is_furnace(read_colors(bpy.data.objects["A"]))


def test_a_bake_within_a_bake_is_refused(closed_box):
    def bake_again(stage, fraction):
        if stage == 'bundles':
            bake()

    with pytest.raises(raybundle.RaybundleError, match="still using"):
        bake(progress=bake_again)
    assert len(closed_box.data.color_attributes) == 0


# --------------------------------------------------------------------------------------------------
# Large meshes
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("topology", ['KEEP', 'ADAPTIVE'])
def test_a_bake_that_needs_too_much_memory_loses_nothing(closed_box, new_object, topology):
    bake()
    # Half a million faces take a gigabyte.
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, 700), np.linspace(-1.0, 1.0, 700))
    corner = np.arange(700 * 700).reshape(700, 700)
    faces = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], axis=-1)
    grid = new_object("Grid", np.stack([x, y, 0.1 * np.sin(9.0 * x)], axis=-1).reshape(-1, 3),
                      faces.reshape(-1, 4))
    with pytest.raises(raybundle.RaybundleError, match=r"memory_limit allows \(300 MB\)"):
        bake(memory_limit=300.0, max_patches=1_000_000, topology=topology)
    assert len(grid.data.color_attributes) == 0
    assert len([item for item in bpy.data.objects if item.raybundle.source]) == 0
    assert is_furnace(read_colors(closed_box))
    bpy.data.objects.remove(grid)
    bake()
    assert is_furnace(read_colors(closed_box))


# --------------------------------------------------------------------------------------------------
# Files
# --------------------------------------------------------------------------------------------------


def command(path, out):
    return [bpy.app.binary_path, "-b", "--factory-startup", str(path), "--python-exit-code", "1",
            "-P", str(SCRIPT), "--", "--out", str(out), "--set", "max_patches=500"]


@pytest.fixture
def saved_box(closed_box, tmp_path):
    path = tmp_path / "box.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def limit_files(size):
    """Returns a function that limits the size of files that its process can write. size: bytes.

    SIGXFSZ is ignored, so that writing more fails with an error, as on a full disk.
    """
    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    return limit


@in_blender
def test_a_full_disk_is_said_and_earlier_results_stay(saved_box, tmp_path):
    out = tmp_path / "out"
    assert subprocess.run(command(saved_box, out), capture_output=True, timeout=120).returncode == 0
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    original = saved_box.read_bytes()
    for size in (0, 1000, 20000):
        result = subprocess.run(command(saved_box, out), capture_output=True, text=True,
                                timeout=120, preexec_fn=limit_files(size))
        assert result.returncode == 1, size
        assert any(line.startswith("bake: ") for line in result.stderr.splitlines()), size
        assert saved_box.read_bytes() == original, size
        blend = out / "box.baked.blend"
        assert blend.read_bytes() == before[blend.name], size
        assert not list(out.glob("*.part")), size


@in_blender
def test_a_killed_bake_leaves_the_file_as_it_was(saved_box, tmp_path):
    original = saved_box.read_bytes()
    out = tmp_path / "out"
    process = subprocess.Popen(
        [*command(saved_box, out), "max_patches=20000", "max_bundles=60000", "skip.bundles=0"],
        stdout=subprocess.PIPE, text=True)
    for line in process.stdout:
        if line.startswith("bundles"):
            break
    process.kill()
    assert process.wait(timeout=30) == -signal.SIGKILL
    assert saved_box.read_bytes() == original
    assert not out.exists() or not list(out.iterdir())
