# SPDX-License-Identifier: GPL-3.0-or-later
"""Joins lines of the report that contain the same message for several owners, such as 45
materials."""

from __future__ import annotations

import re
from collections.abc import Iterable

_MOST_NAMES = 12
# A line consists of the kind of the owner, its name, and the message, which may begin with a count.
_LINE = re.compile(r'(?P<kind>(?:[a-z]+ )?)"(?P<name>.+?)"(?P<said>[: ].*)', re.DOTALL)
_COUNT = re.compile(r': (?P<count>\d+) (?P<counted>.*)', re.DOTALL)
# The suffix that Blender adds to names of copies, here of nodes.
_SUFFIX = re.compile(r'\.\d{3,}"')


def grouped(lines: Iterable[str]) -> list[str]:
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
    result = []
    for (kind, said), matches in groups.items():
        if matches[0] is None:
            result.append(said)
        elif len(matches) == 1:
            result.append(matches[0].string)
        else:
            counts = [_COUNT.fullmatch(match['said']) for match in matches]
            if counts[0] is not None:
                total = sum(int(count['count']) for count in counts)
                said = f": {total} {counts[0]['counted']}"
            names = listed([f'"{match["name"]}"' for match in matches], _MOST_NAMES)
            result.append(f"{kind}{names}{said}")
    return result


def listed(items: list[str], most: int = 3) -> str:
    """Returns the first `most` items, separated by commas, and the number of further items."""
    text = ", ".join(items[:most])
    return text if len(items) <= most else f"{text} and {len(items) - most} more"
