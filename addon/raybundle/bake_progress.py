# SPDX-License-Identifier: GPL-3.0-or-later
"""The progress of a bake as a whole, from the progress of its stages."""

from __future__ import annotations

import time

from bpy.app.translations import pgettext_iface as iface_

from .native import RunState

# The usual share of each stage in the time of a bake, for scenes that were not baked before.
_USUAL_SHARES = {'export': 0.05, 'patches': 0.05, 'first_shot': 0.2, 'bundles': 0.25, 'solve': 0.4,
                 'reconstruction': 0.03, 'write_back': 0.02}
# No time is foretold before this share of the bake, and none for bakes of less than a second.
_LEAST_FRACTION = 0.05


class BakeProgress:
    """Joins the progress of the stages to one that never goes back."""

    def __init__(self, last_seconds: dict[str, float]) -> None:
        """last_seconds: the seconds by stage of an earlier report of the scene, or {}."""
        shares = {stage: last_seconds.get(stage, 0.0) for stage in _USUAL_SHARES}
        if not any(shares.values()):
            shares = _USUAL_SHARES
        total = sum(shares.values())
        self._shares = {stage: share / total for stage, share in shares.items()}
        self._started = time.perf_counter()
        self.stage = 'export'
        self.fraction = 0.0  # of the whole bake, 0 to 1

    def note(self, stage: str, fraction: float) -> None:
        """Takes the finished share of a stage, 0 to 1, of one of the stages of a report."""
        self.stage = stage
        if stage == 'solve' and fraction == 0.0:
            # Bundles and looks at their noise take turns. Only the share of the bundles rises.
            return
        names = list(self._shares)
        before = sum(self._shares[name] for name in names[:names.index(stage)])
        self.fraction = max(self.fraction, before + fraction * self._shares[stage])

    def seconds_left(self) -> float | None:
        """Returns the estimated time to the end of the bake. Returns None if it is unknown."""
        if self.fraction < _LEAST_FRACTION:
            return None
        elapsed = time.perf_counter() - self._started
        return elapsed * (1.0 - self.fraction) / self.fraction

    def stage_name(self) -> str:
        """Returns the name of the stage for the user."""
        return {'export': iface_("Reading the scene"),
                'patches': iface_("Dividing faces into patches"),
                'first_shot': iface_("Direct light"), 'bundles': iface_("Reflected light"),
                'solve': iface_("Reflected light"),
                'reconstruction': iface_("Light at the corners"),
                'write_back': iface_("Writing the attributes")}[self.stage]

    def text(self, state: RunState) -> str:
        """Returns the finished share, the noise so far and the time left for the user."""
        parts = [f"{100.0 * self.fraction:.0f} %"]
        if state.noise is not None:
            percent = 100.0 * state.noise
            digits = f"{percent:.2g}" if percent < 10.0 else f"{percent:.0f}"
            parts.append(iface_("noise {percent} %").format(percent=digits))
        left = self.seconds_left()
        if left is not None and left >= 1.0:
            parts.append(iface_("{seconds} s left").format(seconds=f"{left:.0f}"))
        return ", ".join(parts)
