"""From an unknown axis to a tuned and verified one, in named steps that all can be cancelled.

Pre-checks, inertia, frequency response, candidates, apply, verify. What is applied stays only
if the verification keeps what was promised; on every other way out the drive's parameters are
as they were before.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace

import numpy as np
import numpy.typing as npt

from backend.analysis.design import (
    Candidate,
    Gains,
    LoadClass,
    Mark,
    MeasuredPlant,
    design,
    measured_plant,
    speed_loop,
)
from backend.analysis.sampling import Hold
from backend.axis import Axis, Envelope
from backend.cyclic import CyclicSession
from backend.drive import Drive
from backend.jobs import Progress
from backend.restoring import CLEANUP_TIMEOUT_S, shielded
from backend.tools import excite, notch_effect, sweep_evaluation
from backend.tools import gains as gain_tool
from backend.tools import inertia as inertia_tool
from backend.tools import notch as notch_tool
from backend.tools import step_response as step_tool
from backend.tools import sweep as sweep_tool
from backend.tools.axis_facts import AxisFacts, read_facts
from backend.tools.notch_meaning import meaning_of, remember
from backend.tools.probe import PULLED, holding_torque
from backend.tools.recording import cycle_s
from backend.tools.temporary import put_back, temporary, write_settings
from drivers.cia402 import State
from drivers.errors import DriveError, NotAllowed

Keep = Callable[[str, dict[str, npt.NDArray[np.generic]], dict[str, object]], None]

#: Prediction and verification may differ by this much before a design is taken back.
MARGIN_DB, MARGIN_DEG, MS_RATIO = 3.0, 6.0, 1.2
#: A loop can be verified up to this share of the sample rate, so none is designed above it.
_VERIFIABLE = 0.2
#: The -3 dB point must lie below this share; the highest gain is lowered so many times for it.
_SEEN, _NARROWINGS = 0.23, 4
#: A response with more of its samples at a torque limit is none.
_SATURATED = 0.25
#: Gains that hardly any axis oscillates with, for measuring one that does with its own.
_SOFT_HZ, _SOFT_INTEGRAL_HZ, _SOFT_POSITION_1_S = 5.0, 0.5, 5.0


@dataclass(frozen=True, slots=True)
class AutotuneSettings:
    """``mark`` is the candidate to apply; ``load`` None is judged from the measurement.

    ``apply`` False ends with the table of candidates and changes nothing.
    """

    envelope: Envelope
    mark: Mark = "balanced"
    load: LoadClass | None = None
    loop: sweep_evaluation.Loop = "auto"
    scheme: inertia_tool.Scheme = "free"
    ends_rev: tuple[float, float] | None = None
    apply: bool = True
    rated_torque_nm: float | None = None
    motor_inertia_kgm2: float | None = None


@dataclass(frozen=True)
class Verified:
    """The speed loop as measured after applying, beside what was predicted."""

    sweep: sweep_evaluation.SweepResult
    predicted_bandwidth_hz: float | None
    measured_bandwidth_hz: float | None
    kept: bool
    why: str


@dataclass(frozen=True)
class AutotuneResult:
    """Everything that was measured and decided.

    ``before`` holds raw values that undo what was applied (empty when nothing was).
    """

    inertia: inertia_tool.InertiaOutcome
    mechanics: sweep_evaluation.SweepResult
    load: LoadClass
    candidates: tuple[Candidate, ...]
    applied: Candidate | None
    verified: Verified | None
    step: step_tool.StepResult | None
    before: dict[str, int]
    tried: tuple[str, ...]


async def autotune(
    axis: Axis,
    session: CyclicSession,
    settings: AutotuneSettings,
    progress: Progress,
    keep: Keep | None = None,
) -> AutotuneResult:
    """Carry out all steps.

    Raises:
        NotAllowed: a step cannot be done or its answer cannot be trusted; says which and why.
        DriveError: as the single tools.
    """
    progress(0.0, "1 of 6: pre-checks")
    facts = await _pre_checks(axis, settings)
    async with temporary(axis, await _steady_gains(axis, session, facts)):
        outcome = await inertia_tool.inertia(
            axis, session,
            inertia_tool.InertiaSettings(
                settings.envelope, settings.scheme, settings.ends_rev,
                rated_torque_nm=settings.rated_torque_nm,
                motor_inertia_kgm2=settings.motor_inertia_kgm2,
            ),
            _part(progress, 0.05, 0.3, "2 of 6: inertia and friction"), keep,
        )  # fmt: skip
        _require_inertia(axis, outcome)
        mechanics = await sweep_tool.sweep(
            axis, session, _sweep_settings(settings, outcome),
            _part(progress, 0.3, 0.5, "3 of 6: frequency response"), keep,
        )  # fmt: skip
        facts = sweep_evaluation.completed(facts, mechanics)
        plain = await _learn_notches(
            axis, session, settings, facts, outcome, mechanics,
            _part(progress, 0.5, 0.6, "3 of 6: what the drive's notches do"),
        )  # fmt: skip
    progress(0.6, "4 of 6: notches and gains")
    load, candidates = await _candidates(axis, session, settings, facts, outcome, mechanics)
    nothing = AutotuneResult(outcome, mechanics, load, candidates, None, None, None, {},
                             (plain,) if plain else ())  # fmt: skip
    if not settings.apply:
        return nothing
    return await _apply_and_verify(axis, session, settings, facts, nothing, progress, keep)


def _part(progress: Progress, low: float, high: float, step: str) -> Progress:
    """A step's own progress, shown as a part of the whole."""
    part = Progress(lambda: progress(low + (high - low) * part.fraction, f"{step}: {part.step}"))
    return part


