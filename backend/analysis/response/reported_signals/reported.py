"""Checks the assumptions about the reported speed and torque.

The reported speed is assumed to be the true one behind one lag and one delay, and the reported
torque to be that behind the current loop. Some drives report the mean speed of several cycles, or
the torque demand. The position reveals the first, a torque without any lag the second.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from backend.analysis.response.frf import Frf
from backend.analysis.response.signal_path.sampling import SignalPath, lag_response
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.signals.line_spectra import Record, good_periods, period_spectra
from backend.analysis.thresholds import reported as threshold


def mean_cycles(records: tuple[Record, ...]) -> int | None:
    """Return the number of cycles over which the reported speed is averaged; None if it is not.

    A speed that is the travel of several cycles over their time has nulls within the band, which no
    lag has, and contains nothing that the positions do not.
    """
    if any(r.position is None or r.excitation.segments for r in records):
        return None
    left = []
    for cycles in range(1, threshold.MOST_CYCLES + 1):
        shares = [_apart(r, cycles) for r in records]
        left.append(float(np.median(np.concatenate(shares))))
    best = int(np.argmin(left))
    return best + 1 if left[best] < threshold.SAME else None


def _apart(record: Record, cycles: int) -> FloatArray:
    """Relative difference [lines] of the reported speed from a mean over these cycles."""
    e, place = record.excitation, record.position
    assert place is not None
    good, _ = good_periods(record)
    if not good:
        return np.ones(1)
    before = np.concatenate([np.full(cycles, place[0]), place[:-cycles]])
    mean = (place - before) * (e.sample_rate_hz / cycles)
    reported, made = (period_spectra(x, e, good).mean(axis=0) for x in (record.response, mean))
    # At low lines all candidates are alike.
    upper = e.line_hz >= 0.5 * e.line_hz[-1]
    return np.asarray((np.abs(reported - made) / np.maximum(np.abs(reported), 1e-300))[upper])


def commanded(path: SignalPath) -> bool:
    """Return whether the reported torque is the demand: no current loop lies between them."""
    return (
        path.current_bandwidth_hz is not None and path.current_bandwidth_hz > threshold.COMMANDED_HZ
    )


def current_uncertainty(frequency_hz: FloatArray) -> ComplexArray:
    """Return the log response of an ordinary, unrecorded current loop, without its delay."""
    return _without_delay(frequency_hz, np.log(lag_response(frequency_hz, threshold.USUAL_HZ)))


def slow_uncertainty(frequency_hz: FloatArray, corner_hz: float) -> ComplexArray:
    """Return the logarithm of two lags over a single one of this corner with the same total delay.

    A slow torque may be an ordinary current loop behind a filter as well as one slow lag.
    """
    own_s, usual_s = 1.0 / corner_hz, 1.0 / threshold.USUAL_HZ
    two = lag_response(frequency_hz, threshold.USUAL_HZ) * lag_response(
        frequency_hz, 1.0 / max(own_s - usual_s, 1e-6)
    )
    return np.asarray(np.log(two / lag_response(frequency_hz, corner_hz)))


def path_uncertainty(frequency_hz: FloatArray) -> ComplexArray:
    """Return the possible log response of a path that neither the drive nor its torque explains.

    One more lag, as slow as current loops hardly are, the delay of which is found to within
    `threshold.LATE_S`.
    """
    f = np.asarray(frequency_hz, dtype=np.float64)
    form = _without_delay(f, np.log(lag_response(f, threshold.SLOWEST_HZ)))
    return np.asarray(form.real + 1j * np.hypot(form.imag, 2 * np.pi * f * threshold.LATE_S))


def charged(frf: Frf, lines_hz: FloatArray, uncertainty: ComplexArray) -> Frf:
    """Return the response with its band widened by an uncertainty given on ``lines_hz``."""
    size, turn = (
        np.interp(frf.frequency_hz, lines_hz, x) for x in (uncertainty.real, uncertainty.imag)
    )
    return replace(
        frf,
        std_db=np.hypot(frf.std_db, 20 / np.log(10) * size),
        std_deg=np.hypot(frf.std_deg, np.degrees(turn)),
    )


def _without_delay(f: FloatArray, reported: ComplexArray) -> ComplexArray:
    late = float(np.sum(f * reported.imag) / np.sum(f**2))
    return np.asarray(reported - 1j * late * f)
