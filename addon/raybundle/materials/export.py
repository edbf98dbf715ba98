# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts material slots to `MaterialData`: reflectance and emission of both sides, images,
attributes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ..image_export import ImagePixels
from ..messages import Message, quoted
from ..scene_data import ImageData, MaterialData, SceneData, Warnings
from ..surface_data import (CORRELATED, SEPARATE, ColorData, DiffuseData, GlossData, LobeData,
                            PartData, ShownData, SurfaceData)
from .color_expression import WHITE, ColorExpression, Texture
from .color_reader import Reading
from .cycles_bake import BakedMaterial
from .diffuse_angles import lambert
from .last_surfaces import LastSurface, LastSurfaces
from .layers import BURLEY_SHEEN, LOBES, MICROFIBERS, SEVERAL_FACETS, VELVET
from .node_links import output_node
from .node_reader import NodeReader
from .shown_results import RENDERED, attributes_read
from .surface import Surface

# Linear grey of faces without a material, equal to Blender's default.
DEFAULT_REFLECTANCE = 0.8


@dataclass(frozen=True)
class SlotMaterial:
    """A material in the slot of an object, with the properties of the object that influence how the
    material is read."""

    material: bpy.types.Material | None  # original data-block; None: the default grey
    # Whether the material reads the mesh's render colour attribute and this attribute contains the
    # result of an earlier bake.
    renders_result: bool = False
    # For a material that shows only a result: digest of the surface that the last bake used for the
    # slot (last_surfaces.py).
    last: str | None = None


@dataclass(frozen=True)
class MaterialExport:
    """An exported material, and the mesh data that must be exported for it."""

    index: int  # position in SceneData.materials
    texture: Texture | None = None  # the images are read at its coordinates
    attribute: str | None = None  # source of the corner colours; "": the render colour attribute
    baked_uvs: bool = False  # True: the images are read at the UVs of cycles_bake.py
    surface: LastSurface | None = None  # kept for the next bake; None: the surface was guessed


@dataclass(frozen=True)
class _Shown:
    """How far a material shows the result of an earlier bake."""

    any: bool = False
    only: bool = False  # the surface's own colour does not follow from the material
    tells_emission: bool = False  # the material has an emission that is not a result


def _share_coordinates(*colors: ColorExpression) -> bool:
    """Returns whether the images and attributes of the colours can be read together: at the same UV
    coordinates, and from one attribute."""
    if len({color.attribute for color in colors if color.attribute is not None}) > 1:
        return False
    first, *others = [color.texture for color in colors if color.texture] or [None]
    return all(other.uv_layer == first.uv_layer
               and np.allclose(other.uv_matrix, first.uv_matrix) for other in others)


def _is_laid_out(translucence: ColorExpression, *others: ColorExpression) -> bool:
    """Returns whether a translucence varies only by an image that is read at the same UV
    coordinates as the other colours. True also for a constant translucence."""
    return translucence.attribute is None and _share_coordinates(translucence, *others)


def _part_of(part: ColorExpression, whole: ColorExpression) -> PartData:
    """Returns scale and offset, (3,) each, for which part = scale * whole + offset. The result is
    exact if the part varies by the same image or attribute as the whole, or is constant; otherwise
    it holds for the means."""
    if part.texture and whole.texture and part.texture.same_as(whole.texture):
        scale = _ratio(part.texture_weight, whole.texture_weight)
    elif part.attribute is not None and part.attribute == whole.attribute:
        scale = _ratio(part.attribute_weight, whole.attribute_weight)
    elif part.is_constant and not whole.is_constant:
        scale = np.zeros(3)
    else:
        return PartData(_ratio(part.mean(), whole.mean()))
    return PartData(scale, part.constant - scale * whole.constant)


