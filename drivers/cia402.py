"""The CiA 402 power state machine, its control word and its status word, as pure functions.

Sources: CiA 402-2 (IEC 61800-7-201) clauses 8.3–8.5; manual 003 lines 279–320 for the status
word that echoes the control word.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntEnum


class State(Enum):
    """Power states (CiA 402-2 table 28); the value is the name displayed."""

    NOT_READY = "Not ready to switch on"
    SWITCH_ON_DISABLED = "Switch on disabled"
    READY = "Ready to switch on"
    SWITCHED_ON = "Switched on"
    OPERATION_ENABLED = "Operation enabled"
    QUICK_STOP_ACTIVE = "Quick stop active"
    FAULT_REACTION = "Fault reaction active"
    FAULT = "Fault"
    UNKNOWN = "Unknown"


class Mode(IntEnum):
    """Modes of operation (6060h)."""

    NONE = 0
    PP = 1
    VL = 2
    PV = 3
    PT = 4
    HM = 6
    IP = 7
    CSP = 8
    CSV = 9
    CST = 10


MODE_NAMES = {
    Mode.NONE: "No mode",
    Mode.PP: "Profile position",
    Mode.VL: "Velocity",
    Mode.PV: "Profile velocity",
    Mode.PT: "Profile torque",
    Mode.HM: "Homing",
    Mode.IP: "Interpolated position",
    Mode.CSP: "Cyclic synchronous position",
    Mode.CSV: "Cyclic synchronous velocity",
    Mode.CST: "Cyclic synchronous torque",
}

#: Bit number of each mode in 6502h, supported drive modes.
SUPPORTED_MODE_BIT = {
    Mode.PP: 0, Mode.VL: 1, Mode.PV: 2, Mode.PT: 3, Mode.HM: 5,
    Mode.IP: 6, Mode.CSP: 7, Mode.CSV: 8, Mode.CST: 9,
}  # fmt: skip

SHUTDOWN = 0x0006
SWITCH_ON = 0x0007
ENABLE_OPERATION = 0x000F
DISABLE_VOLTAGE = 0x0000
QUICK_STOP = 0x0002
FAULT_RESET = 0x0080
NEW_SET_POINT = 0x0010
CHANGE_IMMEDIATELY = 0x0020
RELATIVE = 0x0040
HALT = 0x0100

STATUS_VOLTAGE_ENABLED = 1 << 4
STATUS_WARNING = 1 << 7
STATUS_REMOTE = 1 << 9
STATUS_TARGET_REACHED = 1 << 10
STATUS_INTERNAL_LIMIT = 1 << 11
STATUS_SET_POINT_ACKNOWLEDGE = 1 << 12
STATUS_HOMING_ATTAINED = 1 << 12
STATUS_FOLLOWING_ERROR = 1 << 13
STATUS_HOMING_ERROR = 1 << 13

# Mask, value, state (CiA 402-2 table 31).
_STATES = (
    (0x4F, 0x00, State.NOT_READY),
    (0x4F, 0x40, State.SWITCH_ON_DISABLED),
    (0x6F, 0x21, State.READY),
    (0x6F, 0x23, State.SWITCHED_ON),
    (0x6F, 0x27, State.OPERATION_ENABLED),
    (0x6F, 0x07, State.QUICK_STOP_ACTIVE),
    (0x4F, 0x0F, State.FAULT_REACTION),
    (0x4F, 0x08, State.FAULT),
)


def decode_state(status_word: int, *, echoes_control: bool = False) -> State:
    """Return the power state that a status word reports.

    ``echoes_control``: bits 0–2 of this family's status word repeat the control word, and bit 7 is
    the alarm (manual 003:300-305).
    """
    if echoes_control:
        if status_word & 0x80:
            return State.FAULT
        return {
            0b000: State.SWITCH_ON_DISABLED,
            0b001: State.READY,
            0b011: State.SWITCHED_ON,
            0b111: State.OPERATION_ENABLED,
        }.get(status_word & 0b111, State.UNKNOWN)
    for mask, value, state in _STATES:
        if status_word & mask == value:
            return state
    return State.UNKNOWN


def fault_bit(*, echoes_control: bool = False) -> int:
    """Return the status word bit that is set in the fault states only (see `decode_state`).

    CiA 402-2 table 29: bit 3; where the low bits repeat the control word, the alarm is bit 7.
    """
    return 7 if echoes_control else 3


@dataclass(frozen=True, slots=True)
class Dialect:
    """How a family accepts commands in its process data, where this differs from CiA 402-2.

    ``echoes_control`` as in `decode_state`; ``quick_stop`` is the control word of a quick stop; at
    least ``pause_s`` [s] lies between two steps towards Operation enabled; ``speed_mode`` is the
    mode that takes a velocity setpoint in every cycle (Profile velocity where there is no CSV).
    """

    echoes_control: bool = False
    quick_stop: int = QUICK_STOP
    pause_s: float = 0.0
    speed_mode: Mode = Mode.CSV

    def mode(self, mode: int) -> int:
        """Return the mode that this drive uses in place of ``mode``."""
        return int(self.speed_mode) if mode == Mode.CSV else mode


def stops(control_word: int) -> bool:
    """Return whether this control word can only stop motion: quick stop, disable voltage or halt.

    Source: CiA 402-2 table 29 (commands); bit 8 is halt, bit 7 resets a fault.
    """
    if control_word & FAULT_RESET:
        return False
    return control_word & 0x06 != 0x06 or bool(control_word & HALT)


def is_stop(index: int | None, subindex: int, data: bytes) -> bool:
    """Return whether writing this (little endian) is a control word that can only stop motion."""
    return (index, subindex) == (0x6040, 0) and stops(int.from_bytes(data, "little"))


def next_control_word(state: State, goal: State, previous: int = 0) -> int | None:
    """Return the control word of the next step from ``state`` to ``goal``; None if none is due.

    Goals: SWITCH_ON_DISABLED, READY, SWITCHED_ON, OPERATION_ENABLED, QUICK_STOP_ACTIVE. None is
    returned in ``goal`` itself and in the states that the drive leaves by itself. A fault is left
    only by a rising edge of bit 7 (transition 15): if ``previous``, the word sent last, already has
    the bit set, the result is a word without it.
    """
    if state is goal:
        return None
    if state is State.FAULT:
        return DISABLE_VOLTAGE if previous & FAULT_RESET else FAULT_RESET
    if state in (State.NOT_READY, State.FAULT_REACTION, State.UNKNOWN):
        return None
    if goal is State.SWITCH_ON_DISABLED:
        return DISABLE_VOLTAGE
    if goal is State.QUICK_STOP_ACTIVE:
        return QUICK_STOP
    if state is State.QUICK_STOP_ACTIVE:
        return DISABLE_VOLTAGE
    if goal is State.READY or state is State.SWITCH_ON_DISABLED:
        return SHUTDOWN
    if goal is State.SWITCHED_ON or state is State.READY:
        return SWITCH_ON
    return ENABLE_OPERATION


def allowed_goals(state: State) -> tuple[State, ...]:
    """Return the goals that a user may choose in ``state``, in the order of the state diagram."""
    ordinary = (
        State.SWITCH_ON_DISABLED,
        State.READY,
        State.SWITCHED_ON,
        State.OPERATION_ENABLED,
    )
    if state is State.OPERATION_ENABLED:
        return (*ordinary[:3], State.QUICK_STOP_ACTIVE)
    if state in (State.FAULT_REACTION, State.NOT_READY, State.UNKNOWN):
        return ()
    if state is State.FAULT:
        return (State.SWITCH_ON_DISABLED,)
    if state is State.QUICK_STOP_ACTIVE:
        return (State.SWITCH_ON_DISABLED,)
    return tuple(goal for goal in ordinary if goal is not state)
