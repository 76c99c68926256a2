"""Inertia and friction from moves made by the host over cyclic process data.

The axis is moved forth and back by its speed loop (CSV, which even a badly tuned axis follows),
torque and speed are recorded with every cycle, and a regression finds J, friction and gravity.
Three schemes: *free*, *limited* with the ends found at limited torque, and *taught* ends.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from backend.analysis.inertia import (
    InertiaResult,
    Interval,
    MoveLimits,
    design_moves,
    estimate_inertia,
)
from backend.analysis.spectrum import power_density
from backend.axis import Axis, Envelope
from backend.cyclic import CyclicSession
from backend.jobs import Progress
from backend.tools.axis_facts import AxisFacts, read_facts
from backend.tools.go_back import go_back
from backend.tools.probe import RoughFit, require_right_sign, rough_fit
from backend.tools.recording import (
    Play,
    Recording,
    bus_limits,
    cycle_s,
    enabled,
    play,
    quiet,
    require_signals,
    share,
)
from backend.tools.temporary import temporary
from drivers.cia402 import Mode
from drivers.errors import NotAllowed, OutOfRange

Scheme = Literal["free", "limited", "taught"]
Keep = Callable[[str, dict[str, npt.NDArray[np.generic]], dict[str, object]], None]

_TURN = 2 * np.pi
#: A ramp shorter than this excites the machine's resonances more than its inertia.
_RAMP_S = 0.15
_SMOOTHING_S = 0.03
_CUTOFF_HZ = 25.0
_FIRST_REV = 0.12
#: So long at rest is an end; the axis' own start is not judged.
_STALL_S, _START_S = 0.12, 0.25
_END_MARGIN_REV = 0.15
#: Above this R² nothing is left to explain; below, the load may swing in this range of Hz.
_EXPLAINED, _SWING_HZ = 0.9995, (4.0, 80.0)


@dataclass(frozen=True, slots=True)
class InertiaSettings:
    """Scheme and limits.

    ``envelope`` bounds every move; its travel counts from the start (free), or is the longest
    way that the search for an end may go (limited). ``ends_rev`` are taught ends in the axis'
    own position. ``search_torque_percent`` and ``search_speed_rpm`` are for the search.
    """

    envelope: Envelope
    scheme: Scheme = "free"
    ends_rev: tuple[float, float] | None = None
    search_torque_percent: float = 20.0
    search_speed_rpm: float = 30.0
    repetitions: int = 4
    rated_torque_nm: float | None = None
    motor_inertia_kgm2: float | None = None


@dataclass(frozen=True)
class _Shape:
    """How gently the moves begin and end, and the filter that goes with it."""

    ramp_s: float = _RAMP_S
    smoothing_s: float = _SMOOTHING_S
    cutoff_hz: float = _CUTOFF_HZ

    @staticmethod
    def against(swing_hz: float) -> _Shape:
        """A mean over one whole swing does not excite it (a finite-impulse input shaper)."""
        period_s = 1.0 / swing_hz
        return _Shape(
            max(_RAMP_S, 3.0 * period_s), max(_SMOOTHING_S, period_s),
            min(_CUTOFF_HZ, 0.4 * swing_hz),
        )  # fmt: skip


@dataclass(frozen=True)
class InertiaOutcome:
    """The regression's answer, how it was made, and where the ends are, if any (rev)."""

    result: InertiaResult
    method: str
    torque_known: bool
    ends_rev: tuple[float, float] | None
    motion_s: float
    ratio_against: str
    """What the load ratio compares with, in words; empty where there is no ratio."""


