"""Log of hand-overs by drive, stored for the report and for later comparison."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path

from backend.foundation.store.files import StorageFailed
from profiles.schema import Raw

_UNSAFE = re.compile(r"[^\w.\-]")


@dataclass(frozen=True, slots=True)
class HandedOver:
    """One export. ``sha256``: of the list's file; ``values``: raw values by key."""

    time: datetime
    person: str
    format: str
    file: str
    sha256: str
    set_file: str
    values: Mapping[str, Raw]


class HandoverLog:
    """One text file per drive, with one JSON object a line; lines are only appended."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def _path(self, drive_id: str) -> Path:
        return self.folder / f"{_UNSAFE.sub('_', drive_id)}.jsonl"

    def add(self, drive_id: str, made: HandedOver) -> None:
        """Append a hand-over.

        Raises:
            StorageFailed: the file cannot be written.
        """
        row = asdict(made) | {"time": made.time.isoformat(), "values": dict(made.values)}
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with self._path(drive_id).open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
        except OSError as error:
            raise StorageFailed(
                "handover.hand-over-cannot-noted", drive=drive_id, cause=str(error)
            ) from error

    def read(self, drive_id: str) -> tuple[HandedOver, ...]:
        """All hand-overs, oldest first. Incomplete lines, as after a crash, are left out."""
        try:
            lines = self._path(drive_id).read_text("utf-8").splitlines()
        except FileNotFoundError:
            return ()
        found = (_parsed(line) for line in lines)
        return tuple(each for each in found if each is not None)


def _parsed(line: str) -> HandedOver | None:
    try:
        row = json.loads(line)
        return HandedOver(
            datetime.fromisoformat(row["time"]),
            str(row["person"]),
            str(row["format"]),
            str(row["file"]),
            str(row["sha256"]),
            str(row["set_file"]),
            {str(k): v for k, v in row["values"].items() if isinstance(v, (int, float, str))},
        )
    except (ValueError, KeyError, TypeError, AttributeError):
        return None
