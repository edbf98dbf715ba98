# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake in stages: check, export, native scene, execution, results, writing, report.

The user's data is changed only after the native library has computed all of the light.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field, replace

import bpy
import numpy as np

from . import bake_cache, color_attribute, native
from .bake_report import BakeError, BakeReport, ObjectReport
from .corner_map import CornerMap, grouped_mean
from .finer_copy import create_copies, find_copies, originals_shown
from .finer_mesh import FinerMesh, adapted, subdivide
from .light_sets import LightSet, read_light_sets
from .mesh_arrays import corner_vertices
from .messages import Message, quoted
from .native import ErrorCode, Progress, RaybundleError
from .native_scene import build_native_scene, replace_lights
from .properties import BakeSettings, read_settings
from .quality import OBJECT_FACTORS, full_bake
from .scene_data import MeshData
from .scene_export import BakeTarget, SceneExport, export_lamps_again, export_scene
from .simplified_mesh import Simplifier
from .warning_lines import listed


@dataclass(frozen=True)
class TargetLight:
    """The light that will be written to an object."""

    target: BakeTarget
    # (n, 3), for n corners or vertices (settings.domain), in the unit of settings.output
    light: np.ndarray
    error: np.ndarray | None  # (n,), the stated error; None: not written
    # the finer mesh that receives the light; None: the object's own mesh
    finer: FinerMesh | None
    # The light of each light set, (n, 3), by name of the attribute.
    set_lights: dict[str, np.ndarray] = field(default_factory=dict)


@dataclass
class PreparedBake:
    """A bake whose scene has been exported, ready for the native library."""

    scene: bpy.types.Scene
    settings: BakeSettings
    light_sets: list[LightSet]
    export: SceneExport
    # The finer mesh of each target, by the target's position in SceneData.instances. Those of the
    # topology 'ADAPTIVE' are known only when the bake has run.
    finer: dict[int, FinerMesh]
    started: float  # time.perf_counter() at the beginning
    native_bake: native.Bake | None = None
    native_scene: native.Scene | None = None  # the owner of this object closes it
    export_seconds: float = 0.0


def bake(context: bpy.types.Context, progress: Progress | None = None,
         **overrides: object) -> BakeReport:
    """Bakes the context's scene into colour attributes of its meshes, and returns the report.

    progress(stage, fraction), with a fraction from 0 to 1, may return False to cancel. overrides:
    values of settings of scene.raybundle that apply only to this bake (seed=1, ...). Raises
    BakeError, with a message for the user, for settings or scenes that cannot be baked. Raises
    RaybundleError if the native library is missing or fails; its code is CANCELLED after a cancel.
    """
    report_progress = _checked_progress(progress)
    native.load()
    # Call the function before anything is read, because it may change the file.
    report_progress('export', 0.0)
    with object_mode(context):
        prepared = prepare(context, overrides)
        with prepared.native_scene:
            prepared.native_bake.execute(prepared.native_scene, report_progress)
        report_progress('write_back', 0.0)
        return write_results(context, prepared)


def prepare(context: bpy.types.Context, overrides: dict[str, object], is_draft: bool = False
            ) -> PreparedBake:
    """Exports the context's scene, in Object Mode. is_draft: the library's setting `draft`. A draft
    of adapted or simplified meshes keeps those that there are. overrides, and errors: as in
    bake()."""
    started = time.perf_counter()
    scene = context.scene
    settings = _read_settings(scene, overrides)
    if (is_draft and (settings.topology == 'ADAPTIVE' or settings.simplify)
            and find_copies(scene)):
        settings = replace(settings, topology='KEEP', simplify=False)
    light_sets = read_light_sets(scene, settings.attribute)
    _check(scene, settings, light_sets)
    export, finer = _export(context, settings, light_sets)
    return _ready(PreparedBake(scene, settings, light_sets, export, finer, started), is_draft)


