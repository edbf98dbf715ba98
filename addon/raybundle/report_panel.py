# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Last Bake: the time and error of the last bake, its warnings with their remedies, and
what was skipped."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_iface as iface_

from .library_messages import recognised
from .messages import translated
from .report_data import (Line, as_message, coarse_objects, left_out_objects, noisiest_object,
                          read_report, time_text, warning_lines)
from .report_remedies import (advice_text, advised_settings, exist, is_about_error, is_about_side,
                              is_applied)
from .text_wrap import draw_wrapped

# A scene can have thousands of objects that are left out; a panel of that length helps nobody.
_MOST_ROWS = 50
_BOX = 16.0  # width that a box takes, in pixels at a resolution scale of 1


def percent(share: float) -> str:
    """Returns a share as percentage with two digits."""
    return f"{float(f'{100.0 * share:.2g}'):g} %"


class _LastBakePanel:
    """Mixin of the panel of the last report and of its sub-panels."""
    bl_space_type = 'PROPERTIES'
    bl_region_type = 'WINDOW'
    bl_context = "render"

    @classmethod
    def poll(cls, context):
        return context.scene is not None and bool(read_report(context.scene))


class RAYBUNDLE_PT_last_bake(_LastBakePanel, bpy.types.Panel):
    bl_label = "Last Bake"
    bl_parent_id = "RAYBUNDLE_PT_render"
    bl_order = 0

    def draw(self, context):
        report = read_report(context.scene)
        column = self.layout.column(align=True)
        self._draw_row(column, iface_("Time"), time_text(report['seconds']['total']))
        # Reports of earlier releases have no 'error'.
        if error := report.get('error'):
            # `total` combines the other three.
            for name, key in ((iface_("Stated Error"), 'total'), (iface_("Noise"), 'noise'),
                              (iface_("Discretisation"), 'discretisation'),
                              (iface_("Mesh"), 'mesh')):
                self._draw_row(column, name, percent(error[key]))
        if noisiest := noisiest_object(report):
            self._draw_row(column, iface_("Noisiest"),
                           f"{percent(noisiest[0])}, {noisiest[1]}")
        self._draw_row(column, iface_("Patches"), f"{report['patches']:,}")
        self._draw_row(column, iface_("Bundles"), f"{report['bundles']:,}")
        if vertices := report.get('vertices'):
            self._draw_row(column, iface_("Vertices"),
                           f"{vertices['before']:,} \N{RIGHTWARDS ARROW} {vertices['after']:,}")
        elif adaptive := report.get('adaptive_vertices'):
            self._draw_row(column, iface_("If Adaptive"),
                           iface_("{count} vertices").format(count=f"{adaptive:,}"))

    @staticmethod
    def _draw_row(column: bpy.types.UILayout, name: str, value: str) -> None:
        """Draws a name and its value beside each other."""
        row = column.split(factor=0.5, align=True)
        row.label(text=name, translate=False)
        row.label(text=value, translate=False)


class RAYBUNDLE_PT_warnings(_LastBakePanel, bpy.types.Panel):
    bl_label = "Warnings"
    bl_parent_id = "RAYBUNDLE_PT_last_bake"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and bool(read_report(context.scene).get('warnings'))

    def draw_header_preset(self, context):
        count = len(read_report(context.scene)['warnings'])
        self.layout.label(text=f"{count}  ", icon='ERROR', translate=False)

    def draw(self, context):
        for index, line in enumerate(warning_lines(read_report(context.scene))):
            box = self.layout.box()
            draw_wrapped(box, context, translated(line.text), 'ERROR', _BOX)
            _draw_remedies(box, context, line, index)


def _draw_remedies(layout: bpy.types.UILayout, context: bpy.types.Context, line: Line, index: int
                   ) -> None:
    """Draws the buttons beside a warning. index: position of the warning in the report."""
    settings = context.scene.raybundle
    # As many buttons beside each other as the width allows.
    grid = layout.grid_flow(row_major=True, even_columns=False, align=True)
    row = grid.row(align=True)
    # Everything that the warning is about may have been deleted since the bake.
    row.enabled = exist(line.kind, line.names)
    if line.kind == 'material':
        row.operator("raybundle.show_material", icon='MATERIAL').index = index
    elif line.kind:
        row.operator("raybundle.select_named", icon='RESTRICT_SELECT_OFF').index = index
    if is_about_side(line):
        row.operator("raybundle.bake_other_side", icon='UV_SYNC_SELECT').index = index
    if is_about_error(line):
        # It shows the error of all objects, even if those named are gone.
        grid.row(align=True).operator("raybundle.show_error", icon='HIDE_OFF')
    if advised := advised_settings(line, settings):
        row = grid.row(align=True)
        row.enabled = not is_applied(advised, settings)
        row.operator("raybundle.apply_advice", text=advice_text(advised, settings),
                     icon='CHECKMARK', translate=False).index = index


