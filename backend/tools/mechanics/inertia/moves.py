"""Moves for the identification of inertia and friction, made under the speed loop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from backend.analysis.mechanics.slow_moves.identification_path import MoveLimits, design_moves
from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.recording import (
    Play,
    Recording,
    bus_limits,
    cycle_s,
    enabled,
    play,
    quiet,
)
from backend.tools.measuring.temporary import stopping_hard
from backend.tools.mechanics.inertia.evaluation import InertiaSettings
from backend.tools.mechanics.inertia.probe import RoughFit, require_right_sign, rough_fit, smoothed
from backend.tools.mechanics.inertia.soft_loop import SoftLoop, soft_loop_of
from backend.tools.moving.moves.go_back import go_back
from backend.tools.thresholds import inertia_moves as threshold
from backend.tools.tuning.sweep import profile_speed
from drivers.cia402 import Mode
from drivers.errors import EnvelopeExceeded, NotAllowed, OutOfRange, exceeded
from drivers.halt import HaltCause
from drivers.texts.message import reason_of

_TURN = 2 * np.pi
_SHARES = (1.0, 0.8, threshold.WEAKER, 0.45, threshold.WEAKER**2)
BRAKE_WAIT_S = threshold.BRAKE_WAIT_S


@dataclass(frozen=True)
class Shape:
    """Duration of the ramps and of the smoothing of the moves."""

    ramp_s: float = threshold.RAMP_S
    smoothing_s: float = threshold.SMOOTHING_S

    @staticmethod
    def against(swing_hz: float) -> Shape:
        """Shape with a mean over one period of the oscillation, which does not excite it."""
        period_s = 1.0 / swing_hz
        return Shape(max(threshold.RAMP_S, 3.0 * period_s), max(threshold.SMOOTHING_S, period_s))


@dataclass(frozen=True)
class FirstLook:
    """Rough mechanics of the axis, and the share of a short move that its speed loop followed.

    ``loop``: the gains of the loop, where they explain the torque of that move.
    """

    rough: RoughFit
    followed: float
    loop: SoftLoop | None = None


async def speed_move(
    axis: Axis,
    session: CyclicSession,
    speed_rpm: npt.NDArray[np.float64],
    envelope: Envelope,
    facts: AxisFacts,
    progress: Callable[[float], None],
    until: Callable[[npt.NDArray[np.float64]], bool] | None = None,
    torque_nm: npt.NDArray[np.float64] | None = None,
    also: Sequence[str] = (),
) -> Recording:
    """Enable, play a speed profile, brake, disable; ``torque_nm`` [n] is added as torque offset.

    ``also`` are the keys of further signals to record.
    """
    units = await axis.units()
    values = np.round(speed_rpm * (units.velocity_raw(1e6) / 1e6)).astype(np.int64)
    sent = Play(Mode.CSV, values)
    if torque_nm is not None:
        per_nm = 100.0 / (units.torque(1.0) * facts.rated_torque_nm)
        offsets = np.round(torque_nm * per_nm).astype(np.int64)
        sent = replace(sent, offset_role="torque_offset", offsets=offsets)
    async with (
        stopping_hard(axis, envelope.speed_rpm),
        profile_speed.interpolated(axis, session, speed_rpm),
        enabled(axis, session, Mode.CSV) as start,
    ):
        await quiet(axis)
        limits = await bus_limits(axis, envelope, start)
        return await play(
            axis, session, sent, limits, facts.rated_torque_nm, progress, until=until,
            also=also,
        )  # fmt: skip


async def first_look(
    axis: Axis,
    session: CyclicSession,
    settings: InertiaSettings,
    facts: AxisFacts,
    home_raw: int,
    ends: tuple[float, float] | None,
) -> FirstLook:
    """Make a short reciprocating move: checks that the axis moves, and estimates its inertia.

    Raises:
        NotAllowed: it hardly moves, it moves the wrong way, or it takes too much torque.
    """
    units, envelope, rate = await axis.units(), settings.envelope, 1.0 / cycle_s(session)
    aim = min(threshold.FIRST_REV, 0.4 * envelope.travel_rev)
    forward = 1.0
    if ends is not None and units.position(home_raw) + aim > ends[1] - 0.02:
        forward = -1.0
    n = round(0.35 * rate)
    hump = 1.0 - np.cos(_TURN * (np.arange(n) + 0.5) / n)
    speed = forward * hump * aim / (n / rate) * 60.0
    highest_rpm = 0.5 * envelope.speed_rpm
    speed *= min(1.0, highest_rpm / float(np.max(np.abs(speed))))
    while True:
        whole = np.concatenate([speed, -speed, np.zeros(round(0.1 * rate))])
        recording = await _first_move(axis, session, envelope, facts, whole)
        moved = float(np.ptp(recording.position_rad)) / _TURN
        peak = float(np.max(np.abs(recording.torque_nm))) / facts.rated_torque_nm
        if moved >= threshold.FOLLOWED * aim:
            break
        # Should the loop follow fully next time, twice the travel and torque must still be
        # permitted.
        way_rev = 2.0 * float(np.sum(np.abs(speed))) / rate / 60.0
        cramped = (
            way_rev > 0.8 * envelope.travel_rev or 2.0 * float(np.max(np.abs(speed))) > highest_rpm
        )
        if cramped or 2.0 * peak > 0.8 * envelope.torque_percent / 100.0:
            raise NotAllowed(
                "inertia.moves-too-little-cramped" if cramped else "inertia.moves-too-little",
                drive=axis.drive.name,
                value=round(moved, 4),
                limit=f"{aim:.3g} rev",
                moved_rev=moved,
                aim_rev=aim,
                peak_share=peak,
            )
        speed = 2.0 * speed
    require_right_sign(axis.drive.name, recording)
    valid = recording.valid
    wanted, velocity, torque = (
        smoothed(signal, valid, rate)
        for signal in (whole * _TURN / 60.0, recording.velocity_rad_s, recording.torque_nm)
    )
    fit = rough_fit(torque, velocity, rate, valid)
    floor = 0.5 * (facts.motor_inertia_kgm2 or 1e-7)
    rough = RoughFit(max(fit.inertia_kgm2, floor), max(fit.coulomb_nm, 0.0), fit.gravity_nm)
    loop = soft_loop_of(wanted, velocity, torque, valid, rate)
    return FirstLook(rough, moved / (float(np.sum(np.abs(speed))) / rate / 60.0), loop)


async def _first_move(
    axis: Axis,
    session: CyclicSession,
    envelope: Envelope,
    facts: AxisFacts,
    speed_rpm: npt.NDArray[np.float64],
) -> Recording:
    """Make the move; repeat it after a wait where the axis did not move at its beginning.

    A holding brake that opens some 100 ms after Operation enabled blocks the axis until then, and
    no status bit shows it.
    """
    start = await axis.position_raw()

    async def moving() -> tuple[Recording, bool]:
        recording = await speed_move(
            axis, session, speed_rpm, envelope, facts, lambda _fraction: None
        )
        return recording, _stood(recording, speed_rpm)

    try:
        recording, stood = await moving()
    except EnvelopeExceeded as error:
        moved = abs((await axis.units()).position(await axis.position_raw() - start))
        waited = axis.brake_wait_s or moved > threshold.STOOD_REV
        if error.halt.cause is not HaltCause.TORQUE:
            raise
        if waited:
            raise _too_heavy(axis, error) from error
    else:
        if not stood or axis.brake_wait_s:
            return recording
    axis.brake_wait_s = BRAKE_WAIT_S
    try:
        await quiet(axis)
        recording, stood = await moving()
    except EnvelopeExceeded as error:
        axis.brake_wait_s = 0.0
        if error.halt.cause is not HaltCause.TORQUE:
            raise
        raise _too_heavy(axis, error) from error
    if stood:
        # Another cause, such as friction, holds it: no later motion needs to wait.
        axis.brake_wait_s = 0.0
    return recording


def _stood(recording: Recording, speed_rpm: npt.NDArray[np.float64]) -> bool:
    """Whether the axis had not begun to move when a tenth of its travel was demanded.

    A loop that is too soft to follow may look the same: the repeated move after a wait then shows
    it again, and no later motion waits.
    """
    demanded = np.abs(np.cumsum(speed_rpm)) / 60.0 / recording.sample_rate_hz
    begun = int(np.argmax(demanded >= threshold.BEGUN * np.max(demanded)))
    position = recording.position_rad / _TURN
    return bool(abs(position[begun] - position[0]) < threshold.STOOD_SHARE * demanded[begun])


def _too_heavy(axis: Axis, error: EnvelopeExceeded) -> EnvelopeExceeded:
    return EnvelopeExceeded(
        "inertia.short-move-takes-more", halt=error.halt, drive=axis.drive.name, cause=error.text
    )


async def identification_moves(
    axis: Axis,
    session: CyclicSession,
    settings: InertiaSettings,
    facts: AxisFacts,
    look: FirstLook,
    travel_rev: float,
    shape: Shape,
    reported: Callable[[float], None],
) -> Recording:
    """Make the identification moves; weaker ones where the loop takes too much torque.

    The torque of a soft loop is predicted from the first look, so that this is rarely needed.
    """
    envelope = settings.envelope
    room = replace(envelope, travel_rev=min(envelope.travel_rev, travel_rev * 1.15))
    start = await axis.position_raw()
    can = _takes_torque_ahead(axis, session)

    def planned(share: float) -> _Moves:
        return _moves(axis, session, settings, facts, look.rough, travel_rev, shape, share)

    permitted_nm = envelope.torque_percent / 100.0 * facts.rated_torque_nm
    share, ahead = _bearable(planned, look, permitted_nm, can)
    for attempt in range(threshold.ATTEMPTS):
        moves = planned(share * threshold.WEAKER**attempt)
        try:
            return await speed_move(
                axis,
                session,
                moves.speed_rad_s * 60.0 / _TURN,
                room,
                facts,
                reported,
                torque_nm=moves.torque_nm if ahead else None,
            )
        except NotAllowed as error:
            last = attempt == threshold.ATTEMPTS - 1
            if last or exceeded(error) is not HaltCause.TORQUE:
                raise
        await quiet(axis)
        await go_back(axis, session, start, room, facts)
    raise AssertionError


def _bearable(
    planned: Callable[[float], _Moves], look: FirstLook, permitted_nm: float, can: bool
) -> tuple[float, bool]:
    """Strength of the moves that this loop permits, and whether to add a torque offset."""
    ahead = can and look.followed < threshold.FOLLOWS_WELL
    if look.loop is None:
        return 1.0, ahead
    pull_nm = abs(look.rough.gravity_nm)
    for share in _SHARES:
        moves = planned(share)
        for sends in (ahead, can):
            sent_nm = (1.0 - threshold.ROUGHLY) * moves.torque_nm * sends
            expected_nm = look.loop.peak_nm(
                moves.torque_nm, sent_nm, look.rough.inertia_kgm2, moves.rate_hz
            )
            if pull_nm + expected_nm <= threshold.EXPECTED * permitted_nm:
                return share, sends
    return _SHARES[-1], can


def _takes_torque_ahead(axis: Axis, session: CyclicSession) -> bool:
    key = axis.drive.key("torque_offset")
    return key is not None and session.carries(axis.drive, key)


@dataclass(frozen=True)
class _Moves:
    """Setpoints, and the torque [n] that a rigid axis needs for them, without static torque."""

    speed_rad_s: npt.NDArray[np.float64]
    torque_nm: npt.NDArray[np.float64]
    rate_hz: float


def _moves(
    axis: Axis,
    session: CyclicSession,
    settings: InertiaSettings,
    facts: AxisFacts,
    rough: RoughFit,
    travel_rev: float,
    shape: Shape,
    share: float,
) -> _Moves:
    """Plan the moves with this share of the torque that is available for acceleration.

    Raises:
        OutOfRange: the envelope does not allow them.
    """
    envelope, rate = settings.envelope, 1.0 / cycle_s(session)
    friction = rough.coulomb_nm + abs(rough.gravity_nm)
    torque = envelope.torque_percent / 100.0 * facts.rated_torque_nm
    speed = 0.8 * envelope.speed_rpm * _TURN / 60.0
    # As gentle as ramps of this length allow, but well above friction.
    gentle = max(rough.inertia_kgm2 * speed / shape.ramp_s, 4.0 * rough.coulomb_nm)
    wanted = friction + share * (min(0.7 * torque, friction + gentle / 0.7) - friction)
    try:
        trajectory = design_moves(
            MoveLimits(0.8 * travel_rev * _TURN, speed, wanted),
            rough.inertia_kgm2,
            rate,
            friction_nm=friction,
            repetitions=settings.repetitions,
            smoothing_s=shape.smoothing_s,
            dwell_s=0.1,
        )
    except ValueError as error:
        raise OutOfRange(
            "inertia.envelope-not-allow-moves", axis_drive=axis.drive.name, cause=reason_of(error)
        ) from error
    duration_s = trajectory.velocity_rad_s.size / rate
    if duration_s > envelope.time_s:
        raise OutOfRange(
            "inertia.moves-take",
            value=duration_s,
            limit=f"{envelope.time_s:g} s",
            axis_drive=axis.drive.name,
        )
    tail = np.zeros(round(0.2 * rate))
    played = np.concatenate([trajectory.velocity_rad_s, tail])
    needed = rough.inertia_kgm2 * np.concatenate([trajectory.acceleration_rad_s2, tail])
    needed += rough.coulomb_nm * np.tanh(played / threshold.FRICTION_RAD_S)
    return _Moves(played, needed, rate)