async def _pre_checks(axis: Axis, settings: AutotuneSettings) -> AxisFacts:
    """What must be known before anything moves."""
    drive = axis.drive
    if await axis.state() in (State.FAULT, State.FAULT_REACTION):
        causes = "; ".join(await axis.blocked_by())
        raise NotAllowed(f"{drive.name}: {causes}", drive=drive.name,
                         remedy="remove the cause and reset the fault")  # fmt: skip
    if drive.pending:
        raise NotAllowed(
            f"{drive.name}: {len(drive.pending)} parameters wait to take effect",
            drive=drive.name, remedy="write the settings, or restart the drive, and try again",
        )  # fmt: skip
    spec = gain_tool.spec_of(drive)
    if spec.convention == "unit":
        gain_tool.plan_gains(drive, Gains(1.0, 1.0, 1.0, 1.0), 1e-4, 1e-4)
    facts = await read_facts(axis, settings.rated_torque_nm, settings.motor_inertia_kgm2)
    if not facts.torque_known:
        raise NotAllowed(
            f"{drive.name}: its rated torque is not known, so no gain can be computed",
            drive=drive.name, remedy="give the rated torque of the motor",
        )  # fmt: skip
    return facts


async def _steady_gains(axis: Axis, session: CyclicSession, facts: AxisFacts) -> dict[str, int]:
    """Nothing where the axis stands still under its own gains, else gains that are soft."""
    try:
        await holding_torque(axis, session, facts)
    except NotAllowed:
        if await axis.state() in (State.FAULT, State.FAULT_REACTION):
            raise
        inertia = facts.drive_inertia_kgm2 or 1e-4
        soft = Gains(0.0, _SOFT_INTEGRAL_HZ, _SOFT_POSITION_1_S, _SOFT_HZ)
        return gain_tool.plan_gains(axis.drive, soft, inertia, facts.motor_inertia_kgm2)
    return {}


def _require_inertia(axis: Axis, outcome: inertia_tool.InertiaOutcome) -> None:
    if not outcome.result.identifiable:
        raise NotAllowed(
            f"{axis.drive.name}: the inertia cannot be identified: {outcome.result.verdict}",
            drive=axis.drive.name, remedy="widen the envelope as the text says, and try again",
        )  # fmt: skip


