"""Support bundles: a zip with everything about a moment, and a page to read it by."""

from __future__ import annotations

import csv
import html
import io
import json
import os
import tempfile
import zipfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from backend.files import StorageFailed
from backend.journal import Entry
from backend.recording import chunks
from backend.recording.export import labels, to_csv
from backend.recording.reader import RecordingReader
from backend.recording.table import merged
from drivers.link import ScopeBlock

PLOT_WIDTH, PLOT_HEIGHT = 900, 120


@dataclass(frozen=True, slots=True)
class Value:
    """One reading of the history; ``time`` in epoch seconds."""

    time: float
    drive: str
    key: str
    value: float | int | str | None


@dataclass(frozen=True, slots=True)
class Evidence:
    """What goes into a bundle. ``axes``: identity, state and parameters of each."""

    reason: str
    time: float
    version: str
    axes: Sequence[dict[str, Any]]
    links: Sequence[dict[str, Any]]
    log: Sequence[Entry]
    history: Sequence[Value]
    streams: Sequence[dict[str, Any]]
    blocks: Sequence[tuple[int, ScopeBlock]]
    clock: dict[str, float]


def build(evidence: Evidence, target: Path) -> None:
    """Write the zip; it appears when it is whole. Blocking.

    Raises:
        StorageFailed: the disk does not take it.
    """
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent, prefix=".bundle-") as folder:
            part = Path(folder) / "bundle.zip"
            with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED, compresslevel=3) as archive:
                _fill(archive, evidence, Path(folder))
            with part.open("rb") as file:
                os.fsync(file.fileno())
            part.replace(target)
    except OSError as error:
        raise StorageFailed(
            f"the support bundle {target.name} could not be written: {error.strerror or error}",
            value=str(target),
            remedy="free some space, then make one by hand",
        ) from error


def _fill(archive: zipfile.ZipFile, evidence: Evidence, folder: Path) -> None:
    drawings = ""
    if evidence.blocks:
        recording = folder / f"samples{chunks.SUFFIX}"
        recording.write_bytes(_recording(evidence))
        archive.write(recording, recording.name)
        with RecordingReader(recording) as reader:
            to_csv(reader, folder / "samples.csv", lambda _fraction: None)
            drawings = _drawings(reader, evidence)
        archive.write(folder / "samples.csv", "samples.csv")
    for axis in evidence.axes:
        archive.writestr(f"parameters/{axis['drive']}.csv", _parameters(axis))
    facts = {
        "reason": evidence.reason,
        "time": evidence.time,
        "servodeck": evidence.version,
        "axes": list(evidence.axes),
        "links": list(evidence.links),
    }
    archive.writestr("facts.json", json.dumps(facts, indent=1, ensure_ascii=False, default=str))
    archive.writestr("log.txt", "".join(f"{line}\n" for line in map(_log_line, evidence.log)))
    archive.writestr("history.csv", _history(evidence.history))
    archive.writestr("index.html", _page(evidence, drawings))


def _recording(evidence: Evidence) -> bytes:
    header = {
        "format": 1,
        "servodeck": evidence.version,
        "created": evidence.time,
        "clock": evidence.clock,
        "notes": evidence.reason,
        "axes": list(evidence.axes),
        "streams": list(evidence.streams),
    }
    data = [chunks.MAGIC, json_header(header)]
    data += [chunks.samples_chunk(number, block) for number, block in evidence.blocks]
    return b"".join(data)


def json_header(header: dict[str, Any]) -> bytes:
    """The header chunk; dates and the like become text."""
    plain = json.loads(json.dumps(header, default=str))
    return chunks.json_chunk(chunks.HEADER, plain)


def _table(titles: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    text = io.StringIO()
    out = csv.writer(text)
    out.writerow(titles)
    out.writerows(rows)
    return text.getvalue()


def _parameters(axis: dict[str, Any]) -> str:
    titles = ("key", "name", "raw", "value", "unit", "time", "error")
    return _table(titles, ([row[t] for t in titles] for row in axis["parameters"]))


def _history(values: Sequence[Value]) -> str:
    rows = ((_when(v.time), v.drive, v.key, v.value) for v in values)
    return _table(("time", "drive", "key", "value"), rows)


def _when(epoch_s: float) -> str:
    return datetime.fromtimestamp(epoch_s, UTC).isoformat(timespec="milliseconds")


def _log_line(entry: Entry) -> str:
    return f"{_when(entry.time)} {entry.level:<7} {entry.drive or '-':<12} {entry.text}"


# --- the page ---------------------------------------------------------------------------


def _page(evidence: Evidence, drawings: str) -> str:
    parts = [
        f"<h1>{_e(evidence.reason)}</h1>",
        f"<p>{_e(_when(evidence.time))} · servodeck {_e(evidence.version)}</p>",
        *(_axis(axis) for axis in evidence.axes),
        "<h2>Signals</h2>",
        drawings
        or "<p>No cyclic exchange ran; the values that were polled are in "
        '<a href="history.csv">history.csv</a>.</p>',
        "<h2>Links</h2>",
        *(_pairs(link) for link in evidence.links),
        "<h2>Log</h2><pre>",
        *(f"{_e(_log_line(entry))}\n" for entry in evidence.log),
        "</pre>",
    ]
    files = "".join(
        f'<li><a href="{name}">{name}</a>: {what}</li>'
        for name, what in (
            ("facts.json", "everything of this page for programs"),
            ("history.csv", "every value read in the last seconds"),
            ("log.txt", "the log of the station"),
            *(
                (("samples.csv", "cyclic samples"), ("samples.sdrec", "the same as a recording"))
                if evidence.blocks
                else ()
            ),
        )
    )
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8"><title>Support bundle</title>'
        "<style>body{font:15px/1.45 system-ui,sans-serif;max-width:960px;margin:2em auto;"
        "padding:0 1em}table{border-collapse:collapse}td,th{border:1px solid #bbb;"
        "padding:2px 8px;text-align:left;vertical-align:top}pre{overflow:auto;font-size:12px}"
        ".fault{border-left:5px solid #b00020;padding-left:12px}svg{width:100%;height:auto;"
        "border:1px solid #bbb}</style>" + "".join(parts) + f"<h2>Files</h2><ul>{files}</ul></html>"
    )