async def inertia(
    axis: Axis,
    session: CyclicSession,
    settings: InertiaSettings,
    progress: Progress,
    keep: Keep | None = None,
) -> InertiaOutcome:
    """Measure; the axis ends where it began, with its settings as they were.

    Raises:
        OutOfRange: settings that make no sense; nothing has moved.
        NotAllowed: the envelope, an end or a fault ended it, or it cannot move; says why.
    """
    _check(settings)
    require_signals(axis, session, Mode.CSV, False)
    facts = await read_facts(axis, settings.rated_torque_nm, settings.motor_inertia_kgm2)
    units = await axis.units()
    home = await axis.position_raw()
    ends = settings.ends_rev if settings.scheme == "taught" else None
    if ends is not None and not ends[0] < units.position(home) < ends[1]:
        raise OutOfRange(
            f"{axis.drive.name} stands at {units.position(home):.4g} rev, outside the taught ends",
            value=units.position(home), limit=f"{ends[0]:g}…{ends[1]:g} rev",
            remedy="jog it between the ends, or teach them again",
        )  # fmt: skip
    progress(0.0, "a first short move")
    rough = await _first_look(axis, session, settings, facts, home, ends)
    if settings.scheme == "limited":
        ends = await _find_ends(axis, session, settings, facts, rough, home, progress)
    travel, start = _where(settings, ends, units.position(home))
    if abs(start - units.position(home)) > 0.01:
        await go_back(axis, session, units.position_raw(start), _wide(settings, ends), facts)
    told = share(progress, 0.35, 0.65, "moving forth and back")
    shape = _Shape()
    recording = await _moves(axis, session, settings, facts, rough, travel, shape, told)
    progress(0.65, "evaluating")
    result = await asyncio.to_thread(evaluate, recording, settings, facts, shape.cutoff_hz)
    swing_hz = await asyncio.to_thread(oscillation_hz, recording, result)
    if swing_hz is not None:
        # A load that swings behind its coupling is moved again so that it does not.
        gentle = _Shape.against(swing_hz)
        told = share(
            progress, 0.66, 0.9, f"once more, gently: the load swings at {swing_hz:.0f} Hz"
        )
        better = RoughFit(
            max(result.inertia_kgm2.value, rough.inertia_kgm2), rough.coulomb_nm, rough.gravity_nm
        )
        again = await _moves(axis, session, settings, facts, better, travel, gentle, told)
        # Too short a travel leaves too little of a gentle move: the first answer stays.
        with contextlib.suppress(NotAllowed):
            calm = await asyncio.to_thread(evaluate, again, settings, facts, gentle.cutoff_hz)
            if calm.r2 > result.r2:
                recording, result, shape = again, calm, gentle
    await go_back(axis, session, home, _wide(settings, ends), facts)
    if keep is not None:
        keep("inertia", *_raw(recording, settings, facts, shape))
    return InertiaOutcome(
        result, f"host, {settings.scheme}", facts.torque_known, ends,
        recording.velocity_rad_s.size / recording.sample_rate_hz, _ratio_against(facts, settings),
    )  # fmt: skip


def _check(settings: InertiaSettings) -> None:
    if settings.scheme == "taught" and settings.ends_rev is None:
        raise OutOfRange("the taught scheme needs both ends", remedy="jog to each end and take it")
    if not 1 <= settings.repetitions <= 10:
        raise OutOfRange("1 to 10 repetitions are possible", value=settings.repetitions,
                         limit="1…10")  # fmt: skip


def _reference_inertia(facts: AxisFacts) -> float | None:
    """The motor's inertia, or in its place what the drive holds as inertia."""
    return facts.motor_inertia_kgm2 or facts.drive_inertia_kgm2


def _ratio_against(facts: AxisFacts, settings: InertiaSettings) -> str:
    if settings.motor_inertia_kgm2:
        return "the motor inertia given"
    if facts.motor_inertia_kgm2:
        return "the motor inertia that the drive tells"
    if facts.drive_inertia_kgm2:
        return "the inertia stored in the drive, which is the motor's until it is changed"
    return ""


def _where(
    settings: InertiaSettings, ends: tuple[float, float] | None, home_rev: float
) -> tuple[float, float]:
    """Travel of the moves and where they begin, in rev."""
    if ends is None:
        return settings.envelope.travel_rev, home_rev
    margin = min(_END_MARGIN_REV, 0.15 * (ends[1] - ends[0]))
    travel = min(ends[1] - ends[0] - 2 * margin, settings.envelope.travel_rev)
    return travel, ends[0] + margin


def _wide(settings: InertiaSettings, ends: tuple[float, float] | None) -> Envelope:
    """For positioning between the ends: the whole span is known to be free."""
    if ends is None:
        return settings.envelope
    return replace(settings.envelope, travel_rev=ends[1] - ends[0])


