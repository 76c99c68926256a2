"""Torque that a move takes under a speed loop that was not tuned for the load.

A loop that is soft for its load lags, then oscillates and takes far more torque than the move
itself. Its two gains are identified from a first short move (torque over speed error and its
integral), and a move is simulated with them before it is made.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from backend.tools.thresholds import inertia_soft_loop as threshold

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class SoftLoop:
    """Proportional gain [Nm·s/rad] and integral gain [Nm/rad] of a speed loop."""

    proportional: float
    integral: float

    def peak_nm(
        self, needed_nm: FloatArray, ahead_nm: FloatArray, inertia_kgm2: float, rate_hz: float
    ) -> float:
        """Highest torque of a move that needs ``needed_nm`` [n] to be followed exactly [Nm].

        ``ahead_nm`` [n] is sent as torque offset; the axis is assumed to be rigid.
        """
        above = [self.proportional, self.integral]
        below = [inertia_kgm2, self.proportional, self.integral]
        b, a = scipy.signal.bilinear(above, below, rate_hz)
        own = scipy.signal.lfilter(b, a, needed_nm - ahead_nm)
        return float(np.max(np.abs(own + ahead_nm)))


def soft_loop_of(
    wanted_rad_s: FloatArray,
    velocity_rad_s: FloatArray,
    torque_nm: FloatArray,
    valid: npt.NDArray[np.bool_],
    rate_hz: float,
) -> SoftLoop | None:
    """Gains that best explain the torque of a move; None where none do, as with a stiff loop."""
    error = wanted_rad_s - velocity_rad_s
    best, found = threshold.EXPLAINED, None
    for late in range(threshold.LATEST):
        seen = np.concatenate([np.zeros(late), error[: error.size - late]])
        columns = np.column_stack([seen, np.cumsum(seen) / rate_hz, np.ones(seen.size)])[valid]
        torque = torque_nm[valid]
        gains = np.linalg.lstsq(columns, torque, rcond=None)[0]
        spread = float(np.var(torque))
        share = 1.0 - float(np.var(torque - columns @ gains)) / spread if spread else 0.0
        if share > best and gains[0] > 0.0 and gains[1] >= 0.0:
            best, found = share, SoftLoop(float(gains[0]), float(gains[1]))
    return found
