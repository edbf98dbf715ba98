# SPDX-License-Identifier: GPL-3.0-or-later
"""A quick picture of baked vertex colours, rendered by Cycles on the CPU.

Baked surfaces show their attribute as it is, other emitting faces their colour, the rest is grey:
nothing is lit, so a few samples (for smooth edges) and no bounces are enough. The open file is
changed: save it before.
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from raybundle.materials.export import MaterialExporter, SlotMaterial
from raybundle.scene_data import SceneData, Warnings

SAMPLES = 16
MAX_WIDTH, MAX_HEIGHT = 960, 720
GREY = (0.18, 0.18, 0.18)


def render(context: bpy.types.Context, baked: Collection[str], attribute: str, path: Path,
           size: tuple[int, int] | None = None) -> None:
    """Renders the attribute of the baked objects, which are given by name. size: width and height
    of the picture, pixels; None: those of the scene, within MAX_WIDTH and MAX_HEIGHT."""
    scene = context.scene
    if size is not None:
        scene.render.resolution_x, scene.render.resolution_y = size
        scene.render.resolution_percentage = 100
    if context.mode != 'OBJECT':
        # The attributes of a mesh in Edit Mode have no data.
        bpy.ops.object.mode_set(mode='OBJECT')
    # A linked object may have the same name as an object of the file.
    objects = [item for item in scene.objects if item.name in baked and item.type == 'MESH'
               and attribute in item.data.color_attributes]
    if not objects:
        raise ValueError(f'no baked object in the scene has the attribute "{attribute}"')
    emitters = _emission_colors(objects)
    own_camera = scene.camera is not None
    if not own_camera:
        scene.camera = _place_camera(scene, objects)
    # The near walls of a room must not hide its inside from a camera outside.
    _replace_materials(objects, emitters, attribute, hide_backs=not own_camera)
    for item in scene.objects:
        if item.type == 'LIGHT':
            item.hide_render = True
    _set_up_cycles(scene)
    _set_up_view_layer(context.view_layer)
    _set_exposure(scene, objects, attribute)
    scene.render.filepath = str(path)
    with _silent_stdout():
        bpy.ops.render.render(write_still=True)


@contextmanager
def _silent_stdout() -> Iterator[None]:
    """Suppresses the lines that Cycles prints for each step from C++, not through sys.stdout."""
    sys.stdout.flush()
    kept = os.dup(1)
    try:
        with open(os.devnull, "wb") as sink:
            os.dup2(sink.fileno(), 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


def _emission_colors(objects: Collection[bpy.types.Object]
                     ) -> dict[bpy.types.Material, tuple[float, float, float]]:
    """Returns the colour, scaled to full brightness, of each material that emits. Returns none if
    all materials emit, as in a furnace."""
    exporter = MaterialExporter(SceneData(), Warnings())
    materials = {slot.material for item in objects for slot in item.material_slots}
    colors = {}
    for material in materials - {None}:
        index = exporter.export(SlotMaterial(material)).index
        emission = np.max([side.emission.constant
                           for side in exporter.scene.materials[index].sides], axis=0)
        if emission.max() > 0.0:
            colors[material] = tuple(emission / emission.max())
    return colors if len(colors) < len(materials) else {}


def _replace_materials(objects: Collection[bpy.types.Object],
                       emitters: dict[bpy.types.Material, tuple[float, float, float]],
                       attribute: str, hide_backs: bool) -> None:
    light = _new_material("Baked Light", hide_backs, attribute=attribute)
    grey = _new_material("Unbaked", hide_backs, color=GREY)
    lamps = {material: _new_material(material.name, hide_backs, color=color)
             for material, color in emitters.items()}
    # Objects of instanced collections count too, although they are not in the scene.
    for item in bpy.data.objects:
        if item.type not in ('MESH', 'CURVE', 'SURFACE', 'META', 'FONT'):
            continue
        # Linked data cannot be changed and keeps its look.
        if item.library is not None or not item.material_slots and item.data.library is not None:
            continue
        is_baked = item in objects
        if not item.material_slots:
            item.data.materials.append(light if is_baked else grey)
        for slot in item.material_slots:
            # The object gets the material, because other objects may share the mesh.
            lamp = lamps.get(slot.material)
            slot.link = 'OBJECT'
            slot.material = lamp or (light if is_baked else grey)


def _new_material(name: str, hide_backs: bool, attribute: str = "",
                  color: tuple[float, float, float] = GREY) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    emission = tree.nodes.new('ShaderNodeEmission')
    emission.inputs['Color'].default_value = (*color, 1.0)
    if attribute:
        source = tree.nodes.new('ShaderNodeAttribute')
        source.attribute_name = attribute
        tree.links.new(source.outputs['Color'], emission.inputs['Color'])
    output = tree.nodes.new('ShaderNodeOutputMaterial')
    shader = emission.outputs[0]
    if hide_backs:
        geometry = tree.nodes.new('ShaderNodeNewGeometry')
        transparent = tree.nodes.new('ShaderNodeBsdfTransparent')
        mix = tree.nodes.new('ShaderNodeMixShader')
        tree.links.new(geometry.outputs['Backfacing'], mix.inputs[0])
        tree.links.new(shader, mix.inputs[1])
        tree.links.new(transparent.outputs[0], mix.inputs[2])
        shader = mix.outputs[0]
    tree.links.new(shader, output.inputs['Surface'])
    return material


def _place_camera(scene: bpy.types.Scene, objects: Collection[bpy.types.Object]
                  ) -> bpy.types.Object:
    """Returns a camera that sees all baked objects from above, from the front and the left."""
    corners = np.array([item.matrix_world @ Vector(corner)
                        for item in objects for corner in item.bound_box])
    low, high = corners.min(axis=0), corners.max(axis=0)
    centre, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    camera = bpy.data.cameras.new("Camera")
    item = bpy.data.objects.new("Camera", camera)
    scene.collection.objects.link(item)
    direction = Vector((-0.55, -1.0, 0.65)).normalized()
    # The bounding sphere fills the vertical angle of the picture, which is the narrower one.
    camera.angle = math.radians(40.0)
    narrow = math.atan(math.tan(camera.angle / 2.0) * MAX_HEIGHT / MAX_WIDTH)
    distance = max(radius, 1e-3) / math.sin(narrow)
    item.location = Vector(centre) + distance * direction
    item.rotation_euler = direction.to_track_quat('Z', 'Y').to_euler()
    camera.clip_start, camera.clip_end = distance * 1e-3, distance * 10.0
    scene.render.resolution_x, scene.render.resolution_y = MAX_WIDTH, MAX_HEIGHT
    return item


def _set_up_cycles(scene: bpy.types.Scene) -> None:
    scene.render.engine = 'CYCLES'
    cycles = scene.cycles
    cycles.device = 'CPU'
    cycles.samples = SAMPLES
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.max_bounces = 0
    # A ray may meet several culled back sides in a row.
    cycles.transparent_max_bounces = 8
    cycles.film_exposure = 1.0
    render = scene.render
    render.use_multiview = False
    render.use_motion_blur = False
    render.use_single_layer = True
    render.use_border = False
    render.use_compositing = False
    render.use_sequencer = False
    render.use_freestyle = False
    render.image_settings.file_format = 'PNG'
    render.image_settings.color_mode = 'RGB'
    largest = max(render.resolution_x / MAX_WIDTH, render.resolution_y / MAX_HEIGHT)
    render.resolution_percentage = min(100, int(100 / largest))
    scene.view_settings.view_transform = 'Standard'
    scene.view_settings.look = 'None'
    scene.view_settings.gamma = 1.0


def _set_up_view_layer(view_layer: bpy.types.ViewLayer) -> None:
    view_layer.use = True
    view_layer.material_override = None
    view_layer.samples = 0


def _set_exposure(scene: bpy.types.Scene, objects: Collection[bpy.types.Object], attribute: str
                  ) -> None:
    """Keeps the exposure of the file if it shows most of the light, else fits the exposure."""
    values = []
    for item in objects:
        data = item.data.color_attributes[attribute].data
        colors = np.empty(4 * len(data), np.float32)
        data.foreach_get('color', colors)
        values.append(colors.reshape(-1, 4)[:, :3].max(axis=1))
    bright = float(np.percentile(np.concatenate(values), 95.0)) if values else 0.0
    if bright <= 0.0:
        return
    shown = bright * 2.0 ** scene.view_settings.exposure
    if not 0.2 <= shown <= 1.0:
        exposure = math.log2(0.9 / bright)
        scene.view_settings.exposure = min(max(exposure, -10.0), 10.0)
        print(f"picture: exposure set to {scene.view_settings.exposure:.1f} stops")
