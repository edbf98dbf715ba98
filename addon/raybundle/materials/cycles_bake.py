# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes the reflectance, emission and transmission of materials into images with Cycles.

This is used for materials that node_reader.py cannot read. An object is copied into a temporary
scene, and its materials are replaced by copies that emit the property in question
(shader_colors.py). Cycles bakes the emission into one image (face_atlas.py). The images are kept
until the object's mesh, transform or materials change. The user's data does not change, and all
temporary data is removed.

Approximations: values that depend on the direction of view are evaluated for a view from straight
above. A material that uses the Backfacing output gets the mean of both sides. A random value per
object is that of the copy.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import bpy
import numpy as np

from ..mesh_arrays import read, vertex_positions
from ..messages import Message, quoted
from .face_atlas import BORDER, FaceAtlas, face_atlas
from .fingerprint import material_fingerprint
from .gloss import filter_glossy_of
from .node_links import LIGHT_PATH
from .shader_colors import (DIFFUSE, PROPERTIES, RADIANCE, REFLECTANCE, TRANSLUCENCE,
                            TRANSMITTANCE, ShaderColors)

_SAMPLES = 4  # per pixel
_UV_MAP = "Raybundle Bake"
# Positions at which pixels are sampled, as a share of the way from the middle of a face to each
# corner.
_PLACES = (0.2, 0.5, 0.8)


@dataclass(frozen=True)
class BakedMaterial:
    """One material of an object, baked into images.

    Images are (height, width, 3) float32, linear RGB, bottom row first. All materials of the object
    share the same images.
    """

    message: str  # for the report: what was baked and why
    reflectance: np.ndarray
    radiance: np.ndarray | None  # W/(m^2 sr); None: no emission
    opacity: np.ndarray | None  # share that does not pass; None: fully opaque
    translucence: np.ndarray | None  # None: no diffuse transmission
    # (3,) each: the diffuse part is scale * reflectance + offset, fitted to the material's pixels.
    diffuse_scale: np.ndarray
    diffuse_offset: np.ndarray
    # (3,) each: means over the material's faces.
    diffuse_color: np.ndarray
    radiance_color: np.ndarray
    transmittance: np.ndarray
    translucence_color: np.ndarray


@dataclass(frozen=True)
class BakedSurface:
    """The baked materials of an object."""

    uvs: np.ndarray  # (c, 2) float32, image coordinates per corner of the evaluated mesh
    materials: dict[int, BakedMaterial]  # by slot


# The baked surfaces of the last export, by name of the scene and by digest of the data that they
# depend on.
_cache: dict[str, dict[bytes, BakedSurface]] = {}


def discard_all() -> None:
    """Discards the images of all scenes."""
    _cache.clear()


@dataclass(frozen=True)
class Wanted:
    """The materials of an object that must be baked."""

    reasons: dict[int, str]  # by slot to bake: the reason, see MaterialExporter.unread
    results: frozenset[str]  # attributes that hold results of bakes (shown_results.py)


def bake_surfaces(context: bpy.types.Context, wanted: dict[bpy.types.Object, Wanted], pixel: float
                  ) -> tuple[dict[bpy.types.Object, BakedSurface], list[str]]:
    """Bakes materials of objects, or reuses the images of the last export if nothing has changed.

    wanted: by original object. pixel: approximate size of a pixel on the surface, m. Returns the
    baked surfaces by object, and one message for each object that Cycles could not bake.
    """
    name = context.scene.name_full
    before = _cache.get(name, {})
    kept: dict[bytes, BakedSurface] = {}
    result: dict[bpy.types.Object, BakedSurface] = {}
    failures: list[str] = []
    for item, asked in wanted.items():
        try:
            with _evaluated_mesh(context, item) as mesh:
                key = _digest(context, item, mesh, asked, pixel)
                surface = before.get(key) or kept.get(key)
                if surface is None:
                    surface = _bake(context, item, mesh, asked, pixel)
            kept[key] = result[item] = surface
        except (RuntimeError, TypeError, ValueError) as error:
            failures.append(Message(
                "{name}: Cycles could not bake its materials ({error}): values that Raybundle "
                "cannot read are replaced by constants", name=quoted(item.name),
                error=error))
    _cache[name] = kept
    return result, failures


