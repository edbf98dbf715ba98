# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bake says about itself. The JSON form is read by scripts: its keys are fixed."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field


class BakeError(RuntimeError):
    """A bake that cannot go on; the message is for the user and names the object concerned."""


@dataclass(frozen=True)
class ObjectReport:
    name: str
    corners: int
    status: str  # 'baked', perhaps with a remark, or why not
    error: dict[str, float] = field(default_factory=dict)  # as BakeReport.error; {}: not baked


@dataclass
class BakeReport:
    seconds: dict[str, float] = field(default_factory=dict)  # per stage, and 'total'
    patches: int = 0
    refined: list[dict] = field(default_factory=list)  # why, tiles: cut into smaller patches
    bundles: int = 0
    lines: int = 0
    exchanges: int = 0
    shadow_rays: int = 0
    estimated_error: float = 0.0  # relative
    # Relative: noise, discretisation, mesh, total.
    error: dict[str, float] = field(default_factory=dict)
    energy: dict[str, float] = field(default_factory=dict)  # W; balance_error is relative
    peak_memory_bytes: int = 0
    light_sets: list[dict] = field(default_factory=list)  # name, attribute, estimated_error
    objects: list[ObjectReport] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    # What the library's warnings are of, for programs: "MAX_BUNDLES" and so on, each once.
    warning_ids: list[str] = field(default_factory=list)
    skipped: list[dict] = field(default_factory=list)  # id, what, why, count

    @classmethod
    def from_native(cls, values: dict) -> BakeReport:
        report = cls()
        for name in ('seconds', 'patches', 'refined', 'bundles', 'lines', 'exchanges',
                     'shadow_rays', 'estimated_error', 'error', 'energy', 'peak_memory_bytes',
                     'light_sets', 'warnings', 'warning_ids', 'skipped'):
            if name in values:
                setattr(report, name, values[name])
        report.warning_ids = list(dict.fromkeys(report.warning_ids))
        return report

    def to_json(self, indent: int | None = None) -> str:
        return json.dumps(asdict(self), indent=indent)

    def summary(self) -> str:
        """One line for the status bar."""
        baked = sum(item.status.startswith('baked') for item in self.objects)
        warnings = f", {len(self.warnings)} warnings" if self.warnings else ""
        return (f"{baked} objects baked in {self.seconds['total']:.2f} s: {self.patches} patches, "
                f"{self.bundles} bundles, noise {100.0 * self.error['noise']:.2g} %, error "
                f"{100.0 * self.error['total']:.2g} %{warnings}")
