"""SYNC-driven process data against the virtual node."""

from __future__ import annotations

import itertools
import time

import numpy as np
import pytest

from drivers.canopen.exchange.busload import bus_load
from drivers.canopen.exchange.cyclic import CanopenCyclic
from drivers.canopen.link import CanopenLink
from drivers.cia402 import State
from drivers.errors import NotAllowed, OutOfRange
from drivers.halt import HaltCause, Halted
from drivers.link import (
    Address,
    CyclicSignal,
    Envelope,
    LinkEvent,
    ScopeBlock,
    Trajectory,
)
from drivers.virtual.wires.canopen import CanopenNode
from tests.wire.canopen.conftest import Bench, until
from tests.wire.canopen.small_device import SmallDevice

CONTROL = CyclicSignal(5, Address(0x6040, 0, "UINT16"), "control")
TARGET = CyclicSignal(5, Address(0x607A, 0, "INT32"), "target")
SPEED_TARGET = CyclicSignal(5, Address(0x60FF, 0, "INT32"), "speed target")
MODE = CyclicSignal(5, Address(0x6060, 0, "INT8"), "mode")
STATUS = CyclicSignal(5, Address(0x6041, 0, "UINT16"), "status")
POSITION = CyclicSignal(5, Address(0x6064, 0, "INT32"), "position")
SPEED = CyclicSignal(5, Address(0x606C, 0, "INT32"), "speed")
CSP, CSV = 8, 9


def _cyclic(link: CanopenLink) -> CanopenCyclic:
    assert isinstance(link.cyclic, CanopenCyclic)
    return link.cyclic


def _lost(link: CanopenLink, note: str) -> bool:
    halt = _cyclic(link).axis_state(5).halted
    return halt is not None and halt.cause is HaltCause.LOST and note in str(halt.note)


async def _run(
    link: CanopenLink, outputs: list[CyclicSignal], cycle_s: float = 0.002
) -> list[ScopeBlock]:
    blocks: list[ScopeBlock] = []
    cyclic = _cyclic(link)
    cyclic.blocks(blocks.append)
    await cyclic.configure([STATUS, POSITION, SPEED], outputs, cycle_s)
    await cyclic.start()
    return blocks


async def _enable(link: CanopenLink, mode: int) -> None:
    await _cyclic(link).drive_to(5, State.OPERATION_ENABLED, mode)
    await until(lambda: _cyclic(link).axis_state(5)[0] == State.OPERATION_ENABLED.value)


def _column(blocks: list[ScopeBlock], channel: str) -> np.ndarray:
    valid = [b.samples[b.valid] for b in blocks if b.valid is not None]
    return np.concatenate(valid)[:, blocks[0].channels.index(channel)]


async def test_samples_come_with_their_times(link: CanopenLink) -> None:
    blocks = await _run(link, [])
    await until(lambda: len(blocks) > 4)
    assert blocks[0].channels == ("status", "position", "speed")
    assert blocks[0].dt_s == 0.002
    assert set(_column(blocks, "status")) == {0x0250}
    for before, after in itertools.pairwise(blocks):
        assert after.sequence == before.sequence + 1
        gap = after.t0_s - before.t0_s - (len(before.samples) + after.dropped) * before.dt_s
        assert abs(gap) < 1e-9


@pytest.mark.parametrize("option", ["", "&own_id=126"])
async def test_no_node_may_have_the_number_of_our_heartbeat(bench: Bench, option: str) -> None:
    """Drives that watch for 127 would go on for as long as that node lives."""
    link = CanopenLink(bench.url + option)
    await link.open()
    try:
        node = CanopenNode(SmallDevice(), 127, time.monotonic_ns)
        bench.wire.do(lambda: bench.wire.nodes.append(node))
        await until(lambda: link._watch.is_there(127))
        await _cyclic(link).configure([STATUS], [CONTROL, TARGET], 0.002)
        if option:
            await _cyclic(link).start()
        else:
            with pytest.raises(
                NotAllowed,
                match="node 127 has the number with which this computer sends its heartbeat",
            ):
                await _cyclic(link).start()
            await _run(link, [])
    finally:
        await link.close()


async def test_the_loop_owns_the_power_state(bench: Bench, link: CanopenLink) -> None:
    await _run(link, [CONTROL, TARGET])
    cyclic = _cyclic(link)
    assert cyclic.power is not None
    await _enable(link, CSP)
    assert bench.device.value(0x6040) == 15
    assert bench.device.value(0x6061) == CSP  # by SDO, as the mode is not in the PDOs
    with pytest.raises(NotAllowed, match="the cyclic exchange writes 6040h"):
        await link.write(5, CONTROL.address, b"\x00\x00")
    await cyclic.power.drive_to(5, State.SWITCH_ON_DISABLED)
    await until(lambda: bench.device.value(0x6041) == 0x0250)


