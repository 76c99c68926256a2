"""Play a precomputed excitation cycle by cycle and record every sample of it, or fail.

The recording is aligned with the sequence by the setpoints that are read back with each sample, so
lost blocks cannot shift it. A cycle that was lost or late is marked and never evaluated; it
contains values interpolated between its neighbours, as filters and extremes are computed over all
samples.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from backend.axes.axis import loop
from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession, channel
from backend.axes.drive.ports import address_of
from backend.axes.scales.compare import disagreement_of
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.alignment import BoolArray, FloatArray, Run, aligned
from backend.tools.measuring.interrupted import (
    interrupted,
    interrupted_by,
    raise_if_ended,
    require_held,
)
from backend.tools.thresholds import measuring_recording as threshold
from drivers import link as bus
from drivers.cia402 import Mode
from drivers.errors import LinkLost, LinkTimeout, NotAllowed
from drivers.objects.feedback import FeedbackScale
from drivers.texts.message import Text

ROLES = ("position_actual", "velocity_actual", "torque_actual", "status_word")
TARGET_OF = {
    Mode.CSP: "position_target",
    Mode.CSV: "velocity_target",
    Mode.CST: "torque_target",
}


@dataclass(frozen=True)
class Recording:
    """Samples of one played sequence, as received on the bus; arrays [n], one sample per cycle.

    ``position_rad``, ``velocity_rad_s``, ``torque_nm`` are at the motor; ``sent`` and ``offset``
    are raw values as sent. ``valid`` is False where a sample was lost or is not trusted. ``also``
    [n, k] holds further requested signals, raw.
    """

    sample_rate_hz: float
    position_rad: FloatArray
    velocity_rad_s: FloatArray
    torque_nm: FloatArray
    sent: FloatArray
    offset: FloatArray
    valid: BoolArray
    also: FloatArray | None = None

    def arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """The samples as arrays for storage."""
        return {
            "position_rad": self.position_rad,
            "velocity_rad_s": self.velocity_rad_s,
            "torque_nm": self.torque_nm,
            "sent": self.sent,
            "offset": self.offset,
            "valid": self.valid,
        }


@dataclass(frozen=True)
class Play:
    """One sequence in raw units: setpoints of the mode, and optional torque offsets with them."""

    mode: Mode
    values: npt.NDArray[np.int64]
    offset_role: str | None = None
    offsets: npt.NDArray[np.int64] | None = None


@dataclass
class Catch:
    """Received blocks of a motion that begins with cycle ``first``.

    A server that was blocked for a while receives at once everything that the bus did meanwhile,
    and most of it belongs to the time before the motion.
    """

    names: tuple[str, ...]
    blocks: list[bus.ScopeBlock] = field(default_factory=list)
    first: int | None = None

    def take(self, block: bus.ScopeBlock) -> None:
        """Store a block as the exchange delivers it."""
        self.blocks += self._of_motion(block)

    def begin(self, first: int) -> None:
        """Set the number of the first cycle, once known, and discard earlier samples."""
        self.first = first
        self.blocks = [part for block in self.blocks for part in self._of_motion(block)]

    def _of_motion(self, block: bus.ScopeBlock) -> list[bus.ScopeBlock]:
        """Part of a block that may belong to the motion; all of it while ``first`` is unknown."""
        if self.first is None or block.cycle is None:
            return [block]
        early = self.first - threshold.RUN_IN - block.cycle
        if early <= 0:
            return [block]
        if early >= len(block.samples):
            return []
        valid = None if block.valid is None else block.valid[early:]
        return [
            replace(
                block,
                samples=block.samples[early:],
                valid=valid,
                dropped=0,
                cycle=block.cycle + early,
            )
        ]

    @property
    def arrived(self) -> int:
        """Number of samples of the motion so far, lost ones included."""
        if self.first is None or not self.blocks:
            return 0
        newest = self.blocks[-1]
        assert newest.cycle is not None, "what a cyclic exchange delivers is numbered"
        return newest.cycle + len(newest.samples) - self.first

    def since(self, number: int) -> FloatArray:
        """Rows [n, 3] of raw position, velocity and torque of the blocks from this index on."""
        rows = [
            block.samples[:, [block.channels.index(name) for name in self.names[:3]]]
            for block in self.blocks[number:]
        ]
        return np.concatenate(rows) if rows else np.empty((0, 3))

    def runs(self) -> list[Run]:
        """Runs of samples without a gap."""
        found: list[Run] = []
        for block in self.blocks:
            samples = block.samples[:, [block.channels.index(name) for name in self.names]]
            good = np.ones(len(samples), dtype=np.bool_) if block.valid is None else block.valid
            good = good & ~np.isnan(samples).any(axis=1)
            # By the cycle counter and not by the clock: the cycle grid follows the drives' clock.
            missing = block.dropped if found else 0
            if found and not missing:
                before, rows, valid = found.pop()
                samples, good = np.concatenate([rows, samples]), np.concatenate([valid, good])
                missing = before
            found.append((missing, samples, good))
        return found


def cycle_s(session: CyclicSession) -> float:
    """Cycle time of a running exchange [s].

    Raises:
        NotAllowed: no exchange runs.
    """
    if session.state is None:
        raise NotAllowed("measuring.cyclic-exchange-not-run", url=session.link.url)
    return session.state.cycle_s


def require_signals(axis: Axis, session: CyclicSession, mode: Mode, offset: bool) -> None:
    """Check that the signals that the measurement needs come with every cycle.

    Raises:
        NotAllowed: states the missing signal.
    """
    drive = axis.drive
    needed = [*ROLES[:3], TARGET_OF[mode], *(["torque_offset"] if offset else [])]
    for role in needed:
        key = drive.key(role)
        if key is None or not session.carries(drive, key):
            raise NotAllowed(
                "measuring.not-part-cyclic-data",
                drive=drive.name,
                parameter=key,
                replace=role.replace("_", " "),
            )


def takes_torque(axis: Axis, session: CyclicSession) -> bool:
    """Whether the exchange carries the target torque in every cycle."""
    key = axis.drive.key(TARGET_OF[Mode.CST])
    return key is not None and session.carries(axis.drive, key)


@asynccontextmanager
async def enabled(
    axis: Axis, session: CyclicSession, mode: Mode, *, by_increments: bool = False
) -> AsyncIterator[int]:
    """Enable the axis through the cyclic loop for the length of the block; yields the raw position.

    ``by_increments`` as in `Axis.enabled_cyclic`. On every way out the axis is braked and disabled.

    Raises:
        ScaleUnknown: a scale is not certain, so that the envelope would have no meaning.
        ScaleChanged: a scale differs from the one used for planning.
        Interrupted: the axis cannot be enabled, or the drive has a fault at the end.
    """
    inside = False
    if not by_increments:
        # Raised as what it is, not as an interrupted motion.
        await axis.require_planned_scales()
    entered = axis.enabled_cyclic(
        session, mode, threshold.STATE_TIMEOUT_S, by_increments=by_increments
    )
    try:
        async with entered:
            await _forgotten(axis, session)
            inside = True
            yield await axis.position_raw()
            inside = False
            require_held(axis, session)
    except NotAllowed as error:
        if inside:
            raise
        raise interrupted(error) from error


async def _forgotten(axis: Axis, session: CyclicSession) -> None:
    """Wait until the loop no longer reports why the motion before this one ended."""
    power, station = session.power(), session.station(axis.drive)
    deadline = time.monotonic() + threshold.TAIL_S
    while time.monotonic() < deadline:
        if power is None or not power.axis_state(station).halted:
            return
        await asyncio.sleep(threshold.RENEW_S / 2)


async def dwell(axis: Axis, session: CyclicSession, seconds: float) -> None:
    """Hold the last setpoint of a sequence for this time [s]; the axis stays enabled.

    Raises:
        Interrupted: the loop ended the motion meanwhile.
    """
    station, end = session.station(axis.drive), time.monotonic() + seconds
    while time.monotonic() < end:
        raise_if_ended(axis, session)
        await session.cyclic.renew(station)
        await asyncio.sleep(threshold.RENEW_S)


async def bus_limits(axis: Axis, envelope: Envelope, start_raw: int) -> bus.Envelope:
    """Envelope around a starting position, in raw units."""
    units = await axis.units()
    travel = units.position_raw(envelope.travel_rev)
    return bus.Envelope(
        position_min=start_raw - travel,
        position_max=start_raw + travel,
        speed_max=units.velocity_raw(envelope.speed_rpm),
        torque_max=units.torque_raw(envelope.torque_percent),
        feedback=units.feedback,
    )


async def play(
    axis: Axis,
    session: CyclicSession,
    sequence: Play,
    limits: bus.Envelope,
    rated_torque_nm: float,
    progress: Callable[[float], None],
    *,
    until: Callable[[FloatArray], bool] | None = None,
    also: Sequence[str] = (),
) -> Recording:
    """Play one sequence on an enabled axis and return the recording.

    ``until`` is called about 20 times a second with the rows [n, 3] of raw position, velocity and
    torque received since the last call; when it returns True, the motion ends early, by braking.
    ``also`` are the keys of further signals that come with every cycle.

    Raises:
        MotionHalted: the envelope ended the motion; `MotionHalted.halt` states why.
        Interrupted: anything else ended it, such as a fault.
        LinkLost: samples did not arrive.
    """
    drive = axis.drive
    period_s = cycle_s(session)
    keys = [drive.require(role) for role in ROLES[:3]]
    target_key = drive.require(TARGET_OF[sequence.mode])
    offset_key = drive.require(sequence.offset_role) if sequence.offset_role else None
    names = [channel(drive, key) for key in [*keys, *also, target_key]]
    if offset_key is not None:
        names.append(channel(drive, offset_key))
    catch = Catch(tuple(names))
    trajectory = bus.Trajectory(
        session.station(drive),
        address_of(drive.parameter(target_key)),
        sequence.values,
        limits,
        offset_target=address_of(drive.parameter(offset_key)) if offset_key else None,
        offset_values=sequence.offsets,
    )
    unsubscribe = session.cyclic.blocks(catch.take)
    try:
        ended_early = await _drive_through(
            axis, session, trajectory, period_s, catch, progress, until
        )
    finally:
        unsubscribe()
    whole = np.column_stack(
        [sequence.values] if sequence.offsets is None else [sequence.values, sequence.offsets]
    ).astype(np.float64)
    table, valid = await asyncio.to_thread(
        aligned, whole, catch.runs(), drive.name, ended_early=ended_early
    )
    if limits.feedback is not None:
        require_agreement(axis, bridged(table, valid), valid, period_s, limits.feedback)
    recording = await in_si(axis, whole, table, valid, period_s, rated_torque_nm)
    further = bridged(table, valid)[:, len(keys) : len(keys) + len(also)] if also else None
    return replace(recording, also=further)


def require_agreement(
    axis: Axis, table: FloatArray, valid: BoolArray, period_s: float, scale: FeedbackScale
) -> None:
    """Check the reported speed (606Ch) against the position before anything is computed from it.

    Raises:
        Interrupted: they contradict each other; states both speeds.
    """
    halt = disagreement_of(table[:, 0], table[:, 1], period_s, scale, valid)
    if halt is not None:
        raise interrupted_by(axis, halt)


async def _drive_through(
    axis: Axis,
    session: CyclicSession,
    trajectory: bus.Trajectory,
    period_s: float,
    catch: Catch,
    progress: Callable[[float], None],
    until: Callable[[FloatArray], bool] | None,
) -> bool:
    """Renew until every sample of the sequence has arrived; True when ended by ``until``."""
    count = len(trajectory.values)
    station = trajectory.station
    try:
        catch.begin(await loop.play(session, axis.drive, trajectory, axis.grant()))
    except NotAllowed as error:
        raise interrupted(error) from error
    heard, deadline, judged = 0, time.monotonic() + threshold.TAIL_S, 0
    while True:
        arrived = catch.arrived
        if arrived > heard:
            # A bus may be slow where a busy computer simulates it; only a silent one counts as
            # lost.
            heard, deadline = arrived, time.monotonic() + threshold.TAIL_S
        # Some blocks beyond the end: the first samples may be older than the first setpoint.
        if arrived * period_s > count * period_s + 0.15:
            # Also check what happened in the tail, since the last check.
            raise_if_ended(axis, session)
            return False
        if time.monotonic() > deadline:
            raise LinkLost(
                "measuring.samples-came-back-bus",
                drive=axis.drive.name,
                arrived=arrived,
                count=count,
            )
        await asyncio.sleep(threshold.RENEW_S)
        raise_if_ended(axis, session)
        await session.cyclic.renew(station)
        progress(min(1.0, arrived / count))
        if until is not None:
            rows, judged = catch.since(judged), len(catch.blocks)
            if len(rows) and until(rows):
                await session.cyclic.halt(station)
                return True


async def in_si(
    axis: Axis,
    whole: FloatArray,
    table: FloatArray,
    valid: BoolArray,
    period_s: float,
    rated_torque_nm: float,
) -> Recording:
    """Recording in SI from rows [n, 3 or more] of raw position, velocity and torque."""
    units = await axis.units()
    count = len(table)
    table = bridged(table, valid)
    return Recording(
        sample_rate_hz=1.0 / period_s,
        position_rad=table[:, 0] * (units.position(1.0) * 2 * np.pi),
        velocity_rad_s=table[:, 1] * (units.velocity(1.0) * 2 * np.pi / 60.0),
        torque_nm=table[:, 2] * (units.torque(1.0) / 100.0 * rated_torque_nm),
        sent=whole[:count, 0],
        offset=whole[:count, 1] if whole.shape[1] > 1 else np.zeros(count),
        valid=valid,
    )


def bridged(table: FloatArray, valid: BoolArray) -> FloatArray:
    """Rows [n, k] with those that are not ``valid`` [n] interpolated linearly between valid ones.

    A lost row contains zero or NaN: an axis far from zero would seem to jump there and back.
    """
    if np.all(valid) or not np.any(valid):
        return table
    rows, good = np.arange(len(table)), np.flatnonzero(valid)
    return np.column_stack([np.interp(rows, good, column[good]) for column in table.T])


def share(progress: Progress, low: float, high: float, step: Text) -> Callable[[float], None]:
    """Progress callback for the part from ``low`` to ``high`` of a job's progress."""
    return lambda fraction: progress(low + (high - low) * fraction, step)


async def quiet(axis: Axis, timeout_s: float = 3.0) -> None:
    """Wait for standstill.

    Raises:
        LinkTimeout: no standstill within the time.
    """
    if not await axis.standstill(timeout_s):
        raise LinkTimeout(
            "measuring.not-come-rest-within", drive=axis.drive.name, timeout_s=timeout_s
        )