@contextmanager
def _evaluated_mesh(context: bpy.types.Context, item: bpy.types.Object
                    ) -> Iterator[bpy.types.Mesh]:
    """Yields a copy of the object's evaluated mesh. The copy is removed at the end of the with
    block."""
    depsgraph = context.evaluated_depsgraph_get()
    mesh = bpy.data.meshes.new_from_object(item.evaluated_get(depsgraph),
                                           preserve_all_data_layers=True, depsgraph=depsgraph)
    try:
        # Generated texture coordinates are relative to the bounds of the original mesh.
        if item.type == 'MESH':
            mesh.use_auto_texspace = False
            mesh.texspace_location = item.data.texspace_location
            mesh.texspace_size = item.data.texspace_size
        yield mesh
    finally:
        bpy.data.meshes.remove(mesh)


def _digest(context: bpy.types.Context, item: bpy.types.Object, mesh: bpy.types.Mesh,
            asked: Wanted, pixel: float) -> bytes:
    """Returns a digest of all data that the images depend on."""
    content = hashlib.blake2b(digest_size=16)
    depsgraph = context.evaluated_depsgraph_get()
    content.update(repr((sorted(asked.reasons), sorted(asked.results), round(pixel, 9),
                         context.scene.frame_current,
                         filter_glossy_of(context.scene),
                         [tuple(row) for row in item.evaluated_get(depsgraph).matrix_world],
                         tuple(item.color), item.pass_index,
                         tuple(mesh.texspace_location), tuple(mesh.texspace_size))).encode())
    for collection, name, dtype, width in (
            (mesh.vertices, 'co', np.float32, 3), (mesh.loops, 'vertex_index', np.int32, 1),
            (mesh.polygons, 'loop_total', np.int32, 1),
            (mesh.polygons, 'material_index', np.int32, 1),
            (mesh.polygons, 'use_smooth', bool, 1)):
        content.update(read(collection, name, dtype, width).tobytes())
    for layer in mesh.uv_layers:
        content.update(layer.name.encode() + bytes([layer.active_render])
                       + read(layer.data, 'uv', np.float32, 2).tobytes())
    for attribute in mesh.attributes:
        # A bake changes the results in the attributes, but materials are read without the results.
        if attribute.name in asked.results:
            continue
        content.update(attribute.name.encode() + _attribute_bytes(attribute))
    for slot in item.material_slots:
        content.update(material_fingerprint(slot.material).encode())
    return content.digest()


def _attribute_bytes(attribute: bpy.types.Attribute) -> bytes:
    """Returns the values of an attribute as bytes. Empty for types that nodes cannot read."""
    name, width = {'FLOAT': ('value', 1), 'INT': ('value', 1), 'BOOLEAN': ('value', 1),
                   'FLOAT_VECTOR': ('vector', 3), 'FLOAT_COLOR': ('color', 4),
                   'BYTE_COLOR': ('color', 4), 'FLOAT2': ('vector', 2)}.get(
                       attribute.data_type, (None, 0))
    if name is None:
        return b""
    return read(attribute.data, name, np.float32, width).tobytes()


# --------------------------------------------------------------------------------------------------
# One object
# --------------------------------------------------------------------------------------------------


