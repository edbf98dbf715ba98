# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes several parts of the light into the channels R, G, B, A of one attribute, as luminance.

An engine can then mix direct light, indirect light, ambient occlusion and light sets itself. Each
part is baked to an attribute of its own, which is removed again. All bakes after the first reuse
its lines. Ambient occlusion is the direct light of a white world alone, which is baked as a light
set, so that lamps and emission have no part in it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np

from . import color_attribute
from .bake import bake
from .bake_report import BakeError, BakeReport
from .finer_copy import find_copies
from .materials.last_surfaces import LastSurfaces
from .mesh_arrays import read
from .messages import Message
from .native import Progress

NONE, AO = 'NONE', 'AO'
CHANNELS = ('channel_r', 'channel_g', 'channel_b', 'channel_a')  # of scene.raybundle
_SET = 'SET_'  # followed by the position of a light set, from 1
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # Rec. 709

# Light by original object. The light of an object is (n,), for n corners or vertices.
_Light = dict[bpy.types.Object, np.ndarray]


def bake_channels(context: bpy.types.Context, progress: Progress | None = None) -> BakeReport:
    """Bakes the parts of the light that the scene's settings name, and writes them to the channels
    of the scene's attribute. Returns the report of the last bake.

    Raises BakeError if no channel is chosen or a light set is missing, and as `bake` does.
    """
    scene = context.scene
    if reason := why_not(scene):
        raise BakeError(reason)
    sources = _sources(scene)
    wanted = [source for source in dict.fromkeys(sources) if source != NONE]
    sets = [source for source in wanted if source.startswith(_SET)]
    parts: dict[str, _Light] = {}
    # AO last: it needs another first shot than the other parts, which share theirs.
    outputs = [source for source in wanted if source not in sets and source != AO]
    if sets and 'LIGHTING' not in outputs:
        outputs.append('LIGHTING')
    report = None
    for output in outputs:
        attribute = _part_attribute(scene, output)
        with _unnamed_sets(scene):
            report = bake(context, progress, output=output, attribute=attribute,
                          data_type='FLOAT_COLOR', simplify=False)
        parts[output] = _taken(scene, attribute)
        # All bakes write the light sets. Those of Lighting are kept.
        for number, item in enumerate(scene.raybundle.light_sets, 1):
            light = _taken(scene, f"{attribute} {item.name}")
            if output == 'LIGHTING':
                parts[f"{_SET}{number}"] = light
    if AO in wanted:
        attribute = _part_attribute(scene, AO)
        with _white_world(scene, f"{attribute} World"):
            report = bake(context, progress, output='DIRECT', attribute=attribute,
                          data_type='FLOAT_COLOR', exposure=0.0, simplify=False)
        _taken(scene, attribute)
        parts[AO] = _taken(scene, f"{attribute} World")
    _write(scene, sources, parts)
    return report


def why_not(scene: bpy.types.Scene) -> Message | None:
    """Returns why the channels that are chosen cannot be baked, and what to do. None: they can."""
    sources = _sources(scene)
    if all(source == NONE for source in sources):
        return Message("All channels are empty: choose what to bake into them")
    sets = scene.raybundle.light_sets
    for source in sources:
        if source.startswith(_SET):
            number = int(source[len(_SET):])
            if number > len(sets) or not sets[number - 1].enabled:
                return Message("There is no enabled light set number {number}: add it in the "
                               "panel Light Sets, or choose another part for the channel",
                               number=number)
    return None


def _sources(scene: bpy.types.Scene) -> list[str]:
    """Returns the part of each channel."""
    return [getattr(scene.raybundle, name) for name in CHANNELS]


def _part_attribute(scene: bpy.types.Scene, part: str) -> str:
    return f"{scene.raybundle.attribute} {part.capitalize()}"


def _taken(scene: bpy.types.Scene, attribute: str) -> _Light:
    """Returns the luminance of an attribute on all objects that have it, and removes it."""
    found = {item: item.data for item in scene.objects
             if item.type == 'MESH' and attribute in item.data.color_attributes}
    light = {item.raybundle.source or item: read(
        mesh.color_attributes[attribute].data, 'color', np.float32, 4)[:, :3] @ _LUMINANCE
        for item, mesh in found.items()}
    for mesh in set(found.values()):
        color_attribute.clear(mesh, attribute)
    return light


@contextmanager
def _unnamed_sets(scene: bpy.types.Scene) -> Iterator[None]:
    """Lets light sets be baked to attributes that are named after the main one in the with block,
    so that attributes that the user has named are kept."""
    sets = scene.raybundle.light_sets
    names = [item.attribute for item in sets]
    try:
        for item in sets:
            item.attribute = ""
        yield
    finally:
        for item, name in zip(sets, names):
            item.attribute = name


@contextmanager
def _white_world(scene: bpy.types.Scene, attribute: str) -> Iterator[None]:
    """Gives the scene a world of radiance 1 that is the only light set, in the with block."""
    settings = scene.raybundle
    states = [item.enabled for item in settings.light_sets]
    world, index = scene.world, settings.light_set_index
    white = bpy.data.worlds.new("White")
    try:
        if bpy.app.version < (5, 0, 0):
            white.use_nodes = True
        background = next(node for node in white.node_tree.nodes if node.type == 'BACKGROUND')
        background.inputs['Color'].default_value = (1.0, 1.0, 1.0, 1.0)
        background.inputs['Strength'].default_value = 1.0
        scene.world = white
        for item in settings.light_sets:
            item.enabled = False
        sky = settings.light_sets.add()
        sky.name, sky.world, sky.attribute = "White Sky", True, attribute
        yield
    finally:
        while len(settings.light_sets) > len(states):
            settings.light_sets.remove(len(settings.light_sets) - 1)
        for item, enabled in zip(settings.light_sets, states):
            item.enabled = enabled
        settings.light_set_index = index
        scene.world = world
        bpy.data.worlds.remove(white)


def _write(scene: bpy.types.Scene, sources: list[str], parts: dict[str, _Light]) -> None:
    """Writes the parts of the light to the scene's attribute. sources: part of each channel."""
    settings = scene.raybundle
    receivers = {item: item for item in scene.objects if item.type == 'MESH'}
    receivers.update(find_copies(scene))
    for key in next(iter(parts.values())):
        if key not in receivers:
            continue
        channels = [parts[source][key] if source != NONE else None for source in sources]
        count = len(next(channel for channel in channels if channel is not None))
        empty = np.zeros(count, np.float32)
        colors = np.stack([empty if channel is None else channel for channel in channels[:3]], 1)
        mesh = receivers[key].data
        color_attribute.write_light(mesh, settings.attribute, settings.data_type, settings.domain,
                                    colors)
        alpha = np.ones(count, np.float32) if channels[3] is None else channels[3]
        attribute = mesh.color_attributes[settings.attribute]
        written = read(attribute.data, 'color', np.float32, 4)
        written[:, 3] = alpha
        attribute.data.foreach_set('color', written.ravel())
        mesh.update()
    # A further bake must not read the channels as colours of the surfaces.
    LastSurfaces(scene).write({settings.attribute})
