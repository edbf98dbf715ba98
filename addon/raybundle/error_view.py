# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows the stated error of the light as colours in the 3D views.

Views show only colour attributes, but the stated error is an attribute of one number. Its colours
are therefore written to a colour attribute of their own, which the next bake and Clear remove.
"""

from __future__ import annotations

import bpy
import numpy as np
from bpy.app.translations import pgettext_tip as tip_

from . import viewport_preview
from .color_attribute import MOST_BYTES, error_colors_name, error_name, show
from .messages import Message, translated

# The error of this share of all corners is within the range of the colours.
_RANGE = 98.0


def error_meshes(scene: bpy.types.Scene) -> list[bpy.types.Mesh]:
    """Returns the scene's meshes that have a stated error and can be written, each once."""
    name = error_name(scene.raybundle.attribute)
    return [mesh for mesh in dict.fromkeys(
        item.data for item in scene.objects if item.type == 'MESH')
        if mesh.library is None and not mesh.is_editmode and name in mesh.attributes
        and mesh.attributes[name].data_type == 'FLOAT']


def write_error_colors(meshes: list[bpy.types.Mesh], name: str) -> float:
    """Writes the stated error of light as colours: black is 0, then red, yellow, and white for the
    returned error and more. name: of the light's attribute. Returns the error that is white, in the
    unit of LIGHTING."""
    errors = [_read(mesh, name) for mesh in meshes]
    most = float(np.percentile(np.concatenate(errors), _RANGE)) if errors else 0.0
    for mesh, error in zip(meshes, errors):
        domain = mesh.attributes[error_name(name)].domain
        colors = np.ones((len(error), 4), np.float32)
        colors[:, :3] = np.clip(3.0 * error[:, None] / max(most, 1e-30) - [0.0, 1.0, 2.0], 0.0, 1.0)
        shown = error_colors_name(name)
        if shown in mesh.color_attributes:
            mesh.color_attributes.remove(mesh.color_attributes[shown])
        attribute = mesh.color_attributes.new(shown, 'BYTE_COLOR', domain)
        attribute.data.foreach_set('color', colors.ravel())
        show(mesh, shown)
        mesh.update()
    return most


def _read(mesh: bpy.types.Mesh, name: str) -> np.ndarray:
    """Returns the stated error at the corners or vertices of a mesh, (n,)."""
    attribute = mesh.attributes[error_name(name)]
    error = np.empty(len(attribute.data), np.float32)
    attribute.data.foreach_get('value', error)
    return np.nan_to_num(error)


class RAYBUNDLE_OT_show_error(bpy.types.Operator):
    """Show the stated error of the light as colours, from black (exact) to white (largest error)"""
    bl_idname = "raybundle.show_error"
    bl_label = "Show Error"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context):
        if context.scene is None or context.mode != 'OBJECT':
            cls.poll_message_set(tip_("Leave the present mode: colours are written in Object Mode"))
            return False
        return True

    def execute(self, context):
        settings = context.scene.raybundle
        meshes = error_meshes(context.scene)
        if not meshes:
            settings.write_error = True
            self.report({'INFO'}, translated(Message("Write Error is switched on: bake again, then "
                                                     "press Show Error once more")))
            return {'FINISHED'}
        if len(error_colors_name(settings.attribute).encode()) > MOST_BYTES:
            self.report({'WARNING'}, translated(Message(
                "The name of the attribute is too long to add an attribute for these colours: "
                "choose a shorter name")))
            return {'CANCELLED'}
        most = write_error_colors(meshes, settings.attribute)
        if not bpy.app.background:
            viewport_preview.show(context)
        self.report({'INFO'}, translated(Message(
            "White is a stated error of {error} W/(m² sr) and more", error=f"{most:.2g}")))
        return {'FINISHED'}


register, unregister = bpy.utils.register_classes_factory((RAYBUNDLE_OT_show_error,))
