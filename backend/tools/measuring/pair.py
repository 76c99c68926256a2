"""Play two sequences at once on two axes of one machine, and record every sample of both.

The loop couples the axes: neither continues when the other is stopped, and both stop when their
skew exceeds the limit.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass

import numpy as np

from backend.axes.axis import loop
from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession, channel
from backend.axes.drive.ports import address_of
from backend.tools.measuring.alignment import FloatArray, aligned
from backend.tools.measuring.interrupted import interrupted, raise_if_ended
from backend.tools.measuring.recording import (
    ROLES,
    TARGET_OF,
    Catch,
    Play,
    Recording,
    bridged,
    bus_limits,
    cycle_s,
    enabled,
    in_si,
    quiet,
    require_agreement,
)
from backend.tools.thresholds import measuring_recording as threshold
from drivers import link as bus
from drivers.cia402 import Mode
from drivers.errors import LinkLost, NotAllowed
from drivers.halt import HaltCause


@dataclass(frozen=True)
class Pair:
    """Two axes with the exchange that moves them.

    ``sense`` is -1 where the second motor turns the other way. ``home`` are the positions of both
    [increments] at which their skew is 0.
    """

    axes: tuple[Axis, Axis]
    session: CyclicSession
    sense: int
    home: tuple[int, int]
    rated_torque_nm: tuple[float, float]

    async def coupled(self, skew_limit_rev: float) -> bus.Coupled:
        """The skew limit in the form that the cyclic loop monitors."""
        first, second = [(await axis.units()).position(1.0) for axis in self.axes]
        return bus.Coupled(self.home, self.sense * second / first, skew_limit_rev / abs(first))

    async def ways_rev(self) -> tuple[float, float]:
        """Distance of each axis from home [rev], with equal signs for equal machine motion."""
        first, second = [
            (await axis.units()).position(await axis.position_raw() - home)
            for axis, home in zip(self.axes, self.home, strict=True)
        ]
        return first, self.sense * second


@asynccontextmanager
async def both_enabled(pair: Pair) -> AsyncIterator[None]:
    """Enable both axes in CSV; on every way out both are braked before either is disabled.

    Raises:
        Interrupted: one cannot be enabled, or has a fault at the end.
    """
    first, second = pair.axes
    async with enabled(first, pair.session, Mode.CSV), enabled(second, pair.session, Mode.CSV):
        try:
            yield
        finally:
            for axis in pair.axes:
                if pair.session.running:
                    await asyncio.shield(pair.session.cyclic.halt(pair.session.station(axis.drive)))


async def play_pair(
    pair: Pair,
    speeds_rpm: FloatArray,
    envelope: Envelope,
    skew_limit_rev: float,
    progress: Callable[[float], None],
) -> tuple[Recording, Recording]:
    """Enable both axes, play speeds [2, n] in rpm, and disable both.

    Equal speeds mean equal motion of the machine, also where the motors are mirrored.

    Raises:
        MotionHalted: the envelope or the skew limit ended the motion.
        Interrupted: anything else did.
        LinkLost: samples did not arrive.
    """
    session = pair.session
    plays, catches, trajectories = [], [], []
    for axis, home, speed in zip(pair.axes, pair.home, speeds_rpm, strict=True):
        sense = pair.sense if axis is pair.axes[1] else 1
        units = await axis.units()
        values = np.array([units.velocity_raw(sense * v) for v in speed], dtype=np.int64)
        target = axis.drive.require(TARGET_OF[Mode.CSV])
        keys = [axis.drive.require(role) for role in ROLES[:3]]
        plays.append(Play(Mode.CSV, values))
        catches.append(Catch(tuple(channel(axis.drive, key) for key in [*keys, target])))
        trajectories.append(
            bus.Trajectory(
                session.station(axis.drive),
                address_of(axis.drive.parameter(target)),
                values,
                await bus_limits(axis, envelope, home),
            )
        )
    coupled = await pair.coupled(skew_limit_rev)
    async with both_enabled(pair):
        for axis in pair.axes:
            await quiet(axis)
        subscribed = [session.cyclic.blocks(catch.take) for catch in catches]
        try:
            await _through(pair, (trajectories[0], trajectories[1]), coupled, catches, progress)
        finally:
            for unsubscribe in subscribed:
                unsubscribe()
    recordings = []
    for axis, made, catch, sent, rated_nm in zip(
        pair.axes, plays, catches, trajectories, pair.rated_torque_nm, strict=True
    ):
        whole = made.values[:, None].astype(np.float64)
        table, valid = await asyncio.to_thread(aligned, whole, catch.runs(), axis.drive.name)
        period_s = cycle_s(session)
        if sent.envelope.feedback is not None:
            scale = sent.envelope.feedback
            require_agreement(axis, bridged(table, valid), valid, period_s, scale)
        recordings.append(await in_si(axis, whole, table, valid, period_s, rated_nm))
    return recordings[0], recordings[1]


async def _through(
    pair: Pair,
    trajectories: tuple[bus.Trajectory, bus.Trajectory],
    coupled: bus.Coupled,
    catches: list[Catch],
    progress: Callable[[float], None],
) -> None:
    """Renew both until every sample of both has arrived."""
    session, (first, second) = pair.session, pair.axes
    period_s, count = cycle_s(session), len(trajectories[0].values)
    drives, grants = (first.drive, second.drive), (first.grant(), second.grant())
    try:
        begun = await loop.play_pair(session, drives, trajectories, coupled, grants)
    except NotAllowed as error:
        raise interrupted(error) from error
    for catch in catches:
        catch.begin(begun)
    heard, deadline = 0, time.monotonic() + threshold.TAIL_S
    while True:
        arrived = min(catch.arrived for catch in catches)
        if arrived > heard:
            heard, deadline = arrived, time.monotonic() + threshold.TAIL_S
        # Some blocks beyond the end, as for a single axis.
        if arrived * period_s > count * period_s + 0.15:
            _raise_if_ended(pair)
            return
        if time.monotonic() > deadline:
            raise LinkLost(
                "measuring.samples-came-back-bus",
                drive=first.drive.name,
                arrived=arrived,
                count=count,
            )
        await asyncio.sleep(threshold.RENEW_S)
        _raise_if_ended(pair)
        for trajectory in trajectories:
            await session.cyclic.renew(trajectory.station)
        progress(min(1.0, arrived / count))


def _raise_if_ended(pair: Pair) -> None:
    """Raise for the axis that was stopped first, not for the one stopped with it.

    Raises:
        MotionHalted, Interrupted, LinkLost: as `raise_if_ended`.
    """
    power = pair.session.power()
    halts = [
        None if power is None else power.axis_state(pair.session.station(axis.drive)).halted
        for axis in pair.axes
    ]
    for axis, halt in zip(pair.axes, halts, strict=True):
        if halt is not None and halt.cause is not HaltCause.PARTNER:
            raise_if_ended(axis, pair.session)
    for axis in pair.axes:
        raise_if_ended(axis, pair.session)
