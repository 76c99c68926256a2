"""Torque of a virtual axis at constant speed: the reference for tests of measurements."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from drivers.virtual.mechanics.spec import MechanicsSpec

Array = npt.NDArray[np.float64]


def friction_nm(spec: MechanicsSpec, speed_rad_s: npt.ArrayLike) -> Array:
    """Return friction [Nm] at constant non-zero speeds, signed as required of the motor."""
    speed, of = np.asarray(speed_rad_s, dtype=np.float64), spec.friction
    slow = np.abs(speed) / of.stribeck_rad_s
    falling = 1.0 - np.tanh(slow) if of.stribeck_law == "tanh" else np.exp(-(slow**2))
    dry = of.coulomb_nm + max(of.static_nm - of.coulomb_nm, 0.0) * falling
    fan = of.fan_nms2 * speed * np.abs(speed)
    return np.asarray(np.sign(speed) * dry + of.viscous_nms * speed + fan)


def ripple_nm(spec: MechanicsSpec, angle_rad: npt.ArrayLike) -> Array:
    """Return the periodic motor torque [Nm] by its angle, signed as required of the motor."""
    angle, of = np.asarray(angle_rad, dtype=np.float64), spec.ripple
    harmonics = (
        (1, of.revolution_nm),
        (of.pole_pairs, of.pole_pair_nm),
        (of.cogging_per_rev, of.cogging_nm),
        (2 * of.cogging_per_rev, of.cogging_second_nm),
    )
    return np.asarray(
        sum((nm * np.sin(order * angle + of.phase_rad) for order, nm in harmonics), 0.0 * angle)
    )
