"""Logical access, process data, SYNC0 and the watchdog."""

from __future__ import annotations

import struct

import pytest

from .frames import IN, LRD, LRW, LWR, OP, OUT, PREOP, SAFEOP, Wire, fmmu

MS = 1_000_000
CYCLE = MS


def inputs(error: int, status: int, position: int) -> bytes:
    return struct.pack("<HHi", error, status, position)


# -- logical access ---------------------------------------------------------------------------


def test_lrw_counts_one_for_reading_and_two_for_writing_per_slave() -> None:
    wire = Wire(4)
    wire.to_op()
    answer = wire.one(LRW, 0, 0, bytes(0x100 + 32))
    assert answer.wkc == 4 * 3


@pytest.mark.parametrize(("command", "address", "size"), [(LWR, 0, 24), (LRD, 0x100, 32)])
def test_lrd_and_lwr_count_one_per_slave(command: int, address: int, size: int) -> None:
    wire = Wire(4)
    wire.to_op()
    assert wire.one(command, address, 0, bytes(size)).wkc == 4


def test_lrw_writes_what_came_in_before_it_puts_its_inputs_there() -> None:
    """Outputs and inputs may share logical addresses: the slave must take the master's bytes."""
    wire = Wire()
    wire.to_safeop()
    wire.write(0x0610, fmmu(0, 8, IN, write=False))
    answer = wire.one(LRW, 0, 0, wire.outputs(0x0F, 1234) + b"\0\0")
    assert answer.wkc == 3
    assert answer.data == inputs(0, 0x0250, 0)
    assert bytes(wire.slaves[0].controller.sms[2].data) == wire.outputs(0x0F, 1234)


def test_a_later_slave_sees_what_an_earlier_one_put_in() -> None:
    wire = Wire(2)
    wire.to_safeop()
    # Slave 1's inputs are slave 2's outputs: the first 6 of 8 bytes.
    wire.write(0x0600, fmmu(0x100, 6, OUT, write=True), station=0x1002)
    wire.one(LRW, 0x100, 0, b"\xff" * 8)
    assert bytes(wire.slaves[1].controller.sms[2].data) == inputs(0, 0x0250, 0)[:6]


def test_addresses_that_nobody_maps_come_back_untouched() -> None:
    wire = Wire()
    wire.to_op()
    answer = wire.one(LRW, 0x8000, 0, b"\x5a" * 8)
    assert (answer.wkc, answer.data) == (0, b"\x5a" * 8)


def test_below_safe_op_process_data_are_locked() -> None:
    wire = Wire()
    wire.to_preop()
    wire.set_process_data()
    assert wire.one(LRW, 0, 0, bytes(0x108)).wkc == 0
    assert wire.value(0x0817, 1) & 1


def test_in_safe_op_outputs_are_received_and_do_not_act() -> None:
    wire = Wire()
    wire.to_safeop()
    assert wire.one(LRW, 0, 0, wire.outputs(0x0F, 77).ljust(0x108, b"\0")).wkc == 3
    assert wire.device.values[0x607A, 0] == bytes(4)


def test_reading_past_the_end_of_the_inputs_keeps_the_length() -> None:
    wire = Wire()
    wire.to_safeop()
    answer = wire.read(IN, 12)
    assert (answer.wkc, answer.data) == (1, inputs(0, 0x0250, 0) + bytes(4))


def test_a_bitwise_fmmu_moves_single_bits() -> None:
    wire = Wire()
    wire.to_safeop()
    # Logical bits 3 to 5 of byte 200h to physical bits 2 to 4 of a plain RAM byte.
    wire.write(0x0600, struct.pack("<IHBBHBBB3x", 0x200, 1, 3, 5, 0x1F00, 2, 2, 1))
    assert wire.one(LWR, 0x200, 0, bytes([0b00101000])).wkc == 1
    assert wire.value(0x1F00, 1) == 0b00010100


# -- free run (with the event of the sync manager) ---------------------------------------------


def test_without_sync0_outputs_act_and_inputs_are_latched_with_the_frame() -> None:
    wire = Wire()
    wire.to_op()
    wire.clock.time_ns += 5 * MS
    first = wire.one(LRW, 0, 0, wire.outputs(0x0F, 100).ljust(0x108, b"\0"))
    assert wire.device.values[0x607A, 0] == struct.pack("<i", 100)
    wire.clock.time_ns += CYCLE
    second = wire.one(LRW, 0, 0, wire.outputs(0x0F, 200).ljust(0x108, b"\0"))
    wire.clock.time_ns += CYCLE
    third = wire.one(LRW, 0, 0, wire.outputs(0x0F, 300).ljust(0x108, b"\0"))
    positions = [struct.unpack_from("<i", a.data, 0x104)[0] for a in (first, second, third)]
    # Position follows one advance later; what a frame brings back was latched a frame before.
    assert positions == [0, 0, 100]


# -- SYNC0 ------------------------------------------------------------------------------------


