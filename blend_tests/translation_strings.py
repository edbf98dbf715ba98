# SPDX-License-Identifier: GPL-3.0-or-later
"""Collects the texts of the add-on's interface, and writes them to the template of translations.

    blender -b --factory-startup -P blend_tests/translation_strings.py

Writes addon/raybundle/translations/raybundle.pot, and rewrites the .po files beside it: new texts
are added without a translation, and texts that no longer exist are removed.

Texts of classes (labels, descriptions, properties and their choices) are read from Blender, all
others from the code: texts of labels and buttons, texts in iface_() and tip_(), templates of
Message(), and those of the native library's texts.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

ADDON = Path(__file__).parent.parent / "addon" / "raybundle"
sys.path.insert(0, str(ADDON.parent))
sys.dont_write_bytecode = True

import raybundle  # noqa: E402
from raybundle import library_messages, translations  # noqa: E402

TEMPLATE = translations.FOLDER / "raybundle.pot"
# Contexts in which Blender looks a text up.
GENERAL, OPERATOR = "*", "Operator"
# Functions that translate their first argument, and the class of messages, which are translated
# when they are shown.
_TRANSLATING = {'iface_', 'tip_', 'Message'}
# Methods of layouts that translate their argument `text`, and the context of the text.
_LAYOUT = {'label': GENERAL, 'prop': GENERAL, 'menu': GENERAL, 'prop_enum': GENERAL,
           'operator': OPERATOR, 'operator_menu_enum': OPERATOR}
_HEADER = '''# Translation of Raybundle.
msgid ""
msgstr ""
"Content-Type: text/plain; charset=UTF-8\\n"
'''

Key = tuple[str, str]


def registered_classes() -> Iterator[type]:
    """Yields the add-on's classes that are registered in Blender."""
    bases = (bpy.types.PropertyGroup, bpy.types.Operator, bpy.types.Panel, bpy.types.Menu,
             bpy.types.UIList, bpy.types.AddonPreferences)
    for base in bases:
        for item in base.__subclasses__():
            if item.__module__.partition(".")[0] == "raybundle" and item.is_registered:
                yield item


def rna_of(item: type) -> bpy.types.Struct:
    """Returns the description of a class in Blender. An operator has two; that of the class has no
    texts."""
    if issubclass(item, bpy.types.Operator):
        return getattr(bpy.ops.raybundle, item.bl_idname.partition(".")[2]).get_rna_type()
    return item.bl_rna


def own_properties(item: type) -> Iterator[bpy.types.Property]:
    """Yields the properties that a class defines and that are shown, without those of Blender's own
    classes."""
    names = {name for base in item.__mro__ if base.__module__.partition(".")[0] == "raybundle"
             for name in base.__dict__.get('__annotations__', ())}
    # A property that replaces one of Blender, such as `name`, is listed after it.
    found = {definition.identifier: definition for definition in rna_of(item).properties}
    yield from (definition for name, definition in found.items()
                if name in names and not definition.is_hidden)


def texts_of_property(definition: bpy.types.Property) -> Iterator[Key]:
    yield definition.translation_context, definition.name
    yield GENERAL, definition.description
    if definition.type == 'ENUM':
        for choice in definition.enum_items:
            yield definition.translation_context, choice.name
            yield GENERAL, choice.description


def texts_of_class(item: type) -> Iterator[Key]:
    """Yields the texts of a class and of its own properties."""
    if issubclass(item, bpy.types.Operator):
        yield OPERATOR, item.bl_label
        yield GENERAL, rna_of(item).description
    elif hasattr(item, 'bl_label'):
        yield GENERAL, item.bl_label
    for definition in own_properties(item):
        yield from texts_of_property(definition)


def texts_of_code(source: str) -> Iterator[Key]:
    """Yields the texts in the code of a module that are translated when they are shown."""
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Call):
            continue
        if isinstance(node.func, ast.Name) and node.func.id in _TRANSLATING and node.args:
            yield from ((GENERAL, text) for text in _strings(node.args[0]))
        elif isinstance(node.func, ast.Attribute) and node.func.attr in _LAYOUT:
            options = {keyword.arg: keyword.value for keyword in node.keywords}
            if 'text' in options and 'translate' not in options:
                yield from ((_LAYOUT[node.func.attr], text) for text in _strings(options['text']))


def _strings(node: ast.expr) -> Iterator[str]:
    """Yields the text of an expression, or both texts of a conditional one."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.IfExp):
        yield from _strings(node.body)
        yield from _strings(node.orelse)


def all_texts() -> list[Key]:
    """Returns all texts of the interface, each with its context, sorted."""
    found = {key for item in registered_classes() for key in texts_of_class(item)}
    for owner in (bpy.types.Scene, bpy.types.Object):
        found.update(texts_of_property(owner.bl_rna.properties['raybundle']))
    found.update((GENERAL, text)
                 for text in (*library_messages.WARNINGS, *library_messages.ERRORS,
                              *library_messages.SKIPS))
    for path in ADDON.rglob("*.py"):
        found.update(texts_of_code(path.read_text(encoding="utf-8")))
    return sorted(((context, text) for context, text in found if text.strip()),
                  key=lambda key: (key[1].lower(), key))


def quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'


def po_text(keys: list[Key], messages: dict[Key, str]) -> str:
    """Returns the text of a .po file."""
    return _HEADER + "".join(
        f"\nmsgctxt {quoted(context)}\nmsgid {quoted(text)}\n"
        f"msgstr {quoted(messages.get((context, text), ''))}\n" for context, text in keys)


def main() -> None:
    if not hasattr(bpy.types.Scene, "raybundle"):
        raybundle.register()
    keys = all_texts()
    TEMPLATE.write_text(po_text(keys, {}), encoding="utf-8")
    for path in sorted(translations.FOLDER.glob("*.po")):
        messages = translations.read_language(path)
        path.write_text(po_text(keys, messages), encoding="utf-8")
        missing = sum(not messages.get(key) for key in keys)
        print(f"{path.name}: {len(keys)} texts, {missing} without a translation")


if __name__ == "__main__":
    main()
