"""A beam moved by two motors: its specification, exact discretisation and response.

All quantities are at the motor shafts. State ``[θ1, ω1, τ1, θ2, ω2, τ2, b, b', d, d']``: angle,
speed and torque of each motor (first-order current loops), then mean and difference of the beam's
ends. Inputs ``[u1, u2, m1, m2, 1]``: both torque commands, torques on both motors, and a constant
for a beam that is out of square.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field
from scipy.linalg import expm

from drivers.virtual.mechanics.spec import MechanicsSpec

Array = npt.NDArray[np.float64]
STATES, INPUTS = 10, 5
#: Position of the second motor and of the beam among the states.
SECOND, MEAN, DIFFERENCE = 3, 6, 8


class GantrySpec(BaseModel):
    """The beam between the motors of two ``axes``, named as in the bench.

    ``inertia_kgm2`` is that of beam and carriage together for equal motion of both motors;
    ``yaw_inertia_kgm2`` that of the yaw motion, for the difference of its ends. The carriage is
    ``off_centre`` of the span, towards the first axis. Each end is connected to its motor by a
    joint. Guides turn the beam back by ``yaw_stiffness_nm_per_rad`` for the difference of its ends,
    to where that is ``square_error_rad`` (first less second): 0 for a gantry that is square where
    both motors show the same position, as they do at the start.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    axes: tuple[str, str]
    inertia_kgm2: float = Field(gt=0)
    yaw_inertia_kgm2: float = Field(gt=0)
    off_centre: float = Field(default=0.0, ge=-0.5, le=0.5)
    joint_stiffness_nm_per_rad: float = Field(gt=0)
    joint_damping_nms_per_rad: float = Field(default=0.0, ge=0)
    yaw_stiffness_nm_per_rad: float = Field(default=0.0, ge=0)
    yaw_damping_nms_per_rad: float = Field(default=0.0, ge=0)
    square_error_rad: float = 0.0


def _matrices(
    spec: GantrySpec, motors: tuple[MechanicsSpec, MechanicsSpec]
) -> tuple[Array, Array, Array]:
    """Return mass, damping and stiffness of motor 1, motor 2, mean and difference of the ends."""
    beam, off = spec.inertia_kgm2, spec.off_centre
    mass = np.diag(
        [*(m.motor.inertia_kgm2 for m in motors), beam, spec.yaw_inertia_kgm2 + beam * off**2]
    )
    mass[2, 3] = mass[3, 2] = beam * off
    twist = np.array([[1.0, 0.0, -1.0, -0.5], [0.0, 1.0, -1.0, 0.5]])
    square = twist.T @ twist
    stiffness = spec.joint_stiffness_nm_per_rad * square
    damping = spec.joint_damping_nms_per_rad * square
    stiffness[3, 3] += spec.yaw_stiffness_nm_per_rad
    damping[3, 3] += spec.yaw_damping_nms_per_rad
    for place, motor in enumerate(motors):
        damping[place, place] += motor.friction.viscous_nms
    return mass, damping, stiffness


def continuous_gantry(
    spec: GantrySpec,
    motors: tuple[MechanicsSpec, MechanicsSpec],
    current_loops_rad_s: tuple[float, float],
) -> tuple[Array, Array]:
    """Return the continuous matrices."""
    mass, damping, stiffness = _matrices(spec, motors)
    inverse = np.linalg.inv(mass)
    angles, speeds = np.array([0, SECOND, MEAN, DIFFERENCE]), np.array([1, 4, 7, 9])
    a, b = np.zeros((STATES, STATES)), np.zeros((STATES, INPUTS))
    a[angles, speeds] = 1.0
    a[np.ix_(speeds, angles)] = -inverse @ stiffness
    a[np.ix_(speeds, speeds)] = -inverse @ damping
    for place, (torque, corner) in enumerate(zip((2, 5), current_loops_rad_s, strict=True)):
        a[speeds, torque] = inverse[:, place]
        a[torque, torque], b[torque, place] = -corner, corner
        b[speeds, 2 + place] = inverse[:, place]
    b[speeds, 4] = inverse[:, 3] * spec.yaw_stiffness_nm_per_rad * spec.square_error_rad
    return a, b


@lru_cache(maxsize=16)
def discretise_gantry(
    spec: GantrySpec,
    motors: tuple[MechanicsSpec, MechanicsSpec],
    current_loops_rad_s: tuple[float, float],
    step_s: float,
) -> tuple[Array, Array]:
    """Return the zero-order hold by the matrix exponential (Van Loan 1978); do not write to it."""
    a, b = continuous_gantry(spec, motors, current_loops_rad_s)
    block = np.zeros((STATES + INPUTS, STATES + INPUTS))
    block[:STATES, :STATES], block[:STATES, STATES:] = a * step_s, b * step_s
    solved = expm(block)
    return np.ascontiguousarray(solved[:STATES, :STATES]), np.ascontiguousarray(
        solved[:STATES, STATES:]
    )


def gantry_response(
    spec: GantrySpec, motors: tuple[MechanicsSpec, MechanicsSpec], f_hz: npt.ArrayLike
) -> npt.NDArray[np.complex128]:
    """Return torques to speeds of both motors [n, 2, 2] of the linear machine, in (rad/s)/Nm."""
    mass, damping, stiffness = _matrices(spec, motors)
    s = (2j * math.pi * np.asarray(f_hz, dtype=np.float64))[:, None, None]
    return np.asarray(np.linalg.inv(s * mass + damping + stiffness / s)[:, :2, :2])
