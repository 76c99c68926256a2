"""A row of the resonance table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Resonance:
    """A row of the resonance table; ``height_db`` is its local height (negative: depth).

    ``frequency_ci95_hz`` and ``damping_ci95`` are 95 % intervals; None where they are unknown.
    """

    kind: Literal["resonance", "antiresonance"]
    frequency_hz: float
    damping: float
    height_db: float
    frequency_ci95_hz: tuple[float, float] | None = None
    damping_ci95: tuple[float, float] | None = None
