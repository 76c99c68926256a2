"""Frequency response from what has no period: Welch's method, and a stepped sine tone by tone."""

from __future__ import annotations

import numpy as np
from scipy.stats import t as student_t

from backend.analysis.arrays import ComplexArray
from backend.analysis.frf import Frf, valid_band_hz
from backend.analysis.line_spectra import (
    LineSpectra,
    Quantity,
    Record,
    continuous_input,
    own_torque,
    tone_amplitudes,
)
from backend.analysis.sampling import SignalPath


def estimate_aperiodic(
    records: tuple[Record, ...],
    path: SignalPath,
    quantity: Quantity,
    *,
    segment_samples: int,
    f_min_hz: float,
    f_max_hz: float,
    jitter_s: float = 0.0,
) -> Frf:
    """Welch's averaged cross spectra (IEEE Trans. AU-15 (1967) 70) with the same instrument.

    For chirps and anything without periods; Hann windows with half overlap. Segments with a gap
    are left out.
    """
    window = np.hanning(segment_samples + 1)[:-1]
    f = np.fft.rfftfreq(segment_samples, 1.0 / path.sample_rate_hz)
    keep = (f >= f_min_hz) & (f <= f_max_hz) & (f > 0)
    if not np.any(keep):
        raise ValueError("no frequency of the segments lies in the wanted band")
    sent: list[ComplexArray] = []
    response: list[ComplexArray] = []
    torque: list[ComplexArray] = []
    dropped = 0
    for record in records:
        own = np.zeros_like(record.response)
        if quantity == "torque_injection":
            own = own_torque(record, path)
        last = record.response.size - segment_samples
        for start in range(0, last + 1, segment_samples // 2):
            piece = slice(start, start + segment_samples)
            if record.valid is not None and not np.all(record.valid[piece]):
                dropped += 1
                continue
            for store, signal in (
                (sent, record.excitation.samples),
                (response, record.response),
                (torque, own),
            ):
                store.append(np.fft.rfft(window * (signal[piece] - signal[piece].mean()))[keep])
    if not sent:
        raise ValueError("no whole segment without a gap; record longer or shorten the segments")
    f = f[keep]
    lines = np.flatnonzero(keep).astype(np.int64)
    r, y = np.array(sent), np.array(response)
    spectra = LineSpectra(
        f, lines, (r,), (y,), (np.array(torque),), (), (0,), segment_samples, len(sent), dropped
    )
    u = continuous_input(spectra, path, quantity)[0]
    s_yr = np.sum(y * r.conj(), axis=0)
    s_ur = np.sum(u * r.conj(), axis=0)
    coherence = np.abs(s_yr) ** 2 / np.maximum(
        np.sum(np.abs(r) ** 2, axis=0) * np.sum(np.abs(y) ** 2, axis=0), 1e-300
    )
    # Bendat & Piersol, table 9.6; Hann segments with half overlap count 0.53 each (Welch).
    averages = max(1.0, 0.53 * len(sent))
    one_sided = np.sqrt(np.maximum(1 - coherence, 1e-12) / (2 * coherence * averages))
    error = y - (s_yr / s_ur) * u
    return Frf(
        frequency_hz=f,
        response=np.asarray(s_yr / s_ur, dtype=np.complex128),
        std_db=np.asarray(20 / np.log(10) * one_sided),
        std_deg=np.asarray(np.degrees(one_sided)),
        coherence=np.asarray(coherence),
        noise=np.sqrt(np.mean(np.abs(error) ** 2, axis=0)) * 2 / np.sum(window),
        distortion=np.full(f.shape, np.nan),
        sample_rate_hz=path.sample_rate_hz,
        valid_band_hz=valid_band_hz(float(f[0]), path.sample_rate_hz, jitter_s=jitter_s),
        periods_used=len(sent),
        periods_dropped=dropped,
    )


def estimate_stepped(record: Record, path: SignalPath, quantity: Quantity) -> Frf:
    """One complex amplitude per tone of a stepped sine; the halves of a tone give the spread."""
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
    spread = float(student_t.ppf(0.975, 2) / 1.96) / np.sqrt(2)
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
