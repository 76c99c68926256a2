"""Check that the drive that answers at a station is the one that was connected there."""

from __future__ import annotations

from backend.axes.drive.drive import Drive
from drivers.errors import NotAllowed, Rejected
from drivers.link import Address
from drivers.objects.codec import serial_or_none
from drivers.texts.message import text


async def read_serial(drive: Drive) -> int | None:
    """Serial number of the drive that answers now (1018h:04); None where it has none.

    Raises:
        LinkTimeout, LinkLost: the drive does not answer.
    """
    for port in drive.ports:
        if port.link.traits.registers:
            continue
        try:
            async with drive.exclusive.asking():
                data = await port.link.read(port.station, Address(0x1018, 4, "UINT32"))
        except (Rejected, NotAllowed):
            continue
        return serial_or_none(int.from_bytes(data, "little"))
    return None


async def confirm_identity(drive: Drive) -> None:
    """Read the serial number again and compare it, where it is known and the drive reports it.

    Raises:
        NotAllowed: another drive answers here.
    """
    known = drive.found.serial if drive.found else None
    if known is not None:
        serial = await read_serial(drive)
        if serial is not None and serial != known:
            drive.identity_warning = text(
                "drive.another-serial", drive=drive.name, known=str(known), serial=str(serial)
            )
    drive.require_identity()


def place_of(url: str, station: int) -> tuple[str, int]:
    """Return where a drive is connected: bus URL without line settings, and station."""
    return url.partition("?")[0], station
