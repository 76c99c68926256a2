"""Identity of the drive of a restore list, the same for a server's axis list and a scan."""

from __future__ import annotations

from dataclasses import dataclass

from backend.axes.drive.drive import Drive
from backend.axes.drive.identity import place_of


@dataclass(frozen=True, slots=True)
class DriveIdentity:
    """Identity of a drive: its numbers in 1018h, and bus URL and station of its ports.

    A number is None where it is not known.
    """

    vendor_id: int | None
    product_code: int | None
    serial: int | None
    places: tuple[tuple[str, int], ...]

    def is_of(self, other: DriveIdentity) -> bool:
        """Whether both are the same drive.

        Drives with the same serial number and product are the same wherever they are connected.
        Otherwise drives with the same bus and station are, unless a known number differs.
        """
        if any(None not in (a, b) and a != b for a, b in self._numbers(other)):
            return False
        if all(a is not None and a == b for a, b in self._numbers(other)):
            return True
        return bool(set(self.places) & set(other.places))

    def _numbers(self, other: DriveIdentity) -> tuple[tuple[int | None, int | None], ...]:
        return (
            (self.vendor_id, other.vendor_id),
            (self.product_code, other.product_code),
            (self.serial, other.serial),
        )


def identity_of(drive: Drive) -> DriveIdentity:
    """Identity of a connected drive; bus URLs are without line settings."""
    found = drive.found
    return DriveIdentity(
        vendor_id=None if found is None else found.vendor_id or None,
        product_code=None if found is None else found.product_code or None,
        serial=None if found is None else found.serial or None,
        places=tuple(place_of(port.link.url, port.station) for port in drive.ports),
    )
