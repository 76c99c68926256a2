"""What every bus requires of a trajectory before anything moves."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from drivers.errors import NotAllowed, OutOfRange
from drivers.link import Address, Trajectory
from profiles.schema import INTEGER_RANGE

#: Targets of cyclic motion (CiA 402-2: CSP, CSV, CST) and the limit that bounds each.
TARGETS = {0x607A: "position", 0x60FF: "velocity", 0x6071: "torque"}


def require_fits(trajectory: Trajectory) -> None:
    """Every value fits its object, and each has its offset where there are any.

    Raises:
        NotAllowed: no setpoint for cyclic motion.
        OutOfRange: a value does not fit, or values and offsets differ in number.
    """
    if trajectory.target.index not in TARGETS or trajectory.target.subindex:
        raise NotAllowed(
            f"{trajectory.target} is not a setpoint for cyclic motion",
            parameter=str(trajectory.target),
            remedy="play a position, velocity or torque",
        )
    _check_type(trajectory.target, trajectory.values)
    if trajectory.offset_target is not None and trajectory.offset_values is not None:
        _check_type(trajectory.offset_target, trajectory.offset_values)
        if len(trajectory.offset_values) != len(trajectory.values):
            raise OutOfRange("offsets and values of a trajectory differ in number")


def longest_step(trajectory: Trajectory) -> int:
    """The largest change between two values [raw units of the target]; 0 of a single one."""
    return int(np.max(np.abs(np.diff(trajectory.values)), initial=0))


def _check_type(address: Address, values: npt.NDArray[np.int64]) -> None:
    low, high = INTEGER_RANGE[address.type]
    if len(values) and not (low <= int(values.min()) and int(values.max()) <= high):
        raise OutOfRange(
            f"the trajectory goes from {values.min()} to {values.max()}, {address} holds"
            f" {low} to {high}",
            parameter=str(address),
            limit=f"{low}…{high}",
        )


def require_within_envelope(trajectory: Trajectory) -> None:
    """What can be known before anything moves: positions inside the travel, torques inside.

    Raises:
        OutOfRange: a value is beyond the envelope, or there is none.
    """
    kind = TARGETS[trajectory.target.index or 0]
    values, limits = trajectory.values, trajectory.envelope
    low: float | None = None
    high: float | None = None
    if kind == "position":
        low, high = limits.position_min, limits.position_max
    elif kind == "velocity" and limits.speed_max is not None:
        low, high = -limits.speed_max, limits.speed_max
    elif kind == "torque" and limits.torque_max is not None:
        low, high = -limits.torque_max, limits.torque_max
    if not len(values):
        raise OutOfRange("a trajectory without values")
    if (low is not None and values.min() < low) or (high is not None and values.max() > high):
        raise OutOfRange(
            f"the {kind} setpoints go from {values.min()} to {values.max()}, the envelope allows"
            f" {low} to {high}",
            parameter=str(trajectory.target),
            limit=f"{low}…{high}",
            remedy="shorten the move or widen the envelope",
        )
