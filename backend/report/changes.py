"""Log of parameter changes by tuning, with values before and after, stored for the report."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from backend.foundation.store.files import StorageFailed

_UNSAFE = re.compile(r"[^\w.\-]")


@dataclass(frozen=True)
class Change:
    """One write of several parameters; raw values by key. ``what``: such as notches or gains."""

    time: datetime
    what: str
    before: Mapping[str, int]
    after: Mapping[str, int]


@dataclass(frozen=True)
class NetChange:
    """First and last raw value of one parameter, with the time of the last change."""

    key: str
    before: int
    after: int
    time: datetime


class ChangeLog:
    """One text file per drive, with one JSON object a line; lines are only appended."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def _path(self, drive_id: str) -> Path:
        return self.folder / f"{_UNSAFE.sub('_', drive_id)}.jsonl"

    def add(self, drive_id: str, change: Change) -> None:
        """Append a change, without values that stayed the same.

        Raises:
            StorageFailed: the file cannot be written. The drive has the new values nevertheless.
        """
        keys = [key for key, raw in change.after.items() if change.before.get(key) != raw]
        if not keys:
            return
        row = {
            "time": change.time.isoformat(),
            "what": change.what,
            "before": {key: change.before[key] for key in keys if key in change.before},
            "after": {key: change.after[key] for key in keys},
        }
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with self._path(drive_id).open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
        except OSError as error:
            raise StorageFailed(
                "report.change-written-drive-not", drive=drive_id, cause=str(error)
            ) from error

    def read(self, drive_id: str) -> tuple[Change, ...]:
        """All changes, oldest first. Incomplete lines, as after a crash, are left out."""
        try:
            lines = self._path(drive_id).read_text("utf-8").splitlines()
        except FileNotFoundError:
            return ()
        found = (_parsed(line) for line in lines)
        return tuple(change for change in found if change is not None)


def _parsed(line: str) -> Change | None:
    try:
        row = json.loads(line)
        return Change(
            datetime.fromisoformat(row["time"]),
            str(row["what"]),
            {str(k): int(v) for k, v in row["before"].items()},
            {str(k): int(v) for k, v in row["after"].items()},
        )
    except (ValueError, KeyError, TypeError, AttributeError):
        return None


def net(changes: Iterable[Change]) -> tuple[NetChange, ...]:
    """Net change of every parameter, where its last value differs from its first."""
    first: dict[str, int] = {}
    last: dict[str, tuple[int, datetime]] = {}
    for change in changes:
        for key, raw in change.after.items():
            if key in change.before:
                first.setdefault(key, change.before[key])
            # Without a known value before, a later change is still the last one.
            if key in first:
                last[key] = (raw, change.time)
    return tuple(
        NetChange(key, first[key], raw, time)
        for key, (raw, time) in sorted(last.items())
        if first[key] != raw
    )
