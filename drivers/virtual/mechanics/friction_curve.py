"""What a virtual axis needs of torque at a constant speed: the truth that tests measure against."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from drivers.virtual.mechanics.spec import MechanicsSpec

Array = npt.NDArray[np.float64]


def friction_nm(spec: MechanicsSpec, speed_rad_s: npt.ArrayLike) -> Array:
    """Friction in Nm at constant speeds that are not zero, signed as the motor has to make it."""
    speed, of = np.asarray(speed_rad_s, dtype=np.float64), spec.friction
    slow = np.abs(speed) / of.stribeck_rad_s
    falling = 1.0 - np.tanh(slow) if of.stribeck_law == "tanh" else np.exp(-(slow**2))
    dry = of.coulomb_nm + max(of.static_nm - of.coulomb_nm, 0.0) * falling
    fan = of.fan_nms2 * speed * np.abs(speed)
    return np.asarray(np.sign(speed) * dry + of.viscous_nms * speed + fan)


def ripple_nm(spec: MechanicsSpec, angle_rad: npt.ArrayLike) -> Array:
    """Periodic torque of the motor in Nm by its angle, as the motor has to make it."""
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
