"""A Link over a dictionary of bytes, with trouble on request: the seam between Drive and bus."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from drivers.errors import DriveError, Rejected
from drivers.link import (
    Address,
    Cyclic,
    Found,
    LinkEvent,
    LinkQuality,
    LinkTraits,
    Progress,
    Unsubscribe,
    lists_nothing,
)
from drivers.objects.dictionary import Described
from drivers.texts.message import Text
from drivers.urls import bus_kind
from profiles.schema import LinkKind, Profile


class MemoryLink:
    """Objects in memory. ``failures`` are raised in turn by the next writes after they act."""

    def __init__(self, objects: dict[tuple[int, int], bytes]) -> None:
        self.kind: LinkKind = "mlink"
        self.url = "mlink://memory"
        self.cyclic: Cyclic | None = None
        self.doctor = None
        self.frames = None
        self.objects = objects
        self.written: list[tuple[tuple[int, int], bytes]] = []
        self.write_errors: list[DriveError] = []
        self.read_errors: dict[tuple[int, int], DriveError] = {}
        self.loses_writes = False

    @property
    def traits(self) -> LinkTraits:
        return bus_kind(self.kind).traits

    def attach(self, station: int, profile: Profile) -> None: ...

    def unreachable(self, station: int, address: Address) -> Text | None:
        return None

    async def enumerate(self, station: int, progress: Progress) -> list[Described]:
        raise lists_nothing(self.kind, station)

    async def open(self) -> None: ...

    async def close(self) -> None: ...

    async def scan(
        self,
        progress: Progress,
        stations: Sequence[int] | None = None,
        *,
        stop_after: int | None = None,
    ) -> list[Found]:
        return [Found(1, serial=7)]

    async def read(self, station: int, address: Address) -> bytes:
        place = (address.index or 0, address.subindex)
        if place in self.read_errors:
            raise self.read_errors[place]
        if place not in self.objects:
            raise Rejected("object does not exist", abort_code=0x06020000)
        return self.objects[place]

    async def read_many(
        self, station: int, addresses: Sequence[Address]
    ) -> list[bytes | DriveError]:
        answers: list[bytes | DriveError] = []
        for address in addresses:
            try:
                answers.append(await self.read(station, address))
            except DriveError as error:
                answers.append(error)
        return answers

    async def write(self, station: int, address: Address, data: bytes) -> None:
        place = (address.index or 0, address.subindex)
        self.written.append((place, data))
        if not self.loses_writes:
            self.objects[place] = data
        if self.write_errors:
            raise self.write_errors.pop(0)

    def quality(self, station: int | None = None) -> LinkQuality:
        return LinkQuality(connected=True)

    def listen(self, listener: Callable[[LinkEvent], None]) -> Unsubscribe:
        return lambda: None
