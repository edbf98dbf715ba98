# SPDX-License-Identifier: GPL-3.0-or-later
"""What the add-on says to the user: texts in English that can be shown in the user's language.

Reports in files, exceptions and scripts have the English text. `translated` is called where a text
is shown: in reports of operators, in the status bar and in panels.
"""

from __future__ import annotations

from bpy.app import translations

# Blender 4.2 translates reports by a switch of their own, 3.4 by that of tooltips.
_look_up = getattr(translations, 'pgettext_rpt', translations.pgettext_tip)


class Message(str):
    """An English text that is made from a template, with named values in braces.

    Values may be messages themselves, or exceptions with messages. Names of objects and the like
    contain their quotes (`quoted`), so that a value can be one name or a list of names.
    blend_tests/translation_strings.py collects the templates from calls of this class.
    """

    template: str
    values: dict[str, str]

    def __new__(cls, template: str, /, **values: object) -> Message:
        texts = {name: _text(value) for name, value in values.items()}
        message = super().__new__(cls, _filled(template, texts))
        message.template, message.values = template, texts
        return message


def _text(value: object) -> str:
    """Returns a value as text: as a message if it is one, or an exception with one."""
    if isinstance(value, Exception):
        said = value.args[0] if value.args else ""
        # Exceptions of Blender's operators end with a line break.
        value = said if isinstance(said, Message) else str(value).strip()
    return value if isinstance(value, Message) else str(value)


def _filled(template: str, values: dict[str, str]) -> str:
    # A template without values may be the name of something, and contain any braces.
    return template.format(**values) if values else template


def quoted(name: str) -> str:
    """Returns a name of the user's data as messages contain it."""
    return f'"{name}"'


def translated(said: str | Exception) -> str:
    """Returns a message, or the message of an exception, in the language of Blender's interface.
    Other texts are returned as they are."""
    message = _text(said)
    if not isinstance(message, Message):
        return message
    return _filled(_look_up(message.template),
                   {name: translated(value) for name, value in message.values.items()})


def encoded(text: str) -> str | list:
    """Returns a text as JSON can store it: a message as its template and its values."""
    if not isinstance(text, Message):
        return text
    return [text.template, {name: encoded(value) for name, value in text.values.items()}]


def decoded(stored: str | list) -> str:
    """Returns the text that `encoded` has stored."""
    if isinstance(stored, str):
        return stored
    template, values = stored
    return Message(template, **{name: decoded(value) for name, value in values.items()})
