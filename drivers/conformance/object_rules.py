"""Mandatory objects of the communication profile, and their consistency.

Sources: CiA 301 v4.2.0 clauses 7.5.2 (objects) and 7.2.8.2.2 (error control); ETG.1000.6 clause
5.6.7 (objects of CoE, sync managers, PDO assignment).
"""

from __future__ import annotations

from drivers.conformance.rule import (
    Outcome,
    Rule,
    failed,
    hexadecimal,
    judged,
    not_applicable,
    passed,
)
from drivers.conformance.subject import ABSENT, Subject
from drivers.doctor.diagnosis import Fact
from drivers.errors import Rejected

_MAILBOX_OUT, _MAILBOX_IN, _OUTPUTS, _INPUTS = 1, 2, 3, 4
_SYNC_MANAGER_KINDS = (_MAILBOX_OUT, _MAILBOX_IN, _OUTPUTS, _INPUTS)
_DUMMIES = range(0x0001, 0x0020)
"""Mapped data types are gaps (CiA 301, dummy entries); so is index 0 on EtherCAT."""


def _sized(name: str, data: bytes | None, size: int) -> Outcome:
    if data is None:
        return failed(Fact(name, "-"))
    return judged(len(data) == size, Fact(f"{name}_bytes", len(data), size))


async def _device_type(subject: Subject) -> Outcome:
    return _sized("object_1000", await subject.read_if_there(0x1000), 4)


async def _error_register(subject: Subject) -> Outcome:
    return _sized("object_1001", await subject.read_if_there(0x1001), 1)


async def _identity(subject: Subject) -> Outcome:
    """Check vendor, product, revision and serial number: as many as in subindex 0, 4 bytes each."""
    count = await subject.number(0x1018)
    if count is None or not 1 <= count <= 4:
        return failed(Fact("object_1018:00", "-" if count is None else count, "1…4"))
    for subindex in range(1, count + 1):
        name = f"object_1018:{subindex:02X}"
        data = await subject.read_if_there(0x1018, subindex)
        if data is None or len(data) != 4:
            return failed(Fact(f"{name}_bytes", "-" if data is None else len(data), 4))
    vendor = await subject.number(0x1018, 1)
    return judged(bool(vendor), Fact("vendor", hexadecimal(vendor or 0)))


async def _error_control(subject: Subject) -> Outcome:
    """Check that heartbeat or node guarding is present: one of them is mandatory."""
    heartbeat = await subject.read_if_there(0x1017)
    if heartbeat is not None:
        return _sized("object_1017", heartbeat, 2)
    guarding = await subject.read_if_there(0x100C), await subject.read_if_there(0x100D)
    return judged(None not in guarding, Fact("object_1017", "-"), Fact("objects_100C_100D", "-"))


async def _stored_identity(subject: Subject) -> Outcome:
    """Check that EEPROM and firmware state the same product."""
    found = subject.found
    stored = (None, None) if found is None else (found.vendor_id, found.product_code)
    if None in stored:
        return not_applicable(Fact("eeprom", "-"))
    read = await subject.number(0x1018, 1), await subject.number(0x1018, 2)
    names = ("vendor", "product")
    facts = [
        Fact(name, hexadecimal(held or 0), hexadecimal(eeprom or 0))
        for name, held, eeprom in zip(names, read, stored, strict=True)
    ]
    return judged(read == stored, *facts)


async def _sync_manager_kinds(subject: Subject) -> Outcome:
    count = await subject.number(0x1C00)
    if count is None:
        return failed(Fact("object_1C00", "-"))
    kinds = [await subject.number(0x1C00, n) or 0 for n in range(1, min(count, 4) + 1)]
    expected = list(_SYNC_MANAGER_KINDS[: len(kinds)])
    well = count >= 2 and all(
        kind in (wanted, 0) if place >= 2 else kind == wanted
        for place, (kind, wanted) in enumerate(zip(kinds, expected, strict=True))
    )
    return judged(well, Fact("object_1C00", str(kinds), str(expected)))


async def _assignment(subject: Subject) -> Outcome:
    """Check that each assigned PDO is readable and its objects exist, except for gaps."""
    facts: list[Fact] = []
    for assigned in (0x1C12, 0x1C13):
        count = await subject.number(assigned)
        if count is None:
            return not_applicable(Fact(f"object_{assigned:04X}", "-"))
        for place in range(1, count + 1):
            pdo = await subject.number(assigned, place)
            if pdo is None:
                return failed(Fact(f"object_{assigned:04X}:{place:02X}", "-"))
            missing = await _missing(subject, pdo)
            if missing is not None:
                return failed(missing)
            facts.append(Fact(f"object_{assigned:04X}:{place:02X}", hexadecimal(pdo, 4)))
    return passed(*facts)


async def _missing(subject: Subject, pdo: int) -> Fact | None:
    """Return the first object of the mapping that is missing."""
    count = await subject.number(pdo)
    if count is None:
        return Fact(f"object_{pdo:04X}", "-")
    for place in range(1, count + 1):
        word = await subject.number(pdo, place)
        if word is None:
            return Fact(f"object_{pdo:04X}:{place:02X}", "-")
        index, subindex = word >> 16, word >> 8 & 0xFF
        if index == 0 or index in _DUMMIES:
            continue
        try:
            await subject.read(index, subindex)
        except Rejected as refusal:
            # A write-only object exists; a missing object has an abort code of its own.
            if refusal.abort_code in ABSENT:
                return Fact(f"object_{index:04X}:{subindex:02X}", hexadecimal(refusal.abort_code))
    return None


_COE = "ETG.1000.6 5.6.7"
RULES = (
    Rule("conformance.object-device-type", f"CiA 301 7.5.2.1; {_COE}", _device_type),
    Rule("conformance.object-error-register", "CiA 301 7.5.2.2", _error_register, ("canopen",)),
    Rule("conformance.object-identity", f"CiA 301 7.5.2 (1018h); {_COE}", _identity),
    Rule("conformance.error-control", "CiA 301 7.2.8.2.2", _error_control, ("canopen",)),
    Rule("conformance.stored-identity", f"{_COE}; ETG.2010", _stored_identity, ("ethercat",)),
    Rule("conformance.sync-manager-kinds", _COE, _sync_manager_kinds, ("ethercat",)),
    Rule("conformance.assignment", _COE, _assignment, ("ethercat",)),
)
