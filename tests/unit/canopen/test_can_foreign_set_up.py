"""Set-up of foreign CANopen nodes for process data: odd lengths, refusals half way."""

from __future__ import annotations

import contextlib
import struct
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from drivers.canopen.exchange.cyclic import CanopenCyclic
from drivers.canopen.exchange.drive_setup import DriveSetup
from drivers.canopen.exchange.fixed_pdo import FixedPdo
from drivers.canopen.exchange.pdo import PdoPlan
from drivers.canopen.frames import NMT_START, Frame
from drivers.canopen.url import parse_canopen_url
from drivers.errors import LinkLost, NotAllowed, Rejected
from drivers.link import Address, CyclicSignal

SPEED = CyclicSignal(5, Address(0x60FF, 0, "INT32"), "speed")


class Node:
    """Objects of one node; ``read_only`` refuses writes, ``padded`` sends four bytes for each."""

    def __init__(
        self,
        objects: dict[tuple[int, int], bytes],
        read_only: frozenset[tuple[int, int]] = frozenset(),
        *,
        padded: bool = False,
    ) -> None:
        self.objects = objects
        self._read_only = read_only
        self._padded = padded

    def read(self, _station: int, index: int, subindex: int) -> bytes:
        if (index, subindex) not in self.objects:
            raise Rejected("the drive has no such object", abort_code=0x06020000)
        data = self.objects[index, subindex]
        return data.ljust(4, b"\0") if self._padded else data

    def write(self, _station: int, index: int, subindex: int, data: bytes) -> None:
        if (index, subindex) in self._read_only:
            raise Rejected("the object can only be read", abort_code=0x06010002)
        if len(data) != len(self.objects.get((index, subindex), data)):
            raise Rejected("the length does not fit", abort_code=0x06070010)
        self.objects[index, subindex] = data


def test_a_period_whose_exponent_is_refused_is_no_other_period() -> None:
    """1.5 ms is 15 x 10^-4 s; 15 with the drive's own exponent -3 would be 15 ms."""
    node = Node({(0x60C2, 1): b"\x02", (0x60C2, 2): b"\xfd"}, frozenset({(0x60C2, 2)}))
    setup = DriveSetup(node.read, node.write, own_id=127)
    setup.interpolate(5, 0.0015)
    assert node.objects == {(0x60C2, 1): b"\x02", (0x60C2, 2): b"\xfd"}
    setup.undo()


def test_a_period_with_the_exponent_that_the_drive_has_anyway() -> None:
    node = Node({(0x60C2, 1): b"\x02", (0x60C2, 2): b"\xfd"}, frozenset({(0x60C2, 2)}))
    setup = DriveSetup(node.read, node.write, own_id=127)
    setup.interpolate(5, 0.004)
    assert node.objects[0x60C2, 1] == b"\x04"
    setup.undo()
    assert node.objects == {(0x60C2, 1): b"\x02", (0x60C2, 2): b"\xfd"}


def test_a_node_that_sends_four_bytes_for_every_object_gets_its_pdos_back() -> None:
    """CiA 301 lets a server leave the size out of an expedited answer: then there are four."""
    mapping = {
        (0x1400, 1): struct.pack("<I", 0x205),
        (0x1400, 2): b"\xff",
        (0x1600, 0): b"\x01",
        (0x1600, 1): struct.pack("<I", 0x60400010),
        (0x60C2, 1): b"\x02",
        (0x60C2, 2): b"\xfd",
    }
    node = Node(dict(mapping), padded=True)
    setup = DriveSetup(node.read, node.write, own_id=127)
    setup.map_pdos([PdoPlan(5, "rx", 0, (SPEED,))])
    setup.interpolate(5, 0.004)
    assert node.objects[0x1600, 1] == struct.pack("<I", 0x60FF0020)
    setup.undo()
    assert node.objects == mapping


async def test_the_exchange_starts_from_values_that_come_with_four_bytes() -> None:
    """A legal answer without a size ended the start with "has 4 bytes instead of 2"."""
    node = Node(
        {
            (0x1400, 1): struct.pack("<I", 0x205),
            (0x1400, 2): b"\xff",
            (0x1600, 0): b"\0",
            (0x6040, 0): b"\x06\0",
        },
        padded=True,
    )
    url = parse_canopen_url("canopen://virtual/can0")
    sent: list[Frame] = []
    port: Any = SimpleNamespace(send=sent.append)

    async def at_once(work: Callable[[], None]) -> None:
        work()

    cyclic = CanopenCyclic(port, url, node.read, node.write, at_once)
    signal = CyclicSignal(5, Address(0x6040, 0, "UINT16"), "control")
    await cyclic.configure([], [signal], 0.01)
    await cyclic.start()
    try:
        assert cyclic.running
    finally:
        await cyclic.stop()
    assert node.objects[0x1400, 2] == b"\xff"


