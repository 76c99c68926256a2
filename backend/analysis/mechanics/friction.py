"""Coulomb friction, from the differences between realisations of a frequency response."""

from __future__ import annotations

import numpy as np
import scipy

from backend.analysis.response.signal_path.sampling import SignalPath
from backend.analysis.signals.arrays import ComplexArray, FloatArray, neighbour_mean
from backend.analysis.signals.line_spectra import (
    LineSpectra,
    Quantity,
    continuous_input,
    friction_input,
    instrument_estimate,
)
from backend.analysis.thresholds import friction as threshold


def estimate_coulomb(s: LineSpectra, path: SignalPath, quantity: Quantity) -> float:
    """Return the Coulomb friction that best explains the scatter between realisations.

    Coulomb friction is the nonlinearity that every axis has. Subtracting Tc·sign(v) from the torque
    leaves the linear mechanics; Tc minimises the error, as torque, summed over all lines. Zero
    where there are too few realisations or the scatter is not reduced.
    """
    if len(s.sent) < 2:
        return 0.0
    plain = continuous_input(s, path, quantity)
    turned = friction_input(s, path, quantity, plain)
    torques = plain if quantity != "closed_loop" else s.torque
    if not torques:
        return 0.0
    limit = float(
        max(np.median(np.abs(u)) for u in torques) / s.samples * 2.0 * np.sqrt(s.lines.size)
    )
    if limit <= 0.0:
        return 0.0
    # First with weights by noise: behind a coarse encoder noise at the upper lines hides friction,
    # otherwise the lower lines show it best. Backlash hides it at all but the lowest lines.
    low = np.asarray(s.frequency_hz <= threshold.LOWEST * s.frequency_hz[0], dtype=np.float64)
    by_noise = _torque_weight(s, plain)
    found, share = _least(s, plain, turned, by_noise, limit)
    left = _scatter(found, s, plain, turned, by_noise)
    if share < threshold.WORTH_TAKING or _beyond_chance(s, share, left):
        return found
    for weight in (np.ones(s.frequency_hz.size), low):
        found, share = _least(s, plain, turned, weight, limit)
        if share < threshold.WORTH_TAKING:
            return found
    return 0.0


def scatter_left(s: LineSpectra, path: SignalPath, quantity: Quantity, coulomb_nm: float) -> float:
    """Return the share of the scatter between realisations left after subtracting this friction.

    It shows which of two estimates of the direction of motion is better; 1 without friction.
    """
    if coulomb_nm <= 0.0 or len(s.sent) < 2:
        return 1.0
    plain = continuous_input(s, path, quantity)
    turned = friction_input(s, path, quantity, plain)
    weight = _torque_weight(s, plain)
    before = max(_scatter(0.0, s, plain, turned, weight), 1e-300)
    return _scatter(coulomb_nm, s, plain, turned, weight) / before


def _beyond_chance(s: LineSpectra, share: float, left: float) -> bool:
    """Whether friction reduces the scatter by more than chance although noise is most of it.

    With friction this ``share`` of the scatter is left, which is ``left`` in units of one period's
    noise.
    """
    periods = s.used / len(s.sent)
    if periods <= 1.0:
        return False
    freedom = 2 * s.frequency_hz.size * (len(s.sent) - 1)
    only_noise = 2.0 * left * periods < threshold.NOISE_ONLY * freedom
    return only_noise and (1.0 / share - 1.0) * freedom > threshold.BY_NO_CHANCE


def _least(
    s: LineSpectra,
    plain: list[ComplexArray],
    turned: list[ComplexArray],
    weight: FloatArray,
    limit: float,
) -> tuple[float, float]:
    """Friction up to ``limit`` with the least scatter, and the share of the scatter left."""
    found = scipy.optimize.minimize_scalar(
        _scatter, bounds=(0.0, limit), method="bounded", args=(s, plain, turned, weight)
    )
    before = max(_scatter(0.0, s, plain, turned, weight), 1e-300)
    return float(found.x), max(float(found.fun) / before, 1e-12)


def _scatter(
    coulomb_nm: float,
    s: LineSpectra,
    plain: list[ComplexArray],
    turned: list[ComplexArray],
    weight: FloatArray,
) -> float:
    """Scatter, as torque, that linear mechanics do not explain with this friction removed."""
    inputs = [u - coulomb_nm * d for u, d in zip(plain, turned, strict=True)]
    g, _, _ = instrument_estimate(s, inputs)
    errors = np.array(
        [y.mean(axis=0) / g - u.mean(axis=0) for y, u in zip(s.response, inputs, strict=True)]
    )
    return float(np.sum(np.abs(errors) ** 2 * weight))


def _torque_weight(s: LineSpectra, inputs: list[ComplexArray]) -> FloatArray:
    """Inverse noise variance of each line as a torque; equal where a single period shows none."""
    g, _, _ = instrument_estimate(s, inputs)
    errors = [y / g - u for y, u in zip(s.response, inputs, strict=True)]
    freedom = s.used - len(errors)
    if freedom == 0:
        return np.ones(g.size)
    noise = np.sum([np.sum(np.abs(e - e.mean(axis=0)) ** 2, axis=0) for e in errors], axis=0)
    noise = neighbour_mean(noise / freedom, 3)
    least = threshold.LEAST_NOISE * float(np.median(noise))
    return np.asarray(1.0 / (noise + least)) if least > 0.0 else np.ones(g.size)
