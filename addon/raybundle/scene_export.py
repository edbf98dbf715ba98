# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts the evaluated scene to `SceneData`, and records how light is written back to each
object.

Python can only evaluate the scene as the viewport does. Of this scene, the objects that renders
show are exported.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace

import bpy
import numpy as np
from mathutils import Vector

from . import left_out
from .corner_map import CornerMap, ElementCodes, build_corner_map, same_topology
from .hidden_lights import hidden_light_instances
from .image_export import ImagePixels
from .light_export import export_instance
from .light_sets import LightSet, LightSetMembers
from .materials.cycles_bake import BakedSurface, Wanted, bake_surfaces
from .materials.export import MaterialExporter, SlotMaterial
from .materials.gloss import filter_glossy_of
from .materials.last_surfaces import LastSurfaces
from .materials.shown_results import RENDERED, renders_result, result_names
from .mesh_export import MeshError, export_mesh, has_turned_normals
from .messages import Message, quoted
from .scene_data import InstanceData, LightData, MeshData, SceneData, Warnings
from .world_export import export_world

# Object types whose evaluated geometry is a mesh.
GEOMETRY_TYPES = ('MESH', 'CURVE', 'SURFACE', 'META', 'FONT')


@dataclass(frozen=True)
class BakeTarget:
    """An object that light will be written to."""

    object: bpy.types.Object  # original
    instance: int  # position in SceneData.instances
    corner_map: CornerMap  # from the exported mesh to the object's own mesh
    name: str  # of the object, at the time of the export
    vertex_count: int  # of the object's own mesh, at the time of the export

    def unchanged_mesh(self) -> bpy.types.Mesh | None:
        """Returns the object's own mesh. Returns None if it cannot be written: if it or the object
        was removed, if it is in Edit Mode, or if it has another size than at the export."""
        try:
            mesh = self.object.data
            size = (len(mesh.vertices), len(mesh.loops))
            is_same = size == (self.vertex_count, self.corner_map.original_count)
            return mesh if is_same and not mesh.is_editmode else None
        except ReferenceError:
            return None


@dataclass
class SceneExport:
    """An exported scene, and the messages about it for the report."""

    scene: SceneData = field(default_factory=SceneData)
    targets: list[BakeTarget] = field(default_factory=list)
    statuses: dict[str, str] = field(default_factory=dict)  # by object name: why it gets no light
    warnings: Warnings = field(default_factory=Warnings)
    last: LastSurfaces | None = None  # the surfaces of this bake, for the next bake
    shown_lamps: int = 0  # of the scene's lights, those that the viewport shows come first


def export_scene(context: bpy.types.Context, selected: Collection[bpy.types.Object] | None = None,
                 light_sets: Sequence[LightSet] = (), patch_size: float = 0.0,
                 attribute: str | None = None, to_copies: bool = False) -> SceneExport:
    """Exports the context's scene. The user's data is unchanged afterwards.

    selected: original objects to bake, None for all. Other objects still reflect and block light.
    light_sets: sets whose members are recorded. patch_size: m, 0 for the native library's choice;
    it determines the size of the images that Cycles bakes. attribute: name of the attribute for the
    light, None for that of the scene's settings. to_copies: whether the light is written to copies
    of the evaluated meshes, for which it does not matter what modifiers have done. Raises BakeError
    if a light is in several light sets.
    """
    if attribute is None:
        attribute = context.scene.raybundle.attribute
    exporter = _Exporter(context, selected, light_sets, attribute, to_copies)
    exporter.bake_surfaces(patch_size)
    changed = _meshes_with_changed_topology(context, selected)
    try:
        with ElementCodes(changed):
            return exporter.export()
    finally:
        if changed:
            # Evaluate again, so that evaluated meshes have no codes either.
            context.view_layer.update()


def export_lamps_again(context: bpy.types.Context, last: SceneExport) -> SceneExport | None:
    """Returns the export of a scene in which nothing but lamps has changed since its last export.
    Returns None if that needs a whole export: if lamps were added or removed, or have begun or
    ceased to shine, or if an object cannot be written any more."""
    shown: list[LightData] = []
    warnings = Warnings()
    images = ImagePixels()
    for instance in renderable_instances(context):
        if instance.object.type == 'LIGHT':
            light = export_instance(instance, images, warnings)
            if light is not None:
                shown.append(light)
    before = last.scene.lights[:last.shown_lamps]
    if [light.name for light in shown] != [light.name for light in before] \
            or any(target.unchanged_mesh() is None for target in last.targets):
        return None
    scene = replace(last.scene, lights=shown + last.scene.lights[last.shown_lamps:])
    for text in last.warnings:
        warnings.add(text)
    return replace(last, scene=scene, warnings=warnings)


