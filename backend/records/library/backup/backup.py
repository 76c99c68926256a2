"""Backup of a station: one archive with all its stored data, each part with its SHA-256.

The archive is a zip: ``manifest.json``, ``station.db`` (the database of the state folder, copied
while the server runs), ``shared.db`` (library and audit of a PostgreSQL server, as an SQLite file)
and ``state/…`` (all other files of the state folder). It gets its name only when it is complete.
"""

from __future__ import annotations

import hashlib
import json
import os
import sqlite3
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath
from typing import IO, BinaryIO

import backend
from backend.foundation.store.database import FILE, Store
from backend.foundation.store.files import StorageFailed, same_but_for_case
from backend.records.audit.trail import Trail
from backend.records.library.backup.copy import copy_rows
from drivers.errors import NotAllowed
from drivers.texts.message import Text, text
from profiles.replacing import move_into_place

FORMAT = "servodeck backup"
VERSION = 1
MANIFEST, STATION, SHARED, STATE = "manifest.json", "station.db", "shared.db", "state/"
_CHUNK = 1 << 20
#: Not copied as files: databases are copied separately, the lock belongs to a running process, and
#: nvm is the memory of virtual drives.
_LEFT_OUT = frozenset({FILE, f"{FILE}-wal", f"{FILE}-shm", f"{FILE}-journal", "servodeck.lock"})
_FOLDERS_LEFT_OUT = frozenset({"nvm"})
#: Files that are compressed already, or samples that hardly shrink.
_STORED = frozenset({".sdrec", ".sdmeas", ".zip", ".rrd", ".mcap", ".pdf"})


class BackupFailed(NotAllowed):
    """A backup could not be made or is not complete; nothing was changed."""

    kind = "backup-failed"


@dataclass(frozen=True, slots=True)
class Part:
    """One file of the archive."""

    sha256: str
    bytes: int


def make_backup(
    store: Store, archive: Path, *, recordings: bool = True, overwrite: bool = False
) -> dict[str, Part]:
    """Write the archive; return its parts by name. Blocks; the server may run meanwhile.

    Raises:
        BackupFailed: the file exists, the database is damaged, or the audit's chain is broken.
        StorageFailed: an error of disk or database; no archive is left.
    """
    if archive.exists() and not overwrite:
        raise BackupFailed("store.exists-already", value=str(archive), archive=str(archive))
    try:
        archive.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".servodeck-", dir=archive.parent) as folder:
            unfinished = Path(folder) / "backup.zip"
            parts = _write(store, unfinished, Path(folder), recordings=recordings)
            unfinished.chmod(0o600)  # password hashes and keys are in it
            # Open for writing, which flushing on Windows asks for (FlushFileBuffers).
            with unfinished.open("r+b") as file:
                os.fsync(file.fileno())
            move_into_place(unfinished, archive)
    except OSError as error:
        raise StorageFailed(
            "store.backup-not-written",
            value=str(archive),
            archive=str(archive),
            strerror=str(error.strerror or error),
        ) from error
    return parts


def _write(store: Store, file: Path, folder: Path, *, recordings: bool) -> dict[str, Part]:
    """Write the archive; databases first, as each file exists before its row."""
    parts: dict[str, Part] = {}
    databases = {STATION: store.folder / FILE} if (store.folder / FILE).exists() else {}
    copies = {name: _online_copy(path, folder / name) for name, path in databases.items()}
    if store.sqlite_file != store.folder / FILE:
        copies[SHARED] = _shared_copy(store, folder)
    head = _checked_head(copies.get(SHARED) or copies.get(STATION))
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, allowZip64=True) as archive:
        for name, path in copies.items():
            parts[name] = _add(archive, name, path)
        for path in _files(store.folder, recordings=recordings):
            name = STATE + path.relative_to(store.folder).as_posix()
            try:
                parts[name] = _add(archive, name, path)
            except FileNotFoundError:
                continue  # deleted while the backup ran
        manifest = {
            "format": FORMAT,
            "version": VERSION,
            "program": backend.__version__,
            "made": datetime.now(UTC).isoformat(timespec="seconds"),
            "audit_head": head,
            "parts": {n: {"sha256": p.sha256, "bytes": p.bytes} for n, p in parts.items()},
        }
        archive.writestr(MANIFEST, json.dumps(manifest, indent=1))
    return parts


def _online_copy(source: Path, target: Path) -> Path:
    """Copy a database by SQLite's own backup: one consistent state, also while others write.

    Raises:
        BackupFailed: the database is damaged.
    """
    try:
        with (
            closing(sqlite3.connect(source, timeout=30)) as old,
            closing(sqlite3.connect(target)) as new,
        ):
            old.backup(new)
            new.execute("PRAGMA journal_mode=DELETE").close()
            found = new.execute("PRAGMA integrity_check").fetchone()[0]
    except sqlite3.Error as error:
        raise _damaged(source, str(error)) from error
    if found != "ok":
        raise _damaged(source, found)
    return target


def _damaged(source: Path, found: str) -> BackupFailed:
    return BackupFailed(
        "store.database-damaged", value=str(source), source=str(source), found=found
    )


