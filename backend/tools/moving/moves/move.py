"""Moves in profile modes: single moves, reciprocating moves, velocity and torque for a time."""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass
from typing import Literal

from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.polled import PolledGuard
from backend.axes.drive.optional import ramp_keys
from backend.axes.scales.units import AxisUnits, ramp_raw
from backend.foundation.work.jobs import JobResult, Progress
from backend.tools.measuring.axis_facts import brake_opens_s
from backend.tools.thresholds import moves_move as threshold
from drivers import cia402
from drivers.cia402 import Mode, State
from drivers.errors import LinkTimeout, NotAllowed, OutOfRange
from drivers.texts import limits
from drivers.texts.message import joined, text


@dataclass(frozen=True, slots=True)
class MoveSettings:
    """One move. Target in rev (PP), rpm (PV) or % (PT); speed rpm; ramps rpm/s."""

    mode: Literal["PP", "PV", "PT"]
    target: float
    envelope: Envelope
    relative: bool = False
    speed_rpm: float | None = None
    acceleration_rpm_s: float | None = None
    deceleration_rpm_s: float | None = None
    consent: bool = False


@dataclass(frozen=True, slots=True)
class SequenceSettings:
    """Reciprocating move: positions in rev, speed rpm, ramp rpm/s, dwell s."""

    first: float
    second: float
    speed_rpm: float
    acceleration_rpm_s: float
    dwell_s: float
    count: int
    envelope: Envelope


@dataclass(frozen=True, slots=True)
class _Watch:
    """Limits of one motion, relative to its start."""

    start: int
    envelope: Envelope
    guard: PolledGuard


def _watch(axis: Axis, units: AxisUnits, start: int, envelope: Envelope) -> _Watch:
    return _Watch(start, envelope, PolledGuard(axis, units, envelope.speed_rpm * 1.3 + 30.0))


async def move(axis: Axis, settings: MoveSettings, progress: Progress) -> JobResult:
    """Make one move in a profile mode, to the target, or for the envelope's time (PV, PT).

    Raises:
        OutOfRange: target or speed outside the envelope; nothing has moved.
        NotAllowed: no consent where it is needed, or the axis left the envelope.
        MotionHalted: it is too fast, or its speed and position contradict each other.
        LinkTimeout: the target was not reached in time.
    """
    units = await axis.require_certain_scales()
    if settings.mode != "PP":
        _require_watchdog_or_consent(axis, settings.consent)
    async with axis.restoring(*(ramps := await _ramps(axis, settings))):
        for key, raw in ramps.items():
            await axis.drive.write(key, raw)
        start = await axis.position_raw()
        if settings.mode == "PP":
            _require_reachable(
                axis, units, _target(units, settings, start), start, settings.envelope
            )
        else:
            _require_inside(axis, units, settings)
        opens_s = await brake_opens_s(axis.drive)
        async with axis.enabled(Mode[settings.mode], settings.envelope):
            start = await axis.position_raw()
            if settings.mode == "PP":
                target = _target(units, settings, start)
                watch = _watch(axis, units, start, settings.envelope)
                await _to(axis, target, watch, progress, opens_s)
            else:
                await _hold(axis, settings, start, progress)
            end = await axis.position_raw()
    return {"start_rev": units.position(start), "end_rev": units.position(end)}


async def sequence(axis: Axis, settings: SequenceSettings, progress: Progress) -> JobResult:
    """Move between two positions ``count`` times with a dwell at each.

    Raises:
        OutOfRange, NotAllowed, LinkTimeout: as `move`.
    """
    units = await axis.require_certain_scales()
    first = MoveSettings(
        "PP",
        settings.first,
        settings.envelope,
        speed_rpm=settings.speed_rpm,
        acceleration_rpm_s=settings.acceleration_rpm_s,
        deceleration_rpm_s=settings.acceleration_rpm_s,
    )
    times: list[float] = []
    async with axis.restoring(*(ramps := await _ramps(axis, first))):
        for key, raw in ramps.items():
            await axis.drive.write(key, raw)
        start = await axis.position_raw()
        for place in (settings.first, settings.second):
            _require_reachable(axis, units, units.position_raw(place), start, settings.envelope)
        opens_s = await brake_opens_s(axis.drive)
        async with axis.enabled(Mode.PP, settings.envelope):
            watch = _watch(axis, units, await axis.position_raw(), settings.envelope)
            for number in range(settings.count):
                for place in (settings.first, settings.second):
                    progress(
                        number / settings.count,
                        text("moves.cycle", number=number + 1, count=settings.count),
                    )
                    began = time.monotonic()
                    target = units.position_raw(place)
                    await _to(axis, target, watch, None, opens_s)
                    opens_s = 0.0
                    times.append(time.monotonic() - began)
                    await _dwell(axis, settings.dwell_s, watch)
    return {"cycles": settings.count, "mean_move_s": sum(times) / len(times)}


