# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages are in English in scripts and files, and in the user's language where they are shown."""

import ast
import copy
import json
import re
from pathlib import Path

import bpy
import pytest
import raybundle
from drawn_layout import drawn
from raybundle import library_messages, messages, report_panel, translations
from raybundle.library_messages import recognised
from raybundle.messages import Message, decoded, encoded, quoted, translated
from raybundle.report_data import read_report, warning_lines
from raybundle.warning_lines import grouped, listed

ROOT = Path(__file__).parent.parent
ADDON = ROOT / "addon" / "raybundle"
has_languages = pytest.mark.skipif("de_DE" not in bpy.app.translations.locales,
                                   reason="this Blender has no languages")


@pytest.fixture
def german():
    """Blender in German. Yields the preferences of the language."""
    view = bpy.context.preferences.view
    view.language = "de_DE"
    view.use_translate_interface = view.use_translate_tooltips = True
    if hasattr(view, 'use_translate_reports'):
        view.use_translate_reports = True
    yield view
    view.language = "en_US"


@pytest.fixture
def german_file(monkeypatch):
    """The translations of the German file, for a Blender without languages too."""
    found = translations.read_language(translations.FOLDER / "de.po")
    monkeypatch.setattr(messages, '_look_up', lambda text: found.get(("*", text), text))


def no_faces(name: str) -> Message:
    return Message("{name} is left out: {reason}", name=quoted(name),
                   reason=Message("it has no faces"))


def ignored(material: str, node: str) -> Message:
    """Returns the message of the reader of materials about a node."""
    return Message("{owner}: {node} {what}",
                   owner=Message("material {name}", name=quoted(material)),
                   node=Message("node {name} ({type})", name=quoted(node), type=Message("Gamma")),
                   what=Message("is ignored: its input colour is used"))


# --------------------------------------------------------------------------------------------------
# Messages
# --------------------------------------------------------------------------------------------------


def test_a_message_is_its_english_text():
    assert no_faces("Wall") == '"Wall" is left out: it has no faces'
    assert str(raybundle.BakeError(no_faces("Wall"))) == '"Wall" is left out: it has no faces'
    assert copy.deepcopy([no_faces("Wall")])[0].values['name'] == '"Wall"'


@pytest.mark.parametrize("name", ["{", "{name}", "{0}", "}{", "%s"])
def test_names_may_contain_braces(name, german_file):
    assert no_faces(name) == f'"{name}" is left out: it has no faces'
    assert Message(name) == translated(Message(name)) == name
    assert translated(no_faces(name)) == f'"{name}" wird ausgelassen: es hat keine Flächen'


def test_messages_are_stored_as_json(german_file):
    for message in (no_faces("Wall"), ignored("Wood", "Gamma"), "no message"):
        read = decoded(json.loads(json.dumps(encoded(message))))
        assert read == message and translated(read) == translated(message)


@pytest.mark.parametrize("said, expected", [
    (no_faces("Wall"), '"Wall" wird ausgelassen: es hat keine Flächen'),
    (raybundle.BakeError(no_faces("Wall")), '"Wall" wird ausgelassen: es hat keine Flächen'),
    (ignored("Wood", "Gamma"),
     'Material "Wood": Knoten "Gamma" (Gamma) wird ignoriert: Seine Eingangsfarbe wird verwendet'),
    (listed(['"A"', '"B"'], 1), '"A" und 1 weitere'),
    (listed([Message("{name} ({how})", name='"A"', how=Message("adaptive subdivision"))]),
     '"A" (adaptive Unterteilung)'),
    (Message("{path} could not be written: {error}", path='"a"', error=RuntimeError(
        Message("it has no faces"))),
     '"a" konnte nicht geschrieben werden: es hat keine Flächen'),
    ("it has no faces", "it has no faces"), (ValueError("no message"), "no message"),
    (OSError(2, "No such file"), "[Errno 2] No such file"), (ValueError(), ""),
])
def test_messages_and_exceptions_are_translated(said, expected, german_file):
    assert translated(said) == expected


