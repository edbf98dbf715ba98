# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials -> diffuse reflectance and emission of both sides, and the colours that vary."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from .color_expression import WHITE, ColorExpression, Texture
from .image_export import ImagePixels
from .node_reader import NodeReader, Surface, output_node
from .scene_data import ImageData, MaterialData, SceneData, Warnings

# What Blender shows where a face has no material.
DEFAULT_REFLECTANCE = 0.8


@dataclass(frozen=True)
class MaterialExport:
    """A material's index in SceneData, and what meshes must bring along for it."""

    index: int
    texture: Texture | None = None
    attribute: str | None = None


class MaterialExporter:
    """Adds each material, and each image it uses, once to the scene."""

    def __init__(self, scene: SceneData, warnings: Warnings) -> None:
        self.scene = scene
        self.warnings = warnings
        self.images = ImagePixels()
        self._materials: dict[bpy.types.Material | None, MaterialExport] = {}
        self._image_indices: dict[tuple[str, str], int] = {}

    def export(self, material: bpy.types.Material | None) -> MaterialExport:
        """material: original or evaluated; None is the grey default."""
        key = material.original if material else None
        if key not in self._materials:
            self._materials[key] = self._export(material)
        return self._materials[key]

    def _export(self, material: bpy.types.Material | None) -> MaterialExport:
        name = material.name if material else "(none)"
        front, back = (self._surface(material, backfacing) for backfacing in (False, True))
        varying = front.reflectance
        if not varying.same_variation(back.reflectance):
            # The native library lays an image on both sides alike.
            self.warnings.add(f'material "{name}": an image or attribute differs between the '
                              f'sides: its mean is used')
            front, back = (Surface(ColorExpression(side.reflectance.mean()), side.emission)
                           for side in (front, back))
            varying = front.reflectance
        sides = (front, back)
        texture, attribute = varying.texture, varying.attribute
        data = MaterialData(
            name,
            np.maximum([side.reflectance.constant for side in sides], 0.0),
            # A surface of radiance L has the exitance pi L.
            np.pi * np.maximum([side.emission for side in sides], 0.0),
            self._image_index(texture) if texture else None,
            varying.texture_weight if texture else None,
            varying.attribute_weight if attribute is not None else None)
        self.scene.materials.append(data)
        return MaterialExport(len(self.scene.materials) - 1, texture, attribute)

    def _surface(self, material: bpy.types.Material | None, backfacing: bool) -> Surface:
        if material is None:
            return Surface(ColorExpression(WHITE * DEFAULT_REFLECTANCE))
        # From 5.0 on every material has nodes and use_nodes only warns.
        if bpy.app.version < (5, 0, 0) and not material.use_nodes or material.node_tree is None:
            return Surface(ColorExpression(np.array(material.diffuse_color[:3])))
        output = output_node(material.node_tree)
        if output is None:
            self.warnings.add(f'material "{material.name}" has no output node: it is black')
            return Surface()
        reader = NodeReader(f'material "{material.name}"', self.images, self.warnings, backfacing)
        return reader.surface(output.inputs['Surface'])

    def _image_index(self, texture: Texture) -> int:
        key = (texture.image.name_full, texture.extension)
        if key not in self._image_indices:
            pixels = self.images.read(texture.image)
            self._image_indices[key] = len(self.scene.images)
            self.scene.images.append(ImageData(texture.image.name, pixels, texture.extension))
        return self._image_indices[key]