def _ratio(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    return np.divide(part, whole, out=np.zeros(3), where=whole != 0.0)


def _surface_data(surface: Surface, diffuse: PartData, reflectance: ColorData,
                  emission: ColorData, translucence: ColorData) -> SurfaceData:
    """Returns the data of one side of a material. diffuse: the diffuse colour as a function of the
    reflectance."""
    color = np.maximum(surface.diffuse.mean(), 0.0)
    shown = np.where(color > 1e-6, surface.shown_by_angle / np.maximum(color, 1e-6),
                     lambert().shown)
    scattering = surface.scattering
    lobes = [LobeData(scattering.lobes[lobe, 0], scattering.lobes_by_angle[lobe],
                      scattering.lobe_roughness(lobe)) for lobe in LOBES]
    return SurfaceData(
        reflectance, emission, translucence, surface.reflected_by_angle,
        ShownData(diffuse, shown[0], shown[1:]),
        GlossData(_part_of(scattering.gloss, surface.reflectance), scattering.by_angle,
                  scattering.gloss_roughness(),
                  SEPARATE if bpy.app.version < (4, 0, 0) else CORRELATED),
        microfibers=lobes[MICROFIBERS], velvet=lobes[VELVET], burley_sheen=lobes[BURLEY_SHEEN],
        several_facets=lobes[SEVERAL_FACETS],
        diffuse=DiffuseData(*scattering.diffuse_model(), scattering.leaving_factors()))


class MaterialExporter:
    """Adds each material, and each image that a material uses, once to the exported scene.

    filter_glossy: see gloss.filter_glossy_of. results: names of the attributes that bakes write to.
    last: the surfaces that the last bake used; None if there was no bake.
    """

    def __init__(self, scene: SceneData, warnings: Warnings, filter_glossy: float | None = 1.0,
                 results: frozenset[str] = frozenset(), last: LastSurfaces | None = None) -> None:
        self.scene = scene
        self.warnings = warnings
        self.filter_glossy = filter_glossy
        self.results = results
        self.last = last
        self.images = ImagePixels()
        # names of exported materials that show results, in order
        self.showing: dict[str, None] = {}
        self._attributes: dict[bpy.types.Material | None, set[str]] = {}  # names that nodes read
        self._plain: dict[bpy.types.Material | None, SlotMaterial] = {}  # slots that show no result
        self._shown: dict[tuple[bpy.types.Material, bool], _Shown] = {}
        self._materials: dict[SlotMaterial, MaterialExport] = {}
        # Position in SceneData.materials of the last entry for each material that Cycles has baked.
        # There is one entry per object.
        self._baked: dict[bpy.types.Material, int] = {}
        self._unread: dict[SlotMaterial, str | None] = {}  # return values of unread()
        self._image_indices: dict[tuple[str, str], int] = {}

    def slot(self, material: bpy.types.Material | None, renders_result: Callable[[], bool],
             last: Callable[[], str | None]) -> SlotMaterial:
        """Returns a description of a slot. material: evaluated. renders_result, last: return the
        values of the fields of SlotMaterial; they are only called if the material depends on these
        fields."""
        key = material.original if material is not None else None
        if key in self._plain:
            return self._plain[key]
        if key not in self._attributes:
            self._attributes[key] = (set() if key is None or material.node_tree is None
                                     else attributes_read(material.node_tree))
        read = self._attributes[key]
        if RENDERED not in read and self.results.isdisjoint(read):
            self._plain[key] = SlotMaterial(key)
            return self._plain[key]
        slot = SlotMaterial(key, RENDERED in read and renders_result())
        return replace(slot, last=last()) if self._shows(material, slot).only else slot

    def export(self, slot: SlotMaterial, material: bpy.types.Material | None = None
               ) -> MaterialExport:
        """Adds the slot's material to the scene unless it was added before, and returns the export.
        material: the evaluated material, which is read. None: the original material is read."""
        if slot not in self._materials:
            self._materials[slot] = self._export(slot, material or slot.material)
        return self._materials[slot]

    def exported(self) -> Iterator[tuple[bpy.types.Material, bool]]:
        """Yields the exported materials (original data-blocks), each with whether light passes
        straight through."""
        for slot, export in self._materials.items():
            if slot.material is not None:
                yield slot.material, self.scene.materials[export.index].opacity < 1.0
        for material, index in self._baked.items():
            yield material, self.scene.materials[index].opacity_image is not None

    def unread(self, slot: SlotMaterial, material: bpy.types.Material) -> str | None:
        """Returns the property of the evaluated material that only Cycles can evaluate, worded as
        the end of the sentence "Raybundle cannot read ...". Returns None if the export can read the
        whole material."""
        key = replace(slot, last=None)
        if key not in self._unread:
            surface = self._surface(material, self._reading(slot), Warnings(), unread := [])
            if not unread and not _share_coordinates(surface.reflectance, surface.radiance):
                unread.append(Message("an emission that varies in another way than the "
                                      "reflectance"))
            if not unread and not _is_laid_out(surface.translucence, surface.reflectance,
                                               surface.radiance):
                unread.append(Message("a translucence that varies in another way than the "
                                      "reflectance"))
            if self._shows(material, slot).only:
                unread.clear()
            self._unread[key] = unread[0] if unread else None
        return self._unread[key]

    def add_baked(self, slot: SlotMaterial, material: bpy.types.Material, baked: BakedMaterial
                  ) -> MaterialExport:
        """Adds a material that Cycles has baked into images for one object (cycles_bake.py), and
        returns the export. material: evaluated."""
        if self._shows(material, slot).any:
            self.showing[material.name] = None
        # Warn of properties that neither the nodes nor Cycles' bake give exactly.
        approximated = Warnings()
        reading = replace(self._reading(slot), unread_color=baked.diffuse_color)
        surface = self._surface(material, reading, approximated, []).limited()
        for text in (*approximated, baked.message):
            self.warnings.add(text)
        index = {}
        for name, pixels in (('reflectance', baked.reflectance), ('radiance', baked.radiance),
                             ('opacity', baked.opacity), ('translucence', baked.translucence)):
            if pixels is not None:
                index[name] = len(self.scene.images)
                self.scene.images.append(ImageData(f"{material.name} ({name})", pixels, 'EXTEND'))
        side = _surface_data(
            surface, PartData(baked.diffuse_scale, baked.diffuse_offset),
            *(ColorData(image=index.get(name), image_weight=np.full(3, weight))
              for name, weight in (('reflectance', 1.0), ('radiance', np.pi),
                                   ('translucence', 1.0))))
        self.scene.materials.append(MaterialData(material.name, side, side,
                                                 opacity_image=index.get('opacity')))
        self._baked[material.original] = len(self.scene.materials) - 1
        # Only the means of the images are kept for the next bake.
        mean = replace(surface, radiance=ColorExpression(baked.radiance_color),
                       transmittance=baked.transmittance,
                       translucence=ColorExpression(baked.translucence_color))
        return MaterialExport(len(self.scene.materials) - 1, baked_uvs=True,
                              surface=LastSurface(material.name, (mean, mean)))

    def _export(self, slot: SlotMaterial, material: bpy.types.Material | None) -> MaterialExport:
        shown = self._shows(material, slot)
        # Faults of a material whose colours are not used are not worth a warning.
        warnings = Warnings() if shown.only else self.warnings
        reader, front = self._read(material, self._reading(slot), warnings)
        sides = [front.limited()] * 2
        if reader is not None and reader.has_backfacing:
            reading = self._reading(slot, backfacing=True)
            sides[1] = self._surface(material, reading, warnings).limited()
        surface = LastSurface(material.name if material else "(none)", tuple(sides))
        if shown.any:
            self.showing[material.name] = None
        if not shown.only:
            return replace(self._add(surface.material, sides), surface=surface)
        last = self.last and self.last.surface(slot.last)
        if last is None:
            return self._guess(material.name, sides, shown)
        if last.material == material.name and shown.tells_emission:
            # The material's emission is not a result: use its current value.
            last = replace(last, sides=tuple(replace(kept, radiance=side.radiance)
                                             for kept, side in zip(last.sides, sides)))
        return replace(self._add(material.name, list(last.sides)), surface=last)

    def _guess(self, name: str, sides: list[Surface], shown: _Shown) -> MaterialExport:
        """Adds a material that shows only a result and whose surface the last bake has not stored.
        Its colours are those of its sockets, or grey if these are black. Adds a warning."""
        if any(np.any(side.reflectance.mean() + side.translucence.mean() > 0.0) for side in sides):
            self.warnings.add(Message(
                "material {name} shows only the result of a bake, and no earlier bake stored its "
                "own colour: the colour of the socket that the result is linked to is used; set it "
                "there, or link the result through a Multiply node", name=quoted(name)))
        else:
            grey = Surface.matt(ColorExpression(WHITE * DEFAULT_REFLECTANCE))
            sides = [replace(grey, transmittance=side.transmittance) for side in sides]
            self.warnings.add(Message(
                "material {name} shows only the result of a bake, and no earlier bake stored its "
                "own colour: grey of {value} is used; bake once with the original material first",
                name=quoted(name), value=DEFAULT_REFLECTANCE))
        return self._add(name, sides)

    def _results(self, slot: SlotMaterial) -> frozenset[str]:
        """Returns the names of the attributes that contain results on the slot's object, as nodes
        name them."""
        return self.results | {RENDERED} if slot.renders_result else self.results

    def _reading(self, slot: SlotMaterial, backfacing: bool = False) -> Reading:
        return Reading(backfacing, varying_emission=True, filter_glossy=self.filter_glossy,
                       results=self._results(slot))

    def _shows(self, material: bpy.types.Material | None, slot: SlotMaterial) -> _Shown:
        """Returns how far the slot's material (evaluated) shows results on either side."""
        if material is None or self._results(slot).isdisjoint(
                self._attributes.get(material.original, ())):
            return _Shown()
        key = material.original, slot.renders_result
        if key not in self._shown:
            parts = []
            for backfacing in (False, True):
                reader, surface = self._read(material, self._reading(slot, backfacing),
                                             Warnings(), Warnings())
                parts.append((reader is not None and reader.shows_result,
                              reader is not None and reader.shows_only_result(surface),
                              reader is not None and reader.tells_emission
                              and not reader.emits_result))
            self._shown[key] = _Shown(*(any(values) for values in zip(*parts)))
        return self._shown[key]

    def _add(self, name: str, sides: list[Surface]) -> MaterialExport:
        """Adds a material with the given sides, front and back, and returns the export. A colour
        whose variation over the surface the native library cannot represent is replaced by its
        mean, with a warning."""
        if not sides[0].reflectance.same_variation(sides[1].reflectance):
            # The native library has one image and one weight for the reflectance of both sides.
            self.warnings.add(Message("material {name}: front and back have different images or "
                                      "attributes: the mean of each side is used",
                                      name=quoted(name)))
            sides = [replace(side, reflectance=ColorExpression(side.reflectance.mean()),
                             diffuse=ColorExpression(side.diffuse.mean())) for side in sides]
        varying = sides[0].reflectance
        texture, attribute = varying.texture, varying.attribute
        # Images of reflectance and of emission are read at the same coordinates.
        glows = [side.radiance for side in sides]
        glow_texture = next((glow.texture for glow in glows if glow.texture), None)
        glow_attribute = next((glow.attribute for glow in glows if glow.attribute is not None),
                              None)
        if (any(glow.texture and not glow.texture.same_as(glow_texture) for glow in glows)
                or any(glow.attribute not in (None, glow_attribute) for glow in glows)
                or not all(_share_coordinates(side.reflectance, side.radiance)
                           for side in sides)):
            self.warnings.add(Message("material {name}: its emission and its reflectance vary in "
                                      "different ways: the mean of the emission is used",
                                      name=quoted(name)))
            glows = [ColorExpression(glow.mean()) for glow in glows]
            glow_texture = glow_attribute = None
        passed = [side.translucence for side in sides]
        passed_texture = next((color.texture for color in passed if color.texture), None)
        if (not all(_is_laid_out(color, varying, *glows) for color in passed)
                or any(color.texture and not color.texture.same_as(passed_texture)
                       for color in passed)):
            self.warnings.add(Message("material {name}: its translucence and its reflectance vary "
                                      "in different ways: the mean of the translucence is used",
                                      name=quoted(name)))
            passed = [ColorExpression(color.mean()) for color in passed]
            passed_texture = None
        if any(np.any(color.mean() < -1e-6) for side in sides
               for color in (side.reflectance, side.radiance)):
            self.warnings.add(Message("material {name}: negative reflectance or emission counts "
                                      "as 0", name=quoted(name)))
        transmittance = np.clip([side.transmittance for side in sides], 0.0, 1.0)
        if np.ptp(transmittance) > 1e-3:
            self.warnings.add(Message("material {name}: its transparency differs between colours "
                                      "or sides: the mean is used", name=quoted(name)))
        images = [self._image_index(one) if one else None
                  for one in (texture, glow_texture, passed_texture)]
        data = MaterialData(name, *(_surface_data(
            side, _part_of(side.diffuse, side.reflectance),
            ColorData(np.maximum(side.reflectance.constant, 0.0), images[0],
                      varying.texture_weight, varying.attribute_weight),
            # A surface of radiance L has the exitance pi L.
            ColorData(np.pi * np.maximum(glow.constant, 0.0), images[1],
                      np.pi * glow.texture_weight, np.pi * glow.attribute_weight),
            ColorData(through.constant, images[2], through.texture_weight))
            for side, glow, through in zip(sides, glows, passed)),
            1.0 - float(transmittance.mean()))
        self.scene.materials.append(data)
        return MaterialExport(len(self.scene.materials) - 1,
                              texture or glow_texture or passed_texture,
                              glow_attribute if attribute is None else attribute)

    def _surface(self, material: bpy.types.Material | None, reading: Reading, warnings: Warnings,
                 unread: list[str] | None = None) -> Surface:
        """Returns one side of a material. Names of nodes that cannot be read are added to `unread`;
        if it is None, warnings are added instead."""
        reader, surface = self._read(material, reading, warnings,
                                     None if unread is None else Warnings())
        if unread is not None and reader is not None:
            unread += reader.unread
        return surface

    def _read(self, material: bpy.types.Material | None, reading: Reading, warnings: Warnings,
              inexact: Warnings | None = None) -> tuple[NodeReader | None, Surface]:
        """Returns one side of a material, and the reader that has read it. The reader is None if no
        nodes were read. inexact: see ColorReader."""
        if material is None:
            return None, Surface.matt(ColorExpression(WHITE * DEFAULT_REFLECTANCE))
        # From 5.0 on every material has nodes and use_nodes only warns.
        if bpy.app.version < (5, 0, 0) and not material.use_nodes or material.node_tree is None:
            return None, Surface.matt(ColorExpression(np.array(material.diffuse_color[:3])))
        output = output_node(material.node_tree)
        if output is None:
            warnings.add(Message("material {name} is black because it has no output node: add a "
                                 "Material Output", name=quoted(material.name)))
            return None, Surface()
        if output.inputs['Volume'].is_linked and not output.inputs['Surface'].is_linked:
            # A material with a volume and no surface lets all light pass, as in Cycles.
            return None, Surface(transmittance=WHITE)
        reader = NodeReader(Message("material {name}", name=quoted(material.name)), self.images,
                            warnings, reading, inexact)
        return reader, reader.surface(output.inputs['Surface'])

    def _image_index(self, texture: Texture) -> int:
        """Returns the position of the texture's image in SceneData.images. Each image is added
        once."""
        key = (texture.image.name_full, texture.extension)
        if key not in self._image_indices:
            pixels = self.images.read(texture.image)
            self._image_indices[key] = len(self.scene.images)
            self.scene.images.append(ImageData(texture.image.name, pixels, texture.extension))
        return self._image_indices[key]
