"""A reported torque (6077h) that is a copy of the demand, beside a closed loop.

The demand is known exactly then, and what the current loop makes of it is not: all torque passes
it, the loop's own part as well. Such a torque is replaced by what an ordinary current loop makes of
it. Without a loop a copy says nothing that the setpoints do not (`identify._by_motion`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from backend.analysis.response.path_fit import PathFit
from backend.analysis.response.sampling import (
    USUAL_CURRENT_HZ,
    Hold,
    SignalPath,
    lag_response,
    sampled_command,
)
from backend.analysis.signals.arrays import FloatArray
from backend.analysis.signals.line_spectra import Record
from backend.analysis.thresholds import reported_demand as threshold


def demand_path(
    records: tuple[Record, ...], path: SignalPath, *, hold_known: bool
) -> SignalPath | None:
    """Return the path of a reported torque that follows the setpoints at once; None if it lags.

    ``path`` as for `find_paths`. The loop's own part shows it too: it has the phase of the speed.
    """
    if any(record.torque is None for record in records):
        return None
    holds: tuple[Hold, ...] = (path.hold,) if hold_known else ("zero", "linear")
    usual = path.current_bandwidth_hz or USUAL_CURRENT_HZ
    at_once, lagging = (
        min((_fit(records, path, corner).best(hold) for hold in holds), key=lambda end: end[1])
        for corner in (threshold.AT_ONCE_HZ, usual)
    )
    return at_once[0] if at_once[1] < threshold.CLEARLY * lagging[1] else None


def with_acting_torque(record: Record, demand: SignalPath, corner_hz: float) -> Record:
    """Return the record with the torque that a current loop of this corner makes of the demand.

    Raises:
        ValueError: the recording has no reported torque.
    """
    if record.torque is None:
        raise ValueError("the recording has no reported torque")
    sent = record.excitation.samples
    own = record.torque - sampled_command(sent, demand)
    acting = replace(demand, current_bandwidth_hz=corner_hz)
    rate_hz = record.excitation.sample_rate_hz
    return replace(record, torque=sampled_command(sent, acting) + _lagging(own, rate_hz, corner_hz))


def _fit(records: tuple[Record, ...], path: SignalPath, corner_hz: float) -> PathFit:
    known = replace(path, current_bandwidth_hz=corner_hz)
    return PathFit.of(records, known, True, None)


def _lagging(torque: FloatArray, rate_hz: float, corner_hz: float) -> FloatArray:
    """A band-limited torque behind a lag; the ends are those of an axis at rest."""
    padded = np.concatenate([np.full(torque.size, torque[0]), torque])
    spectrum = np.fft.rfft(padded - torque[0])
    f = np.fft.rfftfreq(padded.size, 1.0 / rate_hz)
    late = np.fft.irfft(spectrum * lag_response(f, corner_hz), padded.size)
    return np.asarray(late[torque.size :] + torque[0])