async def _learn_notches(
    axis: Axis, session: CyclicSession, settings: AutotuneSettings, facts: AxisFacts,
    outcome: inertia_tool.InertiaOutcome, mechanics: sweep_evaluation.SweepResult,
    progress: Progress,
) -> str:  # fmt: skip
    """Measure what no manual prints, where the axis turns freely and it is worth it.

    Returns why the design goes without notches; empty where it does not.
    """
    if not notch_effect.unknown(axis.drive) or meaning_of(axis.drive) is not None:
        return ""
    if mechanics.model is None or not any(r.kind == "resonance" for r in mechanics.resonances):
        return ""
    found = outcome.result
    held = abs(found.gravity_nm.value) > PULLED * facts.rated_torque_nm
    if held or settings.scheme != "free" or settings.loop not in ("auto", "none"):
        return (
            "designed without notches: what they do is measured only on an axis that turns freely"
        )
    rigid = excite.Rigid(found.inertia_kgm2.value, found.coulomb_nm.value)
    rate = 1.0 / cycle_s(session)
    path = notch_effect.path_of(rate, facts, mechanics.hold, mechanics.delay_s)
    try:
        meaning = await notch_effect.measure_meaning(
            axis, session, settings.envelope, facts, rigid, path, progress
        )
    except NotAllowed as error:
        if await axis.state() in (State.FAULT, State.FAULT_REACTION):
            raise
        return f"designed without notches: {error.message}"
    remember(axis.drive, meaning)
    return ""


def _sweep_settings(
    settings: AutotuneSettings, outcome: inertia_tool.InertiaOutcome
) -> sweep_evaluation.SweepSettings:
    loop = settings.loop
    if loop == "auto" and settings.scheme != "free":
        loop = "speed"
    return sweep_evaluation.SweepSettings(
        settings.envelope, loop=loop, rated_torque_nm=settings.rated_torque_nm,
        inertia_kgm2=outcome.result.inertia_kgm2.value,
    )  # fmt: skip


def load_class(mechanics: sweep_evaluation.SweepResult) -> LoadClass:
    """Stiff, medium or compliant, by where the first antiresonance lies."""
    low = [r.frequency_hz for r in mechanics.resonances if r.kind == "antiresonance"]
    first = min(low, default=np.inf)
    return "compliant" if first < 80.0 else "medium" if first < 300.0 else "stiff"


async def _candidates(
    axis: Axis, session: CyclicSession, settings: AutotuneSettings, facts: AxisFacts,
    outcome: inertia_tool.InertiaOutcome, mechanics: sweep_evaluation.SweepResult,
) -> tuple[LoadClass, tuple[Candidate, ...]]:  # fmt: skip
    """The table, from the measured response."""
    if mechanics.model is None:
        raise NotAllowed(
            f"{axis.drive.name}: no model explains the frequency response, so nothing is designed",
            drive=axis.drive.name, remedy="; ".join(mechanics.warnings) or "measure again",
        )  # fmt: skip
    if mechanics.saturated_share > _SATURATED:
        raise NotAllowed(
            f"{axis.drive.name}: the torque was at its limit, or not what was commanded, for "
            f"{mechanics.saturated_share:.0%} of the measurement, so nothing is designed from it",
            drive=axis.drive.name, value=round(mechanics.saturated_share, 3),
            limit=f"{_SATURATED:g}",
            remedy="raise the drive's torque limits, or lower the envelope's torque",
        )  # fmt: skip
    load = settings.load or load_class(mechanics)
    plant = measured_plant(mechanics.frf, mechanics.model)
    candidates = await asyncio.to_thread(
        candidates_for, axis.drive, facts, plant, outcome.result.inertia_kgm2.value, load,
        1.0 / cycle_s(session),
    )  # fmt: skip
    if not candidates:
        raise NotAllowed(
            f"{axis.drive.name}: no gains meet the goals for a {load} load",
            drive=axis.drive.name, remedy="look at the mechanics first: coupling, belt, play",
        )  # fmt: skip
    return load, candidates