def _require_watchdog_or_consent(axis: Axis, consent: bool) -> None:
    spec = axis.drive.ports[0].spec
    # The watchdogs of EtherCAT and CANopen drives monitor the cyclic exchange; without one, mailbox
    # commands are not monitored.
    exchanging = axis.session is not None and axis.session.running
    watched = exchanging and spec is not None and spec.watchdog.present
    if not watched and not consent:
        raise NotAllowed("moves.no-watchdog-drive-active", drive=axis.drive.name)


async def _ramps(axis: Axis, settings: MoveSettings) -> dict[str, int]:
    """Profile objects and raw values, checked before anything moves."""
    drive, units = axis.drive, await axis.units()
    shown = settings.envelope.shown
    values: dict[str, int] = {}
    if settings.speed_rpm is not None:
        if settings.speed_rpm > settings.envelope.speed_rpm:
            raise OutOfRange(
                "moves.above-envelope-lower-speed",
                drive=drive.name,
                value=shown.speed(settings.speed_rpm),
                limit=shown.say_speed(settings.envelope.speed_rpm),
                say_speed=shown.say_speed(settings.speed_rpm),
            )
        if settings.mode == "PP":
            values[drive.require("profile_velocity")] = units.velocity_raw(settings.speed_rpm)
    ramps = (settings.acceleration_rpm_s, settings.deceleration_rpm_s)
    if any(ramp is not None for ramp in ramps):
        keys = await ramp_keys(drive)
        if keys[0] == keys[1] and ramps[0] != ramps[1]:
            raise OutOfRange(
                "moves.drive-brakes-acceleration-no",
                drive=drive.name,
                parameter=keys[0],
                value=ramps[1],
            )
        for key, ramp in zip(keys, ramps, strict=True):
            if ramp is not None:
                values[key] = ramp_raw(units, drive, key, ramp)
    for key, raw in values.items():
        drive.check(drive.parameter(key), raw)
    return values


def _target(units: AxisUnits, settings: MoveSettings, start: int) -> int:
    return units.position_raw(settings.target) + (start if settings.relative else 0)


def _require_reachable(
    axis: Axis, units: AxisUnits, target: int, start: int, envelope: Envelope
) -> None:
    """Check, before enabling, that the target is inside the travel limit and the number range."""
    drive, shown = axis.drive, envelope.shown
    if abs(target - start) > units.position_raw(envelope.travel_rev):
        away = shown.say(units.position(target - start), "+.4g")
        raise OutOfRange(
            "moves.target-start-point-outside",
            drive=drive.name,
            value=shown.travel(units.position(target)),
            limit=limits.from_start(shown.say(envelope.travel_rev)),
            away=away,
            say=shown.say(envelope.travel_rev),
        )
    drive.check(drive.parameter(drive.require("position_target")), target)


async def _dwell(axis: Axis, dwell_s: float, watch: _Watch) -> None:
    """Wait, and check that the axis stays inside the envelope and in Operation enabled."""
    end = time.monotonic() + dwell_s
    while (left := end - time.monotonic()) > 0:
        await asyncio.sleep(min(left, 5 * threshold.POLL_S))
        await _still_inside(axis, watch)


async def _to(
    axis: Axis, target: int, watch: _Watch, progress: Progress | None, opens_s: float = 0.0
) -> None:
    """Carry out the setpoint handshake (CiA 402-2 clause 10.3.3), then wait for target reached.

    ``opens_s`` is how long the brake of an axis that was just enabled may still be opening.
    """
    drive, units = axis.drive, await axis.units()
    start, envelope = watch.start, watch.envelope
    _require_reachable(axis, units, target, start, envelope)
    # The enable command must not re-enable an axis that a person or a fault has disabled.
    await _still_inside(axis, watch)
    word = cia402.ENABLE_OPERATION | cia402.CHANGE_IMMEDIATELY
    await axis.control(word)
    key = drive.require("position_target")
    await drive.command(key, target, axis.grant(key))
    await _handed_over(axis, word, opens_s)
    own = drive.profile.quirk("own_status_word") is not None
    reached_bit = 1 << 15 if own else cia402.STATUS_TARGET_REACHED
    deadline = time.monotonic() + envelope.time_s
    await axis.control(word)
    while True:
        status = await _still_inside(axis, watch)
        position = await axis.position_raw()
        if progress and target != start:
            progress(min(1.0, abs((position - start) / (target - start))), text("moves.moving"))
        if status & reached_bit and abs(position - target) <= units.position_raw(0.02) + 2:
            return
        if time.monotonic() > deadline:
            raise LinkTimeout(
                "moves.not-reach-target-within",
                drive=drive.name,
                time_s=envelope.time_s,
                say=envelope.shown.say(units.position(position - target), "+.4g"),
            )
        await asyncio.sleep(threshold.POLL_S)


