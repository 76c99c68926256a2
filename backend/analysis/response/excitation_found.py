"""Which excitation a recorded input holds: a repeated period, a chirp, or noise.

A periodic input is the better instrument by far (Pintelon & Schoukens, *System Identification*,
2012, chapter 2): its periods tell noise, and averaging them leaves no leakage.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy

from backend.analysis.signals.arrays import BoolArray, FloatArray, IntArray
from backend.analysis.thresholds import excitation_found as threshold

Excited = Literal["periodic", "chirp", "noise"]


@dataclass(frozen=True)
class ExcitationFound:
    """``lines`` are excited DFT bins of one period (periodic), else empty.

    ``repeat_error`` is the share of the input's power that its periods do not have in common.
    """

    kind: Excited
    period_samples: int = 0
    periods: int = 0
    repeat_error: float = 0.0


def find_excitation(signal: FloatArray) -> ExcitationFound:
    """Kind of excitation of an input [n] that is not constant."""
    u = signal - np.mean(signal)
    period = _period(u)
    if period:
        count = u.size // period
        rows = u[u.size - count * period :].reshape(count, period)
        error = float(np.mean(np.var(rows, axis=0)) / np.mean(u**2))
        return ExcitationFound("periodic", period, count, error)
    return ExcitationFound("chirp" if _is_chirp(u) else "noise")


def _period(u: FloatArray) -> int:
    """Shortest whole number of samples after which the input repeats itself; 0 where it does not.

    By the normalised correlation of both overlapping parts: 2·Σab/(Σa²+Σb²), 1 where equal.
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
    # What is near lag 0 is the smoothness of the signal: the period lies beyond the first fall.
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
    if best < 1.0 - threshold.UNLIKE:
        return 0
    return int(first + peaks[np.flatnonzero(values >= best - threshold.AS_GOOD)[0]])


def _is_chirp(u: FloatArray) -> bool:
    """One tone at a time whose frequency moves one way, perhaps several times."""
    width = max(u.size // 64, 64)
    _f, _t, parts = scipy.signal.stft(u, nperseg=width, noverlap=width // 2, boundary=None)
    power = np.abs(parts) ** 2
    total = np.sum(power, axis=0)
    loud = total > 0.05 * np.max(total)
    if np.count_nonzero(loud) < 8:
        return False
    top = np.argmax(power, axis=0)
    near = [float(np.sum(power[max(k - 3, 0) : k + 4, i])) for i, k in enumerate(top)]
    single = float(np.median(np.asarray(near)[loud] / total[loud]))
    way = np.diff(top[loud].astype(float))
    moves = way[way != 0]
    if single < threshold.ONE_TONE or moves.size < 4:
        return False
    return bool(max(np.mean(moves > 0), np.mean(moves < 0)) > threshold.ONE_WAY)


def transient_periods(*spectra: FloatArray) -> int:
    """How many leading periods are left out, from signals [periods, samples].

    At least one where there are four; two periods at least are kept.
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
    """Bins of one period that the input excites, without bin 0 and the highest.

    ``amplitude`` [bins] of the mean period, ``deviation`` [bins] of that mean. Distortion of a
    measured input lies on the other bins, which a gap in the ordered amplitudes tells apart.
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