def renderable_instances(context: bpy.types.Context) -> Iterator[bpy.types.DepsgraphObjectInstance]:
    """Yields evaluated instances of objects that are visible in both the viewport and renders."""
    depsgraph = context.evaluated_depsgraph_get()
    renderable = _objects_in_rendered_collections(context.view_layer)
    for instance in depsgraph.object_instances:
        item = instance.object
        if item.hide_render:
            continue
        if instance.is_instance:
            if instance.parent is not None and instance.parent.hide_render:
                continue
        elif item.original not in renderable:
            continue
        elif item.is_instancer and not item.show_instancer_for_render:
            continue
        yield instance


def _objects_in_rendered_collections(view_layer: bpy.types.ViewLayer) -> set[bpy.types.Object]:
    """Returns the original objects in collections that the view layer contains and renders show."""
    objects: set[bpy.types.Object] = set()
    pending = [view_layer.layer_collection]
    while pending:
        layer_collection = pending.pop()
        collection = layer_collection.collection
        if collection.hide_render:
            continue
        # Children of an excluded collection need not be excluded.
        if not layer_collection.exclude:
            objects.update(collection.objects)
        pending.extend(layer_collection.children)
    return objects


def _role(item: bpy.types.Object, selected: Collection[bpy.types.Object] | None) -> str:
    """Returns the role of an original object in this bake: 'BAKE', 'OCCLUDE' or 'IGNORE'."""
    role = item.raybundle.role
    if role == 'BAKE' and selected is not None and item not in selected:
        return 'OCCLUDE'
    return role


def _meshes_with_changed_topology(context: bpy.types.Context,
                                  selected: Collection[bpy.types.Object] | None
                                  ) -> list[bpy.types.Mesh]:
    """Returns the original meshes of baked objects whose modifiers change the topology."""
    meshes = []
    for instance in renderable_instances(context):
        item = instance.object.original
        if (instance.is_instance or item.type != 'MESH' or instance.object.type != 'MESH'
                or not item.modifiers
                or _role(item, selected) != 'BAKE' or item.data.library is not None):
            continue
        if not same_topology(item.data, instance.object.data):
            meshes.append(item.data)
    return meshes


