# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluates the node tree of a world with Cycles, as radiance by direction and suns.

A copy of the world is rendered, as diffuse surfaces see it, in a temporary scene that contains only
a camera: as a panorama, again with finer pixels where it is very bright, and the sun discs of Sky
Textures separately, each in a small picture. All temporary data is removed afterwards.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from .materials.node_links import LIGHT_PATH
from .scene_data import SunLightData

# Number of pixels around the horizon, 0.7 degrees each. Suns are smaller and are rendered
# separately.
_WIDTH = 512
_SAMPLES = 16
# Pixels with more than the share _BRIGHT of all light, and a margin around each, are rendered again
# with pixels _FINER times as fine. The resulting image has pixels _KEPT times as fine as the first
# one.
_BRIGHT = 1e-4
_MARGIN = 2
_FINER = 16
_KEPT = 2
_MAX_TILES = 24
# A sun is found by rendering it with at least this diameter. It is then measured in a picture of
# _DISC_WIDTH pixels in width.
_LARGE_DISC = 0.06  # radians
_DISC_WIDTH = 128
# Suns of a larger diameter remain in the panorama, which has enough pixels for them.
_LARGEST_DISC = 0.5  # radians
_SKIES_WITHOUT_DISC = ('PREETHAM', 'HOSEK_WILKIE')
# A rectangle of an image: begin and end of its rows, and of its columns.
_Part = tuple[tuple[int, int], tuple[int, int]]
_HANDLERS = ('render_init', 'render_pre', 'render_post', 'render_write', 'render_stats',
             'render_complete', 'render_cancel')


@dataclass(frozen=True)
class Panorama:
    """The light of a world by direction."""

    # (height, width, 3) float64, W/(m^2 sr), equirectangular, bottom row first, without the suns.
    pixels: np.ndarray
    suns: tuple[SunLightData, ...]


def is_available() -> bool:
    """Returns whether this Blender contains Cycles."""
    return hasattr(bpy.types.Scene, 'cycles') and hasattr(bpy.types.World, 'cycles')


def evaluate(world: bpy.types.World, frame: int) -> Panorama:
    """Renders a world at a frame. Raises RuntimeError if Blender cannot render it."""
    with _Renderer(world, frame) as renderer:
        discs = renderer.sun_discs()
        for node in discs:
            node.sun_disc = False
        base = renderer.panorama(_WIDTH)
        pixels = _refined(renderer, base)
        suns = [sun for node in discs if (sun := _sun(renderer, node, base)) is not None]
    return Panorama(pixels, tuple(suns))


def directions(height: int, width: int) -> np.ndarray:
    """Returns unit vectors to the centres of the pixels of an equirectangular image, as Cycles maps
    them, (height, width, 3)."""
    elevation = ((np.arange(height) + 0.5) / height - 0.5)[:, None] * np.pi
    azimuth = (1.0 - 2.0 * (np.arange(width) + 0.5) / width)[None, :] * np.pi
    return np.stack([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth),
                     np.broadcast_to(np.sin(elevation), (height, width))], axis=-1)


def solid_angles(height: int, width: int) -> np.ndarray:
    """Returns the solid angle of a pixel in each row of an equirectangular image, (height, 1),
    sr."""
    edges = np.sin((np.arange(height + 1) / height - 0.5) * np.pi)
    return (np.diff(edges) * 2.0 * np.pi / width)[:, None]


# --------------------------------------------------------------------------------------------------
# Bright spots and suns
# --------------------------------------------------------------------------------------------------


