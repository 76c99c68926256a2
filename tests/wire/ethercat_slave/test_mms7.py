"""The MMS7 firmware behind the wire: process data of its manual, motion, watchdog."""

from __future__ import annotations

import struct

import pytest

from drivers.virtual.device import Device
from drivers.virtual.firmware.factory import make_device
from drivers.virtual.mechanics.spec import standard_mechanics

from .frames import LRW, OP, PREOP, SAFEOP, Wire
from .test_process_data import start_sync0

MS = 1_000_000
TARGET_STEP = 20  # increments per cycle of 1 ms: 65536 per revolution, so about 18 rpm


def drive() -> Device:
    device = make_device("mms7", standard_mechanics())
    device.advance(0)
    return device


def sdo_write(wire: Wire, index: int, subindex: int, data: bytes) -> bool:
    return wire.download(index, subindex, data)[0] == 0x60


def test_default_process_data() -> None:
    """1603h and 1A03h (004:1085-1095, 004:1436-1443)."""
    wire = Wire(real=drive())
    wire.to_preop()
    assert wire.upload(0x1C12, 1) == b"\x03\x16"
    assert wire.upload(0x1C13, 1) == b"\x03\x1a"
    assert wire.slaves[0].dictionary.assigned("rx") == (0x60400010, 0x607A0020)
    assert wire.slaves[0].dictionary.assigned("tx") == (0x603F0010, 0x60410010, 0x60640020)


@pytest.mark.parametrize(
    ("rx", "tx", "out_size", "in_size"),
    [
        # Sums of tables 17 and 18 (004:1064-1119), in bytes.
        (0x1600, 0x1A00, 2 + 1 + 4 + 2 + 4, 2 + 2 + 1 + 4 + 2 + 4 + 4 + 4),
        (0x1601, 0x1A01, 2 + 1 + 4 + 4 + 2 + 4, 2 + 2 + 1 + 4 + 4 + 2 + 4 + 4 + 4),
        (0x1602, 0x1A02, 2 + 1 + 4 + 4 + 2 + 2 + 4, 2 + 2 + 1 + 4 + 4 + 2 + 2 + 4 + 4 + 4),
        (0x1603, 0x1A03, 2 + 4, 2 + 2 + 4),
    ],
)
def test_every_set_of_the_manual_can_be_assigned(
    rx: int, tx: int, out_size: int, in_size: int
) -> None:
    wire = Wire(real=drive())
    wire.to_preop()
    for index, pdo in (0x1C12, rx), (0x1C13, tx):
        assert sdo_write(wire, index, 0, b"\0\0")
        assert sdo_write(wire, index, 1, struct.pack("<H", pdo))
        assert sdo_write(wire, index, 0, b"\x01\0")
    wire.set_process_data(out_size=out_size, in_size=in_size)
    assert wire.request(SAFEOP) == (SAFEOP, 0)


def test_remapping_and_what_the_drive_keeps_of_it() -> None:
    wire = Wire(real=drive())
    wire.to_preop()
    assert sdo_write(wire, 0x1603, 0, b"\0")
    assert sdo_write(wire, 0x1603, 3, struct.pack("<I", 0x60FF0020))
    assert sdo_write(wire, 0x1603, 0, b"\x03")
    wire.set_process_data(out_size=10)
    assert wire.request(SAFEOP) == (SAFEOP, 0)
    # Not an object of this direction, and not while Safe-Op: both refused.
    assert not sdo_write(wire, 0x1603, 0, b"\0")
    wire.request(PREOP)
    assert sdo_write(wire, 0x1603, 0, b"\0")
    assert not sdo_write(wire, 0x1603, 4, struct.pack("<I", 0x60640020))
    assert wire.slaves[0].device.read(0x1603, 3) == struct.pack("<I", 0x60FF0020)


def enabled_wire() -> Wire:
    """Operation enabled in CSP over process data with SYNC0 every ms; time is in mid-cycle."""
    wire = Wire(real=drive())
    wire.to_preop()
    assert sdo_write(wire, 0x6060, 0, b"\x08")
    wire.set_process_data()
    start_sync0(wire, 10 * MS)
    assert wire.request(SAFEOP) == (SAFEOP, 0)
    wire.write(0x0120, bytes([OP, 0]))
    wire.clock.time_ns = 9 * MS + MS // 2
    for word in (6, 6, 6, 7, 7, 15) + (15,) * 300:
        wire.clock.time_ns += MS
        status, position = exchange(wire, word, 0)
    assert wire.state() == (OP, 0)
    assert status & 0x6F == 0x27, hex(status)
    assert abs(position) < 100
    return wire


def exchange(wire: Wire, control: int, target: int) -> tuple[int, int]:
    outputs = struct.pack("<Hi", control, target)
    answer = wire.one(LRW, 0, 0, outputs.ljust(0x108, b"\0"))
    assert answer.wkc == 3
    status, position = struct.unpack_from("<Hi", answer.data, 0x102)
    return int(status), int(position)


def test_host_jitter_below_a_cycle_changes_nothing() -> None:
    def run(jitter_ns: int) -> list[tuple[int, int]]:
        wire = enabled_wire()
        start = wire.clock.time_ns
        seen = []
        for n in range(1, 201):
            wire.clock.time_ns = start + n * MS + (jitter_ns if n % 3 else -jitter_ns)
            seen.append(exchange(wire, 15, n * TARGET_STEP))
        return seen

    steady = run(0)
    assert steady[-1][1] > 150 * TARGET_STEP  # it has followed
    assert run(499_999) == steady
    assert run(123_457) == steady


def test_when_the_master_falls_silent_the_axis_stops_by_itself() -> None:
    wire = enabled_wire()
    for n in range(1, 101):
        wire.clock.time_ns += MS
        exchange(wire, 15, n * TARGET_STEP)
    device = wire.slaves[0].device

    def speed() -> int:
        return int.from_bytes(device.read(0x606C, 0), "little", signed=True)

    assert speed() > 0
    silent_from = wire.clock.time_ns
    wire.clock.time_ns = silent_from + 100 * MS
    assert wire.state() == (SAFEOP | 0x10, 0x001B)
    wire.clock.time_ns = silent_from + 1100 * MS
    wire.state()
    status = int.from_bytes(device.read(0x6041, 0), "little")
    assert status & 0x04 == 0, "operation is no longer enabled"
    assert abs(speed()) <= 1
