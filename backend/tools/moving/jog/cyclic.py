"""Motion with one setpoint per cycle: jog, and the signal generator for CSP, CSV and CST.

A trajectory is computed beforehand and checked against the envelope; the cyclic loop plays it,
monitors the envelope in every cycle, and brakes by itself when the renewals stop.
"""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from backend.axes.axis import loop
from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.axis.cyclic_mode import keeping_mode
from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import address_of
from backend.axes.scales.units import AxisUnits
from backend.axes.scales.words import halt_remedy, halt_words
from backend.foundation.work.jobs import JobResult, Progress
from backend.tools.moving.jog.hold import Hold
from backend.tools.moving.jog.run import JogSettings, end_of, require_scale
from backend.tools.thresholds import jog_cyclic as threshold
from drivers import link as bus
from drivers.cia402 import Mode
from drivers.errors import LinkTimeout, NotAllowed, OutOfRange, motion_halted
from drivers.motion.setpoint_plan import Phase
from drivers.texts import limits
from drivers.texts.message import Text, text

Signal = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class GeneratorSettings:
    """A test signal around the present position (CSP), standstill (CSV) or zero torque (CST).

    ``amplitude`` in rev, rpm or % of rated. ``frequency_hz`` for sine; start and end of a chirp
    with ``frequency_end_hz``. Ramps and trapezoids use ``acceleration`` (rev/s², rpm/s, %/s).
    """

    mode: Literal["CSP", "CSV", "CST"]
    shape: Literal["step", "ramp", "trapezoid", "sine", "chirp"]
    amplitude: float
    duration_s: float
    envelope: Envelope
    frequency_hz: float = 1.0
    frequency_end_hz: float = 10.0
    acceleration: float = 10.0


def signal(settings: GeneratorSettings, cycle_s: float) -> Signal:
    """The test signal [n] in the unit of the amplitude; it begins and ends at zero.

    Raises:
        OutOfRange: the duration or a frequency is not possible at this cycle time.
    """
    if not 0 < settings.duration_s <= threshold.MAX_S:
        raise OutOfRange(
            "jog.duration-outside",
            value=settings.duration_s,
            limit=f"0…{threshold.MAX_S:g} s",
            max_s=threshold.MAX_S,
        )
    nyquist = 0.5 / cycle_s
    highest = settings.frequency_hz
    if settings.shape == "chirp":
        highest = max(highest, settings.frequency_end_hz)
    if settings.shape in ("sine", "chirp") and not 0 < highest < nyquist / 2:
        raise OutOfRange(
            "jog.hz-cannot-played-cycle",
            value=highest,
            limit=limits.below(nyquist / 2, "Hz"),
            cycle_ms=cycle_s * 1e3,
        )
    count = max(2, round(settings.duration_s / cycle_s))
    t: Signal = np.arange(count, dtype=np.float64) * np.float64(cycle_s)
    match settings.shape:
        case "step":
            wave = np.where((t > 0) & (t < settings.duration_s / 2), 1.0, 0.0)
            values = settings.amplitude * wave
        case "ramp" | "trapezoid":
            values = _trapezoid(settings, t)
        case "sine":
            values = settings.amplitude * np.sin(2 * math.pi * settings.frequency_hz * t)
            values *= _fade(t, settings.duration_s)
        case "chirp":
            values = settings.amplitude * np.sin(_chirp_phase(settings, t))
            values *= _fade(t, settings.duration_s)
    values[0] = values[-1] = 0.0
    return np.asarray(values)


def _trapezoid(settings: GeneratorSettings, t: Signal) -> Signal:
    """Up to the amplitude and back: a linear ramp, or a move with limited acceleration."""
    size, half = abs(settings.amplitude), settings.duration_s / 2
    sign = math.copysign(1.0, settings.amplitude)
    mirrored = np.where(t <= half, t, settings.duration_s - t)
    if settings.shape == "ramp":
        return sign * np.minimum(settings.acceleration * mirrored, size)
    # In CSP the fastest move of this size: accelerate, then brake. In CSV and CST a limited slope.
    if settings.mode != "CSP":
        return sign * np.minimum(settings.acceleration * mirrored, size)
    turn = math.sqrt(size / settings.acceleration)
    up = 0.5 * settings.acceleration * mirrored**2
    down = size - 0.5 * settings.acceleration * np.maximum(2 * turn - mirrored, 0.0) ** 2
    move = np.where(mirrored < turn, up, down)
    return sign * np.minimum(move, size)


def _fade(t: Signal, duration_s: float) -> Signal:
    """Raised-cosine fade over the first and last tenth."""
    edge = duration_s / 10
    inside = np.minimum(np.minimum(t, duration_s - t) / edge, 1.0)
    return np.asarray(0.5 - 0.5 * np.cos(math.pi * np.clip(inside, 0.0, 1.0)))


