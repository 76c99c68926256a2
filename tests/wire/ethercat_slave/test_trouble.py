"""Trouble: the cable, the supply, the frames, and the control channel that causes it."""

from __future__ import annotations

import io
import json
from typing import Any

import pytest

from drivers.virtual.wires.ethercat.control import Control
from drivers.virtual.wires.ethercat.line import LINK_UP_NS
from drivers.virtual.wires.ethercat.trouble import Fate

from .frames import BRD, INIT, LWR, OP, SAFEOP, Wire, frame, parse

MS = 1_000_000


class Channel:
    def __init__(self, wire: Wire) -> None:
        self._out = io.BytesIO()
        self.control = Control(wire.segment, "test0", self._out)

    def __call__(self, do: str, **arguments: object) -> Any:
        start = self._out.tell()
        line = json.dumps({"id": 9, "do": do, **arguments}).encode()
        self.control.feed(line[:5])
        self.control.feed(line[5:] + b"\n")
        self._out.seek(start)
        answer = json.loads(self._out.readline())
        assert answer["id"] == 9
        if not answer["ok"]:
            raise ValueError(answer["error"])
        return answer["result"]


def count(wire: Wire) -> int | None:
    """Working counter of a broadcast read, None if the frame was lost."""
    raw = wire.segment.process_frame(frame((BRD, 0, 0x0130, b"\0\0")))
    return None if raw is None else parse(raw)[0].wkc


# -- cable ------------------------------------------------------------------------------------


def test_ports_show_the_topology() -> None:
    wire = Wire(3)
    wire.number()
    status = [wire.value(0x0110, 2, 0x1001 + n) for n in range(3)]
    # Port 0 and 1 linked, loops open (bits 9 and 11); the last has its port 1 closed (bit 10).
    assert [s & 0x0F00 for s in status] == [0x0A00, 0x0A00, 0x0600]
    assert [s & 0x0030 for s in status] == [0x30, 0x30, 0x10]
    assert all(s & 0xF000 == 0x5000 for s in status)


def test_a_cut_cable_hides_what_lies_behind_and_heals() -> None:
    wire = Wire(4)
    channel = Channel(wire)
    wire.to_op()
    channel("cut", cable=2)
    assert count(wire) == 2
    assert wire.value(0x0110, 2, 0x1002) & 0x0F00 == 0x0600
    assert wire.value(0x0311, 1, 0x1002) == 1  # lost link at port 1 of the slave before
    assert wire.value(0x0310, 1, 0x1001) == 0
    assert channel("state")["slaves"][2]["lost_links"] == [1, 0, 0, 0]
    channel("heal", cable=2)
    assert count(wire) == 4


def test_behind_a_cut_the_watchdog_stops_the_drives() -> None:
    wire = Wire(2)
    channel = Channel(wire)
    wire.to_op()
    channel("cut", cable=1)
    for n in range(1, 21):
        wire.clock.time_ns = n * 10 * MS
        assert wire.one(LWR, 0, 0, wire.outputs() * 2).wkc == 1
    assert wire.devices[0].lost == []
    assert channel("state")["slaves"][1]["al_code"] == 0x1B
    assert wire.devices[1].lost == ["watchdog"]
    channel("heal")
    assert wire.state(0x1001) == (OP, 0)
    assert wire.state(0x1002) == (SAFEOP | 0x10, 0x1B)


def test_without_the_first_cable_nothing_comes_back() -> None:
    wire = Wire(2)
    channel = Channel(wire)
    channel("cut", cable=0)
    assert count(wire) is None
    channel("heal", cable=0)
    assert count(wire) == 2


def test_reset_of_the_counters() -> None:
    wire = Wire(2)
    channel = Channel(wire)
    wire.number()
    channel("cut", cable=1)
    assert count(wire) == 1
    assert wire.value(0x0311, 1) == 1
    wire.write(0x0310, b"\0")
    assert wire.value(0x0310, 4) == 0


# -- supply -----------------------------------------------------------------------------------