def _refined(renderer: _Renderer, base: np.ndarray) -> np.ndarray:
    """Returns the panorama with pixels _KEPT times as fine. Bright spots are rendered again, and
    all other pixels are repeated. base: (height, width, 3)."""
    height, width = base.shape[:2]
    pixels = base.repeat(_KEPT, axis=0).repeat(_KEPT, axis=1)
    power = base.sum(axis=2) * solid_angles(height, width)
    mean = power.sum() / power.size
    # Only use pixels well above the mean. In a sky that is bright everywhere, no pixel stands out.
    left = np.where(power > max(_BRIGHT * power.sum(), 4.0 * mean), power, 0.0)
    tiles: list[_Part] = []
    while len(tiles) < _MAX_TILES and left.max() > 0.0:
        row, column = np.unravel_index(left.argmax(), left.shape)
        tile = ((max(row - _MARGIN, 0), min(row + _MARGIN + 1, height)),
                (max(column - _MARGIN, 0), min(column + _MARGIN + 1, width)))
        left[tuple(slice(*span) for span in tile)] = 0.0
        tiles.append(tile)
    step = _FINER // _KEPT
    for part in _joined(tiles):
        fine = renderer.panorama(_FINER * width, tuple(
            (_FINER * begin, _FINER * end) for begin, end in part))
        kept = fine.reshape(fine.shape[0] // step, step, fine.shape[1] // step, step, 3)
        pixels[tuple(slice(_KEPT * begin, _KEPT * end) for begin, end in part)] = (
            kept.mean(axis=(1, 3)))
    return pixels


def _joined(parts: list[_Part]) -> list[_Part]:
    """Joins two rectangles as long as their bounding rectangle is not larger than both together,
    because each rectangle is rendered separately."""
    joined: list[_Part] = []
    for part in parts:
        # The joined rectangle may reach further rectangles.
        while other := next((other for other in joined
                             if _area(_around(part, other)) <= _area(part) + _area(other)), None):
            joined.remove(other)
            part = _around(part, other)
        joined.append(part)
    return joined


def _around(first: _Part, second: _Part) -> _Part:
    """Returns the bounding rectangle of two rectangles."""
    rows, columns = ((min(a[0], b[0]), max(a[1], b[1])) for a, b in zip(first, second))
    return rows, columns


def _area(part: _Part) -> int:
    (top, bottom), (left, right) = part
    return (bottom - top) * (right - left)


def _sun(renderer: _Renderer, node: bpy.types.Node, base: np.ndarray) -> SunLightData | None:
    """Returns the light that the sun disc of a Sky Texture adds to the world. Returns None if the
    disc adds none, for example below the horizon. base: the panorama without sun discs."""
    size = node.sun_size
    node.sun_disc = True
    try:
        # Find the direction, which other nodes may change. The samples do not miss a large disc.
        node.sun_size = max(size, _LARGE_DISC)
        added = (renderer.panorama(_WIDTH) - base).sum(axis=2)
        added = np.where(added > 0.1 * max(added.max(), 0.0), added, 0.0)
        power = added * solid_angles(*added.shape)
        towards = (power[..., None] * directions(*added.shape)).sum(axis=(0, 1))
        if power.sum() <= 1e-6 * (base.sum(axis=2) * solid_angles(*added.shape)).sum():
            return None
        node.sun_size = size
        # Render a picture wide enough for the disc and for the error of its direction.
        field_of_view = 1.2 * size + 0.02
        view = Vector(towards / np.linalg.norm(towards))
        added, view_directions, angles = renderer.view(view, field_of_view, _DISC_WIDTH)
        node.sun_disc = False
        added = added - renderer.view(view, field_of_view, _DISC_WIDTH)[0]
    finally:
        node.sun_size = size
        node.sun_disc = False
    flux = added * angles[..., None]
    towards = (flux.sum(axis=2)[..., None] * view_directions).sum(axis=(0, 1))
    if not np.linalg.norm(towards) > 0.0:
        return None
    direction = towards / np.linalg.norm(towards)
    irradiance = (flux * (view_directions @ direction)[..., None]).sum(axis=(0, 1))
    return SunLightData(f'sun of "{node.name}"', direction, np.maximum(irradiance, 0.0), size)


# --------------------------------------------------------------------------------------------------
# Rendering
# --------------------------------------------------------------------------------------------------


class _Renderer:
    """A context manager that creates a scene with a copy of the world and a camera, and renders the
    world."""

    def __init__(self, world: bpy.types.World, frame: int) -> None:
        self._original, self._frame = world, frame
        self._made: list[bpy.types.ID] = []

    def __enter__(self) -> _Renderer:
        # Blender creates these images at the first render.
        self._had = {name for name in ('Render Result', 'Viewer Node') if name in bpy.data.images}
        try:
            self._build()
        except BaseException:
            self._remove()
            raise
        return self

    def __exit__(self, *_exception: object) -> None:
        self._remove()

    def sun_discs(self) -> list[bpy.types.Node]:
        """Returns the Sky Textures of the copied world whose sun discs are too small for the
        panorama."""
        return [node for tree in self._trees for node in tree.nodes
                if node.type == 'TEX_SKY' and getattr(node, 'sun_disc', False)
                and node.sky_type not in _SKIES_WITHOUT_DISC and not node.mute
                and node.sun_size <= _LARGEST_DISC and node.outputs[0].is_linked]

    def panorama(self, width: int, part: _Part | None = None) -> np.ndarray:
        """Renders all directions, or a part of the image, and returns (height, width, 3) W/(m^2
        sr). width: of the whole image, twice its height."""
        camera = self._camera.data
        camera.type = 'PANO'
        # Blender 5.0 moved the property from Cycles to the camera.
        owner = camera if hasattr(camera, 'panorama_type') else camera.cycles
        owner.panorama_type = 'EQUIRECTANGULAR'
        # The middle of the image shows the direction +X, as in an environment texture.
        self._camera.rotation_euler = (math.pi / 2.0, 0.0, -math.pi / 2.0)
        return self._render(width, width // 2, part)

    def view(self, towards: Vector, field_of_view: float, width: int
             ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Renders a square perspective view. Returns radiance (width, width, 3) W/(m^2 sr), unit
        directions (width, width, 3) and solid angles (width, width), sr. field_of_view: radians.
        width: in pixels."""
        camera = self._camera.data
        camera.type = 'PERSP'
        camera.lens_unit, camera.angle = 'FOV', field_of_view
        rotation = towards.to_track_quat('-Z', 'Y')
        self._camera.rotation_euler = rotation.to_euler()
        pixels = self._render(width, width, None)
        half = math.tan(field_of_view / 2.0)
        across = half * (2.0 * (np.arange(width) + 0.5) / width - 1.0)
        local = np.stack([np.broadcast_to(across[None, :], (width, width)),
                          np.broadcast_to(across[:, None], (width, width)),
                          np.full((width, width), -1.0)], axis=-1)
        lengths = np.linalg.norm(local, axis=-1)
        seen = (local / lengths[..., None]) @ np.array(rotation.to_matrix(), float).T
        return pixels, seen, (2.0 * half / width) ** 2 / lengths ** 3

    def _build(self) -> None:
        world = self._keep(self._original.copy())
        world.cycles_visibility.camera = True
        # Cycles need not build a map for sampling the world, because the world lights nothing here.
        world.cycles.sampling_method = 'NONE'
        self._trees = [world.node_tree]
        for tree in self._trees:
            self._open_groups(tree)
            _replace_light_paths(tree)
        scene = self._scene = self._keep(bpy.data.scenes.new("Raybundle World"))
        scene.world = world
        scene.frame_current = self._frame
        self._camera = self._keep(bpy.data.objects.new(
            scene.name, self._keep(bpy.data.cameras.new(scene.name))))
        scene.collection.objects.link(self._camera)
        scene.camera = self._camera
        render, cycles = scene.render, scene.cycles
        render.engine = 'CYCLES'
        cycles.device, cycles.samples = 'CPU', _SAMPLES
        cycles.use_adaptive_sampling = cycles.use_denoising = False
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
        # Each pixel shall be the mean over its own area.
        cycles.pixel_filter_type = 'BOX'
        cycles.film_exposure = 1.0
        render.film_transparent = False
        render.use_compositing = render.use_sequencer = False
        render.resolution_percentage = 100
        render.use_file_extension = True
        render.image_settings.file_format = 'OPEN_EXR'
        render.image_settings.color_mode = 'RGB'
        render.image_settings.color_depth = '32'

    def _open_groups(self, tree: bpy.types.NodeTree) -> None:
        """Replaces the groups of a tree, which other trees may use, by copies."""
        for node in tree.nodes:
            if node.type == 'GROUP' and node.node_tree is not None:
                node.node_tree = self._keep(node.node_tree.copy())
                self._trees.append(node.node_tree)

    def _keep(self, made: bpy.types.ID) -> bpy.types.ID:
        """Registers data that was created, so that _remove removes it. Returns the data."""
        self._made.append(made)
        return made

    def _remove(self) -> None:
        for made in reversed(self._made):
            _collection_of(made).remove(made)
        self._made.clear()
        for name in ('Render Result', 'Viewer Node'):
            image = bpy.data.images.get(name)
            if image is not None and name not in self._had:
                image.user_clear()
                bpy.data.images.remove(image)

    def _render(self, width: int, height: int, part: _Part | None) -> np.ndarray:
        render = self._scene.render
        render.resolution_x, render.resolution_y = width, height
        rows, columns = part or ((0, height), (0, width))
        render.use_border = render.use_crop_to_border = part is not None
        # Put the border a quarter into a pixel, so that rounding cannot move it to another pixel.
        render.border_min_x, render.border_max_x = ((x + 0.25) / width for x in columns)
        render.border_min_y, render.border_max_y = ((y + 0.25) / height for y in rows)
        shape = (rows[1] - rows[0], columns[1] - columns[0])
        with tempfile.TemporaryDirectory() as folder, _silent_handlers():
            path = Path(folder) / "world.exr"
            render.filepath = str(path)
            bpy.ops.render.render(scene=self._scene.name, write_still=True)
            return _read(path, shape)


def _read(path: Path, shape: tuple[int, int]) -> np.ndarray:
    """Returns the pixels of an image file, (height, width, 3) float64. Values that are negative or
    not finite are replaced by 0. Raises RuntimeError if the size (height, width) is not `shape`."""
    image = bpy.data.images.load(str(path))
    try:
        if tuple(image.size) != shape[::-1]:
            raise RuntimeError(f"its image has the size {tuple(image.size)}, not {shape[::-1]}")
        values = np.empty(shape[0] * shape[1] * image.channels, np.float32)
        image.pixels.foreach_get(values)
    finally:
        bpy.data.images.remove(image)
    pixels = values.reshape(*shape, -1)[:, :, :3].astype(np.float64)
    return np.where(np.isfinite(pixels), np.maximum(pixels, 0.0), 0.0)


def _replace_light_paths(tree: bpy.types.NodeTree) -> None:
    """Replaces the outputs of Light Path nodes by their values for a ray from a diffuse surface,
    because a camera renders the world."""
    for node in [node for node in tree.nodes if node.type == 'LIGHT_PATH']:
        for output in node.outputs:
            for socket in [link.to_socket for link in output.links]:
                value = tree.nodes.new('ShaderNodeValue')
                value.outputs[0].default_value = LIGHT_PATH.get(output.name, 0.0)
                tree.links.new(value.outputs[0], socket)


@contextmanager
def _silent_handlers() -> Iterator[None]:
    """Removes render handlers in the with block. These renders are not the user's, so the handlers
    of other add-ons must not run."""
    lists = [getattr(bpy.app.handlers, name) for name in _HANDLERS]
    kept = [list(handlers) for handlers in lists]
    for handlers in lists:
        handlers.clear()
    try:
        yield
    finally:
        for handlers, before in zip(lists, kept):
            handlers[:] = before


def _collection_of(item: bpy.types.ID) -> bpy.types.bpy_prop_collection:
    """Returns the collection of bpy.data that contains an item created in this module."""
    for kind, collection in ((bpy.types.Scene, bpy.data.scenes), (bpy.types.World, bpy.data.worlds),
                             (bpy.types.Object, bpy.data.objects),
                             (bpy.types.Camera, bpy.data.cameras)):
        if isinstance(item, kind):
            return collection
    return bpy.data.node_groups
