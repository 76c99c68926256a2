"""Server side of EEPROM access: read, plan and carry out. The host process owns the wire."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

from drivers.errors import DriveError, NotAllowed, OutOfRange
from drivers.ethercat.eeprom.image import MOST_BYTES, UNIT_BYTES, Image, SlaveIdentity
from drivers.ethercat.eeprom.plan import Plan, plan_identity, plan_restore
from drivers.link import Address, Progress

_READ_S, _WRITE_S = 120.0, 600.0
_IDENTITY = 0x1018

#: Sends a message to the host, with its time-out [s] and progress.
Call = Callable[[dict[str, Any], float, Progress | None], Awaitable[Any]]
ReadObject = Callable[[int, Address], Awaitable[bytes]]


class EepromAccess:
    """Access to the EEPROMs of one segment."""

    def __init__(self, call: Call, read_object: ReadObject) -> None:
        self._call = call
        self._read_object = read_object

    async def read(self, station: int, progress: Progress, size: int | None = None) -> Image:
        """Read the contents; ``size`` [bytes] for a damaged EEPROM that does not state its own.

        Raises:
            Busy: the cyclic exchange runs, or an EEPROM of the segment is being written.
            OutOfRange: ``size`` is impossible.
            ProtocolError: the EEPROM states an impossible size.
        """
        if size is not None and (not 0 < size <= MOST_BYTES or size % UNIT_BYTES):
            raise OutOfRange("ethercat.eeprom-no-image", bytes=size)
        message = {"op": "eeprom_read", "station": station, "size": size}
        return Image(await self._call(message, _READ_S, progress))

    async def identity(self, station: int) -> SlaveIdentity | None:
        """Return the identity that the drive's firmware reports (1018h); None without an answer."""
        try:
            parts = [
                int.from_bytes(
                    await self._read_object(station, Address(_IDENTITY, sub, "UINT32")), "little"
                )
                for sub in (1, 2, 3)
            ]
        except DriveError:
            return None
        return SlaveIdentity(*parts)

    async def plan_restore(
        self, station: int, saved: bytes, progress: Progress, *, unknown_accepted: bool = False
    ) -> Plan:
        """Plan the restoration of a saved file; errors as `plan.plan_restore` and `read`."""
        drive = await self.identity(station)
        present = await self.read(station, progress, _readable(saved))
        return plan_restore(present, Image(saved), drive, unknown_accepted=unknown_accepted)

    async def plan_identity(self, station: int, progress: Progress) -> Plan:
        """Plan the repair of the identity; errors as `plan.plan_identity` and `read`."""
        return plan_identity(await self.read(station, progress), await self.identity(station))

    async def carry_out(self, station: int, plan: Plan, digest: str, progress: Progress) -> None:
        """Write the planned change word by word, and read everything back.

        Raises:
            NotAllowed: ``digest`` is of another plan; the drive is in Safe-Op or Op, or its
                processor emulates the EEPROM.
            ProtocolError: the contents read back differ.
            LinkTimeout, LinkLost: the writing broke off; the checksum is wrong until it is
            restored.
        """
        if digest != plan.digest:
            raise NotAllowed("ethercat.eeprom-plan-changed", digest=plan.digest)
        message = {
            "op": "eeprom_write",
            "station": station,
            "present": plan.present.data,
            "target": plan.target.data,
        }
        await self._call(message, _WRITE_S, progress)


def _readable(saved: bytes) -> int:
    """Return the size of the file in whole units, at least one header, for reading the contents."""
    return max(len(saved) // 128 * 128, 128)