async def test_a_halt_while_the_mode_is_written_ends_the_enabling(
    bench: Bench, link: CanopenLink, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The mode goes by SDO first: STOP in that time comes before the words that enable."""
    await _run(link, [CONTROL, TARGET])
    cyclic = _cyclic(link)
    write, loop = cyclic._write, cyclic._loop
    assert loop is not None

    def halted_meanwhile(station: int, index: int, subindex: int, data: bytes) -> None:
        write(station, index, subindex, data)
        loop.halt(5, Halted(HaltCause.COMMANDED))

    monkeypatch.setattr(cyclic, "_write", halted_meanwhile)
    with pytest.raises(NotAllowed, match="was halted"):
        await cyclic.drive_to(5, State.OPERATION_ENABLED, CSP)
    assert loop.images.axes[5].goal is None
    monkeypatch.undo()
    await _enable(link, CSP)


async def test_a_position_trajectory_is_played_value_for_value(link: CanopenLink) -> None:
    blocks = await _run(link, [CONTROL, TARGET, MODE])
    await _enable(link, CSP)
    values = np.arange(1, 101, dtype=np.int64) * 10
    await _cyclic(link).play([Trajectory(5, TARGET.address, values, Envelope(), renew_s=1.0)])
    await until(lambda: bool(blocks) and blocks[-1].samples[-1][1] == 1000)
    played = _column(blocks, "position")
    steps = np.diff(played[played <= 1000])
    # 10 per cycle; more only behind cycles without samples, or that a late computer left out.
    moving = steps[int(np.argmax(steps > 0)) :]
    assert not np.any(moving % 10)
    extra = int(np.sum(np.maximum(moving / 10 - 1, 0)))
    missing = sum(block.dropped + np.count_nonzero(~block.valid) for block in blocks)
    assert extra <= np.count_nonzero(moving == 0) + missing
    assert np.count_nonzero(moving == 10) > 20


async def test_a_jump_at_the_beginning_is_refused(link: CanopenLink) -> None:
    await _run(link, [CONTROL, TARGET, MODE])
    await _enable(link, CSP)
    values = np.arange(5000, 5100, dtype=np.int64)
    with pytest.raises(NotAllowed, match="begins at 5000"):
        await _cyclic(link).play([Trajectory(5, TARGET.address, values, Envelope())])


async def test_a_disabled_axis_is_followed_so_that_enabling_never_moves(
    bench: Bench, link: CanopenLink
) -> None:
    blocks = await _run(link, [CONTROL, TARGET, MODE])
    bench.wire.do(lambda: bench.device.turn_by_hand(777))
    await until(lambda: bool(blocks) and blocks[-1].samples[-1][1] == 777)
    await until(lambda: bench.device.value(0x607A) == 777)
    await _enable(link, CSP)
    assert bench.device.value(0x6064) == 777


async def test_without_renewal_the_speed_ramps_down_and_the_axis_is_disabled(
    bench: Bench, link: CanopenLink
) -> None:
    blocks = await _run(link, [CONTROL, SPEED_TARGET, MODE])
    await _enable(link, CSV)
    ramp = np.concatenate([np.arange(0, 1000, 50), np.full(500, 1000)]).astype(np.int64)
    await _cyclic(link).play([Trajectory(5, SPEED_TARGET.address, ramp, Envelope(), renew_s=0.2)])
    await until(lambda: bool(blocks) and blocks[-1].samples[-1][2] == 1000)
    await until(lambda: bench.device.value(0x6041) != 0x0237)
    assert bench.device.value(0x60FF) == 0
    assert _cyclic(link).axis_state(5).halted == Halted(HaltCause.EXPIRED)
    falling = _column(blocks, "speed")
    assert falling.max() == 1000
    # In 0.1 s from 1000 to 0: 20 per cycle of 2 ms, so nowhere half of it at once.
    assert np.diff(falling[np.argmax(falling) :]).min() > -500


async def test_leaving_the_envelope_stops_the_axis(bench: Bench, link: CanopenLink) -> None:
    events: list[LinkEvent] = []
    link.listen(events.append)
    await _run(link, [CONTROL, SPEED_TARGET, MODE])
    await _enable(link, CSV)
    values = np.full(2000, 100, np.int64)
    envelope = Envelope(position_max=500)
    await _cyclic(link).play([Trajectory(5, SPEED_TARGET.address, values, envelope, renew_s=10)])
    bench.wire.do(lambda: bench.device.turn_by_hand(600))
    await until(lambda: bench.device.value(0x6041) != 0x0237)
    assert any(
        "position" in e.text.words() and "beyond the limit of 500" in e.text.words() for e in events
    )
    assert bench.device.value(0x60FF) == 0


async def test_what_cannot_be_played_is_refused(link: CanopenLink) -> None:
    await _run(link, [CONTROL, TARGET, MODE])
    zeros = np.zeros(3, np.int64)
    with pytest.raises(NotAllowed, match="needs 'Operation enabled'"):
        await _cyclic(link).play([Trajectory(5, TARGET.address, zeros, Envelope())])
    await _enable(link, CSP)
    with pytest.raises(NotAllowed, match="torque limit cannot be watched"):
        await _cyclic(link).play([Trajectory(5, TARGET.address, zeros, Envelope(torque_max=100))])
    with pytest.raises(NotAllowed, match="not in the cyclic data"):
        await _cyclic(link).play([Trajectory(5, SPEED_TARGET.address, zeros, Envelope())])
    with pytest.raises(OutOfRange, match="607A:00 holds"):
        await _cyclic(link).play([Trajectory(5, TARGET.address, zeros + 2**31, Envelope())])
    offset = Address(0x60B2, 0, "INT16")
    with pytest.raises(OutOfRange, match="differ in number"):
        await _cyclic(link).play(
            [Trajectory(5, TARGET.address, zeros, Envelope(), offset, zeros[:2])]
        )


async def test_halt_brakes_and_leaves_operation(bench: Bench, link: CanopenLink) -> None:
    await _run(link, [CONTROL, SPEED_TARGET, MODE])
    await _enable(link, CSV)
    values = np.full(5000, 800, dtype=np.int64)
    trajectory = Trajectory(5, SPEED_TARGET.address, values, Envelope(), renew_s=99)
    await _cyclic(link).play([trajectory])
    await until(lambda: bench.device.value(0x60FF) == 800)
    await _cyclic(link).halt(5)
    await until(lambda: bench.device.value(0x6041) == 0x0231)
    assert bench.device.value(0x60FF) == 0


async def test_a_node_that_starts_with_our_number_halts_the_axes(
    bench: Bench, link: CanopenLink
) -> None:
    await _run(link, [CONTROL, SPEED_TARGET, MODE])
    await _enable(link, CSV)
    values = np.full(5000, 800, dtype=np.int64)
    trajectory = Trajectory(5, SPEED_TARGET.address, values, Envelope(), renew_s=99)
    await _cyclic(link).play([trajectory])
    await until(lambda: bench.device.value(0x60FF) == 800)
    node = CanopenNode(SmallDevice(), 127, time.monotonic_ns)
    bench.wire.do(lambda: bench.wire.nodes.append(node))
    await until(lambda: bench.device.value(0x6041) == 0x0231)
    assert bench.device.value(0x60FF) == 0


async def test_stop_puts_the_drive_back(bench: Bench, link: CanopenLink) -> None:
    keys = [(0x1800, 1), (0x1800, 2), (0x1A00, 0), (0x1A00, 1), (0x1400, 1), (0x1600, 1)]
    keys += [(0x1016, 1), (0x1801, 1), (0x1A01, 0)]
    before = [await link.read(5, Address(i, s, "OCTETS")) for i, s in keys]
    await _run(link, [CONTROL, TARGET])
    await _enable(link, CSP)
    during = [await link.read(5, Address(i, s, "OCTETS")) for i, s in keys]
    assert during != before
    await _cyclic(link).stop()
    after = [await link.read(5, Address(i, s, "OCTETS")) for i, s in keys]
    assert after == before
    assert bench.node.state == 127
    assert bench.device.lost == []
    assert bench.device.value(0x6041) == 0x0231  # not enabled any more


async def test_the_drive_watches_us_and_stops_when_we_die(bench: Bench, link: CanopenLink) -> None:
    await _run(link, [CONTROL, SPEED_TARGET])
    await until(lambda: bench.node._master_seen_ns is not None)
    link._port.close()  # as if this computer had crashed
    await until(lambda: bench.device.lost)
    assert bench.device.lost == ["heartbeat of the master"]


async def test_after_a_loss_nothing_moves_by_itself(bench: Bench, link: CanopenLink) -> None:
    await _run(link, [CONTROL, SPEED_TARGET, MODE])
    await _enable(link, CSV)
    values = np.full(50000, 800, dtype=np.int64)
    await _cyclic(link).play([Trajectory(5, SPEED_TARGET.address, values, Envelope(), renew_s=99)])
    await until(lambda: bench.device.value(0x60FF) == 800)
    bench.wire.do(bench.wire.side.bus_off)
    await until(lambda: link.quality().details["reopened"] == 1)
    await until(lambda: bench.device.value(0x60FF) == 0)
    assert bench.device.value(0x6040) == 6
    assert _lost(link, "bus-off")


async def test_a_drive_that_falls_silent_is_given_up(bench: Bench, link: CanopenLink) -> None:
    await _run(link, [CONTROL, SPEED_TARGET, MODE])
    await _enable(link, CSV)
    values = np.full(50000, 800, dtype=np.int64)
    await _cyclic(link).play([Trajectory(5, SPEED_TARGET.address, values, Envelope(), renew_s=99)])
    await until(lambda: bench.device.value(0x60FF) == 800)
    newest = _cyclic(link).newest(["speed", "position", "speed target"], 1.0)
    assert list(newest) == ["speed", "position"], "what it is reported is nothing that it tells"
    bench.node.mute = True
    await until(lambda: bench.device.value(0x6040) == 6)
    assert _cyclic(link).newest(["speed"], 1.0) == {}
    assert bench.device.value(0x60FF) == 0
    assert _lost(link, "no more cyclic data")
    bench.node.mute = False


async def test_a_drive_without_cyclic_modes_is_commanded_by_sdo(
    bench: Bench, link: CanopenLink
) -> None:
    link.attach(5, bench.device.profile)  # modes 1 and 3 only
    cyclic = _cyclic(link)
    mapped = await cyclic.configure([STATUS, POSITION], [CONTROL, TARGET], 0.002)
    assert mapped == (STATUS, POSITION)
    assert "commanded by SDO" in cyclic.left_over[0][1].words()
    await cyclic.start()
    assert not cyclic.owns(5)
    await link.write(5, CONTROL.address, b"\x06\x00")
    assert bench.device.value(0x6040) == 6
    with pytest.raises(NotAllowed, match="not in the cyclic data"):
        await cyclic.drive_to(5, State.OPERATION_ENABLED)


async def test_too_much_for_the_bus_is_refused(link: CanopenLink) -> None:
    inputs = [
        CyclicSignal(station, Address(index, 0, "INT32"), f"{station} {index:x}")
        for station in range(1, 11)
        for index in (0x6064, 0x606C)
    ]
    with pytest.raises(NotAllowed, match="bus") as refused:
        await _cyclic(link).configure(inputs, [], 0.001)
    # 10 PDOs of 8 bytes and a SYNC: 10·135 + 55 = 1405 bits in 1000 bit times.
    assert "140%" in str(refused.value)
    assert refused.value.remedy is not None
    assert "1.76 ms" in refused.value.remedy


async def test_shorter_than_a_millisecond_is_refused(link: CanopenLink) -> None:
    with pytest.raises(NotAllowed, match="too short"):
        await _cyclic(link).configure([POSITION], [], 0.0005)


async def test_what_does_not_fit_is_left_to_polling(link: CanopenLink) -> None:
    text = CyclicSignal(5, Address(0x1008, 0, "STRING"), "name")
    modbus_only = CyclicSignal(5, Address(None, 0, "UINT16", 38), "gain")
    cyclic = _cyclic(link)
    assert await cyclic.configure([POSITION, text, modbus_only], [], 0.002) == (POSITION,)


async def test_a_signal_that_the_drive_cannot_map_is_named(link: CanopenLink) -> None:
    cyclic = _cyclic(link)
    await cyclic.configure([CyclicSignal(5, TARGET.address, "x")], [], 0.002)
    with pytest.raises(NotAllowed, match="607A:00"):
        await cyclic.start()
    # What had been changed before the refusal is back.
    assert await link.read(5, Address(0x1800, 1, "UINT32")) == b"\x85\x01\x00\x00"


def test_bus_load_of_a_known_cycle() -> None:
    # CiA: a frame of n bytes takes at most 8n + 44 + (34 + 8n - 1)//4 bits and 3 between frames.
    load = bus_load([8, 8], 0.001, 1_000_000)
    assert load.bits_per_cycle == 2 * 135 + 55
    assert load.fraction == pytest.approx(0.325)
