"""Resonances from the levels of orders, found where order times speed meets a fixed frequency.

Each order is a sinusoidal torque whose amplitude is constant or a power of the speed; the response
to it is common to all orders. Near a mode that response is the one of a single oscillator.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from backend.analysis.signals.arrays import FloatArray, IntArray
from backend.analysis.thresholds import level_peak as threshold


@dataclass(frozen=True)
class LevelPeak:
    """A mode; ``height`` is its level relative to that at the ends of the evaluated window."""

    frequency_hz: float
    frequency_ci95_hz: tuple[float, float]
    damping: float
    height: float
    points: int
    orders: tuple[int, ...]
    """Numbers of the orders used for it."""

    def half_level_hz(self) -> tuple[float, float]:
        """Return the frequencies [Hz] between which the level may exceed half the peak."""
        width = np.sqrt(3.0) * self.damping
        low, high = self.frequency_ci95_hz
        return low * (1.0 - width), high * (1.0 + width)


@dataclass(frozen=True)
class _Points:
    """Log levels [n] at frequencies [n] of orders [n], with the weight of each point."""

    f: FloatArray
    level: FloatArray
    weight: FloatArray
    order: IntArray

    def within(self, low: float, high: float) -> _Points:
        """Return the points between two frequencies, of the orders with a significant level there.

        Weak orders are often sidebands of a strong one, which respond at the frequency of that
        order.
        """
        at = (self.f >= low) & (self.f <= high)
        highest = {
            int(k): self.level[at & (self.order == k)].max() for k in np.unique(self.order[at])
        }
        least = max(highest.values(), default=0.0) + np.log(threshold.MATTERS)
        at &= np.isin(self.order, [k for k, level in highest.items() if level >= least])
        return _Points(self.f[at], self.level[at], self.weight[at], self.order[at])

    def linear(self, centre_hz: float) -> FloatArray:
        """Return the columns for the size of each order and for the slope common to all."""
        own = (self.order[:, None] == np.unique(self.order)[None, :]).astype(float)
        return np.column_stack([own, np.log(self.f / centre_hz)])


def level_peaks(
    frequency_hz: FloatArray, amplitude: FloatArray, deviation: FloatArray, order: IntArray
) -> list[LevelPeak]:
    """Return the modes, highest first, from arrays [n]: one amplitude of one order at one speed."""
    good = np.isfinite(amplitude) & (amplitude > 0.0)
    floor = np.maximum(amplitude, deviation)
    relative = np.hypot(deviation[good] / floor[good], threshold.SCATTER)
    points = _Points(
        frequency_hz[good], np.log(floor[good]), 1.0 / relative, order[good].astype(np.int64)
    )
    found: list[LevelPeak] = []
    taken: list[float] = []
    while points.f.size and len(taken) < threshold.MOST:
        centre = _clearest(points, taken)
        if centre is None:
            break
        taken.append(centre)
        one = _described(points, centre)
        if one is None or any(
            abs(np.log(one.frequency_hz / e.frequency_hz)) < np.log(threshold.REACH) for e in found
        ):
            continue
        found.append(one)
        taken.append(one.frequency_hz)
    return sorted(found, key=lambda each: -each.height)


def _clearest(points: _Points, taken: list[float]) -> float | None:
    """Frequency at which an oscillator explains most, away from frequencies already tried."""
    grid = np.exp(np.arange(np.log(points.f.min()), np.log(points.f.max()), threshold.STEP))
    best: tuple[float, float] | None = None
    for centre in grid:
        if any(abs(np.log(centre / each)) < np.log(threshold.REACH) for each in taken):
            continue
        near = points.within(centre / threshold.REACH, centre * threshold.REACH)
        if not _enough(near, centre):
            continue
        across = _Across(near, centre)
        rss = min(
            across.rss(_oscillator(near.f, centre, damping))
            for damping in np.geomspace(*threshold.DAMPINGS, threshold.DAMPING_STEPS)
        )
        free = near.f.size - across.fitted - 2
        evidence = float(np.log(max(across.rss(0.0), 1e-12) / max(rss, 1e-12)) * free)
        if best is None or evidence > best[0]:
            best = evidence, float(centre)
    return None if best is None else best[1]


def _enough(near: _Points, centre: float) -> bool:
    """Whether there are more points than parameters, with some on both sides of the centre."""
    fitted = np.unique(near.order).size + 3
    below, above = np.count_nonzero(near.f < centre), np.count_nonzero(near.f > centre)
    return bool(
        near.f.size >= fitted + threshold.SPARE and min(below, above) >= threshold.EACH_SIDE
    )


def _described(points: _Points, about: float) -> LevelPeak | None:
    """The mode near a frequency with its interval; None where there is no mode."""
    near = points.within(about / threshold.REACH, about * threshold.REACH)
    across = _Across(near, about)
    # A mode seen from the motor has a zero beside it, near or far.
    best = min(
        (_solved(near, across, about, share) for share in threshold.ZEROS), key=lambda fit: fit.rss
    )
    free = near.f.size - across.fitted - best.parameters.size
    if free < 1:
        return None
    evidence = (across.rss(0.0) - best.rss) / best.parameters.size / max(best.rss / free, 1e-12)
    frequency, damping = (float(v) for v in np.exp(best.parameters[:2]))
    height = _height(frequency, damping, near)
    if (
        evidence < scipy.special.fdtri(best.parameters.size, free, 1.0 - threshold.CHANCE)
        or not near.f.min() < frequency < near.f.max()
        or not damping < threshold.BROAD
        or height < threshold.HEIGHT
        or not _peaked(near, frequency, damping)
    ):
        return None
    half = threshold.WIDER * float(scipy.special.stdtrit(free, 0.975)) * best.deviation(free)
    ends = (frequency * np.exp(-half), frequency * np.exp(half))
    orders = tuple(int(k) for k in np.unique(near.order))
    return LevelPeak(
        frequency, (float(ends[0]), float(ends[1])), damping, height, int(near.f.size), orders
    )


class _Across:
    """Residuals of weighted levels after fitting the orders' sizes and a common slope."""

    def __init__(self, near: _Points, centre: float) -> None:
        linear = near.linear(centre)
        self.fitted = linear.shape[1]
        self._near = near
        self._q, _ = np.linalg.qr(near.weight[:, None] * linear)

    def rest(self, shape: FloatArray | float) -> FloatArray:
        """Return the residuals [n] of the levels less this shape."""
        weighted = self._near.weight * (self._near.level - shape)
        return np.asarray(weighted - self._q @ (self._q.T @ weighted))

    def rss(self, shape: FloatArray | float) -> float:
        """Return the sum of squares of these residuals."""
        rest = self.rest(shape)
        return float(rest @ rest)


