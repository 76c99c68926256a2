"""Speed profile of a gentle move between two positions."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def raised_cosine(distance_rev: float, duration_s: float, rate: float) -> npt.NDArray[np.float64]:
    """Speed [n] in rev/s, from 0 to 0, whose integral is ``distance_rev``.

    ``rate`` is in samples per s. The peak is twice the mean speed.
    """
    n = round(duration_s * rate)
    shape = 1.0 - np.cos(2.0 * np.pi * (np.arange(n) + 0.5) / n)
    return np.asarray(shape * distance_rev / (n / rate), np.float64)
