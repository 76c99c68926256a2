"""Writes that can only remove energy from a motor and therefore need no grant."""

from __future__ import annotations

from drivers.cia402 import CHANGE_IMMEDIATELY, FAULT_RESET, HALT, QUICK_STOP
from drivers.objects.dialect import dialect_of
from profiles.schema import Parameter, Profile, Raw

#: Bit 3 of the control word: without it the motor has no power (CiA 402-2 table 29). The family
#: whose status word echoes the control word uses the same words (003:279).
_ENABLE_OPERATION_BIT = 0x08
#: Bits allowed in a word without that bit: the first three, fault reset, halt, change immediately.
_HARMLESS = 0x07 | FAULT_RESET | HALT | CHANGE_IMMEDIATELY
#: For these roles zero is a position or a mode, not the end of a motion.
_ZERO_MOVES = frozenset({"position_target", "position_offset", "mode", "home_offset"})


def stops(profile: Profile, parameter: Parameter, raw: Raw) -> bool:
    """Whether this raw value can only end motion or remove power.

    True for a control word that does not enable operation, and for zero written to a speed, a
    torque, a forced terminal or a trigger of the drive's own motion, which zero switches off.
    """
    roles = {signal.role for signal in profile.signals if signal.key == parameter.key}
    if "control_word" in roles:
        if not isinstance(raw, int):
            return False
        if raw in (QUICK_STOP, dialect_of(profile).quick_stop):
            return True
        return not raw & _ENABLE_OPERATION_BIT and not raw & ~_HARMLESS
    return raw == 0 and not roles & _ZERO_MOVES