def _chirp_phase(settings: GeneratorSettings, t: Signal) -> Signal:
    """Phase [rad] of a logarithmic chirp (constant time per octave)."""
    ratio = settings.frequency_end_hz / settings.frequency_hz
    if ratio == 1.0:
        return 2 * math.pi * settings.frequency_hz * t
    rate = math.log(ratio) / settings.duration_s
    return np.asarray(2 * math.pi * settings.frequency_hz * np.expm1(rate * t) / rate)


async def generate(
    axis: Axis, session: CyclicSession, settings: GeneratorSettings, progress: Progress
) -> JobResult:
    """Play a test signal once.

    Raises:
        OutOfRange: the signal exceeds the envelope; nothing has moved.
        NotAllowed: the loop ended the motion; states the reason.
    """
    units, drive = await axis.require_certain_scales(), axis.drive
    cycle_s = _cycle(session)
    values = signal(settings, cycle_s)
    mode = Mode[settings.mode]
    _require_inside(drive, settings)
    async with (
        keeping_mode(axis, session),
        axis.enabled_cyclic(session, mode, threshold.STATE_TIMEOUT_S),
    ):
        start = await axis.position_raw()
        if settings.mode == "CSP":
            raw = start + np.round(values * units.position_raw(1.0)).astype(np.int64)
            role = "position_target"
        elif settings.mode == "CSV":
            raw = np.round(values * units.velocity_raw(1000.0) / 1000.0).astype(np.int64)
            role = "velocity_target"
        else:
            raw = np.round(values * units.torque_raw(100.0) / 100.0).astype(np.int64)
            role = "torque_target"
        target = address_of(drive.profile.by_role[role])
        trajectory = bus.Trajectory(
            session.station(drive), target, raw, await _limits(axis, settings.envelope, start)
        )
        await play_through(axis, session, trajectory, len(raw) * cycle_s, progress)
        end = await axis.position_raw()
    return {"cycles": len(raw), "moved_rev": units.position(end - start)}


def _require_inside(drive: Drive, settings: GeneratorSettings) -> None:
    envelope = settings.envelope
    shown = envelope.shown
    limits: dict[str, tuple[float, Callable[[float], str]]] = {
        "CSP": (envelope.travel_rev, shown.say),
        "CSV": (envelope.speed_rpm, shown.say_speed),
        "CST": (envelope.torque_percent, lambda percent: f"{percent:g} %"),
    }
    limit, say = limits[settings.mode]
    if abs(settings.amplitude) > limit:
        raise OutOfRange(
            "jog.amplitude-more-envelope-allows",
            drive=drive.name,
            value=say(settings.amplitude),
            limit=say(limit),
        )


async def jog_cyclic(
    axis: Axis, session: CyclicSession, settings: JogSettings, hold: Hold, progress: Progress
) -> JobResult:
    """Hold-to-run jog in CSP: a trapezoid up to the travel limit, ended early on release.

    Raises:
        NotAllowed: as `generate`.
        LinkTimeout: no standstill after the jog.
    """
    units, drive = await axis.require_certain_scales(), axis.drive
    cycle_s = _cycle(session)
    require_scale(axis, units, settings)
    progress(0.0, text("jog.enabling"))
    enabled = axis.enabled_cyclic(session, Mode.CSP, threshold.STATE_TIMEOUT_S)
    async with keeping_mode(axis, session), enabled:
        start = await axis.position_raw()
        envelope = Envelope(
            settings.travel_rev, settings.speed_rpm, settings.torque_percent, threshold.MAX_S
        )
        station = session.station(drive)
        target = address_of(drive.profile.by_role["position_target"])
        limits = await _limits(axis, envelope, start)
        # Enabling may take longer than the button is held: if it was released meanwhile, nothing
        # moves.
        if reason := await _alive(axis, session, hold):
            return end_of(reason, 0.0)
        progress(0.0, text("jog.moving"))
        begin = start
        while True:
            left_rev = settings.travel_rev - abs(units.position(begin - start))
            if left_rev > 0.0:
                raw = _run_up_from(begin, left_rev, settings, units, cycle_s)
                trajectory = bus.Trajectory(station, target, raw, limits)
                await loop.play(session, drive, trajectory, axis.grant())
            reason = await _while_held(axis, session, hold)
            if reason:
                break
            await session.cyclic.pause(station)
            if reason := await _alive(axis, session, hold):
                break
            # Continue from the present setpoint, which the actual position is close to.
            begin = await drive.raw(drive.require("position_target"))
        await session.cyclic.halt(station)
        if not await axis.standstill(2.0):
            raise LinkTimeout("jog.still-moves-after-jog", drive=drive.name)
        moved = units.position(await axis.position_raw() - start)
    return end_of(reason, moved)


