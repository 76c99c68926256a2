"""Restore lists on the disk, as a server or command killed in a motion restores nothing.

One small file per drive in the state folder while values are changed or pending, none otherwise.
It is written before the first temporary value changes; the motion waits for the disk then, but no
longer than `FLUSH_S`.
"""

from __future__ import annotations

import hashlib
import os
import re
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from backend.axes.drive.notes.pending_restore import PendingRestore
from backend.axes.restore.identity import DriveIdentity
from backend.axes.restore.process import lives, this_process
from backend.foundation.store.files import StorageFailed, write_atomically
from profiles.schema import Raw

#: Time after the last write of the list for which a motion is attributed to the killed process [s];
#: later somebody else may be using the machine.
A_MOMENT_S = 600.0
#: Longest delay of a motion by waiting for the disk [s].
FLUSH_S = 0.02
_DAMAGED = ".damaged"


class _Value(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    key: str
    raw: Raw
    left: tuple[Raw, ...]
    unapplied: bool = False


class _List(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    vendor_id: int | None = None
    product_code: int | None = None
    serial: int | None = None
    places: tuple[tuple[str, int], ...] = ()
    process: str = ""
    by: str = ""
    in_motion: bool = False
    values: tuple[_Value, ...] = ()

    @property
    def identity(self) -> DriveIdentity:
        return DriveIdentity(self.vendor_id, self.product_code, self.serial, self.places)


class _Earlier(BaseModel):
    """File format before lists had an identity: one file per id of a server's drive."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    serial: int | None
    debts: tuple[_Value, ...]
    in_motion: bool = False


@dataclass(frozen=True)
class Pending:
    """Restores that an ended process has left pending in a drive.

    ``since``: time of its last write (seconds since 1970); ``by``: its name. ``moved``: it ended
    less than `A_MOMENT_S` ago during a motion. ``held_by``: another running process that moves this
    drive with temporary values now. ``serial``: serial number of the drive in the list.
    ``unreadable``: damaged lists of this station, whose contents are not known.
    """

    values: tuple[PendingRestore, ...] = ()
    since: float = 0.0
    by: str = ""
    moved: bool = False
    held_by: str = ""
    serial: int | None = None
    unreadable: tuple[Path, ...] = ()


@dataclass
class RestoreList:
    """The list of one drive on the disk, as written by this process."""

    folder: Path
    identity: DriveIdentity
    by: str
    pending: Pending
    _file: Path
    _taken_over: list[Path] = field(default_factory=list)

    def write(
        self,
        values: Sequence[PendingRestore],
        *,
        in_motion: bool,
        identity: DriveIdentity | None = None,
        durable: bool = False,
    ) -> None:
        """Write the values that are temporary or pending now; without any, remove the file.

        ``durable`` waits for the disk, up to `FLUSH_S`.

        Raises:
            StorageFailed: it cannot be written or removed.
        """
        drive = self.identity = identity or self.identity
        if values:
            kept = tuple(
                _Value(key=v.key, raw=v.raw, left=tuple(v.left), unapplied=v.unapplied)
                for v in values
            )
            note = _List(
                vendor_id=drive.vendor_id,
                product_code=drive.product_code,
                serial=drive.serial,
                places=drive.places,
                process=this_process(),
                by=self.by,
                in_motion=in_motion,
                values=kept,
            )
            write_atomically(self._file, note.model_dump_json(indent=1).encode(), durable=False)
            if durable:
                _flush(self._file)
        for file in self._taken_over if values else [*self._taken_over, self._file]:
            try:
                file.unlink(missing_ok=True)
            except OSError as error:
                raise StorageFailed(
                    "restore.cannot-removed", file=str(file), strerror=error.strerror
                ) from error
        self._taken_over.clear()


class RestoreStore:
    """All restore lists of a state folder. ``by``: name of the process that writes them."""

    def __init__(self, state_folder: Path, by: str) -> None:
        self._folder = state_folder / "restore"
        self._earlier = state_folder / "owed"
        self._by = by

    def list_of(self, drive: DriveIdentity, drive_id: str) -> RestoreList:
        """The list of one drive, with what earlier processes left pending in it.

        ``drive_id``: the server's id of the drive, the file name in earlier versions. Values of a
        list from another station are only offered and not restored automatically, as some makers'
        serial numbers are not unique and the other drive may still be at its station.
        """
        own = self._folder / f"{_slug(drive)}.json"
        known, values = Pending(), dict[str, PendingRestore]()
        taken: list[Path] = []
        for file, note, noted in self._lists():
            if not note.identity.is_of(drive):
                continue
            if note.in_motion and note.process != this_process() and lives(note.process):
                known = Pending(
                    tuple(values.values()),
                    known.since,
                    known.by,
                    known.moved,
                    note.by,
                    known.serial,
                )
                own = self._folder / f"{_slug(drive)}-{os.getpid()}.json"
                continue
            taken.append(file)
            here = set(note.identity.places) & set(drive.places) or not note.places
            # The older list has the value from before both motions.
            values = {v.key: _entry(v, known=bool(here)) for v in note.values} | values
            known = Pending(
                tuple(values.values()),
                noted,
                note.by,
                known.moved or (note.in_motion and abs(time.time() - noted) < A_MOMENT_S),
                known.held_by,
                known.serial or note.serial,
            )
        known = self._of_earlier_version(drive, drive_id, known, taken)
        known = replace(known, unreadable=self._set_aside(drive))
        return RestoreList(
            self._folder, drive, self._by, known, own, [file for file in taken if file != own]
        )

    def _lists(self) -> list[tuple[Path, _List, float]]:
        """All readable lists with file and time of writing, the oldest first."""
        found = []
        for file in self._folder.glob("*.json"):
            try:
                found.append(
                    (file, _List.model_validate_json(file.read_bytes()), file.stat().st_mtime)
                )
            except (OSError, ValidationError):
                continue
        return sorted(found, key=lambda each: each[2])

    def _set_aside(self, drive: DriveIdentity) -> tuple[Path, ...]:
        """Damaged lists of this drive's stations, renamed so that no new list replaces them."""
        names = "|".join(re.escape(_place_words(*place)) for place in drive.places)
        ours = re.compile(rf"(?:{names})-[0-9a-f]{{8}}(?:-\d+)?\.json(?:\{_DAMAGED})?")
        found = []
        for file in sorted(self._folder.glob("*.json*")) if names else []:
            if ours.fullmatch(file.name) is None:
                continue
            if file.suffix == _DAMAGED:
                found.append(file)
            elif not _sound(file):
                aside = file.with_name(file.name + _DAMAGED)
                try:
                    found.append(file.rename(aside))
                except OSError:
                    found.append(file)
        return tuple(found)

    def _of_earlier_version(
        self, drive: DriveIdentity, drive_id: str, known: Pending, taken: list[Path]
    ) -> Pending:
        file = self._earlier / f"{re.sub(r'[^a-z0-9-]', '_', drive_id)}.json"
        try:
            note = _Earlier.model_validate_json(file.read_bytes())
            noted = file.stat().st_mtime
        except (OSError, ValidationError):
            return known
        if None not in (note.serial, drive.serial) and note.serial != drive.serial:
            return known
        taken.append(file)
        values = {v.key: v for v in known.values} | {v.key: _entry(v) for v in note.debts}
        moved = note.in_motion and abs(time.time() - noted) < A_MOMENT_S
        return Pending(
            tuple(values.values()),
            known.since or noted,
            known.by,
            known.moved or moved,
            known.held_by,
            known.serial or note.serial,
        )


def _sound(file: Path) -> bool:
    try:
        _List.model_validate_json(file.read_bytes())
    except FileNotFoundError:
        return True
    except (OSError, ValidationError):
        return False
    return True


def _entry(value: _Value, *, known: bool = True) -> PendingRestore:
    """The entry as pending restore; ``known``: whether its ``left`` values hold for this drive."""
    left = frozenset(value.left) if known else frozenset()
    return PendingRestore(value.key, value.raw, left, value.unapplied)


def _slug(drive: DriveIdentity) -> str:
    """File name without suffix: readable, and different for another drive or station."""
    url, station = drive.places[0] if drive.places else ("", 0)
    words = _place_words(url, station)
    whole = f"{url} {station} {drive.vendor_id} {drive.product_code} {drive.serial}"
    return f"{words}-{hashlib.sha256(whole.encode()).hexdigest()[:8]}"


def _place_words(url: str, station: int) -> str:
    return re.sub(r"[^A-Za-z0-9]+", "-", f"{url}-{station}").strip("-")[:60]


def _flush(file: Path) -> None:
    """Flush the file and its folder to the disk, waiting up to `FLUSH_S`; a slow disk continues."""

    def flushed() -> None:
        # Windows flushes only what is open for writing (FlushFileBuffers).
        for path, mode in ((file, os.O_RDWR), (file.parent, os.O_RDONLY)):
            try:
                handle = os.open(path, mode)
            except OSError:
                # A system where folders cannot be opened, or a list that was removed meanwhile.
                continue
            try:
                os.fsync(handle)
            except OSError:
                pass
            finally:
                os.close(handle)

    thread = threading.Thread(target=flushed, name="restore-list", daemon=True)
    thread.start()
    thread.join(FLUSH_S)