def test_a_group_can_be_translated(german_file):
    group, = grouped([no_faces("A"), no_faces("B")])
    assert group.text == '"A", "B" is left out: it has no faces'
    assert translated(group.text) == '"A", "B" wird ausgelassen: es hat keine Flächen'
    group, = grouped(ignored(f"M{k}", f"Gamma.{k:03}") for k in range(20))
    names = ", ".join(f'"M{k}"' for k in range(12))
    assert group.text == (f'material {names} and 8 more: node "Gamma" (Gamma) is ignored: its '
                          f'input colour is used')
    assert translated(group.text) == (f'Material {names} und 8 weitere: Knoten "Gamma" (Gamma) '
                                      f'wird ignoriert: Seine Eingangsfarbe wird verwendet')
    lie_on = [recognised(f'object "{name}": {count} faces were left out, because their area is '
                         f'zero or no larger than rounding errors; remove them (Degenerate '
                         f'Dissolve)') for name, count in (("A", 3), ("B", 4))]
    group, = grouped(lie_on)
    assert translated(group.text).startswith('Objekt "A", "B": 7 Flächen wurden ausgelassen')


# --------------------------------------------------------------------------------------------------
# Texts of the native library
# --------------------------------------------------------------------------------------------------


def texts_of_library() -> str:
    """Returns the texts in the library's source, without names of values between them."""
    texts = []
    for path in sorted((ROOT / "native" / "src").rglob("*.[ch]*")):
        source = re.sub(r'"\s*\n\s*"', "", path.read_text(encoding="utf-8"))
        texts += re.findall(r'"((?:[^"\\\n]|\\.)*)"', source)
    return "\n".join(texts).replace('\\"', '"')


def test_templates_of_the_library_are_in_its_source():
    source = texts_of_library()
    for template in (*library_messages.WARNINGS, *library_messages.ERRORS,
                     *library_messages.SKIPS):
        for part in re.split(r"\{\w+\}", template):
            # The source makes some parts of several texts.
            for sentence in re.split(r"(?<= bundles)(?:: (?:the noise )?| )|(?<=noisiest parts)"
                                     r"|(?<=each object\))|(?= is too bright)", part):
                assert len(sentence) < 12 or sentence.strip('":; ') in source, sentence


@pytest.mark.parametrize("text, values", [
    ('object "A", "B" and 3 more: almost no light reaches the baked sides of the faces, but the '
     'other sides are lit; flip the normals, or bake the other side',
     {'object': '"A", "B" and 3 more'}),
    ("max_bundles was reached at 64 bundles: the noise is 3 %, and at least 5 % on the noisiest "
     "parts; the target is 2 %. Increase max_bundles to reach the target",
     {'count': "64", 'noise': "3 %", 'most': "5 %", 'target': "2 %"}),
    ('some objects are noisier than twice the target of 2 %: object "A" (5 %), "B" (4.1 %) and 2 '
     'more (the report lists the noise of each object); lower target_error, or increase '
     'max_bundles if the bake reached it', {'target': "2 %", 'objects': '"A" (5 %), "B" (4.1 %) '
                                                                        'and 2 more'}),
    ("bundles", {}),
    ('light "A is too bright" is too bright; reduce it to at most 1e15 (W/m^2, W/sr or W/(m^2 sr))',
     {'light': '"A is too bright"'}),
    ("solver RANDOM_WALK does not work with light sets: it moves the light of all sets together "
     "and cannot separate them; choose solver LINE_REUSE",
     {'solver': "RANDOM_WALK", 'what': "light sets", 'instead': "solver LINE_REUSE",
      'why': "it moves the light of all sets together and cannot separate them"}),
])
def test_texts_of_the_library_are_recognised(text, values):
    message = recognised(text)
    assert message == text and message.values == values


def test_other_texts_stay_as_they_are():
    assert type(recognised('object "A" is something new')) is str


@pytest.mark.needs_library
def test_warnings_and_skips_of_a_bake_are_recognised(new_object, new_material, new_light):
    new_light("Lamp", 'POINT', 100.0, (0, 0, 2))
    square = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]
    new_object("Floor", square, [(0, 1, 2, 3), (0, 1, 2, 3)], new_material("Grey", (1, 1, 1)))
    new_object("Turned", square, [(3, 2, 1, 0)], None, (0, 0, 0.5))
    report = raybundle.bake(bpy.context, max_bundles=2, target_error=0.0005, contacts=False)
    assert len(report.warnings) >= 3 and report.skipped
    unknown = [text for text in report.warnings if not isinstance(text, Message)]
    unknown += [item[key] for item in report.skipped for key in ('what', 'why')
                if not isinstance(recognised(item[key]), Message)]
    assert unknown == []


# --------------------------------------------------------------------------------------------------
# Where they are shown
# --------------------------------------------------------------------------------------------------


