"""Response of an axis to a commanded step of speed, or to a commanded move."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.axis_facts import AxisFacts, read_facts
from backend.tools.measuring.recording import (
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
from backend.tools.measuring.temporary import stopping_hard
from backend.tools.moving.jog.cyclic import run_up
from backend.tools.moving.moves.go_back import go_back
from backend.tools.moving.step.evaluate import (
    LEAD_S,
    StepResult,
    StepSettings,
    answer_of,
    evaluate,
    raw_of,
    reevaluate,
)
from backend.tools.moving.step.result import StepAnswer
from backend.tools.moving.step.settings import StepRequest
from backend.tools.moving.step.texts import TEXTS, report
from backend.tools.tool import Keep, Run, Tool
from drivers.cia402 import Mode
from drivers.errors import OutOfRange
from drivers.texts.message import text


async def step_response(
    axis: Axis,
    session: CyclicSession,
    settings: StepSettings,
    progress: Progress,
    keep: Keep | None = None,
    stays: bool = False,
) -> StepResult:
    """Play the step and read the figures; the axis ends where it began.

    With ``stays`` a step of speed ends where the axis has come to rest: the next one leads back.

    Raises:
        OutOfRange: the step exceeds the envelope; nothing has moved.
        NotAllowed: the envelope or a fault ended it.
    """
    demand = _demand(settings, 1.0 / cycle_s(session))
    require_signals(axis, session, _mode(settings), False)
    await axis.require_certain_scales()
    facts = await read_facts(axis, settings.rated_torque_nm)
    home = await axis.position_raw()
    async with stopping_hard(axis, settings.envelope.speed_rpm):
        recording = await _played(axis, session, settings, demand, facts, progress)
    # First of all, so that the measurement is not lost if the way back fails.
    if keep is not None:
        keep("step", *raw_of(recording, demand, settings, facts))
    if not stays:
        await go_back(axis, session, home, settings.envelope, facts)
    return evaluate(recording, demand, settings, facts.rated_torque_nm)


async def one_more_step(
    axis: Axis, session: CyclicSession, settings: StepSettings, facts: AxisFacts
) -> StepResult:
    """Play another step as `step_response` did before, and stay where the axis has come to rest.

    The caller has the `facts`, and lets a quick stop brake hard (`stopping_hard`) meanwhile.

    Raises:
        OutOfRange: the step exceeds the envelope; nothing has moved.
        NotAllowed: the envelope or a fault ended it.
    """
    demand = _demand(settings, 1.0 / cycle_s(session))
    silent = Progress(lambda: None)
    recording = await _played(axis, session, settings, demand, facts, silent)
    return evaluate(recording, demand, settings, facts.rated_torque_nm)


def _mode(settings: StepSettings) -> Mode:
    return Mode.CSV if settings.kind == "speed" else Mode.CSP


async def _played(
    axis: Axis,
    session: CyclicSession,
    settings: StepSettings,
    demand: npt.NDArray[np.float64],
    facts: AxisFacts,
    progress: Progress,
) -> Recording:
    """Play the demand [n] in rpm or rev, within the envelope around the present position."""
    units, mode = await axis.require_certain_scales(), _mode(settings)
    async with enabled(axis, session, mode) as start:
        await quiet(axis)
        if mode is Mode.CSV:
            raw = np.round(demand * (units.velocity_raw(1e6) / 1e6))
        else:
            raw = start + np.round(demand * (units.position_raw(1e6) / 1e6))
        return await play(
            axis,
            session,
            Play(mode, raw.astype(np.int64)),
            await bus_limits(axis, settings.envelope, start),
            facts.rated_torque_nm,
            share(progress, 0.1, 0.85, text("step.stepping")),
        )


def _demand(settings: StepSettings, rate: float) -> npt.NDArray[np.float64]:
    """Commanded speed in rpm, or position in rev from the start [n].

    Raises:
        OutOfRange: the step exceeds the envelope.
    """
    envelope = settings.envelope
    lead, hold = np.zeros(round(LEAD_S * rate)), round(settings.hold_s * rate)
    if settings.kind == "speed":
        highest, name, travelled = abs(settings.size), "rpm", 0.0
        travelled = highest / 60.0 * settings.hold_s
    else:
        highest, name, travelled = settings.speed_rpm, "rpm", abs(settings.size)
    if highest > envelope.speed_rpm or travelled > envelope.travel_rev:
        raise OutOfRange(
            "step.step-needs-rev-more",
            value=settings.size,
            limit=f"{envelope.speed_rpm:g} rpm, {envelope.travel_rev:g} rev",
            highest=highest,
            name=name,
            travelled_rev=travelled,
            speed_rpm=envelope.speed_rpm,
            travel_rev=envelope.travel_rev,
        )
    if settings.kind == "speed":
        return np.concatenate([lead, np.full(hold, settings.size), np.zeros(hold)])
    way = run_up(
        abs(settings.size), settings.speed_rpm / 60.0, settings.acceleration_rpm_s / 60.0, 1 / rate
    )
    end = np.full(hold, abs(settings.size))
    return np.asarray(np.concatenate([lead, way, end]) * np.sign(settings.size))


async def run(run: Run, request: StepRequest) -> StepAnswer:
    """Run `step_response` for the descriptor."""
    return answer_of(
        await step_response(run.axis, run.session, request.inner, run.progress, run.keep)
    )


TOOL = Tool(
    kind="step",
    title=text("step.title"),
    settings=StepRequest,
    result=StepAnswer,
    run=run,
    reevaluate=reevaluate,
    report=report,
    texts=TEXTS,
)
