# SPDX-License-Identifier: GPL-3.0-or-later
"""The lines of the report: joins those that contain the same message for several owners, such as 45
materials, and finds the owners that a line names."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

_MOST_NAMES = 12
# A line consists of the kind of the owner, its name, and the message, which may begin with a count.
_LINE = re.compile(r'(?P<kind>(?:[a-z]+ )?)"(?P<name>.+?)"(?P<said>[: ].*)', re.DOTALL)
_COUNT = re.compile(r': (?P<count>\d+) (?P<counted>.*)', re.DOTALL)
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
    if counts[0] is not None:
        total = sum(int(count['count']) for count in counts)
        said = f": {total} {counts[0]['counted']}"
    names = tuple(match['name'] for match in matches)
    listed_names = listed([f'"{name}"' for name in names], _MOST_NAMES)
    kind = matches[0]['kind'].strip() or 'object'
    return Group(f"{matches[0]['kind']}{listed_names}{said}", kind if kind in _KINDS else "",
                 names if kind in _KINDS else (), first)


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


def listed(items: list[str], most: int = 3) -> str:
    """Returns the first `most` items, separated by commas, and the number of further items."""
    text = ", ".join(items[:most])
    return text if len(items) <= most else f"{text} and {len(items) - most} more"
