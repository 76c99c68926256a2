"""The HTML page of a support bundle, for any browser and without the station."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np
import numpy.typing as npt

from backend.foundation.work.journal import Entry
from backend.records.recording.evidence import Evidence
from backend.records.recording.export import shown
from backend.records.recording.reader import RecordingReader
from backend.records.recording.table import merged
from drivers.texts.answers import in_language, message_in
from drivers.texts.message import Language, Text, text
from drivers.texts.profile_words import ProfileWords

#: Files of the bundle that people read, and the language that they state.
PAGES: dict[Language, str] = {"en": "index.html", "zh": "index.zh.html"}
LOGS: dict[Language, str] = {"en": "log.txt", "zh": "log.zh.txt"}
LOCALES: dict[Language, str] = {"en": "en", "zh": "zh-Hans"}
PLOT_WIDTH, PLOT_HEIGHT = 900, 120
#: Smallest number of points of a curve, and largest number of curves on the page.
LEAST_POINTS, MOST_CURVES = 3, 60


def when(epoch_s: float) -> str:
    """A time as ISO 8601, UTC."""
    return datetime.fromtimestamp(epoch_s, UTC).isoformat(timespec="milliseconds")


def log_line(entry: Entry, language: Language) -> str:
    """An entry of the log as one line of text."""
    words = entry.message.words(language)
    return f"{when(entry.time)} {entry.level:<7} {entry.drive or '-':<12} {words}"


def page(evidence: Evidence, drawings: str, language: Language) -> str:
    """The page as HTML. ``drawings``: drawings of the cyclic samples, empty without any."""
    say = _Words(language)
    parts = [
        f'<p class="languages">{_languages(language)}</p>',
        f"<h1>{_e(evidence.reason.words(language))}</h1>",
        f"<p>{_e(when(evidence.time))} · servodeck {_e(evidence.version)}</p>",
        *(_axis(axis, say) for axis in evidence.axes),
        f"<h2>{say(text('bundle.signals'))}</h2>",
        drawings or f"<p>{say(text('bundle.no-exchange'))}</p>",
        _polled(evidence, say),
        f"<h2>{say(text('bundle.links'))}</h2>",
        *(_pairs(link, say) for link in evidence.links),
        f"<h2>{say(text('bundle.log'))}</h2><pre>",
        *(f"{_e(log_line(entry, language))}\n" for entry in evidence.log),
        "</pre>",
    ]
    files = "".join(
        f'<li><a href="{_e(name)}">{_e(name)}</a>: {say(what)}</li>'
        for name, what in (
            ("facts.json", text("bundle.everything")),
            ("history.csv", text("bundle.history")),
            (LOGS[language], text("bundle.log-file")),
            *((f"frames/{name}", text("bundle.frames")) for name in evidence.frames),
            *(
                (
                    ("samples.csv", text("bundle.cyclic")),
                    ("samples.sdrec", text("bundle.same-recording")),
                )
                if evidence.blocks
                else ()
            ),
        )
    )
    return (
        f'<!doctype html><html lang="{LOCALES[language]}"><meta charset="utf-8">'
        f"<title>{say(text('bundle.title'))}</title>"
        "<style>body{font:15px/1.45 system-ui,sans-serif;max-width:960px;margin:2em auto;"
        "padding:0 1em}table{border-collapse:collapse}td,th{border:1px solid #bbb;"
        "padding:2px 8px;text-align:left;vertical-align:top}pre{overflow:auto;font-size:12px}"
        ".fault{border-left:5px solid #b00020;padding-left:12px}svg{width:100%;height:auto;"
        "border:1px solid #bbb}.languages{text-align:right}</style>"
        + "".join(parts)
        + f"<h2>{say(text('bundle.files'))}</h2><ul>{files}</ul></html>"
    )


class _Words:
    """Messages in one language, ready for the page."""

    def __init__(self, language: Language) -> None:
        self.language = language

    def __call__(self, message: Text) -> str:
        return _e(message.words(self.language))

    def yes_or_no(self, value: bool) -> str:
        return (text("bundle.yes") if value else text("bundle.no")).words(self.language)


def _languages(shown: Language) -> str:
    """The page in each language; a link where it is not the present one."""
    names: dict[Language, str] = {"en": "English", "zh": "中文"}
    return " · ".join(
        name
        if language == shown
        else f'<a href="{PAGES[language]}" lang="{LOCALES[language]}">{name}</a>'
        for language, name in names.items()
    )


def _axis(axis: dict[str, Any], say: _Words) -> str:
    state = axis["state"]
    of_profile = ProfileWords(str(axis.get("profile", "")), say.language)
    joint = "；" if say.language == "zh" else "; "
    kinds = {"fault": text("bundle.fault"), "warning": text("bundle.warning")}

    def listed(sentences: Sequence[str]) -> str:
        return joint.join(map(of_profile, sentences)) or "-"

    faults = "".join(
        f'<div class="fault"><h3>{say(kinds[f["kind"]])} {_e(f["code"])}'
        f" {_e(of_profile(f['name']))}</h3>"
        f"<p>{say(text('bundle.causes', causes=listed(f['causes'])))}</p>"
        f"<p>{say(text('bundle.remedies', remedies=listed(f['remedies'])))}</p>"
        f"<p>{say(text('bundle.source', source=f['source']))}</p></div>"
        for f in state["faults"]
    )
    rows = "".join(_parameter(row, of_profile, say) for row in axis["parameters"])
    titles = (
        text("bundle.column-key"),
        text("bundle.column-name"),
        text("bundle.column-value"),
        text("bundle.column-read"),
    )
    apart = ("parameters", "state", "past_faults")
    identity = {k: v for k, v in axis.items() if k not in apart}
    units = state.get("units", {})
    values = {k: v for k, v in state.items() if k not in ("faults", "units")}
    values["values"] = {
        name: f"{value:g} {units.get(name, '')}".strip()
        for name, value in state.get("values", {}).items()
        if value is not None
    }
    name = f"parameters/{axis['drive']}.csv"
    count = text("bundle.parameters", count=len(axis["parameters"]))
    no_fault = f"<p>{say(text('bundle.no-fault'))}</p>"
    return (
        f"<h2>{_e(axis['name'])}</h2>{faults or no_fault}{_pairs(identity, say)}"
        f"{_remembered(axis['past_faults'], of_profile, say)}"
        f"<details><summary>{say(text('bundle.state'))}</summary>{_pairs(values, say)}</details>"
        f"<details><summary>{say(count)}</summary>"
        f'<p><a href="{_e(name)}">{_e(name)}</a></p><table><tr>{_titles(titles, say)}'
        f"{rows}</table></details>"
    )


def _parameter(row: dict[str, Any], of_profile: ProfileWords, say: _Words) -> str:
    problem = message_in(row, "error")
    read = say(problem) if problem else _e(when(row["time"]) if row["time"] else "")
    return (
        f"<tr><td>{_e(row['key'])}<td>{_e(of_profile(row['name']))}"
        f"<td>{_e(row['value'])} {_e(row['unit'])}<td>{read}"
    )


def _titles(titles: Sequence[Text], say: _Words) -> str:
    return "".join(f"<th>{say(each)}" for each in titles)


def _remembered(past: dict[str, Any], of_profile: ProfileWords, say: _Words) -> str:
    """The drive's own fault history, with the values stored at each fault."""
    if (why := message_in(past, "why")) is not None:
        return f"<p>{say(text('bundle.not-remembered', why=why))}</p>"
    rows = "".join(_record(record, of_profile, say) for record in past["records"])
    if not rows:
        return f"<p>{say(text('bundle.none-remembered'))}</p>"
    titles = (
        text("bundle.column-record"),
        text("bundle.column-fault"),
        text("bundle.column-frozen"),
    )
    return (
        f"<h3>{say(text('bundle.faults-remembered'))}</h3>"
        f"<table><tr>{_titles(titles, say)}{rows}</table>"
    )


