"""Loads that oscillate behind their couplings, identified from the torque of slow moves.

Seen from the motor, whose acceleration is a, a chain of inertias and springs is a rigid inertia and
one oscillator for every mode that the loads have with the motor held (the antiresonances of
the mechanics; modal decomposition of a fixed-base structure, Craig & Bampton, AIAA J. 6 (1968)
1313):

    T = J·a + Σ mᵢ·(Fᵢ(a) − a),   Fᵢ(s) = (2ζωs + ω²) / (s² + 2ζωs + ω²)

Well below ω this is J·a and a small multiple of a's second derivative, which can be a column of a
regression. At and above ω it is not: a load that oscillates freely after a ramp takes torque while
the motor turns at constant speed. Frequency and damping of such a mode are searched for; mᵢ is
linear. The motion of the motor is measured, so friction at the motor has no influence.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from backend.analysis.signals.arrays import BoolArray, FloatArray, IntArray
from backend.analysis.thresholds import load_swing as threshold


@dataclass(frozen=True)
class Swing:
    """A mode of the loads with the motor held: frequency in Hz, damping ratio."""

    frequency_hz: float
    damping: float


def lag_of_load(acceleration: FloatArray, swing: Swing, sample_rate_hz: float) -> FloatArray:
    """Return F(a) − a [n]: acceleration of the load minus that of the motor, from standstill.

    Linear interpolation between samples (first-order hold).
    """
    w = 2 * np.pi * swing.frequency_hz
    damped = 2 * swing.damping * w
    # States: displacement and velocity of the load relative to the motor, driven by the
    # acceleration.
    states = np.array([[0.0, 1.0], [-w * w, -damped]]), np.array([[0.0], [1.0]])
    reported = np.array([[w * w, damped]]), np.array([[0.0]])
    a, b, c, d, _ = scipy.signal.cont2discrete((*states, *reported), 1.0 / sample_rate_hz, "foh")
    numerator, denominator = scipy.signal.ss2tf(a, b, c, d)
    return np.asarray(scipy.signal.lfilter(numerator[0], denominator, acceleration)) - acceleration


def lag_slopes(
    acceleration: FloatArray, swing: Swing, sample_rate_hz: float
) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives [n] of `lag_of_load` by log frequency and by log damping."""

    def at(frequency: float, damping: float) -> FloatArray:
        moved = Swing(swing.frequency_hz * frequency, swing.damping * damping)
        return lag_of_load(acceleration, moved, sample_rate_hz)

    e = threshold.DIFFERENCE
    return (
        np.asarray((at(1 + e, 1.0) - at(1 - e, 1.0)) / (2 * e)),
        np.asarray((at(1.0, 1 + e) - at(1.0, 1 - e)) / (2 * e)),
    )


def find_swings(
    others: FloatArray,
    torque_nm: FloatArray,
    acceleration: FloatArray,
    keep: BoolArray,
    sample_rate_hz: float,
    highest_hz: float,
    most: int = 2,
) -> tuple[Swing, ...]:
    """Return the modes up to ``highest_hz`` that the torque [n] shows besides ``others`` [n,
    columns].

    ``others`` begins with the acceleration. A mode is accepted only if it explains half of the
    remaining residual, with an inertia that is positive and smaller than the whole.
    """
    every = max(1, int(sample_rate_hz / (threshold.PER_CYCLE * highest_hz)))
    rows = np.flatnonzero(keep)[::every]
    problem = _Problem(others[rows], torque_nm[rows], acceleration, rows, sample_rate_hz)
    found: tuple[Swing, ...] = ()
    left = problem.unexplained(found)
    while len(found) < most:
        seed = min(_grid(highest_hz), key=lambda s: problem.unexplained((*found, s)))
        better = problem.refined((*found, seed), highest_hz)
        power = problem.unexplained(better)
        if not power < threshold.WORTH * left or not problem.is_physical(better):
            break
        found, left = better, power
    return found


def _grid(highest_hz: float) -> list[Swing]:
    count = int(np.log(highest_hz / threshold.LOWEST_HZ) / np.log(threshold.STEP)) + 1
    return [
        Swing(float(f), z)
        for f in np.geomspace(threshold.LOWEST_HZ, highest_hz, count)
        for z in threshold.DAMPINGS
    ]


class _Problem:
    """Least squares in the inertias, for given frequencies and dampings."""

    def __init__(
        self,
        others: FloatArray,
        torque: FloatArray,
        acceleration: FloatArray,
        rows: IntArray,
        rate: float,
    ) -> None:
        scale = np.maximum(np.max(np.abs(others), axis=0), 1e-12)
        self._others, self._torque = others / scale, torque
        self._inertia_scale = float(scale[0])
        self._acceleration, self._rows, self._rate = acceleration, rows, rate
        self._q = np.linalg.qr(self._others)[0]
        self._rest = self._without_others(torque)

    def _without_others(self, values: FloatArray) -> FloatArray:
        return np.asarray(values - self._q @ (self._q.T @ values))

    def _columns(self, swings: tuple[Swing, ...]) -> FloatArray:
        lags = [lag_of_load(self._acceleration, s, self._rate)[self._rows] for s in swings]
        return np.column_stack(lags)

    def residual(self, swings: tuple[Swing, ...]) -> FloatArray:
        """Return the unexplained torque [rows]."""
        if not swings:
            return self._rest
        columns = self._without_others(self._columns(swings))
        x = np.linalg.lstsq(columns, self._rest, rcond=None)[0]
        return np.asarray(self._rest - columns @ x)

    def unexplained(self, swings: tuple[Swing, ...]) -> float:
        return float(np.sum(self.residual(swings) ** 2))

    def refined(self, swings: tuple[Swing, ...], highest_hz: float) -> tuple[Swing, ...]:
        """Return the nearest minimum over the logarithms of frequency and damping."""

        def of(q: FloatArray) -> tuple[Swing, ...]:
            return tuple(Swing(float(f), float(z)) for f, z in np.exp(q).reshape(-1, 2))

        start = np.log([(s.frequency_hz, s.damping) for s in swings]).ravel()
        low = np.tile(np.log([0.7 * threshold.LOWEST_HZ, threshold.LEAST_DAMPING]), len(swings))
        high = np.tile(np.log([1.3 * highest_hz, threshold.MOST_DAMPING]), len(swings))
        inside = np.clip(start, low + 1e-6, high - 1e-6)
        size = max(float(np.sqrt(np.mean(self._rest**2))), 1e-300)

        def left(q: FloatArray) -> FloatArray:
            return np.asarray(self.residual(of(q)) / size)

        best = scipy.optimize.least_squares(left, inside, bounds=(low, high), max_nfev=60)
        return of(best.x)

    def is_physical(self, swings: tuple[Swing, ...]) -> bool:
        """Return whether every inertia is positive, and their sum no more than the whole."""
        columns = self._columns(swings)
        x = np.linalg.lstsq(np.column_stack([self._others, columns]), self._torque, rcond=None)[0]
        whole = x[0] / self._inertia_scale
        masses = x[self._others.shape[1] :]
        return bool(np.all(masses > 0.0) and np.sum(masses) < 1.05 * whole)
