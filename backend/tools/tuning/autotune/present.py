"""The settings that an axis had before the tuning, as one more design: kept if none is better.

Its gains may be higher than every design's: chosen by somebody who knows the machine, or higher
than this bus could verify in a search. Their response is predicted from the same measurement, for
all variants of the plant, and then verified like any design.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from backend.analysis.loop.design import Candidate, described
from backend.analysis.loop.loop_goals import Goals, stable_with_less_gain, worst_of
from backend.analysis.loop.loop_structure import Gains, LoopFilters, speed_loop
from backend.analysis.loop.measured_plant import MeasuredPlant
from backend.analysis.loop.notch import Notch
from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.interrupted import ends_all
from backend.tools.measuring.temporary import write_settings
from backend.tools.thresholds import autotune_present as threshold
from backend.tools.tuning.autotune.apply import (
    Applied,
    first_kept,
    nothing_stays,
    stages,
    take_back,
)
from backend.tools.tuning.autotune.design import gains as gain_tool
from backend.tools.tuning.autotune.time_budget import TimeLeft
from backend.tools.tuning.autotune.verification.verdict import fixed_of
from backend.tools.tuning.autotune.verification.verify import Check, Keep, otherwise, verify
from backend.tools.tuning.notch import filters as notch_tool
from backend.tools.tuning.notch.effect import unknown
from backend.tools.tuning.notch.meaning import meaning_of
from drivers.errors import DriveError, NotAllowed
from drivers.texts.message import Text, text

_TURN = 2.0 * np.pi
#: Note where nothing was changed.
KEPT = text("autotune.kept-as-it-was")


@dataclass(frozen=True)
class Present:
    """The present loop; ``candidate`` is None where its gains or notches have no known meaning."""

    speed_nms: float | None
    candidate: Candidate | None = None
    sound: bool = False

    def slower(self, design: Candidate) -> bool:
        """Whether a design would make the axis clearly slower than it is now."""
        now, then = self.candidate and self.candidate.bandwidth_hz, design.bandwidth_hz
        if now and then and then > now:
            return False
        return (
            self.speed_nms is not None
            and design.gains.speed_nms < threshold.SLOWER * self.speed_nms
        )

    def reported(self, design: Candidate, tried: bool) -> Text | None:
        """Note that the applied design is slower than the previous settings, and why; else None."""
        if not self.slower(design) or not self.speed_nms:
            return None
        share = design.gains.speed_nms / self.speed_nms
        why = text("autotune.notches-without-meaning")
        if self.candidate is not None:
            why = text("autotune.too-little-margin")
        if tried:
            why = text("autotune.prediction-not-confirmed")
        return text("autotune.slower-than-it-was", share=share, why=why)


async def present(
    axis: Axis, facts: AxisFacts, plant: MeasuredPlant, inertia_kgm2: float, goals: Goals
) -> Present:
    """Read the present settings, and judge whether they meet these goals for all plant variants.

    Raises:
        DriveError: a parameter cannot be read.
    """
    drive = axis.drive
    now = await gain_tool.read_gains(axis, facts)
    if not now.speed_nms:
        return Present(None)
    reported = Present(now.speed_nms)
    notches = []
    if drive.profile.notch is not None:
        for slot in await notch_tool.read_notches(drive, meaning_of(drive)):
            if slot.enabled and slot.notch is None:
                return reported
            if slot.enabled and slot.notch is not None:
                notches.append(slot.notch)
    if notches and meaning_of(drive) is None and unknown(drive):
        return reported
    gains = Gains(
        now.speed_nms,
        now.integral_hz or 0.0,
        now.position_1_s or 0.0,
        now.speed_nms / (_TURN * inertia_kgm2),
    )
    try:
        candidate, sound = await asyncio.to_thread(
            judged, axis, facts, plant, gains, tuple(notches),
            LoopFilters(facts.speed_filter_hz, facts.torque_filter_hz), goals,
        )  # fmt: skip
    except (NotAllowed, ValueError):
        return reported
    return Present(now.speed_nms, candidate, sound)


def judged(
    axis: Axis,
    facts: AxisFacts,
    plant: MeasuredPlant,
    gains: Gains,
    notches: tuple[Notch, ...],
    filters: LoopFilters,
    goals: Goals,
) -> tuple[Candidate, bool]:
    """A loop as a candidate, and whether it meets the goals for all plant variants.

    Raises:
        NotAllowed, ValueError: a part of the loop has no known meaning.
    """
    f = plant.frequency_hz
    fixed = fixed_of(axis, facts, notches, filters, f)
    loops = speed_loop(f, plant.shifted(), fixed, gains)
    worst = worst_of(loops)
    candidate = described(
        f, plant.response(), fixed, gains, worst.guaranteed, notches=notches, filters=filters
    )
    return candidate, worst.meets(goals) and stable_with_less_gain(loops)


@dataclass
class Trials:
    """All verifications on one axis, in order; ``tried`` lists why candidates failed."""

    axis: Axis
    session: CyclicSession
    check: Check
    guaranteed: Goals
    progress: Progress
    keep: Keep | None
    tried: list[Text] = field(default_factory=list)
    had: Present = field(default_factory=lambda: Present(None))
    had_failed: bool = False
    time_left: TimeLeft = field(default_factory=TimeLeft)

    async def first(self, order: Sequence[Candidate], plant: MeasuredPlant) -> Applied | None:
        """Apply the first candidate that holds; keep the present settings if the rest is slower.

        ``plant`` is the plant that the designs were made for.

        Raises:
            DriveError: the drive has a fault, or the link is lost; nothing stays written.
        """
        check = self.check
        self.had = await present(self.axis, check.facts, plant, check.inertia_kgm2, self.guaranteed)
        slower = [c for c in order if self.had.slower(c)]
        applied = await self._designs([c for c in order if c not in slower], plant)
        if applied is None and slower and self.had.sound and self._may_stay():
            applied = await self._as_it_was()
        if applied is None:
            applied = await self._designs(slower, plant)
            if applied is not None and otherwise(applied.verified) and self.had.candidate:
                applied = await self._as_it_was_or(applied)
        return applied

    def _may_stay(self) -> bool:
        """Whether the previous settings can be verified: not failed before, and time is left."""
        return not self.had_failed and self.time_left.verifications() >= 1

    async def _as_it_was_or(self, slower: Applied) -> Applied:
        """Verify the previous settings after all, as the prediction was wrong for a slower design.

        A wrong prediction is no reason to reject them. They stay if they meet their prediction;
        otherwise the slower design is restored.
        """
        if not self._may_stay():
            return slower
        async with nothing_stays(self.axis, slower.before):
            raw = {key: await self.axis.drive.raw(key) for key in slower.before}
        await take_back(self.axis, slower.before)
        kept = await self._as_it_was()
        if kept is not None and kept.verified.sweep.margins:
            return kept
        self.had_failed = True
        return Applied(slower.candidate, slower.verified, await write_settings(self.axis, raw))

    async def _designs(self, rows: Sequence[Candidate], plant: MeasuredPlant) -> Applied | None:
        async def softer(candidate: Candidate, share: float) -> Candidate | None:
            gains = candidate.gains.times(share)
            made, sound = await asyncio.to_thread(
                judged, self.axis, self.check.facts, plant, gains, candidate.notches,
                candidate.filters, self.guaranteed,
            )  # fmt: skip
            return replace(made, marks=candidate.marks) if sound else None

        return await first_kept(
            self.axis, self.session, self.check, rows, self.guaranteed, self.tried, self.progress,
            self.keep, softer, self.time_left,
        )  # fmt: skip

    async def _as_it_was(self) -> Applied | None:
        """Verify the previous settings like a design; nothing is written."""
        candidate = self.had.candidate
        assert candidate is not None
        self.progress(0.65, text("autotune.faster-designs-left", step=5, steps=6))
        try:
            with self.time_left.verifying():
                verified = await verify(
                    self.axis, self.session, self.check, candidate, self.guaranteed,
                    stages(self.progress), self.keep, self.time_left,
                )  # fmt: skip
        except DriveError as error:
            if await ends_all(self.axis, error):
                raise
            self.tried.append(text("autotune.as-it-was", why=error.text))
        else:
            if verified.kept:
                return Applied(candidate, verified, {})
            self.tried.append(text("autotune.as-it-was", why=verified.why))
        self.had_failed = True
        return None

    def note(self, applied: Applied) -> Text | None:
        """Note of the result on the previous settings; None where the axis became faster."""
        if applied.candidate is self.had.candidate:
            return KEPT
        return self.had.reported(applied.candidate, self.had_failed)
