# SPDX-License-Identifier: GPL-3.0-or-later
"""A stand-in for bpy.types.UILayout that records what a panel draws, because a Blender without a
window has no layouts. Methods, options and icons that this Blender does not have raise an error."""

from __future__ import annotations

from types import SimpleNamespace

import bpy


# Of methods without an icon.
_NO_ICON = SimpleNamespace(enum_items={'NONE'})


class DrawnLayout:
    """Records calls as (method, arguments, options). All rows and columns share one record."""

    def __init__(self, record: list | None = None) -> None:
        self.record = [] if record is None else record
        self.enabled = True

    def __getattr__(self, method: str):
        if method not in bpy.types.UILayout.bl_rna.functions:
            raise AttributeError(method)
        parameters = bpy.types.UILayout.bl_rna.functions[method].parameters

        def call(*arguments, **options):
            assert set(options) <= set(parameters.keys()), method
            assert options.get('icon', 'NONE') in parameters.get('icon', _NO_ICON).enum_items
            shown = SimpleNamespace()  # properties of an operator's button
            self.record.append((method, arguments, options, self, shown))
            if method in ('row', 'column', 'box', 'split', 'grid_flow'):
                return DrawnLayout(self.record)
            return shown if method == 'operator' else None
        return call

    def texts(self) -> list[str]:
        return [options['text'] for _, _, options, *_ in self.record if 'text' in options]

    def props(self) -> list[str]:
        return [arguments[1] for method, arguments, *_ in self.record if method == 'prop']

    def operators(self) -> list[str]:
        return [arguments[0] for method, arguments, *_ in self.record if method == 'operator']


def drawn(panel: type, context: object = None, method: str = 'draw', **properties: object
          ) -> DrawnLayout:
    """Returns what a panel draws, for bpy.context unless another context is given. properties:
    values of properties of the panel itself that it reads."""
    layout = DrawnLayout()
    own = {name: value for name, value in vars(panel).items() if name.startswith("_draw")}
    stand_in = SimpleNamespace(layout=layout, **properties)
    for name, value in own.items():
        function = value.__func__ if isinstance(value, staticmethod) else value.__get__(stand_in)
        setattr(stand_in, name, function)
    getattr(panel, method)(stand_in, context or bpy.context)
    return layout
