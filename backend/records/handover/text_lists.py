"""Start-up lists as text: CODESYS, CSV, IgH shell script, DCF and a Python script."""

from __future__ import annotations

import csv
import io
import struct
from datetime import UTC, datetime

from backend.foundation.store.spreadsheet import as_text
from backend.records.handover.model import AxisHandover, StartupWrite
from profiles.importer import export_dcf
from profiles.schema import Parameter, Raw

#: Columns of CODESYS's page "Startup parameters" of an EtherCAT slave, in its order.
CODESYS_COLUMNS = (
    "Line", "Index:Subindex", "Name", "Value", "Bit length", "Abort on error",
    "Jump to line on error", "Next line", "Comment",
)  # fmt: skip
CSV_COLUMNS = (
    "key", "index", "subindex", "type", "bytes", "raw", "data", "transition", "value", "unit",
    "name",
)  # fmt: skip
#: Neither ethercat_driver_ros2 nor all versions of `ethercat download` accept a REAL32: its four
#: bytes are handed over as an integer, which results in the same bytes.
_AS_NUMBER = {"REAL32": "uint32", "BOOL": "uint8"}


def number_type(write: StartupWrite) -> str:
    """Name of the type for `ethercat download` and ethercat_driver_ros2."""
    return _AS_NUMBER.get(write.type, write.type.lower())


def number_of(write: StartupWrite) -> int:
    """Value as an integer of `number_type`."""
    return write.number if write.type in _AS_NUMBER else int(write.raw)


def line_of(text: str) -> str:
    """A text as one line without control characters, so that it cannot add lines to a file."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def _cell(text: str) -> str:
    """A cell of one line that a spreadsheet does not interpret as a formula."""
    return as_text(line_of(text))


def codesys(axis: AxisHandover) -> bytes:
    """Rows for CODESYS's start-up parameters; values as IEC 61131-3 hexadecimal numbers."""
    text = io.StringIO()
    table = csv.writer(text, delimiter=";", lineterminator="\r\n")
    table.writerow(CODESYS_COLUMNS)
    for line, write in enumerate(axis.writes, 1):
        bits = 8 * len(write.data)
        value = f"16#{write.number:0{bits // 4}X}"
        table.writerow([
            line, f"16#{write.index:04X}:16#{write.subindex:02X}", _cell(write.name), value, bits,
            "FALSE", "FALSE", 0, write.key,
        ])  # fmt: skip
    return text.getvalue().encode("utf-8-sig")


def csv_table(axis: AxisHandover) -> bytes:
    """A table for people; ``data``: the bytes in the order of transmission."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\r\n")
    table.writerow(CSV_COLUMNS)
    for write in axis.writes:
        parameter = axis.profile.by_key[write.key]
        table.writerow([
            write.key, f"0x{write.index:04X}", f"0x{write.subindex:02X}", write.type,
            len(write.data), write.raw, write.data.hex(" "), write.transition,
            parameter.to_value(write.raw), _cell(parameter.unit), _cell(write.name),
        ])  # fmt: skip
    return text.getvalue().encode("utf-8-sig")


def igh(axis: AxisHandover) -> bytes:
    """Shell script of `ethercat download` commands; it ends at the first write that fails."""
    lines = [
        "#!/bin/sh",
        f"# Start-up values of {line_of(axis.name)}, to be written in Pre-Operational.",
        *(f"# {line_of(note.words())}" for note in axis.notes),
        'POS="${1:?usage: $0 POSITION}"',
        "set -eu",
        "# The state is left as it is: taking a running axis out of Operational would stop it.",
        'ethercat slaves -p "$POS" | grep -q " PREOP " || {',
        '  echo "slave $POS is not in Pre-Operational; nothing was written" >&2; exit 1; }',
    ]
    for write in axis.writes:
        lines += [
            f"# {write.key} {line_of(write.name)}",
            f'ethercat download -p "$POS" -t {number_type(write)} 0x{write.index:04X} '
            f"0x{write.subindex:02X} -- {number_of(write)}",
        ]
    return "\n".join([*lines, ""]).encode()


def dcf(
    axis: AxisHandover, file_name: str, saved: datetime | None, *, reals_as_bits: bool = False
) -> bytes:
    """Device configuration file (CiA 306-1), dated as the set, so that output is reproducible."""
    values = {write.key: write.raw for write in axis.writes}
    created = saved or datetime(2000, 1, 1, tzinfo=UTC)
    known = axis.profile.identity
    identity = known.model_copy(
        update={
            "vendor_id": axis.vendor_id,
            "product_code": axis.product_code,
            "revision": axis.revision if axis.revision is not None else known.revision,
        }
    )
    return export_dcf(
        axis.profile.model_copy(update={"identity": identity}),
        values,
        created,
        file_name=file_name,
        node_name=line_of(axis.name),
        reals_as_bits=reals_as_bits,
    ).encode()


def concise_dcf(axis: AxisHandover) -> bytes:
    """Contents of 1F22h (CiA 302-3): count, then index, subindex, size and data of each write."""
    rows = b"".join(
        struct.pack("<HBI", w.index, w.subindex, len(w.data)) + w.data for w in axis.writes
    )
    return struct.pack("<I", len(axis.writes)) + rows


def python(axis: AxisHandover) -> bytes:
    """Python script that writes by a running server and reads each value back."""
    rows = "\n".join(f"    ({w.key!r}, {w.raw!r}),  # {line_of(w.name)}" for w in axis.writes)
    return f'''"""Write the values of a hand-over to a drive of a running servodeck and verify them.

