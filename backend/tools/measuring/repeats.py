"""Optional repetitions of measurements: always in a single tool, as time allows in a tuning."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass


@dataclass
class Repeats:
    """Time limit for repetitions, and their count.

    ``by_s`` is on `time.monotonic`. ``left_out`` counts the repetitions that it did not allow,
    ``repeated`` those that were made, needed or not, for ``played`` measurements. A repetition
    without which nothing can be evaluated is not counted: it is always made.
    """

    by_s: float = math.inf
    left_out: int = 0
    played: int = 0
    repeated: int = 0

    def allow(self, takes_s: float) -> bool:
        """Whether something of this duration ends in time; if not, counted in ``left_out``."""
        if time.monotonic() + takes_s <= self.by_s:
            return True
        self.left_out += 1
        return False

    @property
    def lossy(self) -> float:
        """Share of the measurements that was repeated, 0 to 1."""
        return min(self.repeated / self.played, 1.0) if self.played else 0.0
