"""The folder of recordings: listing, search, remarks, deletion and retention."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from backend.foundation.store.files import (
    checked_name,
    files_of,
    is_taken,
    new_name,
    shown_name,
    write_atomically,
)
from backend.records.recording.chunks import SUFFIX
from backend.records.recording.reader import BadRecording, RecordingReader, Summary
from drivers.errors import NotAllowed
from drivers.texts.message import Text

_NOTES = ".json"
EXPORTS = {"csv": ".csv", "csv_raw": ".raw.csv", "rrd": ".rrd", "mcap": ".mcap"}


@dataclass(frozen=True, slots=True)
class Remarks:
    """Remarks of people on a recording. ``kept`` protects it from retention."""

    notes: str = ""
    tags: tuple[str, ...] = ()
    kept: bool = False


@dataclass(frozen=True, slots=True)
class Retention:
    """Limits of the folder; None for no limit. Recordings marked ``kept`` are not deleted."""

    max_total_bytes: int | None = 20_000_000_000
    keep_days: float | None = None


@dataclass(frozen=True, slots=True)
class Stored:
    """One recording in the list. ``summary`` is None where the file is not usable."""

    name: str
    summary: Summary | None
    remarks: Remarks
    modified: float
    bytes: int
    exports: tuple[str, ...]
    problem: Text | None = None

    def words(self) -> str:
        """All text that a search covers, in lower case."""
        parts = [self.name, self.remarks.notes, *self.remarks.tags]
        if self.summary is not None:
            header = self.summary.header
            parts += [str(header.get("notes", "")), str(header.get("person", ""))]
            parts += [str(tag) for tag in header.get("tags", [])]
            for axis in header.get("axes", []):
                parts += [str(axis.get(k, "")) for k in ("name", "profile", "title", "serial")]
            parts += [f"{c.name} {c.key}" for c in self.summary.channels]
        return " ".join(parts).lower()


class RecordingLibrary:
    """Recordings of one folder. Names are plain file names ending in ``.sdrec``."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.retention = self._read_retention()
        self._seen: dict[str, tuple[tuple[int, int], Summary | None, Text | None]] = {}

    # --- names ------------------------------------------------------------------------

    def path(self, name: str) -> Path:
        """Path of a recording of this name.

        Raises:
            NotAllowed: it is not a plain file name.
        """
        return self.folder / checked_name(name, SUFFIX)

    def existing(self, name: str) -> Path:
        """The file of a recording.

        Raises:
            NotAllowed: there is none of this name.
        """
        path = self.path(name)
        if not path.is_file():
            raise NotAllowed("recording.no-recording", value=path.name)
        return path

    def free_name(self, wanted: str) -> str:
        """File name from ``wanted``, with a number appended where it exists already."""
        stem = new_name(wanted, SUFFIX).removesuffix(SUFFIX)
        name, number = stem, 2
        while is_taken(self.folder, name + SUFFIX):
            name, number = f"{stem} {number}", number + 1
        return name + SUFFIX

    def export_path(self, name: str, kind: str) -> Path:
        """Path of an export of a recording, whether it exists or not.

        Raises:
            NotAllowed: no such kind.
        """
        if kind not in EXPORTS:
            raise NotAllowed("recording.no-export-format", value=kind, limit=", ".join(EXPORTS))
        stem = checked_name(name, SUFFIX).removesuffix(SUFFIX)
        return self.folder / "exports" / (stem + EXPORTS[kind])

    # --- list -------------------------------------------------------------------------

    def entries(self, search: str = "", busy: Iterable[str] = ()) -> list[Stored]:
        """Recordings that contain every word of ``search``, newest first, without ``busy`` ones.

        Reads the files that changed since the last call; blocking.
        """
        words = search.lower().split()
        skip = set(busy)
        found = [
            stored
            for path in files_of(self.folder, SUFFIX)
            if path.name not in skip and (stored := self._listed(path)) is not None
        ]
        fitting = [s for s in found if all(word in s.words() for word in words)]
        return sorted(fitting, key=lambda s: -s.modified)

    def _listed(self, path: Path) -> Stored | None:
        """One row of the list; a file that was deleted in the meantime has none.

        A file that cannot be opened under its name, as one that was copied by hand, is listed with
        its problem.
        """
        name = shown_name(path)
        try:
            return self.describe(name)
        except FileNotFoundError:
            return None
        except NotAllowed as error:
            try:
                status = path.stat()
            except OSError:
                return None
            return Stored(
                name, None, Remarks(), status.st_mtime, status.st_size, (), problem=error.text
            )

    def describe(self, name: str) -> Stored:
        """One recording.

        Raises:
            NotAllowed: there is none of this name.
        """
        path = self.existing(name)
        status = path.stat()
        stamp = (status.st_mtime_ns, status.st_size)
        seen = self._seen.get(path.name)
        if seen is None or seen[0] != stamp:
            try:
                with RecordingReader(path) as reader:
                    seen = (stamp, reader.summary(), None)
            except BadRecording as error:
                seen = (stamp, None, error.text)
            self._seen[path.name] = seen
        exports = tuple(kind for kind in EXPORTS if self.export_path(path.name, kind).is_file())
        return Stored(
            name=path.name,
            summary=seen[1],
            remarks=self._remarks(path),
            modified=status.st_mtime,
            bytes=status.st_size,
            exports=exports,
            problem=seen[2],
        )

    # --- changes ----------------------------------------------------------------------

    def annotate(
        self, name: str, *, notes: str | None, tags: tuple[str, ...] | None, kept: bool | None
    ) -> Stored:
        """Change the remarks on a recording; None leaves a field unchanged."""
        path = self.existing(name)
        remarks = self._remarks(path)
        remarks = replace(
            remarks,
            notes=remarks.notes if notes is None else notes,
            tags=remarks.tags if tags is None else tags,
            kept=remarks.kept if kept is None else kept,
        )
        text = json.dumps(asdict(remarks), ensure_ascii=False)
        write_atomically(path.with_name(path.name + _NOTES), text.encode())
        return self.describe(name)

    def delete(self, name: str) -> None:
        """Delete a recording with its exports and remarks.

        Raises:
            NotAllowed: there is none of this name.
        """
        path = self.existing(name)
        path.unlink()
        path.with_name(path.name + _NOTES).unlink(missing_ok=True)
        for kind in EXPORTS:
            self.export_path(name, kind).unlink(missing_ok=True)
        self._seen.pop(path.name, None)

    def set_retention(self, retention: Retention) -> None:
        """Store and apply these limits."""
        text = json.dumps(asdict(retention))
        write_atomically(self.folder / "retention.json", text.encode())
        self.retention = retention

    def prune(self, busy: Iterable[str] = (), now: float | None = None) -> list[str]:
        """Delete recordings beyond the limits, oldest first; return their names. Blocking."""
        now = time.time() if now is None else now
        skip = set(busy)
        rows = []
        for path in files_of(self.folder, SUFFIX):
            # A file whose name is not one of a recording was put there by hand, and stays.
            if path.name not in skip and self._is_named(path):
                with contextlib.suppress(FileNotFoundError):  # deleted at this moment
                    rows.append((path.stat().st_mtime, path.name, self._size(path)))
        total = sum(row[2] for row in rows)
        gone = []
        for modified, name, size in sorted(rows):
            days, most = self.retention.keep_days, self.retention.max_total_bytes
            old = days is not None and now - modified > days * 86400
            if not (old or (most is not None and total > most)):
                continue
            path = self.folder / name
            if self._remarks(path).kept:
                continue
            if path.exists():
                self.delete(name)
                gone.append(name)
            total -= size
        return gone

    def _is_named(self, path: Path) -> bool:
        try:
            return self.path(path.name).name == path.name
        except NotAllowed:
            return False

    def _size(self, path: Path) -> int:
        """Size of a recording with its exports."""
        exports = (self.export_path(path.name, kind) for kind in EXPORTS)
        return path.stat().st_size + sum(e.stat().st_size for e in exports if e.is_file())

    def _remarks(self, path: Path) -> Remarks:
        """Remarks on a recording; where they cannot be read, it counts as kept."""
        try:
            content = json.loads(path.with_name(path.name + _NOTES).read_text("utf-8"))
        except FileNotFoundError:
            return Remarks()
        except (OSError, ValueError):
            return Remarks(kept=True)
        if not isinstance(content, dict):
            return Remarks(kept=True)
        tags = content.get("tags", [])
        return Remarks(
            notes=str(content.get("notes", "")),
            tags=tuple(str(tag) for tag in tags) if isinstance(tags, list) else (),
            kept=content.get("kept", False) is not False,
        )

    def _read_retention(self) -> Retention:
        content = _read_json(self.folder / "retention.json")
        most = content.get("max_total_bytes", Retention().max_total_bytes)
        days = content.get("keep_days")
        return Retention(
            max_total_bytes=int(most) if isinstance(most, (int, float)) else None,
            keep_days=float(days) if isinstance(days, (int, float)) else None,
        )


def _read_json(path: Path) -> dict[str, Any]:
    """Contents of a small JSON file; a missing or damaged one counts as empty."""
    try:
        content = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}
