# SPDX-License-Identifier: GPL-3.0-or-later
"""Exports baked light in a binary glTF file, as COLOR_0 of unlit materials, in all of Blender.

Blender's exporters differ in what they do with colour attributes (export_check.py). All of them
write other attributes correctly, so the light is passed to them in one, for every corner and as
floats. It becomes COLOR_0 in the written file, in the format that was asked for. Nodes that show
the light are bypassed meanwhile, so that the file has the colours of the surfaces, whatever their
shader.
"""

from __future__ import annotations

import copy
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np

from . import light_in_material
from .glb_file import GlbError, GlbFile
from .mesh_arrays import corner_vertices, read
from .messages import Message, quoted

FORMATS = {'SHORT': np.uint16, 'BYTE': np.uint8, 'FLOAT': np.float32}
# Ways to fit light into the range 0 to 1.
AUTO, FULL, KEEP = 'AUTO', 'FULL', 'KEEP'

# Attributes that pass light and alpha to the exporter. Blender 3.5 and later export names that
# start with an underscore; 3.4 adds another one.
_LIGHT, _ALPHA = "_RAYBUNDLE_LIGHT", "_RAYBUNDLE_ALPHA"
_UNLIT = 'KHR_materials_unlit'

EXPORTER_OFF = Message("Blender's glTF exporter is switched off: enable the add-on \"glTF 2.0 "
                       "format\" in the preferences")


class ExportError(RuntimeError):
    """Raised if nothing can be exported. The message is for the user."""


@dataclass(frozen=True)
class ExportSettings:
    """What is exported, and how."""

    attribute: str  # the colour attribute that contains the light
    # Whether the file shows the light times the surface's colour; False: the light alone.
    with_color: bool = True
    format: str = 'SHORT'  # a key of FORMATS
    range: str = AUTO  # FULL: the largest value becomes 1; AUTO: only if it is above 1
    apply_modifiers: bool = True
    selected: bool = False  # whether only selected objects are exported


@dataclass
class ExportReport:
    """What was exported."""

    meshes: int = 0  # number of meshes with light
    largest: float = 0.0  # value of the attribute
    scale: float = 1.0  # attribute = scale * COLOR_0
    cut: int = 0  # number of vertices whose light was cut off at 1
    warnings: list[str] = field(default_factory=list)

    def summary(self) -> str:
        """Returns one line for the status bar."""
        text = Message("Light of {count} meshes exported" if self.meshes != 1 else
                       "Light of {count} mesh exported", count=self.meshes)
        if self.scale == 1.0:
            return text
        return Message("{exported}, divided by {scale} so that the largest value is 1: multiply it "
                       "in the engine by the scale in the file's extras", exported=text,
                       scale=f"{self.scale:.4g}")


def exporter_options() -> set[str]:
    """Returns the names of the options of Blender's glTF exporter; empty if it is switched off."""
    if "gltf" not in dir(bpy.ops.export_scene):
        return set()
    return set(bpy.ops.export_scene.gltf.get_rna_type().properties.keys())


def export(context: bpy.types.Context, path: Path, settings: ExportSettings) -> ExportReport:
    """Exports the visible objects of the scene to a .glb file. The scene stays as it is.

    Raises ExportError, after which an earlier file of this name is still there.
    """
    if not exporter_options():
        raise ExportError(EXPORTER_OFF)
    if not any(settings.attribute in mesh.color_attributes for mesh in bpy.data.meshes):
        raise ExportError(Message("No mesh has the attribute {name}: bake first",
                                  name=quoted(settings.attribute)))
    report = ExportReport()
    with tempfile.TemporaryDirectory() as folder:
        written = Path(folder) / "light.glb"
        with light_in_material.surfaces_exported() as changed, \
                _passed_on(settings.attribute, report):
            _run_exporter(written, settings)
        try:
            file = GlbFile.read(written)
            _write_colors(file, settings, report)
            _name_meshes_without_light(context.scene, file, settings.attribute, report)
            _show_unlit(file, settings, changed, report)
            file.write(path)
        except (GlbError, OSError) as error:
            raise ExportError(Message("{path} could not be written: {error}",
                                      path=quoted(str(path)), error=error)) from error
    return report


# --------------------------------------------------------------------------------------------------
# Blender's exporter
# --------------------------------------------------------------------------------------------------


