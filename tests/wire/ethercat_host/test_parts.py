"""Ring, messages, lanes, registers, EEPROM and permissions."""

from __future__ import annotations

import contextlib
import os
import platform
import subprocess
import sys
from collections.abc import Sequence

import numpy as np
import pytest

from drivers import errors
from drivers.computer import permissions
from drivers.computer.timing import scheduling
from drivers.errors import DriveError, LinkLost, Rejected
from drivers.ethercat.exchange.cyclic import percentile_us
from drivers.ethercat.exchange.ring import RING_BYTES, SLOT, VALID, Ring
from drivers.ethercat.exchange.samples import contiguous
from drivers.ethercat.process import protocol
from drivers.ethercat.process.stations.station import Station, change_state, to_preop
from drivers.ethercat.wire import esc, sii
from drivers.ethercat.wire.al_status import AlState, al_status_text, state_name
from drivers.ethercat.wire.frames import Request
from drivers.ethercat.wire.lanes import Lanes
from drivers.ethercat.wire.mailbox import Mailbox
from drivers.ethercat.wire.steps import Pause, Read, Step, Steps, Write
from drivers.motion.interpolation import interpolation_period
from drivers.texts.message import text


@pytest.fixture
def ring() -> Ring:
    descriptor = Ring.create()
    made = Ring(descriptor)
    os.close(descriptor)
    return made


def put(ring: Ring, number: int) -> None:
    value = number.to_bytes(4, "little")
    ring.put((number, number * 1_000_000, 0, 3, 3, VALID, 0), [value, b"\xff\xff"])


def test_samples_come_out_as_they_went_in(ring: Ring) -> None:
    ring.prepare(6)
    reader = ring.reader({"position": ("<i4", 0), "torque": ("<i2", 4)})
    for number in range(5):
        put(ring, number)
    taken, lost = reader.drain()
    assert list(taken["position"]) == [0, 1, 2, 3, 4]
    assert list(taken["torque"]) == [-1] * 5
    assert list(taken["cycle"]) == [0, 1, 2, 3, 4]
    assert lost == 0
    assert len(reader.drain()[0]) == 0
    reader.release()


def test_a_reader_that_is_too_slow_loses_the_oldest_and_counts_them(ring: Ring) -> None:
    ring.prepare(100_000 - SLOT.size)
    slots = (RING_BYTES - 4096) // 100_000
    reader = ring.reader({"position": ("<i4", 0)})
    for number in range(slots + 10):
        put(ring, number)
    taken, lost = reader.drain()
    assert len(taken) + lost == slots + 10, "every sample is delivered or counted"
    assert list(taken["position"]) == list(range(lost, slots + 10))
    reader.release()


def test_the_newest_sample_is_looked_at_and_not_taken(ring: Ring) -> None:
    ring.prepare(6)
    reader = ring.reader({"position": ("<i4", 0)})
    assert reader.newest() is None
    slots = (RING_BYTES - 4096) // ((SLOT.size + 6 + 7) // 8 * 8)
    for number in range(slots + 3):  # once round
        put(ring, number)
    newest = reader.newest()
    assert newest is not None
    assert newest["position"].tolist() == [slots + 2]
    assert len(reader.drain()[0]) > 1
    reader.release()
    assert reader.newest() is None


def test_signs_of_life(ring: Ring) -> None:
    assert ring.host_deadline_ns() == 0
    ring.host_lives_until(77, "ethercat.doing-search")
    assert (ring.host_deadline_ns(), ring.host_doing()) == (77, "ethercat.doing-search")


def test_blocks_are_cut_at_gaps_of_the_cycle_counter() -> None:
    taken = np.zeros(5, np.dtype([("cycle", "<u8")]))
    taken["cycle"] = [7, 8, 11, 12, 13]
    assert [list(part["cycle"]) for part in contiguous(taken)] == [[7, 8], [11, 12, 13]]


