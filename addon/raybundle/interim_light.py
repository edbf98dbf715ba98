# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows the light so far in the colour attributes while a bake runs, and puts back what the
attributes held before if the bake is cancelled."""

from __future__ import annotations

import bpy

from . import color_attribute, native
from .bake import PreparedBake, at_elements, exposed


class InterimLight:
    """The interim light of a bake in the colour attributes of its targets."""

    def __init__(self, prepared: PreparedBake) -> None:
        self._prepared = prepared
        self._kept: dict[bpy.types.Mesh, color_attribute.KeptAttribute] = {}

    @property
    def is_shown(self) -> bool:
        return bool(self._kept)

    def show(self, run: native.Run) -> None:
        """Writes the interim light of a run, which must have made some, to the targets. Leaves out
        meshes that cannot be written now. Of targets that share a mesh, the first is shown."""
        settings, export = self._prepared.settings, self._prepared.export
        written: set[bpy.types.Mesh] = set()
        for target in export.targets:
            mesh = target.unchanged_mesh()
            if mesh is None or mesh.library is not None or mesh in written:
                continue
            written.add(mesh)
            exported = export.scene.meshes[export.scene.instances[target.instance].mesh]
            light = run.light(target.instance, settings.output, exported.corner_count)
            finer = self._prepared.finer.get(target.instance)
            if finer is not None:
                light = finer.at_source(light)
            light = at_elements(light, target.corner_map, mesh, settings.domain)
            if mesh not in self._kept:
                self._kept[mesh] = color_attribute.KeptAttribute.of(mesh, settings.attribute)
            color_attribute.write_light(mesh, settings.attribute, settings.data_type,
                                        settings.domain, exposed(light, settings))

    def put_back(self) -> None:
        """Gives all meshes what they had before the bake. Leaves out meshes that were removed, are
        in Edit Mode or have changed their size."""
        for target in self._prepared.export.targets:
            mesh = target.unchanged_mesh()
            kept = self._kept.pop(mesh, None) if mesh is not None else None
            if kept is not None:
                kept.put_back(mesh)
        self._kept.clear()
