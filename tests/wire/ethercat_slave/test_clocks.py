"""Distributed clocks: receive times, system time, propagation, drift; and the wire's clocks."""

from __future__ import annotations

import struct
from itertools import pairwise

import pytest

from drivers.virtual.wires.ethercat.clock import LockstepClock, SteadyClock
from drivers.virtual.wires.ethercat.controller.dc import HOP_NS

from .frames import BWR, FRMW, LRW, SAFEOP, Wire

MS = 1_000_000


def test_receive_times_give_the_propagation_delay() -> None:
    wire = Wire(3)
    wire.number()
    wire.clock.time_ns = 7 * MS
    assert wire.one(BWR, 0, 0x0900, bytes(4)).wkc == 3
    times = [struct.unpack("<II", wire.read(0x0900, 8, 0x1001 + n).data) for n in range(3)]
    # Port 0: one hop after the slave before. Port 1: back from all slaves behind.
    assert times == [
        (7 * MS, 7 * MS + 4 * HOP_NS),
        (7 * MS + HOP_NS, 7 * MS + 3 * HOP_NS),
        (7 * MS + 2 * HOP_NS, 0),
    ]
    # As a master computes it: half the difference of what parent and child saw.
    assert (4 * HOP_NS - 2 * HOP_NS) // 2 == HOP_NS
    unit = [struct.unpack("<Q", wire.read(0x0918, 8, 0x1001 + n).data)[0] for n in range(3)]
    assert unit == [time for time, _ in times]


def test_system_time_is_local_time_plus_the_masters_offset() -> None:
    wire = Wire()
    wire.number()
    wire.clock.time_ns = 3 * MS
    wire.write(0x0920, struct.pack("<Q", 10_000_000_000))
    wire.clock.time_ns = 5 * MS
    assert wire.value(0x0910, 8) == 10_000_000_000 + 5 * MS
    wire.write(0x0920, struct.pack("<q", -MS))
    assert wire.value(0x0910, 8) == 4 * MS


def test_the_difference_to_the_reference_clock_is_shown() -> None:
    wire = Wire(2)
    wire.number()
    wire.clock.time_ns = 10 * MS
    wire.write(0x0920, struct.pack("<q", 300), station=0x1002)
    assert wire.one(FRMW, 0x1001, 0x0910, bytes(8)).wkc == 2
    assert wire.value(0x092C, 4, 0x1002) == 300  # ahead: bit 31 clear
    wire.write(0x0920, struct.pack("<q", -200), station=0x1002)
    wire.one(FRMW, 0x1001, 0x0910, bytes(8))
    assert wire.value(0x092C, 4, 0x1002) == 0x80000000 | 200


def test_distributing_the_reference_time_pulls_a_fast_clock_in() -> None:
    def deviation(distribute: bool) -> int:
        wire = Wire(2)
        wire.number()
        wire.slaves[1].dc.drift_ppm = 50.0
        for n in range(1, 1001):
            wire.clock.time_ns = n * MS
            if distribute:
                wire.one(FRMW, 0x1001, 0x0910, bytes(8))
        return wire.value(0x0910, 8, 0x1002) - wire.value(0x0910, 8, 0x1001)

    # 50 ppm for one second are 50 µs; distributed every ms, at most a few cycles' worth remain.
    assert deviation(distribute=False) == 50_000
    assert abs(deviation(distribute=True)) < 1_000


def test_a_drive_without_dc_ignores_the_registers() -> None:
    wire = Wire(dc=False)
    wire.number()
    wire.clock.time_ns = 5 * MS
    wire.one(BWR, 0, 0x0900, bytes(4))
    assert wire.value(0x0900, 4) == 0
    assert wire.value(0x0910, 8) == 0


def test_activation_status_tells_a_pending_first_pulse() -> None:
    wire = Wire()
    wire.number()
    wire.write(0x0990, struct.pack("<Q", 10 * MS))
    wire.write(0x09A0, struct.pack("<I", MS))
    wire.write(0x0981, b"\x03")
    assert wire.value(0x0984, 1) == 1
    wire.clock.time_ns = 10 * MS
    assert wire.value(0x0984, 1) == 0


def test_lockstep_is_one_cycle_per_process_data_frame() -> None:
    clock = LockstepClock()
    times = []
    for n in range(10):
        times.append(clock.arrival(process_data=True, cycle_ns=MS))
        for _ in range(n % 4):  # mailbox work between two cycles does not move the grid
            clock.arrival(process_data=False, cycle_ns=0)
    assert times == [n * MS + MS // 2 for n in range(10)]
    assert clock.grid(4_200_001, MS) == 5_000_000
    assert clock.grid(5_000_000, MS) == 5_000_000


def test_lockstep_lets_time_pass_while_a_master_only_polls() -> None:
    clock = LockstepClock()
    clock.arrival(process_data=True, cycle_ns=MS)
    before = clock.now()
    for _ in range(clock.IDLE_FRAMES + 10):
        clock.arrival(process_data=False, cycle_ns=0)
    assert clock.now() - before == clock.IDLE_FRAMES * 5_000 + 10 * 200_000


def test_sync1_beside_a_faster_sync0_rules_the_exchange() -> None:
    """ETG.1000.4 clause 6.8: SYNC1 follows the first SYNC0 by 9A4h, then every second SYNC0."""
    wire = Wire()
    wire.number()
    dc = wire.slaves[0].dc
    wire.write(0x0990, struct.pack("<Q", 10 * MS))
    wire.write(0x09A0, struct.pack("<II", MS // 2, MS // 2 + 125_000))
    wire.write(0x0981, b"\x07")
    assert dc.exchange_cycle_ns == MS
    pulses, at = [], 0
    while len(pulses) < 6:
        pulse = dc.next_pulse(at)
        assert pulse is not None
        at = pulse
        pulses.append((pulse, dc.exchanges_at(pulse)))
    start = 10 * MS
    assert pulses == [
        (start, False),
        (start + 500_000, False),
        (start + 625_000, True),
        (start + 1_000_000, False),
        (start + 1_500_000, False),
        (start + 1_625_000, True),
    ]
    wire.write(0x0981, b"\x03")
    assert dc.exchange_cycle_ns == MS // 2
    assert dc.exchanges_at(start + 500_000)


@pytest.mark.parametrize(("exponent", "cycle_ns"), [(-3, 2 * MS), (-4, MS // 5)])
def test_steady_time_follows_the_frames_also_of_drives_without_sync0(
    exponent: int, cycle_ns: int
) -> None:
    """They have no pulse: the cycle is the interpolation period that the master has set."""
    wire = Wire(dc=False, interpolates=True)
    wire.to_preop()
    wire.download(0x60C2, 1, b"\x02")
    wire.download(0x60C2, 2, struct.pack("<b", exponent))
    wire.set_process_data()
    assert wire.request(SAFEOP) == (SAFEOP, 0)
    wire.segment.clock = SteadyClock()
    times = []
    for _ in range(10):
        wire.one(LRW, 0, 0, bytes(0x108))
        times.append(wire.device.time_ns)
    # However long the computer took for each of them.
    assert {new - old for old, new in pairwise(times)} == {cycle_ns}


def test_drives_without_any_cycle_have_real_time() -> None:
    wire = Wire(dc=False)
    wire.to_safeop()
    wire.segment.clock = SteadyClock()
    assert wire.segment._cycle_ns() == 0
