# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds a damaged file of the native library before it is loaded.

The system maps a library into memory. If the file ends before the parts that its header lists, the
process ends when it reads them, and Python cannot prevent it. The zip of the add-on contains the
SHA-256 of the library in a second file, FILE.sha256, in the format of sha256sum. A library that was
built in place has no such file. Then only its length is compared with its header.
"""

from __future__ import annotations

import hashlib
import struct
from pathlib import Path

from .messages import Message

# Header of a 64-bit ELF file in little-endian order: magic number and class, offsets of the tables
# of segments and of sections, size and number of the entries of each.
_ELF_HEADER = struct.Struct('<5s 27x QQ 6x HHHH 2x')
_ELF_MAGIC = b'\x7fELF\x02'
# Entry of the table of segments: offset in the file, and size there.
_ELF_SEGMENT = struct.Struct('<8x Q 16x Q 16x')


def damage(path: Path) -> Message | None:
    """Returns what is wrong with the file of a library, as a part of a sentence, or None if nothing
    was found. path: an existing file. Raises OSError if it cannot be read."""
    content = path.read_bytes()
    hash_file = path.with_name(path.name + ".sha256")
    if hash_file.exists():
        stated = hash_file.read_bytes()[:64].decode(errors='replace')
        if hashlib.sha256(content).hexdigest() != stated:
            return Message("its SHA-256 is not the one in {file}", file=hash_file.name)
    elif len(content) < (needed := _elf_length(content)):
        return Message("it has {count} bytes instead of {needed}", count=len(content),
                       needed=needed)
    return None


def _elf_length(content: bytes) -> int:
    """Returns the number of bytes that an ELF file needs according to its header, or 0 if the
    header cannot be read, which the system reports when it loads the file."""
    if len(content) < _ELF_HEADER.size:
        return 0
    (magic, segments, sections, segment_size, segment_count, section_size,
     section_count) = _ELF_HEADER.unpack_from(content)
    if magic != _ELF_MAGIC or segment_size < _ELF_SEGMENT.size:
        return 0
    length = max(segments + segment_size * segment_count, sections + section_size * section_count)
    if len(content) < length:
        return length
    for index in range(segment_count):
        offset, size = _ELF_SEGMENT.unpack_from(content, segments + segment_size * index)
        length = max(length, offset + size)
    return length
