"""Moves of a map of vibration over speed: a ladder of constant speeds in both directions."""

from __future__ import annotations

import asyncio
from dataclasses import asdict, dataclass

import numpy as np
import numpy.typing as npt

from backend.axes.scales.units import AxisUnits
from backend.tools.measuring.axis_facts import AxisFacts, read_facts
from backend.tools.measuring.computing import meanwhile
from backend.tools.measuring.recording import Recording, cycle_s, require_signals, share
from backend.tools.mechanics.inertia.evaluation import InertiaSettings
from backend.tools.mechanics.inertia.moves import first_look, speed_move
from backend.tools.moving.moves.go_back import go_back
from backend.tools.moving.moves.strokes import Room, Stroke, representable, room_of, speeds_of
from backend.tools.thresholds import vibration_run as threshold
from backend.tools.tool import Run, Tool
from backend.tools.watching.vibration.evaluate import (
    Plateaus,
    closer_about,
    evaluate,
    levels_of,
    reevaluate,
)
from backend.tools.watching.vibration.result import VibrationResult
from backend.tools.watching.vibration.settings import VibrationSettings
from backend.tools.watching.vibration.texts import TEXTS, report
from drivers.cia402 import Mode
from drivers.errors import OutOfRange
from drivers.texts.message import text

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Plan:
    """Strokes, slowest first; ``by_travel``: the travel limits the fastest speed."""

    strokes: tuple[Stroke, ...]
    by_travel: bool


def planned(settings: VibrationSettings, room: Room, units: AxisUnits) -> Plan:
    """Plan speeds spaced evenly on a logarithmic scale.

    Raises:
        OutOfRange: the limits leave no such speeds, or no time for them.
    """
    fastest = room.speed_rps
    while stroke_of(room, fastest) is None and fastest > 1e-3:
        fastest *= 0.97
    slowest = (settings.slowest_rpm or 60.0 * fastest / threshold.RANGE) / 60.0
    if slowest >= threshold.LEAST_RANGE * fastest:
        raise OutOfRange(
            "vibration.no-room-for-speeds",
            value=round(slowest * 60.0, 4),
            limit=f"{fastest * 60.0:.3g} rpm",
            slowest_rpm=slowest * 60.0,
            fastest_rpm=fastest * 60.0,
        )
    speeds = representable(np.geomspace(slowest, fastest, settings.speeds), units)
    strokes = [one for v in speeds if (one := stroke_of(room, v)) is not None]
    takes_s = sum(one.duration_s for one in strokes)
    if takes_s > room.time_s:
        raise OutOfRange(
            "vibration.takes-too-long",
            value=round(takes_s, 1),
            limit=f"{room.time_s:g} s",
            speeds=len(strokes),
            takes_s=takes_s,
            time_s=room.time_s,
        )
    return Plan(tuple(strokes), fastest < 0.95 * room.speed_rps)


def stroke_of(room: Room, speed_rps: float) -> Stroke | None:
    """Stroke of this speed, as long as useful; None where the travel does not suffice."""
    held_s = min(threshold.LONGEST_S, room.plateau_rev(speed_rps) / speed_rps)
    if held_s < threshold.SHORT_S:
        return None
    strokes = 2 if held_s >= threshold.ENOUGH_S else 4
    return Stroke(speed_rps, room.ramp_s(speed_rps), float(held_s), strokes)


