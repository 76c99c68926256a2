"""Homing as a job: method, speeds, start, and the verdict of the status word."""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass

from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.polled import PolledGuard
from backend.axes.drive.readings import Reading
from backend.axes.scales.units import ramp_raw
from backend.foundation.work.jobs import JobResult, Progress
from backend.tools.measuring.axis_facts import brake_opens_s
from backend.tools.thresholds import moves_homing as threshold
from drivers import cia402
from drivers.cia402 import Mode, State
from drivers.errors import LinkTimeout, NotAllowed, OutOfRange
from drivers.texts.message import joined, text

_START_HOMING = 0x10


@dataclass(frozen=True, slots=True)
class HomingSettings:
    """Method of 6098h; speeds rpm, acceleration rpm/s, offset rev. None keeps the drive's value."""

    method: int
    envelope: Envelope
    speed_switch_rpm: float | None = None
    speed_zero_rpm: float | None = None
    acceleration_rpm_s: float | None = None
    offset_rev: float | None = None


async def home(axis: Axis, settings: HomingSettings, progress: Progress) -> JobResult:
    """Home the axis; mode and torque limit are restored, homing objects stay written.

    Raises:
        OutOfRange: the drive does not have this method.
        NotAllowed: homing error (bit 13), a fault, or travel beyond the envelope.
        LinkTimeout: not attained in time.
    """
    drive, units = axis.drive, await axis.require_certain_scales()
    known = {method.method: method for method in drive.profile.homing_methods}
    if settings.method not in known:
        raise OutOfRange(
            "moves.no-homing-method",
            drive=drive.name,
            value=settings.method,
            limit=", ".join(str(m) for m in sorted(known)),
        )
    writes: dict[str, int] = {drive.require("homing_method"): settings.method}
    for role, value in (
        ("homing_speed_switch", settings.speed_switch_rpm),
        ("homing_speed_zero", settings.speed_zero_rpm),
    ):
        if value is not None:
            key = drive.require(role)
            writes[key] = units.velocity_raw_of(drive.parameter(key), value)
    if settings.acceleration_rpm_s is not None:
        key = drive.require("homing_acceleration")
        writes[key] = ramp_raw(units, drive, key, settings.acceleration_rpm_s)
    if settings.offset_rev is not None:
        writes[drive.require("home_offset")] = units.position_raw(settings.offset_rev)
    for key, raw in writes.items():
        drive.check(drive.parameter(key), raw)
    progress(0.0, text("moves.preparing"))
    for key, raw in writes.items():
        await drive.write(key, raw)
    opens_s = await brake_opens_s(drive)
    async with axis.enabled(Mode.HM, settings.envelope):
        # A start command is lost while the brake opens (000:1377, 002:8117), and the status word
        # would still show the result of an earlier homing.
        await asyncio.sleep(opens_s)
        await axis.control(cia402.ENABLE_OPERATION | _START_HOMING)
        await _attained(axis, settings, progress)
        await axis.control(cia402.ENABLE_OPERATION)
        position = units.position(await axis.position_raw())
    return {"method": settings.method, "position_rev": position}


def _integer(name: str, reading: Reading) -> int:
    if not isinstance(reading.raw, int):
        raise LinkTimeout(
            "moves.not-read-homing", drive=name, parameter=reading.key, error=reading.problem
        )
    return reading.raw


async def _attained(axis: Axis, settings: HomingSettings, progress: Progress) -> None:
    drive, units = axis.drive, await axis.units()
    own = drive.profile.quirk("own_status_word") is not None
    shown = settings.envelope.shown
    homed_bit = 1 << 8 if own else cia402.STATUS_HOMING_ATTAINED
    began = time.monotonic()
    last, travelled = await axis.position_raw(), 0
    busy_seen = False
    guard = PolledGuard(axis, units, settings.envelope.speed_rpm * 1.3 + 30.0)
    reported = [drive.require("position_actual"), drive.require("velocity_actual")]
    while True:
        status = await axis.status_word()
        if drive.decode_state(status) is not State.OPERATION_ENABLED:
            causes = joined(await axis.blocked_by() or [text("axis.cause-left-enabled")])
            raise NotAllowed("moves.broke-off-homing", drive=drive.name, causes=causes)
        if not own and status & cia402.STATUS_HOMING_ERROR:
            raise NotAllowed(
                "moves.reports-homing-error-status", drive=drive.name, method=settings.method
            )
        elapsed = time.monotonic() - began
        attained = bool(status & homed_bit) and (own or status & cia402.STATUS_TARGET_REACHED)
        busy_seen = busy_seen or not attained
        # A drive that was homed before may show its old status until it has started again.
        if attained and (busy_seen or elapsed > 0.3):
            return
        asked_s = time.monotonic()
        readings = await drive.read_many(reported)
        position, velocity = (_integer(drive.name, readings[key]) for key in reported)
        step, last = abs(position - last), position
        # The new origin makes the position jump; that is neither travel nor speed.
        if step <= units.position_raw(settings.envelope.speed_rpm / 60.0 * 0.5) + 2:
            travelled += step
            guard.look(position, velocity, asked_s)
        else:
            guard.interrupt()
        if units.position(travelled) > 2.5 * settings.envelope.travel_rev:
            raise NotAllowed(
                "moves.travelled-without-finding-home",
                drive=drive.name,
                limit=text("limit.each-way", distance=shown.say(settings.envelope.travel_rev)),
                say=shown.say(units.position(travelled)),
            )
        if elapsed > settings.envelope.time_s:
            raise LinkTimeout(
                "moves.not-find-home-within", drive=drive.name, time_s=settings.envelope.time_s
            )
        progress(min(0.95, elapsed / settings.envelope.time_s), text("moves.searching-home"))
        await asyncio.sleep(threshold.POLL_S)
