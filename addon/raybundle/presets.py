# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of a scene's settings, in Blender's own preset menu at the top of the panel.

None is shipped: Draft, Good and Final are buttons, and the other defaults suit most scenes.
"""

from __future__ import annotations

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from .properties import BakeSettings

_FOLDER = "raybundle"
# These depend on the computer or the scene, not on the look that a preset stands for.
_LEFT_OUT = {'memory_limit', 'threads', 'scope', 'seed', 'skips_off'}


class RAYBUNDLE_OT_preset_add(AddPresetBase, bpy.types.Operator):
    """Store the settings of this scene as a preset, or remove the chosen preset"""
    bl_idname = "raybundle.preset_add"
    bl_label = "Add Raybundle Preset"
    preset_menu = "RAYBUNDLE_PT_presets"
    preset_subdir = _FOLDER
    preset_defines = ["settings = bpy.context.scene.raybundle"]
    preset_values = [f"settings.{name}" for name in BakeSettings.names() if name not in _LEFT_OUT]


class RAYBUNDLE_PT_presets(PresetPanel, bpy.types.Panel):
    bl_label = "Raybundle Presets"
    preset_subdir = _FOLDER
    preset_operator = "script.execute_preset"
    preset_add_operator = "raybundle.preset_add"

    def draw(self, context):
        if bpy.utils.preset_paths(_FOLDER):
            super().draw(context)
            return
        # Blender would draw "* Missing Paths *" as long as there is no preset.
        window_manager = context.window_manager
        row = self.layout.row()
        row.prop(window_manager, "preset_name", text="")
        row.operator(self.preset_add_operator, text="",
                     icon='ADD').name = window_manager.preset_name


register, unregister = bpy.utils.register_classes_factory((
    RAYBUNDLE_OT_preset_add,
    RAYBUNDLE_PT_presets,
))
