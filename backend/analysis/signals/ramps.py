"""Ramps into and out of an excitation, after which an ideal axis is at standstill at its start."""

from __future__ import annotations

import numpy as np

from backend.analysis.signals.arrays import FloatArray


def cosine_ramp(n: int) -> FloatArray:
    """Return a ramp from 0 to 1 over n samples, both ends flat."""
    return 0.5 - 0.5 * np.cos(np.pi * (np.arange(n) + 0.5) / n)


def settled_ramp(ramp: FloatArray, integrations: int, targets: tuple[float, float]) -> FloatArray:
    """Add smooth bumps so that the running sum and double sum end at ``targets``."""
    if integrations == 0:
        return ramp
    t = (np.arange(ramp.size) + 0.5) / ramp.size
    bumps = [np.sin(np.pi * t) ** 2, np.sin(np.pi * t) ** 2 * (1 - 2 * t)][:integrations]

    def ends(x: FloatArray) -> list[float]:
        first = np.cumsum(x)
        return [float(first[-1]), float(np.sum(first))][:integrations]

    matrix = np.array([ends(b) for b in bumps]).T
    missing = np.array(targets[:integrations]) - np.array(ends(ramp))
    weights = np.linalg.solve(matrix, missing)
    return np.asarray(ramp + sum(w * b for w, b in zip(weights, bumps, strict=True)))


def ramped_periods(
    period: FloatArray, periods: int, ramp_samples: int, integrations: int
) -> FloatArray:
    """Return ramp in, ``periods`` repetitions, ramp out; the axis ends where it began."""
    n = period.size
    if ramp_samples == 0:
        return np.tile(period, periods)
    lead: FloatArray = period[np.arange(-ramp_samples, 0) % n] * cosine_ramp(ramp_samples)
    tail: FloatArray = period[np.arange(ramp_samples) % n] * cosine_ramp(ramp_samples)[::-1]
    # The steady state at the end of the ramp in: zero-mean velocity and position.
    velocity: FloatArray = np.cumsum(period)
    velocity -= np.mean(velocity)
    position: FloatArray = np.cumsum(velocity)
    position -= np.mean(position)
    if integrations == 1:
        lead = settled_ramp(lead, 1, (float(velocity[-1]), 0.0))
        tail = settled_ramp(tail, 1, (-float(velocity[-1]), 0.0))
    elif integrations == 2:
        v_end, x_end = float(velocity[-1]), float(position[-1])
        lead = settled_ramp(lead, 2, (v_end, x_end))
        # During the tail the double sum starts from the steady state, not from zero.
        tail = settled_ramp(tail, 2, (-v_end, -x_end - v_end * ramp_samples))
    return np.concatenate([lead, np.tile(period, periods), tail])
