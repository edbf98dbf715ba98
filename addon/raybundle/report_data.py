# SPDX-License-Identifier: GPL-3.0-or-later
"""The last report of a scene as panels and operators read it. Files may hold reports of earlier
releases, in which keys are missing."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import lru_cache

import bpy

from .library_messages import recognised
from .messages import decoded
from .warning_lines import owners


@dataclass(frozen=True)
class Line:
    """A warning of the report."""

    text: str  # in English; a message that can be translated, if it is known
    id: str  # identifier of the library's warning, "" for warnings of the add-on or unknown
    kind: str  # of the owners: 'object', 'material', 'light', 'mesh', or "" if it names none
    names: tuple[str, ...]  # of the owners


def read_report(scene: bpy.types.Scene) -> dict:
    """Returns the scene's last report, {} if there is none. The caller must not change it."""
    return _parsed(scene.raybundle.report)


# Panels are drawn at every movement of the mouse.
@lru_cache(maxsize=4)
def _parsed(text: str) -> dict:
    try:
        report = json.loads(text) if text else {}
    except ValueError:  # a script may have stored anything
        return {}
    return report if isinstance(report, dict) else {}


def warning_lines(report: dict) -> list[Line]:
    """Returns the warnings of a report with their owners."""
    texts = report.get('warnings', [])
    known = report.get('warning_owners', [])
    if len(known) == len(texts):
        return [Line(as_message(report, text), item.get('id', ""), item['kind'],
                     tuple(item['names'])) for text, item in zip(texts, known)]
    return [Line(as_message(report, text), "", *owners(text)) for text in texts]


def as_message(report: dict, text: str) -> str:
    """Returns a text of a report as a message, or as it is if its template is unknown."""
    stored = report.get('templates', {}).get(text)
    return recognised(text) if stored is None else decoded(stored)


def left_out_objects(report: dict) -> list[tuple[str, str]]:
    """Returns the name of each object that was not baked, and the reason in English."""
    return [(item['name'], item['status']) for item in report.get('objects', [])
            if not item['status'].startswith('baked')]


def noisiest_object(report: dict) -> tuple[float, str] | None:
    """Returns the noise, relative to its own light, and the name of the noisiest of several baked
    objects. The target is about this noise, as far as it is seen. Returns None if the report does
    not tell."""
    noises = [(item['error']['noise'], item['name']) for item in report.get('objects', [])
              if item.get('error')]
    return max(noises) if len(noises) > 1 else None


def coarse_objects(report: dict, least: float) -> list[tuple[str, float, int, int]]:
    """Returns each baked object whose mesh causes a larger error than `least`, relative to the
    object's own light: its name, this error, its number of vertices, and that with the topology
    ADAPTIVE, 0 if they were not counted. The objects with the largest error come first."""
    found = [(item['name'], item['error']['mesh'], item.get('vertices', 0),
              item.get('adaptive_vertices', 0))
             for item in report.get('objects', [])
             if item.get('error') and item['error'].get('mesh', 0.0) > least]
    return sorted(found, key=lambda item: (-item[1], item[0]))


def time_text(seconds: float) -> str:
    """Returns a time with two digits and its unit, which are the same in all languages."""
    if seconds < 100.0:
        return f"{float(f'{seconds:.2g}'):g} s"
    if seconds < 6000.0:
        return f"{seconds / 60.0:.0f} min"
    return f"{seconds / 3600.0:.1f} h"
