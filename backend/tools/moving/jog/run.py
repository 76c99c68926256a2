"""Hold-to-run jog as a moving profile-position target.

The links that need it have no watchdog in the drive (architecture: "No open-ended command without a
watchdog in the drive"). Therefore the target is never more than ``v·T + v²/2a`` ahead of the axis:
without renewal, whichever side fails, the drive's own profile generator brakes and stops there.
"""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass

from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.polled import PolledGuard
from backend.axes.drive.optional import ramp_keys
from backend.axes.motion.travel_unit import REVOLUTIONS, TravelUnit
from backend.axes.scales.units import AxisUnits, ramp_raw
from backend.foundation.work.jobs import JobResult, Progress
from backend.tools.moving.jog.hold import GAP_S, Hold
from backend.tools.thresholds import jog_run as threshold
from drivers import cia402
from drivers.cia402 import Mode, State
from drivers.errors import DriveError, NotAllowed, OutOfRange
from drivers.texts import limits
from drivers.texts.answers import sentence
from drivers.texts.message import Text, joined, text
from drivers.texts.states import state_text

PERIOD_S = threshold.PERIOD_S
TRAVEL_MARGIN_REV = threshold.TRAVEL_MARGIN_REV


@dataclass(frozen=True, slots=True)
class JogSettings:
    """Speed in rpm, acceleration in rpm/s, travel in rev from the start point, torque in %."""

    direction: int
    speed_rpm: float
    acceleration_rpm_s: float
    travel_rev: float
    torque_percent: float
    shown: TravelUnit = REVOLUTIONS

    @property
    def lead_rev(self) -> float:
        """Largest distance from axis to target: ``v·T + v²/2a`` [rev]."""
        speed = self.speed_rpm / 60.0
        return speed * GAP_S + speed**2 / (2.0 * self.acceleration_rpm_s / 60.0)


async def jog(axis: Axis, settings: JogSettings, hold: Hold, progress: Progress) -> JobResult:
    """Move while ``hold`` is held; returns the reason of the end and the distance moved in rev.

    Raises:
        OutOfRange: a setting that is not possible on this drive; nothing has moved.
        NotAllowed: the axis cannot be enabled, or left the envelope.
        DriveError: the link failed; the drive stops by itself as described above.
    """
    drive, units = axis.drive, await axis.require_certain_scales()
    if settings.direction not in (-1, 1):
        raise OutOfRange("jog.direction-neither-nor", direction=settings.direction)
    require_scale(axis, units, settings)
    envelope = Envelope(settings.travel_rev, settings.speed_rpm, settings.torque_percent, 3600.0)
    ramps = {drive.require("profile_velocity"): units.velocity_raw(settings.speed_rpm)}
    for key in await ramp_keys(drive):
        ramps[key] = ramp_raw(units, drive, key, settings.acceleration_rpm_s)
    for key, raw in ramps.items():
        drive.check(drive.parameter(key), raw)
    progress(0.0, text("jog.enabling"))
    async with axis.restoring(*ramps):
        for key, raw in ramps.items():
            await drive.write(key, raw)
        if reason := hold.ended():
            return end_of(reason, 0.0)
        async with axis.enabled(Mode.PP, envelope):
            start = await axis.position_raw()
            # Enabling takes longer than the renewal timeout; the page has sent renewals meanwhile.
            progress(0.0, text("jog.moving"))
            reason = await _follow(axis, settings, hold, start)
            stop_time = 1.0 + 2.0 * settings.speed_rpm / settings.acceleration_rpm_s
            await axis.halt_and_wait(stop_time)
            moved = units.position(await axis.position_raw() - start)
    return end_of(reason, moved)


def end_of(reason: Text, moved_rev: float) -> JobResult:
    """Result of a jog: why it ended, as code and text, and the distance moved [rev]."""
    return {**sentence("reason", reason), "moved_rev": moved_rev}


def require_scale(axis: Axis, units: AxisUnits, settings: JogSettings) -> None:
    """Check that the scales are known and that the drive can resolve the speed of the jog.

    Raises:
        ScaleUnknown: the scale of position or speed is not certain.
        OutOfRange: the speed is below the drive's resolution.
    """
    drive = axis.drive
    units.require_certain()
    if units.velocity_raw(settings.speed_rpm) <= 0:
        raise OutOfRange(
            "jog.below-resolution-speed",
            drive=drive.name,
            value=settings.shown.speed(settings.speed_rpm),
            say_speed=settings.shown.say_speed(settings.speed_rpm),
        )


async def _follow(axis: Axis, settings: JogSettings, hold: Hold, start: int) -> Text:
    drive, units = axis.drive, await axis.units()
    target_key = drive.require("position_target")
    lead = units.position_raw(settings.lead_rev)
    travel = units.position_raw(settings.travel_rev)
    toggle = cia402.ENABLE_OPERATION | cia402.CHANGE_IMMEDIATELY
    low, high = drive.parameter(target_key).raw_limits
    due = time.monotonic()
    last_target: int | None = None
    guard = PolledGuard(axis, units, settings.speed_rpm * 1.3 + 30.0)
    paused = False
    while not (reason := hold.ended()):
        asked_s = time.monotonic()
        position, velocity, state = await _observe(axis)
        guard.look(position, velocity, asked_s)
        if state is not State.OPERATION_ENABLED:
            raise NotAllowed(
                "jog.left-enabled",
                drive=drive.name,
                enabled=state_text(State.OPERATION_ENABLED),
                why=joined(await axis.blocked_by() or [state_text(state)]),
            )
        _inside(axis, settings, units.position(position - start))
        ahead = start + settings.direction * travel
        target = position + settings.direction * lead
        target = min(target, ahead) if settings.direction > 0 else max(target, ahead)
        # The axis stops at the end of the drive's number range as at a travel limit.
        target = int(
            min(max(target, target if low is None else low), target if high is None else high)
        )
        if hold.ended():
            continue
        if hold.braking():
            if not paused:
                # The drive brakes by its own ramp and stays enabled.
                await axis.control(cia402.ENABLE_OPERATION | cia402.HALT)
                paused = True
            await asyncio.sleep(PERIOD_S)
            continue
        if paused:
            # Continue from the position where it halted: the previous target is obsolete.
            paused, last_target = False, None
        if target != last_target:
            await drive.command(target_key, target, axis.grant(target_key))
            await axis.control(toggle | cia402.NEW_SET_POINT)
            await axis.control(toggle)
            last_target = target
        due = max(due + PERIOD_S, time.monotonic())
        await asyncio.sleep(due - time.monotonic())
    return reason


async def _observe(axis: Axis) -> tuple[int, int, State]:
    drive = axis.drive
    keys = [drive.require(r) for r in ("status_word", "position_actual", "velocity_actual")]
    readings = await drive.read_many(keys)
    values: list[int] = []
    for key in keys:
        raw = readings[key].raw
        if not isinstance(raw, int):
            raise DriveError(
                "jog.not-read-jogging", drive=drive.name, parameter=key, error=readings[key].problem
            )
        values.append(raw)
    return values[1], values[2], drive.decode_state(values[0])


def _inside(axis: Axis, settings: JogSettings, moved_rev: float) -> None:
    if abs(moved_rev) > settings.travel_rev + TRAVEL_MARGIN_REV:
        raise NotAllowed(
            "jog.left-travel-limit-jog",
            drive=axis.drive.name,
            value=settings.shown.travel(moved_rev),
            limit=limits.from_start(settings.shown.say(settings.travel_rev)),
        )