def prepare_lamps(context: bpy.types.Context, overrides: dict[str, object], is_draft: bool,
                  last: PreparedBake) -> PreparedBake | None:
    """Does what prepare() does, for a scene in which nothing but lamps has changed since `last` was
    prepared, in a fraction of the time. Returns None if that is not possible. Errors: as in
    bake()."""
    started = time.perf_counter()
    settings = _read_settings(context.scene, overrides)
    # No export depends on these settings.
    same = replace(last.settings, target_error=settings.target_error,
                   max_bundles=settings.max_bundles)
    if (last.scene != context.scene or same != settings
            or read_light_sets(context.scene, settings.attribute) != last.light_sets):
        return None
    export = export_lamps_again(context, last.export)
    if export is None:
        return None
    return _ready(replace(last, settings=settings, export=export, started=started), is_draft)


def _read_settings(scene: bpy.types.Scene, overrides: dict[str, object]) -> BakeSettings:
    try:
        return read_settings(scene, overrides)
    except ValueError as error:
        raise BakeError(str(error)) from error


def _ready(prepared: PreparedBake, is_draft: bool) -> PreparedBake:
    """Adds to a bake whose scene is exported what the native library needs. A native scene that the
    bake has already, and that is open, may differ from the exported scene only in its lights."""
    prepared.native_bake = bake_cache.get_or_create(prepared.scene)
    if prepared.native_scene is None or prepared.native_scene.is_closed:
        prepared.native_scene = build_native_scene(prepared.export.scene)
    else:
        replace_lights(prepared.native_scene, prepared.export.scene)
    prepared.export_seconds = time.perf_counter() - prepared.started
    try:
        _apply_settings(prepared.native_bake, prepared.settings)
        prepared.native_bake.set('draft', is_draft)
        if is_draft:
            prepared.native_bake.set('count_adaptive', False)
    except BaseException:
        prepared.native_scene.close()
        raise
    return prepared


def write_results(context: bpy.types.Context, prepared: PreparedBake,
                  warnings: Sequence[str] = ()) -> BakeReport:
    """Writes the light of an executed bake to the meshes, in Object Mode, and returns the report.
    warnings: further warnings for the report. Raises BakeError, before anything is written, if a
    target has changed since prepare()."""
    write_started = time.perf_counter()
    native_bake, export = prepared.native_bake, prepared.export
    _check_unchanged(prepared.scene, export, native_bake)
    lights = _read_results(prepared)
    native_report = native_bake.report()
    objects, change = _write(context, lights, prepared.settings, export, native_report)
    report = BakeReport.from_native(native_report)
    report.error = _with_change(report.error, change)
    for entry, light_set in zip(report.light_sets, prepared.light_sets):
        entry['attribute'] = light_set.attribute
    report.vertices = _vertex_counts(lights, objects)
    report.objects = objects + [ObjectReport(name, 0, status)
                                for name, status in export.statuses.items()]
    # The library's warnings come first, because one of lost or created light is the first of them
    # and has to be read before all others.
    report.add_warnings([*warnings, *export.warnings])
    finished = time.perf_counter()
    report.seconds.update(export=prepared.export_seconds, write_back=finished - write_started,
                          total=finished - prepared.started)
    report.full_bake = full_bake(report, prepared.settings.target_error,
                                 prepared.scene.raybundle.report)
    prepared.scene.raybundle.report = report.to_json()
    return report


def _checked_progress(progress: Progress | None) -> Progress:
    def report(stage: str, fraction: float) -> None:
        if progress is not None and progress(stage, fraction) is False:
            raise RaybundleError(ErrorCode.CANCELLED, Message("The bake was cancelled"))
    return report


# --------------------------------------------------------------------------------------------------
# Check
# --------------------------------------------------------------------------------------------------


