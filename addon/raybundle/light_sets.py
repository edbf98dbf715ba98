# SPDX-License-Identifier: GPL-3.0-or-later
"""Light sets: named groups of lights, each baked into its own colour attribute.

A set contains the lamps and the emissive objects of a Blender collection and of its children, and
optionally the world. Lights that are in no set are only part of the main attribute, which contains
the light of all lights.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import reduce

import bpy

from .bake_report import BakeError
from .color_attribute import MOST_BYTES
from .messages import Message, quoted
from .scene_data import LightSetData, SceneData


@dataclass(frozen=True)
class LightSet:
    """An enabled light set of a scene."""

    name: str
    attribute: str  # name of the colour attribute for the set's light
    objects: frozenset[bpy.types.Object]  # original objects
    world: bool  # whether the set contains the light of the world


def attribute_of(item: bpy.types.PropertyGroup, main_attribute: str) -> str:
    """Returns the name of the attribute for the light of a set. item: of
    scene.raybundle.light_sets."""
    return item.attribute or f"{main_attribute} {item.name}"


def read_light_sets(scene: bpy.types.Scene, main_attribute: str) -> list[LightSet]:
    """Returns the enabled sets of the scene. Raises BakeError if a set has no name, or if names or
    attributes are too long or occur twice."""
    sets: list[LightSet] = []
    owners = {main_attribute: Message("the light of all lights")}
    for item in scene.raybundle.light_sets:
        if not item.enabled:
            continue
        if not item.name:
            raise BakeError(Message("A light set has no name: enter one"))
        if any(item.name == other.name for other in sets):
            raise BakeError(Message("Two light sets have the name {name}: rename one of them",
                                    name=quoted(item.name)))
        attribute = attribute_of(item, main_attribute)
        if len(attribute.encode()) > MOST_BYTES:
            raise BakeError(Message("Light set {set}: the attribute name {name} is longer than "
                                    "{count} bytes, choose a shorter one", set=quoted(item.name),
                                    name=quoted(attribute), count=MOST_BYTES))
        if attribute in owners:
            raise BakeError(Message("Light set {set} has the same attribute {name} as {other}: "
                                    "choose another attribute name", set=quoted(item.name),
                                    name=quoted(attribute), other=owners[attribute]))
        owners[attribute] = Message("the light set {name}", name=quoted(item.name))
        objects = frozenset(item.collection.all_objects) if item.collection else frozenset()
        sets.append(LightSet(item.name, attribute, objects, item.world))
    return sets


def written_attributes(scene: bpy.types.Scene) -> set[str]:
    """Returns the names of the attributes for the scene's current sets and for the sets of the last
    bake."""
    settings = scene.raybundle
    names = {attribute_of(item, settings.attribute) for item in settings.light_sets}
    # Sets may have been renamed or removed since the last bake.
    last = json.loads(settings.report).get('light_sets', []) if settings.report else []
    return names | {entry['attribute'] for entry in last if 'attribute' in entry}


class LightSetMembers:
    """Records during the export of a scene which of its lights belong to which set.

    Raises BakeError if a light belongs to more than one set.
    """

    def __init__(self, sets: list[LightSet], scene: SceneData) -> None:
        self._sets = sets
        self._scene = scene
        scene.light_sets = [LightSetData(light_set.name, light_set.world) for light_set in sets]
        _check_single(Message("The world"), [light_set for light_set in sets if light_set.world])

    def add_light(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        """Records the lamp that was exported last. instance: the lamp's evaluated instance."""
        for index in self._sets_of(instance):
            self._scene.light_sets[index].lights.append(len(self._scene.lights) - 1)

    def add_world_lights(self, count: int) -> None:
        """Records the last `count` exported lights, which are the suns in the world's sky, as parts
        of the world."""
        lights = range(len(self._scene.lights) - count, len(self._scene.lights))
        for data in self._scene.light_sets:
            if data.world:
                data.lights.extend(lights)

    def add_instance(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        """Records the mesh instance that was exported last, if it emits light. instance: its
        evaluated instance."""
        position = len(self._scene.instances) - 1
        if not self._scene.emits(position):
            return
        for index in self._sets_of(instance):
            self._scene.light_sets[index].instances.append(position)

    def _sets_of(self, instance: bpy.types.DepsgraphObjectInstance) -> list[int]:
        """Returns the positions of the sets that contain the object or the object that instances
        it. The result has at most one element. Raises BakeError if there are more."""
        items = {instance.object.original}
        if instance.is_instance and instance.parent is not None:
            items.add(instance.parent.original)
        found = [index for index, light_set in enumerate(self._sets)
                 if not items.isdisjoint(light_set.objects)]
        _check_single(quoted(instance.object.name), [self._sets[index] for index in found])
        return found


def _check_single(what: str, sets: list[LightSet]) -> None:
    """Raises BakeError if there is more than one set. what: subject of the message, which is a
    member of the sets."""
    if len(sets) > 1:
        names = reduce(lambda names, name: Message("{names} and {name}", names=names, name=name),
                       [quoted(light_set.name) for light_set in sets])
        raise BakeError(Message("{what} belongs to the light sets {names}: a light can be in only "
                                "one set, remove it from the others", what=what, names=names))