async def _handed_over(axis: Axis, word: int, opens_s: float) -> None:
    """Set the new-setpoint bit; repeat while the brake opens and there is no acknowledge.

    A drive ignores setpoints while its brake opens (000:1377, 002:8117): without the repetition the
    enabled axis would stay at standstill until the time of the move is over.
    """
    opened = time.monotonic() + opens_s
    while True:
        is_open = time.monotonic() >= opened
        await axis.control(word | cia402.NEW_SET_POINT)
        if await _acknowledged(axis) or is_open:
            return
        await axis.control(word)


async def _acknowledged(axis: Axis) -> bool:
    """Wait for the acknowledge of the setpoint (CiA 402: bit 12); whether it came.

    The families' manuals state different bits for it (004:3765: bit 13), so a missing acknowledge
    is not an error here; whether the axis reaches the target is checked afterwards.
    """
    deadline = time.monotonic() + threshold.ACKNOWLEDGE_S
    while not await axis.status_word() & cia402.STATUS_SET_POINT_ACKNOWLEDGE:
        if time.monotonic() > deadline:
            return False
        await asyncio.sleep(threshold.POLL_S / 2)
    return True


def _require_inside(axis: Axis, units: AxisUnits, settings: MoveSettings) -> tuple[str, int]:
    """Role and raw value of a velocity or torque target, after checking it against the envelope."""
    drive, envelope = axis.drive, settings.envelope
    velocity = settings.mode == "PV"
    limit = envelope.speed_rpm if velocity else envelope.torque_percent
    if abs(settings.target) > limit:
        shown = envelope.shown
        target, allowed = (
            shown.say_speed(each) if velocity else f"{each:g} %"
            for each in (settings.target, limit)
        )
        raise OutOfRange(
            "moves.above-envelope",
            drive=drive.name,
            value=shown.speed(settings.target) if velocity else settings.target,
            limit=allowed,
            target=target,
        )
    role = "velocity_target" if velocity else "torque_target"
    raw = (units.velocity_raw if velocity else units.torque_raw)(settings.target)
    drive.check(drive.parameter(drive.require(role)), raw)
    return role, raw


async def _hold(axis: Axis, settings: MoveSettings, start: int, progress: Progress) -> None:
    """Command velocity or torque for the envelope's time, inside its travel and speed."""
    drive, units, envelope = axis.drive, await axis.units(), settings.envelope
    role, raw = _require_inside(axis, units, settings)
    await drive.command(drive.require(role), raw, axis.grant())
    began, watch = time.monotonic(), _watch(axis, units, start, envelope)
    while (elapsed := time.monotonic() - began) < envelope.time_s:
        progress(elapsed / envelope.time_s, text("moves.running"))
        await _still_inside(axis, watch)
        await asyncio.sleep(threshold.POLL_S)
    await drive.relax(drive.require(role), 0)


async def _still_inside(axis: Axis, watch: _Watch) -> int:
    """Status word; raises when the axis left the envelope or Operation enabled."""
    drive, units, envelope = axis.drive, await axis.units(), watch.envelope
    asked_s = time.monotonic()
    keys = [drive.require(r) for r in ("status_word", "position_actual", "velocity_actual")]
    readings = await drive.read_many(keys)
    raws: list[int] = []
    for key in keys:
        raw = readings[key].raw
        if not isinstance(raw, int):
            raise LinkTimeout(
                "moves.not-read-during-motion",
                drive=drive.name,
                parameter=key,
                error=readings[key].problem,
            )
        raws.append(raw)
    status, position, velocity = raws
    if drive.decode_state(status) is not State.OPERATION_ENABLED:
        causes = joined(await axis.blocked_by() or [text("axis.cause-left-enabled")])
        raise NotAllowed("moves.stopped-during-move", drive=drive.name, causes=causes)
    moved, shown = abs(units.position(position - watch.start)), envelope.shown
    if moved > envelope.travel_rev * 1.02 + 0.05:
        raise NotAllowed(
            "moves.left-travel-limit-start",
            drive=drive.name,
            value=shown.travel(moved),
            limit=shown.say(envelope.travel_rev),
            say=shown.say(moved),
        )
    watch.guard.look(position, velocity, asked_s)
    return status
