# SPDX-License-Identifier: GPL-3.0-or-later
"""The report of a bake. Scripts read it as JSON: its keys must not change."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field


class BakeError(RuntimeError):
    """A bake that cannot be made; the message is for the user and names the object concerned."""


@dataclass(frozen=True)
class ObjectReport:
    """What became of one object."""

    name: str
    corners: int  # of the mesh that was written to; 0: the object was not baked
    status: str  # 'baked', perhaps followed by a remark, or the reason why it was not
    error: dict[str, float] = field(default_factory=dict)  # as BakeReport.error; {}: not baked


@dataclass
class BakeReport:
    """What a bake did, how long it took and how exact its result is."""

    seconds: dict[str, float] = field(default_factory=dict)  # per stage, and 'total'
    patches: int = 0
    # Tiles of patches that were cut into smaller ones; keys: why, tiles (their number).
    refined: list[dict] = field(default_factory=list)
    bundles: int = 0
    lines: int = 0
    exchanges: int = 0
    shadow_rays: int = 0
    estimated_error: float = 0.0  # relative noise of the light on the patches
    # The stated error, relative to the light; keys: noise, discretisation, mesh, total.
    error: dict[str, float] = field(default_factory=dict)
    energy: dict[str, float] = field(default_factory=dict)  # W; balance_error is relative
    peak_memory_bytes: int = 0
    light_sets: list[dict] = field(default_factory=list)  # keys: name, attribute, estimated_error
    objects: list[ObjectReport] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    # What the library's warnings are of, for programs: "MAX_BUNDLES" and so on, each once.
    warning_ids: list[str] = field(default_factory=list)
    # Work that was not needed; keys: id, what, why, count.
    skipped: list[dict] = field(default_factory=list)

    @classmethod
    def from_native(cls, values: dict) -> BakeReport:
        """The report with what the native library reports, without objects."""
        report = cls()
        for name in ('seconds', 'patches', 'refined', 'bundles', 'lines', 'exchanges',
                     'shadow_rays', 'estimated_error', 'error', 'energy', 'peak_memory_bytes',
                     'light_sets', 'warnings', 'warning_ids', 'skipped'):
            if name in values:
                setattr(report, name, values[name])
        report.warning_ids = list(dict.fromkeys(report.warning_ids))
        return report

    def to_json(self, indent: int | None = None) -> str:
        """The JSON form; indent: as in json.dumps."""
        return json.dumps(asdict(self), indent=indent)

    def summary(self) -> str:
        """One line for the status bar."""
        baked = sum(item.status.startswith('baked') for item in self.objects)
        warnings = f", {len(self.warnings)} warnings" if self.warnings else ""
        return (f"{baked} objects baked in {self.seconds['total']:.2f} s: {self.patches} patches, "
                f"{self.bundles} bundles, noise {100.0 * self.error['noise']:.2g} %, error "
                f"{100.0 * self.error['total']:.2g} %{warnings}")
