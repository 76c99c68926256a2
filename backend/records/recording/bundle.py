"""Support bundles: a zip with all data about one moment, and an HTML page that shows them."""

from __future__ import annotations

import asyncio
import csv
import io
import json
import os
import pickle
import sys
import tempfile
import zipfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from backend.foundation.store.files import StorageFailed
from backend.foundation.store.spreadsheet import as_text
from backend.foundation.work.child import run_child
from backend.records.recording import chunks
from backend.records.recording.bundle_page import LOGS, PAGES, drawings_of, log_line, page, when
from backend.records.recording.evidence import Evidence, Value
from backend.records.recording.export import NICE, to_csv
from backend.records.recording.reader import RecordingReader
from drivers.computer.processes import yield_processor
from drivers.texts.answers import sentence
from profiles.replacing import move_into_place


async def build_apart(evidence: Evidence, target: Path) -> None:
    """`build` without blocking the server: in a separate process where there are cyclic samples.

    Raises:
        StorageFailed: the bundle cannot be written.
    """
    if not evidence.blocks:
        await asyncio.to_thread(build, evidence, target)
        return
    sent = await asyncio.to_thread(pickle.dumps, evidence)
    answer = await run_child("backend.records.recording.bundle", str(target), sent=sent)
    if answer.exit_code != 0:
        raise _failed(target, answer.last_line)


def build(evidence: Evidence, target: Path) -> None:
    """Write the zip; it gets its name only when it is complete. Blocking.

    Raises:
        StorageFailed: the bundle cannot be written.
    """
    try:
        _build(evidence, target)
    except OSError as error:
        raise _failed(target, error.strerror or str(error)) from error


def _build(evidence: Evidence, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=".bundle-") as folder:
        part = Path(folder) / "bundle.zip"
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED, compresslevel=3) as archive:
            _fill(archive, evidence, Path(folder))
        # Open for writing, which flushing on Windows asks for (FlushFileBuffers).
        with part.open("r+b") as file:
            os.fsync(file.fileno())
        move_into_place(part, target)


def _failed(target: Path, why: str) -> StorageFailed:
    return StorageFailed(
        "recording.support-bundle-not-written", value=str(target), target=target.name, why=why
    )


def _fill(archive: zipfile.ZipFile, evidence: Evidence, folder: Path) -> None:
    drawings = dict.fromkeys(PAGES, "")
    if evidence.blocks:
        recording = folder / f"samples{chunks.SUFFIX}"
        recording.write_bytes(_recording(evidence))
        archive.write(recording, recording.name)
        with RecordingReader(recording) as reader:
            to_csv(reader, folder / "samples.csv", lambda _fraction: None)
            drawings = {each: drawings_of(reader, evidence, each) for each in PAGES}
        archive.write(folder / "samples.csv", "samples.csv")
    for axis in evidence.axes:
        archive.writestr(f"parameters/{axis['drive']}.csv", _parameters(axis))
    for name, data in evidence.frames.items():
        archive.writestr(f"frames/{name}", data)
    facts = {
        **sentence("reason", evidence.reason),
        "time": evidence.time,
        "servodeck": evidence.version,
        "axes": list(evidence.axes),
        "links": list(evidence.links),
    }
    archive.writestr("facts.json", json.dumps(facts, indent=1, ensure_ascii=False, default=str))
    archive.writestr("history.csv", _history(evidence.history))
    for language, name in PAGES.items():
        log = "".join(f"{log_line(entry, language)}\n" for entry in evidence.log)
        archive.writestr(LOGS[language], log)
        archive.writestr(name, page(evidence, drawings[language], language))


def _recording(evidence: Evidence) -> bytes:
    header = {
        "format": 1,
        "servodeck": evidence.version,
        "created": evidence.time,
        "clock": evidence.clock,
        "notes": evidence.reason.words(),
        "axes": list(evidence.axes),
        "streams": list(evidence.streams),
    }
    data = [chunks.MAGIC, json_header(header)]
    data += [chunks.samples_chunk(number, block) for number, block in evidence.blocks]
    return b"".join(data)


def json_header(header: dict[str, Any]) -> bytes:
    """The header chunk; values that JSON has no type for, such as dates, become text."""
    plain = json.loads(json.dumps(header, default=str))
    return chunks.json_chunk(chunks.HEADER, plain)


def _table(titles: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    text = io.StringIO()
    out = csv.writer(text)
    out.writerow(titles)
    out.writerows([as_text(c) if isinstance(c, str) else c for c in row] for row in rows)
    return text.getvalue()


def _parameters(axis: dict[str, Any]) -> str:
    titles = ("key", "name", "raw", "value", "unit", "time", "error")
    return _table(titles, ([row[t] for t in titles] for row in axis["parameters"]))


def _history(values: Sequence[Value]) -> str:
    rows = ((when(v.time), v.drive, v.key, v.value) for v in values)
    return _table(("time", "drive", "key", "value"), rows)


def main() -> int:
    """The process of `build_apart`; it reads the evidence from standard input."""
    yield_processor(NICE)
    evidence = pickle.load(sys.stdin.buffer)  # noqa: S301 - from the server that started us
    try:
        _build(evidence, Path(sys.argv[1]))
    except OSError as error:
        sys.stderr.write(error.strerror or str(error))
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
