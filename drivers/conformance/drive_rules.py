"""Drive profile: device type, control and status word, modes of operation.

Sources: CiA 402-2 (IEC 61800-7-201), clause 8.4 (control and status word) and the objects of the
modes; ETG.6010 (their use on EtherCAT). Control words that move an axis are not written:
transitions of the state machine are not tested.
"""

from __future__ import annotations

from drivers.conformance.rule import (
    Outcome,
    Rule,
    failed,
    hexadecimal,
    judged,
    not_applicable,
    not_testable,
    passed,
)
from drivers.conformance.subject import Subject
from drivers.doctor.diagnosis import Fact

_PROFILE = 402
_CONTROL, _STATUS, _MODE_SHOWN, _MODES = 0x6040, 0x6041, 0x6061, 0x6502
_STATES: tuple[tuple[int, int], ...] = (
    (0x4F, 0x00), (0x4F, 0x40), (0x6F, 0x21), (0x6F, 0x23), (0x6F, 0x27), (0x6F, 0x07),
    (0x4F, 0x0F), (0x4F, 0x08),
)  # fmt: skip
"""Mask and value of the eight states (CiA 402-2 clause 8.4.2)."""
_OF_A_MODE: dict[int, tuple[int, ...]] = {
    1: (0x607A,),
    3: (0x60FF, 0x606C),
    6: (0x6098,),
    8: (0x607A, 0x6064),
    9: (0x60FF, 0x606C),
    10: (0x6071, 0x6077),
}
"""Setpoint and actual value that are mandatory for each mode according to its tables."""


async def is_drive(subject: Subject) -> bool:
    """Return whether the slave has the status word of a drive."""
    return await subject.read_if_there(_STATUS) is not None


async def _device_type(subject: Subject) -> Outcome:
    """Check that the low word of 1000h is the device profile number (CiA 301 clause 7.5.2.1)."""
    if not await is_drive(subject):
        return not_applicable(Fact("object_6041", "-"))
    profile = (await subject.number(0x1000) or 0) & 0xFFFF
    return judged(profile == _PROFILE, Fact("device_profile", profile, _PROFILE))


async def _words(subject: Subject) -> Outcome:
    profile = (await subject.number(0x1000) or 0) & 0xFFFF
    status = await subject.read_if_there(_STATUS)
    if profile != _PROFILE and status is None:
        return not_applicable(Fact("device_profile", profile, _PROFILE))
    for index in (_CONTROL, _STATUS):
        data = await subject.read_if_there(index)
        if data is None or len(data) != 2:
            return failed(Fact(f"object_{index:04X}_bytes", "-" if data is None else len(data), 2))
    return passed(Fact("status_word", hexadecimal(int.from_bytes(status or b"", "little"), 4)))


async def _state(subject: Subject) -> Outcome:
    status = await subject.number(_STATUS)
    if status is None:
        return not_applicable(Fact("object_6041", "-"))
    well = any(status & mask == value for mask, value in _STATES)
    return judged(well, Fact("status_word", hexadecimal(status, 4)))


async def _modes(subject: Subject) -> int | None:
    """Read the modes in 6502h as a bit field, bit 0 for mode 1."""
    return await subject.number(_MODES)


async def _mode_shown(subject: Subject) -> Outcome:
    """Check that 6061h is no mode or one listed in 6502h; manufacturer's modes are negative."""
    if not await is_drive(subject):
        return not_applicable(Fact("object_6041", "-"))
    data = await subject.read_if_there(_MODE_SHOWN)
    if data is None or len(data) != 1:
        return failed(Fact("object_6061_bytes", "-" if data is None else len(data), 1))
    mode, modes = int.from_bytes(data, "little", signed=True), await _modes(subject)
    if modes is None:
        return passed(Fact("mode", mode))
    well = mode <= 0 or bool(modes >> (mode - 1) & 1)
    return judged(well, Fact("mode", mode), Fact("object_6502", hexadecimal(modes)))


async def _mode_objects(subject: Subject) -> Outcome:
    """Check the objects of each mode in 6502h, itself only mandatory with several modes."""
    if not await is_drive(subject):
        return not_applicable(Fact("object_6041", "-"))
    modes = await _modes(subject)
    if modes is None:
        return not_testable(Fact("object_6502", "-"))
    fact = Fact("object_6502", hexadecimal(modes))
    if not modes:
        return failed(fact)
    for mode, objects in _OF_A_MODE.items():
        if not modes >> (mode - 1) & 1:
            continue
        for index in objects:
            if await subject.read_if_there(index) is None:
                return failed(fact, Fact("mode", mode), Fact(f"object_{index:04X}", "-"))
    return passed(fact)


RULES = (
    Rule("conformance.drive-device-type", "CiA 301 7.5.2.1; CiA 402-2 (1000h)", _device_type),
    Rule("conformance.drive-words", "CiA 402-2 8.4", _words),
    Rule("conformance.drive-state", "CiA 402-2 8.4.2", _state),
    Rule("conformance.drive-mode-shown", "CiA 402-2 (6061h, 6502h)", _mode_shown),
    Rule("conformance.drive-mode-objects", "CiA 402-2 (6502h); ETG.6010", _mode_objects),
)
