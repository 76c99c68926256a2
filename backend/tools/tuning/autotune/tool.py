"""The automatic tuning as a tool: its published result and its descriptor."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime

from backend.analysis.loop.design import Candidate
from backend.tools.measuring.figures import figures_of
from backend.tools.mechanics.inertia import evaluation as inertia_evaluation
from backend.tools.moving.step import evaluate as step_evaluation
from backend.tools.tool import Arrays, Meta, Run, Tool, ToolResult, Written
from backend.tools.tuning.autotune.again import Again
from backend.tools.tuning.autotune.apply import take_back
from backend.tools.tuning.autotune.result import (
    AgainInfo,
    AutotuneAnswer,
    CandidateInfo,
    FiguresInfo,
    GainStepsInfo,
    VerdictInfo,
    VerifiedInfo,
)
from backend.tools.tuning.autotune.run import AutotuneResult, autotune
from backend.tools.tuning.autotune.settings import AutotuneRequest
from backend.tools.tuning.autotune.texts import TEXTS, report
from backend.tools.tuning.autotune.verification.verify import Verified
from backend.tools.tuning.sweep import stored as sweep_stored
from backend.tools.wire_message import wire_messages, words_of
from drivers.texts.message import text


def answer_of(result: AutotuneResult, after: Mapping[str, int] | None = None) -> AutotuneAnswer:
    """The result in the form that page, report, files and command line use."""
    tried, notes = wire_messages(result.tried), wire_messages(result.notes)
    return AutotuneAnswer(
        inertia=inertia_evaluation.answer_of(result.inertia),
        mechanics=sweep_stored.answer_of(result.mechanics),
        load=result.load,
        candidates=tuple(candidate_info(each) for each in result.candidates),
        applied=candidate_info(result.applied) if result.applied else None,
        verified=_verified(result.verified, result) if result.verified else None,
        again=_again(result.again) if result.again else None,
        step=step_evaluation.answer_of(result.step) if result.step else None,
        before=result.before,
        after=dict(after or {}),
        written=result.written,
        tried=words_of(tried, "en"),
        tried_messages=tried,
        notes=words_of(notes, "en"),
        note_messages=notes,
        cautious=result.cautious,
    )


def candidate_info(candidate: Candidate) -> CandidateInfo:
    """One row of the table of designs."""
    figures = figures_of(candidate)
    # The name of the guaranteed margins in stored results since their first version.
    figures["promised"] = figures.pop("guaranteed")
    return CandidateInfo.model_validate(figures)


def _verified(verified: Verified, result: AutotuneResult) -> VerifiedInfo:
    verdict, steps, expected = verified.verdict, verified.shown, result.expected
    return VerifiedInfo(
        verdict=VerdictInfo.model_validate(figures_of(verdict)) if verdict else None,
        gain_steps=GainStepsInfo.model_validate(figures_of(steps)) if steps else None,
        sweep=sweep_stored.answer_of(verified.sweep),
        predicted_bandwidth_hz=verified.predicted_bandwidth_hz,
        measured_bandwidth_hz=verified.measured_bandwidth_hz,
        expected=FiguresInfo.model_validate(figures_of(expected)) if expected else None,
    )


def _again(again: Again) -> AgainInfo:
    lines = {
        name: None if values is None else tuple(values.tolist())
        for name, values in (
            ("frequency_hz", again.frequency_hz),
            ("closed_db", again.closed_db),
            ("closed_deg", again.closed_deg),
        )
    }
    return AgainInfo(
        predicted=FiguresInfo.model_validate(figures_of(again.predicted)),
        measured=FiguresInfo.model_validate(figures_of(again.measured)),
        outcome=again.outcome,
        gain_ratio=again.gain_ratio,
        **lines,
    )


async def run(run: Run, request: AutotuneRequest) -> AutotuneAnswer:
    """Run `autotune` for the descriptor.

    A cancellation before the result exists restores all parameters.
    """
    found = await autotune(run.axis, run.session, request.inner, run.progress, run.keep)
    try:
        after = {key: await run.axis.drive.raw(key) for key in found.before}
    except BaseException:
        await take_back(run.axis, found.before)
        raise
    return answer_of(found, after)


def reevaluate(_arrays: Arrays, _meta: Meta) -> AutotuneAnswer:
    """Not possible: a tuning has no raw data of its own; its measurements keep theirs.

    Raises:
        ValueError: always.
    """
    raise ValueError("an automatic tuning keeps no raw data of its own")


def parts(result: AutotuneAnswer) -> dict[str, ToolResult | None]:
    """The partial result that belongs to each kind of raw data."""
    return {
        "inertia": result.inertia,
        "sweep-mechanics": result.mechanics,
        "sweep-speed_loop": result.verified.sweep if result.verified else None,
        "step": result.step,
    }


def written(result: AutotuneAnswer) -> Written | None:
    """The gains and filters that were written; None where nothing was."""
    if not result.before:
        return None
    return Written(result.written or datetime.now(UTC), result.before, result.after)


TOOL = Tool(
    kind="autotune",
    title=text("autotune.title"),
    settings=AutotuneRequest,
    result=AutotuneAnswer,
    run=run,
    reevaluate=reevaluate,
    report=report,
    texts=TEXTS,
    parts=parts,
    written=written,
)
