"""Speeds with every SYNC for a drive that has no cyclic mode, and what must hold before that.

Such a drive takes its speeds in Profile velocity. For a measurement its ramps are put out of the
way, so that each setpoint takes effect with its SYNC; they come back on every exit. Nothing in
the drive ends the last speed when this computer falls silent (DS_C documents no watchdog): so the
drive's own travel limits must be active and a person must agree, for every measurement.
"""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import numpy as np
import numpy.typing as npt

from backend.axis.axis import Axis, Envelope
from backend.axis.cyclic import CyclicSession
from backend.axis.cyclic_mode import keeping_mode, modes_of_the_loop
from backend.drive.drive import Drive
from backend.drive.optional import existing
from backend.drive.terminals import read_terminals
from backend.tools.measuring.recording import Play, bus_limits, cycle_s, enabled, play, quiet
from backend.tools.thresholds import sweep_profile_speed as threshold
from drivers.cia402 import Mode, State
from drivers.errors import LinkTimeout, NotAllowed, exceeded
from drivers.halt import HaltCause
from drivers.link import Link

#: Bit 8 of DS_C's status word (003:305).
_HOMED = 1 << 8
_WHOLE_RANGE = 2**31


def needed(drive: Drive, link: Link) -> bool:
    """Whether this drive takes speeds with every cycle only in Profile velocity."""
    modes = set(drive.modes)
    target = drive.profile.by_role.get("velocity_target")
    mapped = target is not None and target.pdo in ("rx", "rxtx")
    only_profile = Mode.PV in modes and not modes & {Mode.CSP, Mode.CSV, Mode.CST}
    cyclic = link.cyclic
    return mapped and only_profile and cyclic is not None and cyclic.speeds is not None


def require_consent(session: CyclicSession, drive: Drive, consent: bool) -> None:
    """Raises NotAllowed where nothing in the drive ends a speed and nobody agreed to that."""
    if not consent and session.unwatched(drive):
        raise NotAllowed("sweep.drive-no-watchdog-ends", drive=drive.name)


async def require_travel_limits(axis: Axis) -> None:
    """The drive itself must stop at the ends of travel.

    Raises:
        NotAllowed: it has neither both limit switches nor active software limits.
    """
    drive = axis.drive
    functions = {t.function_name for t in await read_terminals(drive)}
    if {"positive limit", "negative limit"} <= functions:
        return
    switch = drive.key("software_limits_on")
    if switch is None and await _limits_in_use(drive):
        return
    if switch is not None and await drive.raw(switch) and await axis.status_word() & _HOMED:
        return
    raise NotAllowed("sweep.none-travel-limits-active", drive=drive.name, parameter=switch)


async def _limits_in_use(drive: Drive) -> bool:
    """607Dh as CiA 402-2 has it: limits that are equal, or the whole range, are none."""
    keys = [drive.key(role) for role in ("software_limit_min", "software_limit_max")]
    if None in keys:
        return False
    low, high = [await drive.raw(key) for key in keys if key is not None]
    return 0 < high - low < _WHOLE_RANGE


@asynccontextmanager
async def prepared(
    axis: Axis, session: CyclicSession, envelope: Envelope, consent: bool
) -> AsyncIterator[None]:
    """Around a measurement: what must hold before, and ramps and torque limit for its length.

    A drive with cyclic modes is only asked whether it watches the exchange, and gets the mode back
    that it was in.

    Raises:
        NotAllowed: no consent where it is needed, no travel limit in the drive, the axis is
            enabled, or the drive takes a negative speed for something else. Nothing has moved
            but a quarter turn at most.
        RestoreFailed: on leaving, naming what could not be restored.
    """
    drive = axis.drive
    await axis.require_certain_scales()
    require_consent(session, drive, consent)
    if drive.id not in session.by_speed:
        async with keeping_mode(axis, session):
            yield
        return
    await require_travel_limits(axis)
    if await axis.state() is State.OPERATION_ENABLED:
        raise NotAllowed("sweep.enabled", drive=drive.name)
    ramps = [drive.require("profile_acceleration"), drive.require("profile_deceleration")]
    limits = list(await existing(drive, [drive.key("max_torque")]))
    modes = await axis.restorable_mode()
    with axis.granted("measurement by speed", envelope):
        async with axis.restoring(*ramps, *limits, *modes):
            await _prepare(axis, session, envelope, modes, ramps, limits)
            yield


