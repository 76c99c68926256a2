"""Exports of a recording: CSV, rerun's .rrd, MCAP. Run as a separate process.

    python -m backend.records.recording.export FILE.sdrec OUT (csv|csv_raw|rrd|mcap)

Prints the completed fraction, one number a line. ``csv`` and ``rrd`` are in the units that the
scope shows; ``csv_raw`` and ``mcap`` contain the values as recorded. Times are exact to a
nanosecond.
"""

from __future__ import annotations

import csv
import json
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from backend.foundation.store.spreadsheet import as_text
from backend.records.recording.reader import Channel, RecordingReader
from backend.records.recording.table import merged
from drivers.computer.processes import yield_processor
from profiles.replacing import move_into_place

#: Nice value of the process, which runs for seconds; the buses and the pages have priority.
NICE = 10
Progress = Callable[[float], None]


def export(source: Path, target: Path, kind: str, progress: Progress) -> None:
    """Write ``target``; it gets its name only when it is complete.

    Raises:
        NotAllowed, BadRecording: the source cannot be read.
        OSError: the target cannot be written.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_name(f".{target.name}.part")
    write = {"csv": to_csv, "csv_raw": to_csv_raw, "rrd": to_rrd, "mcap": to_mcap}[kind]
    try:
        with RecordingReader(source) as reader:
            write(reader, part, progress)
        move_into_place(part, target)
    finally:
        part.unlink(missing_ok=True)


@dataclass(frozen=True, slots=True)
class Column:
    """Title of a channel with its unit, and the factor from the recorded unit to it."""

    title: str
    factor: float


def shown(channels: Sequence[Channel]) -> list[Column]:
    """Columns in the units that the scope shows."""
    return [Column(_title(c.name, c.shown_unit), c.shown_factor) for c in channels]


def _title(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def to_csv(reader: RecordingReader, path: Path, progress: Progress) -> None:
    """Write a CSV file in the units that the scope shows; see `_write_csv`."""
    _write_csv(reader, path, progress, shown(reader.channels))


def to_csv_raw(reader: RecordingReader, path: Path, progress: Progress) -> None:
    """Write a CSV file with the values as recorded, in the drive's own units; see `_write_csv`."""
    columns = [Column(_title(c.name, c.unit), 1.0) for c in reader.channels]
    _write_csv(reader, path, progress, columns)


def _cell(value: float, factor: float) -> str:
    """A recorded value exactly; a converted one with 15 digits, to hide rounding of the product."""
    return repr(value) if factor == 1.0 else f"{value * factor:.15g}"


def _write_csv(
    reader: RecordingReader, path: Path, progress: Progress, columns: Sequence[Column]
) -> None:
    """Write one row for each sample time; a cell is empty where its channel has no sample."""
    factors = [column.factor for column in columns]
    summary = reader.summary()
    duration = max(summary.duration_s, 1e-9)
    marked = [n for n, s in enumerate(reader.header["streams"]) if s["synchronous"]]
    titles = {n: reader.header["streams"][n]["channels"][0]["drive_name"] for n in marked}
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        zero = datetime.fromtimestamp(summary.clock.epoch(summary.first_s or 0.0), UTC)
        out.writerow(
            [f"time_s (0 = {zero.isoformat()})", *(as_text(column.title) for column in columns)]
            + [as_text(f"{titles[n]} valid") for n in marked]
        )
        for rows in merged(reader):
            times = (rows.time_ns / 1e9).tolist()
            values, present = rows.values.tolist(), rows.present.tolist()
            valid = rows.valid[:, marked].tolist()
            for t, row, here, good in zip(times, values, present, valid, strict=True):
                cells = [
                    _cell(v, factor) if is_here else ""
                    for v, is_here, factor in zip(row, here, factors, strict=True)
                ]
                out.writerow([repr(t), *cells, *("" if g < 0 else g for g in good)])
            progress(float(rows.time_ns[-1]) / 1e9 / duration)