class StrictNode(Node):
    """Refuses another identifier while the PDO is valid (CiA 301 clause 7.5.2.35, bits 0 to 29)."""

    def write(self, station: int, index: int, subindex: int, data: bytes) -> None:
        if 0x1400 <= index < 0x1C00 and not index & 0x200 and subindex == 1:
            before, after = (struct.unpack("<I", d)[0] for d in (self.objects[index, 1], data))
            if not before & 0x80000000 and (before ^ after) & 0x3FFFFFFF:
                raise Rejected("not while it is valid", abort_code=0x06090030)
        super().write(station, index, subindex, data)


def other_identifier() -> dict[tuple[int, int], bytes]:
    return {
        (0x1400, 1): struct.pack("<I", 0x40000321),
        (0x1400, 2): b"\xff",
        (0x1600, 0): b"\x01",
        (0x1600, 1): struct.pack("<I", 0x60400010),
    }


def test_an_identifier_is_changed_while_its_pdo_is_not_valid() -> None:
    node = StrictNode(other_identifier())
    setup = DriveSetup(node.read, node.write, own_id=127)
    setup.map_pdos([PdoPlan(5, "rx", 0, (SPEED,))])
    assert node.objects[0x1400, 1] == struct.pack("<I", 0x40000205)
    setup.undo()
    assert node.objects == other_identifier()


def test_an_identifier_that_cannot_be_changed_is_the_reason_that_is_given() -> None:
    """The put-back of what never changed was refused as well, and hid the reason."""
    node = Node(other_identifier(), frozenset({(0x1400, 1)}))
    setup = DriveSetup(node.read, node.write, own_id=127)
    with pytest.raises(NotAllowed, match="does not accept 60FF:00 in the mapping of PDO 1"):
        setup.map_pdos([PdoPlan(5, "rx", 0, (SPEED,))])
    setup.undo()
    assert node.objects == other_identifier()


def test_an_identifier_that_is_fixed_but_for_its_valid_bit() -> None:
    class Fixed(Node):
        def write(self, station: int, index: int, subindex: int, data: bytes) -> None:
            before = struct.unpack("<I", self.objects[0x1400, 1])[0]
            if (index, subindex) == (0x1400, 1) and (
                (before ^ struct.unpack("<I", data)[0]) & 0x3FFFFFFF
            ):
                raise Rejected("fixed", abort_code=0x06090030)
            super().write(station, index, subindex, data)

    node = Fixed(other_identifier())
    setup = DriveSetup(node.read, node.write, own_id=127)
    with pytest.raises(NotAllowed, match="in the mapping of PDO 1: fixed"):
        setup.map_pdos([PdoPlan(5, "rx", 0, (SPEED,))])
    setup.undo()
    assert node.objects == other_identifier()


class Unplugged(Node):
    """Loses the bus after ``writes`` writes, until ``plugged``."""

    writes = 1000

    def write(self, station: int, index: int, subindex: int, data: bytes) -> None:
        if self.writes == 0:
            raise LinkLost("canopen.bus-lost")
        self.writes -= 1
        super().write(station, index, subindex, data)


def before_the_loss() -> dict[tuple[int, int], bytes]:
    return other_identifier() | {
        (0x1016, 1): bytes(4),
        (0x60C2, 1): b"\x02",
        (0x60C2, 2): b"\xfd",
    }


@pytest.mark.parametrize("left", range(9))
def test_what_a_lost_adapter_left_changed_is_restored_when_it_is_back(left: int) -> None:
    """It was forgotten, and the values of the exchange counted as the drive's own from then on."""
    node = Unplugged(before_the_loss())
    setup = DriveSetup(node.read, node.write, own_id=127)
    setup.map_pdos([PdoPlan(5, "rx", 0, (SPEED,))])
    setup.interpolate(5, 0.004)
    assert setup.guard(5)
    assert node.objects != before_the_loss()
    node.writes = left
    for undo in (setup.unguard, setup.undo):
        with contextlib.suppress(LinkLost):
            undo()
    node.writes = 1000
    setup.undo()
    assert node.objects == before_the_loss()


async def test_the_next_exchange_begins_with_what_is_still_to_be_restored() -> None:
    node = Unplugged(before_the_loss() | {(0x6040, 0): b"\x06\0"})
    port: Any = SimpleNamespace(send=lambda _frame: None)

    async def at_once(work: Callable[[], None]) -> None:
        work()

    url = parse_canopen_url("canopen://virtual/can0")
    cyclic = CanopenCyclic(port, url, node.read, node.write, at_once)
    control = CyclicSignal(5, Address(0x6040, 0, "UINT16"), "control")
    await cyclic.configure([], [control], 0.01)
    await cyclic.start()
    node.writes = 0
    with pytest.raises(LinkLost):
        await cyclic.stop()
    node.writes = 1000
    await cyclic.start()
    await cyclic.stop()
    assert {key: node.objects[key] for key in before_the_loss()} == before_the_loss()