def _shared_copy(store: Store, folder: Path) -> Path:
    copy = Store(folder, f"sqlite:///{folder / SHARED}")
    try:
        copy_rows(store, copy)
    finally:
        copy.close()
    return _online_copy(folder / SHARED, folder / "shared-packed.db")


def _checked_head(database: Path | None) -> str:
    """Check the audit's chain; number and hash of its last entry, as an anchor for the manifest.

    Raises:
        BackupFailed: the chain is broken.
    """
    if database is None:
        return ""
    copy = Store(database.parent, f"sqlite:///{database}")
    try:
        verdict = Trail(copy).verify()
    finally:
        copy.close()
    if not verdict.ok:
        raise BackupFailed("store.audit-broken-entry", value=verdict.broken, why=verdict.why)
    return str(verdict.head)


def _files(folder: Path, *, recordings: bool) -> Iterator[Path]:
    for path in sorted(folder.rglob("*")):
        inner = path.relative_to(folder)
        if path.is_symlink() or not path.is_file() or inner.name in _LEFT_OUT:
            continue
        hidden = any(part.startswith(".") for part in inner.parts)
        if hidden or inner.parts[0] in _FOLDERS_LEFT_OUT:
            continue  # files that are just being written begin with a dot
        if not recordings and inner.parts[0] == "recordings":
            continue
        yield path


def _add(archive: zipfile.ZipFile, name: str, path: Path) -> Part:
    """Copy and hash a file in one pass, so that the hash fits also where the file grows."""
    info = zipfile.ZipInfo.from_file(path, name, strict_timestamps=False)
    packed = zipfile.ZIP_STORED if path.suffix in _STORED else zipfile.ZIP_DEFLATED
    info.compress_type = packed
    digest, size = hashlib.sha256(), 0
    with path.open("rb") as source, archive.open(info, "w", force_zip64=True) as target:
        while chunk := source.read(_CHUNK):
            target.write(chunk)
            digest.update(chunk)
            size += len(chunk)
    return Part(digest.hexdigest(), size)


# --- reading -----------------------------------------------------------------------------


def read_manifest(archive: zipfile.ZipFile, shown: str) -> dict[str, Part]:
    """Parts by name, after a check that the archive contains exactly these, with safe names.

    Raises:
        BackupFailed: not a backup, of a newer version, or not complete.
    """
    try:
        with archive.open(MANIFEST) as file:
            content = json.loads(file.read(64 << 20))
        kind, version = content["format"], int(content["version"])
        parts = {
            str(name): Part(str(part["sha256"]), int(part["bytes"]))
            for name, part in content["parts"].items()
        }
    except (KeyError, ValueError, TypeError, AttributeError, zipfile.BadZipFile) as error:
        raise _bad(shown, text("store.backup-manifest", cause=str(error))) from error
    if kind != FORMAT:
        raise _bad(shown, text("store.backup-other"))
    if version > VERSION:
        raise _bad(shown, text("store.backup-newer"))
    names = [info.filename for info in archive.infolist()]
    if sorted(names) != sorted([*parts, MANIFEST]):
        raise _bad(shown, text("store.backup-contents"))
    for info in archive.infolist():
        if info.filename != MANIFEST and not _is_safe(info):
            raise _bad(shown, text("store.backup-name", part=info.filename))
    return parts


def _is_safe(info: zipfile.ZipInfo) -> bool:
    """Whether an entry is a regular file within the folder to which it is unpacked."""
    name = info.filename
    path = PurePosixPath(name)
    kind = (info.external_attr >> 16) & 0o170000
    return (
        (name in (STATION, SHARED) or name.startswith(STATE))
        and not path.is_absolute()
        and ".." not in path.parts
        and name == str(path)
        and not any(sign in name for sign in ("\\", ":", "\0"))
        and kind in (0, 0o100000)
    )


def unpack(archive: zipfile.ZipFile, parts: dict[str, Part], folder: Path, shown: str) -> None:
    """Unpack and compare every part; not more bytes than the manifest states.

    Raises:
        BackupFailed: a part is damaged, or the disk takes two of them for one file.
        OSError: an error of the disk.
    """
    for name, part in parts.items():
        inner = name.removeprefix(STATE)
        path = folder / (FILE if name == STATION else inner)
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            with archive.open(name) as source, path.open("xb") as target:
                path.chmod(0o600)
                same = _copy_checked(source, target, part)
        except (zipfile.BadZipFile, EOFError, NotImplementedError) as error:
            raise _bad(shown, text("store.backup-damaged", part=name, cause=str(error))) from error
        except FileExistsError as error:
            other = same_but_for_case(path.parent, path.name) or path.name
            raise _bad(shown, text("store.backup-same-name", part=name, other=other)) from error
        if not same:
            raise _bad(shown, text("store.backup-part-differs", part=name))


def _copy_checked(source: IO[bytes], target: BinaryIO, part: Part) -> bool:
    digest, size = hashlib.sha256(), 0
    while chunk := source.read(_CHUNK):
        size += len(chunk)
        if size > part.bytes:
            return False
        digest.update(chunk)
        target.write(chunk)
    target.flush()
    os.fsync(target.fileno())
    return size == part.bytes and digest.hexdigest() == part.sha256


def _bad(shown: str, why: Text) -> BackupFailed:
    return BackupFailed("store.cannot-restored-nothing-changed", value=shown, why=why)