@contextmanager
def object_mode(context: bpy.types.Context) -> Iterator[None]:
    """Switches to Object Mode in the with block, because meshes in Edit Mode can be neither
    evaluated nor written."""
    was_editing = context.mode.startswith('EDIT')
    if was_editing and bpy.ops.object.mode_set.poll():
        bpy.ops.object.mode_set(mode='OBJECT')
    try:
        yield
    finally:
        if was_editing and context.mode == 'OBJECT' and bpy.ops.object.mode_set.poll():
            bpy.ops.object.mode_set(mode='EDIT')


def _check(scene: bpy.types.Scene, settings: BakeSettings, light_sets: list[LightSet]) -> None:
    """Raises BakeError if the attributes of the settings and of the light sets cannot be
    written."""
    if not settings.attribute:
        raise BakeError(Message("The colour attribute has no name: enter one in the panel Output"))
    longest = settings.attribute
    if settings.write_error:
        longest = color_attribute.error_name(longest)
    if len(longest.encode()) > color_attribute.MOST_BYTES:
        raise BakeError(Message("The attribute name {name} is longer than {count} bytes: choose a "
                                "shorter one", name=quoted(longest),
                                count=color_attribute.MOST_BYTES))
    for item in scene.objects:
        if item.type != 'MESH' or item.raybundle.role != 'BAKE':
            continue
        if item.data.is_editmode:
            raise BakeError(Message("{name} is in Edit Mode: leave Edit Mode before you bake",
                                    name=quoted(item.name)))
        for name in (settings.attribute, *(light_set.attribute for light_set in light_sets)):
            if not color_attribute.name_is_free(item.data, name):
                raise BakeError(Message(
                    "{object} already has an attribute or UV map {name} that is not a colour "
                    "attribute: choose another attribute name", object=quoted(item.name),
                    name=quoted(name)))


# --------------------------------------------------------------------------------------------------
# Export
# --------------------------------------------------------------------------------------------------


def _export(context: bpy.types.Context, settings: BakeSettings, light_sets: list[LightSet]
            ) -> tuple[SceneExport, dict[int, FinerMesh]]:
    """Exports the scene. For topology 'SUBDIVIDE' also returns the finer mesh of each target, by
    the target's position in SceneData.instances. Raises BakeError if there is nothing to bake."""
    selected = None
    if settings.scope == 'SELECTED':
        selected = {item for item in context.scene.objects if item.select_get()}
        if writes_copies(settings):
            # A selected copy counts as a selection of its original.
            selected |= {original for original, copy in find_copies(context.scene).items()
                         if copy in selected}
    with originals_shown(context.scene) if writes_copies(settings) else nullcontext():
        export = export_scene(context, selected, light_sets, settings.patch_size,
                              settings.attribute, writes_copies(settings))
    _leave_out_unwritable(export, settings)
    if not export.targets:
        raise BakeError(_nothing_to_bake(settings, export))
    if settings.topology == 'SUBDIVIDE':
        return export, _refine(export, settings)
    if not writes_copies(settings):
        _want_written_corners(export)
    return export, {}


def writes_copies(settings: BakeSettings) -> bool:
    """Returns whether the light is written to copies of the objects with other meshes."""
    return settings.topology != 'KEEP' or settings.simplify


def _nothing_to_bake(settings: BakeSettings, export: SceneExport) -> Message:
    what = Message("Nothing to bake: there is no selected mesh object with faces and the role Bake"
                   if settings.scope == 'SELECTED' else
                   "Nothing to bake: there is no visible mesh object with faces and the role Bake")
    if not export.statuses:
        return what
    reasons = [Message("{name}: {reason}", name=quoted(name), reason=status)
               for name, status in export.statuses.items()]
    return Message("{what} ({reasons})", what=what,
                   reasons=listed(reasons, len(reasons), separator="; "))


