"""Dwell at one frequency: complex response to the excitation per block, with its harmonics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from backend.analysis.signals.arrays import BoolArray, ComplexArray, FloatArray
from backend.analysis.thresholds import dwell as threshold


@dataclass(frozen=True)
class Followed:
    """Complex amplitudes [blocks, harmonics] of a signal, with the excitation as phase reference.

    The first harmonic is the excitation frequency; ``middle_s`` [blocks] is the time at the middle
    of each block, s.
    """

    blocks: ComplexArray
    middle_s: FloatArray

    def mean(self, harmonic: int = 0) -> complex:
        """Return the mean over all blocks."""
        return complex(np.mean(self.blocks[:, harmonic]))

    def half(self, harmonic: int = 0) -> float:
        """Return half the 95 % interval of the amplitude, from the scatter between blocks."""
        return self._half(harmonic, 1.0)

    def phase_half_deg(self) -> float:
        """Return half the 95 % interval of the phase, in degrees."""
        share = self._half(0, 1j) / max(abs(self.mean()), 1e-300)
        return float(np.degrees(np.arcsin(min(share, 1.0))))

    def _half(self, harmonic: int, along: complex) -> float:
        """Half the interval of the part along (1) or across (1j) the mean, blocks correlated."""
        column = self.blocks[:, harmonic]
        if column.size < 3:
            return float("inf")
        mean = complex(np.mean(column))
        axis = along * mean / max(abs(mean), 1e-300)
        away = np.real((column - mean) * np.conj(axis))
        lag = float(np.sum(away[1:] * away[:-1]) / max(float(np.sum(away**2)), 1e-300))
        lag = min(max(lag, 0.0), threshold.ALIKE)
        scatter = float(np.std(away, ddof=1)) / np.sqrt(column.size)
        wider = np.sqrt((1.0 + lag) / (1.0 - lag))
        return float(scipy.special.stdtrit(column.size - 1, 0.975) * scatter * wider)

    def noise(self, harmonic: int = 0) -> float:
        """Return the standard deviation of the mean, real and imaginary part together."""
        column = self.blocks[:, harmonic]
        power = float(np.sum(np.abs(column - np.mean(column)) ** 2))
        return float(np.sqrt(power / max(column.size - 1, 1) / max(column.size, 1)))


def followed(
    signal: FloatArray,
    valid: BoolArray,
    frequency_hz: float,
    rate_hz: float,
    first: int,
    harmonics: int,
) -> Followed:
    """Return the amplitudes in blocks of whole periods.

    ``first`` is the sample number of ``signal[0]``. Least squares with a polynomial trend in each
    block, so that slow motion and lost samples have no influence.
    """
    rows: list[ComplexArray] = []
    middle_s: list[float] = []
    for part in used_blocks(valid, frequency_hz, rate_hz, harmonics):
        good, size = valid[part], part.stop - part.start
        at = first + np.arange(part.start, part.stop)
        phase = 2 * np.pi * frequency_hz / rate_hz * at
        turning = np.outer(phase, np.arange(1, harmonics + 1))
        trend = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, size), threshold.TREND)
        columns = np.hstack([np.cos(turning), -np.sin(turning), trend])
        solved = np.linalg.lstsq(columns[good], signal[part][good], rcond=None)[0]
        middle_s.append((first + 0.5 * (part.start + part.stop)) / rate_hz)
        rows.append(solved[:harmonics] + 1j * solved[harmonics : 2 * harmonics])
    blocks = np.array(rows, np.complex128).reshape(len(rows), harmonics)
    return Followed(blocks, np.array(middle_s))


def used_blocks(
    valid: BoolArray, frequency_hz: float, rate_hz: float, harmonics: int
) -> list[slice]:
    """Return the blocks of samples [n] that `followed` evaluates; ``valid``: which are given."""
    period = rate_hz / frequency_hz
    periods = max(threshold.PERIODS, int(np.ceil(threshold.BLOCK_S * frequency_hz)))
    size = max(round(periods * period), 4 * harmonics + 8)
    count = min(valid.size // size, threshold.BLOCKS)
    size = valid.size // max(count, 1)
    parts = [slice(number * size, (number + 1) * size) for number in range(count)]
    return [part for part in parts if np.mean(valid[part]) >= threshold.ARRIVED]