async def _csv(
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
    async with enabled(axis, session, Mode.CSV) as start:
        await quiet(axis)
        limits = await bus_limits(axis, envelope, start)
        return await play(
            axis, session, Play(Mode.CSV, values), limits, facts.rated_torque_nm, progress,
            until=until,
        )  # fmt: skip


async def _first_look(
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
        recording = await _csv(axis, session, whole, envelope, facts, lambda _fraction: None)
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
            remedy="look for a closed brake, a blocked axis or a torque limit that is too low",
        )  # fmt: skip
    require_right_sign(axis.drive.name, recording)
    fit = rough_fit(
        recording.torque_nm, recording.velocity_rad_s, recording.sample_rate_hz, recording.valid
    )
    floor = 0.5 * (facts.motor_inertia_kgm2 or 1e-7)
    return RoughFit(max(fit.inertia_kgm2, floor), max(fit.coulomb_nm, 0.0), fit.gravity_nm)


async def _find_ends(
    axis: Axis,
    session: CyclicSession,
    settings: InertiaSettings,
    facts: AxisFacts,
    rough: RoughFit,
    home_raw: int,
    progress: Progress,
) -> tuple[float, float]:
    """Creep both ways at limited torque until the axis stalls; positions of the ends in rev."""
    drive, units = axis.drive, await axis.units()
    available = settings.search_torque_percent / 100.0 * facts.rated_torque_nm
    needed = 1.5 * (rough.coulomb_nm + abs(rough.gravity_nm))
    if available < needed:
        percent = 100.0 * needed / facts.rated_torque_nm
        raise OutOfRange(
            f"{drive.name}: {settings.search_torque_percent:g} % of torque cannot move this axis "
            "safely against its friction and load",
            value=settings.search_torque_percent, limit=f"at least {percent:.3g} %",
            remedy="raise the torque of the search, or teach the ends by jog",
        )  # fmt: skip
    limits: dict[str, int] = {}
    for role in ("torque_limit_positive", "torque_limit_negative", "max_torque"):
        if (key := drive.key(role)) is not None:
            wanted = units.torque_raw(settings.search_torque_percent)
            limits[key] = min(wanted, await drive.raw(key))
    if not limits:
        raise NotAllowed(
            f"{drive.name}: this family has no torque limit that could protect the ends",
            drive=drive.name, remedy="teach the ends by jog",
        )  # fmt: skip
    found = []
    async with temporary(axis, limits):
        for number, direction in enumerate((-1.0, 1.0)):
            progress(0.1 + 0.15 * number, "looking for an end at limited torque")
            found.append(await _creep(axis, session, settings, facts, direction))
    del home_raw
    return found[0], found[1]


@dataclass
class _Stall:
    """Sees in the samples as they come when a creeping axis has come to rest."""

    slow: float
    enough: int
    start: int
    count: int = 0
    resting: int = 0
    found: bool = False

    def seen(self, rows: npt.NDArray[np.float64]) -> bool:
        """Whether it rests; ``rows`` [n, 3] are raw position, velocity and torque."""
        moving = np.flatnonzero(np.abs(rows[:, 1]) >= self.slow)
        self.resting = self.resting + len(rows) if not moving.size else len(rows) - moving[-1] - 1
        self.count += len(rows)
        self.found = self.count > self.start + self.enough and self.resting >= self.enough
        return self.found


async def _creep(
    axis: Axis, session: CyclicSession, settings: InertiaSettings, facts: AxisFacts,
    direction: float,
) -> float:  # fmt: skip
    """Position of one end in rev."""
    units, rate = await axis.units(), 1.0 / cycle_s(session)
    way = settings.envelope.travel_rev
    speed = min(settings.search_speed_rpm, settings.envelope.speed_rpm)
    n = round(way / (speed / 60.0) * rate)
    ramp = np.minimum(np.arange(n) / (0.1 * rate), 1.0)
    ramp[-1] = 0.0
    slow = 0.25 * units.velocity_raw(speed)
    stall = _Stall(slow, round(_STALL_S * rate), round(_START_S * rate))

    envelope = replace(settings.envelope, travel_rev=way * 1.1)
    recording = await _csv(
        axis, session, direction * speed * ramp, envelope, facts, lambda _fraction: None,
        stall.seen,
    )  # fmt: skip
    end = units.position(await axis.position_raw())
    if not stall.found:
        raise NotAllowed(
            f"{axis.drive.name} found no end within {way:g} rev",
            drive=axis.drive.name, value=float(np.ptp(recording.position_rad)) / _TURN,
            limit=f"{way:g} rev",
            remedy="use the free scheme if it turns without ends, or allow a longer search",
        )  # fmt: skip
    return end


async def _moves(
    axis: Axis,
    session: CyclicSession,
    settings: InertiaSettings,
    facts: AxisFacts,
    rough: RoughFit,
    travel_rev: float,
    shape: _Shape,
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
    return await _csv(axis, session, rpm, room, facts, told)


def oscillation_hz(recording: Recording, result: InertiaResult) -> float | None:
    """Where the torque swings beside what inertia and friction explain; None where it hardly does.

    Under its speed loop the motor follows and the load swings behind the coupling, at the
    mechanics' antiresonance.
    """
    if not np.isfinite(result.inertia_kgm2.value) or result.r2 > _EXPLAINED:
        return None
    rate, velocity = recording.sample_rate_hz, recording.velocity_rad_s
    rest = recording.torque_nm - result.inertia_kgm2.value * np.gradient(velocity) * rate
    rest = rest - result.viscous_nms.value * velocity - result.gravity_nm.value
    rest = rest - result.coulomb_nm.value * np.sign(velocity)
    density = power_density(rest, rate, round(2.0 * rate))
    band = (density.frequency_hz >= _SWING_HZ[0]) & (density.frequency_hz <= _SWING_HZ[1])
    levels = density.value[band]
    peak = int(np.argmax(levels))
    if levels[peak] < 8.0 * float(np.median(levels)):
        return None
    return float(density.frequency_hz[band][peak])


def evaluate(
    recording: Recording, settings: InertiaSettings, facts: AxisFacts,
    cutoff_hz: float = _CUTOFF_HZ,
) -> InertiaResult:  # fmt: skip
    """The regression; also works on a recording that was kept."""
    try:
        found = estimate_inertia(
            recording.torque_nm,
            recording.velocity_rad_s,
            recording.sample_rate_hz,
            cutoff_hz=cutoff_hz,
            torque_limit_nm=settings.envelope.torque_percent / 100.0 * facts.rated_torque_nm,
            motor_inertia_kgm2=facts.motor_inertia_kgm2,
            valid=recording.valid,
        )
    except ValueError as error:
        raise NotAllowed(
            f"the moves are too short to be evaluated: {error}",
            limit=f"{settings.envelope.travel_rev:g} rev",
            remedy="allow more travel or time",
        ) from error
    reference = _reference_inertia(facts)
    if found.load_ratio is None and reference and np.isfinite(found.inertia_kgm2.value):
        return replace(found, load_ratio=found.inertia_kgm2.value / reference - 1.0)
    return found


def _raw(
    recording: Recording, settings: InertiaSettings, facts: AxisFacts, shape: _Shape
) -> tuple[dict[str, npt.NDArray[np.generic]], dict[str, object]]:
    return recording.arrays(), {
        "tool": "inertia",
        "cutoff_hz": shape.cutoff_hz,
        "sample_rate_hz": recording.sample_rate_hz,
        "facts": asdict(facts),
        "settings": asdict(settings),
    }


def reevaluate(
    arrays: dict[str, npt.NDArray[np.generic]], meta: dict[str, object]
) -> InertiaOutcome:
    """The answer again, from kept raw data.

    Raises:
        ValueError: not the raw data of an inertia measurement.
    """
    given, told = meta.get("settings"), meta.get("facts")
    if not isinstance(given, dict) or not isinstance(told, dict) or "torque_nm" not in arrays:
        raise ValueError("not the raw data of an inertia measurement")
    ends = given.get("ends_rev")
    settings = InertiaSettings(
        **{
            **given,
            "envelope": Envelope(**given["envelope"]),
            "ends_rev": None if ends is None else (float(ends[0]), float(ends[1])),
        }
    )
    valid = np.asarray(arrays["valid"], np.bool_)
    columns = {k: np.asarray(v, np.float64) for k, v in arrays.items() if k != "valid"}
    rate = float(str(meta["sample_rate_hz"]))
    facts = AxisFacts(**told)
    recording = Recording(rate, **columns, valid=valid)
    cutoff_hz = float(str(meta.get("cutoff_hz", _CUTOFF_HZ)))
    return InertiaOutcome(
        evaluate(recording, settings, facts, cutoff_hz), f"host, {settings.scheme}",
        facts.torque_known, settings.ends_rev, recording.velocity_rad_s.size / rate,
        _ratio_against(facts, settings),
    )  # fmt: skip


def as_json(outcome: InertiaOutcome) -> dict[str, object]:
    """The form that ``servodeck inertia --out`` writes (architecture.md)."""
    r = outcome.result
    parts: dict[str, Interval] = {
        "inertia_kgm2": r.inertia_kgm2, "viscous_nms": r.viscous_nms,
        "coulomb_nm": r.coulomb_nm, "gravity_nm": r.gravity_nm,
    }  # fmt: skip
    ratio = r.load_ratio
    spread = None
    if ratio is not None and np.isfinite(r.inertia_kgm2.value):
        rotor = r.inertia_kgm2.value / (1.0 + ratio)
        spread = [r.inertia_kgm2.low / rotor - 1.0, r.inertia_kgm2.high / rotor - 1.0]
    return {
        "method": outcome.method,
        **{name: _number(part.value) for name, part in parts.items()},
        "load_ratio": ratio,
        "load_ratio_against": outcome.ratio_against,
        "ci95": {
            **{name: [_number(p.low), _number(p.high)] for name, p in parts.items()},
            "load_ratio": spread,
        },
        "r2": r.r2,
        "verdict": r.verdict,
        "identifiable": r.identifiable,
        "unit": "SI" if outcome.torque_known else "torque as a share of rated torque",
        "ends_rev": outcome.ends_rev,
        "motion_s": outcome.motion_s,
    }  # fmt: skip


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
