"""Time budget of a tuning: what still fits into it. One verification is always reserved."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from backend.analysis.response.signal_path.sampling import DIRECT_SHARE
from backend.tools.measuring.repeats import Repeats
from backend.tools.thresholds import autotune_time_budget as threshold
from drivers.texts.message import Text, text

#: Note where realisations with lost samples are used without being measured again.
NOT_AGAIN = text("autotune.not-measured-again")


@dataclass
class TimeLeft:
    """Time until ``until_s`` (`time.monotonic`); ``left_out``: designs dropped for lack of it."""

    until_s: float = math.inf
    longest_s: float = 0.0
    """Duration of the longest verification so far [s]; 0 before the first."""
    left_out: int = 0
    extra_s: float = 0.0
    """Time spent on optional measurements, which only use time that is left [s]."""
    lossy: float = 0.0
    """Share of the frequency response that was measured again for lost samples, 0 to 1."""
    given_up: list[Text] = field(default_factory=list)
    """Notes on what was measured less well than possible, for lack of time."""
    raising_s: float = 0.0
    """Time reserved for raising the gain where a crossover may lie above the measured band [s]."""

    @classmethod
    def of(cls, budget_s: float, cycle_s: float | None = None) -> TimeLeft:
        """Start the budget now, for a bus with this cycle time; None: it resolves any loop."""
        time_left = cls(time.monotonic() + budget_s)
        if cycle_s is not None and DIRECT_SHARE / cycle_s < threshold.CROSSES_HZ:
            time_left.require_raising(threshold.GAIN_STEPS)
        return time_left

    def require_raising(self, steps: int) -> None:
        """Reserve time for this many raised gains."""
        self.raising_s = threshold.GAIN_STEP_S * steps

    def allows(self, optional_s: float) -> bool:
        """Whether there is time for something optional of this duration."""
        return self.until_s - self.raising_s - time.monotonic() >= optional_s

    def verifications(self) -> float:
        """How many more verifications as long as the longest fit; infinite before the first."""
        if not self.longest_s or math.isinf(self.until_s):
            return math.inf
        return math.floor(max(self.until_s - time.monotonic(), 0.0) / self.longest_s)

    def pairs(self, first_s: float, most: int, looks: int = 0) -> int:
        """Number of pairs of realisations that fit, where the first pair took ``first_s``.

        Time for ``looks`` further verifications is reserved where all of them fit.
        """
        left_s = self.until_s - self.raising_s - time.monotonic() - threshold.AROUND_S
        spare_s = looks * (first_s + threshold.AROUND_S)
        if left_s >= spare_s:
            left_s -= spare_s
        return max(0, int(min(left_s / max(first_s, 1e-3), float(most))))

    def learning(self) -> Repeats:
        """Permitted repetitions of measurements before the design; one verification must fit."""
        return Repeats(self._measured_by_s - self.lossy * threshold.LOST_S)

    def measuring(self, learning_s: float) -> Repeats:
        """Permitted repetitions of a frequency response, before ``learning_s`` for the notches."""
        return Repeats(self._measured_by_s - learning_s)

    def moving(self) -> Repeats:
        """Permitted repetitions of moves for the inertia, before the frequency response."""
        return Repeats(self._measured_by_s - threshold.SWEEP_S)

    def verifying_again(self) -> Repeats:
        """Permitted repetitions when measuring a tuned loop."""
        return Repeats(self.until_s - threshold.AROUND_S - self.raising_s)

    @property
    def _measured_by_s(self) -> float:
        """Latest time at which designing and verifying must begin [s]."""
        return self.until_s - threshold.DESIGNED_AND_VERIFIED_S - self.raising_s

    def give_up(self, what: Text) -> None:
        """Note, once each, what was not done for lack of time."""
        if what not in self.given_up:
            self.given_up.append(what)

    @contextmanager
    def extra(self) -> Iterator[None]:
        """Exclude the time spent here from the duration of a verification."""
        begun_s = time.monotonic()
        try:
            yield
        finally:
            self.extra_s += time.monotonic() - begun_s

    @contextmanager
    def verifying(self) -> Iterator[None]:
        """Measure the duration of one verification."""
        begun_s, extra_s = time.monotonic(), self.extra_s
        try:
            yield
        finally:
            took_s = time.monotonic() - begun_s - (self.extra_s - extra_s)
            # After one that fails early, the next one may take its full time.
            took_s = max(took_s, threshold.AROUND_S)
            self.longest_s = max(self.longest_s, took_s)

    def reported(self) -> Text | None:
        """Note that designs were left out for lack of time; None otherwise."""
        if not self.left_out:
            return None
        return text("autotune.designs-not-verified", count=self.left_out)
