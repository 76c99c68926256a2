"""Files of ROS 2: ethercat_driver_ros2's slave file, and ros2_canopen's `bus.yml`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from xml.sax.saxutils import escape

from backend.records.handover.model import AxisHandover, LeftOut, MappedEntry, StartupWrite
from backend.records.handover.text_lists import line_of, number_type
from drivers.errors import NotAllowed
from drivers.texts.message import text

#: ethercat_driver_ros2 reads each value into a C++ `int` and casts it to the stated type.
_INT_LOW, _INT_HIGH = -(1 << 31), (1 << 31) - 1
_ROLES = {
    "position_target": ("command_interface", "position"),
    "velocity_target": ("command_interface", "velocity"),
    "torque_target": ("command_interface", "effort"),
    "position_actual": ("state_interface", "position"),
    "velocity_actual": ("state_interface", "velocity"),
    "torque_actual": ("state_interface", "effort"),
}


def value_of(write: StartupWrite) -> int | None:
    """The number in a ROS 2 file that results in the write's bytes; None where there is none."""
    size = len(write.data)
    number = int.from_bytes(write.data, "little", signed=True)
    unsigned = write.number
    if unsigned <= _INT_HIGH:
        return unsigned if write.type.startswith(("U", "B", "R")) else number
    # -1 cast to uint32 is FFFFFFFFh: the signed number of the same size results in the same bytes.
    return number if size in (1, 2, 4, 8) and _INT_LOW <= number <= _INT_HIGH else None


def carried(axis: AxisHandover) -> AxisHandover:
    """The axis with the writes that ROS 2's files can express; the others are left out.

    Raises:
        NotAllowed: nothing is left to write.
    """
    wired = axis.profile.link("ethercat") is not None
    writes, left = [], []
    for write in axis.writes:
        why = None
        if wired and value_of(write) is None:
            why = text("handover.left-out-larger-32-bits")
        if not wired and write.type == "REAL32":
            why = text("handover.left-out-no-real")
        if why is not None:
            left.append(LeftOut(write.key, why))
        else:
            writes.append(write)
    if not writes:
        raise NotAllowed("handover.carries-no-value", drive=axis.name, key=left[0].key)
    return replace(axis, writes=tuple(writes), left_out=(*axis.left_out, *left))


def ros2(axis: AxisHandover) -> bytes:
    """Slave YAML of ethercat_driver_ros2.

    Raises:
        NotAllowed: identity unknown.
    """
    vendor, product = axis.identity()
    lines = [
        f"# {line_of(axis.name)}; position factors stand only where the list sets the gearing",
        f"vendor_id: 0x{vendor:08x}",
        f"product_id: 0x{product:08x}",
    ]
    if axis.assign_activate:
        known = "of the ESI file" if axis.controller is not None else "check with the ESI file"
        lines.append(f"assign_activate: 0x{axis.assign_activate:04x}  # {known}")
    lines += ["auto_fault_reset: false", "sdo:"]
    lines += [
        f"  - {{index: 0x{w.index:04x}, sub_index: {w.subindex}, type: {number_type(w)}, "
        f"value: {value_of(w)}}}  # {line_of(w.name)}"
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
    # The driver has no floating-point process data: such an entry is a gap without an interface.
    gap = entry.type is None or entry.type == "REAL32"
    kind = f"bit{entry.bits}" if gap or entry.type is None else entry.type.lower()
    kind = "bool" if entry.type == "BOOL" else kind
    text = f"index: 0x{entry.index:04x}, sub_index: {entry.subindex}, type: {kind}"
    for signal in () if gap else axis.profile.signals:
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
    """Position increments per radian of the motor; None where they are not certain.

    They are certain only where the list itself sets the whole gearing to its defaults, as a wrong
    factor would scale every motion of the controller.
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
    """`bus.yml` of ros2_canopen, which refers to the DCFs next to it; node-IDs are proposed."""
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
    lines += ["nodes:"]
    for number, (axis, dcf_name) in enumerate(zip(axes, dcf_names, strict=True)):
        lines += [
            "  drive:" if len(axes) == 1 else f"  drive{number + 1}:",
            f"    node_id: {number + 2}  # set the drive's own",
            f'    dcf: "{dcf_name}"',
            '    driver: "ros2_canopen::Cia402Driver"',
            '    package: "canopen_402_driver"',
            f"    period: {cycle_us // 1000}",
            "    sdo:",
            *(
                f"      - {{index: 0x{w.index:04x}, sub_index: {w.subindex}, value: {int(w.raw)}}}"
                f"  # {line_of(w.name)}"
                for w in axis.writes
            ),
        ]
    return "\n".join([*lines, ""]).encode()


def ros2_control(axes: Sequence[AxisHandover], slave_files: Sequence[str]) -> bytes:
    """`ros2_control` of ethercat_driver_ros2, which refers to the slave files next to it."""
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
