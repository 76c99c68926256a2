"""Why a cyclic loop ended a motion by force: a value passed from the loop to a tool's error.

`Halted.text` is its message for people. No code decides by the message: what may be tried
after a halt depends on `Halted.cause` alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Literal, NamedTuple

from drivers.texts.message import Text, as_text, text

Quantity = Literal["position", "speed", "torque", "following error", "skew"]


class HaltCause(Enum):
    """Cause that ended the motion."""

    POSITION = "position"
    """The position left the envelope."""
    SPEED = "speed"
    """The speed was above the envelope's limit."""
    TORQUE = "torque"
    """The torque was above the envelope's limit."""
    FOLLOWING = "following"
    """The following error was above the envelope's limit."""
    SKEW = "skew"
    """The positions of two axes of one machine differed by more than the envelope's limit."""
    PARTNER = "partner"
    """The other axis of the same machine was stopped."""
    EXPIRED = "expired"
    """The setpoints were not renewed in time."""
    LEFT_ENABLED = "left_enabled"
    """The drive left Operation enabled by itself: a fault, an emergency stop, STO, supply."""
    COMMANDED = "commanded"
    """The end was commanded within servodeck: STOP, release, or end of the exchange."""
    LOST = "lost"
    """The process data, the node, the bus or the server's keep-alive was lost."""
    UNFIT = "unfit"
    """A setpoint does not fit its object, so it could not be sent."""
    CONTRADICTION = "contradiction"
    """Two measured quantities contradict each other, such as 606Ch and differences of 6064h."""


class LeftBy(Enum):
    """Cause of leaving Operation enabled, according to the status word."""

    FAULT = "fault"
    """The drive is in a fault or in its fault reaction."""
    QUICK_STOP = "quick_stop"
    """A quick stop that the loop did not command: a terminal, another master, the drive itself."""
    VOLTAGE = "voltage"
    """Bit 4 is 0: main power or STO is gone (CiA 402-2 table 30)."""
    OTHERS = "others"
    """None of these: another master, a terminal or the drive's panel disabled the drive."""


#: Causes that are limits of the envelope.
ENVELOPE_CAUSES = frozenset(
    {
        HaltCause.POSITION,
        HaltCause.SPEED,
        HaltCause.TORQUE,
        HaltCause.FOLLOWING,
        HaltCause.SKEW,
    }
)
_CAUSE_OF: Mapping[Quantity, HaltCause] = {
    "position": HaltCause.POSITION,
    "speed": HaltCause.SPEED,
    "torque": HaltCause.TORQUE,
    "following error": HaltCause.FOLLOWING,
    "skew": HaltCause.SKEW,
}


@dataclass(frozen=True, slots=True)
class Halted:
    """The end of a motion by force.

    ``quantity`` is the monitored quantity; ``value`` and ``limit`` are in raw drive units; all
    three are None where the cause is not a limit. For a contradiction, ``value`` is the speed by
    606Ch and ``limit`` the speed by position, both in raw units of 606Ch. ``left_by`` is set if the
    drive left Operation enabled while the loop ran. ``note`` holds further details, for people
    only.
    """

    cause: HaltCause
    quantity: Quantity | None = None
    value: float | None = None
    limit: float | None = None
    note: str | Text = ""
    left_by: LeftBy | None = None

    @classmethod
    def beyond(cls, quantity: Quantity, value: float, limit: float) -> Halted:
        """Create the halt for a limit of the envelope that was passed."""
        return cls(_CAUSE_OF[quantity], quantity, value, limit)

    @property
    def text(self) -> Text:
        """Message for people: the page, the log and error messages."""
        note = as_text(self.note)
        if self.cause in ENVELOPE_CAUSES and self.value is not None and self.limit is not None:
            return text(
                "motion.beyond-limit",
                quantity=quantity_key(self.quantity),
                value=f"{self.value:g}",
                limit=f"{self.limit:g}",
            )
        if self.cause is HaltCause.EXPIRED:
            return text("motion.expired")
        if self.cause is HaltCause.LEFT_ENABLED:
            by = "" if self.left_by is None else self.left_by.value
            return text("motion.left-enabled", note=note, by=by)
        if self.cause is HaltCause.CONTRADICTION and self.value is not None:
            return text(
                "motion.contradiction", speed=self.value, from_position=self.limit or 0.0, note=note
            )
        if self.cause is HaltCause.PARTNER:
            return text("motion.partner", note=note)
        return note if self.note else text(_TEXTS[self.cause])

    @property
    def words(self) -> str:
        """The same in English."""
        return self.text.words()

    def to_wire(self) -> dict[str, Any]:
        """Return a map of plain values, for a message to another process."""
        return {
            "cause": self.cause.value,
            "quantity": self.quantity,
            "value": self.value,
            "limit": self.limit,
            "note": self.note.to_wire() if isinstance(self.note, Text) else self.note,
            "left_by": None if self.left_by is None else self.left_by.value,
        }

    @classmethod
    def from_wire(cls, wire: Mapping[str, Any]) -> Halted:
        """Restore the value from a map made by `to_wire`.

        Raises:
            ValueError, KeyError: the map was not made by `to_wire`.
        """
        note, left_by = wire["note"], wire["left_by"]
        return cls(
            HaltCause(wire["cause"]),
            wire["quantity"],
            wire["value"],
            wire["limit"],
            Text.from_wire(note) if isinstance(note, Mapping) else note,
            None if left_by is None else LeftBy(left_by),
        )


_TEXTS: Mapping[HaltCause, str] = {
    HaltCause.POSITION: "motion.position",
    HaltCause.SPEED: "motion.speed",
    HaltCause.TORQUE: "motion.torque",
    HaltCause.FOLLOWING: "motion.following",
    HaltCause.SKEW: "motion.skew",
    HaltCause.COMMANDED: "motion.commanded",
    HaltCause.LOST: "motion.lost",
    HaltCause.UNFIT: "motion.unfit",
    HaltCause.CONTRADICTION: "motion.measured-contradict",
}


def quantity_key(quantity: Quantity | None) -> str:
    """Return the name of a quantity as the catalogue uses it to select a text."""
    return (quantity or "").replace(" ", "-")


class LoopState(NamedTuple):
    """State of one axis as the cyclic loop reports it."""

    state: str
    """CiA 402 power state, a value of `drivers.cia402.State`."""
    phase: str
    """State of the setpoints, a value of `drivers.motion.setpoint_plan.Phase`."""
    halted: Halted | None
    """Why the last motion was ended by force; None if it was not."""
