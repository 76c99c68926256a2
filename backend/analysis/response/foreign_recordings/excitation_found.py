"""Detects the excitation that a recorded input contains: a repeated period, a chirp, or noise.

A periodic input is by far the best (Pintelon & Schoukens, *System Identification*, 2012,
chapter 2): its periods show noise, and averaging them leaves no leakage.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import scipy

from backend.analysis.signals.arrays import BoolArray, FloatArray, IntArray, running_mean
from backend.analysis.thresholds import excitation_found as threshold

Excited = Literal["periodic", "chirp", "noise"]


@dataclass(frozen=True)
class ExcitationFound:
    """Kind of an excitation; ``period_samples`` and ``periods`` of a periodic one.

    ``stretch`` is its range of samples. ``repeat_error`` is the share of the input's power that its
    periods do not have in common.
    """

    kind: Excited
    period_samples: int = 0
    periods: int = 0
    repeat_error: float = 0.0
    stretch: slice = field(default_factory=lambda: slice(None))


def find_excitation(signal: FloatArray) -> ExcitationFound:
    """Return the kind of excitation of an input [n] that is not constant."""
    whole = slice(0, signal.size)
    for stretch in dict.fromkeys(((whole.start, whole.stop), _loud(signal - np.median(signal)))):
        u = signal[slice(*stretch)]
        u = u - np.mean(u)
        period = _period(u)
        if period:
            first, end = _passes(u, period)
            count = (end - first) // period
            if count < threshold.LEAST_PERIODS:
                continue
            rows = u[end - count * period : end].reshape(count, period)
            error = float(np.mean(np.var(rows, axis=0)) / np.mean(rows**2))
            found = slice(stretch[0] + first, stretch[0] + end)
            return ExcitationFound("periodic", period, count, error, found)
    return ExcitationFound("chirp" if _is_chirp(signal - np.mean(signal)) else "noise")


def _loud(u: FloatArray) -> tuple[int, int]:
    """First sample and end of the longest stretch that is not silent.

    A recording usually begins before its excitation, and ends after it.
    """
    width = max(u.size // threshold.PARTS, 8)
    power = running_mean(u**2, width // 2, width)
    loud = power > threshold.SILENT**2 * float(np.percentile(power, 90))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], loud, [False]]).astype(np.int8)))
    begins, ends = edges[::2], edges[1::2]
    if not begins.size:
        return 0, u.size
    longest = int(np.argmax(ends - begins))
    first, end = int(begins[longest]), int(ends[longest])
    # At an end, half of the averaging window may be silent.
    half = width // 2 + 1
    return first + half * (first > 0), end - half * (end < u.size)


def _silent_before_or_after(silent: BoolArray) -> BoolArray:
    """True for silence at the start or the end, before or after everything else."""
    loud = np.flatnonzero(~silent)
    outside = np.ones(silent.size, dtype=bool)
    if loud.size:
        outside[loud[0] : loud[-1] + 1] = False
    return outside


def _passes(u: FloatArray, period: int) -> tuple[int, int]:
    """First sample and end of the stretch in which every period is followed by an identical one."""
    width = max(period // threshold.OF_PERIOD, 1)

    def around(power: FloatArray) -> FloatArray:
        steps = np.cumsum(np.concatenate([[0.0], power]))
        return np.asarray((steps[width:] - steps[:-width]) / width)

    both = 0.5 * around(u[period:] ** 2 + u[:-period] ** 2)
    least = threshold.SILENT**2 * float(np.mean(u**2))
    alike = (around((u[period:] - u[:-period]) ** 2) < threshold.NO_PASS * both) | (both < least)
    alike &= ~_silent_before_or_after(both < least)
    if np.all(alike):
        return 0, u.size
    edges = np.flatnonzero(np.diff(np.concatenate([[False], alike, [False]]).astype(np.int8)))
    begins, ends = edges[::2], edges[1::2]
    if not begins.size:
        return 0, 0
    longest = int(np.argmax(ends - begins))
    first, end = int(begins[longest]), int(ends[longest]) - 1 + width + period
    # At an end, half of the averaging window may be silent.
    return first + width * (first > 0), end - width * (end < u.size)


def _period(u: FloatArray) -> int:
    """Shortest period of the input in whole samples; 0 where it is not periodic.

    From the normalised correlation of both overlapping parts: 2·Σab/(Σa²+Σb²), 1 where equal.
    """
    n = u.size
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.fft.rfft(u, size)
    products = np.fft.irfft(np.abs(spectrum) ** 2, size)[:n]
    power = np.concatenate([[0.0], np.cumsum(u**2)])
    lags = np.arange(n)
    both = power[n - lags] + (power[n] - power[lags])
    alike = 2.0 * products / np.maximum(both, 1e-300)
    last = n // threshold.LEAST_PERIODS
    if last <= threshold.LEAST_PERIOD:
        return 0
    # Near lag 0 the correlation shows smoothness only: the period lies beyond the first fall.
    fallen = np.flatnonzero(alike[: last + 1] < 0.5)
    if not fallen.size:
        return 0
    first = max(int(fallen[0]), threshold.LEAST_PERIOD)
    peaks = np.flatnonzero(
        (alike[first : last + 1] >= alike[first - 1 : last])
        & (alike[first : last + 1] >= alike[first + 1 : last + 2])
    )
    if not peaks.size:
        return 0
    values = alike[first + peaks]
    best = float(np.max(values))
    period = int(first + peaks[np.flatnonzero(values >= best - threshold.AS_GOOD)[0]])
    # Noise lowers the correlation of every multiple alike; chance similarity occurs only once.
    later = alike[2 * period : n - period + 1 : period]
    again = (
        later.size > 0
        and float(np.min(later)) > best - threshold.AS_MUCH
        and best > 1.0 - threshold.UNLIKE
    )
    return period if again or best > 1.0 - threshold.UNLIKE_TWICE else 0


def _is_chirp(u: FloatArray) -> bool:
    """Whether there is one tone at a time whose frequency moves steadily, possibly up and down.

    A slow motion that keeps the axis from sticking may be superimposed.
    """
    width = max(u.size // 64, 64)
    _f, _t, parts = scipy.signal.stft(u, nperseg=width, noverlap=width // 2, boundary=None)
    power = np.abs(parts) ** 2
    power[: threshold.SLOW_BINS] = 0.0
    total = np.sum(power, axis=0)
    loud = total > 0.05 * np.max(total)
    if np.count_nonzero(loud) < 8:
        return False
    top = np.argmax(power, axis=0)
    near = [float(np.sum(power[max(k - 3, 0) : k + 4, i])) for i, k in enumerate(top)]
    single = float(np.median(np.asarray(near)[loud] / total[loud]))
    way = np.diff(top[loud].astype(float))
    moves = np.sign(way[way != 0])
    if single < threshold.ONE_TONE or moves.size < 4:
        return False
    return bool(np.mean(moves[1:] == moves[:-1]) > threshold.ONE_WAY)


def transient_periods(*spectra: FloatArray) -> int:
    """Return how many leading periods to leave out, from signals [periods, samples].

    At least one if there are four or more; at least two periods are kept.
    """
    count = spectra[0].shape[0]
    worst = 1 if count >= 4 else 0
    for rows in spectra:
        later = rows[count // 2 :].mean(axis=0)
        far = np.sqrt(np.mean((rows - later) ** 2, axis=1))
        usual = max(float(np.median(far[count // 2 :])), 1e-12 * float(np.std(rows)))
        over = far > threshold.TRANSIENT * usual
        settled = next((i for i in range(count) if not over[i]), count)
        worst = max(worst, settled)
    return int(min(worst, count - threshold.LEAST_PERIODS))


def excited_lines(amplitude: FloatArray, deviation: FloatArray) -> IntArray:
    """Return the bins of one period that the input excites, without bin 0 and the highest.

    ``amplitude`` [bins] of the mean period, ``deviation`` [bins] of that mean. Distortion of a
    measured input lies on the other bins, which a gap in the ordered amplitudes distinguishes.
    """
    usable = np.arange(1, amplitude.size - 1)
    a = amplitude[usable]
    top = float(np.percentile(a[a >= 0.1 * np.max(a)], 90))
    over: BoolArray = (a > threshold.LEAST_SHARE * top) & (
        a > threshold.DEVIATIONS * deviation[usable]
    )
    ordered = np.sort(a[over])
    if ordered.size > 2:
        ratio = ordered[1:] / ordered[:-1]
        low = np.flatnonzero((ordered[:-1] < 0.5 * top) & (ratio > threshold.GAP))
        if low.size:
            over &= a >= ordered[low[-1] + 1]
    return np.asarray(usable[over], dtype=np.int64)
