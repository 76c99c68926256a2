"""Bidirectional trapezoids for the identification of inertia and friction, within an envelope."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.analysis.signals.arrays import FloatArray


@dataclass(frozen=True)
class MoveLimits:
    """Envelope of the identification moves, at the motor: rad, rad/s, Nm."""

    travel_rad: float
    speed_rad_s: float
    torque_nm: float


@dataclass(frozen=True)
class Trajectory:
    """Position, velocity and acceleration [n] of a move that ends where it began."""

    position_rad: FloatArray
    velocity_rad_s: FloatArray
    acceleration_rad_s2: FloatArray
    sample_rate_hz: float


def _there_and_back(
    travel: float, speed: float, acceleration: float, dwell_s: float, rate: float
) -> FloatArray:
    """Velocity of one trapezoid forward, a dwell, one back, and a dwell."""
    peak = min(speed, float(np.sqrt(travel * acceleration)))
    ramp = max(2, int(np.ceil(peak / acceleration * rate)))
    cruise = max(0, round((travel / peak - peak / acceleration) * rate))
    up = (np.arange(ramp) + 0.5) / ramp
    one = np.concatenate([up, np.ones(cruise), up[::-1]]) * peak
    rest = np.zeros(round(dwell_s * rate))
    return np.concatenate([one, rest, -one, rest])


def design_moves(
    limits: MoveLimits,
    estimated_inertia_kgm2: float,
    sample_rate_hz: float,
    *,
    friction_nm: float = 0.0,
    repetitions: int = 3,
    smoothing_s: float = 0.01,
    dwell_s: float = 0.05,
) -> Trajectory:
    """Return bidirectional trapezoids inside travel, speed and torque.

    The acceleration uses 70 % of the torque left after friction; every second repetition runs at
    half speed and 60 % of the acceleration, so that viscous and Coulomb friction can be separated.
    ``smoothing_s`` bounds the jerk.

    Raises:
        ValueError: the torque limit does not exceed the friction.
    """
    torque = 0.7 * (limits.torque_nm - friction_nm)
    if torque <= 0:
        raise ValueError(
            f"{limits.torque_nm} Nm do not exceed the friction of {friction_nm} Nm; raise the limit"
        )
    acceleration = torque / estimated_inertia_kgm2
    parts: list[FloatArray] = []
    for i in range(repetitions):
        share = 1.0 if i % 2 == 0 else 0.5
        parts.append(
            _there_and_back(
                0.95 * limits.travel_rad,
                share * limits.speed_rad_s,
                acceleration * (1.0 if i % 2 == 0 else 0.6),
                dwell_s,
                sample_rate_hz,
            )
        )
    velocity: FloatArray = np.concatenate(parts)
    width = max(1, round(smoothing_s * sample_rate_hz))
    velocity = np.convolve(velocity, np.ones(width) / width)
    velocity = velocity - np.sum(velocity) / velocity.size * (velocity != 0)
    # Ramps of whole samples make short moves longer than calculated.
    reached = float(np.ptp(np.cumsum(velocity))) / sample_rate_hz
    velocity = velocity * min(1.0, 0.97 * limits.travel_rad / reached)
    position = np.cumsum(velocity) / sample_rate_hz
    return Trajectory(position, velocity, np.gradient(velocity) * sample_rate_hz, sample_rate_hz)
