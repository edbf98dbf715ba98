# SPDX-License-Identifier: GPL-3.0-or-later
"""The texts of the interface in other languages, from the files LANGUAGE.po of this folder.

LANGUAGE is a language of Blender with or without its country, such as de or pt_BR. To add a
language, copy raybundle.pot to LANGUAGE.po and fill in the translations, with any editor of files
of gettext. blend_tests/translation_strings.py makes raybundle.pot from the code and adds new texts
to the .po files.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path

import bpy

FOLDER = Path(__file__).parent
# By context and original text, as bpy.app.translations wants them.
Messages = dict[tuple[str, str], str]

_STRING = re.compile(r'(?:(msgctxt|msgid|msgstr) )?("(?:[^"\\]|\\.)*")')


def read_messages(text: str) -> Messages:
    """Returns the translations in the text of a .po file, without its header. A text that is not
    translated yet is ""."""
    messages: Messages = {}
    entry: dict[str, str] = {}
    current = ""
    for line in [*text.splitlines(), 'msgctxt ""']:
        match = _STRING.fullmatch(line.strip())
        if match is None:  # a comment or an empty line
            continue
        if match[1] and (match[1] == 'msgctxt' or match[1] in entry):
            if entry.get('msgid'):
                messages[entry.get('msgctxt', "*"), entry['msgid']] = entry.get('msgstr', "")
            entry = {}
        current = match[1] or current
        # The escapes of gettext are among those of Python.
        entry[current] = entry.get(current, "") + ast.literal_eval(match[2])
    return messages


def read_language(path: Path) -> Messages:
    return read_messages(path.read_text(encoding="utf-8"))


def register() -> None:
    bpy.app.translations.register(__package__, {
        path.stem: {key: translated for key, translated in read_language(path).items()
                    if translated}
        for path in sorted(FOLDER.glob("*.po"))})


def unregister() -> None:
    bpy.app.translations.unregister(__package__)
