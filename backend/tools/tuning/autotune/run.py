"""Automatic tuning: from an unknown axis to a verified one, in steps that can be cancelled.

Pre-checks, inertia, frequency response, candidates, apply, verify. What is applied stays only if
the verification meets the guaranteed goals; on every other way out the drive's parameters are
restored.
"""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, replace
from datetime import datetime

from backend.analysis.loop.design import Candidate
from backend.analysis.loop.loop_goals import LoadClass, Mark, goals_for
from backend.analysis.loop.loop_structure import Gains
from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.axis_facts import AxisFacts, read_facts
from backend.tools.measuring.interrupted import ends_all
from backend.tools.measuring.recording import cycle_s, quiet
from backend.tools.measuring.temporary import stopping_hard, temporary
from backend.tools.mechanics.inertia import evaluation as inertia_evaluation
from backend.tools.mechanics.inertia import run as inertia_tool
from backend.tools.mechanics.inertia.probe import holding_torque
from backend.tools.mechanics.inertia.result import verdict_of
from backend.tools.moving.moves.go_back import go_back
from backend.tools.moving.step import evaluate as step_evaluation
from backend.tools.thresholds import autotune_run as threshold
from backend.tools.tuning.autotune.again import (
    Again,
    Designing,
    Figures,
    expected,
    first_that_holds,
)
from backend.tools.tuning.autotune.apply import part
from backend.tools.tuning.autotune.design import gains as gain_tool
from backend.tools.tuning.autotune.design.candidates import (
    Design,
    cautious_design,
    design_for,
    plant_of,
)
from backend.tools.tuning.autotune.design.notches import Learning, learn_notches, learning_s
from backend.tools.tuning.autotune.present import Trials
from backend.tools.tuning.autotune.time_budget import NOT_AGAIN, TimeLeft
from backend.tools.tuning.autotune.verification.verify import (
    Check,
    Keep,
    Verified,
    otherwise,
    unseen,
)
from backend.tools.tuning.sweep import evaluation as sweep_evaluation
from backend.tools.tuning.sweep import run as sweep_tool
from drivers.cia402 import State
from drivers.errors import EnvelopeExceeded, NotAllowed
from drivers.texts.message import Text, joined, text

#: Note where no margins could be verified.
_BY_STEP = text("autotune.verified-by-step")
#: Note where the time did not suffice to repeat the inertia move of a swinging load.
_ONE_MOVE = text("autotune.not-moved-again")
#: Half width of a 95 % interval in standard deviations.
_CI95 = 1.96


@dataclass(frozen=True, slots=True)
class AutotuneSettings:
    """Settings: ``mark`` is the candidate to apply; ``load`` None is judged from the measurement.

    ``apply`` False ends with the table of candidates and changes nothing. After ``budget_s``
    nothing more is verified, and nothing unverified is applied.
    """

    envelope: Envelope
    mark: Mark = "balanced"
    load: LoadClass | None = None
    loop: sweep_evaluation.Loop = "auto"
    scheme: inertia_evaluation.Scheme = "free"
    ends_rev: tuple[float, float] | None = None
    apply: bool = True
    rated_torque_nm: float | None = None
    motor_inertia_kgm2: float | None = None
    budget_s: float = 60.0


@dataclass(frozen=True)
class AutotuneResult:
    """Everything measured and decided.

    ``before`` holds raw values that undo what was applied; it is empty when nothing was written,
    also when ``applied`` is the previous settings. ``tried`` states why designs were undone;
    ``notes`` what the design does without. ``cautious``: no model could be relied on. ``again``:
    the redesign of a loop whose response contradicted the prediction. ``expected`` is the
    prediction for ``applied``, read on the lines of the verification.
    """

    inertia: inertia_evaluation.InertiaOutcome
    mechanics: sweep_evaluation.SweepResult
    load: LoadClass
    candidates: tuple[Candidate, ...]
    applied: Candidate | None
    verified: Verified | None
    step: step_evaluation.StepResult | None
    before: dict[str, int]
    tried: tuple[Text, ...]
    notes: tuple[Text, ...]
    cautious: bool
    again: Again | None = None
    expected: Figures | None = None
    written: datetime | None = None
    """When the settings in force were written; their verification came after that."""


