"""Goals for a loop, and the check that it meets them for every plant that the axis may be.

Gain margin, phase margin and peak sensitivity as in Åström & Hägglund, *Advanced PID Control*
(2006), section 4.6.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from backend.analysis.signals.arrays import BoolArray, ComplexArray, FloatArray
from backend.analysis.thresholds import loop_goals as threshold

LoadClass = Literal["stiff", "medium", "compliant"]
Mark = Literal["robust", "balanced", "fast"]


@dataclass(frozen=True)
class Goals:
    """Margins that a candidate must meet in its worst case; ``ms`` is the peak sensitivity."""

    gain_margin_db: float
    phase_margin_deg: float
    ms: float

    def with_reserve(self) -> Goals:
        """Return the goals with reserve: a measurement then still shows these despite errors."""
        db, deg, factor = RESERVE
        return Goals(self.gain_margin_db + db, self.phase_margin_deg + deg, self.ms / factor)


RESERVE = threshold.RESERVE

_BALANCED: dict[LoadClass, Goals] = {
    "stiff": Goals(8.0, 45.0, 1.9),
    "medium": Goals(9.0, 48.0, 1.8),
    "compliant": Goals(10.0, 52.0, 1.7),
}


def goals_for(load: LoadClass, mark: Mark) -> Goals:
    """Return the goals of a load class: robust requires more margin, fast accepts less."""
    base = _BALANCED[load]
    if mark == "robust":
        return Goals(base.gain_margin_db + 3.0, base.phase_margin_deg + 7.0, base.ms - 0.25)
    if mark == "fast":
        return Goals(base.gain_margin_db - 2.0, base.phase_margin_deg - 8.0, base.ms + 0.3)
    return base


@dataclass(frozen=True)
class Worst:
    """The worst margins over all evaluated loops [shifts, lines]."""

    gain_margin_db: float
    phase_margin_deg: float
    ms: float
    stable: bool

    def meets(self, goals: Goals) -> bool:
        """Whether the loops are stable and every margin meets its goal."""
        return (
            self.stable
            and self.gain_margin_db >= goals.gain_margin_db
            and self.phase_margin_deg >= goals.phase_margin_deg
            and self.ms <= goals.ms
        )

    @property
    def guaranteed(self) -> Goals:
        """The guaranteed margins: these less the reserve."""
        db, deg, factor = RESERVE
        return Goals(self.gain_margin_db - db, self.phase_margin_deg - deg, self.ms * factor)


def worst_of(loops: ComplexArray) -> Worst:
    """Return the worst margins of open loops [shifts, lines] on their dense grid."""
    gain_margin, phase_margin = _gain_margin_db(loops), _phase_margin_deg(loops)
    return Worst(gain_margin, phase_margin, sensitivity_peak(loops), bool(np.all(stable(loops))))


def keeps(loops: ComplexArray, goals: Goals) -> bool:
    """Whether the worst margins of open loops [shifts, lines] meet the goals, as `Worst.meets`.

    What fails most often is evaluated first.
    """
    return (
        sensitivity_peak(loops) <= goals.ms
        and bool(np.all(stable(loops)))
        and _phase_margin_deg(loops) >= goals.phase_margin_deg
        and _gain_margin_db(loops) >= goals.gain_margin_db
    )


def _phase_margin_deg(loops: ComplexArray) -> float:
    """The smallest distance of a 0 dB crossing from -180 degrees; 90 without any."""
    over = loops.real**2 + loops.imag**2 > 1.0
    row, line = np.nonzero(over[:, 1:] != over[:, :-1])
    if not row.size:
        return 90.0
    ends = np.concatenate([loops[row, line], loops[row, line + 1]])
    return float(np.degrees(np.min(np.abs(np.angle(-ends)))))


def _gain_margin_db(loops: ComplexArray) -> float:
    """The smallest gain margin, 60 dB at most; magnitudes at -180 degrees are interpolated."""
    real, imag = loops.real, loops.imag
    above = imag > 0
    row, line = np.nonzero((above[:, 1:] != above[:, :-1]) & (real[:, 1:] < 0) & (real[:, :-1] < 0))
    if not row.size:
        return 60.0
    low, high = imag[row, line], imag[row, line + 1]
    share = low / (low - high)
    level = -(real[row, line] * (1.0 - share) + real[row, line + 1] * share)
    inside = level[level < 1.0]
    if not inside.size:
        return 60.0
    return min(60.0, float(-20.0 * np.log10(np.max(inside))))


@dataclass(frozen=True)
class Each:
    """Margins as in `Worst`, of each loop [shifts]."""

    gain_margin_db: FloatArray
    phase_margin_deg: FloatArray
    ms: FloatArray
    stable: BoolArray


def each_of(loops: ComplexArray) -> Each:
    """Return the margins of each open loop [shifts, lines], as `worst_of` of one at a time."""
    over = loops.real**2 + loops.imag**2 > 1.0
    row, line = np.nonzero(over[:, 1:] != over[:, :-1])
    phase = np.full(len(loops), np.inf)
    for at in (line, line + 1):
        np.minimum.at(phase, row, np.degrees(np.abs(np.angle(-loops[row, at]))))
    phase[np.isinf(phase)] = 90.0
    real, imag = loops.real, loops.imag
    flips = (imag[:, 1:] > 0) != (imag[:, :-1] > 0)
    row, line = np.nonzero(flips & (real[:, 1:] < 0) & (real[:, :-1] < 0))
    low, high = imag[row, line], imag[row, line + 1]
    share = low / (low - high)
    level = -(real[row, line] * (1.0 - share) + real[row, line + 1] * share)
    inside = level < 1.0
    gain = np.full(len(loops), 60.0)
    np.minimum.at(gain, row[inside], -20.0 * np.log10(level[inside]))
    peak = 1.0 / np.sqrt(np.min((1.0 + real) ** 2 + imag**2, axis=1))
    return Each(gain, phase, np.asarray(peak), stable(loops))


def sensitivity_peak(loops: ComplexArray) -> float:
    """Return Ms, the largest |1/(1 + L)| of all loops."""
    return float(1.0 / np.sqrt(np.min((1.0 + loops.real) ** 2 + loops.imag**2)))


def stable(loops: ComplexArray) -> BoolArray:
    """Apply the Nyquist criterion per row: followed from the top, 1 + L must not encircle 0."""
    real, imag = 1.0 + loops.real, loops.imag
    # Followed upwards, each passage left of the origin counts as a whole turn.
    above = imag >= 0.0
    row, line = np.nonzero(above[:, 1:] != above[:, :-1])
    side = real[row, line] * imag[row, line + 1] - imag[row, line] * real[row, line + 1]
    falls = above[row, line]
    passed = np.where(falls, side > 0.0, side < 0.0)
    turns = np.bincount(row, passed * np.where(falls, 1.0, -1.0), len(loops))
    end = np.degrees(np.arctan2(imag[:, 0], real[:, 0])) - 360.0 * turns
    return np.asarray((end > -270.0) & (end < 90.0))


#: A saturated torque acts like a reduced gain, down to this share.
_LESS_GAIN = np.geomspace(0.02, 0.9, 10)


def stable_with_less_gain(loops: ComplexArray) -> bool:
    """Whether the loops stay stable while the torque is at its limit."""
    return all(bool(np.all(stable(share * loops))) for share in _LESS_GAIN)