def _run_up_from(
    begin: int, travel_rev: float, settings: JogSettings, units: AxisUnits, cycle_s: float
) -> npt.NDArray[np.int64]:
    """Setpoint positions (raw) of a jog over ``travel_rev`` from the setpoint ``begin``."""
    speed, slope = settings.speed_rpm / 60.0, settings.acceleration_rpm_s / 60.0
    travel = settings.direction * run_up(travel_rev, speed, slope, cycle_s)
    return begin + np.round(travel * units.position_raw(1.0)).astype(np.int64)


def run_up(travel: float, speed: float, slope: float, cycle_s: float) -> Signal:
    """Positions of a trapezoid over ``travel`` with ``speed`` and ``slope``, one per cycle."""
    ramp = min(speed / slope, math.sqrt(travel / slope))
    peak = slope * ramp
    cruise = max(0.0, (travel - peak * ramp) / peak)
    total = 2 * ramp + cruise
    t = np.arange(min(math.ceil(total / cycle_s) + 1, round(threshold.MAX_S / cycle_s))) * cycle_s
    rising = 0.5 * slope * t**2
    level = 0.5 * peak * ramp + peak * (t - ramp)
    falling = travel - 0.5 * slope * np.maximum(total - t, 0.0) ** 2
    return np.asarray(np.where(t < ramp, rising, np.where(t < ramp + cruise, level, falling)))


async def _while_held(axis: Axis, session: CyclicSession, hold: Hold) -> Text | None:
    """Renew until the hold ends, returning the reason, or until a gap begins, returning None."""
    station = session.station(axis.drive)
    while not (reason := hold.ended()) and not hold.braking():
        await session.cyclic.renew(station)
        _raise_if_ended(axis, session)
        await asyncio.sleep(threshold.RENEW_S)
    return reason


async def _alive(axis: Axis, session: CyclicSession, hold: Hold) -> Text | None:
    """Wait for the end of a gap and for standstill; the reason if the hold ends meanwhile."""
    station = session.station(axis.drive)
    while not (reason := hold.ended()) and (hold.braking() or _brakes(session, station)):
        _raise_if_ended(axis, session)
        await asyncio.sleep(threshold.LOOK_S)
    _raise_if_ended(axis, session)
    return reason


def _cycle(session: CyclicSession) -> float:
    if session.state is None:
        raise NotAllowed("jog.cyclic-exchange-not-run", url=session.link.url)
    return session.state.cycle_s


async def _limits(axis: Axis, envelope: Envelope, start: int) -> bus.Envelope:
    units = await axis.units()
    travel = units.position_raw(envelope.travel_rev)
    return bus.Envelope(
        position_min=start - travel,
        position_max=start + travel,
        speed_max=units.velocity_raw(envelope.speed_rpm * 1.2 + 20.0),
        torque_max=units.torque_raw(envelope.torque_percent),
        feedback=units.feedback,
    )


async def play_through(
    axis: Axis,
    session: CyclicSession,
    trajectory: bus.Trajectory,
    duration_s: float,
    progress: Progress,
) -> None:
    """Play until the last value is sent, which takes longer where this computer misses cycles.

    Raises:
        NotAllowed: the loop ended it.
        LinkTimeout: it takes many times as long as it should.
    """
    station = trajectory.station
    await loop.play(session, axis.drive, trajectory, axis.grant())
    began = time.monotonic()
    while (elapsed := time.monotonic() - began) < duration_s or _plays(session, station):
        if elapsed > threshold.PATIENCE * duration_s + threshold.STATE_TIMEOUT_S:
            raise LinkTimeout(
                "jog.station-signal-not-end",
                station=station,
                duration_s=duration_s,
                elapsed_s=elapsed,
            )
        await session.cyclic.renew(station)
        _raise_if_ended(axis, session)
        progress(min(elapsed / duration_s, 1.0), text("jog.playing"))
        left_s = duration_s - elapsed
        await asyncio.sleep(min(threshold.RENEW_S, left_s) if left_s > 0 else threshold.RENEW_S)
    _raise_if_ended(axis, session)


def _plays(session: CyclicSession, station: int) -> bool:
    """Whether values are still to be sent; False where the loop shows no state."""
    return _phase(session, station) is Phase.PLAYING


def _brakes(session: CyclicSession, station: int) -> bool:
    """Whether the loop is still ramping down; False where it shows no state."""
    return _phase(session, station) is Phase.BRAKING


def _phase(session: CyclicSession, station: int) -> Phase | None:
    power = session.power()
    return None if power is None else Phase(power.axis_state(station).phase)


def _raise_if_ended(axis: Axis, session: CyclicSession) -> None:
    station = session.station(axis.drive)
    power = session.power()
    halt = None if power is None else power.axis_state(station).halted
    if halt is not None:
        raise motion_halted(
            axis.drive.name,
            halt,
            words=halt_words(halt, axis.known_units),
            drive=axis.drive.name,
            remedy=halt_remedy(halt, text("jog.see-alarms-check-envelope")),
        )
