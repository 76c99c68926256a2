"""SYNC-driven process data against the virtual node."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from conftest import Bench, until

from drivers.canopen.busload import bus_load
from drivers.canopen.link import CanopenLink
from drivers.errors import NotAllowed
from drivers.link import (
    Address,
    CyclicSignal,
    Envelope,
    LinkEvent,
    ScopeBlock,
    Trajectory,
)

CONTROL = CyclicSignal(5, Address(0x6040, 0, "UINT16"), "control")
TARGET = CyclicSignal(5, Address(0x607A, 0, "INT32"), "target")
SPEED_TARGET = CyclicSignal(5, Address(0x60FF, 0, "INT32"), "speed target")
STATUS = CyclicSignal(5, Address(0x6041, 0, "UINT16"), "status")
POSITION = CyclicSignal(5, Address(0x6064, 0, "INT32"), "position")
SPEED = CyclicSignal(5, Address(0x606C, 0, "INT32"), "speed")
ENABLED = b"\x0f\x00"


async def _run(
    link: CanopenLink, outputs: list[CyclicSignal], cycle_s: float = 0.002
) -> list[ScopeBlock]:
    assert link.cyclic is not None
    blocks: list[ScopeBlock] = []
    link.cyclic.blocks(blocks.append)
    await link.cyclic.configure([STATUS, POSITION, SPEED], outputs, cycle_s)
    await link.cyclic.start()
    return blocks


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


async def test_a_position_trajectory_is_played_value_for_value(link: CanopenLink) -> None:
    blocks = await _run(link, [CONTROL, TARGET])
    values = np.arange(1, 101, dtype=np.int64) * 10
    assert link.cyclic is not None
    await link.cyclic.play([Trajectory(5, TARGET.address, values, Envelope(), renew_s=0.05)])
    await until(lambda: blocks and blocks[-1].samples[-1][1] == 1000)
    played = _column(blocks, "position")
    steps = np.unique(np.diff(played[played < 1000]))
    # 10 per cycle; 20 only where the computer skipped a cycle (which is counted).
    assert set(steps) <= {0.0, 10.0, 20.0, 30.0}
    assert 10.0 in steps


async def test_without_renewal_the_speed_ramps_down_and_the_axis_is_disabled(
    bench: Bench, link: CanopenLink
) -> None:
    blocks = await _run(link, [CONTROL, SPEED_TARGET])
    await link.write(5, CONTROL.address, ENABLED)
    assert bench.device.value(0x6040) == 15
    assert link.cyclic is not None
    ramp = np.arange(0, 1001, 50, dtype=np.int64)
    await link.cyclic.play([Trajectory(5, SPEED_TARGET.address, ramp, Envelope(), renew_s=0.1)])
    await until(lambda: blocks and blocks[-1].samples[-1][2] == 1000)
    await link.cyclic.renew(5)
    assert bench.device.value(0x6040) == 15
    await until(lambda: bench.device.value(0x6040) == 7)
    assert bench.device.value(0x60FF) == 0
    falling = _column(blocks, "speed")
    assert falling.max() == 1000
    # No harder than the trajectory itself: 50 per cycle.
    assert np.diff(falling[np.argmax(falling) :]).min() >= -150


async def test_leaving_the_envelope_stops_the_axis(bench: Bench, link: CanopenLink) -> None:
    events: list[LinkEvent] = []
    link.listen(events.append)
    await _run(link, [CONTROL, TARGET])
    await link.write(5, CONTROL.address, ENABLED)
    assert link.cyclic is not None
    values = np.arange(0, 20000, 10, dtype=np.int64)
    envelope = Envelope(position_max=500)
    await link.cyclic.play([Trajectory(5, TARGET.address, values, envelope, renew_s=10)])
    await until(lambda: bench.device.value(0x6040) == 7)
    assert any("position" in e.text and "above the limit 500" in e.text for e in events)
    assert bench.device.value(0x607A) < 19990


async def test_a_limit_that_cannot_be_watched_is_refused(link: CanopenLink) -> None:
    await _run(link, [TARGET])
    assert link.cyclic is not None
    trajectory = Trajectory(5, TARGET.address, np.zeros(3, np.int64), Envelope(torque_max=100))
    with pytest.raises(NotAllowed, match="torque limit of node 5 cannot be enforced"):
        await link.cyclic.play([trajectory])


async def test_halt_brakes_and_stays_enabled(bench: Bench, link: CanopenLink) -> None:
    await _run(link, [CONTROL, SPEED_TARGET])
    await link.write(5, CONTROL.address, ENABLED)
    assert link.cyclic is not None
    values = np.full(5000, 800, dtype=np.int64)
    await link.cyclic.play([Trajectory(5, SPEED_TARGET.address, values, Envelope())])
    await until(lambda: bench.device.value(0x60FF) == 800)
    await link.cyclic.halt(5)
    await until(lambda: bench.device.value(0x60FF) == 0)
    assert bench.device.value(0x6040) == 15


async def test_stop_puts_the_drive_back(bench: Bench, link: CanopenLink) -> None:
    keys = [(0x1800, 1), (0x1800, 2), (0x1A00, 0), (0x1A00, 1), (0x1400, 1), (0x1600, 1)]
    keys += [(0x1016, 1), (0x1801, 1), (0x1A01, 0)]
    before = [await link.read(5, Address(i, s, "OCTETS")) for i, s in keys]
    await _run(link, [CONTROL, TARGET])
    during = [await link.read(5, Address(i, s, "OCTETS")) for i, s in keys]
    assert during != before
    assert link.cyclic is not None
    await link.cyclic.stop()
    after = [await link.read(5, Address(i, s, "OCTETS")) for i, s in keys]
    # Entries beyond a mapping's count mean nothing: only the first entry of 1A00h is compared.
    assert after == before
    assert bench.node.state == 127
    assert bench.device.lost == []


async def test_the_drive_watches_us_and_stops_when_we_die(bench: Bench, link: CanopenLink) -> None:
    await _run(link, [CONTROL, SPEED_TARGET])
    await until(lambda: bench.node._master_seen_ns is not None)
    link._port.close()  # as if this computer had crashed
    await until(lambda: bench.device.lost)
    assert bench.device.lost == ["heartbeat of the master"]


async def test_after_a_loss_nothing_moves_by_itself(bench: Bench, link: CanopenLink) -> None:
    await _run(link, [CONTROL, SPEED_TARGET])
    await link.write(5, CONTROL.address, ENABLED)
    assert link.cyclic is not None
    values = np.full(50000, 800, dtype=np.int64)
    await link.cyclic.play([Trajectory(5, SPEED_TARGET.address, values, Envelope(), renew_s=99)])
    await until(lambda: bench.device.value(0x60FF) == 800)
    bench.wire.do(bench.wire.side.bus_off)
    await until(lambda: link.quality().details["reopened"] == 1)
    await until(lambda: bench.device.value(0x60FF) == 0)
    assert bench.device.value(0x6040) == 6


async def test_too_much_for_the_bus_is_refused(link: CanopenLink) -> None:
    assert link.cyclic is not None
    inputs = [
        CyclicSignal(station, Address(index, 0, "INT32"), f"{station} {index:x}")
        for station in range(1, 6)
        for index in (0x6064, 0x606C)
    ]
    with pytest.raises(NotAllowed, match="bus") as refused:
        await link.cyclic.configure([*inputs, *inputs], [], 0.001)
    # 10 PDOs of 8 bytes and a SYNC: 10·135 + 55 = 1405 bits in 1000 bit times.
    assert "140%" in str(refused.value)
    assert refused.value.remedy is not None
    assert "1.76 ms" in refused.value.remedy


async def test_shorter_than_a_millisecond_is_refused(link: CanopenLink) -> None:
    assert link.cyclic is not None
    with pytest.raises(NotAllowed, match="too short"):
        await link.cyclic.configure([POSITION], [], 0.0005)


async def test_what_does_not_fit_is_left_to_polling(link: CanopenLink) -> None:
    assert link.cyclic is not None
    text = CyclicSignal(5, Address(0x1008, 0, "STRING"), "name")
    modbus_only = CyclicSignal(5, Address(None, 0, "UINT16", 38), "gain")
    assert await link.cyclic.configure([POSITION, text, modbus_only], [], 0.002) == (POSITION,)


async def test_a_signal_that_the_drive_cannot_map_is_named(link: CanopenLink) -> None:
    assert link.cyclic is not None
    await link.cyclic.configure([CyclicSignal(5, TARGET.address, "x")], [], 0.002)
    with pytest.raises(NotAllowed, match="607A:00"):
        await link.cyclic.start()
    # What had been changed before the refusal is back.
    assert await link.read(5, Address(0x1800, 1, "UINT32")) == b"\x85\x01\x00\x00"


def test_bus_load_of_a_known_cycle() -> None:
    # CiA: a frame of n bytes takes at most 8n + 44 + (34 + 8n - 1)//4 bits and 3 between frames.
    load = bus_load([8, 8], 0.001, 1_000_000)
    assert load.bits_per_cycle == 2 * 135 + 55
    assert load.fraction == pytest.approx(0.325)
