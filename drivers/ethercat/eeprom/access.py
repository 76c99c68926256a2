"""The EEPROM of a station in the server: read, plan, carry out. The wire is the host's."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

from drivers.errors import DriveError, NotAllowed
from drivers.ethercat.eeprom.image import Image, SlaveIdentity
from drivers.ethercat.eeprom.plan import Plan, plan_identity, plan_restore
from drivers.link import Address, Progress

_READ_S, _WRITE_S = 120.0, 600.0
_IDENTITY = 0x1018

#: A message to the host with its time-out [s] and progress.
Call = Callable[[dict[str, Any], float, Progress | None], Awaitable[Any]]
ReadObject = Callable[[int, Address], Awaitable[bytes]]


class EepromAccess:
    """EEPROMs of one segment."""

    def __init__(self, call: Call, read_object: ReadObject) -> None:
        self._call = call
        self._read_object = read_object

    async def read(self, station: int, progress: Progress, size: int | None = None) -> Image:
        """The contents; ``size`` [bytes] where a damaged EEPROM does not state its own.

        Raises:
            Busy: the cyclic exchange runs, or an EEPROM of the segment is being written.
            ProtocolError: it states a size that no EEPROM has.
        """
        message = {"op": "eeprom_read", "station": station, "size": size}
        return Image(await self._call(message, _READ_S, progress))

    async def identity(self, station: int) -> SlaveIdentity | None:
        """What the drive's firmware says of itself (1018h); None where it does not answer."""
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
        """What restoring a saved file would change; errors as `plan.plan_restore` and `read`."""
        drive = await self.identity(station)
        present = await self.read(station, progress, _readable(saved))
        return plan_restore(present, Image(saved), drive, unknown_accepted=unknown_accepted)

    async def plan_identity(self, station: int, progress: Progress) -> Plan:
        """What repairing the identity would change; errors as `plan.plan_identity` and `read`."""
        return plan_identity(await self.read(station, progress), await self.identity(station))

    async def carry_out(self, station: int, plan: Plan, digest: str, progress: Progress) -> None:
        """Write what was planned, word by word, and read everything back.

        Raises:
            NotAllowed: ``digest`` is of another plan; the drive is in Safe-Op or Op, or its
                processor plays the EEPROM.
            ProtocolError: something else reads back.
            LinkTimeout, LinkLost: it broke off; the checksum is wrong until it is restored.
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
    """As much as the file has, and a header at the least: for the contents next to it."""
    return max(len(saved) // 128 * 128, 128)
