"""Speeds with every SYNC on a drive without cyclic modes, and the conditions for it.

Such a drive accepts its speeds in Profile velocity mode. For a measurement its ramps are set to the
fastest, so that each setpoint takes effect with its SYNC; they are restored on every exit. Nothing
in the drive ends the last speed when this computer stops sending (DS_C documents no watchdog):
therefore the drive's own travel limits must be active and a person must agree, for every
measurement.
"""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import numpy as np
import numpy.typing as npt

from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.axis.cyclic_mode import keeping_mode, modes_of_the_loop
from backend.axes.drive.drive import Drive
from backend.axes.drive.optional import existing
from backend.axes.drive.terminals import read_terminals
from backend.tools.measuring.recording import Play, bus_limits, cycle_s, enabled, play, quiet
from backend.tools.thresholds import sweep_profile_speed as threshold
from drivers.cia402 import Mode, State
from drivers.errors import LinkTimeout, NotAllowed, exceeded
from drivers.halt import HaltCause
from drivers.link import Link
from drivers.texts.message import text

#: Bit 8 of DS_C's status word (003:305).
_HOMED = 1 << 8
_WHOLE_RANGE = 2**31


def needed(drive: Drive, link: Link) -> bool:
    """Whether this drive accepts speeds in every cycle only in Profile velocity mode."""
    modes = set(drive.modes)
    target = drive.profile.by_role.get("velocity_target")
    mapped = target is not None and target.pdo in ("rx", "rxtx")
    only_profile = Mode.PV in modes and not modes & {Mode.CSP, Mode.CSV, Mode.CST}
    cyclic = link.cyclic
    return mapped and only_profile and cyclic is not None and cyclic.speeds is not None


def require_consent(session: CyclicSession, drive: Drive, consent: bool) -> None:
    """Check the consent to a motion that nothing in the drive would end.

    Raises:
        NotAllowed: the drive has no watchdog, and no person agreed.
    """
    if not consent and session.unwatched(drive):
        raise NotAllowed("sweep.drive-no-watchdog-ends", drive=drive.name)


async def require_travel_limits(axis: Axis) -> None:
    """Check that the drive itself stops at the ends of the travel.

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
    """Whether 607Dh limits the travel (CiA 402-2): equal limits, or the whole range, do not."""
    keys = [drive.key(role) for role in ("software_limit_min", "software_limit_max")]
    if None in keys:
        return False
    low, high = [await drive.raw(key) for key in keys if key is not None]
    return 0 < high - low < _WHOLE_RANGE


@asynccontextmanager
async def prepared(
    axis: Axis, session: CyclicSession, envelope: Envelope, consent: bool
) -> AsyncIterator[None]:
    """Check the conditions of a measurement, and set ramps and torque limit for its duration.

    For a drive with cyclic modes, only the consent is checked, and its mode of operation is
    restored.

    Raises:
        NotAllowed: no consent where it is needed, no travel limit in the drive, the axis is
            enabled, or the drive misinterprets a negative speed. Nothing has moved more than a
            quarter turn.
        RestoreFailed: on leaving, states what could not be restored.
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
    with axis.granted(text("motion.purpose-profile-velocity"), envelope):
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
    """Let the drive's own ramp interpolate between the setpoints of a smooth move.

    A speed that steps with every SYNC causes a torque that falls during each cycle, and samples at
    its end miss half of that: an inertia would be too small by half a cycle of the speed gain. No
    effect on drives with cyclic modes, which interpolate themselves.
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
    """Write ramps of this rate; None: the fastest possible."""
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
    """Test a short slow turn backwards: a drive that reads it as a high speed is detected.

    The manual of DS_C declares 60FFh as unsigned (003:317), so that −1 would be the highest speed.
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
