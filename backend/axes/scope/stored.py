"""Stored data of the scope: named set-ups, and snapshots of its traces.

A set-up is a JSON file. A snapshot (``.sdsnap``) is 8 bytes of magic, the length of a JSON header
(u32, little endian), the header, and then for each of its traces all times and all values as
64-bit floats. The server only checks that it is complete; browsers write and read it.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from backend.foundation.store.files import (
    StorageFailed,
    checked_name,
    is_taken,
    new_name,
    require_own_name,
    write_atomically,
)
from backend.foundation.store.free_space import RESERVE_BYTES, free_bytes
from drivers.errors import NotAllowed
from drivers.texts import limits
from drivers.texts.message import Text, text

SETUP_SUFFIX, SNAPSHOT_SUFFIX = ".json", ".sdsnap"
MAGIC = b"SDSNAP1\n"
_LENGTH = struct.Struct("<I")
MAX_HEADER_BYTES = 256 * 1024
MAX_SNAPSHOT_BYTES = 32 * 1024 * 1024
MOST_SETUPS, MOST_SNAPSHOTS = 200, 500


class BadSnapshot(NotAllowed):
    """Not a snapshot, or incomplete."""

    kind = "bad-snapshot"


@dataclass(frozen=True, slots=True)
class StoredSetup:
    """A named set-up; ``modified`` in seconds since 1970."""

    name: str
    modified: float
    content: dict[str, Any]


@dataclass(frozen=True, slots=True)
class StoredSnapshot:
    """A stored snapshot; ``header`` is empty where the file is not usable."""

    name: str
    modified: float
    bytes: int
    header: dict[str, Any]


def snapshot_header(data: bytes, name: str = "the file") -> dict[str, Any]:
    """The header of a snapshot, after a check that the length of the file agrees with it.

    Raises:
        BadSnapshot: not a complete snapshot.
    """
    return _checked_header(data, len(data), name)


def _checked_header(head: bytes, total_bytes: int, name: str) -> dict[str, Any]:
    begin = len(MAGIC) + _LENGTH.size
    try:
        (length,) = _LENGTH.unpack_from(head, len(MAGIC))
        header: dict[str, Any] = json.loads(head[begin : begin + min(length, MAX_HEADER_BYTES)])
        rows = [int(trace["rows"]) for trace in header["traces"]]
    except (ValueError, KeyError, TypeError, struct.error) as error:
        raise _bad(name, text("scope.header-not-readable")) from error
    expected = begin + length + 16 * sum(rows)
    if not head.startswith(MAGIC) or min(rows, default=0) < 0 or total_bytes != expected:
        raise _bad(name, text("scope.length-differs", bytes=total_bytes, expected=expected))
    return header


def _bad(name: str, why: Text) -> BadSnapshot:
    return BadSnapshot("scope.no-snapshot-scope", value=name, why=why)


class ScopeStore:
    """The folder of set-ups and snapshots. All methods block."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    # --- set-ups ----------------------------------------------------------------------

    def setups(self) -> list[StoredSetup]:
        """All set-ups, sorted by name; damaged files are left out."""
        found = []
        for path in sorted((self.folder / "setups").glob(f"*{SETUP_SUFFIX}")):
            if path.name.startswith("."):
                continue
            try:
                content = json.loads(path.read_text("utf-8"))
            except (OSError, ValueError):
                continue
            name = path.name.removesuffix(SETUP_SUFFIX)
            found.append(StoredSetup(name, path.stat().st_mtime, content))
        return found

    def save_setup(self, name: str, content: dict[str, Any]) -> None:
        """Store a set-up under a name, in place of an earlier one.

        Raises:
            NotAllowed: not a file name, the name of another set-up but for its case, or too many
                set-ups.
            StorageFailed: the disk is nearly full or cannot be written.
        """
        path = self.folder / "setups" / new_name(name, SETUP_SUFFIX)
        require_own_name(path.parent, path.name)
        _check_room(path, SETUP_SUFFIX, MOST_SETUPS)
        write_atomically(path, json.dumps(content, ensure_ascii=False, indent=1).encode())

    def delete_setup(self, name: str) -> None:
        """Delete a set-up.

        Raises:
            NotAllowed: there is none of this name.
        """
        _existing(self.folder / "setups" / checked_name(name, SETUP_SUFFIX)).unlink()

    # --- snapshots --------------------------------------------------------------------

    def snapshots(self) -> list[StoredSnapshot]:
        """All snapshots, newest first."""
        found = []
        for path in (self.folder / "snapshots").glob(f"*{SNAPSHOT_SUFFIX}"):
            if path.name.startswith("."):
                continue
            status = path.stat()
            try:
                with path.open("rb") as file:
                    head = file.read(MAX_HEADER_BYTES + 64)
                header = _checked_header(head, status.st_size, path.name)
            except (OSError, BadSnapshot):
                header = {}
            found.append(StoredSnapshot(path.name, status.st_mtime, status.st_size, header))
        return sorted(found, key=lambda each: -each.modified)

    def save_snapshot(self, name: str, data: bytes) -> str:
        """Store a snapshot; return its file name, with a number where the name is in use.

        Raises:
            BadSnapshot: it is not complete.
            NotAllowed: not a file name, or too many snapshots.
            StorageFailed: the disk is nearly full.
        """
        snapshot_header(data, name)
        folder = self.folder / "snapshots"
        stem = new_name(name, SNAPSHOT_SUFFIX).removesuffix(SNAPSHOT_SUFFIX)
        path, number = folder / (stem + SNAPSHOT_SUFFIX), 2
        while is_taken(folder, path.name):
            path, number = folder / f"{stem} {number}{SNAPSHOT_SUFFIX}", number + 1
        _check_room(path, SNAPSHOT_SUFFIX, MOST_SNAPSHOTS)
        write_atomically(path, data)
        return path.name

    def snapshot(self, name: str) -> bytes:
        """A snapshot's bytes.

        Raises:
            NotAllowed: there is none of this name.
        """
        return _existing(
            self.folder / "snapshots" / checked_name(name, SNAPSHOT_SUFFIX)
        ).read_bytes()

    def delete_snapshot(self, name: str) -> None:
        """Delete a snapshot.

        Raises:
            NotAllowed: there is none of this name.
        """
        _existing(self.folder / "snapshots" / checked_name(name, SNAPSHOT_SUFFIX)).unlink()


def _existing(path: Path) -> Path:
    if not path.is_file():
        raise NotAllowed("scope.no", value=path.name)
    return path


def _check_room(path: Path, suffix: str, most: int) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() and len(list(path.parent.glob(f"*{suffix}"))) >= most:
        raise NotAllowed("scope.already", value=path.name, limit=str(most), most=most)
    free = free_bytes(path.parent)
    if free < RESERVE_BYTES:
        raise StorageFailed(
            "scope.not-stored-disk-nearly",
            value=free,
            limit=limits.stays_free(RESERVE_BYTES),
            path=path.name,
            free_mib=free >> 20,
        )
