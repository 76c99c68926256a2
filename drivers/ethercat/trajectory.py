"""Trajectories on their way to the host process, checked before anything moves."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
import numpy.typing as npt

from drivers.errors import NotAllowed, OutOfRange
from drivers.ethercat.mapping import TARGETS
from drivers.ethercat.protocol import Message
from drivers.link import Address, Trajectory
from profiles.schema import INTEGER_RANGE


def message_of(trajectory: Trajectory) -> Message:
    """What the host process is told of a trajectory.

    Raises:
        NotAllowed: no set-point for cyclic motion.
        OutOfRange: a value does not fit its object or the envelope.
    """
    if trajectory.target.index not in TARGETS:
        raise NotAllowed(f"{trajectory.target} is not a setpoint for cyclic motion")
    _check_type(trajectory.target, trajectory.values)
    limits = trajectory.envelope
    _check_envelope(trajectory)
    message: Message = {
        "station": trajectory.station,
        "target": trajectory.target.index,
        "values": np.ascontiguousarray(trajectory.values, np.int64).tobytes(),
        "limits": asdict(limits),
        "renew_s": trajectory.renew_s,
        "longest_step": int(np.max(np.abs(np.diff(trajectory.values)), initial=0)),
        "offset": None,
        "offset_values": None,
    }
    if trajectory.offset_target is not None and trajectory.offset_values is not None:
        _check_type(trajectory.offset_target, trajectory.offset_values)
        if len(trajectory.offset_values) != len(trajectory.values):
            raise OutOfRange("offsets and values of a trajectory differ in number")
        message["offset"] = trajectory.offset_target.index
        message["offset_values"] = np.ascontiguousarray(
            trajectory.offset_values, np.int64
        ).tobytes()
    return message


def _check_type(address: Address, values: npt.NDArray[np.int64]) -> None:
    low, high = INTEGER_RANGE[address.type]
    if len(values) and not (low <= int(values.min()) and int(values.max()) <= high):
        raise OutOfRange(
            f"the trajectory goes from {values.min()} to {values.max()}, {address} holds"
            f" {low} to {high}",
            parameter=str(address),
            limit=f"{low}…{high}",
        )


def _check_envelope(trajectory: Trajectory) -> None:
    """What can be known before anything moves: positions inside the travel, torques inside."""
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
