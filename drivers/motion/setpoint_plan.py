"""A motion for the cyclic loop: setpoints cycle by cycle within an envelope."""

from __future__ import annotations

import array
from collections.abc import Container, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

from drivers import cia402
from drivers.errors import NotAllowed
from drivers.objects.feedback import FeedbackScale
from drivers.texts.message import Text, text

#: The CiA 402-2 objects that a motion commands and monitors.
CONTROL, MODE, POSITION, VELOCITY, TORQUE = 0x6040, 0x6060, 0x607A, 0x60FF, 0x6071
OFFSETS = (0x60B0, 0x60B1, 0x60B2)
STATUS, MODE_SHOWN = 0x6041, 0x6061
ACTUAL_POSITION, ACTUAL_VELOCITY, ACTUAL_TORQUE, FOLLOWING = 0x6064, 0x606C, 0x6077, 0x60F4
MODE_OF = {POSITION: cia402.Mode.CSP, VELOCITY: cia402.Mode.CSV, TORQUE: cia402.Mode.CST}


class Phase(Enum):
    """State of the setpoints of an axis."""

    IDLE = "idle"
    PLAYING = "playing"
    HOLDING = "holding the last setpoint"
    BRAKING = "braking"


@dataclass(frozen=True, slots=True)
class Limits:
    """The envelope in raw drive units; None means no limit of that kind."""

    position_min: float | None = None
    position_max: float | None = None
    speed_max: float | None = None
    torque_max: float | None = None
    following_error_max: float | None = None
    feedback: FeedbackScale | None = None
    torque_off_only: bool = False
    """Beyond a limit a torque only becomes zero, without a quick stop."""
    stopped_if_it_runs_on: bool = False
    """With ``torque_off_only``: a quick stop follows where the shaft does not slow down."""

    def require_watched(self, inputs: Container[int], where: Text, target: int = POSITION) -> None:
        """Check that the actual value of each limit is among these objects of the cyclic data.

        Where 60F4h is missing, the loop computes the following error of a position ``target`` from
        the position.

        Raises:
            NotAllowed: one is missing.
        """
        compared = self.feedback
        lag = FOLLOWING
        if target == POSITION and FOLLOWING not in inputs:
            lag = ACTUAL_POSITION
        for name, index, limit in (
            ("travel", ACTUAL_POSITION, self.position_min),
            ("travel", ACTUAL_POSITION, self.position_max),
            ("speed", ACTUAL_VELOCITY, self.speed_max),
            ("torque", ACTUAL_TORQUE, self.torque_max),
            ("following-error", lag, self.following_error_max),
            ("speed", ACTUAL_POSITION, compared and compared.velocity_per_inc_s),
            ("speed", ACTUAL_VELOCITY, compared and compared.velocity_per_inc_s),
        ):
            if limit is not None and index not in inputs:
                raise NotAllowed(
                    "cyclic.limit-cannot-watched-not", where=where, name=name, index=index
                )


def limits_of(message: Mapping[str, Any]) -> Limits:
    """Create the envelope from the plain values sent by the server's process."""
    feedback = message.get("feedback")
    scale = None if feedback is None else FeedbackScale(**feedback)
    return Limits(**{**message, "feedback": scale})


@dataclass(frozen=True, slots=True)
class Motion:
    """One value per cycle for one target and, optionally, for one offset."""

    target: int
    values: array.array[int]
    limits: Limits
    renew_cycles: int
    longest_step: int
    """Largest change between two values, computed by the server, as the loop lacks the time."""
    offset: int | None = None
    offset_values: array.array[int] | None = None

    def require_mapped(self, outputs: Container[int], where: Text) -> None:
        """Check that target and offset are among these objects of the cyclic data.

        Raises:
            NotAllowed: one is not.
        """
        for index in (self.target, self.offset):
            if index is not None and index not in outputs:
                raise NotAllowed("cyclic.not-cyclic-data", where=where, index=index)

    def require_near(self, now: int, speed: float, where: Text) -> None:
        """Check that the first position is no further away than the longest step that follows.

        ``now`` is the setpoint [increments] and ``speed`` its change in the last cycle.

        Raises:
            NotAllowed: it is further away, so the axis would jump.
        """
        first = self.values[0]
        longest = max(self.longest_step, abs(round(speed)), 1)
        if abs(first - now) > longest:
            raise NotAllowed(
                "cyclic.trajectory-begins-axis-held",
                value=first,
                limit=text("limit.per-cycle", longest=longest),
                where=where,
                now=now,
            )