def nothing_to_bake(new_object) -> str:
    """Makes a scene that cannot be baked, and returns why in German."""
    new_object("Empty", [(0, 0, 0)], [])
    return ('Nichts zu backen: Es gibt kein sichtbares Mesh-Objekt mit Flächen und der Rolle '
            '„Backen“ ("Empty": es hat keine Flächen)')


@has_languages
@pytest.mark.needs_library
def test_operators_report_in_german_and_scripts_in_english(german, new_object):
    expected = nothing_to_bake(new_object)
    with pytest.raises(RuntimeError) as reported:
        bpy.ops.raybundle.bake()
    assert expected in str(reported.value)
    with pytest.raises(raybundle.BakeError) as raised:
        raybundle.bake(bpy.context)
    assert str(raised.value) == ('Nothing to bake: there is no visible mesh object with faces and '
                                 'the role Bake ("Empty": it has no faces)')


@has_languages
@pytest.mark.needs_library
def test_reports_stay_english_if_blender_does_not_translate_them(german, new_object):
    nothing_to_bake(new_object)
    # Older versions translate reports as they do tooltips.
    name = 'use_translate_reports' if hasattr(german, 'use_translate_reports') \
        else 'use_translate_tooltips'
    setattr(german, name, False)
    with pytest.raises(RuntimeError, match="Nothing to bake"):
        bpy.ops.raybundle.bake()


@pytest.mark.needs_library
def test_the_report_is_stored_in_english_and_drawn_in_german(german_file, closed_box, new_object):
    new_object("Empty", [(0, 0, 0)], [])
    report = raybundle.bake(bpy.context, max_bundles=2, target_error=0.0005)
    stored = json.loads(bpy.context.scene.raybundle.report)
    assert stored['warnings'] == report.warnings
    assert '"Empty" is left out: it has no faces' in stored['warnings']
    german_texts = [translated(line.text) for line in warning_lines(read_report(
        bpy.context.scene))]
    assert '"Empty" wird ausgelassen: es hat keine Flächen' in german_texts
    assert any("max_bundles wurde bei 2 Bündeln erreicht" in text for text in german_texts)
    left_out = " ".join(drawn(report_panel.RAYBUNDLE_PT_left_out).texts())
    assert "Empty: es hat keine Flächen" in left_out
    warnings = " ".join(drawn(report_panel.RAYBUNDLE_PT_warnings).texts())
    assert "wird ausgelassen" in warnings and "is left out" not in warnings


@pytest.mark.needs_library
def test_the_summary(german_file, closed_box):
    report = raybundle.bake(bpy.context)
    report.seconds['total'] = 1.0
    report.patches, report.bundles, report.error = 100, 64, {'noise': 0.02, 'total': 0.03}
    report.warnings = []
    assert report.summary() == ("1 object baked in 1.00 s: 100 patches, 64 bundles, noise 2 %, "
                                "stated error 3 %")
    report.warnings = ["one", "two"]
    assert report.summary().endswith("stated error 3 %, 2 warnings")
    assert translated(report.summary()) == (
        "1 Objekt in 1.00 s gebacken: 100 Patches, 64 Bündel, Rauschen 2 %, angegebener Fehler "
        "3 %, 2 Warnungen")


def calls(path: Path, name: str) -> list[ast.Call]:
    """Returns the calls of a function or a method in a module."""
    return [node for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            if isinstance(node, ast.Call) and name in (
                getattr(node.func, 'id', None), getattr(node.func, 'attr', None))]


def test_all_reports_of_operators_are_translated():
    found = [call for path in ADDON.rglob("*.py") for call in calls(path, 'report')
             if len(call.args) == 2 and isinstance(call.args[0], ast.Set)]
    assert len(found) > 20
    assert [ast.unparse(call) for call in found
            if not ast.unparse(call.args[1]).startswith("translated(")] == []


def test_exceptions_for_the_user_have_messages():
    raised = [(path, call) for path in ADDON.rglob("*.py")
              for name in ('BakeError', 'ExportError', 'MeshError') for call in calls(path, name)]
    assert len(raised) > 15
    # Errors of values that scripts set, and reasons that are messages already.
    assert sorted(f"{path.name}: {ast.unparse(call)}" for path, call in raised
                  if not ast.unparse(call.args[0]).startswith("Message(")) == [
        "bake.py: BakeError(_nothing_to_bake(settings, export))", "bake.py: BakeError(str(error))",
        "channel_bake.py: BakeError(reason)", "gltf_export.py: ExportError(EXPORTER_OFF)"]
