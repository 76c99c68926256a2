"""The CiA 402 state machine as pure functions (CiA 402-2 clause 8, 004:3543-3632)."""

from __future__ import annotations

from enum import Enum


class State(Enum):
    """States with the status word bits that show them (mask 0x6F)."""

    def __init__(self, bits: int) -> None:
        self.bits = bits
        """The value; an enumeration looks that up more slowly, and this is read in every cycle."""

    NOT_READY = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION = 0x0F
    FAULT = 0x08


class Command(Enum):
    """Command in the control word (table 45, 004:3609-3621)."""

    SHUTDOWN = "shutdown"
    SWITCH_ON = "switch on"
    ENABLE = "enable operation"
    DISABLE_VOLTAGE = "disable voltage"
    QUICK_STOP = "quick stop"


def decode(control_word: int) -> Command:
    """Return the command in bits 0 to 3; the fault reset edge in bit 7 is handled elsewhere."""
    if not control_word & 0x02:
        return Command.DISABLE_VOLTAGE
    if not control_word & 0x04:
        return Command.QUICK_STOP
    if not control_word & 0x01:
        return Command.SHUTDOWN
    return Command.ENABLE if control_word & 0x08 else Command.SWITCH_ON


_S, _C = State, Command
#: Next state per state and command; other combinations are ignored. The drive passes "switched on"
#: by itself when "enable operation" comes in "ready to switch on" (note 13, 004:3624).
TRANSITIONS: dict[tuple[State, Command], State] = {
    (_S.SWITCH_ON_DISABLED, _C.SHUTDOWN): _S.READY,  # 2
    (_S.READY, _C.SWITCH_ON): _S.SWITCHED_ON,  # 3
    (_S.READY, _C.ENABLE): _S.OPERATION_ENABLED,  # 3 + 4
    (_S.READY, _C.DISABLE_VOLTAGE): _S.SWITCH_ON_DISABLED,  # 7
    (_S.READY, _C.QUICK_STOP): _S.SWITCH_ON_DISABLED,  # 7
    (_S.SWITCHED_ON, _C.ENABLE): _S.OPERATION_ENABLED,  # 4
    (_S.SWITCHED_ON, _C.SHUTDOWN): _S.READY,  # 6
    (_S.SWITCHED_ON, _C.DISABLE_VOLTAGE): _S.SWITCH_ON_DISABLED,  # 10
    (_S.SWITCHED_ON, _C.QUICK_STOP): _S.SWITCH_ON_DISABLED,  # 10
    (_S.OPERATION_ENABLED, _C.SWITCH_ON): _S.SWITCHED_ON,  # 5
    (_S.OPERATION_ENABLED, _C.SHUTDOWN): _S.READY,  # 8
    (_S.OPERATION_ENABLED, _C.DISABLE_VOLTAGE): _S.SWITCH_ON_DISABLED,  # 9
    (_S.OPERATION_ENABLED, _C.QUICK_STOP): _S.QUICK_STOP_ACTIVE,  # 11
    (_S.QUICK_STOP_ACTIVE, _C.DISABLE_VOLTAGE): _S.SWITCH_ON_DISABLED,  # 12
    (_S.QUICK_STOP_ACTIVE, _C.ENABLE): _S.OPERATION_ENABLED,  # 16, options 5 to 8 only
}


def next_state(state: State, command: Command) -> State:
    """Return the next state; the same state if the command does not apply."""
    return TRANSITIONS.get((state, command), state)
