"""Torque and speed of a machine's cycle: its period, effective torque, power and overload.

Samples are uneven in time, as polling gives them. Between two samples torque and speed are
interpolated linearly; longer gaps are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from backend.analysis.thresholds import duty_load as threshold

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
_RAD_S = 2.0 * np.pi / 60.0


@dataclass(frozen=True)
class Signals:
    """Arrays [n]: time in s (rising), torque in % of rated, speed in rpm."""

    time_s: FloatArray
    torque_percent: FloatArray
    speed_rpm: FloatArray

    @property
    def spacing_s(self) -> float:
        """Median time between two samples, s."""
        return float(np.median(np.diff(self.time_s)))

    @property
    def duration_s(self) -> float:
        """Time from the first to the last sample, s."""
        return float(self.time_s[-1] - self.time_s[0])

    @property
    def known(self) -> BoolArray:
        """False for each interval between two samples [n − 1] that is a gap."""
        return np.asarray(
            np.diff(self.time_s) <= max(threshold.GAP_FACTOR * self.spacing_s, threshold.GAP_S)
        )

    @property
    def longest_gap_s(self) -> float:
        """Longest time between two samples, s."""
        return float(np.max(np.diff(self.time_s)))

    def evenly(self, most: int = threshold.MOST_SAMPLES) -> Signals:
        """Return the signals on a grid of even spacing."""
        spacing = max(self.spacing_s, self.duration_s / most)
        time = np.arange(self.time_s[0], self.time_s[-1], spacing)
        return Signals(
            time,
            np.interp(time, self.time_s, self.torque_percent),
            np.interp(time, self.time_s, self.speed_rpm),
        )


@dataclass(frozen=True)
class Effective:
    """Value over whole periods, and its 95 % interval where there are at least three of them."""

    value: float
    ci95: tuple[float | None, float | None]


@dataclass(frozen=True)
class Power:
    """Power at the motor's shaft without losses, W; energy in J per period, or per recording."""

    highest_w: float
    mean_w: float
    highest_braking_w: float
    braking_j: float
    braking_mean_w: float


@dataclass(frozen=True)
class Budget:
    """I²t budget: ``used`` is the highest share of it; ``trip_s`` None if never exceeded."""

    used: float
    trip_s: float | None