async def run(run: Run, settings: VibrationSettings) -> VibrationResult:
    """Measure; the axis ends where it began, with its settings restored.

    Raises:
        OutOfRange: the limits leave nothing to measure; only a short first move was made.
        NotAllowed: the envelope or a fault ended a motion; states the reason.
    """
    axis, session, envelope = run.axis, run.session, settings.envelope
    require_signals(axis, session, Mode.CSV, False)
    units = await axis.require_certain_scales()
    facts = await read_facts(axis, settings.rated_torque_nm)
    home = await axis.position_raw()
    run.progress(0.0, text("vibration.first-short-move"))
    look = await first_look(axis, session, InertiaSettings(envelope), facts, home, None)
    await go_back(axis, session, home, envelope, facts)
    room = room_of(envelope, facts, look.rough)
    plan = planned(settings, room, units)
    measured = _Measured(run, settings, facts, home, [])
    await measured.strokes(plan.strokes, 0.05, 0.6)
    found = await asyncio.to_thread(levels_of, measured.plateaus(plan), facts.rated_torque_nm)
    about = closer_about(found) if settings.closer else None
    closer = True
    if about is not None:
        left_s = room.time_s - sum(one.duration_s for one in plan.strokes)
        more = _closer(settings, room, about, units, left_s)
        closer = bool(more)
        await measured.strokes(more, 0.6, 0.92)
    run.progress(0.92, text("vibration.going-back-evaluating"))
    data = measured.plateaus(plan, closer=closer)
    if run.keep is not None:
        meta = {"settings": settings.model_dump(mode="json"), "facts": asdict(facts)}
        run.keep("vibration", data.arrays(), {"tool": "vibration", **meta, **data.facts()})
    return await meanwhile(
        lambda: evaluate(data, facts), go_back(axis, session, home, envelope, facts)
    )


def _closer(
    settings: VibrationSettings,
    room: Room,
    about: tuple[float, float],
    units: AxisUnits,
    left_s: float,
) -> tuple[Stroke, ...]:
    """Further speeds within this range, as many as the remaining time allows."""
    for count in range(settings.closer, min(settings.closer, threshold.LEAST_CLOSER) - 1, -1):
        inside = np.geomspace(*about, count + 2)[1:-1]
        speeds = representable(np.asarray(inside, np.float64), units)
        strokes = [one for v in speeds if (one := stroke_of(room, v)) is not None]
        if sum(one.duration_s for one in strokes) <= left_s:
            return tuple(strokes)
    return ()


@dataclass(frozen=True)
class _Measured:
    """Recordings made so far."""

    run: Run
    settings: VibrationSettings
    facts: AxisFacts
    home: int
    taken: list[tuple[Recording, FloatArray]]

    async def strokes(self, strokes: tuple[Stroke, ...], low: float, high: float) -> None:
        """Play these strokes, each from the start; progress goes from ``low`` to ``high``."""
        run, envelope = self.run, self.settings.envelope
        total_s, done_s = sum(one.duration_s for one in strokes), 0.0
        slow_rps = threshold.POSITIONING * envelope.speed_rpm / 60.0
        for stroke in strokes:
            if self.taken:
                await go_back(run.axis, run.session, self.home, envelope, self.facts)
            speed_rpm, numbers = speeds_of(stroke, 1.0 / cycle_s(run.session), slow_rps)
            ends = [low + (high - low) * s / total_s for s in (done_s, done_s + stroke.duration_s)]
            step = text("vibration.speed-both-directions", speed_rpm=stroke.speed_rps * 60.0)
            recording = await speed_move(
                run.axis,
                run.session,
                speed_rpm,
                envelope,
                self.facts,
                share(run.progress, ends[0], ends[1], step),
            )
            self.taken.append((recording, numbers[: recording.velocity_rad_s.size]))
            done_s += stroke.duration_s

    def plateaus(self, plan: Plan, *, closer: bool = True) -> Plateaus:
        """All recordings as raw data for the evaluation."""
        return Plateaus.of(
            [recording for recording, _ in self.taken],
            [numbers for _, numbers in self.taken],
            by_travel=plan.by_travel,
            closer=closer,
        )


TOOL = Tool(
    kind="vibration",
    title=text("vibration.title"),
    settings=VibrationSettings,
    result=VibrationResult,
    run=run,
    reevaluate=reevaluate,
    report=report,
    texts=TEXTS,
)
