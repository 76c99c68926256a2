"""Comparison of a set's identity with the drive to which it is to be written."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from backend.axes.drive.drive import Drive
from backend.axes.parameters.set_file import ParameterSet
from drivers.texts.message import Text, text

What = Literal["vendor", "product", "serial", "revision", "firmware"]
#: Differences that show another drive, so that writing needs consent. Others are only reported.
_OTHER_DRIVE = frozenset({"vendor", "product", "serial"})


@dataclass(frozen=True, slots=True)
class Difference:
    """One part of the identity that differs. ``other_drive``: it certainly is another drive."""

    what: What
    theirs: str
    ours: str

    @property
    def other_drive(self) -> bool:
        """Whether writing needs consent."""
        return self.what in _OTHER_DRIVE

    @property
    def text(self) -> Text:
        """The difference as a message."""
        return text("library.saved-from", what=self.what, theirs=self.theirs, ours=self.ours)


def differences(content: ParameterSet, drive: Drive) -> list[Difference]:
    """Differences where both values are known, the most serious first (CiA 301, object 1018h)."""
    found = drive.found
    if found is None:
        return []
    pairs: list[tuple[What, object, object]] = [
        ("vendor", content.vendor_id, found.vendor_id),
        ("product", content.product_code, found.product_code),
        ("serial", content.serial, found.serial),
        ("revision", content.revision, found.revision),
        ("firmware", content.firmware or None, found.firmware or None),
    ]
    return [
        Difference(what, str(theirs), str(ours))
        for what, theirs, ours in pairs
        if theirs is not None and ours is not None and theirs != ours
    ]