def _bake(context: bpy.types.Context, item: bpy.types.Object, mesh: bpy.types.Mesh,
          asked: Wanted, pixel: float) -> BakedSurface:
    reasons = asked.reasons
    slots = np.clip(read(mesh.polygons, 'material_index', np.int32), 0,
                    max(len(item.material_slots) - 1, 0))
    wanted = np.isin(slots, list(reasons))
    uvs = np.full((len(mesh.loops), 2), -1.0, np.float32)
    if not wanted.any():
        return BakedSurface(uvs, {})
    atlas = _atlas(mesh, np.array(item.evaluated_get(
        context.evaluated_depsgraph_get()).matrix_world, float), wanted, pixel)
    layer = mesh.uv_layers.new(name=_UV_MAP, do_init=False)
    if layer is None:
        raise RuntimeError(Message("the mesh has no room for another UV map, remove one"))
    layer.data.foreach_set('uv', atlas.uvs.ravel())
    images = {}
    with _stage(context, item, mesh, asked.results) as stage:
        for wanted_property in PROPERTIES:
            if wanted_property == DIFFUSE and not stage.has_gloss:
                continue
            sides = []
            for backfacing in (False, True):
                colors = stage.bake(wanted_property, set(reasons), atlas, backfacing)
                if colors is not None:
                    sides.append(colors)
                if not stage.has_backfacing:
                    break
            if sides:
                images[wanted_property] = np.mean(sides, axis=0)
    opacity = None
    if TRANSMITTANCE in images:
        # The native library has one opacity for all channels.
        through = np.clip(images[TRANSMITTANCE], 0.0, 1.0).mean(axis=2, keepdims=True)
        opacity = np.repeat(1.0 - through, 3, axis=2)
    black = np.zeros((atlas.height, atlas.width, 3), np.float32)
    whole = images.get(REFLECTANCE, black)
    diffuse = images.get(DIFFUSE, black) if stage.has_gloss else whole
    sizes = read(mesh.polygons, 'loop_total', np.int32)
    materials = {}
    for slot, reason in reasons.items():
        pixels, diffuse_pixels, *others = _pixels(
            atlas, sizes, slots == slot, whole, diffuse,
            *(images.get(name, black) for name in (RADIANCE, TRANSMITTANCE, TRANSLUCENCE)))
        materials[slot] = BakedMaterial(
            Message("material {name}: baked by Cycles on {object}, because Raybundle cannot read "
                    "{reason}", name=quoted(item.material_slots[slot].material.name),
                    object=quoted(item.name), reason=reason),
            whole, images.get(RADIANCE), opacity, images.get(TRANSLUCENCE),
            *_line_through(pixels, diffuse_pixels),
            *(image.mean(axis=0) if len(image) else np.zeros(3)
              for image in (diffuse_pixels, *others)))
    return BakedSurface(atlas.uvs, materials)


def _pixels(atlas: FaceAtlas, sizes: np.ndarray, faces: np.ndarray, *images: np.ndarray
            ) -> list[np.ndarray]:
    """Returns the pixels of each image at some positions in each chosen face, (n, 3) float64 per
    image. sizes: (f,), number of corners of each face. faces: (f,) bool."""
    firsts = np.cumsum(sizes) - sizes
    centres = np.repeat(np.add.reduceat(atlas.uvs, firsts) / sizes[:, None], sizes, axis=0)
    inside = np.repeat(faces, sizes)
    places = np.concatenate([centres[inside] + share * (atlas.uvs - centres)[inside]
                             for share in _PLACES])
    column, row = (np.clip((places[:, k] * size).astype(int), 0, size - 1)
                   for k, size in enumerate((atlas.width, atlas.height)))
    return [image[row, column].astype(np.float64) for image in images]


