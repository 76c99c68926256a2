"""Logarithmic chirps, repeated without a pause or single.

Source: Novak et al., JAES 63 (2015) 786.
"""

from __future__ import annotations

import numpy as np

from backend.analysis.signals.arrays import FloatArray, IntArray
from backend.analysis.signals.excitation import Excitation, falling_amplitude
from backend.analysis.signals.ramps import cosine_ramp, settled_ramp


def chirp_period(
    sample_rate_hz: float, period_samples: int, f_min_hz: float, f_max_hz: float, realisation: int
) -> FloatArray:
    """Return one period of a logarithmic chirp that is repeated without a pause.

    Realisations differ in direction (up, down) and in the start point of the period.
    """
    t = np.arange(period_samples) / sample_rate_hz
    rate = np.log(f_max_hz / f_min_hz) * sample_rate_hz / period_samples
    signal = np.sin(2 * np.pi * f_min_hz / rate * np.expm1(rate * t))
    if realisation % 2:
        signal = signal[::-1]
    return np.asarray(np.roll(signal, (realisation // 2) * period_samples // 3))


def band_limited(period: FloatArray, lines: IntArray, amplitude: FloatArray) -> FloatArray:
    """Return a period without its bins below the first and above the last line, peak 1.

    ``amplitude`` [len(lines)] weights the remaining bins, interpolated between the lines.
    """
    spectrum = np.fft.rfft(period)
    bins = np.arange(spectrum.size)
    weight = np.interp(bins, lines, amplitude)
    spectrum *= np.where((bins >= lines[0]) & (bins <= lines[-1]), weight, 0.0)
    signal = np.fft.irfft(spectrum, period.size)
    return np.asarray(signal / np.max(np.abs(signal)), dtype=np.float64)


def chirp(
    *,
    sample_rate_hz: float,
    f_min_hz: float,
    f_max_hz: float,
    duration_s: float,
    ramp_s: float = 0.1,
    falloff_corner_hz: float | None = None,
    integrations: int = 0,
) -> Excitation:
    """Return a logarithmic chirp: the same time per octave, optionally with falling amplitude.

    The correction that returns the axis to standstill is spread over the whole signal, where it
    stays far below the measured band.

    Raises:
        ValueError: the frequencies or the length give no signal at this rate.
    """
    n = round(duration_s * sample_rate_hz)
    ramp = min(round(ramp_s * sample_rate_hz), n // 4)
    if n < 16 or not 0 < f_min_hz < f_max_hz < sample_rate_hz / 2:
        raise ValueError("a chirp needs 0 < f_min < f_max < half the sample rate and some length")
    t = np.arange(n) / sample_rate_hz
    rate = np.log(f_max_hz / f_min_hz) / duration_s
    signal = np.sin(2 * np.pi * f_min_hz / rate * np.expm1(rate * t))
    if falloff_corner_hz is not None:
        signal *= falling_amplitude(f_min_hz * np.exp(rate * t), falloff_corner_hz)
    signal[:ramp] *= cosine_ramp(ramp)
    signal[-ramp:] *= cosine_ramp(ramp)[::-1]
    signal = settled_ramp(signal, integrations, (0.0, 0.0))
    return Excitation(
        kind="chirp", samples=signal / np.max(np.abs(signal)), sample_rate_hz=sample_rate_hz
    )
