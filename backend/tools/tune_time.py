"""How long a tuning may take, and what of its verification still fits into that."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

#: Writing a design, standing still and a step, beside the measurement of the loop.
_AROUND_S = 4.0


@dataclass
class TimeLeft:
    """``until_s`` is by `time.monotonic`; ``left_out`` counts designs that it did not allow."""

    until_s: float = math.inf
    longest_s: float = 0.0
    """The longest verification so far, 0 before the first."""
    left_out: int = 0
    extra_s: float = 0.0
    """Spent on what only time that is left is spent on."""

    @classmethod
    def of(cls, budget_s: float) -> TimeLeft:
        """From now on."""
        return cls(time.monotonic() + budget_s)

    def verifications(self) -> float:
        """How many more as long as the longest fit; the first always does."""
        if not self.longest_s or math.isinf(self.until_s):
            return math.inf
        return math.floor(max(self.until_s - time.monotonic(), 0.0) / self.longest_s)

    def pairs(self, first_s: float, most: int, looks: int = 0) -> int:
        """How many pairs of realisations there is time for, where the first took ``first_s``.

        Beside so many ``looks``, further verifications, where there is time for all of them.
        """
        left_s = self.until_s - time.monotonic() - _AROUND_S
        spare_s = looks * (first_s + _AROUND_S)
        if left_s >= spare_s:
            left_s -= spare_s
        return max(0, int(min(left_s / max(first_s, 1e-3), float(most))))

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
            took_s = max(took_s, _AROUND_S)
            self.longest_s = max(self.longest_s, took_s)

    def told(self) -> str:
        """That designs were left out for their time, in words; else empty."""
        if not self.left_out:
            return ""
        designs = "one design was" if self.left_out == 1 else f"{self.left_out} designs were"
        return (
            f"{designs} not verified, so none of them was applied: the time for one tuning was "
            "used up"
        )
