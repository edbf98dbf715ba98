# SPDX-License-Identifier: GPL-3.0-or-later
"""Registration, and settings that agree with the native library."""

import inspect
import re
import subprocess
import sys
from pathlib import Path

import bpy
import pytest
import raybundle
from raybundle import native, properties

GROUPS = (properties.RaybundleSceneSettings, properties.RaybundleObjectSettings)

# Names that scripts use; see the interfaces in docs.
SCENE_PROPERTIES = """scope target_error output attribute domain data_type topology shared_meshes
    patch_size max_patches refine contacts solver first_shot directions projector small_patches
    reconstruction final_gather plane_count plane_placement local_rays estimator max_bundles
    lines_per_bundle memory_limit seed threads report""".split()
OPERATORS = ("bake", "relight", "clear", "preview")


def test_register_unregister_register():
    raybundle.unregister()
    assert not hasattr(bpy.types.Scene, "raybundle")
    assert not hasattr(bpy.types, "RAYBUNDLE_OT_bake")
    raybundle.register()
    assert bpy.context.scene.raybundle.attribute == "Radiosity"
    for name in OPERATORS:
        assert getattr(bpy.ops.raybundle, name).get_rna_type().description


@pytest.mark.skipif(bool(bpy.app.binary_path), reason="of Blender as a module")
def test_python_ends_well_after_it_was_registered():
    addon = Path(raybundle.__file__).parent.parent
    code = f"import sys; sys.path.insert(0, {str(addon)!r}); import bpy, raybundle; raybundle.register()"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_names_that_scripts_use():
    for name in SCENE_PROPERTIES:
        assert name in properties.RaybundleSceneSettings.bl_rna.properties
    assert bpy.data.objects.new("Any", None).raybundle.role == 'BAKE'
    assert callable(raybundle.bake)


@pytest.mark.parametrize("group", GROUPS)
def test_every_property_has_a_description(group):
    for definition in group.bl_rna.properties:
        if definition.identifier in group.__annotations__:
            assert definition.name and definition.description, definition.identifier
            if definition.type == 'ENUM':
                assert all(item.description for item in definition.enum_items)


@pytest.mark.needs_library
def test_defaults_are_those_of_the_native_library():
    # Floats cross the interface in single precision, hence 1e-6.
    with native.Bake() as bake:
        for name in native.SETTINGS:
            if name in properties.RaybundleSceneSettings.bl_rna.properties:
                default = getattr(bpy.context.scene.raybundle, name)
                assert bake.get(name) == (
                    pytest.approx(default, rel=1e-6) if isinstance(default, float) else default
                ), name


@pytest.mark.needs_library
def test_every_choice_is_known_to_the_native_library():
    with native.Bake() as bake:
        for name, kind in native.SETTINGS.items():
            definition = properties.RaybundleSceneSettings.bl_rna.properties.get(name)
            if definition is None:
                continue
            if kind is str:
                for item in definition.enum_items:
                    bake.set(name, item.identifier)
            elif definition.type == 'BOOLEAN':
                bake.set(name, False)
                bake.set(name, True)
            else:
                bake.set(name, definition.hard_min)
                bake.set(name, definition.hard_max)


def test_every_native_function_is_declared():
    header = Path(__file__).parent.parent / "native/include/raybundle/raybundle.h"
    text = header.read_text()
    declared = set(re.findall(r"RB_API [^;(]*?(rb_\w+)\(", text))
    assert declared == set(native._FALLIBLE) | set(native._INFALLIBLE)
    assert int(re.search(r"#define RB_ABI_VERSION (\d+)", text)[1]) == native.ABI_VERSION


def test_every_skip_is_a_choice():
    header = Path(__file__).parent.parent / "native/include/raybundle/raybundle.h"
    names = re.search(r"skip\.NAME .*?NAME: ([^(]*)", header.read_text(), re.DOTALL)[1]
    names = re.findall(r"[a-z_]+", names)
    assert sorted(names) == sorted(native.SKIPS)
    assert [item[0] for item in properties.enum_skip] == list(native.SKIPS)


def test_only_one_module_knows_ctypes():
    folder = Path(inspect.getfile(raybundle)).parent
    users = [path.name for path in folder.rglob("*.py") if "ctypes" in path.read_text()]
    assert users == ["native.py"]
