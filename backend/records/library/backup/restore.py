"""Restore of a station from a backup: first checked as a whole, then put in place atomically."""

from __future__ import annotations

import shutil
import tempfile
import zipfile
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from backend.foundation.store import state_version
from backend.foundation.store.database import FILE, Store
from backend.foundation.store.files import StorageFailed
from backend.foundation.store.lock import FolderLock
from backend.records.audit.trail import Trail
from backend.records.library.backup import backup
from backend.records.library.backup.backup import SHARED, BackupFailed
from backend.records.library.backup.copy import copy_rows
from drivers.computer.files import FOLDERS_MOVE_WHILE_OPEN


@dataclass(frozen=True, slots=True)
class Restored:
    """Result of a restore; ``aside``: present path of the earlier state folder."""

    parts: int
    audit_entries: int
    aside: Path | None
    copied_rows: int


def restore(
    archive: Path, folder: Path, *, database: str | None = None, replace: bool = False
) -> Restored:
    """Unpack a backup into a state folder, and library and audit into an empty ``database``.

    Blocks. An existing folder is refused, or with ``replace`` kept under another name.

    Raises:
        BackupFailed: the archive is not complete, or the folder is in use; nothing was changed.
        StateRefused: a newer servodeck made the backup; nothing was changed.
        StorageFailed: an error of disk or database; the state folder is unchanged.
    """
    used = folder.exists() and any(path.name != FolderLock.NAME for path in folder.iterdir())
    if used and not replace:
        raise BackupFailed("store.not-empty-nothing-changed", value=str(folder), folder=str(folder))
    with FolderLock(folder) as lock:
        if not lock.held:
            raise BackupFailed(
                "store.running-servodeck-uses-nothing", value=str(folder), folder=str(folder)
            )
        try:
            folder.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(prefix=".servodeck-", dir=folder.parent) as place:
                fresh = Path(place) / "state"
                fresh.mkdir(mode=0o700)
                parts = _unpack(archive, fresh)
                entries = _check(fresh, str(archive))
                copied = _fill(fresh, database) if database else 0
                if not FOLDERS_MOVE_WHILE_OPEN:
                    # The lock is a file of the folder, and would prevent its renaming, as does
                    # every file that another process has open there: that protects it now.
                    lock.give()
                aside = _put_in_place(fresh, folder)
        except OSError as error:
            raise StorageFailed(
                "store.not-restored",
                value=str(folder),
                archive=str(archive),
                folder=str(folder),
                strerror=str(error.strerror or error),
            ) from error
    return Restored(parts, entries, aside, copied)


def _unpack(archive: Path, folder: Path) -> int:
    try:
        with zipfile.ZipFile(archive) as file:
            parts = backup.read_manifest(file, str(archive))
            needed = sum(part.bytes for part in parts.values())
            if shutil.disk_usage(folder).free < needed:
                raise StorageFailed(
                    "store.needs-bytes-disk-not", value=needed, archive=str(archive)
                )
            backup.unpack(file, parts, folder, str(archive))
    except zipfile.BadZipFile as error:
        raise BackupFailed(
            "store.no-whole-backup-nothing",
            value=str(archive),
            archive=str(archive),
            cause=str(error),
        ) from error
    return len(parts)


def _check(folder: Path, shown: str) -> int:
    """Check that the databases open and the audit's chain is intact; number of audit entries."""
    state_version.check(folder)
    entries = 0
    for name in (FILE, SHARED):
        if not (folder / name).exists():
            continue
        store = Store(folder, f"sqlite:///{folder / name}")
        try:
            verdict = Trail(store).verify()
        finally:
            store.close()
        if not verdict.ok:
            raise BackupFailed(
                "store.audit-broken-entry-nothing",
                value=verdict.broken,
                shown=shown,
                why=verdict.why,
            )
        entries = max(entries, verdict.entries)
    return entries


def _fill(folder: Path, database: str) -> int:
    name = SHARED if (folder / SHARED).exists() else FILE
    source, target = Store(folder, f"sqlite:///{folder / name}"), Store(folder, database)
    try:
        return copy_rows(source, target)
    finally:
        source.close()
        target.close()


def _put_in_place(fresh: Path, folder: Path) -> Path | None:
    """Move the new folder in place of the old one, which is kept; undone on failure."""
    aside = None
    if folder.exists() and any(path.name != FolderLock.NAME for path in folder.iterdir()):
        aside = folder.with_name(f"{folder.name}.before-{datetime.now(UTC):%Y%m%d-%H%M%S}")
        folder.rename(aside)
    elif folder.exists():
        shutil.rmtree(folder)
    try:
        fresh.rename(folder)
    except OSError:
        if aside is not None:
            aside.rename(folder)
        raise
    return aside
