"""A reported torque (6077h) that is a copy of the demand, with a closed loop.

The demand is known exactly then, and what the current loop makes of it is not: all torque passes
it, the loop's own part as well. Such a torque is replaced by what an ordinary current loop makes of
it. Without a loop a copy says nothing that the setpoints do not (`identify._by_motion`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from backend.analysis.response.signal_path.path_fit import PathFit
from backend.analysis.response.signal_path.sampled_model import SampledFit, Sampler
from backend.analysis.response.signal_path.sampling import (
    USUAL_CURRENT_HZ,
    Hold,
    SignalPath,
    delay_response,
    lag_response,
    sampled_command,
)
from backend.analysis.signals.arrays import ComplexArray, FloatArray
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


def with_acting_torque(
    record: Record, demand: SignalPath, corner_hz: float, motion: SampledFit | None = None
) -> Record:
    """Return the record with the torque that a current loop of this corner makes of the demand.

    ``motion`` is an earlier fit: what is folded back of the loop's own part lags by more than its
    line does.

    Raises:
        ValueError: the recording has no reported torque.
    """
    if record.torque is None:
        raise ValueError("the recording has no reported torque")
    sent = record.excitation.samples
    own = record.torque - sampled_command(sent, demand)
    acting = sampled_command(sent, replace(demand, current_bandwidth_hz=corner_hz))
    rate_hz = record.excitation.sample_rate_hz
    return replace(record, torque=acting + _lagging(own, rate_hz, corner_hz, motion))


def _fit(records: tuple[Record, ...], path: SignalPath, corner_hz: float) -> PathFit:
    known = replace(path, current_bandwidth_hz=corner_hz)
    return PathFit.of(records, known, True, None)


def _lagging(
    torque: FloatArray, rate_hz: float, corner_hz: float, motion: SampledFit | None
) -> FloatArray:
    """A sampled torque behind a lag; the ends are those of an axis at rest."""
    padded = np.concatenate([np.full(torque.size, torque[0]), torque])
    spectrum = np.fft.rfft(padded - torque[0])
    f = np.fft.rfftfreq(padded.size, 1.0 / rate_hz)[1:]
    lag = lag_response(f, corner_hz) if motion is None else _folded_lag(f, corner_hz, motion)
    late = np.fft.irfft(spectrum * np.concatenate([[1.0], lag]), padded.size)
    return np.asarray(late[torque.size :] + torque[0])


def _folded_lag(f: FloatArray, corner_hz: float, motion: SampledFit) -> ComplexArray:
    """What a lag makes of the loop's own sampled torque, images included."""
    path = replace(motion.path, current_bandwidth_hz=corner_hz)
    sampler = Sampler.of(f, path, motion.loop)
    whole = sampler.frequency_hz
    plant = motion.model.response(whole) * delay_response(whole, motion.delay_s)
    own = sampler.controller * plant * sampler.torque / (1.0 + sampler.controller * plant)
    without = own / lag_response(whole, corner_hz)
    return np.asarray(np.sum(own, axis=0) / np.sum(without, axis=0))