def _line_through(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns scale and offset, (3,) each, for which scale * x + offset is nearest to y by least
    squares. x, y: (n, 3). The offset is 0 in channels in which x hardly varies."""
    means = x.mean(axis=0), y.mean(axis=0)
    spread = ((x - means[0])**2).sum(axis=0)
    varies = spread > 1e-6 * (x**2).sum(axis=0)
    scale = np.where(
        varies, ((x - means[0]) * (y - means[1])).sum(axis=0) / np.where(varies, spread, 1.0),
        means[1] / np.maximum(means[0], 1e-9))
    return scale, np.where(varies, means[1] - scale * means[0], 0.0)


def _atlas(mesh: bpy.types.Mesh, matrix: np.ndarray, wanted: np.ndarray, pixel: float
           ) -> FaceAtlas:
    """Returns the layout of the mesh's faces at their size in the world. matrix: (4, 4), object to
    world. wanted: (f,) bool."""
    placed = vertex_positions(mesh).astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    sizes = read(mesh.polygons, 'loop_total', np.int32)
    return face_atlas(placed[read(mesh.loops, 'vertex_index', np.int32)],
                      np.concatenate([[0], np.cumsum(sizes)]), wanted, pixel)


class _Stage:
    """The copy of an object, alone in a scene that Cycles renders."""

    def __init__(self, context: bpy.types.Context, source: bpy.types.Object,
                 scene: bpy.types.Scene, item: bpy.types.Object, results: frozenset[str]) -> None:
        self.context, self.source, self.scene, self.item = context, source, scene, item
        self.results = results
        # Set by the first bake, that of REFLECTANCE; see ShaderColors.
        self.has_backfacing = False
        self.has_gloss = False

    def bake(self, wanted: str, slots: set[int], atlas: FaceAtlas, backfacing: bool
             ) -> np.ndarray | None:
        """Bakes a property. wanted: one of PROPERTIES. slots: the slots whose materials are baked.
        Returns (height, width, 3) float32, or None if no shader of the materials has the property.
        Raises RuntimeError if Cycles cannot bake."""
        image = bpy.data.images.new(_UV_MAP, atlas.width, atlas.height, alpha=False,
                                    float_buffer=True, is_data=True)
        made: list[bpy.types.ID] = [image]
        try:
            found = self._set_materials(wanted, slots, backfacing, image, made)
            if not found:
                return None
            self._run()
            pixels = np.empty(atlas.width * atlas.height * 4, np.float32)
            image.pixels.foreach_get(pixels)
            colors = pixels.reshape(atlas.height, atlas.width, 4)[:, :, :3]
            return np.ascontiguousarray(np.maximum(np.nan_to_num(colors), 0.0))
        finally:
            self.item.data.materials.clear()
            bpy.data.batch_remove(made)

    def _set_materials(self, wanted: str, slots: set[int], backfacing: bool,
                       image: bpy.types.Image, made: list[bpy.types.ID]) -> bool:
        """Assigns materials to the object that emit the property. Returns whether any shader has
        the property. Adds all created data to `made`, which the caller removes."""
        found = False
        mesh = self.item.data
        faces = read(mesh.polygons, 'material_index', np.int32)
        mesh.materials.clear()
        for index, slot in enumerate(self.source.material_slots):
            if index in slots:
                material = slot.material.copy()
                made.append(material)
                colors = ShaderColors(wanted, LIGHT_PATH, backfacing,
                                      filter_glossy_of(self.context.scene), self.results)
                try:
                    colors.rewrite(material.node_tree)
                finally:
                    made += colors.groups
                found |= colors.found
                self.has_backfacing |= colors.has_backfacing
                self.has_gloss |= colors.has_gloss
            else:
                material = bpy.data.materials.new(_UV_MAP)
                made.append(material)
                if bpy.app.version < (5, 0, 0):
                    material.use_nodes = True
            # The bake writes to the active image of each material.
            target = material.node_tree.nodes.new('ShaderNodeTexImage')
            target.image = image
            material.node_tree.nodes.active = target
            mesh.materials.append(material)
        mesh.polygons.foreach_set('material_index', faces)
        mesh.update()
        return found

    def _run(self) -> None:
        view_layer = self.scene.view_layers[0]
        with self.context.temp_override(
                scene=self.scene, view_layer=view_layer, object=self.item,
                active_object=self.item, selected_objects=[self.item],
                selected_editable_objects=[self.item]):
            bpy.ops.object.bake(type='EMIT', target='IMAGE_TEXTURES', save_mode='INTERNAL',
                                use_clear=True, margin=BORDER, uv_layer=_UV_MAP,
                                use_selected_to_active=False)


@contextmanager
def _stage(context: bpy.types.Context, source: bpy.types.Object, mesh: bpy.types.Mesh,
           results: frozenset[str]) -> Iterator[_Stage]:
    """Yields a scene with a copy of the object. Both are removed at the end of the with block."""
    scene = bpy.data.scenes.new(_UV_MAP)
    item = bpy.data.objects.new(_UV_MAP, mesh)
    try:
        scene.render.engine = 'CYCLES'
        scene.cycles.samples = _SAMPLES
        scene.cycles.use_adaptive_sampling = False
        scene.cycles.use_denoising = False
        # frame_set is not used because it calls the user's handlers.
        scene.frame_current = context.scene.frame_current
        scene.collection.objects.link(item)
        depsgraph = context.evaluated_depsgraph_get()
        item.matrix_world = source.evaluated_get(depsgraph).matrix_world
        item.color, item.pass_index = source.color, source.pass_index
        scene.view_layers[0].objects.active = item
        item.select_set(True, view_layer=scene.view_layers[0])
        yield _Stage(context, source, scene, item, results)
    finally:
        bpy.data.objects.remove(item)
        bpy.data.scenes.remove(scene)
