# SPDX-License-Identifier: GPL-3.0-or-later
"""Light sets: named groups of lights, each baked into a colour attribute of its own.

A set has the lights and the emissive objects of a Blender collection, its children included, and
perhaps the world. What is in no set only counts in the light of all, the scene's main attribute.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

import bpy

from .bake_report import BakeError
from .color_attribute import MOST_BYTES
from .scene_data import LightSetData, SceneData


@dataclass(frozen=True)
class LightSet:
    name: str
    attribute: str
    objects: frozenset[bpy.types.Object]
    world: bool


def attribute_of(item: bpy.types.PropertyGroup, main_attribute: str) -> str:
    """The name of the attribute that a set of scene.raybundle.light_sets is written to."""
    return item.attribute or f"{main_attribute} {item.name}"


def read_light_sets(scene: bpy.types.Scene, main_attribute: str) -> list[LightSet]:
    """The enabled sets. Raises BakeError where their names or attributes clash."""
    sets: list[LightSet] = []
    owners = {main_attribute: "the light of all"}
    for item in scene.raybundle.light_sets:
        if not item.enabled:
            continue
        if not item.name:
            raise BakeError("A light set has no name")
        if any(item.name == other.name for other in sets):
            raise BakeError(f'There are two light sets of the name "{item.name}"')
        attribute = attribute_of(item, main_attribute)
        if len(attribute.encode()) > MOST_BYTES:
            raise BakeError(f'Light set "{item.name}": the name of its attribute, "{attribute}", '
                            f'is longer than {MOST_BYTES} bytes')
        if attribute in owners:
            raise BakeError(f'Light set "{item.name}" has the same attribute, "{attribute}", as '
                            f'{owners[attribute]}: choose another name')
        owners[attribute] = f'the light set "{item.name}"'
        objects = frozenset(item.collection.all_objects) if item.collection else frozenset()
        sets.append(LightSet(item.name, attribute, objects, item.world))
    return sets


def written_attributes(scene: bpy.types.Scene) -> set[str]:
    """The attributes that the scene's sets are or were written to."""
    settings = scene.raybundle
    names = {attribute_of(item, settings.attribute) for item in settings.light_sets}
    # Sets may have been renamed or removed since the last bake.
    last = json.loads(settings.report).get('light_sets', []) if settings.report else []
    return names | {entry['attribute'] for entry in last if 'attribute' in entry}


class LightSetMembers:
    """What of an exported scene belongs to which set; filled while it is exported."""

    def __init__(self, sets: list[LightSet], scene: SceneData) -> None:
        self._sets = sets
        self._scene = scene
        scene.light_sets = [LightSetData(light_set.name, light_set.world) for light_set in sets]
        _check_single("The world", [light_set for light_set in sets if light_set.world])

    def add_light(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        """The light that was exported last, of this instance."""
        for index in self._sets_of(instance):
            self._scene.light_sets[index].lights.append(len(self._scene.lights) - 1)

    def add_world_lights(self, count: int) -> None:
        """The lights that were exported last, as parts of the world."""
        lights = range(len(self._scene.lights) - count, len(self._scene.lights))
        for data in self._scene.light_sets:
            if data.world:
                data.lights.extend(lights)

    def add_instance(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        """The mesh that was exported last, of this instance, if it shines."""
        position = len(self._scene.instances) - 1
        if not self._scene.emits(position):
            return
        for index in self._sets_of(instance):
            self._scene.light_sets[index].instances.append(position)

    def _sets_of(self, instance: bpy.types.DepsgraphObjectInstance) -> list[int]:
        """None or one, by the object itself or by the one that instances it."""
        items = {instance.object.original}
        if instance.is_instance and instance.parent is not None:
            items.add(instance.parent.original)
        found = [index for index, light_set in enumerate(self._sets)
                 if not items.isdisjoint(light_set.objects)]
        _check_single(f'"{instance.object.name}"', [self._sets[index] for index in found])
        return found


def _check_single(what: str, sets: list[LightSet]) -> None:
    if len(sets) > 1:
        names = " and ".join(f'"{light_set.name}"' for light_set in sets)
        raise BakeError(f"{what} belongs to the light sets {names}: light is in one set at most")