def _leave_out_unwritable(export: SceneExport, settings: BakeSettings) -> None:
    """Removes targets that cannot be written because their data belongs to another file. These
    objects still reflect and block light."""
    writable = []
    for target in export.targets:
        # A finer copy has its own mesh, but is placed in the collections of its original object.
        owner = target.object if writes_copies(settings) else target.object.data
        if owner.library is None and owner.override_library is None:
            writable.append(target)
            continue
        status = (Message("linked from {file} and gets no colours: make it local",
                          file=owner.library.filepath) if owner.library else
                  Message("a library override and gets no colours: make it local"))
        export.statuses[target.object.name] = status
        export.warnings.add(Message("{name} is {what}", name=quoted(target.object.name),
                                    what=status))
        instances = export.scene.instances
        instances[target.instance] = replace(instances[target.instance], role='OCCLUDE')
    export.targets[:] = writable


def _refine(export: SceneExport, settings: BakeSettings) -> dict[int, FinerMesh]:
    """Replaces the mesh of each target by a finer mesh. Returns the finer meshes by position of the
    instance in SceneData.instances."""
    scene = export.scene
    patch_size = settings.patch_size or scene.diagonal() / 64.0
    result = {}
    for target in export.targets:
        instance = scene.instances[target.instance]
        factor = OBJECT_FACTORS[instance.quality].patch_size
        mesh = subdivide(scene.meshes[instance.mesh], instance.transform,
                         2.0 * factor * patch_size)
        scene.meshes.append(mesh.data)
        scene.instances[target.instance] = replace(instance, mesh=len(scene.meshes) - 1)
        result[target.instance] = mesh
    return result


def _want_written_corners(export: SceneExport) -> None:
    """Limits the results of meshes that modifiers have changed to the corners whose light is
    written."""
    instances = export.scene.instances
    for target in export.targets:
        if not target.corner_map.is_identity:
            instances[target.instance] = replace(
                instances[target.instance], result_corners=np.unique(target.corner_map.evaluated))


def _apply_settings(native_bake: native.Bake, settings: BakeSettings) -> None:
    for name in native.settings():
        section, _, skip = name.partition(".")
        if section == "skip":
            native_bake.set(name, skip not in settings.skips_off)
        elif name == 'adapt_meshes':
            native_bake.set(name, settings.topology == 'ADAPTIVE')
        elif name == 'discontinuity_lines':
            # A vertex has one value in the domain POINT: that of both sides of the line.
            native_bake.set(name, settings.discontinuity_lines and settings.domain == 'CORNER')
        elif hasattr(settings, name):
            native_bake.set(name, getattr(settings, name))


def _check_unchanged(scene: bpy.types.Scene, export: SceneExport, native_bake: native.Bake) -> None:
    """Raises BakeError if a target or the bake has changed since the export. The progress function
    may have undone a step, opened a file or edited a mesh."""
    try:
        is_scene = bool(scene.name)
    except ReferenceError:
        is_scene = False
    for target in export.targets:
        if not is_scene or target.unchanged_mesh() is None:
            raise BakeError(Message("{name} was removed or changed during the bake: nothing was "
                                    "written, bake again", name=quoted(target.name)))
    if native_bake.is_closed:
        raise BakeError(Message("The bake was cleared while it was running: nothing was written"))


# --------------------------------------------------------------------------------------------------
# Results
# --------------------------------------------------------------------------------------------------


def _read_results(prepared: PreparedBake) -> list[TargetLight]:
    """Returns the light of each target, at the corners or vertices of the mesh that receives it."""
    native_bake, export, settings = prepared.native_bake, prepared.export, prepared.settings
    results = []
    for target in export.targets:
        mesh = export.scene.meshes[export.scene.instances[target.instance].mesh]
        finer = prepared.finer.get(target.instance)
        if settings.topology == 'ADAPTIVE':
            finer = adapted(mesh, native_bake.adapted_mesh(target.instance))
            mesh = finer.data
        elif settings.simplify and finer is None:
            finer = FinerMesh.of(mesh)
        corner_map = target.corner_map if finer is None else CornerMap(mesh.corner_count)

        def read_light(light_set: int | None = None) -> np.ndarray:
            if settings.domain == 'POINT' and corner_map.is_identity:
                return native_bake.vertex_light(target.instance, settings.output,
                                                len(mesh.vertices), light_set)
            return at_elements(
                native_bake.corner_light(target.instance, settings.output, mesh.corner_count,
                                         light_set),
                corner_map, target.object.data, settings.domain)

        error = None
        if settings.write_error:
            error = _read_error(native_bake, target, mesh, corner_map, settings.domain)
        results.append(TargetLight(target, read_light(), error, finer, {
            light_set.attribute: read_light(index)
            for index, light_set in enumerate(prepared.light_sets)}))
    return results