def candidates_for(
    drive: Drive, facts: AxisFacts, plant: MeasuredPlant, inertia_kgm2: float, load: LoadClass,
    sample_rate_hz: float | None = None,
) -> tuple[Candidate, ...]:  # fmt: skip
    """All candidates for a measured plant; with a sample rate only those that can be verified."""
    profile = drive.profile
    loops = gain_tool.loops_of(drive, facts)
    if sample_rate_hz is not None:
        highest = _VERIFIABLE * sample_rate_hz
        loops = replace(
            loops,
            highest_speed_bandwidth_hz=min(loops.highest_speed_bandwidth_hz or highest, highest),
        )
    meaning = meaning_of(drive)
    known = meaning is not None or not notch_effect.unknown(drive)
    slots = len(profile.notch.slots) if profile.notch is not None and known else 0
    table: tuple[Candidate, ...] = ()
    for _ in range(_NARROWINGS):
        table = design(
            plant, inertia_kgm2, loops, load, slots=slots,
            notch_response=lambda notch, f: notch_tool.response(profile, notch, f, meaning),
        )  # fmt: skip
        widest = max((c.bandwidth_hz or np.inf for c in table if c.marks), default=0.0)
        if sample_rate_hz is None or widest <= _SEEN * sample_rate_hz:
            break
        # Its -3 dB point lies above what this bus can see: a slower one that can be verified.
        share = max(_SEEN * sample_rate_hz / widest, 0.5)
        loops = replace(
            loops, highest_speed_bandwidth_hz=share * (loops.highest_speed_bandwidth_hz or 0.0)
        )
    return table


async def plan(
    axis: Axis, candidate: Candidate, inertia_kgm2: float, motor_inertia_kgm2: float | None = None
) -> dict[str, int]:
    """Raw values of a candidate: gains, inertia and notches."""
    rotor = await gain_tool.rotor_inertia(axis, motor_inertia_kgm2)
    raw = gain_tool.plan_gains(axis.drive, candidate.gains, inertia_kgm2, rotor)
    if axis.drive.profile.notch is not None:
        raw |= await notch_tool.plan_notches(axis.drive, candidate.notches, meaning_of(axis.drive))
    return raw


async def _apply_and_verify(
    axis: Axis, session: CyclicSession, settings: AutotuneSettings, facts: AxisFacts,
    found: AutotuneResult, progress: Progress, keep: Keep | None,
) -> AutotuneResult:  # fmt: skip
    """The wanted candidate, then more careful ones, until one keeps its promise."""
    tried = list(found.tried)
    inertia = found.inertia.result.inertia_kgm2.value
    for number, candidate in enumerate(_order(found.candidates, settings.mark)):
        progress(0.65 + 0.1 * number, "5 of 6: applying")
        raw = await plan(axis, candidate, inertia, settings.motor_inertia_kgm2)
        before = await write_settings(axis, raw)
        try:
            verified = await _verify(
                axis,
                session,
                settings,
                facts,
                candidate,
                inertia,
                found.mechanics.hold,
                progress,
                keep,
            )
            if verified.kept:
                step = await step_tool.step_response(
                    axis, session, _step_settings(settings, facts, candidate),
                    _part(progress, 0.92, 0.99, "6 of 6: step"), keep,
                )  # fmt: skip
                return replace(
                    found, applied=candidate, verified=verified, step=step, before=before,
                    tried=tuple(tried),
                )  # fmt: skip
            tried.append(verified.why)
        except DriveError as error:
            await shielded(
                lambda b=before: put_back(axis, b),  # type: ignore[misc]
                CLEANUP_TIMEOUT_S, axis.drive.name,
            )  # fmt: skip
            if await axis.state() in (State.FAULT, State.FAULT_REACTION):
                raise
            tried.append(error.message)
            continue
        except BaseException:
            await shielded(
                lambda b=before: put_back(axis, b),  # type: ignore[misc]
                CLEANUP_TIMEOUT_S, axis.drive.name,
            )  # fmt: skip
            raise
        await put_back(axis, before)
    raise NotAllowed(
        f"{axis.drive.name}: no candidate kept its promise when it was verified: "
        + "; ".join(tried),
        drive=axis.drive.name,
        remedy="all parameters are as before; measure again, or choose gains by hand",
    )


def _order(candidates: tuple[Candidate, ...], mark: Mark) -> list[Candidate]:
    """The wanted one, then those that are more careful."""
    marks: tuple[Mark, ...] = ("fast", "balanced", "robust")
    wanted = marks[marks.index(mark) :]
    found = [next((c for c in candidates if m in c.marks), None) for m in wanted]
    chosen = [c for c in found if c is not None]
    return chosen or [candidates[-1]]