@pytest.mark.parametrize(
    "error",
    [
        DriveError("a"),
        errors.LinkTimeout("b"),
        LinkLost("c", remedy="d"),
        errors.ProtocolError("e", parameter="6041:00"),
        errors.OutOfRange("f", limit="1…2"),
        errors.NotAllowed("g"),
        errors.Busy("h"),
        Rejected("i", abort_code=0x06010002),
        errors.NotInUse("j"),
    ],
)
def test_every_error_survives_the_pipe(error: DriveError) -> None:
    unpacker = protocol.Unpacker()
    data = protocol.pack({"error": protocol.error_to_wire(error)})
    for byte in data[:-1]:
        assert unpacker.feed(bytes([byte])) == []
    back = protocol.error_from_wire(unpacker.feed(data[-1:])[0]["error"])
    assert type(back) is type(error)
    assert (back.message, back.remedy, back.limit) == (error.message, error.remedy, error.limit)
    assert getattr(back, "code", None) == getattr(error, "code", None)


class FakeWire:
    def __init__(self) -> None:
        self.log: list[list[tuple[int, int]]] = []

    def exchange(self, requests: Sequence[Request]) -> list[bytes | None]:
        self.log.append([(station, access.register) for station, access in requests])
        return [bytes(access.size) if isinstance(access, Read) else b"" for _, access in requests]


def test_lanes_interleave_stations_and_keep_order_within_one() -> None:
    wire, now, finished = FakeWire(), [0.0], []
    lanes = Lanes(wire, lambda: now[0])

    def job(register: int) -> Steps[int]:
        yield Read(register, 1)
        yield Pause(1.0)
        yield Write(register + 1, b"x")
        return register

    for station, register in ((1, 0x10), (1, 0x20), (2, 0x30)):
        lanes.submit(station, "mailbox", job(register), lambda r, e: finished.append((r, e)))
    while lanes.step():
        pass
    assert wire.log == [[(1, 0x10), (2, 0x30)]], "a pause of one does not hold up the other"
    assert lanes.wake_s() == 1.0
    now[0] = 1.0
    while lanes.step():
        pass
    now[0] = 2.0
    while lanes.step():
        pass
    frames = [[(1, 0x10), (2, 0x30)], [(1, 0x11), (2, 0x31)], [(1, 0x20)], [(1, 0x21)]]
    assert wire.log == frames, "what several have to ask goes in one frame"
    assert [r for r, _ in finished] == [0x10, 0x30, 0x20]
    assert not lanes.pending()


def test_dropped_transactions_end_with_an_error() -> None:
    lanes = Lanes(FakeWire(), lambda: 0.0)
    ended: list[DriveError | None] = []

    def job() -> Steps[None]:
        yield Read(0, 1)
        yield Pause(1.0)

    for _ in range(2):
        lanes.submit(1, "mailbox", job(), lambda _r, e: ended.append(e))
    lanes.step()
    lanes.drop(text("event.interface-gone", interface="eth9"))
    assert [str(e) for e in ended] == ["the interface eth9 has disappeared"] * 2
    assert not lanes.pending()


def ports(station: int, *open_ports: int, counters: bytes = bytes(20)) -> esc.PortCounters:
    status = sum(1 << 4 + p | 1 << 9 + 2 * p for p in (0, *open_ports))
    return esc.decode_ports(station, status.to_bytes(2, "little"), counters)


def test_topology_of_a_line_and_of_a_branch() -> None:
    line = [ports(1, 1), ports(2, 1), ports(3)]
    assert esc.parents(line) == {1: (0, 0), 2: (1, 1), 3: (2, 1)}
    # Station 1 branches: port 3 is served before port 1 (ETG.1000.4: order 0, 3, 1, 2).
    branch = [ports(1, 1, 3), ports(2), ports(3)]
    assert esc.parents(branch) == {1: (0, 0), 2: (1, 3), 3: (1, 1)}