def epoch_ns(
    reader: RecordingReader, times_s: np.ndarray[tuple[int], np.dtype[np.float64]]
) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Times in ns since 1970 as integers; a float of this size only resolves 240 ns."""
    start = round(reader.clock.epoch_s * 1e9)
    since = np.rint((times_s - reader.clock.sample_s) * 1e9).astype(np.int64)
    return np.asarray(since + start, dtype=np.int64)


def to_mcap(reader: RecordingReader, path: Path, progress: Progress) -> None:
    """Write an MCAP file: one topic for each stream, with one JSON message for each sample time."""
    from mcap.writer import Writer

    total = max(1, reader.summary().samples)
    done = 0
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="", library="servodeck")
        topics = {}
        for number, stream in enumerate(reader.header["streams"]):
            mine = [c for c in reader.channels if c.stream == number]
            schema = {
                "type": "object",
                "properties": {c.name: {"type": ["number", "null"], "unit": c.unit} for c in mine}
                | {"valid": {"type": "boolean"}},
            }
            schema_id = writer.register_schema(
                f"stream{number}", "jsonschema", json.dumps(schema).encode()
            )
            kind = "cyclic" if stream["synchronous"] else "polled"
            topics[number] = (
                writer.register_channel(f"/{mine[0].drive}/{kind}", "json", schema_id),
                [c.name for c in mine],
            )
        events = writer.register_schema("event", "jsonschema", b'{"type": "object"}')
        events_id = writer.register_channel("/events", "json", events)
        writer.add_metadata("servodeck", {"header": json.dumps(reader.header)})
        for block in reader.blocks():
            channel_id, names = topics[block.stream]
            valid = None if block.valid is None else block.valid.tolist()
            times = epoch_ns(reader, block.times_s).tolist()
            for n, (ns, row) in enumerate(zip(times, block.values.tolist(), strict=True)):
                message: dict[str, object] = {
                    name: v if math.isfinite(v) else None
                    for name, v in zip(names, row, strict=True)
                }
                if valid is not None:
                    message["valid"] = valid[n]
                writer.add_message(channel_id, ns, json.dumps(message).encode(), ns, block.sequence)
            done += len(times)
            progress(done / total)
        for number, event in enumerate(reader.events()):
            ns = int(epoch_ns(reader, np.array([float(event.get("t_s", 0.0))]))[0])
            writer.add_message(events_id, ns, json.dumps(event).encode(), ns, number)
        writer.finish()  # type: ignore[no-untyped-call]


def to_rrd(reader: RecordingReader, path: Path, progress: Progress) -> None:
    """Write a .rrd file: one entity for each drive and unit, a text log of events, the layout."""
    import rerun as rr

    from backend.records.recording import rerun_layout

    total = max(1, reader.summary().samples)
    arranged = rerun_layout.plots(reader.channels)
    recording = rr.RecordingStream(rerun_layout.APPLICATION, recording_id=reader.path.stem)
    recording.save(path, default_blueprint=rerun_layout.blueprint(arranged, follow=False))
    rerun_layout.send_names(recording, arranged)
    done = 0
    for block in reader.blocks():
        times = epoch_ns(reader, block.times_s)
        for plot in arranged:
            if plot.stream == block.stream:
                columns = block.values[:, list(plot.columns)]
                rerun_layout.send_samples(recording, plot, times, columns)
        done += len(times)
        progress(done / total)
    for event in reader.events():
        ns = int(epoch_ns(reader, np.array([float(event.get("t_s", 0.0))]))[0])
        rerun_layout.send_event(
            recording, ns, str(event.get("text", event)), str(event.get("level", "info"))
        )
    recording.disconnect()


def main() -> int:
    """The process of an export."""
    yield_processor(NICE)
    source, target, kind = sys.argv[1:4]
    last = -1.0

    def progress(fraction: float) -> None:
        nonlocal last
        if fraction - last >= 0.01:
            last = fraction
            sys.stdout.write(f"{fraction:.3f}\n")
            sys.stdout.flush()

    export(Path(source), Path(target), kind, progress)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