def period_of(signals: Signals) -> float | None:
    """Return the period of torque and speed in s; None where they are not periodic.

    From the autocorrelation of the signals; the recording must contain at least two periods.
    """
    even = signals.evenly(1 << 14)
    spacing, size = even.spacing_s, even.time_s.size
    if size < 64:
        return None
    total, energy = np.zeros(size), np.zeros(size)
    for each in (even.torque_percent, even.speed_rpm):
        centred = each - float(np.mean(each))
        deviation = float(np.std(centred))
        if deviation <= 1e-9:
            continue
        centred = centred / deviation
        whole = scipy.signal.fftconvolve(centred, centred[::-1])[size - 1 :]
        squares = np.concatenate([[0.0], np.cumsum(centred**2)])
        lags = np.arange(size)
        first, last = squares[size - lags], squares[size] - squares[lags]
        total += whole
        energy += np.sqrt(np.maximum(first * last, 1e-12))
    if not np.any(energy):
        return None
    correlation = total / np.maximum(energy, 1e-12)
    half = correlation[: size // 2 + 1]
    fallen = np.flatnonzero(half < threshold.FALLEN)
    if not fallen.size:
        return None
    begin = int(fallen[0])
    peaks = (
        1
        + begin
        + np.flatnonzero(
            (half[begin + 1 : -1] >= half[begin:-2]) & (half[begin + 1 : -1] >= half[begin + 2 :])
        )
    )
    if not peaks.size or float(np.max(half[peaks])) < threshold.REPEATS:
        return None
    best = float(np.max(half[peaks]))
    lag = int(peaks[np.flatnonzero(half[peaks] >= threshold.NEARLY * best)[0]])
    return _refined(half, lag) * spacing


def _refined(correlation: FloatArray, lag: int) -> float:
    """Position of the peak of a parabola through three samples."""
    before, here, after = (float(correlation[lag + k]) for k in (-1, 0, 1))
    bend = before - 2.0 * here + after
    return lag if bend >= 0.0 else lag + 0.5 * (before - after) / bend


def whole_periods(signals: Signals, period_s: float | None) -> FloatArray:
    """Return the limits [k + 1] of k whole periods, s; start and end where there is no period.

    A period that is longer than the recording or shorter than the spacing of its samples is none.
    """
    begin, duration = float(signals.time_s[0]), signals.duration_s
    if period_s is None or not has_periods(signals, period_s):
        return np.array([begin, begin + duration])
    return np.asarray(begin + period_s * np.arange(int(duration / period_s + 1e-3) + 1))


def has_periods(signals: Signals, period_s: float) -> bool:
    """Whether the recording contains a whole period, with samples in it."""
    return signals.spacing_s <= period_s <= signals.duration_s


def effective_torque(signals: Signals, moments: FloatArray) -> Effective:
    """Return the root mean square of the torque in %, with its interval over periods."""
    a, b = signals.torque_percent[:-1], signals.torque_percent[1:]
    squares = np.array(_means(signals, (a * a + a * b + b * b) / 3.0, moments))
    value = float(np.sqrt(np.mean(squares)))
    if squares.size < 3 or value <= 0.0:
        return Effective(value, (None, None))
    each = np.sqrt(squares)
    half = float(scipy.special.stdtrit(each.size - 1, 0.975) * np.std(each, ddof=1))
    half /= float(np.sqrt(each.size))
    return Effective(value, (max(value - half, 0.0), value + half))


def mean_speed_rpm(signals: Signals, moments: FloatArray) -> float:
    """Return the mean magnitude of the speed, rpm."""
    speed = np.abs(signals.speed_rpm)
    return float(np.mean(_means(signals, 0.5 * (speed[:-1] + speed[1:]), moments)))


def power_of(signals: Signals, rated_nm: float, moments: FloatArray) -> Power:
    """Return the mechanical power; negative power returns to the drive, less the losses."""
    torque, speed = signals.torque_percent * rated_nm / 100.0, signals.speed_rpm * _RAD_S
    power = torque * speed
    # Between two samples torque times speed is a parabola, for which Simpson's rule is exact.
    middle = 0.25 * (torque[:-1] + torque[1:]) * (speed[:-1] + speed[1:])

    def over(values: FloatArray, between: FloatArray) -> FloatArray:
        return (values[:-1] + 4.0 * between + values[1:]) / 6.0

    braking = over(np.maximum(-power, 0.0), np.maximum(-middle, 0.0))
    mean_braking = float(np.mean(_means(signals, braking, moments)))
    return Power(
        float(np.max(power)),
        float(np.mean(_means(signals, over(power, middle), moments))),
        float(np.max(np.maximum(-power, 0.0))),
        mean_braking * float(moments[-1] - moments[0]) / max(moments.size - 1, 1),
        mean_braking,
    )


def _means(signals: Signals, by_interval: FloatArray, moments: FloatArray) -> list[float]:
    """Means of a quantity [n − 1] between these moments, without gaps."""
    long = np.diff(signals.time_s) * signals.known
    amount = np.concatenate([[0.0], np.cumsum(by_interval * long)])
    passed = np.concatenate([[0.0], np.cumsum(long)])
    sums = np.diff(np.interp(moments, signals.time_s, amount))
    times = np.diff(np.interp(moments, signals.time_s, passed))
    return [float(s / t) for s, t in zip(sums, times, strict=True) if t > 0.0] or [0.0]


def share_above(signals: Signals, percent: float) -> float:
    """Return the share of the time in which the magnitude of the torque exceeds ``percent``."""
    long = np.diff(signals.time_s) * signals.known
    middle = 0.5 * np.abs(signals.torque_percent[:-1] + signals.torque_percent[1:])
    return float(np.sum(long[middle > percent]) / max(float(np.sum(long)), 1e-12))


def i2t(signals: Signals, overload_percent: float, overload_s: float) -> Budget:
    """Integrate the square of the torque above the rated one, and compare it with a rating.

    The rating: ``overload_percent`` of rated torque for ``overload_s`` from the rated load. The
    sum falls again below rated torque, but not below zero. The recording is taken to repeat.
    """
    budget = ((overload_percent / 100.0) ** 2 - 1.0) * overload_s
    even = signals.evenly()
    steps = ((even.torque_percent / 100.0) ** 2 - 1.0) * even.spacing_s
    first = _added_up(steps, 0.0)
    second = _added_up(steps, float(first[-1]))
    for done, course in enumerate((first, second)):
        over = np.flatnonzero(course >= budget)
        if over.size:
            trip = done * signals.duration_s + float(over[0] + 1) * even.spacing_s
            return Budget(float(np.max(course) / budget), trip)
    growth = float(second[-1] - first[-1])
    highest = float(np.max(second))
    if growth <= 1e-6 * budget:
        return Budget(highest / budget, None)
    passes = np.ceil((budget - highest) / growth) + 1.0
    return Budget(highest / budget, float(passes * signals.duration_s))


def _added_up(steps: FloatArray, start: float) -> FloatArray:
    """Running sum limited to zero from below (the sum minus its lowest value so far)."""
    total = start + np.cumsum(steps)
    return np.asarray(total - np.minimum(np.minimum.accumulate(total), 0.0))
