"""Cyclic exchange on a real wire: motion, samples, and trouble in the middle of it.

Time follows the frames here, so that a busy machine changes nothing; what real time decides is in
`test_real_time`.
"""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import numpy as np
import numpy.typing as npt
import pytest

from drivers.cia402 import Mode, State
from drivers.errors import Busy, EnvelopeExceeded, NotAllowed, OutOfRange
from drivers.halt import HaltCause, Halted
from drivers.link import Address, CyclicSignal, Envelope, ScopeBlock, Trajectory
from profiles.schema import DataType
from tests.support.station import HANG_S
from tests.wire.ethercat_host.conftest import Bus, Rig, until
from tests.wire.ethercat_host.servo_device import servo_profile

POSITION = Address(0x607A, 0, "INT32")
VELOCITY = Address(0x60FF, 0, "INT32")
TORQUE = Address(0x6071, 0, "INT16")
_INPUTS: tuple[tuple[int, DataType, str], ...] = (
    (0x6041, "UINT16", "status"),
    (0x6064, "INT32", "position"),
    (0x606C, "INT32", "speed"),
    (0x6077, "INT16", "torque"),
    (0x6061, "INT8", "mode"),
    (0x60F4, "INT32", "following"),
)
START = 1000
LOCKSTEP = True
"""Of the rig, see `conftest`."""


def inputs(station: int) -> list[CyclicSignal]:
    return [
        CyclicSignal(station, Address(index, 0, kind), f"{station}.{name}")
        for index, kind, name in _INPUTS
    ]


def outputs(station: int) -> list[CyclicSignal]:
    return [
        CyclicSignal(station, POSITION, f"{station}.target"),
        CyclicSignal(station, VELOCITY, f"{station}.target speed"),
        CyclicSignal(station, TORQUE, f"{station}.target torque"),
        CyclicSignal(station, Address(0x6060, 0, "INT8"), f"{station}.mode wanted"),
        CyclicSignal(station, Address(0x6072, 0, "UINT16"), f"{station}.max torque"),
    ]


@asynccontextmanager
async def running(
    rig: Rig, stations: tuple[int, ...] = (1, 2), cycle_s: float = 0.002
) -> AsyncIterator[Bus]:
    """2 ms: the tests must hold on a computer that does other things as well."""
    async with rig.link() as bus:
        for station in stations:
            bus.link.attach(station, servo_profile())
        cyclic = bus.link.process_data
        await cyclic.configure(
            [s for n in stations for s in inputs(n)],
            [s for n in stations for s in outputs(n)],
            cycle_s,
        )
        await cyclic.start()
        try:
            yield bus
        finally:
            if bus.link.quality().connected and cyclic.running:
                await cyclic.stop()


async def enable(bus: Bus, station: int, mode: Mode = Mode.CSP) -> None:
    await bus.link.process_data.drive_to(station, State.OPERATION_ENABLED, mode)
    await until(lambda: in_state(bus, station) == "Operation enabled", HANG_S)


def in_state(bus: Bus, station: int) -> str:
    return bus.link.process_data.axis_state(station)[0]


def move(
    station: int,
    values: npt.ArrayLike,
    target: Address = POSITION,
    envelope: Envelope | None = None,
    renew_s: float = 0.2,
) -> Trajectory:
    return Trajectory(
        station, target, np.asarray(values, np.int64), envelope or Envelope(), renew_s=renew_s
    )


def ramp(rig: Rig, slave: int, step: int = 5, count: int = 5000) -> npt.NDArray[np.int64]:
    return rig.truth(slave, 0x6064) + step * np.arange(count, dtype=np.int64)


class Track:
    """Everything that the loop delivered, by channel."""

    def __init__(self, bus: Bus) -> None:
        self.blocks: list[ScopeBlock] = []
        bus.link.process_data.blocks(self.blocks.append)

    def __getitem__(self, channel: str) -> npt.NDArray[np.float64]:
        column = self.blocks[0].channels.index(channel)
        return np.concatenate([block.samples[:, column] for block in self.blocks])