async def autotune(
    axis: Axis,
    session: CyclicSession,
    settings: AutotuneSettings,
    progress: Progress,
    keep: Keep | None = None,
) -> AutotuneResult:
    """Carry out all steps.

    Raises:
        NotAllowed: a step cannot be done or its result cannot be trusted; states which and why.
        DriveError: as in the single tools.
    """
    time_left = TimeLeft.of(settings.budget_s, cycle_s(session))
    progress(0.0, text("autotune.pre-checks", step=1, steps=6))
    facts = await _pre_checks(axis, settings)
    async with stopping_hard(axis, settings.envelope.speed_rpm):
        found = await _tuned(axis, session, settings, facts, progress, keep, time_left)
    return replace(found, notes=(*found.notes, *time_left.given_up))


async def _tuned(
    axis: Axis,
    session: CyclicSession,
    settings: AutotuneSettings,
    facts: AxisFacts,
    progress: Progress,
    keep: Keep | None,
    time_left: TimeLeft,
) -> AutotuneResult:
    """Carry out the steps that move the axis."""
    home = await axis.position_raw()
    gains = await _steady_gains(axis, session, facts)
    try:
        found = await _measured(axis, session, settings, facts, gains, progress, keep, time_left)
    except EnvelopeExceeded:
        if gains or await axis.state() in (State.FAULT, State.FAULT_REACTION):
            raise
        # It held standstill, but a motion under its own gains exceeds the envelope, mostly in
        # torque.
        gains = _soft_gains(axis, facts)
        found = await _measured(
            axis, session, settings, facts, gains, progress, keep, time_left, home
        )
    facts = sweep_evaluation.completed(facts, found.mechanics)
    progress(0.6, text("autotune.notches-gains", step=4, steps=6))
    found = _with(found, await _design(axis, session, settings, facts, found))
    if not settings.apply:
        return found
    return await apply_and_verify(axis, session, settings, facts, found, progress, keep, time_left)


async def _measured(
    axis: Axis, session: CyclicSession, settings: AutotuneSettings, facts: AxisFacts,
    gains: dict[str, int], progress: Progress, keep: Keep | None, time_left: TimeLeft,
    begun_raw: int | None = None,
) -> AutotuneResult:  # fmt: skip
    """Measure inertia, frequency response and the effect of the notches with these gains in force.

    ``begun_raw`` is the position before an earlier attempt ended elsewhere: travel counts from
    there.
    """
    async with temporary(axis, gains):
        if begun_raw is not None:
            await quiet(axis)
            await go_back(axis, session, begun_raw, settings.envelope, facts)
        moving = time_left.moving()
        outcome = await inertia_tool.inertia(
            axis,
            session,
            inertia_evaluation.InertiaSettings(
                settings.envelope,
                settings.scheme,
                settings.ends_rev,
                rated_torque_nm=settings.rated_torque_nm,
                motor_inertia_kgm2=settings.motor_inertia_kgm2,
            ),
            part(progress, 0.05, 0.3, text("autotune.inertia-and-friction", step=2, steps=6)),
            keep,
            moving,
        )
        if moving.left_out:
            time_left.give_up(_ONE_MOVE)
        _require_inertia(axis, outcome)
        how = Learning(settings.envelope, settings.loop, settings.scheme)
        playing = time_left.measuring(learning_s(axis, how, facts, outcome))
        mechanics = await sweep_tool.sweep(
            axis,
            session,
            _sweep_settings(settings, outcome),
            part(progress, 0.3, 0.5, text("autotune.frequency-response", step=3, steps=6)),
            keep,
            playing,
        )
        time_left.lossy = playing.lossy
        if playing.left_out:
            time_left.give_up(NOT_AGAIN)
        _require_torque(axis, mechanics)
        plain = await learn_notches(
            axis,
            session,
            how,
            sweep_evaluation.completed(facts, mechanics),
            outcome,
            mechanics,
            part(progress, 0.5, 0.6, text("autotune.what-notches-do", step=3, steps=6)),
            time_left,
        )
    return AutotuneResult(
        outcome,
        mechanics,
        "medium",
        (),
        None,
        None,
        None,
        {},
        (),
        () if plain is None else (plain,),
        False,
    )