def test_a_power_cycle_takes_a_drive_and_all_behind_it_away_for_a_while() -> None:
    wire = Wire(3)
    channel = Channel(wire)
    wire.to_op()
    wire.devices[1].values[0x2001, 1] = b"\x99\x99"
    channel("power_cycle", slave=1, off_s=0.2)
    assert count(wire) == 1
    wire.clock.time_ns = 200 * MS
    assert count(wire) == 1  # on again, the link is not up yet
    wire.clock.time_ns = 200 * MS + LINK_UP_NS
    assert count(wire) == 3
    slave = wire.slaves[1]
    assert (slave.al.state, slave.controller.station) == (INIT, 0)
    assert wire.devices[1].values[0x2001, 1] == b"\x22\x11"
    assert wire.devices[1].power_cycles == [0.2]
    # Its neighbours kept their supply: only their links fell.
    assert wire.read(0x0310, 4, 0x1001).data == b"\x00\x01\x00\x00"
    assert wire.read(0x0310, 4, 0x1003).data == b"\x01\x00\x00\x00"
    assert slave.controller.memory[0x0310:0x0314] == bytes(4)
    assert wire.slaves[2].controller.station == 0x1003


def test_off_until_reported_otherwise() -> None:
    wire = Wire(1)
    channel = Channel(wire)
    channel("power_off", slave=0)
    wire.clock.time_ns = 3_600_000 * MS
    assert count(wire) is None
    channel("power_on", slave=0)
    wire.clock.time_ns += MS
    assert count(wire) is None
    wire.clock.time_ns += LINK_UP_NS
    assert count(wire) == 1


def test_a_drive_that_goes_off_by_itself_is_noticed() -> None:
    wire = Wire(2)
    wire.number()
    wire.devices[0].power_cycle(0.1)
    assert count(wire) is None
    wire.clock.time_ns = 101 * MS
    wire.segment.settle()
    wire.clock.time_ns += LINK_UP_NS
    assert count(wire) == 2


# -- frames -----------------------------------------------------------------------------------


@pytest.mark.parametrize(("direction", "stored"), [("in", b"\x07"), ("out", b"\x00")])
def test_a_frame_is_lost_on_its_way_out_or_back(direction: str, stored: bytes) -> None:
    wire = Wire(1)
    channel = Channel(wire)
    wire.number()
    channel("lose", count=2, direction=direction)
    for _ in range(2):
        assert wire.segment.process_frame(frame((5, 0x1001, 0x0020, b"\x07"))) is None
    assert wire.read(0x0020, 1).data == stored
    assert channel("state")["trouble"]["lost"] == 2


def test_loss_by_chance_is_reproducible() -> None:
    def pattern() -> list[bool]:
        wire = Wire(1)
        Channel(wire)("lose", chance=0.3)
        return [count(wire) is None for _ in range(1000)]

    first = pattern()
    assert first == pattern()
    # Binomial: 300 ± 4 standard deviations of 14.5.
    assert 242 < sum(first) < 358


def test_cyclic_loss_spares_the_mailbox() -> None:
    wire = Wire(1)
    wire.to_op()
    Channel(wire)("lose", cyclic=True)
    assert count(wire) == 1
    assert wire.segment.process_frame(frame((LWR, 0, 0, bytes(6)))) is None


def test_late_frames_say_how_late() -> None:
    wire = Wire(1)
    Channel(wire)("late", by_s=0.005, count=1)
    assert count(wire) == 1
    assert wire.segment.reply_delay_ns == 5 * MS
    assert count(wire) == 1
    assert wire.segment.reply_delay_ns == 0


def test_a_frame_that_reaches_the_slaves_late_acts_late() -> None:
    wire = Wire(1)
    wire.number()
    Channel(wire)("late", by_s=0.002, count=1, direction="out")
    sent = frame((5, 0x1001, 0x0020, b"\x07"))
    assert wire.segment.process_frame(sent) is None
    assert wire.segment.hold_ns == 2 * MS
    assert wire.slaves[0].controller.memory[0x20] == 0
    got = wire.segment.process_frame(sent, held=True)
    assert got is not None
    assert parse(got)[0].wkc == 1
    assert wire.slaves[0].controller.memory[0x20] == 7


def test_damaged_frames_are_counted_where_they_arrive() -> None:
    wire = Wire(3)
    wire.number()
    Channel(wire)("corrupt", slave=1, port=0, count=3)
    for _ in range(3):
        assert count(wire) is None
    assert wire.read(0x0300, 2, 0x1002).data == b"\x03\x03"
    assert wire.read(0x0300, 2, 0x1001).data == b"\0\0"
    assert wire.value(0x0308, 1, 0x1003) == 3
    wire.write(0x0300, b"\0", 0x1002)
    assert wire.read(0x0300, 12, 0x1002).data == bytes(12)


