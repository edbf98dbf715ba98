# SPDX-License-Identifier: GPL-3.0-or-later
"""The shading of the 3D views that show baked light. Background processes have no windows, so that
these tests have views that only look like those of Blender."""

from types import SimpleNamespace

import bpy
import pytest
from raybundle import light_in_material, viewport_preview

BEFORE = {'type': 'RENDERED', 'color_type': 'OBJECT', 'light': 'MATCAP'}
SOLID = {'type': 'SOLID', 'color_type': 'VERTEX', 'light': 'FLAT'}
MATERIALS = {**BEFORE, 'type': 'MATERIAL'}


class View:
    def __init__(self):
        self.shading = SimpleNamespace(**BEFORE)

    def as_pointer(self):
        return id(self)


@pytest.fixture
def view(monkeypatch):
    """Returns the only view of all windows."""
    found = View()
    monkeypatch.setattr(viewport_preview, '_views', lambda _: [found])
    monkeypatch.setattr(viewport_preview, '_earlier', {})
    return found


@pytest.fixture
def lit(new_object, new_material):
    """Returns the material of a face with a colour attribute of the name of the light."""
    item = new_object("Face", [(0, 0, 0), (1, 0, 0), (1, 1, 0)], [(0, 1, 2)],
                      new_material("Grey", (0.5, 0.5, 0.5)))
    item.data.color_attributes.new("Radiosity", 'FLOAT_COLOR', 'CORNER')
    return item.material_slots[0].material


def test_preview_shows_the_attribute_and_returns(view, lit):
    assert viewport_preview.toggle(bpy.context) == []
    assert vars(view.shading) == SOLID
    assert not light_in_material.shows_light(lit)
    viewport_preview.toggle(bpy.context)
    assert vars(view.shading) == BEFORE


def test_preview_in_materials_adds_the_light_and_returns(view, lit):
    bpy.context.scene.raybundle.show_in = 'MATERIALS'
    viewport_preview.toggle(bpy.context)
    assert vars(view.shading) == MATERIALS
    assert light_in_material.shows_light(lit)
    viewport_preview.toggle(bpy.context)
    assert vars(view.shading) == BEFORE
    assert not light_in_material.shows_light(lit)


def test_light_that_the_user_has_put_into_materials_stays(view, lit):
    bpy.context.scene.raybundle.show_in = 'MATERIALS'
    bpy.ops.raybundle.use_in_material()
    viewport_preview.toggle(bpy.context)
    viewport_preview.toggle(bpy.context)
    assert vars(view.shading) == BEFORE
    assert light_in_material.shows_light(lit)


def test_preview_follows_the_choice(view, lit):
    settings = bpy.context.scene.raybundle
    settings.show_in = 'MATERIALS'
    assert vars(view.shading) == BEFORE and not light_in_material.shows_light(lit)
    viewport_preview.toggle(bpy.context)
    settings.show_in = 'SOLID'
    assert vars(view.shading) == SOLID and not light_in_material.shows_light(lit)
    settings.show_in = 'MATERIALS'
    assert view.shading.type == 'MATERIAL' and light_in_material.shows_light(lit)


def test_preview_of_a_file_that_was_saved_with_it_returns(view, lit):
    bpy.context.scene.raybundle.show_in = 'MATERIALS'
    viewport_preview.toggle(bpy.context)
    viewport_preview._earlier.clear()  # as after a file was opened
    viewport_preview.toggle(bpy.context)
    assert view.shading.type == 'SOLID' and not light_in_material.shows_light(lit)


def test_a_bake_shows_solid_light_first_and_materials_at_its_end(view, lit):
    bpy.context.scene.raybundle.show_in = 'MATERIALS'
    assert viewport_preview.show_interim(bpy.context)
    assert vars(view.shading) == SOLID and not light_in_material.shows_light(lit)
    viewport_preview.show_result(bpy.context)
    assert vars(view.shading) == {**SOLID, 'type': 'MATERIAL'}
    assert light_in_material.shows_light(lit)
    # The second bake goes on in Material Preview.
    assert not viewport_preview.show_interim(bpy.context)
    viewport_preview.hide(bpy.context)
    assert vars(view.shading) == BEFORE and not light_in_material.shows_light(lit)


def test_result_is_not_shown_if_switched_off(view, lit):
    bpy.context.scene.raybundle.show_result = False
    assert not viewport_preview.show_interim(bpy.context)
    assert viewport_preview.show_result(bpy.context) == []
    assert vars(view.shading) == BEFORE


def test_material_preview_of_the_user_is_left_alone(view):
    view.shading.type = 'MATERIAL'
    viewport_preview.hide(bpy.context)
    assert view.shading.type == 'MATERIAL'


def test_materials_that_cannot_show_the_light_are_named(view, lit):
    bpy.context.scene.raybundle.show_in = 'MATERIALS'
    lit.use_nodes = True
    lit.node_tree.nodes.clear()
    assert ['Grey' in line for line in viewport_preview.show_result(bpy.context)] == [True]
