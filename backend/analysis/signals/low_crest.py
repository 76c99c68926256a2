"""Phases of a multisine for a low crest factor.

Source: Guillaume et al., IEEE Trans. Instrum. Meas. 40 (1991) 982.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy

from backend.analysis.signals.arrays import FloatArray, IntArray


def low_crest_period(
    n: int, lines: IntArray, amplitude: FloatArray, seed: int, iterations: int
) -> FloatArray:
    """Return `_optimised_period` from a cache, as a copy that the caller may change."""
    whole = (lines.astype(np.int64).tobytes(), amplitude.astype(np.float64).tobytes())
    return _optimised_period(n, *whole, seed, iterations).copy()


@lru_cache(maxsize=32)
def _optimised_period(
    n: int, lines_bytes: bytes, amplitude_bytes: bytes, seed: int, iterations: int
) -> FloatArray:
    """One period with the given line amplitudes, peak 1, phases chosen for a low crest factor.

    Minimises the 2p-norm of the signal for growing p (Guillaume et al., IEEE Trans. Instrum.
    Meas. 40 (1991) 982). The search starts at random phases, so different seeds stay
    independent realisations.
    """
    lines = np.frombuffer(lines_bytes, np.int64)
    amplitude = np.frombuffer(amplitude_bytes, np.float64)
    rng = np.random.default_rng(seed)
    scale = n * amplitude / (2.0 * np.sqrt(np.sum(amplitude**2) / 2.0))

    def signal_of(phases: FloatArray) -> FloatArray:
        spectrum = np.zeros(n // 2 + 1, dtype=np.complex128)
        spectrum[lines] = scale * np.exp(1j * phases)
        return np.fft.irfft(spectrum, n)

    def norm(phases: FloatArray, power: int) -> tuple[float, FloatArray]:
        signal = signal_of(phases)
        peak = float(np.max(np.abs(signal)))
        ratio = signal / peak
        total = float(np.mean(ratio**power))
        pull = np.fft.rfft(ratio ** (power - 1))[lines] / n
        slope = 2.0 / n * np.imag(pull * np.conj(scale * np.exp(1j * phases)))
        # log of the norm: its scale does not depend on p, which keeps the line search easy
        return float(np.log(peak) + np.log(total) / power), slope / (peak * total)

    best = rng.uniform(0, 2 * np.pi, lines.size)
    for power in (4, 8, 16, 40):
        best = scipy.optimize.minimize(
            norm, best, (power,), "L-BFGS-B", jac=True, options={"maxiter": iterations // 4}
        ).x
    signal = signal_of(best)
    return np.asarray(signal / np.max(np.abs(signal)), dtype=np.float64)