class _Exporter:
    """Exports the evaluated scene for one bake."""

    def __init__(self, context: bpy.types.Context,
                 selected: Collection[bpy.types.Object] | None,
                 light_sets: Sequence[LightSet], attribute: str, to_copies: bool) -> None:
        self.context = context
        self.selected = selected
        self.to_copies = to_copies
        self.last = LastSurfaces(context.scene)
        self.result = SceneExport(last=self.last)
        self.results = result_names([attribute, *self.last.attributes,
                                     *(item.attribute for item in light_sets)])
        self.materials = MaterialExporter(self.result.scene, self.result.warnings,
                                          filter_glossy_of(context.scene), self.results, self.last)
        self.members = LightSetMembers(list(light_sets), self.result.scene)
        self._baked: dict[bpy.types.Object, BakedSurface] = {}  # by original object
        # By mesh and materials, see _mesh: index in SceneData.meshes, or the reason why the mesh is
        # left out.
        self._meshes: dict[tuple, int | MeshError] = {}
        # By the keys of _meshes: the digests (LastSurfaces) of the surfaces in the slots.
        self._taken: dict[tuple, list[str]] = {}
        self._alike: dict[tuple, list[int]] = {}  # exported meshes by MeshData.key()
        # Numbers of instances that are not objects themselves, by the names of the instancing
        # object and of the instance's object.
        self._instance_counts: Counter[tuple[str, str]] = Counter()
        self._corner_maps: dict[bpy.types.Object, CornerMap] = {}  # by original object
        self._copied: list[str] = []  # objects whose modifiers create several corners from one
        self._untraced: list[str] = []  # objects whose modifiers lose the codes of some corners
        self._turned: dict[int, str] = {}  # by mesh: an object whose custom normals turn faces
        # Name, mesh and transform of exported objects that are not meshes.
        self._placed: set[tuple[str, int, bytes]] = set()
        self._drawn: dict[bpy.types.Object, None] = {}  # original objects that are exported

    def bake_surfaces(self, patch_size: float) -> None:
        """Bakes the materials that cannot be read with Cycles. Must not be called while the
        evaluated scene is in use, because Cycles evaluates another scene."""
        wanted: dict[bpy.types.Object, Wanted] = {}
        seen: set[tuple] = set()
        for instance in renderable_instances(self.context):
            item = instance.object
            # Only use objects with a mesh of their own. Of the objects that share a mesh and its
            # materials, use the first.
            if (item.type != 'MESH' or item.original.type != 'MESH'
                    or _role(item.original, None) == 'IGNORE'):
                continue
            slots = self._slots(item)
            group = (item.data.as_pointer(), slots)
            if group in seen:
                continue
            seen.add(group)
            reasons = {}
            # Cycles bakes the original's materials. A script may have changed their slots since the
            # evaluation.
            for index, (slot, original) in enumerate(zip(item.material_slots,
                                                         item.original.material_slots)):
                if slot.material is None or original.material is None:
                    continue
                unread = self.materials.unread(slots[index], slot.material)
                if unread is not None:
                    reasons[index] = unread
            if reasons:
                rendered = {RENDERED} if self._renders_result(item) else set()
                wanted[item.original] = Wanted(reasons, self.results | rendered)
        if not wanted:
            return
        # A quarter of the size that the native library chooses for patches.
        pixel = 0.25 * (patch_size or self._diagonal() / 64.0)
        self._baked, failures = bake_surfaces(self.context, wanted, pixel)
        for text in failures:
            self.result.warnings.add(text)

    def _slots(self, item: bpy.types.Object) -> tuple[SlotMaterial, ...]:
        """Returns descriptions of the material slots of an evaluated object."""
        return tuple(
            self.materials.slot(slot.material, lambda: self._renders_result(item),
                                lambda index=index: self.last.digest(item.original, index))
            for index, slot in enumerate(item.material_slots))

    def _renders_result(self, item: bpy.types.Object) -> bool:
        """Returns whether the render colour attribute of an evaluated object is the result of a
        bake."""
        if item.type != 'MESH' or item.original.type != 'MESH':
            return False
        return renders_result(item.data, self.results,
                              _role(item.original, self.selected) == 'BAKE')

    def _diagonal(self) -> float:
        """Returns the approximate diagonal of the bounding box of the exported objects, m."""
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for instance in renderable_instances(self.context):
            item = instance.object
            if item.type in GEOMETRY_TYPES and _role(item.original, None) != 'IGNORE':
                box = np.array([instance.matrix_world @ Vector(c) for c in item.bound_box])
                low, high = np.minimum(low, box.min(axis=0)), np.maximum(high, box.max(axis=0))
        return float(np.linalg.norm(high - low))

    def export(self) -> SceneExport:
        """Exports the evaluated scene. Must be called after bake_surfaces."""
        for instance in renderable_instances(self.context):
            item = instance.object
            if item.type == 'LIGHT':
                self._add_light(instance)
            elif item.type in GEOMETRY_TYPES:
                self._add_geometry(instance)
            elif item.type in left_out.UNREAD_TYPES:
                self._refuse(item.name, left_out.UNREAD_TYPES[item.type])
        hidden = self._hidden()
        lights = self.result.scene.lights
        shown = self.result.shown_lamps = len(lights)
        for instance in hidden_light_instances(self.context, hidden):
            self._add_light(instance)
        self._name_what_is_left_out(hidden, [light.name for light in lights[shown:]])
        scene = self.result.scene
        world = export_world(self.context, self.materials.images, self.result.warnings)
        scene.world, scene.world_image = world.radiance, world.image
        scene.lights.extend(world.suns)
        self.members.add_world_lights(len(world.suns))
        self._name_showing_materials()
        for (parent, name), count in self._instance_counts.items():
            label = name if parent == name else f"{parent} / {name}"
            self.result.statuses[label] = Message(
                "{count} instances, not baked: instances reflect and block light, but get no "
                "colours; make them real to bake them" if count > 1 else
                "{count} instance, not baked: instances reflect and block light, but get no "
                "colours; make them real to bake them", count=count)
        return self.result

    def _hidden(self) -> list[bpy.types.Object]:
        """Returns the original objects that are hidden in the viewport and not in renders, sorted
        by name."""
        shown = {item.original for item in self.context.evaluated_depsgraph_get().objects}
        return [item for item in sorted(_objects_in_rendered_collections(self.context.view_layer),
                                        key=lambda item: item.name_full)
                if item not in shown and not item.hide_render]

    def _unrendered(self) -> list[bpy.types.Object]:
        """Returns the original objects that are shown in the viewport and not in renders, sorted by
        name."""
        rendered = _objects_in_rendered_collections(self.context.view_layer)
        return [item for item in sorted(self.context.view_layer.objects,
                                        key=lambda item: item.name_full)
                if (item.hide_render or item not in rendered) and item.visible_get()]

    def _name_what_is_left_out(self, hidden: list[bpy.types.Object], lights: list[str]) -> None:
        """Adds warnings of features that the bake ignores. hidden: see _hidden. lights: names of
        the hidden lamps, which are exported."""
        scene = self.context.scene
        hidden, unrendered = (
            [item for item in items
             if item.type in GEOMETRY_TYPES and _role(item, None) != 'IGNORE']
            for items in (hidden, self._unrendered()))
        for items, status in ((hidden, Message("hidden in the viewport")),
                              (unrendered, Message("hidden in renders"))):
            for item in items:
                self.result.statuses.setdefault(item.name, status)
        for text in (
                *left_out.of_render_settings(scene, self.context.view_layer),
                *left_out.of_world(scene.world), *left_out.of_objects(self._drawn),
                *left_out.of_materials(scene, self.materials.exported()),
                *left_out.of_hidden(hidden, lights),
                *left_out.of_unrendered(unrendered),
                *left_out.of_modifiers(self._copied, self._untraced),
                *left_out.of_normals(self._turned.values())):
            self.result.warnings.add(text)

    def _name_showing_materials(self) -> None:
        if not self.materials.showing:
            return
        names = ", ".join(quoted(name) for name in self.materials.showing)
        self.result.warnings.add(Message(
            "the materials {names} show the result of a bake: the result counts as 0 where it is "
            "emission and as 1 where it is a factor; a surface that shows only the result keeps "
            "the properties that the last bake used", names=names))

    def _add_light(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        light = export_instance(instance, self.materials.images, self.result.warnings)
        if light is not None:
            self.result.scene.lights.append(light)
            self.members.add_light(instance)

    def _add_geometry(self, instance: bpy.types.DepsgraphObjectInstance) -> None:
        item = instance.object
        original = item.original
        role = _role(original, self.selected)
        if role == 'IGNORE':
            return
        transform = np.array(instance.matrix_world, float)[:3]
        if not np.isfinite(transform).all():
            self._refuse(item.name, Message("its transform is not finite: reset the transform"))
            return
        mesh = self._mesh(item, wants_map=role == 'BAKE' and not instance.is_instance)
        if isinstance(mesh, MeshError):
            # Curves without a surface and empty texts are common, so only meshes are worth a
            # warning.
            if original.type == 'MESH':
                self._refuse(item.name, *mesh.args)
            return
        if original.type != 'MESH':
            # Blender lists a curve twice: as itself and as the mesh that it evaluates to.
            place = (original.name_full, mesh, transform.tobytes())
            if place in self._placed:
                return
            self._placed.add(place)
            if role == 'BAKE':
                self.result.statuses[item.name] = Message(
                    "takes part in the light, but gets no colours: convert the {type} object to a "
                    "mesh", type=original.type)
            role = 'OCCLUDE'
        elif instance.is_instance:
            parent = instance.parent.name if instance.parent else item.name
            self._instance_counts[parent, item.name] += 1
            role = 'OCCLUDE'
        self._drawn[original] = None
        is_holdout = original.is_holdout or original.holdout_get(
            view_layer=self.context.view_layer)
        if is_holdout or original.is_shadow_catcher and bpy.app.version >= (4, 0, 0):
            self.result.warnings.add(Message(
                "{name} is a holdout: Cycles bakes it black, but Raybundle bakes it like other "
                "objects; switch the holdout off to compare" if is_holdout else
                "{name} is a shadow catcher: Cycles bakes it black, but Raybundle bakes it like "
                "other objects; switch the shadow catcher off to compare",
                name=quoted(item.name)))
        # In Cycles, the ray visibility of the instancing object also applies.
        shown = (item, instance.parent) if instance.is_instance and instance.parent else (item,)
        self.result.scene.instances.append(
            InstanceData(mesh, item.name, transform, role, original.raybundle.side,
                         original.raybundle.quality,
                         stops_direct=all(source.visible_shadow for source in shown),
                         exchanges=all(source.visible_diffuse for source in shown)))
        self.members.add_instance(instance)
        if (left_out.has_light_linking(original)
                and self.result.scene.emits(len(self.result.scene.instances) - 1)):
            self.result.warnings.add(Message("{name}: {reason}", name=quoted(item.name),
                                             reason=left_out.NO_LINKING))
        if role == 'BAKE':
            index = len(self.result.scene.instances) - 1
            self.result.targets.append(
                BakeTarget(original, index, self._corner_maps[original], original.name,
                           len(original.data.vertices)))

    def _refuse(self, name: str, reason: Message) -> None:
        """Leaves out an object, with a warning."""
        self.result.statuses[name] = reason
        self.result.warnings.add(Message("{name} is left out: {reason}", name=quoted(name),
                                         reason=reason))

    def _mesh(self, item: bpy.types.Object, wants_map: bool) -> int | MeshError:
        """Returns the index in SceneData.meshes of an evaluated object's mesh, which is exported
        once. Returns a MeshError if the mesh cannot be part of the bake. wants_map: whether the
        object's corner map is also built."""
        # Materials may be linked to the object and then differ between objects with the same mesh.
        key = (item.data.as_pointer(), item.type, self._slots(item))
        original = item.original
        needs_map = wants_map and original.type == 'MESH' and original not in self._corner_maps
        if key not in self._meshes or needs_map:
            mesh = item.to_mesh()
            try:
                if key not in self._meshes:
                    self._meshes[key] = self._exported(item, mesh, key)
                index = self._meshes[key]
                if needs_map and not isinstance(index, MeshError):
                    self._corner_maps[original] = self._corner_map(
                        original, mesh, self.result.scene.meshes[index])
            finally:
                item.to_mesh_clear()
        if key in self._taken:
            self.last.take(original, self._taken[key])
        return self._meshes[key]

    def _exported(self, item: bpy.types.Object, mesh: bpy.types.Mesh, key: tuple
                  ) -> int | MeshError:
        baked = self._baked.get(item.original)
        # The mesh has been evaluated again and may have changed.
        if baked is not None and len(baked.uvs) != len(mesh.loops):
            baked = None
        slots = self._slots(item)
        materials = [self.materials.add_baked(slots[index], slot.material, baked.materials[index])
                     if baked is not None and index in baked.materials
                     else self.materials.export(slots[index], slot.material)
                     for index, slot in enumerate(item.material_slots)]
        default = None if materials else self.materials.export(SlotMaterial(None))
        self._taken[key] = [self.last.digest_of(material.surface, mesh)
                            for material in materials or [default]]
        try:
            data = export_mesh(mesh, item.data.name, materials, default,
                               baked.uvs if baked is not None else None)
        except MeshError as error:
            return error
        index = self._unique(data)
        if has_turned_normals(mesh, data):
            self._turned.setdefault(index, item.original.name)
        return index

    def _unique(self, data: MeshData) -> int:
        """Returns the index in SceneData.meshes of a mesh. A mesh with equal content, such as a
        copy that an earlier bake made, is added once."""
        meshes = self.result.scene.meshes
        alike = self._alike.setdefault(data.key(), [])
        for index in alike:
            if meshes[index].equals(data):
                return index
        alike.append(len(meshes))
        meshes.append(data)
        return alike[-1]

    def _corner_map(self, original: bpy.types.Object, evaluated: bpy.types.Mesh,
                    data: MeshData) -> CornerMap:
        mesh = original.data
        if not original.modifiers and data.counts == (len(mesh.vertices), len(mesh.loops),
                                                      len(mesh.polygons)):
            return CornerMap(len(mesh.loops))
        corner_map = build_corner_map(mesh, evaluated)
        if self.to_copies:
            return corner_map
        if corner_map.untraced:
            self._untraced.append(original.name)
        if corner_map.copied:
            self._copied.append(original.name)
        return corner_map