def _coarse_objects(scene: bpy.types.Scene) -> list[tuple[str, float, int, int]]:
    """Returns those whose error is larger than the noise that is aimed for."""
    return coarse_objects(read_report(scene), scene.raybundle.target_error)


class RAYBUNDLE_PT_mesh_error(_LastBakePanel, bpy.types.Panel):
    bl_label = "Mesh Error by Object"
    bl_parent_id = "RAYBUNDLE_PT_last_bake"
    bl_options = {'DEFAULT_CLOSED'}

    @classmethod
    def poll(cls, context):
        return super().poll(context) and bool(_coarse_objects(context.scene))

    def draw_header_preset(self, context):
        self.layout.label(text=f"{len(_coarse_objects(context.scene))}  ", translate=False)

    def draw(self, context):
        settings = context.scene.raybundle
        objects = _coarse_objects(context.scene)
        column = self.layout.column(align=True)
        for name, error, vertices, adaptive in objects[:_MOST_ROWS]:
            row = column.row(align=True)
            row.label(text=name, translate=False)
            row.label(text=percent(error), translate=False)
            row.label(text=f"{vertices:,} \N{RIGHTWARDS ARROW} {adaptive:,}"
                      if adaptive > vertices else f"{vertices:,}", icon='VERTEXSEL',
                      translate=False)
            _draw_select(row, name)
        _draw_rest(self.layout, len(objects))
        row = self.layout.row(align=True)
        row.prop_enum(settings, "topology", 'ADAPTIVE')
        row.prop(settings, "count_adaptive", toggle=True)


class RAYBUNDLE_PT_left_out(_LastBakePanel, bpy.types.Panel):
    bl_label = "Objects Left Out"
    bl_parent_id = "RAYBUNDLE_PT_last_bake"
    bl_options = {'DEFAULT_CLOSED'}

    @classmethod
    def poll(cls, context):
        return super().poll(context) and bool(left_out_objects(read_report(context.scene)))

    def draw(self, context):
        report = read_report(context.scene)
        objects = left_out_objects(report)
        for name, reason in objects[:_MOST_ROWS]:
            row = self.layout.row(align=True)
            draw_wrapped(row.column(), context,
                         f"{name}: {translated(as_message(report, reason))}", indent=32.0)
            _draw_select(row, name)
        _draw_rest(self.layout, len(objects))


def _draw_select(row: bpy.types.UILayout, name: str) -> None:
    """Draws the button that selects an object, which may have been deleted since the bake."""
    button = row.row(align=True)
    button.enabled = exist('object', [name])
    button.operator("raybundle.select_named", text="",
                    icon='RESTRICT_SELECT_OFF').object_name = name


def _draw_rest(layout: bpy.types.UILayout, count: int) -> None:
    """Draws how many of `count` rows are not shown."""
    if count > _MOST_ROWS:
        layout.label(text=iface_("and {count} more").format(count=count - _MOST_ROWS),
                     translate=False)


class RAYBUNDLE_PT_skipped(_LastBakePanel, bpy.types.Panel):
    bl_label = "Work That Was Skipped"
    bl_parent_id = "RAYBUNDLE_PT_last_bake"
    bl_options = {'DEFAULT_CLOSED'}

    @classmethod
    def poll(cls, context):
        return super().poll(context) and bool(read_report(context.scene).get('skipped'))

    def draw(self, context):
        for item in read_report(context.scene)['skipped']:
            what, why = (translated(recognised(item[key])) for key in ('what', 'why'))
            draw_wrapped(self.layout, context, f"{item['count']:,} × {what}: {why}", 'DOT')


register, unregister = bpy.utils.register_classes_factory((
    RAYBUNDLE_PT_last_bake,
    RAYBUNDLE_PT_warnings,
    RAYBUNDLE_PT_mesh_error,
    RAYBUNDLE_PT_left_out,
    RAYBUNDLE_PT_skipped,
))
