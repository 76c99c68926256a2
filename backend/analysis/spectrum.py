"""Spectra and cursor read-outs for the scope."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal as dsp

from backend.analysis.arrays import FloatArray


@dataclass(frozen=True)
class Spectrum:
    """``value`` [n] over ``frequency_hz`` [n]; amplitude (unit) or density (unit²/Hz)."""

    frequency_hz: FloatArray
    value: FloatArray


@dataclass(frozen=True)
class Spectrogram:
    """``value`` [n frequencies, m times], density in unit²/Hz."""

    frequency_hz: FloatArray
    time_s: FloatArray
    value: FloatArray


@dataclass(frozen=True)
class CursorMeasurement:
    """Read-outs of the samples between two cursors; None where the signal has no such thing."""

    minimum: float
    maximum: float
    mean: float
    rms: float
    peak_to_peak: float
    rise_s: float | None
    frequency_hz: float | None


def amplitude_spectrum(samples: FloatArray, sample_rate_hz: float) -> Spectrum:
    """Hann-windowed amplitude spectrum: a sine of peak A on a line reads A; the mean is kept."""
    window = np.hanning(samples.size + 1)[:-1]
    mean = float(np.mean(samples))
    value = np.abs(np.fft.rfft((samples - mean) * window)) * 2.0 / np.sum(window)
    value[0] = abs(mean)
    return Spectrum(np.fft.rfftfreq(samples.size, 1.0 / sample_rate_hz), np.asarray(value))


def power_density(
    samples: FloatArray, sample_rate_hz: float, segment_samples: int | None = None
) -> Spectrum:
    """Welch's power spectral density, Hann windows with half overlap."""
    length = min(samples.size, segment_samples or max(256, samples.size // 8))
    f, value = dsp.welch(samples, sample_rate_hz, nperseg=length)
    return Spectrum(np.asarray(f), np.asarray(value))


def spectrogram(
    samples: FloatArray, sample_rate_hz: float, segment_samples: int = 256
) -> Spectrogram:
    """Density over time, Hann windows with half overlap; times are the centres of the windows."""
    length = min(samples.size, segment_samples)
    f, t, value = dsp.spectrogram(
        samples, sample_rate_hz, window="hann", nperseg=length, noverlap=length // 2
    )
    return Spectrogram(np.asarray(f), np.asarray(t), np.asarray(value))


def _frequency(samples: FloatArray, sample_rate_hz: float) -> float | None:
    """Mean frequency from rising crossings of the mean, with hysteresis against noise."""
    centred = samples - np.mean(samples)
    guard = 0.2 * float(np.max(np.abs(centred), initial=0.0))
    if guard == 0.0:
        return None
    crossings = []
    armed = False
    for i in range(1, centred.size):
        if centred[i] < -guard:
            armed = True
        elif armed and centred[i] > guard:
            below = i - 1
            while below > 0 and centred[below] >= 0:
                below -= 1
            share = -centred[below] / (centred[below + 1] - centred[below])
            crossings.append(below + share)
            armed = False
    if len(crossings) < 2:
        return None
    return float((len(crossings) - 1) * sample_rate_hz / (crossings[-1] - crossings[0]))


def _rise(samples: FloatArray, sample_rate_hz: float) -> float | None:
    """Time of the first rise from 10 % to 90 % of the span."""
    low = float(np.min(samples))
    span = float(np.max(samples)) - low
    if span == 0.0:
        return None
    progress = (samples - low) / span
    top = int(np.argmax(progress >= 0.9))
    under = np.flatnonzero(progress[: top + 1] <= 0.1)
    if under.size == 0 or top == 0:
        return None
    start = int(under[-1])

    def reach(level: float, i: int) -> float:
        return i + float((level - progress[i]) / (progress[i + 1] - progress[i]))

    return (reach(0.9, top - 1) - reach(0.1, start)) / sample_rate_hz


def measure(samples: FloatArray, sample_rate_hz: float) -> CursorMeasurement:
    """All read-outs of the samples between two cursors."""
    if samples.size == 0:
        raise ValueError("there are no samples between the cursors")
    low, high = float(np.min(samples)), float(np.max(samples))
    return CursorMeasurement(
        minimum=low,
        maximum=high,
        mean=float(np.mean(samples)),
        rms=float(np.sqrt(np.mean(samples**2))),
        peak_to_peak=high - low,
        rise_s=_rise(samples, sample_rate_hz),
        frequency_hz=_frequency(samples, sample_rate_hz),
    )