async def _verify(
    axis: Axis, session: CyclicSession, settings: AutotuneSettings, facts: AxisFacts,
    candidate: Candidate, inertia: float, hold: Hold | None, progress: Progress,
    keep: Keep | None,
) -> Verified:  # fmt: skip
    """Measure the closed speed loop and compare it with the promise."""
    progress(0.7, "6 of 6: verifying that it stands still")
    await holding_torque(axis, session, facts)
    swept = await sweep_tool.sweep(
        axis, session,
        sweep_evaluation.SweepSettings(
            settings.envelope, kind="speed_loop", realisations=1, inertia_kgm2=inertia, hold=hold,
            rated_torque_nm=settings.rated_torque_nm,
        ),
        _part(progress, 0.72, 0.92, "6 of 6: measuring the tuned loop"), keep,
    )  # fmt: skip
    why = _broken_promise(candidate, swept.margins)
    width = swept.margins.get("bandwidth_hz")
    return Verified(
        swept, candidate.bandwidth_hz, width if isinstance(width, float) else None,
        not why, why,
    )  # fmt: skip


def _broken_promise(candidate: Candidate, found: dict[str, float | bool | None]) -> str:
    """Empty where the measured loop keeps what was promised, else a sentence."""
    promised = candidate.promised
    words = []
    ms, pm, gm = found.get("ms"), found.get("phase_margin_deg"), found.get("gain_margin_db")
    if not found:
        return "too few lines of the tuned loop could be measured"
    if isinstance(ms, float) and ms > promised.ms * MS_RATIO:
        words.append(f"sensitivity {ms:.2f} instead of {promised.ms:.2f}")
    if isinstance(pm, float) and pm < promised.phase_margin_deg - MARGIN_DEG:
        words.append(f"phase margin {pm:.0f}° instead of {promised.phase_margin_deg:.0f}°")
    if isinstance(gm, float) and gm < promised.gain_margin_db - MARGIN_DB:
        words.append(f"gain margin {gm:.1f} dB instead of {promised.gain_margin_db:.1f} dB")
    if not words:
        return ""
    return f"{candidate.gains.speed_bandwidth_hz:.0f} Hz: " + ", ".join(words)


def _step_settings(
    settings: AutotuneSettings, facts: AxisFacts, candidate: Candidate
) -> step_tool.StepSettings:
    """A step of speed whose first torque, gain times step, leaves half of what is permitted."""
    envelope = settings.envelope
    torque_nm = envelope.torque_percent / 100.0 * facts.rated_torque_nm
    gentle = 0.5 * torque_nm / candidate.gains.speed_nms * 60.0 / (2 * np.pi)
    size = min(100.0, 0.3 * envelope.speed_rpm, 120.0 * envelope.travel_rev, gentle)
    return step_tool.StepSettings(envelope, size=size, rated_torque_nm=settings.rated_torque_nm)


def predicted(
    drive: Drive, facts: AxisFacts, plant: MeasuredPlant, candidate: Candidate
) -> tuple[npt.NDArray[np.floating], npt.NDArray[np.complexfloating]]:
    """Open speed loop (frequency, response) of a candidate on the measured plant."""
    f = plant.frequency_hz
    fixed = gain_tool.loops_of(drive, facts).response(f)
    filters = fixed * notch_tool.combined(drive.profile, candidate.notches, f, meaning_of(drive))
    return f, speed_loop(f, plant.response(), filters, candidate.gains)


def candidate_json(candidate: Candidate) -> dict[str, object]:
    """One row of the table."""
    return asdict(candidate)


def as_json(result: AutotuneResult) -> dict[str, object]:
    """For files and pages."""
    verified = result.verified
    return {
        "inertia": inertia_tool.as_json(result.inertia),
        "mechanics": sweep_evaluation.as_json(result.mechanics),
        "load": result.load,
        "candidates": [candidate_json(c) for c in result.candidates],
        "applied": candidate_json(result.applied) if result.applied else None,
        "verified": None
        if verified is None
        else {
            "sweep": sweep_evaluation.as_json(verified.sweep),
            "predicted_bandwidth_hz": verified.predicted_bandwidth_hz,
            "measured_bandwidth_hz": verified.measured_bandwidth_hz,
        },
        "step": step_tool.as_json(result.step) if result.step else None,
        "before": result.before,
        "tried": list(result.tried),
    }
