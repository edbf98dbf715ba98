# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps that are hidden in the viewport but not in renders. Cycles bakes their light.

Python can only evaluate a scene as the viewport does, without these lamps. The lamps are therefore
evaluated in a temporary scene.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

import bpy

_SCENE = "Raybundle Hidden Lights"


def hidden_light_instances(context: bpy.types.Context, hidden: Iterable[bpy.types.Object]
                           ) -> Iterator[bpy.types.DepsgraphObjectInstance]:
    """Yields evaluated instances of hidden lamps: of the lamps among the given original objects,
    and of the lamps in collections that these objects instance."""
    bearers = [item for item in hidden if _bears_light(item)]
    if not bearers:
        return
    scene = bpy.data.scenes.new(_SCENE)
    switched = [item for item in bearers if item.hide_viewport]
    try:
        # frame_set is not used because it calls the user's handlers.
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
    """Returns whether an object is a lamp, or instances a collection with lamps."""
    if item.type == 'LIGHT':
        return True
    return (item.instance_type == 'COLLECTION' and item.instance_collection is not None
            and _has_light(item.instance_collection.all_objects))


def _has_light(items: Collection[bpy.types.Object]) -> bool:
    return any(item.type == 'LIGHT' and not item.hide_render for item in items)
