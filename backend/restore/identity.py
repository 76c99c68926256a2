"""Which drive a restore list is about, whoever asks: a server by its list, a command by a scan."""

from __future__ import annotations

from dataclasses import dataclass

from backend.drive.drive import Drive


@dataclass(frozen=True, slots=True)
class DriveIdentity:
    """What is known of a drive: its numbers in 1018h, and the bus URL and station of its ports.

    A number is None where it is not known.
    """

    vendor_id: int | None
    product_code: int | None
    serial: int | None
    places: tuple[tuple[str, int], ...]

    def is_of(self, other: DriveIdentity) -> bool:
        """Whether both are the same drive.

        The same serial number of the same product is the same drive wherever it hangs; without
        one, the same place is, as long as no number contradicts it.
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
    """Of a drive that is connected; settings of the line are no part of a place."""
    found = drive.found
    return DriveIdentity(
        vendor_id=None if found is None else found.vendor_id or None,
        product_code=None if found is None else found.product_code or None,
        serial=None if found is None else found.serial or None,
        places=tuple((port.link.url.partition("?")[0], port.station) for port in drive.ports),
    )
