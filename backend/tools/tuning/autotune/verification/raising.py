"""How far to raise a loop's gain to cover the unmeasured band, and what that leaves unverified."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

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
from backend.analysis.signals.arrays import ComplexArray
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


@dataclass(frozen=True)
class GainRaise:
    """What is known of a loop whose gain may be raised: how far, and what that would show.

    Its methods raise NotAllowed or ValueError where a part of the loop has no known meaning.
    """

    axis: Axis
    """The axis with its drive; nothing is read or written."""
    facts: AxisFacts
    """What the drive reports of its loop, in SI units."""
    plant: MeasuredPlant | None
    """Plant (torque to speed) on its own dense lines, that the design was made for; None: not
    known, no more than what must be shown can be said."""
    candidate: Candidate
    """The design whose loop was measured: gains, notches and filters."""
    guaranteed: Goals
    """Margins [dB, degrees] and peak sensitivity that must be shown."""
    verdicts: Sequence[LoopVerdict] = ()
    """Of the measured loop, one for each possible path of its reference; empty without a plant."""

    def raised_to(self, missed: tuple[Missed, ...]) -> float | None:
        """By how many dB the gain is raised: as much as must be verified, or more if decisive.

        None where even the most that may be tried leaves loops that miss the goals; ``missed`` are
        the goals that are missed without a raise.

        In a slow loop of which too few lines are significant, an extra delay of up to a whole loop
        period remains possible; with enough gain it would oscillate if it had that delay. A raise
        beyond `wanted_db` leaves `threshold.LEAST_LEFT_DB` of the design's gain margin. The raise
        excludes what misses the goals on each possible path, also a path with all its loops.
        """
        least_db = wanted_db(missed, self.guaranteed)
        margins = self._predicted_margins
        if self.plant is None or not margins:
            return least_db
        nominal_db = self.candidate.nominal.gain_margin_db or 0.0
        favourable_db = max(nominal_db, *(each.value for each in margins))
        return self._decisive_db(self.plant, self.candidate, least_db, favourable_db)

    def share_to_show(self, missed: tuple[Missed, ...]) -> float | None:
        """Largest share of the design's gains with which a raised gain would show its margins.

        Delay and gain that the measured lines leave open are those of plant and reference, and
        remain so with less gain. None where no share that is tried suffices.
        """
        if self.plant is None:
            return None
        least_db = wanted_db(missed, self.guaranteed)
        for number in range(1, threshold.SOFTER_STEPS + 1):
            share = threshold.SOFTER**number
            less = replace(self.candidate, gains=self.candidate.gains.times(share))
            if self._decisive_db(self.plant, less, least_db) is not None:
                return share
        return None

    def surely_db(self) -> float:
        """Up to which raise [dB] every loop that the axis may have is stable, with a reserve.

        These are all plants of the design with the delay and gain that the lines leave open, and
        the motor that decouples from its load above the measured band.
        """
        margins, motor_kgm2 = self._predicted_margins, self.facts.motor_inertia_kgm2
        if self.plant is None or len(margins) < len(self.verdicts) or not margins:
            return 0.0
        if not all(each.stable for each in self.verdicts):
            return 0.0
        if motor_kgm2 is None:
            # How light the motor is alone is not known.
            return 0.0
        alone = self.plant.motor_alone_above(motor_kgm2)
        other = worst_of(self._loops(self.plant, self.candidate, alone[None, :]))
        if not other.stable:
            return 0.0
        least_db = min(each.low for each in margins)
        return max(min(least_db, other.gain_margin_db) - threshold.KEPT_BACK_DB, 0.0)

    @property
    def _predicted_margins(self) -> list[Interval]:
        """The predicted gain margins [dB], of the paths that have one."""
        bands = [each.predicted for each in self.verdicts]
        return [b.gain_margin_db for b in bands if b is not None and b.gain_margin_db is not None]

    def _loops(self, plant: MeasuredPlant, design: Candidate, plants: ComplexArray) -> ComplexArray:
        """Open loops of a design with each of these plants [..., lines of ``plant``]."""
        return loops_of(self.axis, self.facts, design, plant.frequency_hz, plants)

    def _decisive_db(
        self,
        plant: MeasuredPlant,
        design: Candidate,
        least_db: float,
        favourable_db: float | None = None,
    ) -> float | None:
        """The raise of a design, from ``least_db`` on, that excludes what misses the goals, in dB.

        None beyond reach. Within reach is what leaves `threshold.LEAST_LEFT_DB` of the most
        favourable loop's gain margin, and no more than `threshold.MOST_DB`; that margin is the
        nominal loop's where ``favourable_db`` is None.
        """
        f, guaranteed = plant.frequency_hz, self.guaranteed
        nominal = self._loops(plant, design, plant.response())
        loops = self._loops(plant, design, plant.shifted())
        if favourable_db is None:
            favourable_db = worst_of(nominal[None, :]).gain_margin_db
        excludes = max(excluding_db(each, f, loops, guaranteed) for each in self.verdicts)
        # A loop that would be stated must reach the goals itself, or be excluded as well.
        for each in self.verdicts:
            stated = worst_of(as_measured(each, f, nominal))
            if stated.stable and not _reaches(stated, guaranteed):
                excludes = max(excludes, stated.gain_margin_db)
        if not excludes:
            return least_db
        excludes += threshold.SURELY_DB
        most = max(favourable_db - threshold.LEAST_LEFT_DB, least_db + threshold.AT_ONCE_DB)
        return None if excludes > min(most, threshold.MOST_DB) else max(least_db, excludes)


def _reaches(worst: Worst, guaranteed: Goals) -> bool:
    return worst.meets(
        Goals(
            guaranteed.gain_margin_db - MARGIN_DB,
            guaranteed.phase_margin_deg - MARGIN_DEG,
            guaranteed.ms * MS_RATIO,
        )
    )


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
