# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows the edges of a mesh in a picture."""

from __future__ import annotations

import bpy


def add_edges(item: bpy.types.Object, thickness: float) -> None:
    """Adds a copy of a mesh object to the scene whose edges are grey bars of this thickness (m)."""
    edges = item.copy()
    edges.data = edges.data.copy()
    while edges.data.color_attributes:
        edges.data.color_attributes.remove(edges.data.color_attributes[0])
    bars = edges.modifiers.new("Edges", 'WIREFRAME')
    bars.thickness, bars.use_even_offset = thickness, False
    bpy.context.scene.collection.objects.link(edges)