async def _pre_checks(axis: Axis, settings: AutotuneSettings) -> AxisFacts:
    """Check and read what must be known before anything moves."""
    drive = axis.drive
    await axis.require_certain_scales()
    if await axis.state() in (State.FAULT, State.FAULT_REACTION):
        causes = joined(await axis.blocked_by())
        raise NotAllowed("autotune.axis-has-fault", drive=drive.name, causes=causes)
    if drive.pending:
        raise NotAllowed(
            "autotune.parameters-wait-take-effect",
            drive=drive.name,
            pending_count=len(drive.pending),
        )
    # Gains without a meaning and an unknown motor inertia are reported before the axis moves.
    if settings.apply or gain_tool.spec_of(drive).convention == "unit":
        rotor = await gain_tool.rotor_inertia(axis, settings.motor_inertia_kgm2)
        gain_tool.plan_gains(drive, Gains(1.0, 1.0, 1.0, 1.0), rotor or 1e-4, rotor)
    facts = await read_facts(axis, settings.rated_torque_nm, settings.motor_inertia_kgm2)
    if not facts.torque_known:
        raise NotAllowed("autotune.rated-torque-not-known", drive=drive.name)
    return facts


async def _steady_gains(axis: Axis, session: CyclicSession, facts: AxisFacts) -> dict[str, int]:
    """Empty where the axis holds standstill under its own gains, else soft gains as raw values."""
    try:
        await holding_torque(axis, session, facts)
    except NotAllowed as error:
        if await ends_all(axis, error):
            raise
        return _soft_gains(axis, facts)
    return {}


def _soft_gains(axis: Axis, facts: AxisFacts) -> dict[str, int]:
    """Raw values with which hardly any axis oscillates, and which still overcome friction.

    They use the motor's inertia alone where it is known: the inertia that the drive holds may be
    wrong.
    """
    rotor = facts.motor_inertia_kgm2
    hz = threshold.SOFT_HZ if rotor is None else threshold.SOFT_ALONE_HZ
    soft = Gains(0.0, 0.1 * hz, hz, hz)
    inertia = rotor or facts.drive_inertia_kgm2 or 1e-4
    return gain_tool.plan_gains(axis.drive, soft, inertia, rotor)


def _require_inertia(axis: Axis, outcome: inertia_evaluation.InertiaOutcome) -> None:
    if not outcome.result.identifiable:
        raise NotAllowed(
            "autotune.inertia-cannot-identified",
            drive=axis.drive.name,
            verdict=verdict_of(outcome.result.reasons),
        )


def _sweep_settings(
    settings: AutotuneSettings, outcome: inertia_evaluation.InertiaOutcome
) -> sweep_evaluation.SweepSettings:
    loop, inertia = settings.loop, outcome.result.inertia_kgm2
    if loop == "auto" and settings.scheme != "free":
        loop = "speed"
    return sweep_evaluation.SweepSettings(
        settings.envelope,
        loop=loop,
        rated_torque_nm=settings.rated_torque_nm,
        inertia_kgm2=inertia.value,
        inertia_deviation=(inertia.high - inertia.low) / 2.0 / _CI95 / inertia.value,
    )


def _require_torque(axis: Axis, mechanics: sweep_evaluation.SweepResult) -> None:
    if mechanics.saturated_share > threshold.SATURATED:
        raise NotAllowed(
            "autotune.torque-limit-not-commanded",
            drive=axis.drive.name,
            value=round(mechanics.saturated_share, 3),
            limit=f"{threshold.SATURATED:g}",
            saturated_share=mechanics.saturated_share,
        )


async def _design(
    axis: Axis,
    session: CyclicSession,
    settings: AutotuneSettings,
    facts: AxisFacts,
    found: AutotuneResult,
) -> Design:
    """The candidates, from the measured response.

    Raises:
        NotAllowed: not even a careful design meets its goals.
    """
    drive = axis.drive
    made = await asyncio.to_thread(
        design_for, drive, facts, found.mechanics, found.inertia.result.inertia_kgm2.value,
        settings.load, 1.0 / cycle_s(session),
    )  # fmt: skip
    if not made.candidates:
        look = joined([*found.mechanics.warnings, text("autotune.look-at-mechanics")])
        raise NotAllowed(
            "autotune.no-careful-safe-either",
            drive=drive.name,
            remedy=look,
            caution=made.caution,
            detail=look,
        )
    return made


