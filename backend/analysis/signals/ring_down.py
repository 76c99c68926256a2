"""Frequency and damping of the slow mode that rings after a move, from the ring-down.

Each ring-down is the sum of one damped sinusoid and a parabola for slow creep (integral action,
friction). Frequency and damping are common to all signals of a ring-down; amplitude and phase are
individual (variable projection, Golub and Pereyra 1973).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from backend.analysis.signals.arrays import BoolArray, FloatArray
from backend.analysis.thresholds import ring_down as threshold

_TURN = 2 * math.pi
_CI95 = 1.959964


@dataclass(frozen=True)
class RingDown:
    """Signals [n, k] after the end of a move; ``valid`` [n] is True where a sample was received."""

    signals: FloatArray
    valid: BoolArray
    sample_rate_hz: float


@dataclass(frozen=True)
class ModeFit:
    """Fit of one ring-down: frequency in Hz, damping ratio, and the deviations of both.

    ``explained`` [k] is the share of each signal, without its parabola, that the sinusoid explains;
    ``amplitude`` [k] is that of the sinusoid at the first sample, ``noise`` [k] the deviation of
    the residual, both in the unit of the signal.
    """

    frequency_hz: float
    damping: float
    frequency_std_hz: float
    damping_std: float
    explained: FloatArray
    amplitude: FloatArray
    noise: FloatArray


@dataclass(frozen=True)
class Mode:
    """The mode of several ring-downs, with 95 % intervals of frequency in Hz and damping ratio."""

    frequency_hz: float
    damping: float
    frequency_ci95_hz: tuple[float, float]
    damping_ci95: tuple[float, float]


@dataclass(frozen=True)
class CommonMode:
    """The mode common to several ring-downs, their fits, and the median explained share."""

    mode: Mode
    fits: list[ModeFit]
    explained: float


@dataclass(frozen=True)
class Parts:
    """A ring-down split at a given mode: its creep [n, k], and the amplitude of the sinusoid."""

    creep: FloatArray
    amplitude: FloatArray


def fit_mode(ring: RingDown, low_hz: float, high_hz: float) -> ModeFit | None:
    """Return the mode between two frequencies in one ring-down; None where there are too few
    samples.

    The recording must contain at least `FEWEST_PERIODS` of the sinusoid.
    """
    ring = _thinned(ring, high_hz)
    seen, rate = ring.valid, ring.sample_rate_hz
    low_hz = max(low_hz, threshold.FEWEST_PERIODS * rate / seen.size)
    if low_hz >= high_hz or np.count_nonzero(seen) < threshold.FEWEST_SAMPLES:
        return None
    time = np.arange(seen.size) / rate
    trend = _trend(time)
    flat = ring.signals[seen] - trend[seen] @ _solved(trend[seen], ring.signals[seen])
    scale = np.sqrt(np.mean(flat**2, axis=0))
    moving = scale > 0.0
    if not np.any(moving):
        return None
    scaled = ring.signals[seen][:, moving] / scale[moving]

    def left(place: FloatArray) -> FloatArray:
        base = _base(time, float(np.exp(place[0])), float(np.exp(place[1])))[seen]
        return np.asarray((scaled - base @ _solved(base, scaled)).ravel())

    begin = np.log(_nearest(time[seen], trend[seen], scaled, low_hz, high_hz))
    ends = (
        np.log([low_hz, threshold.DAMPING_ENDS[0]]),
        np.log([high_hz, threshold.DAMPING_ENDS[1]]),
    )
    found = scipy.optimize.least_squares(
        left, np.clip(begin, *ends), bounds=ends, x_scale=(0.01, 0.5)
    )
    frequency, damping = float(np.exp(found.x[0])), float(np.exp(found.x[1]))
    base = _base(time, frequency, damping)
    solved = _solved(base[seen], ring.signals[seen])
    rest = ring.signals[seen] - base[seen] @ solved
    noise = np.sqrt(np.mean(rest**2, axis=0))
    explained = 1.0 - np.divide(
        np.mean(rest**2, axis=0), scale**2, out=np.ones(scale.size), where=moving
    )
    std = _deviations(np.asarray(found.jac), found.fun, int(np.count_nonzero(moving)))
    return ModeFit(
        frequency,
        damping,
        frequency * float(std[0]),
        damping * float(std[1]),
        explained,
        np.hypot(solved[0], solved[1]),
        noise,
    )


def common_mode(rings: list[RingDown], low_hz: float, high_hz: float) -> CommonMode | None:
    """Return the mode of ring-downs of one signal [n, 1]; None where they do not agree."""
    fits = [fit_mode(each, low_hz, high_hz) for each in rings]
    good = [each for each in fits if each is not None and _is_mode(each, low_hz, high_hz)]
    if len(good) < max(2, math.ceil(threshold.AGREEING * len(rings))):
        return None
    mode = mode_of(good)
    if float(np.std([each.frequency_hz for each in good])) > threshold.SCATTER * mode.frequency_hz:
        return None
    return CommonMode(mode, good, float(np.median([float(each.explained[0]) for each in good])))


def _is_mode(fit: ModeFit, low_hz: float, high_hz: float) -> bool:
    """Whether a ring-down consists mostly of this sinusoid, inside the searched band."""
    edge = threshold.EDGE
    inside = low_hz * (1.0 + edge) < fit.frequency_hz < high_hz * (1.0 - edge)
    clear = float(fit.amplitude[0]) > threshold.CLEAR * float(fit.noise[0])
    rings = fit.damping < threshold.RINGS
    return inside and clear and rings and float(fit.explained[0]) > threshold.EXPLAINED


def _nearest(
    time: FloatArray, trend: FloatArray, signals: FloatArray, low_hz: float, high_hz: float
) -> tuple[float, float]:
    """Grid point of frequency and damping ratio that explains most of the signals [n, k].

    The parabola is projected out of signals and sinusoids alike, which leaves two unknowns, whose
    normal equations are solved for the whole grid at once.
    """
    steps = max(8, math.ceil(math.log(high_hz / low_hz) / threshold.GRID_STEP))
    frequencies, dampings = (
        each.ravel()
        for each in np.meshgrid(np.geomspace(low_hz, high_hz, steps), threshold.DAMPINGS)
    )
    flat = np.linalg.qr(trend)[0]
    fall = np.exp(-np.outer(_TURN * frequencies * dampings, time))
    angle = np.outer(_TURN * frequencies * np.sqrt(1.0 - dampings**2), time)
    real, imaginary = fall * np.cos(angle), fall * np.sin(angle)
    real -= (real @ flat) @ flat.T
    imaginary -= (imaginary @ flat) @ flat.T
    one, two = real @ signals, imaginary @ signals
    rr, ii = np.sum(real**2, axis=1), np.sum(imaginary**2, axis=1)
    ri = np.sum(real * imaginary, axis=1)
    power = ii * np.sum(one**2, axis=1) - 2 * ri * np.sum(one * two, axis=1)
    power += rr * np.sum(two**2, axis=1)
    best = int(np.argmax(power / np.maximum(rr * ii - ri**2, 1e-12 * rr * ii)))
    return float(frequencies[best]), float(dampings[best])


def mode_of(fits: list[ModeFit]) -> Mode:
    """Return the mean of several ring-downs (at least two) with its intervals.

    The interval is that of the mean by the scatter between them, and not narrower than the
    deviations of the fits.
    """
    count = len(fits)
    factor = float(scipy.special.stdtrit(count - 1, 0.975)) if count > 1 else math.inf

    def half(values: FloatArray, stds: FloatArray) -> float:
        scatter = factor * float(np.std(values, ddof=1)) / math.sqrt(count)
        return max(scatter, _CI95 * float(np.sqrt(np.mean(stds**2) / count)))

    frequency = np.array([each.frequency_hz for each in fits])
    damping = np.array([each.damping for each in fits])
    f, z = float(np.mean(frequency)), float(np.mean(damping))
    df = half(frequency, np.array([each.frequency_std_hz for each in fits]))
    dz = half(damping, np.array([each.damping_std for each in fits]))
    most = threshold.DAMPING_ENDS[1]
    return Mode(f, z, (max(f - df, 0.01 * f), f + df), (max(z - dz, 0.0), min(z + dz, most)))


def parts_of(ring: RingDown, mode: Mode) -> Parts:
    """Return the creep, and the amplitude [k] of the mode at the first sample, by least squares."""
    time = np.arange(ring.valid.size) / ring.sample_rate_hz
    base = _base(time, mode.frequency_hz, max(mode.damping, threshold.DAMPING_ENDS[0]))
    solved = _solved(base[ring.valid], ring.signals[ring.valid])
    return Parts(base[:, 2:] @ solved[2:], np.hypot(solved[0], solved[1]))


def about_creep(ring: RingDown, mode: Mode, begin: int) -> FloatArray:
    """Return signals [n, k] without the creep parabola fitted from sample ``begin`` on, smoothed.

    Before that sample the parabola's first value holds. The mean over a tenth of a period removes
    1.6 % of the mode, and most of the noise of single samples.
    """
    rate = ring.sample_rate_hz
    creep = parts_of(RingDown(ring.signals[begin:], ring.valid[begin:], rate), mode).creep
    table = ring.signals - np.concatenate([np.repeat(creep[:1], begin, axis=0), creep])
    kernel = np.ones(max(1, round(threshold.SMOOTHED * rate / mode.frequency_hz)))
    count = np.convolve(np.ones(len(table)), kernel, "same")
    return np.column_stack([np.convolve(each, kernel, "same") / count for each in table.T])


def settling_s(values: FloatArray, window: float, last: int, rate: float) -> float | None:
    """Return the time after which the values [n] stay within ± the window, s from the first sample.

    None where they are outside the window within the ``last`` samples: they have not settled then.
    """
    outside = np.flatnonzero(np.abs(values) > window)
    if outside.size == 0:
        return 0.0
    if outside[-1] >= values.size - last:
        return None
    return float(outside[-1] + 1) / rate


def _thinned(ring: RingDown, high_hz: float) -> RingDown:
    """Means over several samples: `OVERSAMPLING` of the highest frequency suffices."""
    step = max(1, math.floor(ring.sample_rate_hz / (threshold.OVERSAMPLING * high_hz)))
    count = ring.valid.size // step
    if step == 1 or count == 0:
        return ring
    whole = ring.signals[: count * step].reshape(count, step, -1)
    valid = ring.valid[: count * step].reshape(count, step)
    return RingDown(whole.mean(axis=1), np.asarray(valid.all(axis=1)), ring.sample_rate_hz / step)


def _trend(time: FloatArray) -> FloatArray:
    place = np.linspace(-1.0, 1.0, time.size)
    return np.column_stack([np.ones(time.size), place, place**2])


def _base(time: FloatArray, frequency_hz: float, damping: float) -> FloatArray:
    """Columns: cosine and sine of the damped sinusoid, and the parabola."""
    omega = _TURN * frequency_hz
    fall = np.exp(-damping * omega * time)
    angle = omega * math.sqrt(1.0 - damping**2) * time
    return np.column_stack([fall * np.cos(angle), fall * np.sin(angle), _trend(time)])


def _solved(base: FloatArray, signals: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.lstsq(base, signals, rcond=None)[0])


def _deviations(jacobian: FloatArray, rest: FloatArray, signals: int) -> FloatArray:
    """Deviations of log frequency and log damping for residuals that are not white.

    With the correlation ρ of neighbouring samples, (1 + ρ)/(1 - ρ) samples count as one.
    """
    table = rest.reshape(-1, signals)
    power = float(np.mean(table**2))
    if power == 0.0:
        return np.zeros(2)
    correlated = float(np.mean(table[1:] * table[:-1])) / power
    correlated = min(max(correlated, 0.0), threshold.CORRELATED_MOST)
    worth = (1.0 + correlated) / (1.0 - correlated)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * power * worth
    return np.sqrt(np.maximum(np.diag(covariance), 0.0))