def _record(record: dict[str, Any], of_profile: ProfileWords, say: _Words) -> str:
    name, problem = message_in(record, "name"), message_in(record, "error")
    frozen = "; ".join(_frozen(value, of_profile, say) for value in record["values"])
    return (
        f"<tr><td>{say(name) if name else ''}<td>{_e(record['code'])}"
        f" {_e(of_profile(record['title']))}<td>{say(problem) if problem else frozen}"
    )


def _frozen(value: dict[str, Any], of_profile: ProfileWords, say: _Words) -> str:
    problem = message_in(value, "error")
    shown = say(text("bundle.no-answer", why=problem)) if problem else _e(value["value"])
    return f"{_e(of_profile(value['name']))} {shown} {_e(value['unit'])}".strip()


#: What stands under these names in the facts of an axis or of a link.
_NAMES: dict[str, Text] = {
    "blocked_by": text("bundle.name-blocked-by"),
    "connected": text("bundle.name-connected"),
    "crc_errors": text("bundle.name-crc-errors"),
    "details": text("bundle.name-details"),
    "drive": text("bundle.name-drive"),
    "firmware": text("bundle.name-firmware"),
    "framing_errors": text("bundle.name-framing-errors"),
    "fresh": text("bundle.name-fresh"),
    "internal_limit": text("bundle.name-internal-limit"),
    "lost_frames": text("bundle.name-lost-frames"),
    "mode": text("bundle.name-mode"),
    "mode_bits": text("bundle.name-mode-bits"),
    "name": text("bundle.name-name"),
    "notes": text("bundle.name-notes"),
    "ports": text("bundle.name-ports"),
    "problem": text("bundle.name-problem"),
    "profile": text("bundle.name-profile"),
    "retries": text("bundle.name-retries"),
    "round_trip_ms": text("bundle.name-round-trip"),
    "serial": text("bundle.name-serial"),
    "state": text("bundle.name-state"),
    "station": text("bundle.name-station"),
    "status_word": text("bundle.name-status-word"),
    "target_reached": text("bundle.name-target-reached"),
    "time": text("bundle.name-time"),
    "timeouts": text("bundle.name-timeouts"),
    "title": text("bundle.name-title"),
    "transactions": text("bundle.name-transactions"),
    "turning": text("bundle.name-turning"),
    "url": text("bundle.name-url"),
    "values": text("bundle.name-values"),
    "position": text("bundle.name-position"),
    "velocity": text("bundle.name-velocity"),
    "torque": text("bundle.name-torque"),
    "following_error": text("bundle.name-following-error"),
    "dc_voltage": text("bundle.name-dc-voltage"),
    "temperature": text("bundle.name-temperature"),
    "wkc_errors": text("bundle.name-wkc-errors"),
}


