"""Conversion of trajectories to motions of the loop."""

from __future__ import annotations

import array
import math

from drivers.link import Trajectory
from drivers.motion.setpoint_plan import Limits, Motion
from drivers.motion.setpoints import longest_step


def motion_of(trajectory: Trajectory, cycle_s: float) -> Motion:
    """Convert a trajectory checked by `drivers.motion.setpoints.require_playable` to cycles."""
    envelope = trajectory.envelope
    offsets = trajectory.offset_values
    return Motion(
        target=trajectory.target.index or 0,
        values=array.array("q", trajectory.values.tolist()),
        limits=Limits(
            envelope.position_min,
            envelope.position_max,
            envelope.speed_max,
            envelope.torque_max,
            envelope.following_error_max,
            envelope.feedback,
            envelope.torque_off_only,
            envelope.stopped_if_it_runs_on,
        ),
        renew_cycles=max(1, math.ceil(trajectory.renew_s / cycle_s)),
        longest_step=longest_step(trajectory),
        offset=None if trajectory.offset_target is None else trajectory.offset_target.index,
        offset_values=None if offsets is None else array.array("q", offsets.tolist()),
    )
