"""Verification by measurement: whether a tuned axis meets the goals guaranteed by its design."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from backend.analysis.loop.design import Candidate
from backend.analysis.loop.loop_goals import Goals
from backend.analysis.loop.loop_verdict import LoopVerdict, Missed
from backend.analysis.loop.margins import bandwidth, open_from_closed
from backend.analysis.loop.measured_plant import MeasuredPlant
from backend.analysis.response.frf import Frf
from backend.analysis.response.signal_path.sampling import Hold
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.recording import quiet
from backend.tools.mechanics.inertia.probe import standing
from backend.tools.moving.moves.go_back import go_back
from backend.tools.moving.step import evaluate as step_evaluation
from backend.tools.moving.step.run import step_response
from backend.tools.thresholds import autotune_verify as threshold
from backend.tools.tuning.autotune.time_budget import NOT_AGAIN, TimeLeft
from backend.tools.tuning.autotune.verification.gain_steps import GainSteps, gain_steps, steps_to
from backend.tools.tuning.autotune.verification.raising import GainRaise, by_raised_gain, not_shown
from backend.tools.tuning.autotune.verification.reference import reference_for
from backend.tools.tuning.autotune.verification.verdict import (
    COHERENT,
    LINES,
    MARGIN_DB,
    MARGIN_DEG,
    MS_RATIO,
    WITHIN,
    in_words,
    misses,
    pieces,
    sharp,
    sharp_lines,
    verdicts_of,
    worst_of_paths,
)
from backend.tools.tuning.sweep import evaluation as sweep_evaluation
from backend.tools.tuning.sweep import run as sweep_tool
from drivers.errors import NotAllowed
from drivers.texts.message import Text, joined, prose, text

Keep = Callable[[str, dict[str, npt.NDArray[np.generic]], dict[str, object]], None]

MOST_PAIRS = threshold.MOST_PAIRS
LOOKS = threshold.LOOKS
HUM_PERCENT = threshold.HUM_PERCENT


class TorqueRipples(NotAllowed):
    """The torque of the standing axis oscillates by far: no response need be measured for that.

    ``rms_percent`` is the RMS of the torque, in % of rated torque.
    """

    def __init__(self, rms_percent: float) -> None:
        super().__init__("autotune.hums", rms_percent=rms_percent)
        self.rms_percent = rms_percent


@dataclass(frozen=True)
class Verified:
    """The speed loop as measured after applying, compared with its prediction.

    ``hum_percent`` is set where torque ripple at standstill is the only fault, in % of rated torque
    (RMS).
    """

    sweep: sweep_evaluation.SweepResult
    step: step_evaluation.StepResult | None
    guaranteed: Goals
    predicted_bandwidth_hz: float | None
    measured_bandwidth_hz: float | None
    kept: bool
    why: Text | None
    hum_percent: float | None = None
    every: Frf | None = None
    """Response over all realisations of the repeated measurement; None if not repeated."""
    verdict: LoopVerdict | None = None
    """Margins and the band they are known in; None without a plant to predict from."""
    share_to_show: float | None = None
    """Share of the gains with which a raised gain would show the margins, where it cannot."""
    shown: GainSteps | None = None
    """Result of raising the gain, where the measured band does not reach the last crossover."""

    @property
    def seen(self) -> Frf:
        """Best known response of the loop."""
        return self.every or self.sweep.frf


@dataclass(frozen=True)
class Check:
    """Data of the earlier measurements that the verification needs."""

    envelope: Envelope
    facts: AxisFacts
    inertia_kgm2: float
    hold: Hold | None
    rated_torque_nm: float | None
    motor_inertia_kgm2: float | None
    coulomb_nm: float | None = None
    home_raw: int | None = None
    """Position where each verification begins, wherever the one before ended."""
    pairs_before: int = 0
    """Realisations that the prediction was derived from; they must not be used to verify it."""
    speed_dropped: bool = False
    """Whether the reported speed contradicts the position, which shows the loop then."""
    plant: MeasuredPlant | None = None
    """Plant that the design was made for; unmeasured parts of the loop are predicted from it."""


async def verify(
    axis: Axis,
    session: CyclicSession,
    check: Check,
    candidate: Candidate,
    guaranteed: Goals,
    reported: tuple[Progress, Progress, Progress],
    keep: Keep | None,
    time_left: TimeLeft | None = None,
) -> Verified:
    """Check standstill, measure the closed speed loop, make a step; ``reported``: progress of each.

    The loop is measured once more, with as many pairs of realisations as ``time_left`` allows,
    where the first pair shows too little, or another bandwidth than predicted.

    Raises:
        TorqueRipples: the torque oscillates at standstill by far: nothing else was measured.
        NotAllowed: the axis does not hold standstill, or the envelope or a fault ended it.
    """
    waiting, measuring, stepping = reported
    waiting(0.0, prose(""))
    ripple = (await standing(axis, session, check.facts)).ripple_percent
    if ripple > threshold.SURELY_HUMS * HUM_PERCENT:
        raise TorqueRipples(ripple)
    if check.home_raw is not None:
        await quiet(axis)
        await go_back(axis, session, check.home_raw, check.envelope, check.facts)
    reference = await reference_for(
        axis, session, check.envelope, check.facts, check.inertia_kgm2, check.plant, candidate
    )
    settings = sweep_evaluation.SweepSettings(
        check.envelope,
        kind="speed_loop",
        realisations=1,
        inertia_kgm2=check.inertia_kgm2,
        hold=check.hold,
        pairs_before=check.pairs_before,
        rated_torque_nm=check.rated_torque_nm,
        coulomb_nm=check.coulomb_nm,
        reference_rad_s=reference.peak_rad_s if reference else None,
        reference_corner_hz=reference.corner_hz if reference else None,
        speed_dropped=check.speed_dropped,
    )
    clock = time_left or TimeLeft()
    begun_s = time.monotonic()
    again = clock.verifying_again()
    swept = await sweep_tool.sweep(axis, session, settings, measuring, keep, again)
    read = sharp_margins(swept)
    # A further verification of a redesign is worth more than a longer measurement of this loop.
    looks = LOOKS - bool(check.pairs_before) if read else 0
    took_s = time.monotonic() - begun_s
    judged = swept
    verdicts = _verdicts(axis, check, candidate, judged, None)
    verdict = _worst(verdicts)
    above = tuple(each for each in _misses(verdict, guaranteed) if by_raised_gain(each))
    known = GainRaise(axis, check.facts, check.plant, candidate, guaranteed, verdicts)
    raised_db = known.raised_to(above) if above else None
    clock.require_raising(steps_to(raised_db, known.surely_db()) if raised_db else 0)
    pairs = clock.pairs(took_s, MOST_PAIRS, looks)
    missed = worse_than(guaranteed, read)
    blurred = any(each.end == "measured" for each in _misses(verdict, guaranteed))
    blurred = blurred or (verdict is not None and sharp_lines(swept.frf) is None)
    as_predicted = _as_predicted(candidate.bandwidth_hz, _width_of(read), threshold.DOUBTED)
    every: Frf | None = None
    if (not read or blurred or not as_predicted) and pairs > 1 and not missed:
        settings = replace(settings, realisations=pairs)
        with clock.extra():
            more = await sweep_tool.sweep(axis, session, settings, measuring, keep, again)
        every = more.frf
        missed = worse_than(guaranteed, sharp_margins(more))
        if blurred and sharp_lines(more.frf) is not None:
            judged = more
            known = replace(known, verdicts=_verdicts(axis, check, candidate, judged, None))
            verdict = _worst(known.verdicts)
        swept, read = _joined(swept, read, more)
    if again.left_out:
        clock.give_up(NOT_AGAIN)
    measured = _width_of(read)
    beyond = _misses(verdict, guaranteed)
    open_above = tuple(each for each in beyond if by_raised_gain(each))
    raised_db = known.raised_to(open_above) if open_above else None
    missed = missed or in_words(tuple(each for each in beyond if each not in open_above))
    share: float | None = None
    if open_above and raised_db is None and not missed:
        # No gain that may be tried shows it.
        missed = in_words(open_above)
        share = known.share_to_show(open_above)
    why = _named(candidate, missed)
    shown: GainSteps | None = None
    step: step_evaluation.StepResult | None = None
    only_hums = False
    if why is None:
        steps = _Steps(axis, session, check, stepping, keep, stays=raised_db is not None)
        settings_of_step = _step_settings(check, candidate)
        stepped_s = time.monotonic()
        step = await steps.made(settings_of_step)
        larger = min(step_evaluation.significant_size(step), _largest_step(check, candidate))
        wanted = step.widened and larger > threshold.WORTH_A_STEP * settings_of_step.size
        # Without time for it the settling window stays as wide as the noise, and says so.
        if wanted and clock.allows(time.monotonic() - stepped_s):
            settings_of_step = replace(settings_of_step, size=larger)
            step = await steps.made(settings_of_step)
        hums, restless_why = hum(step), None if read else restless(step)
        why = _named(candidate, [each for each in (hums, restless_why) if each is not None])
        only_hums = hums is not None and restless_why is None
        if why is not None:
            await steps.back()
        elif raised_db is not None:
            shown = await steps.with_raised_gain(raised_db, known.surely_db())
            verdict = _worst(_verdicts(axis, check, candidate, judged, shown.shown_db))
            why = _named(candidate, not_shown(verdict, guaranteed, shown, open_above))
    swept = replace(swept, margins=read)
    return Verified(
        swept, step, guaranteed, candidate.bandwidth_hz, measured, why is None, why,
        hum_percent_of(step) if step is not None and only_hums else None, every, verdict, share,
        shown,
    )  # fmt: skip


@dataclass
class _Steps:
    """Steps of speed with the gains in force, each from where the first one began.

    With ``stays`` the axis stays where the last one ended, until it has to be elsewhere: steps at a
    raised gain are compared with one back as well, which then replaces a return.
    """

    axis: Axis
    session: CyclicSession
    check: Check
    progress: Progress
    keep: Keep | None
    stays: bool
    _done: list[tuple[step_evaluation.StepSettings, step_evaluation.StepResult]] = field(
        default_factory=list
    )
    _begun_raw: int | None = None
    """Where the axis has to return to, raw; None where it stands there."""

    async def made(self, settings: step_evaluation.StepSettings) -> step_evaluation.StepResult:
        """Make a step."""
        await self.back()
        if self.stays:
            self._begun_raw = await self.axis.position_raw()
        step = await step_response(
            self.axis, self.session, settings, self.progress, self.keep, self.stays
        )
        self._done.append((settings, step))
        return step

    async def back(self) -> None:
        """Return to where the steps begin."""
        if self._begun_raw is not None:
            begun, self._begun_raw = self._begun_raw, None
            await go_back(self.axis, self.session, begun, self.check.envelope, self.check.facts)

    async def with_raised_gain(self, raised_db: float, surely_db: float) -> GainSteps:
        """Raise the gain with the last step, or with a smaller one that the torque limit permits.

        A raised gain takes more torque in the same step; at the limit it shows nothing.
        """
        settings, present = self._done[-1]
        size = bearable(self.check, present, raised_db)
        if size < 1.0:
            await self.back()
            usual, before = self._done[0]
            if len(self._done) > 1 and bearable(self.check, before, raised_db) >= 1.0:
                settings, present = usual, before
            else:
                settings = replace(settings, size=size * settings.size)
                present = await self.made(settings)
        begun, self._begun_raw = self._begun_raw, None
        return await gain_steps(
            self.axis, self.session, settings, present, raised_db, self.progress,
            facts=self.check.facts, surely_db=surely_db, begun_raw=begun,
        )  # fmt: skip


def _worst(verdicts: Sequence[LoopVerdict]) -> LoopVerdict | None:
    """The worst verdict over the possible paths; None where there is none."""
    return worst_of_paths(verdicts) if verdicts else None


def _verdicts(
    axis: Axis,
    check: Check,
    candidate: Candidate,
    swept: sweep_evaluation.SweepResult,
    shown_db: float | None,
) -> tuple[LoopVerdict, ...]:
    """Verdicts on the measured loop; none where there is no plant to predict from."""
    if check.plant is None:
        return ()
    return verdicts_of(axis, check.facts, check.plant, candidate, swept.frf, check.hold, shown_db)


def _misses(verdict: LoopVerdict | None, guaranteed: Goals) -> tuple[Missed, ...]:
    return () if verdict is None else misses(verdict, guaranteed)


def sharp_margins(swept: sweep_evaluation.SweepResult) -> dict[str, float | bool | None]:
    """Margins from lines with a small standard deviation; empty where there are too few of them.

    Where the loop's response is weak against the sensor noise, a line yields no margins. Where only
    lines above the bandwidth are left, the crossover is not among them.
    """
    frf = swept.frf
    use = sharp(frf)
    if np.count_nonzero(use) < LINES:
        return {}
    f, closed = frf.frequency_hz[use], frf.response[use]
    if np.abs(closed[0]) < WITHIN:
        return {}
    found = _without_gaps(f, closed)
    if not isinstance(phase := found["phase_margin_deg"], float):
        return {}
    width = bandwidth(f, closed)
    if width.minus_3db_hz is None:
        # The -3 dB point may fall into an antiresonance, where the lines are weak.
        seen = frf.in_band & (frf.coherence > threshold.SEEN)
        width = bandwidth(frf.frequency_hz[seen], frf.response[seen])
    return {
        **found,
        # Measured in closed loop, it is stable: the distance to the critical point on either side
        # counts.
        "phase_margin_deg": abs(phase),
        "bandwidth_hz": width.minus_3db_hz,
        "bandwidth_90deg_hz": width.minus_90deg_hz,
    }


def _without_gaps(f: FloatArray, closed: ComplexArray) -> dict[str, float | bool | None]:
    """Margins on these lines; crossings between two that are far apart do not count.

    There the lines are lost in an antiresonance, whose phase may turn either way between them: a
    straight line from one to the other may pass the critical point where the loop does not.
    """
    whole = sweep_evaluation.margins_of(f, open_from_closed(closed))
    parts = [part for part in pieces(f) if f[part].size > 1]
    if len(parts) == 1 and f[parts[0]].size == f.size:
        return whole
    each = [sweep_evaluation.margins_of(f[p], open_from_closed(closed[p])) for p in parts]
    crossovers = [m["crossover_hz"] for m in each if m["crossover_hz"] is not None]
    found = whole | {"crossover_hz": crossovers[-1] if crossovers else None}
    for name, at in (("phase_margin_deg", "phase_margin_hz"), ("gain_margin_db", "gain_margin_hz")):
        least = min(
            ((abs(v), m) for m in each if isinstance(v := m[name], float)),
            key=lambda pair: pair[0],
            default=None,
        )
        found |= {name: None, at: None} if least is None else {k: least[1][k] for k in (name, at)}
    return found


def restless(step: step_evaluation.StepResult) -> Text | None:
    """Message that a loop with too few usable lines has no well-damped step either; else None."""
    found = step.step
    if found is not None and "overshoot_percent" in step_evaluation.unknown_figures(found):
        return text("autotune.few-lines-lost")
    if found is not None and found.overshoot_percent <= threshold.OVERSHOOT_PERCENT:
        return None
    return text("autotune.few-lines")


def _joined(
    first: sweep_evaluation.SweepResult,
    read: dict[str, float | bool | None],
    more: sweep_evaluation.SweepResult,
) -> tuple[sweep_evaluation.SweepResult, dict[str, float | bool | None]]:
    """A loop measured again with more realisations, and the figures read from both measurements.

    The bandwidth is that of the repeated measurement. Differences between realisations blur lines,
    so the margins of the first measurement, which reach higher, are kept where it had any.
    """
    again = sharp_margins(more)
    moved_s = first.motion_s + more.motion_s
    if not read:
        return replace(more, motion_s=moved_s), again
    widths = ("bandwidth_hz", "bandwidth_90deg_hz") if _width_of(again) else ()
    return replace(first, motion_s=moved_s), read | {name: again[name] for name in widths}


def _width_of(found: dict[str, float | bool | None]) -> float | None:
    """The bandwidth among the figures of a loop [Hz]."""
    width = found.get("bandwidth_hz")
    return width if isinstance(width, float) else None


def _as_predicted(
    predicted_hz: float | None, measured_hz: float | None, within: float = threshold.AS_PREDICTED
) -> bool:
    """Whether a bandwidth is as predicted; also True where one of them is unknown."""
    if not predicted_hz or not measured_hz:
        return True
    return abs(measured_hz / predicted_hz - 1.0) <= within


def worse_than(guaranteed: Goals, found: dict[str, float | bool | None]) -> list[Text]:
    """Messages for the figures of a measured loop that are worse than guaranteed."""
    said = []
    ms, pm, gm = found.get("ms"), found.get("phase_margin_deg"), found.get("gain_margin_db")
    if isinstance(ms, float) and ms > guaranteed.ms * MS_RATIO:
        said.append(text("autotune.sensitivity", have=ms, wanted=guaranteed.ms))
    if isinstance(pm, float) and pm < guaranteed.phase_margin_deg - MARGIN_DEG:
        wanted = guaranteed.phase_margin_deg
        said.append(text("autotune.phase-margin", have_deg=pm, wanted_deg=wanted))
    if isinstance(gm, float) and gm < guaranteed.gain_margin_db - MARGIN_DB:
        wanted = guaranteed.gain_margin_db
        said.append(text("autotune.gain-margin", have_db=gm, wanted_db=wanted))
    return said


def otherwise(verified: Verified) -> Text | None:
    """Note that the bandwidth differs from the prediction although the margins hold; else None.

    This is typical of an axis with backlash: how much of the time its gap is open depends on the
    excitation.
    """
    predicted, measured = verified.predicted_bandwidth_hz, verified.measured_bandwidth_hz
    if _as_predicted(predicted, measured):
        return None
    return text("autotune.other-bandwidth", measured_hz=measured, predicted_hz=predicted)


def unseen(last_hz: float | None, verified: Verified) -> Text | None:
    """Note that a possible crossover lies outside the verified band; None otherwise.

    Above its resonances, the motor of a compliant axis is decoupled and lighter: its loop may cross
    0 dB for the last time at a frequency that the samples of this exchange do not show.
    """
    verdict = verified.verdict
    if verdict is not None:
        gain_db = verdict.shown_gain_db
        if verdict.coverage != "gain_steps" or gain_db is None or verdict.uncovered_hz is None:
            return None
        crossover_hz, end_hz = verdict.uncovered_hz
        if end_hz == 0.0:
            code = "autotune.margins-bounded-unmeasured"
            return text(code, crossover_hz=crossover_hz, gain_db=gain_db)
        code = "autotune.margins-bounded"
        if crossover_hz < end_hz:
            code = "autotune.margins-below-bounded"
        return text(code, crossover_hz=crossover_hz, measured_hz=end_hz, gain_db=gain_db)
    frf = verified.sweep.frf
    lines = frf.frequency_hz[frf.in_band & (frf.coherence > COHERENT)]
    if not verified.sweep.margins or last_hz is None or last_hz <= np.max(lines, initial=0.0):
        return None
    top = float(np.max(lines))
    return text("autotune.margins-unseen", crossover_hz=last_hz, measured_hz=top)


def hum(step: step_evaluation.StepResult) -> Text | None:
    """Message that the torque oscillates at standstill before the step; None where it does not.

    Sensor noise causes torque ripple that rises with the gain and with the filters' bandwidth.
    """
    rms = hum_percent_of(step)
    if rms <= HUM_PERCENT:
        return None
    return text("autotune.hums", rms_percent=rms)


def hum_percent_of(step: step_evaluation.StepResult) -> float:
    """RMS of the torque before the step, without its mean, in % of rated torque.

    Of the samples that were received: interpolated ones do not oscillate.
    """
    before = step.time_s < 0.8 * step_evaluation.LEAD_S
    if step.valid is not None and np.any(before & step.valid):
        before &= step.valid
    return float(np.std(step.torque_percent[before]))


def _named(candidate: Candidate, missed: Sequence[Text]) -> Text | None:
    return of_candidate(candidate, joined(missed)) if missed else None


def of_candidate(candidate: Candidate, why: Text) -> Text:
    """A reason together with the design that it refers to."""
    width = candidate.gains.speed_bandwidth_hz
    return text("autotune.candidate", bandwidth_hz=width, why=why)


def _largest_step(check: Check, candidate: Candidate) -> float:
    """Step [rpm] whose initial torque, gain times step, uses half of the permitted torque."""
    envelope = check.envelope
    torque_nm = envelope.torque_percent / 100.0 * check.facts.rated_torque_nm
    gentle = 0.5 * torque_nm / candidate.gains.speed_nms * 60.0 / (2 * np.pi)
    return float(min(0.3 * envelope.speed_rpm, 120.0 * envelope.travel_rev, gentle))


def bearable(check: Check, step: step_evaluation.StepResult, raised_db: float) -> float:
    """Share of this step's size whose torque stays below the limit with so much more gain."""
    highest = float(np.max(np.abs(step.torque_percent), initial=0.0)) * 10 ** (raised_db / 20.0)
    limit = threshold.RAISED_TORQUE * check.envelope.torque_percent
    return limit / highest if highest > limit else 1.0


def _step_settings(check: Check, candidate: Candidate) -> step_evaluation.StepSettings:
    """Settings of the usual speed step, reduced to what the envelope allows."""
    size = min(threshold.USUAL_STEP_RPM, _largest_step(check, candidate))
    return step_evaluation.StepSettings(
        check.envelope, size=size, rated_torque_nm=check.rated_torque_nm
    )
