"""Inertia and friction from moves made by the host over cyclic process data.

The speed loop makes reciprocating moves (in CSV, which even a badly tuned axis follows), torque and
speed are recorded in every cycle, and a regression yields J, friction and gravity. Three schemes:
*free*, *limited* with the ends found at limited torque, and *taught* ends.
"""

from __future__ import annotations

import asyncio
import contextlib
from dataclasses import replace

from backend.analysis.mechanics.slow_moves.inertia import InertiaResult
from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.axis_facts import read_facts
from backend.tools.measuring.computing import meanwhile
from backend.tools.measuring.recording import Recording, require_signals, share
from backend.tools.measuring.repeats import Repeats
from backend.tools.mechanics.inertia.evaluation import (
    InertiaOutcome,
    InertiaSettings,
    answer_of,
    evaluate,
    oscillation_hz,
    ratio_against,
    raw_of,
    reevaluate,
    uncertainty_of,
)
from backend.tools.mechanics.inertia.moves import Shape, first_look, identification_moves
from backend.tools.mechanics.inertia.probe import RoughFit
from backend.tools.mechanics.inertia.result import InertiaAnswer
from backend.tools.mechanics.inertia.settings import InertiaRequest
from backend.tools.mechanics.inertia.texts import TEXTS, report
from backend.tools.moving.moves.end_search import find_ends
from backend.tools.moving.moves.go_back import go_back
from backend.tools.thresholds import inertia_run as threshold
from backend.tools.tool import Keep, Run, Tool
from drivers.cia402 import Mode
from drivers.errors import NotAllowed, OutOfRange
from drivers.texts.message import text


async def inertia(
    axis: Axis,
    session: CyclicSession,
    settings: InertiaSettings,
    progress: Progress,
    keep: Keep | None = None,
    repeats: Repeats | None = None,
) -> InertiaOutcome:
    """Measure; the axis ends where it began, with its settings restored.

    ``repeats`` limits the time for a second move with an oscillating load; without it, that move is
    always made.

    Raises:
        OutOfRange: invalid settings; nothing has moved.
        NotAllowed: the envelope, an end or a fault ended it, or it cannot move; states the reason.
    """
    _check(settings)
    require_signals(axis, session, Mode.CSV, False)
    units = await axis.require_certain_scales()
    facts = await read_facts(axis, settings.rated_torque_nm, settings.motor_inertia_kgm2)
    home = await axis.position_raw()
    ends = settings.ends_rev if settings.scheme == "taught" else None
    if ends is not None and not ends[0] < units.position(home) < ends[1]:
        raise OutOfRange(
            "inertia.stands-rev-outside-taught",
            value=units.position(home),
            limit=f"{ends[0]:g}…{ends[1]:g} rev",
            axis_drive=axis.drive.name,
        )
    progress(0.0, text("inertia.first-short-move"))
    look = await first_look(axis, session, settings, facts, home, ends)
    if settings.scheme == "limited":
        ends = await find_ends(axis, session, settings, facts, look.rough, progress)
    travel, start = _where(settings, ends, units.position(home))
    begin = home if abs(start - units.position(home)) <= 0.01 else units.position_raw(start)

    async def back_to(place_raw: int) -> None:
        await go_back(axis, session, place_raw, _wide(settings, ends), facts)

    if begin != home:
        await back_to(begin)
    reported = share(progress, 0.35, 0.65, text("inertia.moving-forth-and-back"))
    recording = await identification_moves(
        axis, session, settings, facts, look, travel, Shape(), reported
    )
    progress(0.65, text("inertia.going-back-evaluating"))

    def evaluated() -> tuple[InertiaResult, float | None]:
        found = evaluate(recording, settings, facts)
        return found, oscillation_hz(recording, found)

    try:
        result, swing_hz = await meanwhile(evaluated, back_to(home))
        played_s = recording.velocity_rad_s.size / recording.sample_rate_hz
        if swing_hz is not None and (repeats or Repeats()).allow(
            threshold.GENTLY * played_s + threshold.AROUND_S
        ):
            # Repeat with a shape that does not excite the oscillation of the load.
            gentle = Shape.against(swing_hz)
            step = text("inertia.once-more-gently", swing_hz=swing_hz)
            rough = look.rough
            heavier = max(result.inertia_kgm2.value, rough.inertia_kgm2)
            better = replace(look, rough=RoughFit(heavier, rough.coulomb_nm, rough.gravity_nm))
            await back_to(begin)
            again: Recording | None = None
            # Gentle moves take longer, and may not fit into the limits: the first result stays.
            with contextlib.suppress(OutOfRange):
                again = await identification_moves(
                    axis, session, settings, facts, better, travel, gentle,
                    share(progress, 0.66, 0.9, step),
                )  # fmt: skip
            # With short travel, a gentle move may contain too little to evaluate.
            with contextlib.suppress(NotAllowed):
                if again is not None:
                    calm = await asyncio.to_thread(evaluate, again, settings, facts)
                    if uncertainty_of(calm) < uncertainty_of(result):
                        recording, result = again, calm
            await back_to(home)
    finally:
        # Also if the evaluation or the way back fails: the measurement is not lost.
        if keep is not None:
            # With the ends that were found, so that an evaluation of the file states them too.
            keep("inertia", *raw_of(recording, replace(settings, ends_rev=ends), facts))
    return InertiaOutcome(
        result,
        f"host, {settings.scheme}",
        facts.torque_known,
        ends,
        recording.velocity_rad_s.size / recording.sample_rate_hz,
        ratio_against(facts, settings),
    )


def _check(settings: InertiaSettings) -> None:
    if settings.scheme == "taught" and settings.ends_rev is None:
        raise OutOfRange("inertia.taught-scheme-needs-both")
    if not 1 <= settings.repetitions <= 10:
        raise OutOfRange(
            "inertia.10-repetitions-possible", value=settings.repetitions, limit="1…10"
        )


def _where(
    settings: InertiaSettings, ends: tuple[float, float] | None, home_rev: float
) -> tuple[float, float]:
    """Travel of the moves and their start [rev]."""
    if ends is None:
        return settings.envelope.travel_rev, home_rev
    margin = min(threshold.END_MARGIN_REV, 0.15 * (ends[1] - ends[0]))
    travel = min(ends[1] - ends[0] - 2 * margin, settings.envelope.travel_rev)
    return travel, ends[0] + margin


def _wide(settings: InertiaSettings, ends: tuple[float, float] | None) -> Envelope:
    """Envelope for positioning between the ends: the whole span is known to be free."""
    if ends is None:
        return settings.envelope
    return replace(settings.envelope, travel_rev=ends[1] - ends[0])


async def run(run: Run, request: InertiaRequest) -> InertiaAnswer:
    """Run `inertia` for the descriptor."""
    return answer_of(
        await inertia(run.axis, run.session, request.inner, run.progress, run.keep, run.repeats)
    )


TOOL = Tool(
    kind="inertia",
    title=text("inertia.title"),
    settings=InertiaRequest,
    result=InertiaAnswer,
    run=run,
    reevaluate=reevaluate,
    report=report,
    texts=TEXTS,
)
