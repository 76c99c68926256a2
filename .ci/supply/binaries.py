"""Reads from the header of a binary for which processor it is, and which libraries it asks for.

ELF after the System V gABI (chapters 4 and 5), PE after Microsoft's "PE Format": only what is
asked here, 64-bit little-endian files alone.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

_PT_LOAD, _PT_DYNAMIC = 1, 2
_DT_NULL, _DT_NEEDED, _DT_STRTAB = 0, 1, 5
_PE32_PLUS = 0x20B
_IMPORTS = 1  #: number of the import table among a PE file's data directories
_DESCRIPTOR = 20  #: bytes of one import descriptor


@dataclass(frozen=True, slots=True)
class Binary:
    """Processor as the header numbers it, and the libraries that are loaded with it."""

    processor: int
    asks_for: tuple[str, ...]


def read_elf(file: Path) -> Binary | None:
    """A program or library of Linux, or None for another file.

    Raises:
        ValueError: it is one, but not 64-bit little-endian.
    """
    with file.open("rb") as opened:
        if opened.read(4) != b"\x7fELF":
            return None
    data = file.read_bytes()
    if data[4:6] != b"\x02\x01":
        raise ValueError(f"{file}: not a 64-bit little-endian ELF file")
    (processor,) = struct.unpack_from("<H", data, 18)
    (headers,) = struct.unpack_from("<Q", data, 32)
    size, count = struct.unpack_from("<HH", data, 54)
    loaded, dynamic = [], b""
    for number in range(count):
        kind, _, offset, address, _, length = struct.unpack_from(
            "<IIQQQQ", data, headers + number * size
        )
        if kind == _PT_LOAD:
            loaded.append((address, length, offset))
        elif kind == _PT_DYNAMIC:
            dynamic = data[offset : offset + length // 16 * 16]
    entries = list(struct.iter_unpack("<qQ", dynamic))
    return Binary(processor, _needed(data, entries, _placed(loaded)))


def _needed(
    data: bytes, entries: list[tuple[int, int]], offset: Callable[[int], int]
) -> tuple[str, ...]:
    names, strings = [], 0
    for tag, value in entries:
        if tag == _DT_NULL:
            break
        if tag == _DT_NEEDED:
            names.append(value)
        elif tag == _DT_STRTAB:
            strings = offset(value)
    return tuple(_text(data, strings + name) for name in names)


def read_pe(file: Path) -> Binary | None:
    """A program or library of Windows, or None for another file."""
    with file.open("rb") as opened:
        if opened.read(2) != b"MZ":
            return None
    data = file.read_bytes()
    (start,) = struct.unpack_from("<I", data, 0x3C)
    if data[start : start + 4] != b"PE\0\0":
        return None
    processor, sections, _, _, _, optional_size = struct.unpack_from("<HHIIIH", data, start + 4)
    optional = start + 24
    (magic,) = struct.unpack_from("<H", data, optional)
    directories = optional + (112 if magic == _PE32_PLUS else 96)
    (table,) = struct.unpack_from("<I", data, directories + 8 * _IMPORTS)
    placed = []
    for number in range(sections):
        size, address, raw_size, raw = struct.unpack_from(
            "<IIII", data, optional + optional_size + number * 40 + 8
        )
        placed.append((address, max(size, raw_size), raw))
    return Binary(processor, _imported(data, table, _placed(placed)) if table else ())


def _imported(data: bytes, table: int, offset: Callable[[int], int]) -> tuple[str, ...]:
    names = []
    at = offset(table)
    while any(data[at : at + _DESCRIPTOR]):
        (name,) = struct.unpack_from("<I", data, at + 12)
        names.append(_text(data, offset(name)))
        at += _DESCRIPTOR
    return tuple(names)


def _placed(parts: list[tuple[int, int, int]]) -> Callable[[int], int]:
    """From an address in memory to the place in the file; parts are address, length, place."""

    def offset(address: int) -> int:
        for start, length, place in parts:
            if start <= address < start + length:
                return address - start + place
        raise ValueError(f"address {address:#x} is in no part of the file")

    return offset


def _text(data: bytes, start: int) -> str:
    return data[start : data.index(b"\0", start)].decode("ascii")
