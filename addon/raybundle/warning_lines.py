# SPDX-License-Identifier: GPL-3.0-or-later
"""The lines of the report: joins those that contain the same message for several owners, such as 45
materials, and finds the owners that a line names."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from string import Formatter

from .messages import Message, quoted

_MOST_NAMES = 12
# A line consists of the kind of the owner, its name, and the message, which may begin with a count.
_LINE = re.compile(r'(?P<kind>(?:[a-z]+ )?)"(?P<name>.+?)"(?P<said>[: ].*)', re.DOTALL)
# A percentage is no count: those of several owners have no sum.
_COUNT = re.compile(r': (?P<count>\d+) (?!% )(?P<counted>.*)', re.DOTALL)
# The suffix that Blender adds to names of copies, here of nodes.
_SUFFIX = re.compile(r'\.\d{3,}"')

# Kinds of owners that can be shown to the user. A name without a kind at the start of a line is
# that of an object.
_KINDS = ('object', 'material', 'light', 'mesh')
_NAME = re.compile(r'(?P<before>[^"]*)"(?P<name>[^"]+)"')
_KIND_BEFORE = re.compile(r'(?:^|\W)(?P<kind>object|material|light|mesh)(?:e?s)?:? $',
                          re.IGNORECASE)
# Names after the first one of a list, such as: "A", "B" (3 %), "C".
_NEXT_OF_LIST = re.compile(r'(?: \([^"]*\))?, ')


@dataclass(frozen=True)
class Group:
    """Equal messages about several owners."""

    text: str
    kind: str  # of the owners: one of _KINDS, or "" if the line names none of them
    names: tuple[str, ...]  # of all owners, although the text lists only the first of many
    first: str  # the first of the lines that were joined


def grouped(lines: Iterable[str]) -> list[Group]:
    """Joins lines that differ only by owner and count: the owners are listed and the counts are
    added. The order is that of the first line of each group."""
    groups: dict[tuple[str, str], list[re.Match]] = {}
    for line in dict.fromkeys(lines):
        match = _LINE.fullmatch(line)
        key = ("", line)
        if match is not None:
            said = match['said']
            count = _COUNT.fullmatch(said)
            key = (match['kind'], _SUFFIX.sub('"', f": # {count['counted']}" if count else said))
        groups.setdefault(key, []).append(match)
    return [_joined(said, matches) for (_, said), matches in groups.items()]


def _joined(said: str, matches: list[re.Match | None]) -> Group:
    """Returns the group of lines with the same message. said: the message. matches: of _LINE; one
    None if the line has no owner at its start."""
    first = matches[0].string if matches[0] is not None else said
    if len(matches) == 1:
        return Group(first, *owners(first), first)
    counts = [_COUNT.fullmatch(match['said']) for match in matches]
    total = None
    if counts[0] is not None:
        total = sum(int(count['count']) for count in counts)
        said = f": {total} {counts[0]['counted']}"
    names = tuple(match['name'] for match in matches)
    listed_names = listed([quoted(name) for name in names], _MOST_NAMES)
    kind = matches[0]['kind'].strip() or 'object'
    text = f"{matches[0]['kind']}{listed_names}{said}"
    if isinstance(first, Message) and (message := _about(first, listed_names, total)) == text:
        text = message
    return Group(text, kind if kind in _KINDS else "", names if kind in _KINDS else (), first)


def _about(message: Message, owner: str | None, count: int | None = None) -> Message:
    """Returns the same message about another owner, which the first value of the template is or
    contains, and with another count. Suffixes of copies are removed from other names. None: the
    owner or the count stays."""
    fields = [field for _, field, *_ in Formatter().parse(message.template) if field]
    values = {}
    for field in fields:
        value = message.values[field]
        wanted = owner if field == fields[0] else None
        if isinstance(value, Message):
            values[field] = _about(value, wanted) if value.values else value
        elif field == 'count' and count is not None:
            values[field] = count
        else:
            values[field] = _SUFFIX.sub('"', value) if wanted is None else wanted
    return Message(message.template, **values)


def owners(text: str) -> tuple[str, tuple[str, ...]]:
    """Returns the kind and the names of the owners that a line names in quotes: those of the first
    kind that it names. Returns ("", ()) if it names none, and no names that the line leaves out."""
    found: dict[str, None] = {}
    kind = current = ""
    start = 0
    for match in _NAME.finditer(text):
        before = match['before']
        said = _KIND_BEFORE.search(before)
        if said is not None:
            current = said['kind'].lower()
        elif start == 0 and before == "" or before.endswith(" patch of "):
            current = 'object'
        elif start == 0 or not _NEXT_OF_LIST.fullmatch(before):
            current = ""
        start = match.end()
        if current and current == (kind or current):
            kind = current
            found[match['name']] = None
    return kind, tuple(found)


def listed(items: list[str], most: int = 3, separator: str = ", ") -> str:
    """Returns the first `most` items and the number of further items."""
    shown = items[:most]
    text = separator.join(shown)
    if any(isinstance(item, Message) for item in shown):
        named = {f"item{position}": item for position, item in enumerate(shown)}
        text = Message(separator.join(f"{{{name}}}" for name in named), **named)
    if len(items) <= most:
        return text
    return Message("{names} and {count} more", names=text, count=len(items) - most)
