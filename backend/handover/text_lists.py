"""Start-up lists as text: CODESYS, CSV, IgH shell script, ROS 2 YAML, DCF and a Python script."""

from __future__ import annotations

import csv
import io
import math
import struct
from collections.abc import Sequence
from datetime import UTC, datetime
from xml.sax.saxutils import escape

from backend.handover.model import AxisHandover, MappedEntry, StartupWrite
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
#: Neither ethercat_driver_ros2 nor all versions of `ethercat download` take a REAL32: its four
#: bytes are handed over as a number, which is the same on the wire.
_AS_NUMBER = {"REAL32": "uint32", "BOOL": "uint8"}
_ROLES = {
    "position_target": ("command_interface", "position"),
    "velocity_target": ("command_interface", "velocity"),
    "torque_target": ("command_interface", "effort"),
    "position_actual": ("state_interface", "position"),
    "velocity_actual": ("state_interface", "velocity"),
    "torque_actual": ("state_interface", "effort"),
}


def number_type(write: StartupWrite) -> str:
    """Type word of `ethercat download` and ethercat_driver_ros2."""
    return _AS_NUMBER.get(write.type, write.type.lower())


def _number(write: StartupWrite) -> int:
    return write.number if write.type in _AS_NUMBER else int(write.raw)


def _line(text: str) -> str:
    """One line of it without control characters: no value of a file may begin a line of its own."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def _cell(text: str) -> str:
    """A cell that no spreadsheet takes for a formula."""
    text = _line(text)
    return f"'{text}" if text[:1] in ("=", "+", "-", "@") else text


def codesys(axis: AxisHandover) -> bytes:
    """Rows for CODESYS's start-up parameters; values as IEC 61131-3 hexadecimal of the bits."""
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
    """A table for people; ``data`` are the bytes in the order of travel."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\r\n")
    table.writerow(CSV_COLUMNS)
    for write in axis.writes:
        parameter = axis.profile.by_key[write.key]
        table.writerow([
            write.key, f"0x{write.index:04X}", f"0x{write.subindex:02X}", write.type,
            len(write.data), write.raw, write.data.hex(" "), write.transition,
            parameter.to_value(write.raw), parameter.unit, _cell(write.name),
        ])  # fmt: skip
    return text.getvalue().encode("utf-8-sig")


def igh(axis: AxisHandover) -> bytes:
    """Shell script of `ethercat download`; it ends at the first write that fails."""
    lines = [
        "#!/bin/sh",
        f"# Start-up values of {_line(axis.name)}, to be written in Pre-Operational.",
        *(f"# {_line(note)}" for note in axis.notes),
        'POS="${1:?usage: $0 POSITION}"',
        "set -eu",
        "# The state is left as it is: taking a running axis out of Operational would stop it.",
        'ethercat slaves -p "$POS" | grep -q " PREOP " || {',
        '  echo "slave $POS is not in Pre-Operational; nothing was written" >&2; exit 1; }',
    ]
    for write in axis.writes:
        lines += [
            f"# {write.key} {_line(write.name)}",
            f'ethercat download -p "$POS" -t {number_type(write)} 0x{write.index:04X} '
            f"0x{write.subindex:02X} -- {_number(write)}",
        ]
    return "\n".join([*lines, ""]).encode()


def ros2(axis: AxisHandover) -> bytes:
    """Slave YAML of ethercat_driver_ros2.

    Raises:
        NotAllowed: identity unknown.
    """
    vendor, product = axis.identity()
    lines = [
        f"# {_line(axis.name)}; position factors stand only where the list sets the gearing",
        f"vendor_id: 0x{vendor:08x}",
        f"product_id: 0x{product:08x}",
    ]
    if axis.assign_activate:
        known = "of the ESI file" if axis.controller is not None else "check with the ESI file"
        lines.append(f"assign_activate: 0x{axis.assign_activate:04x}  # {known}")
    lines += ["auto_fault_reset: false", "sdo:"]
    lines += [
        f"  - {{index: 0x{w.index:04x}, sub_index: {w.subindex}, type: {number_type(w)}, "
        f"value: {_number(w)}}}  # {_line(w.name)}"
        for w in axis.writes
    ]
    for direction, tag in (("rx", "rpdo"), ("tx", "tpdo")):
        pdos = [p for p in axis.pdos if p.direction == direction]
        lines += [f"{tag}:"] if pdos else []
        for pdo in pdos:
            lines += [f"  - index: 0x{pdo.index:04x}", "    channels:"]
            lines += [f"      - {{{_channel(axis, entry)}}}" for entry in pdo.entries]
    return "\n".join([*lines, ""]).encode()


def _channel(axis: AxisHandover, entry: MappedEntry) -> str:
    kind = f"bit{entry.bits}" if entry.type is None else entry.type.lower()
    kind = "bool" if entry.type == "BOOL" else kind
    text = f"index: 0x{entry.index:04x}, sub_index: {entry.subindex}, type: {kind}"
    for signal in axis.profile.signals:
        if signal.key == f"{entry.index:04X}:{entry.subindex:02X}" and signal.role in _ROLES:
            field, word = _ROLES[signal.role]
            text += f", {field}: {word}"
            text += ", default: .nan" if field == "command_interface" and word == "position" else ""
            per_radian = increments_per_radian(axis)
            if word == "position" and per_radian:
                down = field == "command_interface"
                text += f", factor: {(per_radian if down else 1 / per_radian)!r}"
    return text


def increments_per_radian(axis: AxisHandover) -> float | None:
    """Position increments per radian of the motor, None where it is not certain.

    Certain only where the list itself sets the whole gearing to its defaults: a wrong factor
    scales every motion of the controller.
    """
    units = axis.profile.units
    gearing = {units.gear_numerator, units.gear_denominator, units.feed, units.feed_revolutions}
    written = {write.key: write.raw for write in axis.writes}
    for key in gearing - {None}:
        parameter = axis.profile.by_key[key] if key is not None else None
        if parameter is None or written.get(parameter.key) != parameter.default_raw:
            return None
    return units.counts_per_rev / (2 * math.pi) if units.counts_per_rev else None


def bus_yml(axes: Sequence[AxisHandover], dcf_names: Sequence[str]) -> bytes:
    """`bus.yml` of ros2_canopen, which names the DCFs beside it; node numbers are proposed."""
    cycle_us = max(axis.cycle_us for axis in axes)
    lines = [
        "options:",
        '  dcf_path: "@BUS_CONFIG_PATH@"',
        "master:",
        "  node_id: 1",
        '  driver: "ros2_canopen::MasterDriver"',
        '  package: "canopen_master_driver"',
        f"  sync_period: {cycle_us}",
    ]
    for number, (axis, dcf_name) in enumerate(zip(axes, dcf_names, strict=True)):
        lines += [
            "drive:" if len(axes) == 1 else f"drive{number + 1}:",
            f"  node_id: {number + 2}  # set the drive's own",
            f'  dcf: "{dcf_name}"',
            '  driver: "ros2_canopen::Cia402Driver"',
            '  package: "canopen_402_driver"',
            f"  period: {cycle_us // 1000}",
            "  sdo:",
            *(
                f"    - {{index: 0x{w.index:04x}, sub_index: {w.subindex}, value: {_number(w)}}}"
                f"  # {_line(w.name)}"
                for w in axis.writes
            ),
        ]
    return "\n".join([*lines, ""]).encode()


def ros2_control(axes: Sequence[AxisHandover], slave_files: Sequence[str]) -> bytes:
    """`ros2_control` of ethercat_driver_ros2 that names the slave files beside it."""
    frequency = 1_000_000 // max(axis.cycle_us for axis in axes)
    lines = [
        '<ros2_control name="segment" type="system">',
        "  <hardware>",
        "    <plugin>ethercat_driver/EthercatDriver</plugin>",
        '    <param name="master_id">0</param>',
        f'    <param name="control_frequency">{frequency}</param>',
        "  </hardware>",
    ]
    for position, file in enumerate(slave_files):
        lines += [
            f'  <joint name="joint_{position + 1}">',
            '    <state_interface name="position"/>',
            '    <command_interface name="position"/>',
            f'    <ec_module name="drive{position + 1}">',
            "      <plugin>ethercat_generic_plugins/EcCiA402Drive</plugin>",
            '      <param name="alias">0</param>',
            f'      <param name="position">{position}</param>',
            '      <param name="mode_of_operation">8</param>',
            f'      <param name="slave_config">{escape(file)}</param>',
            "    </ec_module>",
            "  </joint>",
        ]
    return "\n".join([*lines, "</ros2_control>", ""]).encode()


def dcf(axis: AxisHandover, file_name: str, saved: datetime | None) -> bytes:
    """Device configuration file of CiA 306-1; dated as the set, so that it comes out the same."""
    values = {write.key: write.raw for write in axis.writes}
    created = saved or datetime(2000, 1, 1, tzinfo=UTC)
    return export_dcf(
        axis.profile, values, created, file_name=file_name, node_name=_line(axis.name)
    ).encode()


def concise_dcf(axis: AxisHandover) -> bytes:
    """Contents of 1F22h (CiA 302-3): count, then index, subindex, size and data of each write."""
    rows = b"".join(
        struct.pack("<HBI", w.index, w.subindex, len(w.data)) + w.data for w in axis.writes
    )
    return struct.pack("<I", len(axis.writes)) + rows


def python(axis: AxisHandover) -> bytes:
    """Script that writes over the command line's server and reads each value back."""
    rows = "\n".join(f"    ({w.key!r}, {w.raw!r}),  # {_line(w.name)}" for w in axis.writes)
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
    """Scaling of the controller's axis, what was left out, and what must be heeded.

    Only what the list itself writes is stated as a value: what it leaves is as the drive keeps it.
    """
    units = axis.profile.units
    lines = [f"Hand-over of {_line(axis.name)} ({axis.profile.title})", "", "Scaling"]
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
        ("gear numerator", units.gear_numerator), ("gear denominator", units.gear_denominator),
        ("feed", units.feed), ("feed revolutions", units.feed_revolutions),
    )  # fmt: skip
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
        + ", ".join(f"{_line(e.name)} ({e.bits} bits)" for e in pdo.entries)
        for pdo in axis.pdos
    ]
    lines += ["", "To heed", *(f"  {_line(note)}" for note in axis.notes or ("nothing",))]
    lines += ["", "Left out", *(f"  {e.key}: {_line(e.reason)}" for e in axis.left_out)]
    return "\n".join([*lines, ""]).encode()


def _with_unit(parameter: Parameter, raw: Raw) -> str:
    value = parameter.to_value(raw)
    unit = f" {parameter.unit}" if parameter.unit else ""
    return f"{value}{unit}" + (f" (raw {raw})" if value != raw else "")


def _increments_per_unit(axis: AxisHandover) -> str:
    """Encoder increments per unit of the drive's positions, from the gearing that is handed over.

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
