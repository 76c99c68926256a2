"""Moves of a load-side measurement: slow passes, then reciprocating moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
import numpy.typing as npt

from backend.analysis.mechanics.load_side_samples import GROUP, unwrapped
from backend.axes.axis.axis import Envelope
from backend.tools.measuring.axis_facts import AxisFacts, read_facts
from backend.tools.measuring.computing import meanwhile
from backend.tools.measuring.load_position import load_position
from backend.tools.measuring.recording import Recording, cycle_s, require_signals, share
from backend.tools.mechanics.inertia.evaluation import InertiaSettings
from backend.tools.mechanics.inertia.moves import first_look, speed_move
from backend.tools.mechanics.inertia.probe import RoughFit
from backend.tools.mechanics.load_side.evaluate import Sides, evaluate, reevaluate
from backend.tools.mechanics.load_side.result import LoadSideResult
from backend.tools.mechanics.load_side.settings import LoadSideSettings
from backend.tools.mechanics.load_side.texts import TEXTS, report
from backend.tools.moving.moves.go_back import go_back
from backend.tools.moving.moves.raised_cosine import raised_cosine
from backend.tools.thresholds import load_side_run as threshold
from backend.tools.tool import Run, Tool
from drivers.cia402 import Mode
from drivers.errors import OutOfRange
from drivers.texts.message import text

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
_TURN = 2 * np.pi


@dataclass(frozen=True)
class Room:
    """Limits of the moves: rev to each side, rev/s, s, and rad/s² beyond friction.

    ``friction_rad_s2`` is the acceleration that corresponds to friction and static torque.
    """

    travel_rev: float
    speed_rps: float
    time_s: float
    acceleration_rad_s2: float
    friction_rad_s2: float


@dataclass(frozen=True)
class Plan:
    """Two sequences: speeds [n] in rpm, and the part that each sample belongs to (see `Sides`)."""

    slow_rpm: FloatArray
    slow_part: IntArray
    moves_rpm: FloatArray
    moves_part: IntArray


def planned(settings: LoadSideSettings, room: Room, rate: float) -> Plan:
    """Passes over a load revolution where the travel allows it, and moves inside their range.

    Raises:
        OutOfRange: travel or time does not suffice for them.
    """
    quarter_s, peak_rps = _triangle(room)
    stroke_rev = peak_rps * quarter_s
    wanted_rev = max(threshold.WHOLE * settings.gear_ratio, threshold.WIDER * stroke_rev)
    range_rev = min(wanted_rev, 2.0 * room.travel_rev)
    if peak_rps < threshold.LEAST_RPS or range_rev < threshold.LEAST_REV:
        raise OutOfRange(
            "load-side.no-room",
            value=round(2.0 * room.travel_rev, 4),
            limit=f"{threshold.LEAST_REV:g} rev",
        )
    moves_rpm, moves_part = _moves(peak_rps, quarter_s, rate)
    left_s = room.time_s - moves_rpm.size / rate - threshold.SPARE_S
    fastest_rps = threshold.SLOW_SHARE * room.speed_rps
    asked = settings.slow_rpm or threshold.SLOW_RPM
    needed_rps = threshold.PASSES * range_rev / left_s if left_s > 0.0 else np.inf
    slow_rps = max(min(asked / 60.0, fastest_rps), needed_rps)
    if slow_rps > fastest_rps:
        longest_s = room.time_s - left_s + threshold.PASSES * range_rev / fastest_rps
        raise OutOfRange(
            "load-side.no-time",
            value=round(longest_s, 1),
            limit=f"{room.time_s:g} s",
            range_rev=range_rev,
        )
    slow_rpm, slow_part = _passes(range_rev, slow_rps, fastest_rps, rate)
    return Plan(slow_rpm, slow_part, moves_rpm, moves_part)


def _triangle(room: Room) -> tuple[float, float]:
    """Quarter period [s] and peak [rev/s] of a triangle of speed.

    Its acceleration must change the flank of the gear against friction.
    """
    quarter_s, peak_rps = threshold.QUARTERS_S[-1], 0.0
    for quarter_s in threshold.QUARTERS_S:
        most_rps = min(room.speed_rps, 2.0 * room.travel_rev / quarter_s)
        peak_rps = min(most_rps, room.acceleration_rad_s2 * quarter_s / _TURN)
        if peak_rps * _TURN / quarter_s >= threshold.BEYOND * room.friction_rad_s2:
            break
    return quarter_s, peak_rps


def _passes(
    range_rev: float, slow_rps: float, fastest_rps: float, rate: float
) -> tuple[FloatArray, IntArray]:
    """Passes forwards and backwards over the range, centred on the present position."""
    half = _positioning(-0.5 * range_rev, fastest_rps, rate)
    still = np.zeros(round(threshold.DWELL_S * rate))
    n = round(threshold.RAMP_S * rate)
    rise = 0.5 * (1.0 - np.cos(np.pi * (np.arange(n) + 0.5) / n))
    held = max(1, round((range_rev / slow_rps - threshold.RAMP_S) * rate))
    one = np.concatenate([rise, np.ones(held), rise[::-1], still]) * slow_rps
    early = round(threshold.SETTLE_S * rate)
    speeds, parts = [half, still], [np.zeros(half.size + still.size)]
    for number in range(threshold.PASSES):
        sign = 1 if number % 2 == 0 else -1
        counts = np.zeros(one.size)
        counts[n + early : n + held] = sign * (number + 1)
        speeds.append(sign * one)
        parts.append(counts)
    speeds += [-half, still]
    parts.append(np.zeros(half.size + still.size))
    return np.concatenate(speeds) * 60.0, np.concatenate(parts).astype(np.int64)


def _moves(peak_rps: float, quarter_s: float, rate: float) -> tuple[FloatArray, IntArray]:
    """Groups of triangles of speed: acceleration ±α while turning forwards, then backwards."""
    n = round(quarter_s * rate)
    ramp = (np.arange(n) + 0.5) / n
    triangle = np.concatenate([ramp, ramp[::-1], -ramp, -ramp[::-1]])
    corner = round(threshold.CORNER_S * rate)
    window = np.hanning(corner + 2)[1:-1] / np.sum(np.hanning(corner + 2)[1:-1])
    early, late = round(threshold.CONTACT * n), round(threshold.LATE_S * rate)
    quarter = np.zeros(n)
    quarter[early : n - late] = 1.0
    still = np.zeros(round(threshold.DWELL_S * rate))
    speeds, parts = [still], [still]
    for number, level in enumerate(threshold.LEVELS * threshold.REPEATS):
        sign = 1.0 if number % 2 == 0 else -1.0
        away_rev = -0.5 * sign * level * peak_rps * quarter_s
        half = _positioning(away_rev, peak_rps, rate)
        ends = np.zeros(corner)
        padded = np.concatenate([ends, *[triangle] * threshold.CYCLES, ends])
        one = np.convolve(padded, window, mode="same") * sign * level * peak_rps
        counts = np.concatenate([ends, *[quarter] * 4 * threshold.CYCLES])
        counts[: corner + n] = 0.0
        counts = np.concatenate([counts, np.zeros(one.size - counts.size)])
        speeds += [half, still, one, still, -half, still]
        outside = np.zeros(half.size + still.size)
        parts += [outside, counts * (GROUP + number), still, outside]
    return np.concatenate(speeds) * 60.0, np.concatenate(parts).astype(np.int64)


def _positioning(distance_rev: float, peak_rps: float, rate: float) -> FloatArray:
    duration_s = max(2.0 * abs(distance_rev) / peak_rps, threshold.POSITIONING_S)
    return raised_cosine(distance_rev, duration_s, rate)


async def run(run: Run, settings: LoadSideSettings) -> LoadSideResult:
    """Measure; the axis ends where it began, with its settings restored.

    Raises:
        NotAllowed: the drive has no second position, it does not come with every cycle or does not
            follow the motor, or the envelope or a fault ended a motion; states why.
        OutOfRange: the limits leave nothing to measure; only a short first move was made.
    """
    axis, session, envelope = run.axis, run.session, settings.envelope
    key = await load_position(axis, session)
    require_signals(axis, session, Mode.CSV, False)
    await axis.require_certain_scales()
    facts = await read_facts(axis, settings.rated_torque_nm)
    home = await axis.position_raw()
    run.progress(0.0, text("load-side.first-short-move"))
    look = await first_look(axis, session, InertiaSettings(envelope), facts, home, None)
    await go_back(axis, session, home, envelope, facts)
    plan = planned(settings, _room(envelope, facts, look.rough), 1.0 / cycle_s(session))
    reported = share(run.progress, 0.05, 0.5, text("load-side.slow-passes"))
    slow = await speed_move(axis, session, plan.slow_rpm, envelope, facts, reported, also=(key,))
    await go_back(axis, session, home, envelope, facts)
    reported = share(run.progress, 0.5, 0.92, text("load-side.reciprocating"))
    moves = await speed_move(axis, session, plan.moves_rpm, envelope, facts, reported, also=(key,))
    run.progress(0.92, text("load-side.going-back-evaluating"))
    found = _sides((slow, moves), (plan.slow_part, plan.moves_part))
    if run.keep is not None:
        meta = {"settings": settings.model_dump(mode="json"), "facts": asdict(facts)}
        rate = {"sample_rate_hz": found.sample_rate_hz}
        run.keep("load-side", found.arrays(), {"tool": "load-side", **meta, **rate})
    return await meanwhile(
        lambda: evaluate(found, settings, facts), go_back(axis, session, home, envelope, facts)
    )


def _sides(recordings: Sequence[Recording], parts: Sequence[IntArray]) -> Sides:
    """Join both recordings; the load encoder's counter continues between them."""
    counts = [recording.also for recording in recordings]
    assert all(each is not None for each in counts), "asked for with the move"
    shown = np.concatenate([each[:, 0] for each in counts if each is not None])
    load = np.asarray(unwrapped(shown), np.float64)
    sizes = [recording.position_rad.size for recording in recordings]
    part = np.concatenate([p[:n] for p, n in zip(parts, sizes, strict=True)])
    return Sides(
        recordings[0].sample_rate_hz,
        np.concatenate([each.position_rad for each in recordings]),
        load,
        np.concatenate([each.torque_nm for each in recordings]),
        np.concatenate([each.valid for each in recordings]),
        part,
    )


def _room(envelope: Envelope, facts: AxisFacts, rough: RoughFit) -> Room:
    permitted_nm = envelope.torque_percent / 100.0 * facts.rated_torque_nm
    free_nm = permitted_nm - rough.coulomb_nm - abs(rough.gravity_nm)
    return Room(
        threshold.USED * envelope.travel_rev,
        threshold.FAST * envelope.speed_rpm / 60.0,
        envelope.time_s,
        max(threshold.TORQUE_SHARE * free_nm, 0.0) / rough.inertia_kgm2,
        (rough.coulomb_nm + abs(rough.gravity_nm)) / rough.inertia_kgm2,
    )


TOOL = Tool(
    kind="load-side",
    title=text("load-side.title"),
    settings=LoadSideSettings,
    result=LoadSideResult,
    run=run,
    reevaluate=reevaluate,
    report=report,
    texts=TEXTS,
)
