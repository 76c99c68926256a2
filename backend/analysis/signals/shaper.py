"""Input shapers: impulse sequences with which a setpoint is convolved so as not to excite a mode.

ZV and ZVD after Singer and Seering (1990, J. Dyn. Sys. Meas. Control 112, 76-82), EI after
Singhose, Derezinski and Singer (1996, IEEE ICRA). Amplitudes are shares that sum to one, so that
a shaped move ends at the same position as the unshaped one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np

from backend.analysis.signals.arrays import FloatArray

Kind = Literal["zv", "zvd", "ei"]
KINDS: tuple[Kind, ...] = ("zv", "zvd", "ei")
_TURN = 2 * math.pi


@dataclass(frozen=True)
class Shaper:
    """Impulses: shares [m] that sum to one, and times [m] in s from 0 on."""

    kind: Kind
    amplitudes: tuple[float, ...]
    times_s: tuple[float, ...]

    @property
    def delay_s(self) -> float:
        """Time by which a shaped move ends later, s."""
        return self.times_s[-1]


@dataclass(frozen=True)
class Band:
    """Ranges of a mode that a prediction covers: Hz, and damping ratio."""

    frequency_hz: tuple[float, float]
    damping: tuple[float, float]


def design(kind: Kind, frequency_hz: float, damping: float, tolerance: float) -> Shaper:
    """Return the shaper of a mode; ``tolerance`` is the residual share of an EI shaper at its
    centre.

    With K = exp(-ζπ/√(1-ζ²)), the decay within half a period, the impulses of an EI shaper are (1 +
    VK)/(1 + K)², K² times that, and the rest between them. They leave the share V (0.05: 5 %) of
    the vibration, and equal those of Singhose (1 ± V)/4 without damping and those of a ZVD with V =
    0.

    Raises:
        ValueError: frequency, damping or tolerance is not that of an oscillation.
    """
    if not (frequency_hz > 0.0 and 0.0 <= damping < 1.0 and 0.0 <= tolerance < 1.0):
        raise ValueError("a shaper needs a frequency above 0 and a damping ratio below 1")
    root = math.sqrt(1.0 - damping**2)
    half_s = 0.5 / (frequency_hz * root)
    decay = math.exp(-math.pi * damping / root)
    if kind == "zv":
        shares = (1.0 / (1.0 + decay), decay / (1.0 + decay))
        return Shaper(kind, shares, (0.0, half_s))
    left = tolerance if kind == "ei" else 0.0
    first = (1.0 + left * decay) / (1.0 + decay) ** 2
    last = first * decay**2
    return Shaper(kind, (first, 1.0 - first - last, last), (0.0, half_s, 2.0 * half_s))


def residual(shaper: Shaper, frequency_hz: float, damping: float) -> float:
    """Return the residual vibration, as a share of that of the unshaped move at the same time.

    It is √(C² + S²) of Singer and Seering. Their V divides by the vibration at time 0 and so
    includes the natural decay during the shaper; this share does not.
    """
    omega = _TURN * frequency_hz
    times, shares = np.asarray(shaper.times_s), np.asarray(shaper.amplitudes)
    pole = omega * complex(damping, -math.sqrt(1.0 - damping**2))
    return float(abs(np.sum(shares * np.exp(pole * times))))


def residual_range(shaper: Shaper, band: Band) -> tuple[float, float]:
    """Return the lowest and the highest residual share of any mode within the band."""
    frequencies = np.linspace(*band.frequency_hz, 41)
    dampings = np.linspace(*band.damping, 5)
    left = [residual(shaper, float(f), float(z)) for f, z in product(frequencies, dampings)]
    return min(left), max(left)


def tolerated(
    shaper: Shaper, frequency_hz: float, damping: float, tolerance: float
) -> tuple[float, float]:
    """Return the frequencies [Hz] about a mode between which at most this share remains.

    Both equal the mode's own frequency where the shaper leaves more there already.
    """
    scale = np.geomspace(0.5, 2.0, 1401)
    kept = [residual(shaper, float(frequency_hz * each), damping) for each in scale]
    within = np.asarray(kept) <= tolerance
    low = high = scale.size // 2
    while low > 0 and within[low - 1]:
        low -= 1
    while high < scale.size - 1 and within[high + 1]:
        high += 1
    return float(frequency_hz * scale[low]), float(frequency_hz * scale[high])


def shaped(values: FloatArray, shaper: Shaper, sample_rate_hz: float) -> FloatArray:
    """Return setpoints [n] convolved with the shaper, longer by its delay, with the last value
    held.

    An impulse between two samples is split between both: at 1 kHz this attenuates 30 Hz by less
    than 0.1 %.
    """
    delays = np.asarray(shaper.times_s) * sample_rate_hz
    count = values.size + math.ceil(float(delays[-1]) - 1e-9)
    places = np.arange(count, dtype=np.float64)
    own = np.arange(values.size, dtype=np.float64)
    total = np.zeros(count)
    for share, delay in zip(shaper.amplitudes, delays, strict=True):
        total += share * np.interp(places - delay, own, values)
    return total
