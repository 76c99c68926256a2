"""What is owed to drives, on the disk: a server that is killed in a motion puts nothing back.

One small file per drive in the state folder while something is owed or lent, none otherwise. It
outlives the process, not a failing supply of the computer: nothing waits for the disk here, since
every motion begins and ends with it.
"""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from backend.files import StorageFailed, write_atomically
from backend.owed import Debt
from profiles.schema import Raw

#: What moves is this long after the last note still the doing of the server that was killed; later
#: somebody else may have the machine.
A_MOMENT_S = 600.0


class _Kept(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    key: str
    raw: Raw
    left: tuple[Raw, ...]
    unapplied: bool = False


class _Note(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    serial: int | None
    debts: tuple[_Kept, ...]
    in_motion: bool = False


class OwedStore:
    """Notes by the id of the drive."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def get(self, drive: str, serial: int | None) -> tuple[tuple[Debt, ...], int | None]:
        """What an earlier server noted, and the serial number of the drive that was here then.

        Nothing where ``serial`` says that it was another one.
        """
        try:
            note = _Note.model_validate_json(self._file(drive).read_text("utf-8"))
        except (OSError, ValidationError):
            return (), serial
        if note.serial is not None and serial is not None and note.serial != serial:
            return (), serial
        debts = (
            Debt(kept.key, kept.raw, frozenset(kept.left), kept.unapplied) for kept in note.debts
        )
        return tuple(debts), serial if note.serial is None else note.serial

    def was_moved(self, drive: str) -> bool:
        """Whether a server ended a moment ago in the middle of a motion of this drive."""
        file = self._file(drive)
        try:
            note = _Note.model_validate_json(file.read_text("utf-8"))
            age_s = time.time() - file.stat().st_mtime
        except (OSError, ValidationError):
            return False
        return note.in_motion and abs(age_s) < A_MOMENT_S

    def put(
        self, drive: str, serial: int | None, debts: Sequence[Debt], *, in_motion: bool = False
    ) -> None:
        """Note what is owed now instead of what was.

        Raises:
            StorageFailed: it cannot be written or taken away.
        """
        file = self._file(drive)
        if not debts:
            try:
                file.unlink(missing_ok=True)
            except OSError as error:
                raise StorageFailed(f"{file} cannot be removed: {error.strerror}") from error
            return
        kept = tuple(_Kept(key=d.key, raw=d.raw, left=tuple(d.left), unapplied=d.unapplied)
                     for d in debts)  # fmt: skip
        note = _Note(serial=serial, debts=kept, in_motion=in_motion)
        write_atomically(file, note.model_dump_json(indent=1).encode(), durable=False)

    def _file(self, drive: str) -> Path:
        return self._folder / f"{re.sub(r'[^a-z0-9-]', '_', drive)}.json"
