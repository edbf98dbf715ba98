# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the progress of a running bake, with the buttons that stop it."""

from __future__ import annotations

import bpy

from . import bake_run
from .text_wrap import draw_wrapped


def draw_progress(layout: bpy.types.UILayout, context: bpy.types.Context) -> bool:
    """Draws the progress of the running bake. Returns False, and draws nothing, if none runs, or
    only one of live mode."""
    run = bake_run.active()
    if run is None or run.is_live:
        return False
    text = run.progress.text(run.state)
    column = layout.column(align=True)
    column.label(text=run.progress.stage_name(), icon='TIME')
    if hasattr(column, 'progress'):  # from Blender 4.0 on
        column.progress(factor=run.progress.fraction, type='BAR', text=text)
    else:
        draw_wrapped(column, context, text, 'BLANK1')
    # Below each other, because half of a narrow panel would cut the names off.
    column = layout.column(align=True)
    column.operator("raybundle.stop", text="Cancel", icon='CANCEL').keep = False
    kept = column.column(align=True)
    kept.enabled = run.shows_light
    kept.operator("raybundle.stop", text="Stop and Keep", icon='CHECKMARK').keep = True
    return True
