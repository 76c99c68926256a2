"""Open and closed loops, their margins and bandwidths.

Everything works on measured lines; crossings are interpolated in log frequency. Definitions as
in Åström & Murray, *Feedback Systems* (2nd ed. 2021), chapters 10 and 12.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.analysis.signals.arrays import ComplexArray, FloatArray, magnitude_db, phase_deg


def open_from_closed(closed: ComplexArray) -> ComplexArray:
    """Return L = T / (1 - T)."""
    return np.asarray(closed / (1.0 - closed), dtype=np.complex128)


def closed_from_open(loop: ComplexArray) -> ComplexArray:
    """Return T = L / (1 + L)."""
    return np.asarray(loop / (1.0 + loop), dtype=np.complex128)


def sensitivity(loop: ComplexArray) -> ComplexArray:
    """Return S = 1 / (1 + L)."""
    return np.asarray(1.0 / (1.0 + loop), dtype=np.complex128)


@dataclass(frozen=True)
class Bandwidth:
    """Frequencies of a closed loop's first fall by 3 dB and first lag of 90°; None
    beyond the data.
    """

    minus_3db_hz: float | None
    minus_90deg_hz: float | None


@dataclass(frozen=True)
class Margins:
    """Margins of an open loop; None where the data contain no such crossing.

    ``crossover_hz`` is the last fall through 0 dB. ``phase_margin_deg`` is the smallest over all
    crossings of 0 dB; it is negative only where the loop is unstable, as a stable loop may pass the
    critical point on either side. ``gain_margin_db`` is the smallest *increase* of gain that
    reaches the critical point. ``ms`` is the peak of |S| at ``ms_hz``.
    """

    crossover_hz: float | None
    phase_margin_deg: float | None
    phase_margin_hz: float | None
    gain_margin_db: float | None
    gain_margin_hz: float | None
    ms: float
    ms_hz: float
    stable: bool


def _crossings(frequency_hz: FloatArray, value: FloatArray) -> list[tuple[float, int]]:
    """Frequencies where ``value`` changes sign, with +1 for rising and -1 for falling."""
    found = []
    log_f = np.log(frequency_hz)
    below = value < 0
    for i in np.flatnonzero(below[1:] != below[:-1]):
        share = value[i] / (value[i] - value[i + 1])
        where = float(np.exp(log_f[i] + share * (log_f[i + 1] - log_f[i])))
        found.append((where, 1 if below[i] else -1))
    return found


def _at(frequency_hz: FloatArray, value: FloatArray, where_hz: float) -> float:
    return float(np.interp(np.log(where_hz), np.log(frequency_hz), value))


def bandwidth(frequency_hz: FloatArray, closed: ComplexArray) -> Bandwidth:
    """Return the -3 dB and -90° bandwidth of a closed loop, relative to 0 dB.

    0 dB is the gain of a drive's closed loop at 0 Hz; the lowest measured line is above it where
    the integral action overshoots, the more the higher that line lies. The lowest line must lie
    well inside the bandwidth; its phase is taken as the principal value.
    """
    db = magnitude_db(closed)
    phase = phase_deg(closed)
    low = _crossings(frequency_hz, db + 3.0103)
    late = _crossings(frequency_hz, phase + 90.0)
    falls = [f for f, sense in low if sense < 0]
    lags = [f for f, sense in late if sense < 0]
    return Bandwidth(falls[0] if falls else None, lags[0] if lags else None)


def is_stable(frequency_hz: FloatArray, loop: ComplexArray) -> bool:
    """Apply the Nyquist criterion to data, for a loop without unstable open-loop poles.

    Followed down from the highest line (|L| small, so 1 + L near 1), the phase of 1 + L must end
    near that of L itself at the lowest line, within (-270°, 90°): up to two integrators. Lines
    must be dense enough that no half turn falls between two of them, and reach from |L| > 1 to
    |L| < 1; a loop that never exceeds 1 is stable.
    """
    if np.max(np.abs(loop)) < 1.0:
        return True
    order = np.argsort(frequency_hz)
    turn = np.unwrap(np.angle(1.0 + loop[order])[::-1])
    turn = np.degrees(turn - turn[0] + np.angle(1.0 + loop[order][-1]))
    return bool(-270.0 < turn[-1] < 90.0)


def margins(frequency_hz: FloatArray, loop: ComplexArray) -> Margins:
    """Return all margins of an open loop given on ``frequency_hz`` (ascending)."""
    db = magnitude_db(loop)
    phase = phase_deg(loop)
    gain_crossings = _crossings(frequency_hz, db)
    falls = [f for f, sense in gain_crossings if sense < 0]
    phase_margins = [
        ((_at(frequency_hz, phase, f) + 180.0 + 180.0) % 360.0 - 180.0, f)
        for f, _ in gain_crossings
    ]
    gain_margins = []
    lowest, highest = float(np.min(phase)), float(np.max(phase))
    for turns in range(
        int(np.floor((lowest + 180) / 360)), int(np.ceil((highest + 180) / 360)) + 1
    ):
        for f, _ in _crossings(frequency_hz, phase + 180.0 - 360.0 * turns):
            margin = -_at(frequency_hz, db, f)
            if margin > 0:
                gain_margins.append((margin, f))
    s = np.abs(sensitivity(loop))
    worst = int(np.argmax(s))
    smallest_phase = min(phase_margins, key=lambda x: abs(x[0])) if phase_margins else None
    smallest_gain = min(gain_margins) if gain_margins else None
    steady = is_stable(frequency_hz, loop)
    if steady and smallest_phase is not None:
        smallest_phase = (abs(smallest_phase[0]), smallest_phase[1])
    return Margins(
        crossover_hz=falls[-1] if falls else None,
        phase_margin_deg=smallest_phase[0] if smallest_phase else None,
        phase_margin_hz=smallest_phase[1] if smallest_phase else None,
        gain_margin_db=smallest_gain[0] if smallest_gain else None,
        gain_margin_hz=smallest_gain[1] if smallest_gain else None,
        ms=float(s[worst]),
        ms_hz=float(frequency_hz[worst]),
        stable=steady,
    )