def _run_exporter(path: Path, settings: ExportSettings) -> None:
    wanted = {'export_format': 'GLB', 'export_attributes': True, 'use_visible': True,
              'use_selection': settings.selected, 'export_apply': settings.apply_modifiers,
              # Versions before 4.2, and from 4.2 on: no colour attribute in its usual place.
              'export_colors': False, 'export_vertex_color': 'NONE'}
    known = exporter_options()
    options = {name: value for name, value in wanted.items() if name in known}
    try:
        bpy.ops.export_scene.gltf(filepath=str(path), **options)
    except RuntimeError as error:
        raise ExportError(Message("Blender's glTF exporter failed: {error}", error=error)
                          ) from error
    if not path.is_file():
        raise ExportError(Message("Blender's glTF exporter wrote no file: see the console"))


@contextmanager
def _passed_on(attribute: str, report: ExportReport) -> Iterator[None]:
    """Copies the light of all meshes to attributes that the exporter writes, in the with block."""
    meshes = [mesh for mesh in bpy.data.meshes
              if attribute in mesh.color_attributes and not mesh.is_editmode]
    try:
        for mesh in meshes:
            try:
                _pass_on(mesh, attribute)
            except (RuntimeError, AttributeError) as error:
                report.warnings.append(Message("{name} is exported without its light: {error}",
                                               name=quoted(mesh.name), error=error))
        yield
    finally:
        for mesh in meshes:
            for name in (_LIGHT, _ALPHA):
                if name in mesh.attributes:
                    mesh.attributes.remove(mesh.attributes[name])


def _pass_on(mesh: bpy.types.Mesh, attribute: str) -> None:
    source = mesh.color_attributes[attribute]
    colors = read(source.data, 'color', np.float32, 4)
    if source.domain == 'POINT':
        colors = colors[corner_vertices(mesh)]
    light = mesh.attributes.new(_LIGHT, 'FLOAT_VECTOR', 'CORNER')
    light.data.foreach_set('vector', np.ascontiguousarray(colors[:, :3]).ravel())
    if (colors[:, 3] != 1.0).any():
        alpha = mesh.attributes.new(_ALPHA, 'FLOAT', 'CORNER')
        alpha.data.foreach_set('value', np.ascontiguousarray(colors[:, 3]))


# --------------------------------------------------------------------------------------------------
# Colours
# --------------------------------------------------------------------------------------------------


def _write_colors(file: GlbFile, settings: ExportSettings, report: ExportReport) -> None:
    """Moves the light to COLOR_0 and says in the extras how to get the attribute back."""
    passed = []
    for mesh, primitive in file.primitives():
        attributes = primitive['attributes']
        light, alpha = (_take(attributes, name) for name in (_LIGHT, _ALPHA))
        for name in [name for name in attributes if name.startswith("_")]:
            # Blender 3.4 exports all attributes of a mesh together with the light.
            del attributes[name]
        if light is not None:
            values = np.nan_to_num(file.values(light).astype(np.float32))
            opacity = None if alpha is None else file.values(alpha).astype(np.float32)
            passed.append((mesh, primitive, np.maximum(values, 0.0), opacity))
    report.meshes = len({id(mesh) for mesh, *_ in passed})
    report.largest = max((float(values.max(initial=0.0)) for _, _, values, _ in passed),
                         default=0.0)
    report.scale = _scale(report.largest, settings)
    extras = {'attribute': settings.attribute, 'exposure': float(-np.log2(report.scale)),
              'scale': report.scale}
    cut_alpha = 0
    for mesh, primitive, values, opacity in passed:
        color = np.ones((len(values), 4), np.float64)
        color[:, :3] = values / report.scale
        if opacity is not None:
            color[:, 3] = opacity
        if settings.format != 'FLOAT':
            report.cut += int((color[:, :3] > 1.0).any(axis=1).sum())
            cut_alpha += int((color[:, 3] > 1.0).sum())
        encoded = _encoded(color, settings.format)
        primitive['attributes']['COLOR_0'] = file.add_accessor(
            encoded, normalized=settings.format != 'FLOAT')
        mesh.setdefault('extras', {})['raybundle'] = extras
    if passed:
        file.document['asset'].setdefault('extras', {})['raybundle'] = extras
    if report.cut:
        report.warnings.append(Message(
            "the light of {count} vertices is brighter than 1 and was cut off (the largest value "
            "is {largest}): export with the range Automatic", count=report.cut,
            largest=f"{report.largest:.4g}"))
    if cut_alpha:
        report.warnings.append(Message(
            "the alpha of {count} vertices is above 1, is not scaled, and was cut off: export "
            "floats, or write a part of the light to alpha that stays below 1", count=cut_alpha))


def _take(attributes: dict[str, int], name: str) -> int | None:
    return attributes.pop(name, attributes.pop(f"_{name}", None))


