"""SDO services: abort codes, and that a refused write changes nothing.

Sources: CiA 301 v4.2.0 clause 7.2.4.3.17 table 22; ETG.1000.6 table 41.
"""

from __future__ import annotations

from collections.abc import Awaitable
from typing import Any

from drivers.conformance.rule import (
    Outcome,
    Rule,
    failed,
    hexadecimal,
    judged,
    not_testable,
)
from drivers.conformance.subject import Subject
from drivers.doctor.diagnosis import Fact
from drivers.errors import Rejected

_CLAUSE = "CiA 301 7.2.4.3.17 table 22; ETG.1000.6 table 41"
_RESERVED = 0x0FFF
"""Last index of an area reserved by CiA 301 (0260h to 0FFFh): no slave has an object there."""
_NO_OBJECT, _NO_SUBINDEX, _READ_ONLY = 0x06020000, 0x06090011, 0x06010002
_LENGTH, _TOO_LONG, _TOO_SHORT = 0x06070010, 0x06070012, 0x06070013
_PLAIN: tuple[tuple[int, int], ...] = (
    (0x1017, 2), (0x6067, 4), (0x6065, 4), (0x6083, 4), (0x6084, 4), (0x6085, 4), (0x607C, 4),
    (0x6068, 2), (0x6066, 2), (0x605A, 2), (0x605D, 2),
)  # fmt: skip
"""Writable objects and their bytes (CiA 301, CiA 402-2). None of them starts a motion; the present
value is written in a wrong length, so that a slave that accepts it nevertheless keeps its value.
"""


async def _abort_code(access: Awaitable[Any]) -> int:
    """Return the abort code; 0 if the slave accepted the access."""
    try:
        await access
    except Rejected as refusal:
        return refusal.abort_code
    return 0


def _aborts(code: int, *expected: int) -> Outcome:
    wanted = ", ".join(hexadecimal(each) for each in expected)
    return judged(code in expected, Fact("abort_code", hexadecimal(code), wanted))


async def _no_object(subject: Subject) -> Outcome:
    return _aborts(await _abort_code(subject.read(_RESERVED)), _NO_OBJECT)


async def _no_subindex(subject: Subject) -> Outcome:
    if await subject.read_if_there(0x1018) is None:
        return not_testable(Fact("object_1018", "-"))
    return _aborts(await _abort_code(subject.read(0x1018, 0xFE)), _NO_SUBINDEX)


async def _read_only(subject: Subject) -> Outcome:
    present = await subject.read_if_there(0x1000)
    if present is None:
        return not_testable(Fact("object_1000", "-"))
    return _aborts(await _abort_code(subject.write(0x1000, 0, present)), _READ_ONLY)


async def _plain(subject: Subject) -> tuple[int, bytes] | None:
    """Return a writable object of known length that may be written at standstill."""
    for index, size in _PLAIN:
        present = await subject.read_if_there(index)
        if present is not None and len(present) == size:
            return index, present
    return None


async def _wrong_length(subject: Subject, grow: int, *expected: int) -> Outcome:
    found = await _plain(subject)
    if found is None:
        return not_testable(Fact("writable_object", "-"))
    index, present = found
    sent = present.ljust(len(present) + grow, b"\0")[: len(present) + grow]
    code = await _abort_code(subject.write(index, 0, sent))
    held = await subject.read(index)
    if held != present:
        await subject.write(index, 0, present)
        name = f"object_{index:04X}"
        return failed(Fact(name, held.hex(), present.hex()), Fact("bytes_sent", len(sent)))
    wanted = ", ".join(hexadecimal(each) for each in expected)
    return judged(
        code in expected,
        Fact("abort_code", hexadecimal(code), wanted),
        Fact("object", hexadecimal(index, 4)),
        Fact("bytes_sent", len(sent), len(present)),
    )


async def _too_long(subject: Subject) -> Outcome:
    return await _wrong_length(subject, 1, _LENGTH, _TOO_LONG)


async def _too_short(subject: Subject) -> Outcome:
    return await _wrong_length(subject, -1, _LENGTH, _TOO_SHORT)


RULES = (
    Rule("conformance.sdo-no-object", _CLAUSE, _no_object),
    Rule("conformance.sdo-no-subindex", _CLAUSE, _no_subindex),
    Rule("conformance.sdo-read-only", _CLAUSE, _read_only, changes=True),
    Rule("conformance.sdo-too-long", _CLAUSE, _too_long, changes=True),
    Rule("conformance.sdo-too-short", _CLAUSE, _too_short, changes=True),
)
