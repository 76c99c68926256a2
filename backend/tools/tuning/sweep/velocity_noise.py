"""Velocity of a recording as the drive reports it, or from its positions where less noisy.

A coarse encoder (2500 lines on DS_C) makes the reported speed noisy, while the positions are off by
a fraction of an increment at most. Noise in the speed makes the inertia of a regression too small
(errors in the variables), so the less noisy of the two is used.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from backend.analysis.signals.spectrum import power_density
from backend.tools.measuring.recording import Recording
from backend.tools.thresholds import sweep_velocity_noise as threshold

_TURN = 2 * np.pi


def velocity_without_noise(recording: Recording, cutoff_hz: float) -> npt.NDArray[np.float64]:
    """Velocity [n] in rad/s, for moves with a bandwidth below ``cutoff_hz``."""
    reported, rate = recording.velocity_rad_s, recording.sample_rate_hz
    count = np.arange(reported.size)
    good = recording.valid
    if np.count_nonzero(good) < threshold.WINDOW or not np.any(recording.position_rad):
        return reported
    position = np.interp(count, count[good], recording.position_rad[good])
    given = np.interp(count, count[good], reported[good])
    # Noise of the position, expressed as a speed at the cutoff.
    from_position = _noise(position, rate) * (_TURN * cutoff_hz) ** 2
    if from_position * threshold.CLEARLY > _noise(given, rate):
        return reported
    return np.asarray(np.gradient(position) * rate)


def _noise(signal: npt.NDArray[np.float64], rate: float) -> float:
    """Power density of white noise; the differences keep leakage of the move itself small."""
    density = power_density(np.diff(signal, 2), rate, threshold.WINDOW)
    f = density.frequency_hz / rate
    use = (f >= threshold.NOISE[0]) & (f <= threshold.NOISE[1])
    return float(np.median(density.value[use] / (2.0 * np.sin(np.pi * f[use])) ** 4))