def test_what_could_not_be_restored_is_said_in_the_readers_language() -> None:
    node = Node(before_the_loss())
    setup = DriveSetup(node.read, node.write, own_id=127)
    assert setup.guard(5)
    node._read_only = frozenset({(0x1016, 1)})
    with pytest.raises(NotAllowed, match=r"restored: node 5 1016:01 \(the object") as refused:
        setup.undo()
    assert "节点 5 的 1016:01" in refused.value.text.words("zh")


async def test_a_start_that_fails_at_its_last_step_leaves_nothing_running() -> None:
    node = Node(before_the_loss() | {(0x6040, 0): b"\x06\0"})

    def send(frame: Frame) -> None:
        if frame.cob_id == 0 and frame.data[0] == NMT_START:
            raise LinkLost("canopen.bus-lost")

    async def at_once(work: Callable[[], None]) -> None:
        work()

    port: Any = SimpleNamespace(send=send)
    url = parse_canopen_url("canopen://virtual/can0")
    cyclic = CanopenCyclic(port, url, node.read, node.write, at_once)
    await cyclic.configure([], [CyclicSignal(5, Address(0x6040, 0, "UINT16"), "control")], 0.01)
    with pytest.raises(LinkLost):
        await cyclic.start()
    assert not cyclic.running
    assert {key: node.objects[key] for key in before_the_loss()} == before_the_loss()


def inputs(count: int, gap: int | None = None) -> dict[tuple[int, int], bytes]:
    """Communication parameters of so many active input PDOs, and the contents of the first."""
    found = {
        (0x1800 + n, 1): struct.pack("<I", 0x40000185 if n == 0 else 0x40000680 + n)
        for n in range(count)
        if n != gap
    }
    return found | {(0x1800, 2): b"\xff", (0x1A00, 0): b"\0"}


class Asked(Node):
    """Records what is read of the communication parameters."""

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        self.asked: list[int] = []

    def read(self, station: int, index: int, subindex: int) -> bytes:
        self.asked.append(index)
        return super().read(station, index, subindex)


POSITION = CyclicSignal(5, Address(0x6064, 0, "INT32"), "position")


@pytest.mark.parametrize("count", [1, 4, 5, 9, 512])
def test_every_other_input_of_a_node_is_silenced_and_comes_back(count: int) -> None:
    """From the fifth on they went on loading the bus, perhaps with an identifier of ours."""
    node = Asked(inputs(count))
    setup = DriveSetup(node.read, node.write, own_id=127)
    setup.map_pdos([PdoPlan(5, "tx", 0, (POSITION,))])
    words = [struct.unpack("<I", node.objects[0x1800 + n, 1])[0] for n in range(count)]
    assert [bool(word & 0x80000000) for word in words] == [False, *[True] * (count - 1)]
    ends = max(min(count, 511), 4)
    assert max(i for i in node.asked if i < 0x1A00) == 0x1800 + ends, "then it has no more"
    setup.undo()
    back = {key: data for key, data in node.objects.items() if key != (0x1A00, 1)}
    assert back == inputs(count)


def test_a_gap_among_the_first_four_inputs_is_not_their_end() -> None:
    node = Node(inputs(6, gap=2))
    setup = DriveSetup(node.read, node.write, own_id=127)
    setup.map_pdos([PdoPlan(5, "tx", 0, (POSITION,))])
    for number in (1, 3, 4, 5):
        assert node.objects[0x1800 + number, 1][3] & 0x80


def test_an_input_that_cannot_be_silenced_is_not_the_end_of_them() -> None:
    node = Node(inputs(7), frozenset({(0x1805, 1)}))
    setup = DriveSetup(node.read, node.write, own_id=127)
    setup.map_pdos([PdoPlan(5, "tx", 0, (POSITION,))])
    assert node.objects[0x1806, 1][3] & 0x80
    setup.undo()
    assert {key: node.objects[key] for key in inputs(7)} == inputs(7)


def test_a_fixed_input_beyond_the_fourth_that_is_used_stays() -> None:
    node = Node(
        inputs(7)
        | {(0x1A05, 0): b"\1", (0x1A05, 1): struct.pack("<I", 0x60640020)}
        | {(0x1805, 2): b"\x01"}
    )
    setup = DriveSetup(node.read, node.write, own_id=127)
    fixed = FixedPdo("tx", 5, 0x685, ((POSITION.address, 4),))
    setup.map_pdos([PdoPlan(5, "tx", 5, (POSITION,), fixed)])
    valid = [n for n in range(7) if not node.objects[0x1800 + n, 1][3] & 0x80]
    assert valid == [5]
