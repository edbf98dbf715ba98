# SPDX-License-Identifier: GPL-3.0-or-later
"""Registration of the add-on, and agreement of its properties with the native library."""

import inspect
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest
import raybundle
from raybundle import native, panels, properties

GROUPS = (properties.RaybundleSceneSettings, properties.RaybundleObjectSettings)

# Names that scripts use, as documented in docs/.
SCENE_PROPERTIES = """scope target_error output attribute domain data_type topology shared_meshes
    patch_size max_patches refine contacts solver first_shot directions projector small_patches
    reconstruction final_gather plane_count plane_placement local_rays estimator max_bundles
    lines_per_bundle memory_limit seed threads report""".split()
OPERATORS = ("bake", "relight", "clear", "preview")

# Settings of the library that Blender does not show. They are for studies with the C interface.
# The topology decides adapt_meshes.
NOT_IN_BLENDER = ["adapt_meshes", "draft", "min_bundles", "thesis_literal", "plane_coherence",
                  "regularization"]
# Properties with a narrower range than in the library, where studies use the full range.
NARROWER = {'target_error': (0.0005, 1.0)}
RNA_TYPES = {int: 'INT', float: 'FLOAT', str: 'ENUM'}
RNA_UNITS = {"": 'NONE', "m": 'LENGTH'}  # Blender has no unit for megabytes


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


def rna_properties() -> bpy.types.bpy_prop_collection:
    return properties.RaybundleSceneSettings.bl_rna.properties


def library_settings(kind: type) -> list[native.Setting]:
    """Returns the settings of a type that are also properties of the scene."""
    return [setting for setting in native.settings().values()
            if setting.type is kind and setting.name in rna_properties()]


@pytest.mark.needs_library
def test_every_setting_of_the_library_is_a_property_or_left_out_on_purpose():
    skips = {item[0] for item in properties.enum_skip}
    missing = [name for name in native.settings()
               if name not in rna_properties() and name.partition("skip.")[2] not in skips]
    assert missing == NOT_IN_BLENDER


@pytest.mark.needs_library
def test_types_descriptions_and_units_are_those_of_the_library():
    for kind in (int, float, str):
        for setting in library_settings(kind):
            definition = rna_properties()[setting.name]
            is_switch = kind is int and (setting.least, setting.most) == (0, 1)
            assert definition.type == ('BOOLEAN' if is_switch else RNA_TYPES[kind]), setting.name
            assert definition.description == setting.help
            if setting.unit in RNA_UNITS:
                assert definition.unit == RNA_UNITS[setting.unit], setting.name


@pytest.mark.needs_library
@pytest.mark.parametrize("kind", (int, float))
def test_numbers_have_the_default_and_the_range_of_the_library(kind):
    for setting in library_settings(kind):
        definition = rna_properties()[setting.name]
        # Floats are passed in single precision, hence 1e-6.
        assert definition.default == pytest.approx(setting.default, rel=1e-6), setting.name
        if definition.type == 'BOOLEAN':
            continue
        least, most = NARROWER.get(setting.name, (setting.least, setting.most))
        assert setting.least <= least <= most <= setting.most, setting.name
        assert definition.hard_min == pytest.approx(least, rel=1e-6), setting.name
        assert definition.hard_max == pytest.approx(most, rel=1e-6), setting.name


@pytest.mark.needs_library
def test_choices_are_those_of_the_library_in_its_order():
    for setting in library_settings(str):
        definition = rna_properties()[setting.name]
        assert definition.default == setting.default
        assert {item.identifier: item.description for item in definition.enum_items} == \
            setting.choices
        # A .blend file stores the index of a choice, so that the order must not change.
        assert definition.enum_items.keys() == list(setting.choices), setting.name


@pytest.mark.needs_library
def test_the_method_panel_draws_the_settings_that_have_an_effect():
    class Layout:
        def __init__(self):
            self.drawn = []

        def prop(self, settings, name, **_options):
            self.drawn.append(name)

    settings = bpy.context.scene.raybundle
    of_choices = {'solver': {"estimator"}, 'first_shot': {"local_rays"},
                  'projector': {"plane_count", "plane_placement"}}
    for choice, names in of_choices.items():
        for value in native.settings()[choice].choices:
            setattr(settings, choice, value)
            panel = SimpleNamespace(layout=Layout())
            panels.RAYBUNDLE_PT_method.draw(panel, bpy.context)
            assert len(panel.layout.drawn) == len(set(panel.layout.drawn))
            is_used = value in ('RANDOM_WALK', 'SHOOT', 'EXTENDED', 'PLANES')
            assert (names <= set(panel.layout.drawn)) == is_used, value
            assert names.isdisjoint(panel.layout.drawn) != is_used, value
        settings.property_unset(choice)


@pytest.mark.needs_library
def test_skips_are_those_of_the_library_in_its_order():
    skips = [(name.partition(".")[2], setting) for name, setting in native.settings().items()
             if name.startswith("skip.")]
    assert [(item[0], item[2]) for item in properties.enum_skip] == \
        [(name, setting.help) for name, setting in skips]
    # The property of the add-on is the set of skips that are off. By default it is empty.
    assert all((setting.type, setting.least, setting.most, setting.default) == (int, 0, 1, 1)
               for _, setting in skips)
    assert rna_properties()['skips_off'].default_flag == set()


@pytest.mark.needs_library
def test_settings_are_set_and_read_by_name():
    with native.Bake() as bake:
        for setting in native.settings().values():
            assert bake.get(setting.name) == setting.default
            for value in setting.choices or (setting.type(setting.least),
                                             setting.type(setting.most)):
                bake.set(setting.name, value)
                assert bake.get(setting.name) == value
        for call in (lambda: bake.get("colour"), lambda: bake.set("colour", 1)):
            with pytest.raises(raybundle.RaybundleError, match="colour"):
                call()


def test_every_native_function_is_declared():
    header = Path(__file__).parent.parent / "native/include/raybundle/raybundle.h"
    text = header.read_text()
    declared = set(re.findall(r"RB_API [^;(]*?(rb_\w+)\(", text))
    assert declared == set(native._FALLIBLE) | set(native._INFALLIBLE)
    assert int(re.search(r"#define RB_ABI_VERSION (\d+)", text)[1]) == native.ABI_VERSION


def test_only_one_module_knows_ctypes():
    folder = Path(inspect.getfile(raybundle)).parent
    users = [path.name for path in folder.rglob("*.py") if "ctypes" in path.read_text()]
    assert users == ["native.py"]
