# SPDX-License-Identifier: GPL-3.0-or-later
"""The surfaces that the last bake used for each object's material slots, stored in the .blend file.

A material that shows only the result of a bake (shown_results.py) contains neither the colour nor
the emission of its surface. The next bake therefore uses the same surface as the last one. The
scene stores a table of surfaces by digest, and each object the digests of its slots.
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
    """The surfaces of a material that a bake used."""

    material: str  # name of the material
    sides: tuple[Surface, Surface]  # front and back


class LastSurfaces:
    """The stored surfaces of a scene: those of the last bake, and those of the current bake, by
    which write() replaces them."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        """Reads the surfaces that an earlier bake has stored in the scene. scene: original
        data-block."""
        self._scene = scene
        self._table: dict[str, dict] = {}
        self._attributes: set[str] = set()
        try:
            stored = json.loads(scene.raybundle.last_surfaces or "{}")
            self._table = dict(stored.get('surfaces', {}))
            self._attributes = set(stored.get('attributes', ()))
        except (ValueError, TypeError, AttributeError):
            # The property has other content: continue as if there had been no bake.
            pass
        self._taken: dict[bpy.types.Object, str] = {}
        self._new: dict[str, dict] = {}
        # Digests by id() of the surface and name of the render colour attribute. The surface is
        # stored too, so that its id() is not reused.
        self._digests: dict[tuple, tuple[LastSurface, str]] = {}

    @property
    def attributes(self) -> frozenset[str]:
        """Returns the names of the attributes that bakes have written to and that Clear has not
        removed."""
        return frozenset(self._attributes)

    def digest(self, item: bpy.types.Object, slot: int) -> str | None:
        """Returns the digest of the surface that the last bake used for a slot of an original
        object. Returns None if no surface is stored."""
        digests = item.raybundle.last_surfaces.split()
        digest = digests[slot] if slot < len(digests) else _NONE
        return digest if digest in self._table else None

    def surface(self, digest: str | None) -> LastSurface | None:
        """Returns the stored surface of a digest. Returns None if no readable surface is stored."""
        if digest not in self._table:
            return None
        try:
            stored = self._table[digest]
            return LastSurface(stored['material'],
                               tuple(_decoded(side, Surface()) for side in stored['sides']))
        except (KeyError, ValueError, TypeError):
            # Another version of the add-on has stored the surface.
            return None

    def digest_of(self, surface: LastSurface | None, mesh: bpy.types.Mesh) -> str:
        """Returns the digest of a surface that the current bake uses on a mesh, and keeps the
        surface for write()."""
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
        """Keeps the digests of all slots of an original object for write()."""
        if item.library is None:
            self._taken[item] = " ".join(digests)

    def share(self, original: bpy.types.Object, copy: bpy.types.Object) -> None:
        """Keeps the digests of the original for a copy (finer_copy.py), which has the same
        slots."""
        if original in self._taken:
            self._taken[copy] = self._taken[original]

    def forget_attributes(self) -> None:
        """Removes the names of all baked attributes, after the attributes were removed. The
        surfaces are kept, because materials may still read the removed attributes."""
        self._attributes.clear()
        self.write(())

    def write(self, attributes: Iterable[str]) -> None:
        """Stores the surfaces of the current bake in the file. attributes: names of the attributes
        that the bake has written to."""
        used: set[str] = set()
        for item, digests in self._taken.items():
            used.update(digests.split())
            try:
                if item.raybundle.last_surfaces != digests:
                    item.raybundle.last_surfaces = digests
            except ReferenceError:
                # The object was removed while the bake ran.
                continue
        # Objects that were not part of this bake keep their surfaces.
        used.update(digest for item in self._scene.objects
                    for digest in item.raybundle.last_surfaces.split())
        table = {digest: stored for digest, stored in {**self._table, **self._new}.items()
                 if digest in used}
        text = json.dumps({'attributes': sorted(self._attributes.union(attributes)),
                           'surfaces': table})
        if self._scene.raybundle.last_surfaces != text:
            self._scene.raybundle.last_surfaces = text


# --------------------------------------------------------------------------------------------------
# JSON of surfaces. Arrays of zeros are stored as null, which keeps plain diffuse surfaces short.
# --------------------------------------------------------------------------------------------------


def _encoded(value: object, rendered: str | None) -> object:
    """Returns the JSON value of a surface or of a part of it. rendered: name of the mesh's render
    colour attribute. The surface is stored with this name because the bake makes its result the
    render colour attribute."""
    if isinstance(value, ColorExpression) and value.attribute == "":
        value = replace(value, attribute=rendered)
        if rendered is None:
            # Without an attribute, nodes read black.
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
    """Returns the dataclass of a stored value. default: determines the type and the shapes of its
    arrays."""
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