async def apply_and_verify(
    axis: Axis, session: CyclicSession, settings: AutotuneSettings, facts: AxisFacts,
    found: AutotuneResult, progress: Progress, keep: Keep | None,
    time_left: TimeLeft | None = None,
) -> AutotuneResult:  # fmt: skip
    """Apply the wanted candidate, then more careful ones, until one meets its prediction.

    The previous settings are tried before designs that are slower than they are.

    Raises:
        NotAllowed: no candidate was verified; all parameters are as before.
        DriveError: the drive has a fault, or the link is lost.
    """
    inertia = found.inertia.result.inertia_kgm2.value
    check = Check(
        settings.envelope, facts, inertia, found.mechanics.hold, settings.rated_torque_nm,
        settings.motor_inertia_kgm2, found.inertia.result.coulomb_nm.value,
        await axis.position_raw(), speed_dropped=found.mechanics.speed_dropped,
    )  # fmt: skip
    guaranteed = goals_for(found.load, settings.mark)
    clock = time_left or TimeLeft()
    trials = Trials(axis, session, check, guaranteed, progress, keep, time_left=clock)

    def designing(mark: Mark) -> Designing:
        plant = plant_of(found.mechanics, inertia, facts, cautious=found.cautious)
        return Designing(plant, found.load, mark, found.cautious, 1.0 / cycle_s(session))

    how = designing(settings.mark)
    trials.check = replace(check, plant=how.plant)
    applied, again = await first_that_holds(trials, _order(found, settings.mark), how)
    if applied is None and not found.cautious and clock.verifications() >= 1:
        made = await asyncio.to_thread(
            cautious_design, axis.drive, facts, found.mechanics, inertia,
            1.0 / cycle_s(session), text("autotune.no-design-on-model"),
        )  # fmt: skip
        found = _with(found, made)
        how = designing("robust")
        trials.check = replace(check, plant=how.plant)
        applied, again = await first_that_holds(trials, _order(found, "robust"), how)
    if applied is None:
        raise NotAllowed(
            "autotune.no-candidate-verified",
            drive=axis.drive.name,
            detail=joined([each for each in (*trials.tried, clock.reported()) if each is not None]),
        )
    verified = applied.verified
    twice = again.reported(verified) if again else None
    said = (
        None if verified.sweep.margins else _BY_STEP,
        trials.note(applied),
        clock.reported(),
        twice,
        None if again and not again.verified_anew else otherwise(verified),
        unseen(applied.candidate.nominal.crossover_hz, verified),
    )
    if twice is not None:
        # Attached to the measurement too, for readers who see it without the tuning.
        warnings = (*verified.sweep.warnings, twice)
        verified = replace(verified, sweep=replace(verified.sweep, warnings=warnings))
    plant = again.plant if again and again.plant else how.plant
    return replace(
        found, applied=applied.candidate, verified=verified, step=verified.step,
        before=applied.before, tried=tuple(trials.tried), again=again,
        notes=(*found.notes, *(each for each in said if each is not None)),
        expected=expected(trials, applied, plant), written=applied.written,
    )  # fmt: skip


def _with(found: AutotuneResult, made: Design) -> AutotuneResult:
    """Add the candidates of a design, and the reason why they are careful."""
    notes = found.notes
    if made.caution is not None:
        notes += (text("autotune.tuned-with-caution", caution=made.caution),)
    return replace(
        found,
        load=made.load,
        candidates=made.candidates,
        cautious=made.caution is not None,
        notes=notes,
    )


def _order(found: AutotuneResult, mark: Mark) -> list[Candidate]:
    """The wanted candidate, then the more careful ones, the slowest of all last."""
    marks: tuple[Mark, ...] = ("fast", "balanced", "robust")
    wanted = marks[marks.index(mark) :]
    chosen = [next((c for c in found.candidates if m in c.marks), None) for m in wanted]
    rows = [c for c in (*chosen, *found.candidates[-1:]) if c is not None]
    return list(dict.fromkeys(rows))
