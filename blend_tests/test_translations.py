# SPDX-License-Identifier: GPL-3.0-or-later
"""Every text of the interface is in the template and has a German translation."""

import re

import bpy
import pytest
import translation_strings
from raybundle import translations

PLACEHOLDER = re.compile(r"\{[^{}]*\}")
GERMAN = translations.FOLDER / "de.po"
LANGUAGES = sorted(translations.FOLDER.glob("*.po"))
REWRITE = "run blend_tests/translation_strings.py"


@pytest.fixture(scope="module")
def texts() -> list[tuple[str, str]]:
    return translation_strings.all_texts()


def test_labels_descriptions_choices_and_messages_are_found(texts):
    for key in (("Operator", "Bake Radiosity"), ("Operator", "Bake"), ("*", "Last Bake"),
                ("*", "Write direct and indirect light into the colour attributes of the scene's "
                      "meshes"),
                ("*", "Relative noise of the light at which the bake stops"),
                ("*", "Least Squares"), ("*", "Objects set: {count}"), ("*", "Study Methods"),
                ("*", "Name of the light set"), ("*", "Raybundle")):
        assert key in texts


def test_the_template_has_all_texts(texts):
    assert translation_strings.TEMPLATE.read_text(encoding="utf-8") == \
        translation_strings.po_text(texts, {}), REWRITE


@pytest.mark.parametrize("path", LANGUAGES, ids=lambda path: path.stem)
def test_files_have_the_texts_of_the_template(texts, path):
    assert list(translations.read_language(path)) == texts, REWRITE


def test_every_text_is_in_german(texts):
    messages = translations.read_language(GERMAN)
    assert [key for key in texts if not messages.get(key)] == []


@pytest.mark.parametrize("path", LANGUAGES, ids=lambda path: path.stem)
def test_placeholders_are_kept(path):
    for (_, text), translated in translations.read_language(path).items():
        if translated:
            assert sorted(PLACEHOLDER.findall(text)) == sorted(PLACEHOLDER.findall(translated))
            # Blender adds full stops itself.
            assert not translated.endswith("."), text


def test_no_text_has_lines(texts):
    assert [text for _, text in texts if "\n" in text or "  " in text] == []


@pytest.mark.parametrize("text, messages", [
    ("", {}),
    ('msgid ""\nmsgstr "Language: de\\n"\n', {}),
    ('msgid "a"\nmsgstr "b"\n', {("*", "a"): "b"}),
    ('# comment\nmsgctxt "Operator"\nmsgid "a"\nmsgstr "b"\n\nmsgid "c"\nmsgstr ""\n',
     {("Operator", "a"): "b", ("*", "c"): ""}),
    ('msgid ""\n"one "\n"two"\nmsgstr "\\"x\\"\\n"\n', {("*", "one two"): '"x"\n'}),
    ('msgid "a"\nmsgstr "b"\nmsgid "c"\nmsgstr "d"', {("*", "a"): "b", ("*", "c"): "d"}),
])
def test_files_of_gettext_are_read(text, messages):
    assert translations.read_messages(text) == messages


def test_what_is_written_is_read():
    messages = {("*", 'a "b" \\ c'): "ä", ("Operator", "d"): ""}
    assert translations.read_messages(
        translation_strings.po_text(list(messages), messages)) == messages


def test_texts_of_code():
    source = ('layout.label(text="A")\nlayout.operator("x", text="B" if y else "C")\n'
              'layout.label(text="no", translate=False)\ntip_("D {n}").format(n=1)\nprint("no")')
    assert list(translation_strings.texts_of_code(source)) == [
        ("*", "A"), ("Operator", "B"), ("Operator", "C"), ("*", "D {n}")]


@pytest.mark.skipif("de_DE" not in bpy.app.translations.locales,
                    reason="this Blender has no languages")
def test_blender_shows_german():
    view = bpy.context.preferences.view
    try:
        view.language = "de_DE"
        view.use_translate_interface = True
        assert bpy.app.translations.pgettext("Bake Radiosity", "Operator") == "Radiosity backen"
        assert bpy.app.translations.pgettext_iface("Last Bake") == "Letztes Backen"
    finally:
        view.language = "en_US"