Usage: python FILE SERVER DRIVE_ID, as http://127.0.0.1:8420 and the id of the drive there.
The token of the account comes from SERVODECK_TOKEN where the server has accounts.
"""

import os
import sys

import httpx

PROFILE = {axis.profile.drive!r}
WRITES = [
{rows}
]


def main() -> int:
    server, drive = sys.argv[1:3]
    token = os.environ.get("SERVODECK_TOKEN")
    headers = {{"Authorization": f"Bearer {{token}}"}} if token else {{}}
    wrong = 0
    with httpx.Client(base_url=f"{{server}}/api/v1", headers=headers, timeout=60) as http:
        known = http.get("/drives").raise_for_status().json()
        here = next((each for each in known if each["id"] == drive), None)
        if here is None or here["profile"] != PROFILE:
            print(f"{{drive}} is no {{PROFILE}} drive of {{server}}", file=sys.stderr)
            return 1
        for key, raw in WRITES:
            path = f"/drives/{{drive}}/parameters/{{key}}"
            answer = http.put(path, json={{"raw": raw}})
            now = answer.json().get("raw") if answer.is_success else None
            if now != raw:
                wrong += 1
                why = f"wanted {{raw}}, drive has {{now}}: {{answer.text}}"
                print(f"{{key}}: {{why}}", file=sys.stderr)
    print(f"{{len(WRITES) - wrong}} of {{len(WRITES)}} values written and read back")
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
'''.encode()


_SHEET = (
    ("direction (polarity)", "607E:00"), ("encoder increments", "608F:01"),
    ("encoder motor revolutions", "608F:02"), ("software limit minimum", "607D:01"),
    ("software limit maximum", "607D:02"), ("maximum profile velocity", "607F:00"),
    ("maximum speed", "6080:00"), ("maximum torque", "6072:00"),
    ("positive torque limit", "60E0:00"), ("negative torque limit", "60E1:00"),
    ("following error window", "6065:00"), ("following error time", "6066:00"),
)  # fmt: skip


def sheet(axis: AxisHandover) -> bytes:
    """Sheet with the scaling of the controller's axis, values left out, and notes.

    Only parameters that the list writes have a value here; others keep their values in the drive.
    """
    units = axis.profile.units
    lines = [f"Hand-over of {line_of(axis.name)} ({axis.profile.title})", "", "Scaling"]
    lines.append(
        f"  position unit {units.position}, velocity {units.velocity}, acceleration "
        f"{units.acceleration}, torque {units.torque}"
    )
    known = units.counts_per_rev
    lines.append(
        f"  increments per motor revolution with default gearing: {known or 'not in the manual'}"
    )
    lines.append(f"  increments per feed unit: {_increments_per_unit(axis)}")
    lines.append(
        f"  encoder counts per revolution: {units.encoder_counts_per_rev or 'read 608Fh of drive'}"
    )
    gearing = (
        ("gear numerator", units.gear_numerator),
        ("gear denominator", units.gear_denominator),
        ("feed", units.feed),
        ("feed revolutions", units.feed_revolutions),
    )
    by_key = {write.key: write for write in axis.writes}
    for words, key in (*gearing, *_SHEET):
        parameter = axis.profile.by_key.get(key or "")
        if key and parameter is not None:
            write = by_key.get(key)
            text = _with_unit(parameter, write.raw) if write else "not handed over"
            lines.append(f"  {words} {key}: {text}")
    lines += ["", f"Cycle {axis.cycle_us} µs (proposed), values written in P→S unless stated"]
    lines += ["", "Process data"]
    lines += [
        f"  {pdo.index:04X}h {'to' if pdo.direction == 'rx' else 'from'} the drive: "
        + ", ".join(f"{line_of(e.name)} ({e.bits} bits)" for e in pdo.entries)
        for pdo in axis.pdos
    ]
    notes = [note.words() for note in axis.notes] or ["nothing"]
    lines += ["", "To heed", *(f"  {line_of(note)}" for note in notes)]
    lines += ["", "Left out", *(f"  {e.key}: {line_of(e.reason.words())}" for e in axis.left_out)]
    return "\n".join([*lines, ""]).encode()


def _with_unit(parameter: Parameter, raw: Raw) -> str:
    value = parameter.to_value(raw)
    unit = f" {parameter.unit}" if parameter.unit else ""
    return f"{value}{unit}" + (f" (raw {raw})" if value != raw else "")


def _increments_per_unit(axis: AxisHandover) -> str:
    """Encoder increments per position unit of the drive, from the gearing that is handed over.

    CiA 402-2 clause 9: the gear ratio is motor revolutions per shaft revolution (6091h), the feed
    is units per shaft revolution (6092h).
    """
    units = axis.profile.units
    keys = (units.gear_numerator, units.gear_denominator, units.feed, units.feed_revolutions)
    written = {write.key: write.raw for write in axis.writes}
    encoder = units.encoder_counts_per_rev
    standard = keys == ("6091:01", "6091:02", "6092:01", "6092:02")
    values = [written.get(key or "") for key in keys]
    whole = [value for value in values if isinstance(value, int) and value]
    if not standard or encoder is None or len(whole) != 4:
        return "not certain from this list: compute it from the gearing in the drive"
    gear, shaft, feed, turns = whole
    return f"{encoder * gear * turns / (shaft * feed):.9g}"
