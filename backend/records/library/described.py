"""Index entries for recordings, measurements and reports."""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

from backend.records.library import measurements
from backend.records.library.entries import Addition, AxisIdentity, Kind
from backend.records.library.index import Described, Folder
from backend.records.recording.chunks import SUFFIX as RECORDING
from backend.records.recording.library import RecordingLibrary
from backend.records.recording.reader import RecordingReader
from drivers.texts.answers import sentence

_REPORT = re.compile(r"^\d{8}-\d{6}-report-(?P<axis>.+?)(-\d+)?\.\w+$")


def folders(state: Path) -> list[Folder]:
    """The folders of a station that are indexed."""
    recordings = RecordingLibrary(state / "recordings")
    return [
        Folder(
            "recording",
            recordings.folder,
            (RECORDING,),
            lambda path: _recording(recordings, path),
            sidecar=".json",
        ),
        Folder("measurement", state / "measurements", (measurements.SUFFIX,), _measurement),
        Folder("report", state / "reports", (".html", ".pdf"), _report),
    ]


def require_usable(kind: Kind, path: Path) -> None:
    """Check that a file from another station is of its stated kind and usable.

    Raises:
        NotAllowed: the file is damaged, or of another kind.
        OSError: the file cannot be read.
    """
    if kind == "measurement":
        measurements.unpack(path.read_bytes(), path.name)
    elif kind == "recording":
        with RecordingReader(path) as reader:
            reader.summary()


def _recording(library: RecordingLibrary, path: Path) -> Described:
    stored = library.describe(path.name)
    tags, notes = stored.remarks.tags, stored.remarks.notes
    if stored.summary is None:
        return Described(Addition(facts=sentence("problem", stored.problem)), notes, tags)
    header = stored.summary.header
    axes = [axis for axis in header.get("axes", []) if isinstance(axis, dict)]
    return Described(
        Addition(
            axis=_axis(axes[0]) if axes else AxisIdentity(),
            author=str(header.get("person", "")),
            notes=str(header.get("notes", "")),
            saved=datetime.fromtimestamp(stored.summary.clock.epoch_s, UTC),
            facts={
                "channels": len(stored.summary.channels),
                "duration_s": round(stored.summary.duration_s, 3),
                "state": stored.summary.state,
                "words": stored.words(),
            },
        ),
        notes,
        (*(str(tag) for tag in header.get("tags", [])), *tags),
    )


def _measurement(path: Path) -> Described:
    head = measurements.unpack_head(path)
    identity = head.meta.get("identity")
    facts = {"measurement": head.kind, "words": f"{head.kind} {head.drive}"}
    axis = dict(identity) if isinstance(identity, dict) else {}
    axis |= {"name": head.drive, "profile": head.meta.get("profile")}
    return Described(
        Addition(
            axis=_axis(axis),
            author=str(head.meta.get("person") or ""),
            notes=str(head.meta.get("notes") or ""),
            saved=head.saved.astimezone(UTC),
            facts=facts,
        )
    )


def _report(path: Path) -> Described:
    named = _REPORT.match(path.name)
    axis = AxisIdentity(name=named["axis"] if named else "")
    return Described(Addition(axis=axis, facts={"format": path.suffix.removeprefix(".")}))


def _axis(facts: Mapping[str, object]) -> AxisIdentity:
    """An identity from the header of a file; invalid numbers are left out."""

    def number(name: str) -> int | None:
        value = facts.get(name)
        known = isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 1 << 63
        return value if known and isinstance(value, int) else None

    return AxisIdentity(
        profile=str(facts.get("profile") or ""),
        name=str(facts.get("name") or ""),
        vendor_id=number("vendor_id"),
        product_code=number("product_code"),
        revision=number("revision"),
        serial=number("serial"),
        firmware=str(facts.get("firmware") or ""),
    )
