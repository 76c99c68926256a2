"""Restore lists on the disk: whoever is killed in a motion, server or command, restores nothing.

One small file per drive in the state folder while values are changed or pending, none otherwise.
It is written before the first temporary value changes, and the disk is waited for then, but no
longer than a motion may begin late by it.
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

from backend.drive.pending_restore import PendingRestore
from backend.restore.identity import DriveIdentity
from backend.restore.process import lives, this_process
from backend.store.files import StorageFailed, write_atomically
from profiles.schema import Raw

#: What moves is this long after the last note still the doing of the process that was killed;
#: later somebody else may have the machine.
A_MOMENT_S = 600.0
#: A motion begins at most so much later because the disk is waited for.
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
    """The form before lists had an identity: one file per id of a server's drive."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    serial: int | None
    debts: tuple[_Value, ...]
    in_motion: bool = False


@dataclass(frozen=True)
class Pending:
    """What a process that is no more has left in a drive.

    ``since`` is when it noted this last (seconds since 1970), ``by`` what it was. ``moved``: it
    ended a moment ago in the middle of a motion. ``held_by`` is another process that lives and
    moves this drive with temporary values now, and ``serial`` that of the drive which was here.
    ``unreadable`` are damaged lists of this place: what they held is not known.
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
    """The list of one drive on the disk, as this process keeps it."""

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
        """Note what is changed temporarily or pending now instead of what was; nothing takes the
        file away.

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
    """All restore lists of a state folder. ``by`` says as text who writes them."""

    def __init__(self, state_folder: Path, by: str) -> None:
        self._folder = state_folder / "restore"
        self._earlier = state_folder / "owed"
        self._by = by

    def list_of(self, drive: DriveIdentity, drive_id: str) -> RestoreList:
        """The list of one drive, with what earlier processes left pending in it.

        ``drive_id`` is the server's name of it, by which servers before this version noted it.
        Of a list that was written at another place the values are only offered: not every maker's
        serial numbers differ, and the other drive may still be where it was.
        """
        own = self._folder / f"{_slug(drive)}.json"
        known, values = Pending(), dict[str, PendingRestore]()
        taken: list[Path] = []
        for file, note, noted in self._lists():
            if not note.identity.is_of(drive):
                continue
            if note.in_motion and note.process != this_process() and lives(note.process):
                known = Pending(
                    tuple(values.values()), known.since, known.by, known.moved, note.by, None
                )
                own = self._folder / f"{_slug(drive)}-{os.getpid()}.json"
                continue
            taken.append(file)
            here = set(note.identity.places) & set(drive.places) or not note.places
            # The older list knows what it was before both.
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
        """All that can be read, the oldest first."""
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
        """Damaged lists of the places of this drive, named so that no new list replaces them."""
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
    """``known``: whether what the motion left there is known of this drive."""
    left = frozenset(value.left) if known else frozenset()
    return PendingRestore(value.key, value.raw, left, value.unapplied)


def _slug(drive: DriveIdentity) -> str:
    """A name for the file: readable, and another one for another drive or place."""
    url, station = drive.places[0] if drive.places else ("", 0)
    words = _place_words(url, station)
    whole = f"{url} {station} {drive.vendor_id} {drive.product_code} {drive.serial}"
    return f"{words}-{hashlib.sha256(whole.encode()).hexdigest()[:8]}"


def _place_words(url: str, station: int) -> str:
    return re.sub(r"[^A-Za-z0-9]+", "-", f"{url}-{station}").strip("-")[:60]


def _flush(file: Path) -> None:
    """The file and its name are on the disk; a slow disk goes on with it by itself."""

    def flushed() -> None:
        for path in (file, file.parent):
            try:
                handle = os.open(path, os.O_RDONLY)
            except OSError:
                # A system where folders cannot be opened, or a list that is done with already.
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
