# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps that the viewport hides and renders do not: Cycles bakes their light.

Python has the viewport's evaluation only, in which they do not exist. So they are evaluated in a
scene of their own, which is removed again.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

import bpy

_SCENE = "Raybundle Hidden Lights"


def hidden_light_instances(context: bpy.types.Context, hidden: Iterable[bpy.types.Object]
                           ) -> Iterator[bpy.types.DepsgraphObjectInstance]:
    """The lamps among original objects, and those of the collections that they instance."""
    bearers = [item for item in hidden if _bears_light(item)]
    if not bearers:
        return
    scene = bpy.data.scenes.new(_SCENE)
    switched = [item for item in bearers if item.hide_viewport]
    try:
        # Not frame_set, which calls the user's handlers.
        scene.frame_current = context.scene.frame_current
        for item in switched:
            item.hide_viewport = False
        for item in bearers:
            scene.collection.objects.link(item)
        view_layer = scene.view_layers[0]
        view_layer.update()
        for instance in view_layer.depsgraph.object_instances:
            item = instance.object
            if item.type == 'LIGHT' and not item.hide_render:
                yield instance
    finally:
        for item in switched:
            item.hide_viewport = True
        bpy.data.scenes.remove(scene)


def _bears_light(item: bpy.types.Object) -> bool:
    if item.type == 'LIGHT':
        return True
    return (item.instance_type == 'COLLECTION' and item.instance_collection is not None
            and _has_light(item.instance_collection.all_objects))


def _has_light(items: Collection[bpy.types.Object]) -> bool:
    return any(item.type == 'LIGHT' and not item.hide_render for item in items)