def test_a_wrong_working_counter_touches_process_data_only() -> None:
    wire = Wire(2)
    wire.to_op()
    channel = Channel(wire)
    channel("counter", by=-1, count=1)
    assert count(wire) == 2
    assert wire.one(LWR, 0, 0, bytes(12)).wkc == 1
    assert wire.one(LWR, 0, 0, bytes(12)).wkc == 2


def test_peace_ends_all_frame_trouble() -> None:
    wire = Wire(1)
    wire.segment.trouble.add(Fate(lost_inbound=True))
    assert count(wire) is None
    Channel(wire)("peace")
    assert count(wire) == 1


# -- slaves -----------------------------------------------------------------------------------


def test_slowness_and_silence_by_command() -> None:
    wire = Wire(2)
    channel = Channel(wire)
    channel("timing", al_s=0.5, sdo_s=0.25, eeprom_read_s=0.001, eeprom_write_s=0.01)
    assert [s.al.delay_ns for s in wire.slaves] == [500 * MS] * 2
    channel("timing", slave=1, sdo_s=0)
    assert [s.mailbox.delay_ns for s in wire.slaves] == [250 * MS, 0]
    channel("mute", slave=0)
    assert wire.slaves[0].mailbox.muted
    channel("mute", slave=0, on=False)
    assert not wire.slaves[0].mailbox.muted
    channel("die_in_transfer", slave=1, after_segments=2)
    assert wire.slaves[1].mailbox.die_after_segments == 2
    channel("refuse", slave=0, state="safeop", code=0x1E)
    assert wire.slaves[0].al.refusals == {4: 0x1E}
    channel("refuse", slave=0, state="safeop", code=None)
    assert wire.slaves[0].al.refusals == {}


def test_odd_slaves_by_command() -> None:
    wire = Wire(1)
    channel = Channel(wire)
    channel("odd", slave=0, abort_command=0x8F, unpadded_count=True, endless_segments=True)
    oddities = wire.slaves[0].coe.oddities
    assert (oddities.abort_command, oddities.unpadded_count) == (0x8F, True)
    assert oddities.endless_segments
    channel("odd", slave=0)
    assert not wire.slaves[0].coe.oddities.unpadded_count


def test_a_busy_eeprom_by_command() -> None:
    wire = Wire(1)
    wire.number()
    channel = Channel(wire)
    channel("eeprom_busy", slave=0, for_s=0.01)
    assert wire.value(0x0502, 2) & 0x8000
    wire.clock.time_ns += 10 * MS
    assert not wire.value(0x0502, 2) & 0x8000


def test_the_truth_can_be_read_and_trouble_injected_past_the_wire() -> None:
    wire = Wire(1)
    channel = Channel(wire)
    assert channel("read", slave=0, index=0x2001, subindex=1) == "2211"
    channel("write", slave=0, index=0x2001, subindex=1, data="3412")
    assert wire.device.values[0x2001, 1] == b"\x34\x12"
    channel("inject", slave=0, what="emergency", value=0x2310)
    assert wire.device.injected == [("emergency", 0x2310)]
    assert channel("register", slave=0, address=4, length=2) == 0x0404


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ({"do": "explode"}, "unknown command"),
        ({"do": "cut", "cable": 7}, "no slave 7"),
        ({"do": "mute", "slave": -1}, "no slave -1"),
        ({"do": "lose", "chance": 0}, "chance 0"),
        ({"do": "lose", "direction": "up"}, "direction"),
        ({"do": "inject", "slave": 0, "what": "gremlins"}, "gremlins"),
        ({"do": "read", "slave": 0, "index": 0x5555}, "0x06020000"),
    ],
)
def test_wrong_commands_are_refused_in_words(command: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Channel(Wire(1))(str(command.pop("do")), **command)


def test_rubbish_on_the_channel_is_answered_not_fatal() -> None:
    control = Control(Wire(1).segment, "test0", io.BytesIO())
    assert control.execute(b"{nonsense")["ok"] is False
    assert control.execute(b"[1, 2]")["ok"] is False
