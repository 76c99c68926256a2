"""Power spectral density."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from backend.analysis.signals.arrays import FloatArray


@dataclass(frozen=True)
class Spectrum:
    """``value`` [n] in unit²/Hz over ``frequency_hz`` [n]."""

    frequency_hz: FloatArray
    value: FloatArray


def power_density(
    samples: FloatArray, sample_rate_hz: float, segment_samples: int | None = None
) -> Spectrum:
    """Return Welch's power spectral density, with Hann windows and half overlap."""
    length = min(samples.size, segment_samples or max(256, samples.size // 8))
    f, value = scipy.signal.welch(samples, sample_rate_hz, nperseg=length)
    return Spectrum(np.asarray(f), np.asarray(value))
