"""Planned changes of an EEPROM, and the conditions under which they are allowed. Pure.

A change is planned, shown, and carried out only with the digest of the plan that was shown, so that
a change of the drive or the file in between is detected.
"""

from __future__ import annotations

import hashlib
import struct
from dataclasses import dataclass

from drivers.errors import NotAllowed, OutOfRange
from drivers.ethercat.eeprom.image import (
    SERIAL_WORD,
    VENDOR_WORD,
    Difference,
    Image,
    SlaveIdentity,
    differences,
)
from drivers.texts import limits


@dataclass(frozen=True, slots=True)
class Plan:
    """A change from the present contents to a target. ``changes`` is empty if both are equal."""

    present: Image
    target: Image
    keeps_serial: bool

    @property
    def changes(self) -> tuple[Difference, ...]:
        """The fields that will change."""
        return differences(self.present, self.target)

    @property
    def words(self) -> int:
        """Number of words that will be written."""
        before, after = self.present.data, self.target.data
        return sum(before[at : at + 2] != after[at : at + 2] for at in range(0, len(after), 2))

    @property
    def digest(self) -> str:
        """Identifies this change, from these contents to those."""
        both = hashlib.sha256(self.present.data)
        both.update(self.target.data)
        return both.hexdigest()[:16]


def plan_restore(
    present: Image, saved: Image, drive: SlaveIdentity | None, *, unknown_accepted: bool = False
) -> Plan:
    """Plan the restoration of a saved file. ``drive`` is the firmware's identity (1018h).

    The serial number of the drive is kept if it can be trusted: two drives with the same serial
    number could not be distinguished.

    Raises:
        OutOfRange: the file is not a valid EEPROM image, or has another size.
        NotAllowed: the file is of another drive; or the identity of the drive is unknown, and
            ``unknown_accepted`` is not set.
    """
    problem = saved.problem()
    if problem is not None:
        raise OutOfRange("ethercat.eeprom-file-unsound", cause=problem)
    if present.trusted and present.stated_bytes != len(saved.data):
        raise OutOfRange(
            "ethercat.eeprom-file-size",
            value=len(saved.data),
            limit=limits.size(present.stated_bytes),
            bytes=len(saved.data),
            size=present.stated_bytes,
        )
    known = drive or (present.identity if present.trusted else None)
    if known is None and not unknown_accepted:
        raise NotAllowed("ethercat.eeprom-drive-unknown")
    if known is not None and known != saved.identity:
        raise NotAllowed(
            "ethercat.eeprom-other-drive", file=_named(saved.identity), drive_is=_named(known)
        )
    own = present.serial if present.trusted else None
    if own is None or own == saved.serial:
        return Plan(present, saved, keeps_serial=False)
    return Plan(present, saved.with_words(SERIAL_WORD, struct.pack("<I", own)), keeps_serial=True)


def plan_identity(present: Image, drive: SlaveIdentity | None) -> Plan:
    """Plan to write vendor, product and revision as the firmware reports them (1018h).

    Raises:
        NotAllowed: the drive does not report its identity, or more than the identity is damaged.
    """
    if drive is None:
        raise NotAllowed("ethercat.eeprom-drive-silent")
    if not present.checksum_right:
        raise NotAllowed("ethercat.eeprom-damaged")
    target = present.with_words(VENDOR_WORD, struct.pack("<III", *drive))
    return Plan(present, target, keeps_serial=False)


def _named(identity: SlaveIdentity) -> str:
    return (
        f"{identity.vendor_id:#010x} {identity.product_code:#010x} revision {identity.revision:#x}"
    )
