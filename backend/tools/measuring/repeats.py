"""What could be measured again to know it better: always by itself, as time allows in a tuning."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass


@dataclass
class Repeats:
    """``by_s`` is by `time.monotonic`; ``left_out`` counts what it did not allow,
    ``repeated`` what was measured again, needed or not, of so many that were ``played``.

    What nothing can be evaluated without is none of this: it is measured again whatever the time.
    """

    by_s: float = math.inf
    left_out: int = 0
    played: int = 0
    repeated: int = 0

    def allow(self, takes_s: float) -> bool:
        """Whether something that takes so long ends in time; counted where it does not."""
        if time.monotonic() + takes_s <= self.by_s:
            return True
        self.left_out += 1
        return False

    @property
    def lossy(self) -> float:
        """How much of it was measured again, 0 to 1."""
        return min(self.repeated / self.played, 1.0) if self.played else 0.0
