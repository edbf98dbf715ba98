# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads, changes and writes binary glTF 2.0 files (.glb): one JSON document and one buffer.

Source: Khronos, "glTF 2.0 Specification", sections 3.6 (accessors) and 4 (GLB).
"""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np

_MAGIC, _VERSION, _JSON, _BIN = b'glTF', 2, b'JSON', b'BIN\0'
_COMPONENTS = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32,
               5126: np.float32}
_TYPES = {'SCALAR': 1, 'VEC2': 2, 'VEC3': 3, 'VEC4': 4, 'MAT4': 16}


class GlbError(ValueError):
    """Raised for a file that is not a binary glTF 2.0 file with one buffer."""


class GlbFile:
    """The document and the buffer of a file. `document` is the JSON, which callers may change."""

    def __init__(self, document: dict, binary: bytes = b'') -> None:
        self.document = document
        self._binary = bytearray(binary)

    @classmethod
    def read(cls, path: Path) -> GlbFile:
        """Reads a file. Raises GlbError if it cannot be understood, and OSError."""
        data = path.read_bytes()
        try:
            magic, version, length = struct.unpack_from('<4sII', data)
            if (magic, version) != (_MAGIC, _VERSION):
                raise GlbError(f'"{path}" is not a binary glTF 2.0 file')
            chunks, position = {}, 12
            while position < length:
                size, kind = struct.unpack_from('<I4s', data, position)
                chunks[kind] = data[position + 8:position + 8 + size]
                position += 8 + size
            return cls(json.loads(chunks[_JSON]), chunks.get(_BIN, b''))
        except (struct.error, KeyError, UnicodeDecodeError, json.JSONDecodeError) as error:
            raise GlbError(f'"{path}" is damaged: {error}') from error

    def write(self, path: Path) -> None:
        """Writes the file, without accessors, images and parts of the buffer that nothing uses."""
        self._drop_unused()
        if self._binary:
            self.document['buffers'] = [{'byteLength': len(self._binary)}]
        text = json.dumps(self.document, separators=(',', ':'), ensure_ascii=False).encode()
        text += b' ' * (-len(text) % 4)
        binary = bytes(self._binary) + b'\0' * (-len(self._binary) % 4)
        chunks = struct.pack('<I4s', len(text), _JSON) + text
        if binary:
            chunks += struct.pack('<I4s', len(binary), _BIN) + binary
        path.write_bytes(struct.pack('<4sII', _MAGIC, _VERSION, 12 + len(chunks)) + chunks)

    def primitives(self) -> list[tuple[dict, dict]]:
        """Returns the primitives with their meshes, as parts of the document."""
        return [(mesh, primitive) for mesh in self.document.get('meshes', ())
                for primitive in mesh['primitives']]

    def values(self, index: int) -> np.ndarray:
        """Returns the values of an accessor as stored, (n,) or (n, components). Raises GlbError
        for sparse accessors and for accessors without data."""
        accessor = self.document['accessors'][index]
        if 'sparse' in accessor or 'bufferView' not in accessor:
            raise GlbError(f"accessor {index} has no plain data")
        view = self.document['bufferViews'][accessor['bufferView']]
        dtype = np.dtype(_COMPONENTS[accessor['componentType']]).newbyteorder('<')
        width, count = _TYPES[accessor['type']], accessor['count']
        start = view.get('byteOffset', 0) + accessor.get('byteOffset', 0)
        stride = view.get('byteStride', dtype.itemsize * width)
        values = np.ndarray((count, width), dtype, self._binary, start,
                            (stride, dtype.itemsize)).copy()
        return values if width > 1 else values[:, 0]

    def decoded(self, index: int) -> np.ndarray:
        """Returns the values of an accessor as numbers: those of normalised integers divided by
        the largest integer."""
        values = self.values(index)
        if not self.document['accessors'][index].get('normalized'):
            return values.astype(float)
        return values / float(np.iinfo(values.dtype).max)

    def add_accessor(self, values: np.ndarray, normalized: bool) -> int:
        """Adds the accessor of a vertex attribute, and returns its index. values: (n, components),
        of a type that glTF allows. A vertex must be a multiple of 4 bytes."""
        component = next(key for key, dtype in _COMPONENTS.items() if dtype == values.dtype)
        kind = next(key for key, width in _TYPES.items() if width == values.shape[1])
        self._binary += b'\0' * (-len(self._binary) % 4)
        data = np.ascontiguousarray(values).tobytes()
        views = self.document.setdefault('bufferViews', [])
        views.append({'buffer': 0, 'byteOffset': len(self._binary), 'byteLength': len(data),
                      'target': 34962})
        self._binary += data
        accessor = {'bufferView': len(views) - 1, 'componentType': component,
                    'count': len(values), 'type': kind}
        if normalized:
            accessor['normalized'] = True
        self.document['accessors'].append(accessor)
        return len(self.document['accessors']) - 1

    def _drop_unused(self) -> None:
        """Removes the accessors, images and parts of the buffer that nothing uses."""
        document = self.document
        _keep_used(document, 'accessors', _accessor_references(document))
        _keep_used(document, 'textures', _texture_references(document.get('materials', [])))
        _keep_used(document, 'images', [
            (holder, 'source') for texture in document.get('textures', ())
            for holder in (texture, *texture.get('extensions', {}).values()) if 'source' in holder])
        _keep_used(document, 'bufferViews', [
            (entry, 'bufferView')
            for entry in document.get('accessors', []) + document.get('images', [])
            if 'bufferView' in entry])
        packed = bytearray()
        for view in document.get('bufferViews', ()):
            start = view.get('byteOffset', 0)
            packed += b'\0' * (-len(packed) % 4)
            data = self._binary[start:start + view['byteLength']]
            view['byteOffset'] = len(packed)
            packed += data
        self._binary = packed


def _keep_used(document: dict, name: str, references: list[tuple[dict, str]]) -> None:
    """Removes the entries of a list of the document without a reference, and renumbers the
    references, which are dictionaries and keys."""
    kept = sorted({holder[key] for holder, key in references})
    numbers = {old: new for new, old in enumerate(kept)}
    for holder, key in references:
        holder[key] = numbers[holder[key]]
    entries = document.pop(name, [])
    if kept:
        document[name] = [entries[index] for index in kept]


def _texture_references(part: object) -> list[tuple[dict, str]]:
    """Returns the references to textures in a part of the materials."""
    if isinstance(part, list):
        return [reference for entry in part for reference in _texture_references(entry)]
    if not isinstance(part, dict):
        return []
    references = [(entry, 'index') for key, entry in part.items()
                  if key.endswith('Texture') and 'index' in entry]
    return references + _texture_references([entry for key, entry in part.items()
                                             if key != 'extras'])


def _accessor_references(document: dict) -> list[tuple[dict, str]]:
    """Returns all references to accessors, as dictionaries of the document and keys. Raises
    GlbError if extensions may have references that are not known here."""
    unknown = set(document.get('extensionsUsed', ())) & {
        'KHR_draco_mesh_compression', 'EXT_mesh_gpu_instancing', 'EXT_meshopt_compression'}
    if unknown:
        raise GlbError(f"files with {', '.join(sorted(unknown))} cannot be changed")
    references = []
    for mesh in document.get('meshes', ()):
        for primitive in mesh['primitives']:
            for attributes in (primitive['attributes'], *primitive.get('targets', ())):
                references += [(attributes, key) for key in attributes]
            if 'indices' in primitive:
                references.append((primitive, 'indices'))
    for skin in document.get('skins', ()):
        if 'inverseBindMatrices' in skin:
            references.append((skin, 'inverseBindMatrices'))
    for animation in document.get('animations', ()):
        references += [(sampler, key) for sampler in animation['samplers']
                       for key in ('input', 'output')]
    return references
