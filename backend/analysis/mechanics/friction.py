"""Coulomb friction, from how the realisations of a frequency response differ."""

from __future__ import annotations

import numpy as np
import scipy

from backend.analysis.response.sampling import SignalPath
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
    """Coulomb friction that best explains the scatter between realisations.

    Friction is the one nonlinearity every axis has. Subtracting Tc·sign(v) from the torque
    leaves the linear mechanics; Tc is where the error, as torque, summed over all lines is
    smallest. Zero where realisations do not suffice or nothing is gained.
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
    # By their noise first: behind a coarse encoder the upper lines drown friction, and elsewhere
    # the lower ones show it best. What play does drowns it in all but the lowest.
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
    """Share of the scatter between realisations that is left with this friction removed.

    It shows which of two ways to know the direction of motion is better; 1 without friction.
    """
    if coulomb_nm <= 0.0 or len(s.sent) < 2:
        return 1.0
    plain = continuous_input(s, path, quantity)
    turned = friction_input(s, path, quantity, plain)
    weight = _torque_weight(s, plain)
    before = max(_scatter(0.0, s, plain, turned, weight), 1e-300)
    return _scatter(coulomb_nm, s, plain, turned, weight) / before


def _beyond_chance(s: LineSpectra, share: float, left: float) -> bool:
    """Whether friction is there that makes little of the scatter because noise makes the rest.

    It leaves this ``share`` of the scatter, which is ``left`` in units of one period's noise.
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
    """Friction up to ``limit`` that leaves the least scatter, and the share that it leaves."""
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
    """What no linear mechanics explain with this friction removed, as torque."""
    inputs = [u - coulomb_nm * d for u, d in zip(plain, turned, strict=True)]
    g, _, _ = instrument_estimate(s, inputs)
    errors = np.array(
        [y.mean(axis=0) / g - u.mean(axis=0) for y, u in zip(s.response, inputs, strict=True)]
    )
    return float(np.sum(np.abs(errors) ** 2 * weight))


def _torque_weight(s: LineSpectra, inputs: list[ComplexArray]) -> FloatArray:
    """One over the noise variance of each line as a torque; alike where one period shows none."""
    g, _, _ = instrument_estimate(s, inputs)
    errors = [y / g - u for y, u in zip(s.response, inputs, strict=True)]
    freedom = s.used - len(errors)
    if freedom == 0:
        return np.ones(g.size)
    noise = np.sum([np.sum(np.abs(e - e.mean(axis=0)) ** 2, axis=0) for e in errors], axis=0)
    noise = neighbour_mean(noise / freedom, 3)
    least = threshold.LEAST_NOISE * float(np.median(noise))
    return np.asarray(1.0 / (noise + least)) if least > 0.0 else np.ones(g.size)
