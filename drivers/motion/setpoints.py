"""Checks of a trajectory, common to all buses, before anything moves."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from drivers.errors import NotAllowed, OutOfRange
from drivers.link import Address, Trajectory
from profiles.schema import INTEGER_RANGE

#: Targets of cyclic motion (CiA 402-2: CSP, CSV, CST) and the limit that applies to each.
TARGETS = {0x607A: "position", 0x60FF: "velocity", 0x6071: "torque"}


def require_playable(trajectory: Trajectory) -> None:
    """Check every value against its object and the envelope; on every bus before anything is sent.

    Raises:
        NotAllowed: the target is not a setpoint of cyclic motion.
        OutOfRange: a value does not fit its object or the envelope, there are no values, or values
            and offsets differ in number.
    """
    require_fits(trajectory)
    require_within_envelope(trajectory)


def require_fits(trajectory: Trajectory) -> None:
    """Check that every value fits its object, and that offsets, if any, match in number.

    Raises:
        NotAllowed: the target is not a setpoint of cyclic motion.
        OutOfRange: a value does not fit, or values and offsets differ in number.
    """
    if trajectory.target.index not in TARGETS or trajectory.target.subindex:
        raise NotAllowed(
            "cyclic.not-setpoint-cyclic-motion",
            parameter=str(trajectory.target),
            target=str(trajectory.target),
        )
    _check_type(trajectory.target, trajectory.values)
    if trajectory.offset_target is not None and trajectory.offset_values is not None:
        _check_type(trajectory.offset_target, trajectory.offset_values)
        if len(trajectory.offset_values) != len(trajectory.values):
            raise OutOfRange("cyclic.offsets-values-trajectory-differ")


def longest_step(trajectory: Trajectory) -> int:
    """Return the largest change between two values [raw units of the target]; 0 for one value."""
    return int(np.max(np.abs(np.diff(trajectory.values)), initial=0))


def _check_type(address: Address, values: npt.NDArray[np.int64]) -> None:
    low, high = INTEGER_RANGE[address.type]
    if len(values) and not (low <= int(values.min()) and int(values.max()) <= high):
        raise OutOfRange(
            "cyclic.trajectory-goes-holds",
            parameter=str(address),
            limit=f"{low}…{high}",
            min_values=values.min(),
            max_values=values.max(),
            address=str(address),
            low=low,
            high=high,
        )


def require_within_envelope(trajectory: Trajectory) -> None:
    """Check before any motion that the position, velocity or torque values are in the envelope.

    Raises:
        OutOfRange: a value is outside the envelope, or there are no values.
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
        raise OutOfRange("cyclic.trajectory-without-values-2")
    if (low is not None and values.min() < low) or (high is not None and values.max() > high):
        raise OutOfRange(
            "cyclic.setpoints-go-envelope-allows",
            parameter=str(trajectory.target),
            limit=f"{low}…{high}",
            kind=kind,
            min_values=values.min(),
            max_values=values.max(),
            low=low,
            high=high,
        )