def _axis(axis: dict[str, Any]) -> str:
    state = axis["state"]
    faults = "".join(
        f'<div class="fault"><h3>{_e(f["kind"])} {_e(f["code"])} {_e(f["name"])}</h3>'
        f"<p>Causes: {_e('; '.join(f['causes']) or '-')}</p>"
        f"<p>Remedies: {_e('; '.join(f['remedies']) or '-')}</p>"
        f"<p>Source: {_e(f['source'])}</p></div>"
        for f in state["faults"]
    )
    rows = "".join(
        f"<tr><td>{_e(r['key'])}<td>{_e(r['name'])}<td>{_e(r['value'])} {_e(r['unit'])}"
        f"<td>{_e(r['error'] or _when(r['time']) if r['time'] else r['error'])}"
        for r in axis["parameters"]
    )
    identity = {k: v for k, v in axis.items() if k not in ("parameters", "state")}
    shown = {k: v for k, v in state.items() if k != "faults"}
    name = f"parameters/{axis['drive']}.csv"
    return (
        f"<h2>{_e(axis['name'])}</h2>{faults or '<p>No fault.</p>'}{_pairs(identity)}"
        f"<details><summary>State</summary>{_pairs(shown)}</details>"
        f"<details><summary>{len(axis['parameters'])} parameters</summary>"
        f'<p><a href="{_e(name)}">{_e(name)}</a></p><table><tr><th>Key<th>Name<th>Value<th>Read'
        f"{rows}</table></details>"
    )


def _pairs(content: dict[str, Any]) -> str:
    rows = "".join(f"<tr><th>{_e(k)}<td>{_e(v)}" for k, v in content.items())
    return f"<table>{rows}</table>"


def _e(value: object) -> str:
    return html.escape("" if value is None else str(value))


def _drawings(reader: RecordingReader, evidence: Evidence) -> str:
    """One curve for each channel, drawn by its least and greatest value in each column."""
    parts = list(merged(reader))
    if not parts:
        return ""
    times = np.concatenate([p.time_ns for p in parts]) / 1e9
    values = np.concatenate([p.values for p in parts])
    present = np.concatenate([p.present for p in parts])
    first = min(ref.t0_s for ref in reader.index())
    mark = evidence.time - reader.clock.epoch(first)
    return "".join(
        f"<h3>{_e(label)}</h3>{curve(times[present[:, n]], values[present[:, n], n], mark)}"
        for n, label in enumerate(labels(reader.channels))
    )


def curve(times: npt.NDArray[np.float64], values: npt.NDArray[np.float64], mark_s: float) -> str:
    """An SVG of one channel, with a line at ``mark_s``; no peak is lost to the drawing."""
    good = np.isfinite(values)
    times, values = times[good], values[good]
    if not len(times):
        return "<p>No samples.</p>"
    low, high = float(values.min()), float(values.max())
    span_s = max(float(times[-1] - times[0]), 1e-9)
    span = (high - low) or 1.0

    def x(t: float) -> float:
        return round((t - float(times[0])) / span_s * PLOT_WIDTH, 1)

    def y(v: float) -> float:
        return round(PLOT_HEIGHT - 4 - (v - low) / span * (PLOT_HEIGHT - 8), 1)

    columns = np.minimum(((times - times[0]) / span_s * PLOT_WIDTH).astype(int), PLOT_WIDTH - 1)
    points = []
    starts = np.flatnonzero(np.diff(columns, prepend=-1))
    for begin, end in zip(starts, [*starts[1:], len(times)], strict=True):
        part = values[begin:end]
        for place in sorted({0, int(part.argmin()), int(part.argmax()), len(part) - 1}):
            points.append(f"{x(float(times[begin + place]))},{y(float(part[place]))}")
    at = x(mark_s)
    return (
        f'<svg viewBox="0 0 {PLOT_WIDTH} {PLOT_HEIGHT}" role="img" aria-label="{low:g} … {high:g}">'
        f'<line x1="{at}" x2="{at}" y1="0" y2="{PLOT_HEIGHT}" stroke="#b00020"/>'
        f'<polyline fill="none" stroke="#0b57d0" points="{" ".join(points)}"/></svg>'
        f"<p>{low:g} … {high:g}, {span_s:.3f} s</p>"
    )
