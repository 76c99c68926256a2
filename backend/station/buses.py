"""The buses of a bench: opening, scanning for drives, and closing."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.foundation.people.identity import by_itself
from backend.station.install.box.roles import require_not_office
from drivers.errors import Busy, NotAllowed
from drivers.link import Found, Link, LinkEvent
from drivers.texts.message import Text, text
from drivers.urls import link_for

if TYPE_CHECKING:
    from backend.station.bench import Bench


class Buses:
    """Buses of one bench. ``opened`` holds the link of each open bus by its URL.

    ``wires``: wires of a demo bench, as factories of their links by URL such as
    ``mlink://virtual0``.
    """

    def __init__(self, bench: Bench, wires: Mapping[str, Callable[[], Link]]) -> None:
        self.wires = dict(wires)
        #: Causes a fault in a virtual drive, by bus URL and station; None without a demo bench.
        self.cause_fault: Callable[[str, int], None] | None = None
        self.opened: dict[str, Link] = {}
        #: Mean round trip of buses that were closed [ms], by URL; None where none was measured.
        self.last_round_trip_ms: dict[str, float | None] = {}
        self._bench = bench
        self._opening = asyncio.Lock()
        #: Whether the links of a drive were there at its last snapshot, by drive and port.
        self._linked: dict[str, tuple[bool, ...]] = {}

    async def open(self, url: str) -> Link:
        """The link of the bus of this URL; opened at first use.

        Raises:
            LinkLost: it cannot be opened.
            NotAllowed: no such kind of bus, or EtherCAT on the office port.
        """
        async with self._opening:
            link = self.opened.get(url)
            if link is None:
                make = self.wires.get(url)
                if make is None:
                    require_not_office(self._bench.state_folder, url)
                link = make() if make is not None else link_for(url)
                await link.open()
                link.listen(lambda event: by_itself().run(self._event, url, event))
                self.opened[url] = link
                self._bench.journal.add(text("journal.opened", url=url))
                self._bench.drives_changed()
            return link

    async def close(self, url: str) -> None:
        """Close a bus that no drive uses.

        Raises:
            Busy: drives use it.
            NotAllowed: it is not open.
        """
        users = [
            m.drive.name
            for m in self._bench.connected_drives.values()
            if url in self.urls_of(m.drive)
        ]
        if users:
            raise Busy("station.used", url=url, users=", ".join(users))
        link = self.opened.pop(url, None)
        if link is None:
            raise NotAllowed("station.not-open", value=url)
        self.last_round_trip_ms[url] = link.quality(None).round_trip_ms
        await link.close()
        self._bench.drives_changed()

    def urls_of(self, drive: Drive) -> list[str]:
        """URLs of the open buses over which this drive is reached."""
        return [
            url for url, link in self.opened.items() if any(p.link is link for p in drive.ports)
        ]

    def seen(self, drive: Drive) -> None:
        """Compare the links of a drive with those of its last snapshot.

        Pages show them with the list of drives, which nothing else may send when a link comes or
        goes.
        """
        now = tuple(port.link.quality(port.station).connected for port in drive.ports)
        before = self._linked.get(drive.id)
        self._linked[drive.id] = now
        if before is not None and before != now:
            self._bench.drives_changed()

    def url_of(self, port: Port) -> str:
        """The URL by which the bus of a port was opened, as entered by the user."""
        return next((u for u, link in self.opened.items() if link is port.link), port.link.url)

    async def scan(
        self,
        url: str,
        stations: Sequence[int] | None,
        progress: Callable[[float, Text], None],
        *,
        stop_after_first: bool = False,
    ) -> list[Found]:
        """Scan a bus for drives.

        Raises:
            LinkLost: the bus cannot be opened.
            Busy: a drive on it is moving; a scan may reset the drives.
        """
        link = await self.open(url)
        for connected in self._bench.connected_drives.values():
            if any(port.link is link for port in connected.drive.ports):
                self._bench.motion.require_idle(connected)
        with self._bench.exchanges.searching(url):
            found = await link.scan(progress, stations, stop_after=1 if stop_after_first else None)
        self._bench.journal.add(text("journal.drives-found", url=url, count=len(found)))
        return found

    def _event(self, url: str, event: LinkEvent) -> None:
        drive = next(
            (
                m.drive
                for m in self._bench.connected_drives.values()
                for p in m.drive.ports
                if self.url_of(p) == url and event.station in (None, p.station)
            ),
            None,
        )
        self._bench.journal.add(
            text("journal.link-event", url=url, event=event.text),
            level="info" if event.kind in ("boot", "back", "state") else "warning",
            drive=drive.id if drive else None,
        )
        if drive is not None and event.kind in ("boot", "back"):
            self._bench.reconnection.returned(drive.id)

    async def close_all(self) -> None:
        """Close every bus; a failure does not keep others open."""
        links = self.opened.values()
        await asyncio.gather(*(link.close() for link in links), return_exceptions=True)
