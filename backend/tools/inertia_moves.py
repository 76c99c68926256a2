"""The moves from which inertia and friction are found, made by the speed loop of the axis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from backend.analysis.inertia import MoveLimits, design_moves
from backend.axis import Axis, Envelope
from backend.cyclic import CyclicSession
from backend.tools import profile_speed
from backend.tools.axis_facts import AxisFacts
from backend.tools.inertia_evaluation import CUTOFF_HZ, InertiaSettings
from backend.tools.probe import RoughFit, require_right_sign, rough_fit
from backend.tools.recording import Play, Recording, bus_limits, cycle_s, enabled, play, quiet
from drivers.cia402 import Mode
from drivers.errors import NotAllowed, OutOfRange

_TURN = 2 * np.pi
#: A ramp shorter than this excites the machine's resonances more than its inertia.
_RAMP_S = 0.15
_SMOOTHING_S = 0.03
_FIRST_REV = 0.12


@dataclass(frozen=True)
class Shape:
    """How gently the moves begin and end, and the filter that goes with it."""

    ramp_s: float = _RAMP_S
    smoothing_s: float = _SMOOTHING_S
    cutoff_hz: float = CUTOFF_HZ

    @staticmethod
    def against(swing_hz: float) -> Shape:
        """A mean over one whole swing does not excite it (a finite-impulse input shaper)."""
        period_s = 1.0 / swing_hz
        return Shape(
            max(_RAMP_S, 3.0 * period_s), max(_SMOOTHING_S, period_s),
            min(CUTOFF_HZ, 0.4 * swing_hz),
        )  # fmt: skip


async def speed_move(
    axis: Axis,
    session: CyclicSession,
    speed_rpm: npt.NDArray[np.float64],
    envelope: Envelope,
    facts: AxisFacts,
    progress: Callable[[float], None],
    until: Callable[[npt.NDArray[np.float64]], bool] | None = None,
) -> Recording:
    """Enable, play a speed profile, brake, disable."""
    units = await axis.units()
    values = np.round(speed_rpm * (units.velocity_raw(1e6) / 1e6)).astype(np.int64)
    async with (
        profile_speed.interpolated(axis, session, speed_rpm),
        enabled(axis, session, Mode.CSV) as start,
    ):
        await quiet(axis)
        limits = await bus_limits(axis, envelope, start)
        return await play(
            axis, session, Play(Mode.CSV, values), limits, facts.rated_torque_nm, progress,
            until=until,
        )  # fmt: skip


async def first_look(
    axis: Axis,
    session: CyclicSession,
    settings: InertiaSettings,
    facts: AxisFacts,
    home_raw: int,
    ends: tuple[float, float] | None,
) -> RoughFit:
    """A short move forth and back: does it move at all, and how heavy is it about?"""
    units, envelope, rate = await axis.units(), settings.envelope, 1.0 / cycle_s(session)
    travel = min(_FIRST_REV, 0.4 * envelope.travel_rev)
    forward = 1.0
    if ends is not None and units.position(home_raw) + travel > ends[1] - 0.02:
        forward = -1.0
    n = round(0.35 * rate)
    hump = 1.0 - np.cos(_TURN * (np.arange(n) + 0.5) / n)
    speed = forward * hump * travel / (n / rate) * 60.0
    speed *= min(1.0, 0.5 * envelope.speed_rpm / float(np.max(np.abs(speed))))
    whole = np.concatenate([speed, -speed, np.zeros(round(0.1 * rate))])
    try:
        recording = await speed_move(axis, session, whole, envelope, facts, lambda _fraction: None)
    except NotAllowed as error:
        if "torque" not in error.message:
            raise
        raise NotAllowed(
            f"{axis.drive.name}: a short move takes more torque than is permitted: {error.message}",
            drive=axis.drive.name,
            remedy="look for a closed brake, a blocked axis or gains that are far too high",
        ) from error
    moved = float(np.ptp(recording.position_rad)) / _TURN
    if moved < 0.2 * travel:
        peak = float(np.max(np.abs(recording.torque_nm))) / facts.rated_torque_nm
        raise NotAllowed(
            f"{axis.drive.name} moves only {moved:.3g} of {travel:.3g} rev, with up to {peak:.0%} "
            "of its rated torque",
            drive=axis.drive.name, value=round(moved, 4), limit=f"{travel:.3g} rev",
            remedy="look for a closed brake, a blocked axis, a torque limit that is too low or a "
            "speed loop that is far too soft",
        )  # fmt: skip
    require_right_sign(axis.drive.name, recording)
    fit = rough_fit(
        recording.torque_nm, recording.velocity_rad_s, recording.sample_rate_hz, recording.valid
    )
    floor = 0.5 * (facts.motor_inertia_kgm2 or 1e-7)
    return RoughFit(max(fit.inertia_kgm2, floor), max(fit.coulomb_nm, 0.0), fit.gravity_nm)


async def identification_moves(
    axis: Axis,
    session: CyclicSession,
    settings: InertiaSettings,
    facts: AxisFacts,
    rough: RoughFit,
    travel_rev: float,
    shape: Shape,
    told: Callable[[float], None],
) -> Recording:
    """The identification moves."""
    envelope, rate = settings.envelope, 1.0 / cycle_s(session)
    friction = rough.coulomb_nm + abs(rough.gravity_nm)
    torque = envelope.torque_percent / 100.0 * facts.rated_torque_nm
    speed = 0.8 * envelope.speed_rpm * _TURN / 60.0
    # As gentle as ramps of this length are, but well above friction.
    gentle = max(rough.inertia_kgm2 * speed / shape.ramp_s, 4.0 * rough.coulomb_nm)
    wanted = min(0.7 * torque, friction + gentle / 0.7)
    try:
        trajectory = design_moves(
            MoveLimits(0.8 * travel_rev * _TURN, speed, wanted), rough.inertia_kgm2, rate,
            friction_nm=friction, repetitions=settings.repetitions, smoothing_s=shape.smoothing_s,
            dwell_s=0.1,
        )  # fmt: skip
    except ValueError as error:
        raise OutOfRange(
            f"{axis.drive.name}: the envelope does not allow the moves: {error}",
            remedy="raise the envelope's torque",
        ) from error
    duration_s = trajectory.velocity_rad_s.size / rate
    if duration_s > envelope.time_s:
        raise OutOfRange(
            f"{axis.drive.name}: the moves would take {duration_s:.3g} s",
            value=duration_s, limit=f"{envelope.time_s:g} s",
            remedy="allow more time, speed or torque, or less travel",
        )  # fmt: skip
    tail = np.zeros(round(0.2 * rate))
    rpm = np.concatenate([trajectory.velocity_rad_s, tail]) * 60.0 / _TURN
    room = replace(envelope, travel_rev=min(envelope.travel_rev, travel_rev * 1.15))
    return await speed_move(axis, session, rpm, room, facts, told)