def _scale(largest: float, settings: ExportSettings) -> float:
    """Returns the number by which the light is divided."""
    if settings.range == KEEP or largest <= 0.0 or settings.range == AUTO and largest <= 1.0:
        return 1.0
    return largest


def _encoded(color: np.ndarray, kind: str) -> np.ndarray:
    """Returns colours, (n, 4), in a format of glTF, rounded to the nearest value."""
    dtype = FORMATS[kind]
    if kind == 'FLOAT':
        return color.astype(dtype)
    return np.rint(np.clip(color, 0.0, 1.0) * np.iinfo(dtype).max).astype(dtype)


# --------------------------------------------------------------------------------------------------
# Materials
# --------------------------------------------------------------------------------------------------


def _show_unlit(file: GlbFile, settings: ExportSettings, changed: set[str],
                report: ExportReport) -> None:
    """Makes the materials of the primitives with light unlit, so that engines do not light them
    again. changed: names of the materials that were made unlit for the exporter."""
    materials = file.document.setdefault('materials', [])
    lit = {primitive.get('material') for _, primitive in file.primitives()
           if 'COLOR_0' not in primitive['attributes']}
    unlit: dict[int | None, int] = {}
    for _, primitive in file.primitives():
        if 'COLOR_0' not in primitive['attributes']:
            continue
        index = primitive.get('material')
        if index not in unlit:
            material = {} if index is None else materials[index]
            if index is None or index in lit:
                material = copy.deepcopy(material)
                materials.append(material)
                unlit[index] = len(materials) - 1
            else:
                unlit[index] = index
            _make_unlit(material, settings, report)
        primitive['material'] = unlit[index]
    for index in lit - {None}:
        if materials[index].get('name') in changed:
            del materials[index]['extensions']
    if any(_UNLIT in material.get('extensions', ()) for material in materials):
        names = file.document.setdefault('extensionsUsed', [])
        file.document['extensionsUsed'] = list(dict.fromkeys([*names, _UNLIT]))
    if not materials:
        del file.document['materials']


def _make_unlit(material: dict, settings: ExportSettings, report: ExportReport) -> None:
    name = material.get('name', "Grey")
    surface = material.setdefault('pbrMetallicRoughness', {})
    if settings.with_color and (any(material.get('emissiveFactor', ()))):
        report.warnings.append(Message(
            "material {name} emits light and is not exported as unlit, because unlit materials do "
            "not emit: bake the output Combined to export emission with the light",
            name=quoted(name)))
        return
    if not settings.with_color:
        alpha = surface.get('baseColorFactor', (1.0,) * 4)[3]
        surface['baseColorFactor'] = [1.0, 1.0, 1.0, alpha]
        if material.get('alphaMode', 'OPAQUE') == 'OPAQUE':
            surface.pop('baseColorTexture', None)
        elif 'baseColorTexture' in surface:
            report.warnings.append(Message(
                "material {name} keeps its image, which has the transparency, so that the light is "
                "multiplied by the image: bake the output Lighting", name=quoted(name)))
    elif 'baseColorFactor' not in surface and not material.get('name'):
        # Faces without a material are grey in Blender and white in glTF.
        surface['baseColorFactor'] = [0.8, 0.8, 0.8, 1.0]
    if surface.get('baseColorFactor', (1.0,) * 4)[3] < 1.0:
        # Blender 3.4 asks Eevee's blend mode, which Cycles ignores.
        material.setdefault('alphaMode', 'BLEND')
    for key in ('emissiveFactor', 'emissiveTexture', 'normalTexture', 'occlusionTexture'):
        material.pop(key, None)
    surface.pop('metallicRoughnessTexture', None)
    # Recommended by the extension for engines that do not know it.
    surface.update(metallicFactor=0.0, roughnessFactor=0.9)
    material['extensions'] = {_UNLIT: {}}


def _name_meshes_without_light(scene: bpy.types.Scene, file: GlbFile, attribute: str,
                               report: ExportReport) -> None:
    """Warns of objects whose light is not in the file, because a modifier removes attributes."""
    meshes = file.document.get('meshes', [])
    for node in file.document.get('nodes', ()):
        item = scene.objects.get(node.get('name', ""))
        if (item is None or item.type != 'MESH' or 'mesh' not in node
                or attribute not in item.data.color_attributes):
            continue
        if not any('COLOR_0' in primitive['attributes']
                   for primitive in meshes[node['mesh']]['primitives']):
            report.warnings.append(Message(
                "{name} is exported without light, because a modifier removes the attribute: apply "
                "the modifier and bake again", name=quoted(item.name)))
