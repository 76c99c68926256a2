"""Redesign from the verified loop where its response contradicts the prediction.

The verification measures the axis under its operating conditions; with backlash, no measurement
without the loop can replace it. The plant that it shows is combined with the plant known before.
The design is judged again, replaced if it no longer meets its goals, and verified with new noise
realisations: a prediction is never compared with the data that it was derived from.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from backend.analysis.loop.design import Candidate
from backend.analysis.loop.loop_goals import LoadClass, Mark, goals_for
from backend.analysis.loop.loop_seen import LoopLines, seen_in_loop
from backend.analysis.loop.loop_structure import speed_loop
from backend.analysis.loop.margins import closed_from_open
from backend.analysis.loop.measured_plant import MeasuredPlant
from backend.analysis.response.frf import Frf
from backend.analysis.signals.arrays import ComplexArray, FloatArray, magnitude_db, phase_deg
from backend.tools.measuring.temporary import write_settings
from backend.tools.thresholds import autotune_again as threshold
from backend.tools.tuning.autotune.apply import Applied, first_kept, nothing_stays, take_back
from backend.tools.tuning.autotune.design.candidates import candidates_for
from backend.tools.tuning.autotune.present import Trials, judged
from backend.tools.tuning.autotune.verification.verdict import fixed_of
from backend.tools.tuning.autotune.verification.verify import (
    LOOKS,
    MOST_PAIRS,
    Verified,
    sharp_margins,
)
from drivers.texts.message import Text, joined, text

#: Outcome of the redesign. *same*: the design also holds for the plant that its loop shows, and was
#: verified again; *other*: another design replaced it; *not kept*: the second verification failed
#: and the design was undone; *none*: no design meets the goals; *time*: too little time was left;
#: *unclear*: too few lines of the loop are known.
Outcome = Literal["same", "other", "not kept", "none", "time", "unclear"]

_OUTCOMES: dict[Outcome, Text] = {
    "same": text("autotune.again-same"),
    "not kept": text("autotune.again-not-kept"),
    "none": text("autotune.again-none"),
    "time": text("autotune.again-no-time"),
    "unclear": text("autotune.again-unclear"),
}


@dataclass(frozen=True)
class Figures:
    """Figures of one loop, read on the verified lines; None where they lie outside them."""

    bandwidth_hz: float | None
    phase_margin_deg: float | None
    gain_margin_db: float | None


@dataclass(frozen=True)
class Again:
    """Comparison of the first verification with its prediction, and the outcome of the redesign.

    ``predicted`` and ``measured`` refer to the same lines, for which the axis moved for
    ``motion_s``. ``gain_ratio`` is the second design's speed gain over the first one's, None
    without a second design; ``plant`` is the plant that the second design was made for.
    ``frequency_hz``, ``closed_db`` and ``closed_deg`` [lines] are the closed loop predicted for the
    second verification.
    """

    predicted: Figures
    measured: Figures
    outcome: Outcome
    motion_s: float = 0.0
    gain_ratio: float | None = None
    plant: MeasuredPlant | None = None
    frequency_hz: FloatArray | None = None
    closed_db: FloatArray | None = None
    closed_deg: FloatArray | None = None

    @property
    def verified_anew(self) -> bool:
        """Whether a second verification was made and its result is in force."""
        return self.outcome in ("same", "other")

    def reported(self, verified: Verified) -> Text:
        """The whole comparison as a text; ``verified`` is the last verification that counts."""
        parts = [*contradictions(self.predicted, self.measured), self._outcome()]
        have, want = verified.measured_bandwidth_hz, verified.predicted_bandwidth_hz
        if self.verified_anew and have is not None and want is not None:
            parts.append(text("autotune.again-verified", have_hz=have, wanted_hz=want))
        return text("autotune.answers-otherwise", what=joined(parts))

    def _outcome(self) -> Text:
        if self.outcome == "other":
            return text("autotune.again-other", gain_ratio=self.gain_ratio)
        return _OUTCOMES[self.outcome]


@dataclass(frozen=True)
class Designing:
    """Inputs of the first design."""

    plant: MeasuredPlant
    load: LoadClass
    mark: Mark
    cautious: bool
    sample_rate_hz: float


async def first_that_holds(
    trials: Trials, order: Sequence[Candidate], how: Designing
) -> tuple[Applied | None, Again | None]:
    """Apply the first candidate that meets its prediction, redesigning from its loop if necessary.

    Returns that candidate, None where none does, and the comparison of the last redesign.

    Raises:
        DriveError: the drive has a fault, or the link is lost; nothing stays written.
    """
    reported: Again | None = None
    while order:
        applied = await trials.first(order, how.plant)
        if applied is None:
            break
        held, reported = await again(trials, applied, how)
        if held is not None:
            return held, reported
        gain = (1.0 - threshold.SAME) * applied.candidate.gains.speed_nms
        order = [row for row in order if row.gains.speed_nms < gain]
    return None, reported


async def again(
    trials: Trials, first: Applied, how: Designing
) -> tuple[Applied | None, Again | None]:
    """Where the verification contradicts the prediction: redesign from the loop, and verify again.

    Returns what is in force afterwards, and the comparison; the comparison is None where the
    prediction holds. Nothing is in force where the same design failed its second verification.

    Raises:
        DriveError: the drive has a fault, or the link is lost; nothing stays written.
    """
    if not first.before:
        return first, None  # No design was written: the axis has its previous settings.
    candidate = first.candidate
    async with nothing_stays(trials.axis, first.before):
        reported = Again(
            expected(trials, first, how.plant),
            _measured(first.verified),
            "unclear",
            first.verified.sweep.motion_s,
        )
        if not contradictions(reported.predicted, reported.measured):
            return first, None
        # If the second design fails, there must be time left for a more careful one.
        if trials.time_left.verifications() < LOOKS:
            return first, replace(reported, outcome="time")
        trials.progress(0.6, text("autotune.designing-axis-loop-shows", step=4, steps=6))
        lines = loop_lines(first.verified.seen)
        controller = _controller(trials, candidate, lines.frequency_hz)
        try:
            plant = seen_in_loop(how.plant, lines, controller)
        except ValueError:
            return first, reported
        second = await asyncio.to_thread(_designed, trials, candidate, how, plant)
    if second is None or (trials.had.slower(second) and not trials.had.slower(candidate)):
        return first, replace(reported, outcome="none")
    reported = replace(reported, gain_ratio=second.gains.speed_nms / candidate.gains.speed_nms)
    same = _alike(candidate, second)
    applied = await _in_place_of(trials, first, second, plant, fall_back=not same)
    if applied is None or applied.candidate is candidate:
        return applied, replace(reported, outcome="not kept")
    f = lines.frequency_hz
    closed = _closed(trials, second, plant, f)
    return applied, replace(
        reported,
        outcome="same" if same else "other",
        plant=plant,
        frequency_hz=f,
        closed_db=magnitude_db(closed),
        closed_deg=phase_deg(closed),
    )


def loop_lines(frf: Frf) -> LoopLines:
    """Lines of a verified loop within its band, with their standard deviations."""
    use = frf.in_band
    parts = (np.log(10.0) / 20.0 * frf.std_db[use], np.radians(frf.std_deg[use]))
    deviation = np.sqrt(0.5 * (parts[0] ** 2 + parts[1] ** 2))
    return LoopLines(frf.frequency_hz[use], frf.response[use], np.asarray(deviation))


def expected(trials: Trials, applied: Applied, plant: MeasuredPlant) -> Figures:
    """Figures that ``plant`` predicts, read in the same way and on the same lines as measured.

    The figures of a design cover the whole loop; its smallest margin may lie above those lines.
    """
    verified = applied.verified

    def read(frf: Frf) -> dict[str, float | bool | None]:
        closed = _closed(trials, applied.candidate, plant, frf.frequency_hz)
        frf = replace(frf, response=closed)
        return sharp_margins(replace(verified.sweep, frf=frf))

    found = read(verified.sweep.frf)
    if verified.every is not None:
        found = found | {"bandwidth_hz": read(verified.every).get("bandwidth_hz")}
    return _figures(found)


def _measured(verified: Verified) -> Figures:
    """Measured figures, as the verification judged them."""
    found = _figures(verified.sweep.margins)
    return replace(found, bandwidth_hz=verified.measured_bandwidth_hz)


def _figures(found: Mapping[str, float | bool | None]) -> Figures:
    def number(name: str) -> float | None:
        value = found.get(name)
        return value if isinstance(value, float) else None

    return Figures(number("bandwidth_hz"), number("phase_margin_deg"), number("gain_margin_db"))


def contradictions(predicted: Figures, measured: Figures) -> list[Text]:
    """Texts of the measured figures that differ too much from the prediction, None skipped."""
    said = []
    want, have = predicted.bandwidth_hz, measured.bandwidth_hz
    if want and have and abs(have / want - 1.0) > threshold.WIDTH:
        said.append(text("autotune.other-width", have_hz=have, wanted_hz=want))
    want, have = predicted.phase_margin_deg, measured.phase_margin_deg
    if want is not None and have is not None and abs(have - want) > threshold.DEG:
        said.append(text("autotune.other-phase-margin", have_deg=have, wanted_deg=want))
    want, have = predicted.gain_margin_db, measured.gain_margin_db
    if want is not None and have is not None and abs(have - want) > threshold.DB:
        said.append(text("autotune.other-gain-margin", have_db=have, wanted_db=want))
    return said


def _controller(trials: Trials, candidate: Candidate, frequency_hz: FloatArray) -> ComplexArray:
    """Frequency response of the whole open loop without the plant [lines]."""
    fixed = fixed_of(
        trials.axis, trials.check.facts, candidate.notches, candidate.filters, frequency_hz
    )
    return speed_loop(frequency_hz, np.ones_like(fixed), fixed, candidate.gains)


def _closed(
    trials: Trials, candidate: Candidate, plant: MeasuredPlant, frequency_hz: FloatArray
) -> ComplexArray:
    """Closed loop of a design on a plant [lines]."""
    controller = _controller(trials, candidate, frequency_hz)
    return closed_from_open(plant.on(frequency_hz).response() * controller)


def _alike(one: Candidate, other: Candidate) -> bool:
    near = abs(other.gains.speed_nms / one.gains.speed_nms - 1.0) < threshold.SAME
    return near and one.notches == other.notches and one.filters == other.filters


def _designed(
    trials: Trials, candidate: Candidate, how: Designing, plant: MeasuredPlant
) -> Candidate | None:
    """The same design if it meets its goals on both plants, else the best that does, or None.

    It was the best design for the plant as first measured; where it also holds for the second
    plant, no other is better for both.
    """
    axis, check = trials.axis, trials.check
    mark = how.mark if how.mark in candidate.marks else next(iter(candidate.marks), how.mark)
    goals = goals_for(how.load, mark).with_reserve() if candidate.marks else trials.guaranteed
    made, sound = judged(
        axis, check.facts, plant, candidate.gains, candidate.notches, candidate.filters, goals
    )
    if sound:
        return replace(made, marks=candidate.marks, phase_cost_deg=candidate.phase_cost_deg)
    # Limited to the verified bandwidth: the axis may oscillate above it.
    table = candidates_for(
        axis.drive, check.facts, plant, check.inertia_kgm2, how.load, how.sample_rate_hz,
        filters=not how.cautious, notches=not how.cautious,
        highest_hz=candidate.gains.speed_bandwidth_hz,
    )  # fmt: skip
    return next((row for row in table if mark in row.marks), None)


async def _in_place_of(
    trials: Trials, first: Applied, second: Candidate, plant: MeasuredPlant, *, fall_back: bool
) -> Applied | None:
    """Apply the second design; if it fails its verification, restore the first one or nothing.

    ``fall_back``: whether the first design may be restored; not where it equals the second.
    """
    axis = trials.axis
    async with nothing_stays(axis, first.before):
        raw = {key: await axis.drive.raw(key) for key in first.before}
    await take_back(axis, first.before)
    check = replace(trials.check, pairs_before=MOST_PAIRS, plant=plant)
    applied = await first_kept(
        axis, trials.session, check, [second], trials.guaranteed, trials.tried, trials.progress,
        trials.keep, None, trials.time_left,
    )  # fmt: skip
    if applied is None and fall_back:
        return replace(first, before=await write_settings(axis, raw))
    return applied
