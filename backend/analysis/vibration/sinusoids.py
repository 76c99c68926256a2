"""Sinusoids in a recording at one constant speed, in time or in angle, with lost samples.

They are found one after the other in the spectrum of the residual, and all are fitted together, so
that gaps and neighbouring components cause no leakage.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from backend.analysis.signals.arrays import BoolArray, ComplexArray, FloatArray
from backend.analysis.thresholds import sinusoids as threshold


@dataclass(frozen=True)
class Segment:
    """One constant speed; arrays [n], ``turns`` [rev] increase from 0.

    ``speed`` and ``torque`` are without their trend, in their own units; ``valid`` is False where a
    sample was lost.
    """

    rate_hz: float
    turns: FloatArray
    speed: FloatArray
    torque: FloatArray
    valid: BoolArray

    @property
    def duration_s(self) -> float:
        """Duration of the segment."""
        return self.turns.size / self.rate_hz

    @property
    def speed_rps(self) -> float:
        """Mean speed, revolutions per second."""
        return float(self.turns[-1] - self.turns[0]) / ((self.turns.size - 1) / self.rate_hz)

    def clock(self, *, by_angle: bool) -> FloatArray:
        """Return time [n] in s, or turns over mean speed, in which an order is a frequency."""
        if by_angle:
            return np.asarray((self.turns - self.turns[0]) / self.speed_rps)
        return np.arange(self.turns.size) / self.rate_hz


@dataclass(frozen=True)
class Sinusoid:
    """One component of the speed; deviations are standard deviations.

    ``by_angle``: it repeats per angle at least as well as in time.
    """

    frequency_hz: float
    deviation_hz: float
    amplitude: float
    amplitude_deviation: float
    by_angle: bool


def about_trend(signal: FloatArray, valid: BoolArray) -> FloatArray:
    """Return the signal [n] without mean, slope and curvature, fitted to the valid samples."""
    place = np.linspace(-1.0, 1.0, signal.size)
    fit = np.polynomial.polynomial.polyfit(place[valid], signal[valid], 2)
    return np.asarray(signal - np.polynomial.polynomial.polyval(place, fit), np.float64)


def sinusoids(segment: Segment, low_hz: float, high_hz: float) -> list[Sinusoid]:
    """Return the sinusoids that exceed the noise around them, in descending order of amplitude."""
    found: list[tuple[float, bool]] = []
    clocks = {way: segment.clock(by_angle=way) for way in (True, False)}
    rest = segment.speed * segment.valid
    window = np.hanning(rest.size + 2)[1:-1] * segment.valid
    while len(found) < threshold.MOST:
        best: tuple[float, float, bool] | None = None
        for by_angle, clock in clocks.items():
            ratio, frequency = _strongest(rest * window, clock, segment, low_hz, high_hz)
            # On a tie take the angle: most components turn with the shaft.
            if best is None or ratio > 1.02 * best[0]:
                best = ratio, frequency, by_angle
        assert best is not None
        if best[0] < threshold.STANDS_OUT:
            break
        clock = clocks[best[2]]
        frequency = _refined(rest * window, clock, best[1], 1.0 / segment.duration_s)
        near = [f for f, _ in found if abs(f - frequency) < threshold.APART / segment.duration_s]
        if near:
            break
        found.append((frequency, best[2]))
        amplitudes, _ = fitted(segment, segment.speed, found)
        rest = (segment.speed - _sum(segment, found, amplitudes)) * segment.valid
    if not found:
        return []
    found = _together(segment, found)
    amplitudes, deviations = fitted(segment, segment.speed, found)
    order = np.argsort(-np.abs(amplitudes))
    per_ratio = np.sqrt(3.0) / (np.pi * segment.duration_s)
    return [
        Sinusoid(
            found[i][0],
            float(per_ratio * deviations[i] / abs(amplitudes[i])),
            float(abs(amplitudes[i])),
            float(deviations[i]),
            found[i][1],
        )
        for i in order
    ]


def _together(segment: Segment, components: list[tuple[float, bool]]) -> list[tuple[float, bool]]:
    """Refine the frequencies of all components together, without a window."""
    used, line = segment.valid.astype(float), 1.0 / segment.duration_s
    for _ in range(threshold.TOGETHER):
        amplitudes, _ = fitted(segment, segment.speed, components)
        columns = [_columns(segment, components)]
        for (hertz, by_angle), amplitude in zip(components, amplitudes, strict=True):
            clock = segment.clock(by_angle=by_angle)
            turning = amplitude * np.exp(2j * np.pi * hertz * clock)
            middle = clock - 0.5 * clock[-1]
            columns.append(np.real(2j * np.pi * middle * turning)[:, None])
        basis = np.hstack(columns) * used[:, None]
        solved = np.linalg.lstsq(basis.T @ basis, basis.T @ (segment.speed * used), rcond=None)[0]
        change = np.clip(solved[-len(components) :], -0.3 * line, 0.3 * line)
        components = [(f + float(c), way) for (f, way), c in zip(components, change, strict=True)]
    return components


def fitted(
    segment: Segment, signal: FloatArray, components: list[tuple[float, bool]]
) -> tuple[ComplexArray, FloatArray]:
    """Return complex amplitudes [k] of these (frequency in Hz, by angle), and their deviations.

    The deviation is that of the noise around each frequency, which is seldom white.
    """
    columns = _columns(segment, components)
    valid = segment.valid
    # Normal equations suffice: columns of different frequencies are nearly orthogonal.
    used = columns * valid[:, None]
    solved = np.linalg.lstsq(used.T @ used, used.T @ signal, rcond=None)[0]
    k = len(components)
    amplitudes = np.asarray(solved[:k] - 1j * solved[k : 2 * k])
    rest = (signal - columns @ solved) * valid
    window = np.hanning(rest.size + 2)[1:-1] * valid
    power = np.abs(np.fft.rfft(rest * window, 2 * rest.size)) ** 2
    noise = _noise(power) / float(np.sum(window**2))
    grid = np.arange(power.size) * segment.rate_hz / (2 * rest.size)
    variance = np.interp([f for f, _ in components], grid, noise)
    return amplitudes, np.sqrt(2.0 * variance / np.count_nonzero(valid))


def _columns(segment: Segment, components: list[tuple[float, bool]]) -> FloatArray:
    clocks = {way: segment.clock(by_angle=way) for way in (True, False)}
    phases = np.column_stack([2 * np.pi * f * clocks[way] for f, way in components])
    return np.hstack([np.cos(phases), np.sin(phases), np.ones((phases.shape[0], 1))])


def _sum(
    segment: Segment, components: list[tuple[float, bool]], amplitudes: ComplexArray
) -> FloatArray:
    columns = _columns(segment, components)
    weights = np.concatenate([amplitudes.real, -amplitudes.imag, [0.0]])
    return np.asarray(columns @ weights)


def _noise(power: FloatArray) -> FloatArray:
    """Mean power [lines] of the noise, from the median of the neighbouring lines."""
    width = min(threshold.AROUND, power.size)
    middle = scipy.ndimage.median_filter(power, width, mode="nearest")
    return np.asarray(np.maximum(middle / np.log(2.0), 1e-300))


def _strongest(
    signal: FloatArray, clock: FloatArray, segment: Segment, low_hz: float, high_hz: float
) -> tuple[float, float]:
    """Highest ratio to the noise around it, and its frequency; ``clock`` may be uneven."""
    even = np.linspace(clock[0], clock[-1], clock.size)
    # Interpolated on an even grid for the search only; the fit uses the samples themselves.
    warped = np.interp(even, clock, signal) if np.max(np.abs(even - clock)) > 1e-6 else signal
    size = 2 * warped.size
    power = np.abs(np.fft.rfft(warped, size)) ** 2
    grid = np.arange(power.size) * segment.rate_hz / size
    inside = (grid >= low_hz) & (grid <= high_hz)
    if not np.any(inside):
        return 0.0, low_hz
    ratio = np.where(inside, power / _noise(power), 0.0)
    at = int(np.argmax(ratio))
    return float(ratio[at]), float(grid[at])


def _refined(signal: FloatArray, clock: FloatArray, frequency_hz: float, line_hz: float) -> float:
    def lost(hz: float) -> float:
        return -float(abs(signal @ np.exp(-2j * np.pi * hz * clock)))

    ends = (max(frequency_hz - line_hz, 1e-3), frequency_hz + line_hz)
    found = scipy.optimize.minimize_scalar(
        lost, bounds=ends, method="bounded", options={"xatol": 1e-4 * line_hz}
    )
    return float(found.x)
