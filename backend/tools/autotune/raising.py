"""How far to raise a loop's gain to cover the unmeasured band, and what that leaves unverified."""

from __future__ import annotations

from backend.analysis.loop.design import Candidate
from backend.analysis.loop.loop_goals import Goals, worst_of
from backend.analysis.loop.loop_verdict import WORST_DB, LoopVerdict, Missed, excluding_db
from backend.analysis.loop.measured_plant import MeasuredPlant
from backend.axes.axis.axis import Axis
from backend.tools.autotune.axis_facts import AxisFacts
from backend.tools.autotune.gain_steps import GainSteps
from backend.tools.autotune.verdict import MARGIN_DB, in_words, loops_of, misses
from backend.tools.thresholds import autotune_raising as threshold
from drivers.texts.message import Text, text


def by_raised_gain(missed: Missed) -> bool:
    """Whether raising the gain can still verify it: anything outside the measured band."""
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
    verdict: LoopVerdict | None,
    guaranteed: Goals,
    missed: tuple[Missed, ...],
) -> float:
    """By how many dB the gain is raised: as much as must be verified, or more if that is decisive.

    In a slow loop of which too few lines are significant, an extra delay of up to a whole loop
    period remains possible; with enough gain it would oscillate if it had that delay. A raise
    beyond `wanted_db` leaves `threshold.KEPT_BACK_DB` of the predicted gain margin.

    Raises:
        NotAllowed, ValueError: a part of the loop has no known meaning.
    """
    least = wanted_db(missed, guaranteed)
    predicted = verdict.predicted if verdict is not None else None
    if verdict is None or plant is None or predicted is None or predicted.gain_margin_db is None:
        return least
    f = plant.frequency_hz
    every = loops_of(axis, facts, candidate, f, plant.shifted())
    excludes = excluding_db(verdict, f, every, guaranteed) + threshold.SURELY_DB
    most = max(
        predicted.gain_margin_db.value - threshold.KEPT_BACK_DB, least + threshold.AT_ONCE_DB
    )
    return excludes if least < excludes <= most else least


def surely_db(
    axis: Axis,
    facts: AxisFacts,
    plant: MeasuredPlant | None,
    candidate: Candidate,
    verdict: LoopVerdict | None,
) -> float:
    """Up to which raise [dB] every loop that the axis may have is stable, with a reserve.

    These are all plants of the design with the delay and gain that the lines leave open, and the
    motor that decouples from its load above the measured band.

    Raises:
        NotAllowed, ValueError: a part of the loop has no known meaning.
    """
    predicted = verdict.predicted if verdict is not None else None
    if plant is None or predicted is None or predicted.gain_margin_db is None:
        return 0.0
    least_db = predicted.gain_margin_db.low
    if facts.motor_inertia_kgm2 is None:
        # How light the motor is alone is not known.
        return 0.0
    alone = plant.motor_alone_above(facts.motor_inertia_kgm2)[None, :]
    other = worst_of(loops_of(axis, facts, candidate, plant.frequency_hz, alone))
    if not other.stable:
        return 0.0
    return max(min(least_db, other.gain_margin_db) - threshold.KEPT_BACK_DB, 0.0)


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