@pytest.mark.long
async def test_a_trajectory_is_played_exactly_one_value_per_cycle(rig: Rig) -> None:
    async with running(rig) as bus:
        track = Track(bus)
        assert bus.link.process_data.dc
        await enable(bus, 1)
        await enable(bus, 2)
        wave = (2000 * (1 - np.cos(np.linspace(0, 2 * np.pi, 300)))).astype(np.int64)
        first, second = wave + rig.truth(0, 0x6064), rig.truth(1, 0x6064) - wave
        await bus.link.process_data.run([move(1, first), move(2, second)])
        for channel, values in (("1.target", first), ("2.target", second)):

            def came_whole(channel: str = channel, values: npt.NDArray[np.int64] = values) -> bool:
                reported = track[channel]
                begin = int(np.argmax(reported != reported[0])) - int(
                    np.argmax(values != values[0])
                )
                return np.array_equal(reported[begin : begin + 300], values)

            await until(came_whole, HANG_S, "every value, once")
        follows = track["1.position"]
        assert follows.max() == first.max()
        counters = bus.link.quality().details
        delivered = sum(len(b.samples) + b.dropped for b in track.blocks)
        assert delivered <= int(counters["cyclic_cycles"]) + int(counters["cyclic_overruns"]) + 200
        ends = [b.t0_s + len(b.samples) * b.dt_s for b in track.blocks]
        for block, end in zip(track.blocks[1:], ends, strict=False):
            if not block.dropped:
                assert block.t0_s == pytest.approx(end, abs=1e-3), "no gap that is not counted"


@pytest.mark.long
async def test_mapped_objects_keep_the_value_that_they_had(rig: Rig) -> None:
    async with running(rig):
        assert rig.truth(0, 0x6072) == 3000, "a mapped torque limit must not become zero"


@pytest.mark.long
async def test_parameters_are_read_while_axes_move(rig: Rig) -> None:
    async with running(rig) as bus:
        await enable(bus, 1)
        moving = asyncio.create_task(bus.link.process_data.run([move(1, ramp(rig, 0, count=200))]))
        reads = 0
        while not moving.done():
            assert await bus.link.read(1, Address(0x1008, 0, "STRING")) == b"DICT-1 drive"
            reads += 1
        await moving
        assert reads > 20
        with pytest.raises(NotAllowed, match="6040:00 belongs to the cyclic exchange"):
            await bus.link.write(1, Address(0x6040, 0, "UINT16"), b"\x0f\0")
        await bus.link.write(1, Address(0x6072, 0, "UINT16"), (1500).to_bytes(2, "little"))
        await until(lambda: rig.truth(0, 0x6072) == 1500, HANG_S)
        with pytest.raises(Busy, match="runs on this segment"):
            await bus.link.scan(lambda _s, _t: None)


async def test_velocity_and_torque_modes(rig: Rig) -> None:
    async with running(rig) as bus:
        await enable(bus, 1, Mode.CSV)
        await bus.link.process_data.run([move(1, [3000] * 60 + [0], VELOCITY)])
        await until(lambda: rig.truth(0, 0x606C) == 0, HANG_S)
        assert rig.truth(0, 0x6064) > START
        await until(lambda: in_state(bus, 1) == "Ready to switch on", HANG_S)
        await enable(bus, 1, Mode.CST)
        await bus.link.process_data.run([move(1, [2] * 30, TORQUE)])
        await until(lambda: rig.truth(0, 0x606C) == 0, HANG_S, "the quick stop ends the motion")


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    ("what", "envelope", "halt", "words"),
    [
        (
            "torque",
            Envelope(torque_max=500),
            Halted(HaltCause.TORQUE, "torque", 900, 500),
            "torque 900 is beyond the limit of 500",
        ),
        (
            "following",
            Envelope(following_error_max=30),
            Halted(HaltCause.FOLLOWING, "following error", -40, 30),
            "following error -40 is beyond",
        ),
    ],
)
async def test_the_envelope_stops_one_axis_and_not_the_other(
    rig: Rig, what: str, envelope: Envelope, halt: Halted, words: str
) -> None:
    async with running(rig) as bus:
        await enable(bus, 1)
        await enable(bus, 2)
        play = bus.link.process_data.run(
            [move(1, ramp(rig, 0), envelope=envelope, renew_s=1.0), move(2, ramp(rig, 1))]
        )
        moving = asyncio.create_task(play)
        await asyncio.sleep(0.1)
        rig.do("inject", slave=0, what=what, value=halt.value)
        await bus.reported(words)
        await until(lambda: in_state(bus, 1) != "Operation enabled", HANG_S)
        with pytest.raises(EnvelopeExceeded, match=words) as ended:
            await moving
        assert ended.value.halt == halt, "the same value, from the loop's process to the caller"
        rig.do("inject", slave=0, what=what, value=0)
        assert not [t for t in bus.texts if "beyond" in t and words not in t]


@pytest.mark.long
async def test_what_the_envelope_forbids_is_refused_before_anything_moves(rig: Rig) -> None:
    async with running(rig) as bus:
        here = rig.truth(0, 0x6064)
        with pytest.raises(NotAllowed, match="a motion needs 'Operation enabled'"):
            await bus.link.process_data.play([move(1, [here])])
        await enable(bus, 1)
        with pytest.raises(OutOfRange, match="the envelope allows"):
            await bus.link.process_data.play(
                [move(1, [here, here + 50], envelope=Envelope(position_max=here + 10))]
            )
        with pytest.raises(OutOfRange, match="holds"):
            await bus.link.process_data.play([move(1, [1 << 40])])
        assert rig.truth(0, 0x6064) == here