def start_sync0(wire: Wire, first_ns: int, cycle_ns: int = CYCLE) -> None:
    """As SOEM: off, start time, cycle, on. The local clocks are at the wire's time here."""
    for n in range(len(wire.slaves)):
        station = 0x1001 + n
        wire.write(0x0981, b"\x00", station)
        wire.write(0x0990, struct.pack("<Q", first_ns), station)
        wire.write(0x09A0, struct.pack("<I", cycle_ns), station)
        wire.write(0x0981, b"\x03", station)


def dc_wire(cycle_ns: int = CYCLE) -> Wire:
    """In Op at 10.5 ms with SYNC0 at 10, 11, 12 … ms."""
    wire = Wire()
    wire.to_preop()
    wire.set_process_data()
    start_sync0(wire, 10 * MS, cycle_ns)
    assert wire.request(SAFEOP) == (SAFEOP, 0)
    wire.write(0x0120, bytes([OP, 0]))
    wire.clock.time_ns = 10 * MS + MS // 2
    exchange(wire, 0)
    assert wire.state() == (OP, 0)
    wire.device.unpacked.clear()
    wire.device.advances.clear()
    return wire


def exchange(wire: Wire, target: int) -> int:
    answer = wire.one(LRW, 0, 0, wire.outputs(0x0F, target).ljust(0x108, b"\0"))
    assert answer.wkc == 3
    return int(struct.unpack_from("<i", answer.data, 0x104)[0])


def test_outputs_are_taken_and_inputs_latched_at_sync0() -> None:
    wire = dc_wire()
    exchange(wire, 1)  # at 10.5 ms: acts at 11 ms
    assert wire.device.unpacked == []
    wire.clock.time_ns = 11 * MS + 1
    exchange(wire, 2)
    assert [(t, struct.unpack_from("<i", d, 2)[0]) for t, d in wire.device.unpacked] == [
        (11 * MS, 1)
    ]
    wire.clock.time_ns = 12 * MS + MS // 2
    assert exchange(wire, 3) == 1  # latched at 12 ms, before target 2 acted
    assert wire.device.unpacked[-1] == (12 * MS, wire.outputs(0x0F, 2))


def test_the_physics_do_not_see_when_in_the_cycle_a_frame_comes() -> None:
    runs = []
    for jitter in (0, 1, 400_000, -400_000, 123_456):
        wire = dc_wire()
        got = []
        for n in range(20):
            at = 11 * MS + MS // 2 + n * CYCLE
            wire.clock.time_ns = at + (jitter if n % 2 else -jitter)
            got.append(exchange(wire, n))
        runs.append((got, list(wire.device.advances), list(wire.device.unpacked)))
    assert all(run == runs[0] for run in runs)
    assert all(t % CYCLE == 0 for t in runs[0][1])


def test_a_late_frame_is_a_repeated_output_and_is_counted() -> None:
    wire = dc_wire()
    exchange(wire, 5)
    wire.clock.time_ns = 13 * MS + MS // 2  # 11 took it, 12 and 13 found nothing new
    exchange(wire, 6)
    targets = [struct.unpack_from("<i", d, 2)[0] for _, d in wire.device.unpacked]
    assert targets == [5, 5, 5]
    assert wire.upload(0x1C32, 0x0B) == b"\x02\x00"


def test_in_safe_op_with_sync0_outputs_do_not_act_either() -> None:
    wire = dc_wire()
    assert wire.request(SAFEOP) == (SAFEOP, 0)
    wire.device.unpacked.clear()
    for _ in range(5):
        exchange(wire, 77)
        wire.clock.time_ns += CYCLE
    wire.state()
    assert wire.device.unpacked == []


def test_outside_op_only_the_last_sync0_is_computed() -> None:
    wire = Wire()
    wire.to_preop()
    wire.set_process_data()
    start_sync0(wire, 10 * MS)
    wire.request(SAFEOP)
    wire.device.advances.clear()
    wire.clock.time_ns = 500 * MS + 7
    exchange(wire, 0)
    assert wire.device.advances[-1] == 500 * MS
    assert len(wire.device.advances) < 5


def test_a_start_time_in_the_past_never_fires_and_op_is_refused() -> None:
    wire = Wire()
    wire.clock.time_ns = 50 * MS
    wire.to_preop()
    wire.set_process_data()
    start_sync0(wire, 10 * MS)
    assert wire.request(SAFEOP) == (SAFEOP, 0)
    wire.write(OUT, wire.outputs())
    assert wire.request(OP) == (SAFEOP | 0x10, 0x002D)


def test_sync0_without_a_cycle_time_is_refused() -> None:
    wire = Wire()
    wire.to_preop()
    wire.set_process_data()
    start_sync0(wire, 10 * MS, 0)
    assert wire.request(SAFEOP) == (PREOP | 0x10, 0x0030)