async def _prepare(
    axis: Axis,
    session: CyclicSession,
    envelope: Envelope,
    modes: list[str],
    ramps: list[str],
    limits: list[str],
) -> None:
    for key in modes:
        modes_of_the_loop(axis.drive, session, key)
    await axis.limit_torque(limits, threshold.ABOVE * envelope.torque_percent)
    await _write_ramps(axis, ramps, threshold.SLOW_RPM_S)
    await _require_signed(axis, session, envelope)
    await _write_ramps(axis, ramps, None)


@asynccontextmanager
async def interpolated(
    axis: Axis, session: CyclicSession, speed_rpm: npt.NDArray[np.float64]
) -> AsyncIterator[None]:
    """Let the drive's own ramp carry it from one setpoint of a smooth move to the next.

    A speed that steps with every SYNC makes a torque that falls during each cycle, and samples at
    its end miss half of that: an inertia would come out too small by half a cycle of the speed
    gain. Nothing for drives with cyclic modes, which interpolate by themselves.
    """
    steepest = float(np.max(np.abs(np.diff(speed_rpm)), initial=0.0)) / cycle_s(session)
    if axis.drive.id not in session.by_speed or not steepest:
        yield
        return
    ramps = [axis.drive.require(f"profile_{name}") for name in ("acceleration", "deceleration")]
    async with axis.restoring(*ramps):
        await _write_ramps(axis, ramps, steepest)
        yield


async def _write_ramps(axis: Axis, keys: list[str], rpm_per_s: float | None) -> None:
    """Ramps of this rate, or as good as none."""
    drive, units = axis.drive, await axis.units()
    times = units.spec.acceleration.startswith("ms")
    for key in keys:
        raw = units.acceleration_raw(rpm_per_s or threshold.RAMP_RPM_S)
        if rpm_per_s is None and times:
            raw = threshold.RAMP_MS
        low, high = drive.parameter(key).raw_limits
        raw = int(max(raw, raw if low is None else low))
        await drive.write(key, int(min(raw, raw if high is None else high)))


async def _require_signed(axis: Axis, session: CyclicSession, envelope: Envelope) -> None:
    """A short turn backwards with a slow ramp: a drive that takes it for a high speed shows.

    60FFh of DS_C is printed as an unsigned number (003:317), with which −1 would be the highest.
    """
    drive, units = axis.drive, await axis.units()
    steps = round(threshold.TRIED_S / cycle_s(session))
    speed = -min(threshold.TRIED_RPM, 0.3 * envelope.speed_rpm)
    pause = np.zeros(steps // 4, dtype=np.int64)
    values = np.concatenate([pause, np.full(steps, units.velocity_raw(speed)), pause])
    room = Envelope(
        min(threshold.ALLOWED_REV, envelope.travel_rev),
        min(threshold.ALLOWED_RPM, envelope.speed_rpm),
        envelope.torque_percent,
        envelope.time_s,
    )
    try:
        async with enabled(axis, session, Mode.CSV) as start:
            await quiet(axis)
            recording = await play(
                axis,
                session,
                Play(Mode.CSV, values),
                await bus_limits(axis, room, start),
                1.0,
                lambda _fraction: None,
            )
    except NotAllowed as error:
        if exceeded(error) not in (HaltCause.SPEED, HaltCause.POSITION):
            raise
        raise _other_way(drive) from error
    if not await axis.standstill(2.0):
        raise LinkTimeout("sweep.still-turns-after-speed", drive=drive.name)
    turned = recording.position_rad[-1] - recording.position_rad[0]
    if turned > 0.1 * abs(speed) / 60.0 * 2 * np.pi * threshold.TRIED_S:
        raise _other_way(drive)


def _other_way(drive: Drive) -> NotAllowed:
    return NotAllowed(
        "sweep.not-turn-backwards-low", drive=drive.name, parameter=drive.key("velocity_target")
    )