def test_counters_name_the_cable() -> None:
    counters = bytearray(20)
    counters[1] = 7  # port 0: RX errors
    counters[17] = 2  # port 1: lost links
    line = [ports(1, 1), ports(2, 1, counters=bytes(counters)), ports(3)]
    found = esc.findings(line, esc.parents(line))
    assert [finding.text.words() for finding in found] == [
        "cable between station 1 and station 2: damaged frames arrived 7 times;"
        " check cable, screen and earth",
        "cable between station 2 and station 3: the link was lost 2 times; check plug and cable",
    ]


def test_errors_that_were_only_passed_on_accuse_nobody() -> None:
    counters = bytearray(20)
    counters[0], counters[8] = 5, 5  # port 0: invalid frames, all of them forwarded
    line = [ports(1, 1), ports(2, counters=bytes(counters))]
    assert esc.findings(line, esc.parents(line)) == []


def test_eeprom_checksum() -> None:
    words = bytes.fromhex("0503 4464 0000 0000 0000 0000 0000")
    assert sii.checksum(words) == _division(words)
    assert sii.checksum(words) != sii.checksum(words[:8] + b"\x01" + words[9:])


def _division(data: bytes) -> int:
    """CRC-8, polynomial 0x107, start 0xFF, as a division of whole numbers."""
    length = 8 * len(data)
    # A start value of 0xFF is the same as inverting the first eight bits of the message.
    value = (int.from_bytes(data, "big") ^ (0xFF << length - 8)) << 8
    for bit in range(length + 7, 7, -1):
        if value >> bit & 1:
            value ^= 0x107 << bit - 8
    return value


def test_al_status_in_words() -> None:
    assert al_status_text(0x001B).words().startswith("sync manager watchdog")
    assert "0x9abc" in al_status_text(0x9ABC).words()
    assert state_name(0x14) == "SAFEOP + error"


@pytest.mark.parametrize(
    ("cycle_us", "value", "exponent"),
    [(1000, 1, -3), (250, 25, -5), (500, 5, -4), (10_000, 10, -3)],
)
def test_interpolation_period(cycle_us: int, value: int, exponent: int) -> None:
    assert interpolation_period(cycle_us * 1000) == (value, exponent)


def test_permissions_name_what_is_missing_and_the_command() -> None:
    status = f"Name:\tx\nCapEff:\t{1 << 13:016x}\n"
    report = permissions.check("lo", status=status, python="/usr/bin/env")
    assert report.missing == ("CAP_NET_ADMIN",)
    assert report.advised == ("CAP_SYS_NICE", "CAP_IPC_LOCK")
    assert report.text.words() == "CAP_NET_ADMIN is missing"
    assert report.commands[0].startswith(
        "sudo setcap cap_net_raw,cap_net_admin,cap_sys_nice,cap_ipc_lock+ep /"
    )
    assert not report.ready
    everything = permissions.check("lo", status="CapEff:\tffffffffffffffff\n")
    assert everything.missing == ()


def test_permissions_without_the_interface() -> None:
    report = permissions.check("nosuch0")
    assert not report.ready
    assert "no network interface 'nosuch0'" in report.text.words()


