"""Fit of the controller of a closed loop, from its own torque and the velocity."""

from __future__ import annotations

import numpy as np

from backend.analysis.mechanics.mechanical_model import TURN
from backend.analysis.response.signal_path.sampled_model import LoopModel
from backend.analysis.response.signal_path.sampling import (
    DIRECT_SHARE,
    SignalPath,
    delay_response,
    lag_response,
)
from backend.analysis.signals.arrays import ComplexArray, FloatArray


def fit_loop(
    frequency_hz: FloatArray, own_torque: ComplexArray, velocity: ComplexArray, path: SignalPath
) -> LoopModel:
    """Fit the controller of a closed loop to its own torque and the velocity on the lines.

    ``own_torque`` and ``velocity`` are cross spectra with the injection. Only lines well below
    half the sample rate are used, since both are sampled signals.

    Raises:
        ValueError: fewer than 6 lines lie below 0.15 of the sample rate.
    """
    use = frequency_hz <= 0.6 * DIRECT_SHARE * path.sample_rate_hz
    if np.count_nonzero(use) < 6:
        raise ValueError("fewer than 6 lines below 0.15 of the sample rate")
    f = frequency_hz[use]
    s = 1j * TURN * f
    known = lag_response(f, path.current_bandwidth_hz) * delay_response(f, path.loop_delay_s)
    reference = -own_torque[use] / velocity[use] / known
    a = np.column_stack([np.ones(f.size), 1.0 / s, 1.0 / s**2]) / np.abs(reference)[:, None]
    b = reference / np.abs(reference)
    matrix, target = np.vstack([a.real, a.imag]), np.concatenate([b.real, b.imag])
    # Robust reweighting: single lines spoilt by friction must not bias the gains.
    row: FloatArray = np.ones(target.size)
    c: FloatArray = np.zeros(3)
    for _ in range(4):
        c = np.linalg.lstsq(matrix * row[:, None], target * row, rcond=None)[0]
        error = np.abs(target - matrix @ c)
        row = 1.0 / np.sqrt(1.0 + (error / max(float(np.median(error)), 1e-9) / 2.0) ** 2)
    return LoopModel(float(c[0]), float(c[1]), float(c[2]))
