# SPDX-License-Identifier: GPL-3.0-or-later
"""The surfaces that the last bake used for each object's material slots, kept in the .blend file.

A material that shows nothing but the result of a bake (shown_results.py) tells neither the colour
nor the emission of its surface: the next bake uses the same surface as the last one. The scene has
a table of surfaces by digest, and each object the digests of its slots.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace

import bpy
import numpy as np

from ..color_attribute import rendered_attribute
from .color_expression import ColorExpression, Texture
from .surface import Surface

# The digest of a slot whose surface is not known.
_NONE = "-"


@dataclass(frozen=True)
class LastSurface:
    """A material as a bake used it."""

    material: str  # name
    sides: tuple[Surface, Surface]  # front and back


class LastSurfaces:
    """The surfaces of a scene: those that the last bake has kept, and those of the current bake,
    which write() puts in their place."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        """scene: original; what an earlier bake has stored in it is read."""
        self._scene = scene
        self._table: dict[str, dict] = {}
        self._attributes: set[str] = set()
        try:
            stored = json.loads(scene.raybundle.last_surfaces or "{}")
            self._table = dict(stored.get('surfaces', {}))
            self._attributes = set(stored.get('attributes', ()))
        except (ValueError, TypeError, AttributeError):
            # Somebody else wrote the property: go on as if there had been no bake.
            pass
        self._taken: dict[bpy.types.Object, str] = {}
        self._new: dict[str, dict] = {}
        # By the surface's id(), and with the surface, so that the id stays its own.
        self._digests: dict[tuple, tuple[LastSurface, str]] = {}

    @property
    def attributes(self) -> frozenset[str]:
        """Names of the attributes that bakes have written to and Clear has not removed."""
        return frozenset(self._attributes)

    def digest(self, item: bpy.types.Object, slot: int) -> str | None:
        """Digest of the surface that the last bake used for a slot of an original object; None if
        none is kept."""
        digests = item.raybundle.last_surfaces.split()
        digest = digests[slot] if slot < len(digests) else _NONE
        return digest if digest in self._table else None

    def surface(self, digest: str | None) -> LastSurface | None:
        """The kept surface of a digest; None if there is none that can be read."""
        if digest not in self._table:
            return None
        try:
            stored = self._table[digest]
            return LastSurface(stored['material'],
                               tuple(_decoded(side, Surface()) for side in stored['sides']))
        except (KeyError, ValueError, TypeError):
            # Another version of the add-on has stored it.
            return None

    def digest_of(self, surface: LastSurface | None, mesh: bpy.types.Mesh) -> str:
        """Digest of a surface that the current bake uses on a mesh; the surface is kept for it."""
        if surface is None:
            return _NONE
        attribute = rendered_attribute(mesh)
        rendered = attribute.name if attribute is not None else None
        key = (id(surface), rendered)
        if key not in self._digests:
            front, back = surface.sides
            sides = [_encoded(front, rendered)] * 2
            if back is not front:
                sides[1] = _encoded(back, rendered)
            stored = {'material': surface.material, 'sides': sides}
            text = json.dumps(stored, sort_keys=True)
            digest = hashlib.blake2b(text.encode(), digest_size=6).hexdigest()
            self._digests[key] = surface, digest
            self._new[digest] = stored
        return self._digests[key][1]

    def take(self, item: bpy.types.Object, digests: Sequence[str]) -> None:
        """Keeps the digests of all slots of an original object, for write()."""
        if item.library is None:
            self._taken[item] = " ".join(digests)

    def share(self, original: bpy.types.Object, copy: bpy.types.Object) -> None:
        """Keeps for a copy (subdivided_copy.py) what is kept for its original, which has the same
        slots."""
        if original in self._taken:
            self._taken[copy] = self._taken[original]

    def forget_attributes(self) -> None:
        """After the baked attributes were removed. The surfaces are kept, since materials may still
        read the attributes that are gone."""
        self._attributes.clear()
        self.write(())

    def write(self, attributes: Iterable[str]) -> None:
        """Stores the surfaces of the current bake in the file. attributes: names of those that the
        bake has written to."""
        used: set[str] = set()
        for item, digests in self._taken.items():
            used.update(digests.split())
            try:
                if item.raybundle.last_surfaces != digests:
                    item.raybundle.last_surfaces = digests
            except ReferenceError:
                # The object was removed while the bake ran.
                continue
        # Objects that took no part in this bake keep their surfaces.
        used.update(digest for item in self._scene.objects
                    for digest in item.raybundle.last_surfaces.split())
        table = {digest: stored for digest, stored in {**self._table, **self._new}.items()
                 if digest in used}
        text = json.dumps({'attributes': sorted(self._attributes.union(attributes)),
                           'surfaces': table})
        if self._scene.raybundle.last_surfaces != text:
            self._scene.raybundle.last_surfaces = text


# --------------------------------------------------------------------------------------------------
# JSON of surfaces: arrays of zeros are null, so that those of plain diffuse surfaces are short
# --------------------------------------------------------------------------------------------------


def _encoded(value: object, rendered: str | None) -> object:
    """The JSON value of a surface or of a part of it. rendered: name of the mesh's render colour
    attribute, which the surface is stored with since the bake makes its result that attribute."""
    if isinstance(value, ColorExpression) and value.attribute == "":
        value = replace(value, attribute=rendered)
        if rendered is None:
            # Without an attribute nodes read black.
            value = replace(value, attribute_weight=np.zeros(3))
    if isinstance(value, Texture):
        return {'image': value.image.name_full, 'extension': value.extension,
                'mean': value.mean.tolist(), 'uv_layer': value.uv_layer,
                'uv_matrix': value.uv_matrix.tolist()}
    if is_dataclass(value):
        return {item.name: _encoded(getattr(value, item.name), rendered)
                for item in fields(value) if item.name != 'result'}
    if isinstance(value, np.ndarray):
        return value.tolist() if value.any() else None
    return value


def _decoded(stored: dict, default: object) -> object:
    """The dataclass of a stored value; default: gives the type and the shapes of its arrays."""
    values = {}
    for item in fields(default):
        if item.name not in stored:
            continue
        value, usual = stored[item.name], getattr(default, item.name)
        if item.name == 'texture':
            value = value and _texture(value)
        elif isinstance(usual, np.ndarray):
            value = np.zeros(usual.shape) if value is None else np.array(value, float).reshape(
                usual.shape)
        elif is_dataclass(usual):
            value = _decoded(value, usual)
        values[item.name] = value
    decoded = replace(default, **values)
    if isinstance(decoded, ColorExpression) and decoded.texture and decoded.texture.image is None:
        # The image was removed from the file: use its mean.
        decoded = replace(decoded, constant=decoded.constant
                          + decoded.texture_weight * decoded.texture.mean,
                          texture=None, texture_weight=np.zeros(3))
    return decoded


def _texture(stored: dict) -> Texture:
    image = next((image for image in bpy.data.images if image.name_full == stored['image']), None)
    return Texture(image, stored['extension'], np.array(stored['mean'], float),
                   stored['uv_layer'], np.array(stored['uv_matrix'], float).reshape(2, 3))
