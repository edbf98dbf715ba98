# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts the light of the world to a constant radiance, an image of the varying part, and
suns."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass, field

import bpy
import numpy as np

from . import world_panorama
from .image_export import ImagePixels
from .materials.node_links import output_node
from .materials.node_reader import NodeReader
from .messages import Message, quoted
from .scene_data import SunLightData, Warnings

# An image that varies by less than this share of its mean counts as constant.
_LEAST_VARIATION = 1e-3
# Number of evaluated worlds that are kept, so that a bake after a change of lamps is fast.
_REMEMBERED = 4


@dataclass(frozen=True)
class WorldData:
    """The light of a world on diffuse surfaces, which is the sum of its three parts."""

    radiance: np.ndarray = field(default_factory=lambda: np.zeros(3))  # (3,) W/(m^2 sr), constant
    # (height, width, 3) W/(m^2 sr), equirectangular, bottom row first. None: no image.
    image: np.ndarray | None = None
    suns: tuple[SunLightData, ...] = ()


# By _digest of the world, from the oldest to the newest.
_evaluated: dict[bytes, WorldData] = {}


def export_world(context: bpy.types.Context, images: ImagePixels, warnings: Warnings
                 ) -> WorldData:
    """Returns the light of the scene's world on diffuse surfaces. Cycles renders node trees that
    cannot be read. If this also fails, the mean is used as far as it could be read, with a
    warning."""
    scene = context.scene
    world = scene.world
    # The view layer may exclude the world, and the world may be invisible to diffuse surfaces.
    if (world is None or not context.view_layer.use_sky
            or not getattr(world.cycles_visibility, 'diffuse', True)):
        return WorldData()
    # From 5.0 on, every world has nodes, and use_nodes only warns.
    if bpy.app.version < (5, 0, 0) and not world.use_nodes or world.node_tree is None:
        return WorldData(np.array(world.color, float))
    output = output_node(world.node_tree)
    if output is None:
        return WorldData()
    unread = Warnings()
    reader = NodeReader(Message("world {name}", name=quoted(world.name)), images, unread)
    given = reader.surface(output.inputs['Surface']).emission
    radiance = np.maximum(given, 0.0)
    if np.any(given < 0.0):
        warnings.add(Message("world {name}: negative light counts as 0", name=quoted(world.name)))
    # A world that is read without warnings is constant.
    if not unread:
        return WorldData(radiance)
    if not world_panorama.is_available():
        for message in unread:
            warnings.add(message)
        return WorldData(radiance)
    key = _digest(world, scene.frame_current)
    if key not in _evaluated:
        try:
            evaluated = _split(world_panorama.evaluate(world, scene.frame_current))
        except RuntimeError as error:
            warnings.add(Message("world {name}: Cycles could not evaluate its nodes ({error}), so "
                                 "that its mean is used, as far as Raybundle can read it",
                                 name=quoted(world.name), error=error))
            for message in unread:
                warnings.add(message)
            return WorldData(radiance)
        while len(_evaluated) >= _REMEMBERED:
            _evaluated.pop(next(iter(_evaluated)))
        _evaluated[key] = evaluated
    return _evaluated[key]


def _split(panorama: world_panorama.Panorama) -> WorldData:
    """Splits a panorama into a constant, which is the least radiance of all directions, and an
    image of the rest, because bundles transport constant light without shadow rays."""
    pixels = panorama.pixels
    angles = world_panorama.solid_angles(*pixels.shape[:2])
    mean = (pixels * angles[..., None]).sum(axis=(0, 1)) / (4.0 * np.pi)
    if np.ptp(pixels, axis=(0, 1)).max() <= _LEAST_VARIATION * mean.max():
        return WorldData(mean, None, panorama.suns)
    least = pixels.min(axis=(0, 1))
    return WorldData(least, (pixels - least).astype(np.float32), panorama.suns)


# --------------------------------------------------------------------------------------------------
# Digests of worlds
# --------------------------------------------------------------------------------------------------

# Properties that only affect the node editor, or do not belong to the node itself.
_OF_THE_EDITOR = {'rna_type', 'location', 'width', 'width_hidden', 'height', 'dimensions', 'select',
                  'label', 'color', 'use_custom_color', 'show_options', 'show_preview',
                  'show_texture', 'show_expanded', 'hide', 'hide_value', 'parent', 'internal_links',
                  'is_active_output', 'active', 'users', 'preview', 'animation_data', 'view_center',
                  'grease_pencil', 'interface', 'asset_data', 'override_library', 'library',
                  'library_weak_reference', 'original', 'link_limit', 'node', 'id_data',
                  'links', 'location_absolute', 'warning_propagation', 'color_tag'}


def _digest(world: bpy.types.World, frame: int) -> bytes:
    """Returns a digest that is equal for worlds with equal nodes, values, images and other data at
    a frame."""
    content = hashlib.blake2b(digest_size=16)
    content.update(repr(bpy.app.version).encode())
    _add(content, world.node_tree, frame, set())
    return content.digest()


def _add(content: hashlib.blake2b, item: bpy.types.bpy_struct, frame: int, seen: set[int]) -> None:
    """Adds a struct and all data that it refers to. seen: addresses of structs that were added
    before."""
    if item.as_pointer() in seen:
        return
    seen.add(item.as_pointer())
    if isinstance(item, bpy.types.Image):
        _add_image(content, item, frame)
        return
    if isinstance(item, bpy.types.ID) and not isinstance(item, bpy.types.NodeTree):
        # Nodes read the coordinates of an object, and the code of a text.
        content.update(repr((item.name_full, getattr(item, 'matrix_world', None))).encode())
        if isinstance(item, bpy.types.Text):
            content.update(item.as_string().encode())
        return
    for prop in item.bl_rna.properties:
        name = prop.identifier
        if name in _OF_THE_EDITOR or name.startswith('bl_'):
            continue
        value = getattr(item, name)
        content.update(name.encode())
        if prop.type == 'POINTER':
            if value is not None:
                _add(content, value, frame, seen)
        elif prop.type == 'COLLECTION':
            for member in value:
                _add(content, member, frame, seen)
        elif getattr(prop, 'is_array', False):
            content.update(repr(tuple(map(tuple, value) if isinstance(value[0], (tuple, list))
                                      else value)).encode())
        else:
            content.update(repr(value).encode())
    if isinstance(item, bpy.types.NodeTree):
        for link in item.links:
            content.update(repr((link.from_node.name, link.from_socket.identifier,
                                 link.to_node.name, link.to_socket.identifier,
                                 link.is_muted)).encode())


def _add_image(content: hashlib.blake2b, image: bpy.types.Image, frame: int) -> None:
    content.update(repr((image.name_full, tuple(image.size), image.source, image.alpha_mode,
                         image.colorspace_settings.name)).encode())
    if image.source in ('SEQUENCE', 'MOVIE'):
        content.update(repr(frame).encode())
    path = bpy.path.abspath(image.filepath, library=image.library)
    if image.source == 'FILE' and not image.is_dirty and image.packed_file is None \
            and os.path.isfile(path):
        status = os.stat(path)
        content.update(repr((path, status.st_size, status.st_mtime_ns)).encode())
    elif image.size[0] > 0 and image.size[1] > 0:
        values = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(values)
        content.update(values.data)