def test_a_cycle_shorter_than_the_drive_can_do_is_refused() -> None:
    wire = Wire(cycle_min_us=250)
    wire.to_preop()
    wire.set_process_data()
    start_sync0(wire, 10 * MS, 125_000)
    assert wire.request(SAFEOP) == (PREOP | 0x10, 0x0035)
    start_sync0(wire, 10 * MS, 250_000)
    assert wire.request(SAFEOP | 0x10) == (SAFEOP, 0)


# -- watchdog ---------------------------------------------------------------------------------


def test_the_watchdog_drops_to_safe_op_with_1bh_and_tells_the_drive() -> None:
    wire = Wire()
    wire.to_op()
    # Default: (2498 + 2) * 40 ns * 1000 = 100 ms after the last outputs.
    wire.clock.time_ns = 100 * MS - 1
    assert wire.state() == (OP, 0)
    assert wire.value(0x0440, 2) == 1
    wire.clock.time_ns = 100 * MS
    assert wire.state() == (SAFEOP | 0x10, 0x001B)
    assert wire.device.lost == ["watchdog"]
    assert wire.device.time_ns == 100 * MS
    assert wire.value(0x0440, 2) == 0
    assert wire.value(0x0442, 1) == 1


def test_the_drive_is_stopped_when_the_watchdog_ends_however_late_that_is_seen() -> None:
    wire = Wire()
    wire.to_op()
    seen: list[int] = []
    wire.device.communication_lost = lambda reason: seen.append(wire.device.time_ns)  # type: ignore[method-assign]
    wire.clock.time_ns = 5_000 * MS
    wire.state()
    assert seen == [100 * MS]


def test_outputs_feed_the_watchdog() -> None:
    wire = Wire()
    wire.to_op()
    for n in range(1, 11):
        wire.clock.time_ns = n * 60 * MS
        assert wire.one(LWR, 0, 0, wire.outputs()).wkc == 1
    assert wire.state() == (OP, 0)


def test_the_master_sets_the_watchdog_time() -> None:
    wire = Wire()
    wire.to_op()
    # 1 ms steps (divider 24998), 20 of them.
    wire.write(0x0400, struct.pack("<H", 24_998))
    wire.write(0x0420, struct.pack("<H", 20))
    wire.clock.time_ns = 20 * MS - 1
    assert wire.state() == (OP, 0)
    wire.clock.time_ns = 20 * MS
    assert wire.state() == (SAFEOP | 0x10, 0x001B)


@pytest.mark.parametrize("off", ["count", "trigger"])
def test_a_watchdog_can_be_switched_off(off: str) -> None:
    wire = Wire()
    wire.to_preop()
    wire.set_process_data(control=0x24 if off == "trigger" else 0x64)
    if off == "count":
        wire.write(0x0420, b"\0\0")
    wire.request(SAFEOP)
    wire.write(OUT, wire.outputs())
    wire.request(OP)
    wire.clock.time_ns = 10_000 * MS
    assert wire.state() == (OP, 0)


@pytest.mark.parametrize("with_sync0", [False, True])
def test_outputs_from_before_the_watchdog_never_act_again(with_sync0: bool) -> None:
    wire = dc_wire() if with_sync0 else Wire()
    if with_sync0:
        exchange(wire, 1234)
    else:
        wire.to_op()
        wire.one(LWR, 0, 0, wire.outputs(0x0F, 1234))
    wire.clock.time_ns += 500 * MS
    assert wire.state() == (SAFEOP | 0x10, 0x001B)
    wire.device.unpacked.clear()
    assert wire.request(OP | 0x10) == (SAFEOP, 0)  # waits for new outputs
    wire.clock.time_ns += 5 * MS
    assert wire.state() == (SAFEOP, 0)
    assert wire.device.unpacked == []
    wire.write(OUT, wire.outputs(0x06, 0))
    assert wire.state() == (OP, 0)
    wire.clock.time_ns += 5 * MS
    wire.write(OUT, wire.outputs(0x06, 0))
    wire.state()
    assert {data for _, data in wire.device.unpacked} == {wire.outputs(0x06, 0)}


def test_after_the_watchdog_the_master_can_go_back_to_op() -> None:
    wire = Wire()
    wire.to_op()
    wire.clock.time_ns = 200 * MS
    assert wire.state()[0] == SAFEOP | 0x10
    wire.write(OUT, wire.outputs())
    assert wire.request(OP)[0] == SAFEOP | 0x10  # not without acknowledgement
    assert wire.request(OP | 0x10) == (OP, 0)


def test_a_mapping_that_the_master_moves_counts_from_the_next_frame_on() -> None:
    wire = Wire()
    wire.to_op()
    assert wire.one(LRD, 0x100, 0, bytes(8)).wkc == 1
    wire.write(0x0610, fmmu(0x200, 8, IN, write=False))
    assert wire.one(LRD, 0x100, 0, bytes(8)).wkc == 0
    assert wire.one(LRD, 0x200, 0, bytes(8)).wkc == 1
