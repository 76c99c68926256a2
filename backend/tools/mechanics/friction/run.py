"""Moves of a friction map: reciprocating strokes of constant speed about one position."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
import numpy.typing as npt

from backend.axes.scales.units import AxisUnits
from backend.tools.measuring.axis_facts import AxisFacts, read_facts
from backend.tools.measuring.computing import meanwhile
from backend.tools.measuring.recording import Recording, cycle_s, require_signals, share
from backend.tools.mechanics.friction.evaluate import Map, evaluate, reevaluate
from backend.tools.mechanics.friction.result import FrictionResult
from backend.tools.mechanics.friction.settings import FrictionSettings
from backend.tools.mechanics.friction.texts import TEXTS, report
from backend.tools.mechanics.inertia.evaluation import InertiaSettings
from backend.tools.mechanics.inertia.moves import first_look, speed_move
from backend.tools.moving.moves.go_back import go_back
from backend.tools.moving.moves.strokes import Room, Stroke, representable, room_of, speeds_of
from backend.tools.thresholds import friction_run as threshold
from backend.tools.tool import Run, Tool
from drivers.cia402 import Mode
from drivers.errors import NotAllowed, OutOfRange
from drivers.texts.message import Text, text

FloatArray = npt.NDArray[np.float64]


def _stroke_of(room: Room, speed_rps: float, slow_s: float) -> Stroke | None:
    """Stroke of this speed; None where the travel does not suffice for its plateaus."""
    ramp_s, left_rev = room.ramp_s(speed_rps), room.plateau_rev(speed_rps)
    wanted = max(1.0, np.ceil(threshold.LEAST_S * speed_rps))
    whole = min(wanted, np.floor(left_rev))
    if whole >= 1.0 and whole / speed_rps <= threshold.LONGEST_S:
        plateau_s = whole / speed_rps
    elif whole >= 1.0:
        plateau_s = slow_s
    else:
        plateau_s = min(left_rev / speed_rps, slow_s)
        # If the travel allows a whole revolution, a shorter plateau would give a worse mean: use a
        # lower speed.
        if plateau_s < threshold.SHORT_S or (2 * room.travel_rev >= 1.5 and speed_rps > 0.5):
            return None
    return Stroke(speed_rps, ramp_s, float(plateau_s), 2 if plateau_s >= threshold.LEAST_S else 4)


@dataclass(frozen=True)
class Plan:
    """Strokes, slowest first. ``ripple_rps`` is the speed of the slow revolution, None without one.

    ``by_travel`` and ``by_time``: whether they limited the fastest and the slowest speed.
    """

    strokes: tuple[Stroke, ...]
    ripple_rps: float | None
    by_travel: bool
    by_time: bool


def planned(settings: FrictionSettings, room: Room, units: AxisUnits) -> Plan:
    """Plan speeds spaced evenly on a logarithmic scale, as slow as the time allows.

    Raises:
        OutOfRange: the limits leave no speed to measure.
    """
    fastest = room.speed_rps
    while _stroke_of(room, fastest, threshold.SLOW_S[0]) is None and fastest > 1e-3:
        fastest *= 0.97
    slowest = (
        settings.slowest_rpm or min(threshold.SLOWEST_RPM, 0.05 * settings.speed_limit)
    ) / 60.0
    if slowest >= 0.5 * fastest:
        raise OutOfRange(
            "friction.between-rpm-rpm-fastest",
            value=round(slowest * 60.0, 4),
            limit=f"{fastest * 60.0:.3g} rpm",
            slowest_rpm=slowest * 60.0,
            fastest_rpm=fastest * 60.0,
        )
    ripple = _ripple_stroke(settings, room, slowest)
    lowest, count = slowest, settings.speeds
    while True:
        speeds = representable(np.geomspace(lowest, fastest, count), units)
        if ripple is not None:
            near = ripple.speed_rps * np.array([1.0 - threshold.ALIKE, 1.0 + threshold.ALIKE])
            speeds = [v for v in speeds if not near[0] < v < near[1]]
        for slow_s in threshold.SLOW_S:
            found = [stroke for v in speeds if (stroke := _stroke_of(room, v, slow_s)) is not None]
            whole = sorted([*found, *([ripple] if ripple else [])], key=lambda s: s.speed_rps)
            if whole and sum(stroke.duration_s for stroke in whole) <= room.time_s:
                return Plan(
                    tuple(whole),
                    ripple.speed_rps if ripple else None,
                    fastest < 0.95 * room.speed_rps,
                    lowest > slowest,
                )
        lowest *= 1.3
        if lowest >= 0.5 * fastest:
            raise OutOfRange(
                "friction.speeds-friction-map-take",
                value=settings.speeds,
                limit=f"{room.time_s:g} s",
                time_s=room.time_s,
            )


def _ripple_stroke(settings: FrictionSettings, room: Room, slowest_rps: float) -> Stroke | None:
    """One slow revolution in each direction; None where not requested or beyond the travel."""
    if not settings.ripple or 2 * room.travel_rev < threshold.RIPPLE_REV + 0.1:
        return None
    speed = 2 * threshold.RIPPLE_REV / (threshold.RIPPLE_SHARE * room.time_s)
    speed = min(max(speed, slowest_rps), threshold.RIPPLE_HZ / settings.orders)
    return Stroke(speed, room.ramp_s(speed), threshold.RIPPLE_REV / speed, 2)


async def run(run: Run, settings: FrictionSettings) -> FrictionResult:
    """Measure; the axis ends where it began, with its settings restored.

    Raises:
        OutOfRange: the limits leave nothing to measure; only a short first move was made.
        NotAllowed: 6077h does not come with every cycle or does not change, or the envelope or a
            fault ended a motion; states the reason.
    """
    axis, session, envelope = run.axis, run.session, settings.envelope
    require_signals(axis, session, Mode.CSV, False)
    units = await axis.require_certain_scales()
    facts = await read_facts(axis, settings.rated_torque_nm)
    home = await axis.position_raw()
    run.progress(0.0, text("friction.first-short-move"))
    look = await first_look(axis, session, InertiaSettings(envelope), facts, home, None)
    await go_back(axis, session, home, envelope, facts)
    plan = planned(settings, room_of(envelope, facts, look.rough), units)
    total_s = sum(stroke.duration_s for stroke in plan.strokes)
    taken: list[tuple[Recording, FloatArray]] = []
    done_s = 0.0
    for stroke in plan.strokes:
        low, high = (0.05 + 0.85 * s / total_s for s in (done_s, done_s + stroke.duration_s))
        step = text("friction.speed-both-directions", speed_rpm=stroke.speed_rps * 60.0)
        taken.append(await _stroke(run, settings, facts, stroke, (low, high, step)))
        _require_torque(run, taken[0][0], facts, units)
        done_s += stroke.duration_s
        if stroke is not plan.strokes[-1]:
            await go_back(axis, session, home, envelope, facts)
    run.progress(0.92, text("friction.going-back-evaluating"))
    found = Map.of(
        [recording for recording, _ in taken],
        [numbers for _, numbers in taken],
        torque_step_nm=abs(units.torque(1.0)) / 100.0 * facts.rated_torque_nm,
        inertia_kgm2=look.rough.inertia_kgm2,
        by_travel=plan.by_travel,
        by_time=plan.by_time,
        ripple_rpm=None if plan.ripple_rps is None else plan.ripple_rps * 60.0,
    )
    if run.keep is not None:
        meta = {"settings": settings.model_dump(mode="json"), "facts": asdict(facts)}
        run.keep("friction", found.arrays(), {"tool": "friction", **meta, **found.facts()})
    return await meanwhile(
        lambda: evaluate(found, settings, facts), go_back(axis, session, home, envelope, facts)
    )


async def _stroke(
    run: Run,
    settings: FrictionSettings,
    facts: AxisFacts,
    stroke: Stroke,
    where: tuple[float, float, Text],
) -> tuple[Recording, FloatArray]:
    """Recording of one speed, and the plateau number of each sample."""
    slow_rps = 0.25 * settings.speed_limit / 60.0
    speed_rpm, numbers = speeds_of(stroke, 1.0 / cycle_s(run.session), slow_rps)
    recording = await speed_move(
        run.axis, run.session, speed_rpm, settings.envelope, facts, share(run.progress, *where)
    )
    return recording, numbers[: recording.velocity_rad_s.size]


def _require_torque(run: Run, first: Recording, facts: AxisFacts, units: AxisUnits) -> None:
    """Check that the reported torque changes: a reciprocating move needs torques of both signs.

    Raises:
        NotAllowed: the torque that the drive reports does not change.
    """
    step_nm = abs(units.torque(1.0)) / 100.0 * facts.rated_torque_nm
    seen = first.torque_nm[first.valid]
    if seen.size and float(np.ptp(seen)) >= 0.5 * step_nm:
        return
    drive = run.axis.drive
    key = drive.require("torque_actual")
    raise NotAllowed("friction.actual-torque-not-change", drive=drive.name, parameter=key)


TOOL = Tool(
    kind="friction",
    title=text("friction.title"),
    settings=FrictionSettings,
    result=FrictionResult,
    run=run,
    reevaluate=reevaluate,
    report=report,
    texts=TEXTS,
)
