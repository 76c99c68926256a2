"""How long a tuning may take, and what still fits into that: first of all one verification."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from backend.analysis.response.sampling import DIRECT_SHARE
from backend.tools.measuring.repeats import Repeats
from backend.tools.thresholds import autotune_time_budget as threshold
from drivers.texts.message import Text, text

#: Said where realisations that lost samples count as they are.
NOT_AGAIN = text("autotune.not-measured-again")


@dataclass
class TimeLeft:
    """``until_s`` is by `time.monotonic`; ``left_out`` counts designs that it did not allow."""

    until_s: float = math.inf
    longest_s: float = 0.0
    """The longest verification so far, 0 before the first."""
    left_out: int = 0
    extra_s: float = 0.0
    """Spent on what only time that is left is spent on."""
    lossy: float = 0.0
    """How much of the frequency response was measured again for lost samples, 0 to 1."""
    given_up: list[Text] = field(default_factory=list)
    """What was not measured as well as it could be."""
    raising_s: float = 0.0
    """What raising the gain in steps takes, where a loop may cross above the measured band."""

    @classmethod
    def of(cls, budget_s: float, cycle_s: float | None = None) -> TimeLeft:
        """From now on, for a bus with this cycle time; None: it shows any loop."""
        time_left = cls(time.monotonic() + budget_s)
        if cycle_s is not None and DIRECT_SHARE / cycle_s < threshold.CROSSES_HZ:
            time_left.require_raising(threshold.GAIN_STEPS)
        return time_left

    def require_raising(self, steps: int) -> None:
        """Keep time for so many raised gains."""
        self.raising_s = threshold.GAIN_STEP_S * steps

    def verifications(self) -> float:
        """How many more as long as the longest fit; the first always does."""
        if not self.longest_s or math.isinf(self.until_s):
            return math.inf
        return math.floor(max(self.until_s - time.monotonic(), 0.0) / self.longest_s)

    def pairs(self, first_s: float, most: int, looks: int = 0) -> int:
        """How many pairs of realisations there is time for, where the first took ``first_s``.

        Next to so many ``looks``, further verifications, where there is time for all of them.
        """
        left_s = self.until_s - self.raising_s - time.monotonic() - threshold.AROUND_S
        spare_s = looks * (first_s + threshold.AROUND_S)
        if left_s >= spare_s:
            left_s -= spare_s
        return max(0, int(min(left_s / max(first_s, 1e-3), float(most))))

    def learning(self) -> Repeats:
        """What may be measured before the designs, as long as one is verified in time."""
        return Repeats(self._measured_by_s - self.lossy * threshold.LOST_S)

    def measuring(self, learning_s: float) -> Repeats:
        """What of a frequency response, where learning what notches do takes so long after it."""
        return Repeats(self._measured_by_s - learning_s)

    def moving(self) -> Repeats:
        """What of moves for the inertia; the frequency response comes after them."""
        return Repeats(self._measured_by_s - threshold.SWEEP_S)

    def verifying_again(self) -> Repeats:
        """What of a tuned loop."""
        return Repeats(self.until_s - threshold.AROUND_S - self.raising_s)

    @property
    def _measured_by_s(self) -> float:
        """When designing and verifying must begin at the latest."""
        return self.until_s - threshold.DESIGNED_AND_VERIFIED_S - self.raising_s

    def give_up(self, what: Text) -> None:
        """Note once what was not done for its time."""
        if what not in self.given_up:
            self.given_up.append(what)

    @contextmanager
    def extra(self) -> Iterator[None]:
        """Counts as no part of what one verification takes."""
        begun_s = time.monotonic()
        try:
            yield
        finally:
            self.extra_s += time.monotonic() - begun_s

    @contextmanager
    def verifying(self) -> Iterator[None]:
        """Measures what one verification takes."""
        begun_s, extra_s = time.monotonic(), self.extra_s
        try:
            yield
        finally:
            took_s = time.monotonic() - begun_s - (self.extra_s - extra_s)
            # One that fails early may be followed by one that does not.
            took_s = max(took_s, threshold.AROUND_S)
            self.longest_s = max(self.longest_s, took_s)

    def reported(self) -> Text | None:
        """That designs were left out for their time; else None."""
        if not self.left_out:
            return None
        return text("autotune.designs-not-verified", count=self.left_out)