def at_elements(light: np.ndarray, corner_map: CornerMap, original: bpy.types.Mesh, domain: str
                ) -> np.ndarray:
    """Converts light at the corners of an exported mesh, (c, 3), to light at the corners or
    vertices (domain) of the original mesh, (n, 3)."""
    light = corner_map.to_original(light)
    if domain == 'POINT':
        light = grouped_mean(light, corner_vertices(original), len(original.vertices))
    return light


def _read_error(native_bake: native.Bake, target: BakeTarget, mesh: MeshData,
                corner_map: CornerMap, domain: str) -> np.ndarray:
    """Returns the stated error at corners or vertices, (n,). domain: 'CORNER' or 'POINT'. If
    several evaluated corners belong to one element, the result is their root mean square."""
    error = native_bake.corner_error(target.instance, mesh.corner_count)
    squares = corner_map.to_original(np.repeat(error[:, None] ** 2, 3, axis=1))
    if domain == 'POINT' and corner_map.is_identity:
        squares = grouped_mean(squares, mesh.corner_vertices, len(mesh.vertices))
    elif domain == 'POINT':
        original = target.object.data
        squares = grouped_mean(squares, corner_vertices(original), len(original.vertices))
    return np.sqrt(squares[:, 0])


# --------------------------------------------------------------------------------------------------
# Write
# --------------------------------------------------------------------------------------------------


def _write(context: bpy.types.Context, lights: list[TargetLight], settings: BakeSettings,
           export: SceneExport, native_report: dict) -> tuple[list[ObjectReport], float]:
    """Writes the light to the targets, or to their finer copies. Returns a report for each target,
    and what simplifying the copies has changed, relative to the light."""
    copies: dict[bpy.types.Object, bpy.types.Object] = {}
    simplifier = _simplifier(lights, settings) if settings.simplify else None
    if writes_copies(settings):
        copies, warnings = create_copies(
            context, {item.target.object: item.finer for item in lights},
            simplifier and simplifier.simplify)
        for warning in warnings:
            export.warnings.add(warning)
        if simplifier is not None:
            lights = [_left(item, simplifier, settings.domain) for item in lights]
    else:
        lights = _resolve_shared_meshes(lights, settings, export)
    lights = [replace(item, light=exposed(item.light, settings)) for item in lights]
    reports = []
    for item in lights:
        receiver = copies.get(item.target.object, item.target.object)
        # Each written attribute becomes the active one: write the light of all lights last.
        for name, light in {**item.set_lights, settings.attribute: item.light}.items():
            color_attribute.write_light(receiver.data, name, settings.data_type, settings.domain,
                                        light)
        if item.error is None:
            color_attribute.clear_error(receiver.data, settings.attribute)
        else:
            color_attribute.write_error(receiver.data, settings.attribute, settings.domain,
                                        item.error)
        # The native library lists its objects by instance.
        own = native_report['objects'][item.target.instance]
        reports.append(ObjectReport(
            receiver.name, len(receiver.data.loops), own['status'],
            _with_change(own['error'],
                         simplifier.changes[item.target.object] if simplifier else 0.0),
            len(receiver.data.vertices), own['adaptive_vertices']))
    for original, copy in copies.items():
        export.last.share(original, copy)
    names = {settings.attribute, *(name for item in lights for name in item.set_lights)}
    export.last.write(names)
    _warn_of_clipping(lights, settings, export)
    return reports, simplifier.change() if simplifier else 0.0


