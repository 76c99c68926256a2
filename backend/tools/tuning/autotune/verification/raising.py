"""How far to raise a loop's gain to cover the unmeasured band, and what that leaves unverified."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from backend.analysis.loop.design import Candidate
from backend.analysis.loop.loop_goals import Goals, Worst, worst_of
from backend.analysis.loop.loop_verdict import (
    WORST_DB,
    Interval,
    LoopVerdict,
    Missed,
    as_measured,
    excluding_db,
)
from backend.analysis.loop.measured_plant import MeasuredPlant
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.axes.axis.axis import Axis
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.thresholds import autotune_raising as threshold
from backend.tools.tuning.autotune.verification.gain_steps import GainSteps
from backend.tools.tuning.autotune.verification.verdict import (
    MARGIN_DB,
    MARGIN_DEG,
    MS_RATIO,
    in_words,
    loops_of,
    misses,
)
from drivers.texts.message import Text, text


def by_raised_gain(missed: Missed) -> bool:
    """Whether raising the gain can still verify it: anything outside the measured band.

    Also that a loop among the possible ones is not stable: the axis has stood and moved with its
    own, and one that is stable with more gain is none of those.
    """
    return missed.what == "coverage" or missed.end == "predicted"


def wanted_db(missed: tuple[Missed, ...], guaranteed: Goals) -> float:
    """Raise of the gain to verify [dB]; the required margin less its tolerance if uncertain."""
    if any(each.what != "coverage" for each in missed):
        return guaranteed.gain_margin_db - WORST_DB
    return min(guaranteed.gain_margin_db - threshold.NOT_SHOWN_DB, threshold.MOST_SHOWN_DB)


def raised_to(
    axis: Axis,
    facts: AxisFacts,
    plant: MeasuredPlant | None,
    candidate: Candidate,
    verdicts: Sequence[LoopVerdict],
    guaranteed: Goals,
    missed: tuple[Missed, ...],
) -> float | None:
    """By how many dB the gain is raised: as much as must be verified, or more if that is decisive.

    None where even the most that may be tried leaves loops that miss the goals.

    In a slow loop of which too few lines are significant, an extra delay of up to a whole loop
    period remains possible; with enough gain it would oscillate if it had that delay. A raise
    beyond `wanted_db` leaves `threshold.LEAST_LEFT_DB` of the design's gain margin. ``verdicts``
    are those of all possible paths of the reference: the raise excludes what misses the goals on
    each of them, also a path with all its loops.

    Raises:
        NotAllowed, ValueError: a part of the loop has no known meaning.
    """
    least = wanted_db(missed, guaranteed)
    margins = _predicted_margins(verdicts)
    if plant is None or not margins:
        return least
    f = plant.frequency_hz
    every = loops_of(axis, facts, candidate, f, plant.shifted())
    favourable_db = max(candidate.nominal.gain_margin_db or 0.0, *(each.value for each in margins))
    nominal = loops_of(axis, facts, candidate, f, plant.response())
    return _decisive_db(verdicts, f, every, nominal, guaranteed, least, favourable_db)


def _decisive_db(
    verdicts: Sequence[LoopVerdict],
    frequency_hz: FloatArray,
    loops: ComplexArray,
    nominal: ComplexArray,
    guaranteed: Goals,
    least_db: float,
    favourable_db: float,
) -> float | None:
    """The raise, from ``least_db`` on, that excludes what misses the goals; None beyond reach.

    Within reach is what leaves `threshold.LEAST_LEFT_DB` of the most favourable loop's gain margin,
    and no more than `threshold.MOST_DB`.
    """
    excludes = max(excluding_db(each, frequency_hz, loops, guaranteed) for each in verdicts)
    # A loop that would be stated must reach the goals itself, or be excluded as well.
    for each in verdicts:
        stated = worst_of(as_measured(each, frequency_hz, nominal))
        if stated.stable and not _reaches(stated, guaranteed):
            excludes = max(excludes, stated.gain_margin_db)
    if not excludes:
        return least_db
    excludes += threshold.SURELY_DB
    most = max(favourable_db - threshold.LEAST_LEFT_DB, least_db + threshold.AT_ONCE_DB)
    return None if excludes > min(most, threshold.MOST_DB) else max(least_db, excludes)


def share_to_show(
    axis: Axis,
    facts: AxisFacts,
    plant: MeasuredPlant | None,
    candidate: Candidate,
    verdicts: Sequence[LoopVerdict],
    guaranteed: Goals,
    missed: tuple[Missed, ...],
) -> float | None:
    """Largest share of a design's gains with which a raised gain would show its margins.

    Delay and gain that the measured lines leave open are those of plant and reference, and remain
    so with less gain. None where no share that is tried suffices.

    Raises:
        NotAllowed, ValueError: a part of the loop has no known meaning.
    """
    if plant is None:
        return None
    f, least_db = plant.frequency_hz, wanted_db(missed, guaranteed)
    for number in range(1, threshold.SOFTER_STEPS + 1):
        share = threshold.SOFTER**number
        less = replace(candidate, gains=candidate.gains.times(share))
        nominal = loops_of(axis, facts, less, f, plant.response())
        favourable_db = worst_of(nominal[None, :]).gain_margin_db
        every = loops_of(axis, facts, less, f, plant.shifted())
        shown = _decisive_db(verdicts, f, every, nominal, guaranteed, least_db, favourable_db)
        if shown is not None:
            return share
    return None


def _reaches(worst: Worst, guaranteed: Goals) -> bool:
    return worst.meets(
        Goals(
            guaranteed.gain_margin_db - MARGIN_DB,
            guaranteed.phase_margin_deg - MARGIN_DEG,
            guaranteed.ms * MS_RATIO,
        )
    )


def surely_db(
    axis: Axis,
    facts: AxisFacts,
    plant: MeasuredPlant | None,
    candidate: Candidate,
    verdicts: Sequence[LoopVerdict],
) -> float:
    """Up to which raise [dB] every loop that the axis may have is stable, with a reserve.

    These are all plants of the design with the delay and gain that the lines leave open, and the
    motor that decouples from its load above the measured band.

    Raises:
        NotAllowed, ValueError: a part of the loop has no known meaning.
    """
    margins = _predicted_margins(verdicts)
    if plant is None or len(margins) < len(verdicts) or not margins:
        return 0.0
    if not all(each.stable for each in verdicts):
        return 0.0
    least_db = min(each.low for each in margins)
    if facts.motor_inertia_kgm2 is None:
        # How light the motor is alone is not known.
        return 0.0
    alone = plant.motor_alone_above(facts.motor_inertia_kgm2)[None, :]
    other = worst_of(loops_of(axis, facts, candidate, plant.frequency_hz, alone))
    if not other.stable:
        return 0.0
    return max(min(least_db, other.gain_margin_db) - threshold.KEPT_BACK_DB, 0.0)


def _predicted_margins(verdicts: Sequence[LoopVerdict]) -> list[Interval]:
    """The predicted gain margins, of the paths that have one."""
    bands = [each.predicted for each in verdicts]
    return [b.gain_margin_db for b in bands if b is not None and b.gain_margin_db is not None]


def not_shown(
    verdict: LoopVerdict | None, guaranteed: Goals, shown: GainSteps, missed: tuple[Missed, ...]
) -> list[Text]:
    """What raising the gain leaves unverified outside the measured band; empty if nothing."""
    if verdict is None:
        return []
    said = in_words(misses(verdict, guaranteed))
    wanted = wanted_db(missed, guaranteed)
    if shown.shown_db < wanted - MARGIN_DB:
        crossover_hz, end_hz = verdict.uncovered_hz or (verdict.last_crossover_hz, 0.0)
        gains = {"shown_db": shown.shown_db, "wanted_db": wanted}
        if end_hz == 0.0:
            code = "autotune.crossover-unmeasured-not-shown"
            said.append(text(code, crossover_hz=crossover_hz, **gains))
        else:
            code = "autotune.crossover-not-shown"
            if crossover_hz < end_hz:
                code = "autotune.crossover-below-not-shown"
            said.append(text(code, crossover_hz=crossover_hz, measured_hz=end_hz, **gains))
    return said
