"""The tested slave as the rules access it: objects by SDO, and AL states on EtherCAT."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from drivers.errors import Rejected
from drivers.link import Address, Found, Link
from profiles.schema import LinkKind

ABSENT = frozenset({0x06020000, 0x06090011})
"""Abort codes of an object or subindex that does not exist (CiA 301 table 22)."""


@dataclass(frozen=True, slots=True)
class AlAnswer:
    """Registers 130h and 134h after a request."""

    state: int
    code: int


class AlStates(Protocol):
    """Requests to the state machine of EtherCAT slaves."""

    async def request(self, station: int, control: int) -> AlAnswer:
        """Write ``control`` to 120h; read 130h and 134h once the slave has responded.

        Raises:
            Busy: the cyclic exchange runs.
            NotAllowed: Op is requested of a slave that is not in Pre-Op.
        """


@runtime_checkable
class TakesAlRequests(Protocol):
    """A link whose slaves have an AL state machine."""

    al_states: AlStates


class Subject:
    """One station of an opened link. Errors of all methods are those of `drivers.link.Link`."""

    def __init__(self, link: Link, station: int, found: Found | None = None) -> None:
        """``found`` is the result of a search of the bus."""
        self._link = link
        self.station = station
        self.found = found
        self.states = link.al_states if isinstance(link, TakesAlRequests) else None

    @property
    def bus(self) -> LinkKind:
        """Kind of its bus."""
        return self._link.kind

    async def read(self, index: int, subindex: int = 0) -> bytes:
        """Read all bytes of an object as the slave sends them."""
        return await self._link.read(self.station, Address(index, subindex, "OCTETS"))

    async def read_if_there(self, index: int, subindex: int = 0) -> bytes | None:
        """Read as `read`; None if the slave reports that there is no such object."""
        try:
            return await self.read(index, subindex)
        except Rejected as refusal:
            if refusal.abort_code in ABSENT:
                return None
            raise

    async def number(self, index: int, subindex: int = 0) -> int | None:
        """Read as `read_if_there`, as an unsigned number."""
        data = await self.read_if_there(index, subindex)
        return None if data is None else int.from_bytes(data, "little")

    async def write(self, index: int, subindex: int, data: bytes) -> None:
        """Write an object; never repeated."""
        await self._link.write(self.station, Address(index, subindex, "OCTETS"), data)
