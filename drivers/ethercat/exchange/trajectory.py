"""Messages with trajectories for the host process, checked before anything moves."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from drivers.ethercat.process.protocol import Message
from drivers.link import Trajectory
from drivers.motion.setpoints import longest_step, require_playable


def message_of(trajectory: Trajectory) -> Message:
    """Check a trajectory and convert it to a message for the host process.

    Raises:
        NotAllowed: the target is not a setpoint of cyclic motion.
        OutOfRange: a value does not fit its object or the envelope.
    """
    require_playable(trajectory)
    message: Message = {
        "station": trajectory.station,
        "target": trajectory.target.index,
        "values": np.ascontiguousarray(trajectory.values, np.int64).tobytes(),
        "limits": asdict(trajectory.envelope),
        "renew_s": trajectory.renew_s,
        "longest_step": longest_step(trajectory),
        "offset": None,
        "offset_values": None,
    }
    if trajectory.offset_target is not None and trajectory.offset_values is not None:
        message["offset"] = trajectory.offset_target.index
        message["offset_values"] = np.ascontiguousarray(
            trajectory.offset_values, np.int64
        ).tobytes()
    return message