@dataclass(frozen=True)
class _Solved:
    """``parameters``: logarithms of frequency and damping of the mode, and of its zero."""

    parameters: FloatArray
    rss: float
    jacobian: FloatArray

    def deviation(self, free: int) -> float:
        """Return the standard deviation of log frequency, from the scatter of the points.

        It is never less than the weights of the points imply.
        """
        covariance = np.linalg.pinv(self.jacobian.T @ self.jacobian)
        return float(np.sqrt(covariance[0, 0] * max(self.rss / free, 1.0)))


def _solved(near: _Points, across: _Across, about: float, zero: float) -> _Solved:
    """Fit the best mode near a frequency; its zero starts at ``zero`` times that frequency."""

    def left(p: FloatArray) -> FloatArray:
        f, z, zero_f, zero_z = (float(v) for v in np.exp(p))
        return across.rest(_oscillator(near.f, f, z) - _oscillator(near.f, zero_f, zero_z))

    reach, (least, most) = np.log(threshold.REACH), np.log(threshold.DAMPINGS)
    start = np.log([about, threshold.START, zero * about, threshold.START])
    shift = np.array([np.log(about), 0.0, np.log(about), 0.0])
    low = np.array([-reach, least, -threshold.ZERO_REACH, least])
    high = np.array([reach, most, threshold.ZERO_REACH, most])
    found = scipy.optimize.least_squares(
        left, start, bounds=(shift + low, shift + high), x_scale=0.1
    )
    return _Solved(np.asarray(found.x), 2.0 * float(found.cost), np.asarray(found.jac))


def _oscillator(f: FloatArray, frequency: float, damping: float) -> FloatArray:
    """Logarithm of the level of an oscillator [n], up to its size."""
    away = f / frequency - frequency / f
    return np.asarray(-0.5 * np.log(away**2 + (2.0 * damping) ** 2))


def _peaked(near: _Points, frequency: float, damping: float) -> bool:
    """Whether an order has points on the peak itself and falls on both sides of it.

    A peak that lies between two points has not been observed.
    """
    away = np.abs(near.f / frequency - frequency / near.f)
    on = away < threshold.ON_PEAK * damping
    if np.count_nonzero(on) < threshold.ON_PEAK_POINTS:
        return False
    for order in np.unique(near.order[on]):
        own = near.order == order
        top = near.level[own & on].max() - np.log(threshold.FALLS)
        sides = (near.level[own & (near.f < frequency)], near.level[own & (near.f > frequency)])
        if all(side.size and side.min() <= top for side in sides):
            return True
    return False


def _height(frequency: float, damping: float, near: _Points) -> float:
    """Level at the mode relative to that at the ends of the window, of the oscillator alone."""
    ends = np.array([near.f.min(), near.f.max()])
    away = np.abs(ends / frequency - frequency / ends)
    return float(np.min(np.hypot(away, 2.0 * damping)) / (2.0 * damping))