@pytest.mark.long
async def test_single_wrong_counters_and_lost_frames_are_tolerated_and_counted(rig: Rig) -> None:
    async with running(rig) as bus:
        await enable(bus, 1)
        moving = asyncio.create_task(bus.link.process_data.run([move(1, ramp(rig, 0, count=250))]))
        await asyncio.sleep(0.1)
        before = bus.link.quality()
        rig.do("counter", by=-1, count=1)
        await asyncio.sleep(0.1)
        rig.do("lose", count=2, cyclic=True)
        await moving

        def counted() -> bool:
            return bus.link.quality().lost_frames - before.lost_frames >= 2

        await until(counted, HANG_S)
        assert bus.link.quality().wkc_errors - before.wkc_errors == 1


@pytest.mark.long
async def test_data_that_stay_invalid_stop_the_axis(rig: Rig) -> None:
    async with running(rig) as bus:
        await enable(bus, 1)
        await bus.link.process_data.play([move(1, ramp(rig, 0), renew_s=5)])
        rig.do("counter", by=-1)
        await bus.reported("no valid process data for", "the axis is braked")
        await until(lambda: rig.truth(0, 0x606C) == 0, HANG_S)
        rig.do("peace")
        await until(lambda: in_state(bus, 1) == "Ready to switch on", HANG_S)


@pytest.mark.long
async def test_a_power_cycle_in_motion_ends_it_and_the_drive_comes_back_disabled(
    rig: Rig,
) -> None:
    async with running(rig) as bus:
        await enable(bus, 1)
        await bus.link.process_data.play([move(1, ramp(rig, 0), renew_s=5)])
        rig.do("power_cycle", slave=0, off_s=0.3)
        await bus.reported("station 1", "was switched on again")
        await bus.reported("station 1 is in OP again", within_s=HANG_S)
        await until(lambda: in_state(bus, 1) == "Switch on disabled", HANG_S)
        assert rig.do("state")["slaves"][0]["state"] == "OP"  # type: ignore[index]
        await enable(bus, 1)
        await bus.link.process_data.run([move(1, ramp(rig, 0, count=30))])


@pytest.mark.long
async def test_another_drive_after_a_break_is_refused_in_words(rig: Rig) -> None:
    async with running(rig) as bus:
        cyclic = bus.link.process_data
        cyclic._setup["identities"][2][2] = 4711
        os.kill(bus.link._host.pid or 0, signal.SIGKILL)
        await bus.reported("could not be set up again: a different drive now answers at station 2")
        assert not cyclic.running
        assert "a different drive" in str(cyclic.trouble)
        with pytest.raises(NotAllowed, match="no axis can be enabled before that"):
            await bus.link.write(1, Address(0x6040, 0, "UINT16"), b"\x0f\0")
        await bus.link.write(1, Address(0x6040, 0, "UINT16"), b"\x02\0")
        await cyclic.stop()
        assert not cyclic.trouble, "nobody wants it any more"


@pytest.mark.long
async def test_watchdogs_are_in_the_slaves(rig: Rig) -> None:
    async with running(rig):
        for slave in (0, 1):
            divider = int(str(rig.do("register", slave=slave, address=0x400)))
            ticks = int(str(rig.do("register", slave=slave, address=0x420)))
            assert ticks * (divider + 2) * 40e-9 == pytest.approx(0.05, rel=0.01)
            assert int(str(rig.do("register", slave=slave, address=0x814, length=1))) & 0x40


@pytest.mark.long
async def test_a_refused_mapping_names_drive_and_reason(rig: Rig) -> None:
    async with rig.link() as bus:
        wish = [CyclicSignal(1, Address(0x2001, 1, "UINT16"), "odd")]
        with pytest.raises(NotAllowed, match=r"station 1 does not accept these process data"):
            await bus.link.process_data.configure(wish, [], 0.001)
        rig.do("refuse", slave=0, state="SAFEOP", code=0x0025)
        with pytest.raises(NotAllowed, match=r"refuses SAFEOP.*invalid output mapping"):
            await bus.link.process_data.configure(inputs(1), outputs(1), 0.001)
        bus.link.attach(1, servo_profile())
        with pytest.raises(NotAllowed, match="accepts cycles of 250 to 10000"):
            await bus.link.process_data.configure(inputs(1), outputs(1), 0.02)
        with pytest.raises(NotAllowed, match="configure the cyclic data first"):
            await bus.link.process_data.start()
