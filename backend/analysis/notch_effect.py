"""What a notch in the path of the torque does, seen in the reported torque. Pure.

The same torque is played with and without the notch, with no loop closed. The ratio of the two
reported torques is the notch, blurred by what sampling folds back: the held set-points contain
images of every line above half the sample rate, which pass the notch untouched, so that a deep
notch looks shallow. The shape is therefore fitted through hold and sampling.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from backend.analysis.arrays import ComplexArray, FloatArray
from backend.analysis.notch import Notch
from backend.analysis.sampling import SignalPath, command_response

#: Images that are counted on each side, multiples of the sample rate.
_IMAGES = 25
#: A depth that cannot be told from a deeper one.
_DEEPEST_DB = -45.0


@dataclass(frozen=True)
class NotchEffect:
    """The notch that explains a measured ratio, and what is left of it (median, relative)."""

    notch: Notch
    error: float


def seen_ratio(notch: Notch, frequency_hz: FloatArray, path: SignalPath) -> ComplexArray:
    """Ratio of the sampled torques with and without a notch."""
    orders = np.arange(-_IMAGES, _IMAGES + 1)[:, None] * path.sample_rate_hz
    f = frequency_hz[None, :] + orders
    direct = command_response(f, path)
    # One line's image k carries the phase of the line itself: the sequence is the same.
    return np.asarray(np.sum(direct * notch.response(f), axis=0) / np.sum(direct, axis=0))


def fit_effect(frequency_hz: FloatArray, ratio: ComplexArray, path: SignalPath) -> NotchEffect:
    """Centre, width and depth behind a measured ratio of sampled torques.

    Raises:
        ValueError: nothing like a notch is seen.
    """
    f = np.asarray(frequency_hz, np.float64)
    lowest = int(np.argmin(np.abs(ratio)))
    if abs(ratio[lowest]) > 0.93:
        raise ValueError("the notch has no effect that can be seen in the torque")
    centre = float(f[lowest])

    def notch_of(x: FloatArray) -> Notch:
        depth = max(-float(np.exp(x[2])), _DEEPEST_DB)
        return Notch(float(np.exp(x[0])), float(np.exp(x[1])), depth)

    def rest(x: FloatArray) -> FloatArray:
        error = (seen_ratio(notch_of(x), f, path) - ratio) / (np.abs(ratio) + 0.05)
        return np.concatenate([error.real, error.imag])

    low = np.log([0.7 * centre, 0.01 * centre, 0.3])
    high = np.log([1.4 * centre, 4.0 * centre, -_DEEPEST_DB])
    fits = [
        least_squares(
            rest, np.log([centre, share * centre, depth]), bounds=(low, high), loss="soft_l1",
            f_scale=0.1, max_nfev=60,
        )
        for share in (0.05, 0.3, 1.0) for depth in (8.0, 25.0)
    ]  # fmt: skip
    best = min(fits, key=lambda fit: float(fit.cost))
    found = notch_of(best.x)
    error = np.abs(seen_ratio(found, f, path) - ratio)
    return NotchEffect(found, float(np.median(error)))