def _simplifier(lights: list[TargetLight], settings: BakeSettings) -> Simplifier:
    light = {}
    for item in lights:
        together = np.concatenate([item.light, *item.set_lights.values()], axis=1)
        light[item.target.object] = (together if settings.domain == 'CORNER'
                                     else together[item.finer.data.corner_vertices])
    return Simplifier(settings.target_error, light)


def _left(item: TargetLight, simplifier: Simplifier, domain: str) -> TargetLight:
    """Returns what is left of the light of a target whose mesh was simplified."""
    original = item.target.object
    return replace(
        item, light=simplifier.left(original, item.light, domain),
        error=None if item.error is None else simplifier.left(original, item.error, domain),
        set_lights={name: simplifier.left(original, light, domain)
                    for name, light in item.set_lights.items()})


def _with_change(error: dict[str, float], change: float) -> dict[str, float]:
    """Returns the parts of a stated error, with what simplifying the mesh has changed."""
    return {**error, **{name: math.hypot(error[name], change) for name in ('mesh', 'total')}}


def _vertex_counts(lights: list[TargetLight], objects: list[ObjectReport]) -> dict[str, int]:
    """Returns BakeReport.vertices."""
    copied = [item for item in lights if item.finer is not None]
    if not copied:
        return {}
    return {'before': sum(item.finer.source_vertex_count for item in copied),
            'after': sum(item.vertices for item in objects)}


def exposed(light: np.ndarray, settings: BakeSettings) -> np.ndarray:
    """Returns light with the settings' exposure and clamping applied."""
    light = light * np.float32(2.0 ** settings.exposure)
    return np.clip(light, 0.0, 1.0) if settings.clamp else light


def _resolve_shared_meshes(lights: list[TargetLight], settings: BakeSettings,
                           export: SceneExport) -> list[TargetLight]:
    """Resolves meshes that several targets share. A mesh can only show one light, so either each
    target gets a copy of the mesh, or the mesh gets the mean light of its targets."""
    groups: dict[bpy.types.Mesh, list[TargetLight]] = {}
    for item in lights:
        groups.setdefault(item.target.object.data, []).append(item)
    resolved = []
    for mesh, group in groups.items():
        if len(group) > 1 and settings.shared_meshes == 'AVERAGE':
            mean = np.mean([item.light for item in group], axis=0)
            set_means = {name: np.mean([item.set_lights[name] for item in group], axis=0)
                         for name in group[0].set_lights}
            # Use the largest error. The actual error of the mean may be smaller if errors have
            # different signs.
            error = None if group[0].error is None else np.max([item.error for item in group], 0)
            group = [replace(item, light=mean, error=error, set_lights=set_means)
                     for item in group]
            export.warnings.add(Message("mesh {name} shows the mean light of the {count} objects "
                                        "that share it", name=quoted(mesh.name),
                                        count=len(group)))
        elif len(group) > 1:
            for item in group[1:]:
                item.target.object.data = mesh.copy()
            export.warnings.add(Message(
                "mesh {name} was shared by {count} baked objects: each object now has its own "
                "mesh, with its own light", name=quoted(mesh.name), count=len(group)))
        resolved += group
    return resolved


def _warn_of_clipping(lights: list[TargetLight], settings: BakeSettings, export: SceneExport
                      ) -> None:
    if settings.data_type != 'BYTE_COLOR':
        return
    for item in lights:
        clipped = np.count_nonzero((item.light > 1.0).any(axis=1)) / max(len(item.light), 1)
        if clipped:
            export.warnings.add(Message(
                "{name}: {percent} % of its values are brighter than 1 and were cut off: choose "
                "the data type Color to keep them, or lower the exposure",
                name=quoted(item.target.object.name), percent=f"{100.0 * clipped:.3g}"))
