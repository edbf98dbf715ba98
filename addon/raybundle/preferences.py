# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's preferences: what does not belong to a scene but to the user and the computer."""

from __future__ import annotations

import platform
from pathlib import Path

import bpy
from bpy.app.translations import pgettext_tip as tip_
from bpy.props import BoolProperty, FloatProperty, IntProperty

from .messages import Message, translated
from .report_data import read_report

# The add-on's zip contains the guide; in a clone of the repository it is beside the add-on.
_GUIDES = (Path(__file__).parent / "docs" / "user_guide.md",
           Path(__file__).parent.parent.parent / "docs" / "user_guide.md")


# Usual seconds without a change of the light after which live mode bakes.
LIVE_DELAY = 0.4


def get() -> RaybundlePreferences | None:
    """Returns the add-on's preferences. Returns None if the add-on is registered by a script and
    not enabled in the preferences of Blender."""
    addon = bpy.context.preferences.addons.get(__package__)
    return addon.preferences if addon is not None else None


def studies_methods() -> bool:
    """Returns whether panels show the methods of the thesis."""
    user = get()
    return user is not None and user.study_methods


def _guide() -> Path | None:
    return next((path for path in _GUIDES if path.is_file()), None)


class RaybundlePreferences(bpy.types.AddonPreferences):
    # It differs between a legacy add-on (raybundle) and an extension
    # (bl_ext.REPOSITORY.raybundle).
    bl_idname = __package__

    study_methods: BoolProperty(
        name="Study Methods",
        description="Show the panel Method, with the solvers, first shots, directions and "
                    "projectors to compare. The defaults are nearly always the fastest",
        default=False)
    threads: IntProperty(
        name="Threads",
        description="Number of processor threads for scenes whose own number is 0; 0 uses all",
        default=0, min=0, soft_max=64, max=1024)
    memory_limit: FloatProperty(
        name="Memory Limit (MB)",
        description="Maximum memory of a bake, in MB, for scenes that do not set their own limit; "
                    "0 allows three quarters of the computer's memory",
        default=0.0, min=0.0, max=1e9, soft_max=262_144.0, precision=0, step=6400)
    live_bakes: BoolProperty(
        name="Bake when Changes Stop",
        description="In live mode, replace the draft by a bake with the settings of the scene as "
                    "soon as changes stop. Off: the draft stays until you press Bake",
        default=True)
    live_delay: FloatProperty(
        name="Delay",
        description="Time without changes after which live mode bakes",
        default=LIVE_DELAY, min=0.0, soft_max=10.0, max=3600.0, precision=1, step=10,
        subtype='TIME_ABSOLUTE', unit='TIME_ABSOLUTE')

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "threads")
        layout.prop(self, "memory_limit")
        layout.prop(self, "study_methods")
        layout.separator()
        column = layout.column(heading="Live")
        column.prop(self, "live_bakes")
        row = column.row()
        row.active = self.live_bakes
        row.prop(self, "live_delay")
        layout.separator()
        row = layout.row()
        row.operator("raybundle.open_guide", icon='HELP')
        row.operator("raybundle.copy_bug_report", icon='URL')


class RAYBUNDLE_OT_open_guide(bpy.types.Operator):
    """Open the user guide, which is part of the add-on, in the web browser"""
    bl_idname = "raybundle.open_guide"
    bl_label = "User Guide"

    @classmethod
    def poll(cls, context):
        if _guide() is None:
            cls.poll_message_set(tip_("This copy of the add-on contains no user guide"))
            return False
        return True

    def execute(self, context):
        bpy.ops.wm.url_open(url=_guide().as_uri())
        return {'FINISHED'}


class RAYBUNDLE_OT_copy_bug_report(bpy.types.Operator):
    """Copy versions, settings and the last warnings to the clipboard, to report a bug"""
    bl_idname = "raybundle.copy_bug_report"
    bl_label = "Copy Bug Report"

    def execute(self, context):
        context.window_manager.clipboard = bug_report(context.scene)
        self.report({'INFO'}, translated(Message("The bug report is in the clipboard: paste it "
                                                 "where you report the bug")))
        return {'FINISHED'}


def bug_report(scene: bpy.types.Scene | None) -> str:
    """Returns a text for the report of a bug: versions, and settings and report of the scene."""
    # The package and the settings are complete only after this module was imported.
    from . import bl_info
    from .properties import BakeSettings
    lines = [f"Raybundle {'.'.join(map(str, bl_info['version']))}",
             f"Blender {bpy.app.version_string}, {bpy.app.build_platform.decode()}",
             f"System {platform.platform()}", f"Python {platform.python_version()}"]
    if scene is not None:
        settings = scene.raybundle
        # The attribute's name may be private.
        changed = [f"{name} = {getattr(settings, name)!r}" for name in BakeSettings.names()
                   if name != 'attribute' and settings.is_property_set(name)]
        lines.append("Settings: " + (", ".join(changed) or "default"))
        report = read_report(scene)
        # Names of objects may be private, and are not needed to find most bugs.
        lines.append(f"Warnings: {', '.join(report.get('warning_ids', [])) or 'none'}")
        lines.append(f"Seconds: {report.get('seconds', {})}")
    return "\n".join(lines) + "\n"


register, unregister = bpy.utils.register_classes_factory((
    RaybundlePreferences,
    RAYBUNDLE_OT_open_guide,
    RAYBUNDLE_OT_copy_bug_report,
))
