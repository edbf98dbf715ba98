# SPDX-License-Identifier: GPL-3.0-or-later
"""The report of a bake. Scripts read it as JSON, so its keys must not change."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field

from .library_messages import recognised
from .messages import Message, encoded
from .warning_lines import grouped


class BakeError(RuntimeError):
    """Raised if a bake is impossible. The message is for the user and names the object
    concerned."""


@dataclass(frozen=True)
class ObjectReport:
    """The result of one object."""

    name: str
    corners: int  # number, of the mesh that was written to; 0: not baked
    status: str  # 'baked', optionally with a remark, or the reason why the object was not baked
    # Keys as in BakeReport.error. {}: not baked.
    error: dict[str, float] = field(default_factory=dict)
    vertices: int = 0  # number, of the mesh that was written to; 0: not baked
    # Number that its mesh has, or would have, with the topology 'ADAPTIVE'. 0: not counted.
    adaptive_vertices: int = 0


@dataclass
class BakeReport:
    """The statistics of a bake: its work, its times, and the accuracy of its result."""

    seconds: dict[str, float] = field(default_factory=dict)  # per stage, and 'total'
    patches: int = 0
    # Tiles that were cut into smaller patches; keys: why, tiles (number of tiles).
    refined: list[dict] = field(default_factory=list)
    bundles: int = 0
    lines: int = 0
    exchanges: int = 0
    shadow_rays: int = 0
    estimated_error: float = 0.0  # relative noise of the light on patches
    # The stated error, relative to the light; keys: noise, discretisation, mesh, total.
    error: dict[str, float] = field(default_factory=dict)
    # In W, except balance_error, which is relative.
    energy: dict[str, float] = field(default_factory=dict)
    peak_memory_bytes: int = 0
    # Number of vertices that all copies have, or would have, with the topology 'ADAPTIVE'. 0: not
    # counted.
    adaptive_vertices: int = 0
    # Of the objects whose light was written to finer copies, with modifiers; keys: before, after.
    # {}: there are no copies.
    vertices: dict[str, int] = field(default_factory=dict)
    light_sets: list[dict] = field(default_factory=list)  # keys: name, attribute, estimated_error
    objects: list[ObjectReport] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    # Identifiers of the library's warnings for programs, such as "MAX_BUNDLES", without duplicates.
    warning_ids: list[str] = field(default_factory=list)
    # For each of the warnings; keys: id (see above, "" for warnings of the add-on), kind ('object',
    # 'material', 'light', 'mesh' or "") and names of the owners. A warning that joins many lines
    # lists only the first owners in its text, but all of them here.
    warning_owners: list[dict] = field(default_factory=list)
    # Work that was skipped because the scene did not need it; keys: id, what, why, count.
    skipped: list[dict] = field(default_factory=list)
    # The last bake that reused nothing, to estimate times; keys: target_error, seconds (by stage).
    full_bake: dict = field(default_factory=dict)

    @classmethod
    def from_native(cls, values: dict) -> BakeReport:
        """Returns a report with the values of the native library's report, without objects."""
        report = cls()
        for name in ('seconds', 'patches', 'refined', 'bundles', 'lines', 'exchanges',
                     'shadow_rays', 'estimated_error', 'error', 'energy', 'peak_memory_bytes',
                     'adaptive_vertices', 'light_sets', 'warnings', 'warning_ids', 'skipped'):
            if name in values:
                setattr(report, name, values[name])
        report.warnings = [recognised(line) for line in report.warnings]
        report.warning_owners = [{'id': identifier} for identifier in report.warning_ids]
        report.warning_ids = list(dict.fromkeys(report.warning_ids))
        return report

    def add_warnings(self, lines: Iterable[str]) -> None:
        """Adds the add-on's lines to the library's warnings, joins those with the same message
        about several owners, and lists the owners. To be called once."""
        ids = dict(zip(self.warnings, (item['id'] for item in self.warning_owners)))
        # The library's warnings come first, because one of lost or created light is the first of
        # them and has to be read before all others.
        groups = grouped([*self.warnings, *lines])
        self.warnings = [group.text for group in groups]
        self.warning_owners = [{'id': ids.get(group.first, ""), 'kind': group.kind,
                                'names': list(group.names)} for group in groups]

    def to_json(self, indent: int | None = None) -> str:
        """Returns the report as JSON, with the templates of the add-on's texts, so that panels can
        translate them. indent: as in json.dumps."""
        texts = [*self.warnings, *(item.status for item in self.objects)]
        values = {**asdict(self), 'templates': {
            text: encoded(text) for text in texts if isinstance(text, Message)}}
        return json.dumps(values, indent=indent)

    def summary(self) -> str:
        """Returns one line for the status bar."""
        baked = sum(item.status.startswith('baked') for item in self.objects)
        text = Message("{objects} baked in {seconds} s: {patches} patches, {bundles} bundles, "
                       "noise {noise} %, stated error {error} %",
                       objects=Message("{count} object" if baked == 1 else "{count} objects",
                                       count=baked),
                       seconds=f"{self.seconds['total']:.2f}", patches=self.patches,
                       bundles=self.bundles, noise=f"{100.0 * self.error['noise']:.2g}",
                       error=f"{100.0 * self.error['total']:.2g}")
        if not self.warnings:
            return text
        return Message("{baked}, {count} warnings" if len(self.warnings) > 1 else
                       "{baked}, {count} warning", baked=text, count=len(self.warnings))
