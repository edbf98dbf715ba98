# SPDX-License-Identifier: GPL-3.0-or-later
"""A damaged file of the native library ends in a message before it is loaded."""

import hashlib
from pathlib import Path

import bpy
import pytest
import raybundle
from raybundle import library_file, native

# Parts of the library that a copy holds: of the header, of the tables, of the code, all but a byte.
PARTS = (64, 100, 4096, 0.01, 0.3, 0.5, 0.9, 0.999, -1)


@pytest.fixture
def library(tmp_path) -> Path:
    """Returns a copy of the library without its SHA-256, as after a build."""
    path = tmp_path / native.library_path().name
    path.write_bytes(native.library_path().read_bytes())
    return path


def write_hash(library: Path, text: str | None = None) -> None:
    """Writes the file with the SHA-256 of the library, or with another text."""
    line = f"{hashlib.sha256(library.read_bytes()).hexdigest()}  {library.name}\n"
    library.with_name(f"{library.name}.sha256").write_text(line if text is None else text)


@pytest.mark.parametrize("platform, name", (("linux", "libraybundle.so"),
                                            ("win32", "raybundle.dll"),
                                            ("darwin", "libraybundle.dylib")))
def test_the_library_is_the_one_of_the_platform(monkeypatch, platform, name):
    monkeypatch.setattr(native.sys, "platform", platform)
    assert native.library_path().name == name


@pytest.mark.needs_library
def test_a_whole_library_is_not_damaged(library):
    assert library_file.damage(library) is None
    write_hash(library)
    assert library_file.damage(library) is None


@pytest.mark.needs_library
@pytest.mark.parametrize("has_hash", (False, True))
@pytest.mark.parametrize("part", PARTS)
def test_a_truncated_library_is_damaged(library, part, has_hash):
    content = library.read_bytes()
    if has_hash:
        write_hash(library)
    end = int(part * len(content)) if isinstance(part, float) else part
    library.write_bytes(content[:end])
    assert "SHA-256" in library_file.damage(library) if has_hash else (
        f"{len(content[:end])} bytes instead of" in library_file.damage(library))


@pytest.mark.needs_library
@pytest.mark.parametrize("share", (0.0, 0.001, 0.5, 0.9999))
def test_a_library_with_a_changed_bit_is_damaged(library, share):
    write_hash(library)
    content = bytearray(library.read_bytes())
    content[int(share * len(content))] ^= 1
    library.write_bytes(content)
    assert "SHA-256" in library_file.damage(library)


@pytest.mark.needs_library
@pytest.mark.parametrize("text", ("", "\n", "no hash", "\0"))
def test_a_library_with_an_unreadable_hash_is_damaged(library, text):
    write_hash(library, text)
    assert "SHA-256" in library_file.damage(library)


@pytest.mark.needs_library
def test_a_damaged_library_ends_in_a_message(closed_box, library, monkeypatch):
    library.write_bytes(library.read_bytes()[:-5000])
    monkeypatch.setattr(native, "_library", None)
    monkeypatch.setattr(native, "library_path", lambda: library)
    with pytest.raises(raybundle.RaybundleError, match="is damaged.*Install the add-on again"):
        raybundle.bake(bpy.context)
    with pytest.raises(RuntimeError, match="is damaged"):
        bpy.ops.raybundle.bake()
    assert len(closed_box.data.color_attributes) == 0


@pytest.mark.parametrize("content", (b"", b"\x7fELF\x02", b"not a library" * 100))
def test_a_file_that_is_no_library_is_refused(closed_box, tmp_path, monkeypatch, content):
    path = tmp_path / "libraybundle.so"
    path.write_bytes(content)
    monkeypatch.setattr(native, "_library", None)
    monkeypatch.setattr(native, "library_path", lambda: path)
    with pytest.raises(raybundle.RaybundleError, match="cannot be loaded"):
        raybundle.bake(bpy.context)