def test_short_turns_need_no_permission() -> None:
    """The kernel reports them by sched_getattr(2); in a process of its own, not for these tests."""
    code = """
import ctypes, os, platform, struct
from drivers.computer.timing import scheduling
asked = scheduling.short_slice()
reported = ctypes.create_string_buffer(56)
number = {"x86_64": 315}.get(platform.machine(), 275)
assert ctypes.CDLL(None).syscall(number, 0, reported, 56, 0) == 0
_, policy, _, nice, _, slice_ns = struct.unpack_from("<IIQiIQ", reported)
print(int(asked), policy, nice - os.nice(0), slice_ns)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    asked, policy, nicer, slice_ns = map(int, done.stdout.split())
    assert asked == (policy == os.SCHED_OTHER), "who may run at idle times only stays there"
    assert nicer == 0
    if asked and tuple(map(int, platform.release().split(".")[:2])) >= (6, 12):
        assert slice_ns == scheduling.SHORT_SLICE_NS


def test_percentiles_of_the_lateness() -> None:
    bins = [0] * 16
    bins[3], bins[8] = 99, 1
    assert percentile_us(bins, 0.5) == 8
    assert percentile_us(bins, 0.995) == 256


def test_what_a_slave_sends_never_ends_the_process() -> None:
    def job() -> Steps[int]:
        data = yield Read(0, 1)
        assert data is not None
        return data[5]

    ended: list[DriveError | None] = []
    lanes = Lanes(FakeWire(), lambda: 0.0)
    lanes.submit(1, "mailbox", job(), lambda _r, e: ended.append(e))
    while lanes.pending():
        lanes.step()
    assert isinstance(ended[0], errors.ProtocolError)


def test_a_refused_state_is_reported_and_acknowledged_before_the_next_request() -> None:
    """By the registers alone (ETG.1000.4 clause 6.4): 0x130 with error bit 4, its code at 0x134."""
    state, code = 2, 0
    asked: list[int] = []

    def answer(step: Step) -> bytes:
        nonlocal state, code
        if isinstance(step, Write):
            assert step.register == 0x120
            asked.append(step.data[0])
            if state & 0x10 and not step.data[0] & 0x10:
                return b""
            state, code = step.data[0] & 0x0F, 0
            if step.data[0] == AlState.SAFEOP and len(asked) == 1:
                state, code = 0x12, 0x001E
            return b""
        assert isinstance(step, Read)
        assert step.register == 0x130
        return bytes([state, 0, 0, 0]) + code.to_bytes(2, "little")

    def drive(steps: Steps[None]) -> None:
        reply: bytes | None = None
        with contextlib.suppress(StopIteration):
            step = next(steps)
            while True:
                reply = b"" if isinstance(step, Pause) else answer(step)
                step = steps.send(reply)

    station = Station(3)
    words = r"station 3 refuses SAFEOP and is in PREOP \+ error: invalid input configuration"
    with pytest.raises(errors.NotAllowed, match=words):
        drive(change_state(station, AlState.SAFEOP, lambda: 0.0))
    drive(change_state(station, AlState.SAFEOP, lambda: 0.0))
    assert asked == [0x04, 0x12, 0x04], "the error is acknowledged in the state it fell to"
    assert state == AlState.SAFEOP


def test_mailboxes_whose_sync_managers_were_lost_are_set_again() -> None:
    """AL status 0016h (ETG.1000.6 table 11): a frame of the search did not arrive."""
    memory = bytearray(0x1000)
    memory[0x130] = 1
    asked: list[int] = []

    def access(step: Step) -> bytes | None:
        if isinstance(step, Read):
            return bytes(memory[step.register : step.register + step.size])
        if isinstance(step, Write):
            memory[step.register : step.register + len(step.data)] = step.data
            if step.register == 0x120:
                asked.append(step.data[0])
                ready = memory[0x800:0x808] == b"\x00\x10\x80\x00\x26\x00\x01\x00"
                memory[0x130] = 2 if step.data[0] == 2 and ready else 0x11
                memory[0x130] = 1 if step.data[0] & 0x10 else memory[0x130]
                memory[0x134] = 0x16 if memory[0x130] == 0x11 else 0
        return b""

    station = Station(1, mailbox=Mailbox(0x1000, 128, 0x1080, 128, lambda: 0.0, lambda _d: None))
    steps = to_preop(station, lambda: 0.0)
    step = next(steps)
    with contextlib.suppress(StopIteration):
        while True:
            step = steps.send(access(step))
    assert station.al_state == 2
    assert asked == [2, 0x11, 2], "refused, acknowledged, and reached"
    assert memory[0x808:0x810] == b"\x80\x10\x80\x00\x22\x00\x01\x00"