def _pairs(content: dict[str, Any], say: _Words) -> str:
    rows = "".join(
        f"<tr><th>{_named(name, say)}<td>{shown}"
        for name, value in in_language(content, say.language).items()
        if not name.endswith(("_message", "_messages"))
        if (shown := _shown(name, value, say))
    )
    return f"<table>{rows}</table>"


def _named(name: str, say: _Words) -> str:
    known = _NAMES.get(name)
    return say(known) if known else _e(name)


def _shown(name: str, value: object, say: _Words) -> str:
    """A value of the facts: lists one below the other, maps as their entries."""
    if name == "time" and isinstance(value, (int, float)):
        return _e(when(value))
    if isinstance(value, bool):
        return _e(say.yes_or_no(value))
    if name == "status_word" and isinstance(value, int):
        return f"0x{value:04X}"
    if isinstance(value, Mapping):
        entries = ((str(each), value[each]) for each in value)
        return ", ".join(f"{_named(k, say)} {_shown(k, v, say)}" for k, v in entries)
    if isinstance(value, (list, tuple)):
        return "<br>".join(_shown("", each, say) for each in value)
    return f"{value:g}" if isinstance(value, float) else _e(value)


def _e(value: object) -> str:
    return html.escape("" if value is None else str(value))


def drawings_of(reader: RecordingReader, evidence: Evidence, language: Language) -> str:
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
        f"{curve(times[present[:, n]], values[present[:, n], n] * column.factor, mark, language)}"
        for n, column in enumerate(shown(reader.channels))
    )


def _polled(evidence: Evidence, say: _Words) -> str:
    """Curves of polled values that changed, without the signals of the cyclic exchange."""
    cyclic = {(c["drive"], c["key"]) for s in evidence.streams for c in s["channels"]}
    found: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for value in evidence.history:
        number = value.value
        if isinstance(number, (int, float)) and (value.drive, value.key) not in cyclic:
            found.setdefault((value.drive, value.key), []).append((value.time, float(number)))
    if not evidence.history:
        return f"<p>{say(text('bundle.nothing-read'))}</p>"
    file = "history.csv"
    reported = say(text("bundle.polled", file=file)).replace(file, f'<a href="{file}">{file}</a>')
    first = min(value.time for value in evidence.history)
    parts: list[str] = []
    for place, rows in found.items():
        points = np.array(rows) - [first, 0.0]
        if len(rows) < LEAST_POINTS or np.ptp(points[:, 1]) == 0 or len(parts) >= MOST_CURVES:
            continue
        named = evidence.names.get(place)
        name = named.words(say.language) if named else " ".join(place)
        drawing = curve(points[:, 0], points[:, 1], evidence.time - first, say.language)
        parts.append(f"<h3>{_e(name)}</h3>{drawing}")
    return f"{''.join(parts)}<p>{reported}</p>"


def curve(
    times: npt.NDArray[np.float64],
    values: npt.NDArray[np.float64],
    mark_s: float,
    language: Language = "en",
) -> str:
    """An SVG of one channel, with a line at ``mark_s``; the drawing contains every peak."""
    good = np.isfinite(values)
    times, values = times[good], values[good]
    if not len(times):
        return f"<p>{_e(text('bundle.no-samples').words(language))}</p>"
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
