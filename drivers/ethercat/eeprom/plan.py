"""What is to be written into an EEPROM, and why it may be. Pure.

A change is planned, shown, and carried out only for the digest of the plan that was shown: what
changed in between, the drive or the file, is noticed.
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
    """From the present contents to others. ``changes`` is empty where they are the same."""

    present: Image
    target: Image
    keeps_serial: bool

    @property
    def changes(self) -> tuple[Difference, ...]:
        """What will be different."""
        return differences(self.present, self.target)

    @property
    def words(self) -> int:
        """How many words are written."""
        before, after = self.present.data, self.target.data
        return sum(before[at : at + 2] != after[at : at + 2] for at in range(0, len(after), 2))

    @property
    def digest(self) -> str:
        """Names this change: from these contents to those."""
        both = hashlib.sha256(self.present.data)
        both.update(self.target.data)
        return both.hexdigest()[:16]


def plan_restore(
    present: Image, saved: Image, drive: SlaveIdentity | None, *, unknown_accepted: bool = False
) -> Plan:
    """From a saved file. ``drive`` is what the drive's firmware says of itself (1018h).

    The serial number of the drive stays where it has one that can be trusted: two drives with
    one serial number could not be distinguished.

    Raises:
        OutOfRange: the file is no sound contents of an EEPROM, or of another size.
        NotAllowed: it is of another drive; or nobody can say what the drive is, and
            ``unknown_accepted`` is not given.
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
    """Vendor, product and revision as the drive's firmware gives them (1018h).

    Raises:
        NotAllowed: the drive does not say what it is, or the contents are damaged beyond that.
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
