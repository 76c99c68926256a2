"""Frequency response from a stepped sine, tone by tone."""

from __future__ import annotations

import numpy as np
import scipy

from backend.analysis.response.frf import Frf, valid_band_hz
from backend.analysis.response.signal_path.sampling import SignalPath
from backend.analysis.signals.line_spectra import (
    LineSpectra,
    Quantity,
    Record,
    continuous_input,
    own_torque,
    tone_amplitudes,
)


def estimate_stepped(record: Record, path: SignalPath, quantity: Quantity) -> Frf:
    """Estimate one complex amplitude per tone of a stepped sine; the two halves give its deviation.

    Raises:
        ValueError: the excitation has no tones.
    """
    e = record.excitation
    f = np.array([segment.frequency_hz for segment in e.segments])
    if f.size == 0:
        raise ValueError("the excitation has no tones")
    own = np.zeros_like(record.response)
    if quantity == "torque_injection":
        own = own_torque(record, path)
    r, y, t = (tone_amplitudes(x, e, [0, 1]) for x in (e.samples, record.response, own))
    spectra = LineSpectra(f, np.arange(f.size), (r,), (y,), (t,), (), (0,), 2, 2, 0)
    u = continuous_input(spectra, path, quantity)[0]
    g = np.asarray(y.sum(axis=0) / u.sum(axis=0))
    relative = np.abs(y[0] / u[0] - y[1] / u[1]) / (2 * np.abs(g))
    spread = float(scipy.special.stdtrit(2, 0.975) / 1.96) / np.sqrt(2)
    cross = np.abs(np.sum(y * r.conj(), axis=0)) ** 2
    powers = np.sum(np.abs(y) ** 2, axis=0) * np.sum(np.abs(r) ** 2, axis=0)
    return Frf(
        frequency_hz=f,
        response=g,
        std_db=20 / np.log(10) * relative * spread,
        std_deg=np.degrees(relative * spread),
        coherence=np.asarray(cross / np.maximum(powers, 1e-300)),
        noise=np.abs(y[0] - y[1]) / 2,
        distortion=np.full(f.shape, np.nan),
        sample_rate_hz=path.sample_rate_hz,
        valid_band_hz=valid_band_hz(float(f.min()), path.sample_rate_hz),
        periods_used=f.size,
        periods_dropped=0,
    )
