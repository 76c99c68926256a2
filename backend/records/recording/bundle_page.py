"""The HTML page of a support bundle, for any browser and without the station."""

from __future__ import annotations

import html
from datetime import UTC, datetime
from typing import Any

import numpy as np
import numpy.typing as npt

from backend.foundation.work.journal import Entry
from backend.records.recording.evidence import Evidence
from backend.records.recording.export import shown
from backend.records.recording.reader import RecordingReader
from backend.records.recording.table import merged

PLOT_WIDTH, PLOT_HEIGHT = 900, 120
#: Smallest number of points of a curve, and largest number of curves on the page.
LEAST_POINTS, MOST_CURVES = 3, 60


def when(epoch_s: float) -> str:
    """A time as ISO 8601, UTC."""
    return datetime.fromtimestamp(epoch_s, UTC).isoformat(timespec="milliseconds")


def log_line(entry: Entry) -> str:
    """An entry of the log as one line of text."""
    return f"{when(entry.time)} {entry.level:<7} {entry.drive or '-':<12} {entry.text}"


def page(evidence: Evidence, drawings: str) -> str:
    """The page as HTML. ``drawings``: drawings of the cyclic samples, empty without any."""
    parts = [
        f"<h1>{_e(evidence.reason)}</h1>",
        f"<p>{_e(when(evidence.time))} · servodeck {_e(evidence.version)}</p>",
        *(_axis(axis) for axis in evidence.axes),
        "<h2>Signals</h2>",
        drawings or "<p>No cyclic exchange ran.</p>",
        _polled(evidence),
        "<h2>Links</h2>",
        *(_pairs(link) for link in evidence.links),
        "<h2>Log</h2><pre>",
        *(f"{_e(log_line(entry))}\n" for entry in evidence.log),
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
        f"<td>{_e(r['error'] or when(r['time']) if r['time'] else r['error'])}"
        for r in axis["parameters"]
    )
    apart = ("parameters", "state", "past_faults")
    identity = {k: v for k, v in axis.items() if k not in apart}
    shown = {k: v for k, v in state.items() if k != "faults"}
    name = f"parameters/{axis['drive']}.csv"
    return (
        f"<h2>{_e(axis['name'])}</h2>{faults or '<p>No fault.</p>'}{_pairs(identity)}"
        f"{_remembered(axis['past_faults'])}"
        f"<details><summary>State</summary>{_pairs(shown)}</details>"
        f"<details><summary>{len(axis['parameters'])} parameters</summary>"
        f'<p><a href="{_e(name)}">{_e(name)}</a></p><table><tr><th>Key<th>Name<th>Value<th>Read'
        f"{rows}</table></details>"
    )


def _remembered(past: dict[str, Any]) -> str:
    """The drive's own fault history, with the values stored at each fault."""
    if past["why"]:
        return f"<p>Faults that the drive remembers: {_e(past['why'])}.</p>"
    rows = "".join(
        f"<tr><td>{_e(r['name'])}<td>{_e(r['code'])} {_e(r['title'])}<td>"
        + (_e(r["error"]) or "; ".join(_e(_frozen(v)) for v in r["values"]))
        for r in past["records"]
    )
    if not rows:
        return "<p>The drive remembers no fault.</p>"
    return (
        "<h3>Faults that the drive remembers</h3>"
        f"<table><tr><th>Record<th>Fault<th>Frozen with it{rows}</table>"
    )


def _frozen(value: dict[str, Any]) -> str:
    shown = f"no answer ({value['error']})" if value["error"] else f"{value['value']}"
    return f"{value['name']} {shown} {value['unit'] or ''}".strip()


def _pairs(content: dict[str, Any]) -> str:
    rows = "".join(f"<tr><th>{_e(k)}<td>{_e(v)}" for k, v in content.items())
    return f"<table>{rows}</table>"


def _e(value: object) -> str:
    return html.escape("" if value is None else str(value))


def drawings_of(reader: RecordingReader, evidence: Evidence) -> str:
    """One curve for each channel, drawn by its minimum and maximum in each pixel column."""
    parts = list(merged(reader))
    if not parts:
        return ""
    times = np.concatenate([p.time_ns for p in parts]) / 1e9
    values = np.concatenate([p.values for p in parts])
    present = np.concatenate([p.present for p in parts])
    first = min(ref.t0_s for ref in reader.index())
    mark = evidence.time - reader.clock.epoch(first)
    return "".join(
        f"<h3>{_e(column.title)}</h3>"
        f"{curve(times[present[:, n]], values[present[:, n], n] * column.factor, mark)}"
        for n, column in enumerate(shown(reader.channels))
    )


def _polled(evidence: Evidence) -> str:
    """Curves of polled values that changed, without the signals of the cyclic exchange."""
    cyclic = {(c["drive"], c["key"]) for s in evidence.streams for c in s["channels"]}
    found: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for value in evidence.history:
        number = value.value
        if isinstance(number, (int, float)) and (value.drive, value.key) not in cyclic:
            found.setdefault((value.drive, value.key), []).append((value.time, float(number)))
    reported = (
        '<p>All values that were read one by one are in <a href="history.csv">history.csv</a>'
    )
    if not evidence.history:
        return "<p>Nothing was read in the last seconds.</p>"
    first = min(value.time for value in evidence.history)
    parts: list[str] = []
    for place, rows in found.items():
        points = np.array(rows) - [first, 0.0]
        if len(rows) < LEAST_POINTS or np.ptp(points[:, 1]) == 0 or len(parts) >= MOST_CURVES:
            continue
        name = evidence.names.get(place, " ".join(place))
        drawing = curve(points[:, 0], points[:, 1], evidence.time - first)
        parts.append(f"<h3>{_e(name)}</h3>{drawing}")
    return f"{''.join(parts)}{reported}; those that changed are drawn.</p>"


def curve(times: npt.NDArray[np.float64], values: npt.NDArray[np.float64], mark_s: float) -> str:
    """An SVG of one channel, with a line at ``mark_s``; the drawing contains every peak."""
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
    at = min(max(x(mark_s), 0.0), float(PLOT_WIDTH))
    return (
        f'<svg viewBox="0 0 {PLOT_WIDTH} {PLOT_HEIGHT}" role="img" aria-label="{low:g} … {high:g}">'
        f'<line x1="{at}" x2="{at}" y1="0" y2="{PLOT_HEIGHT}" stroke="#b00020"/>'
        f'<polyline fill="none" stroke="#0b57d0" points="{" ".join(points)}"/></svg>'
        f"<p>{low:g} … {high:g}, {span_s:.3f} s</p>"
    )
