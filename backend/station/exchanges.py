"""The cyclic exchanges of a bench: which run, and when they may be changed or ended."""

from __future__ import annotations

import asyncio
import contextlib
from collections import Counter
from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING

from backend.axes.axis.cyclic import CyclicSession
from drivers.errors import Busy, DriveError, NotAllowed
from drivers.texts.message import text

if TYPE_CHECKING:
    from backend.station.bench import Bench
    from backend.station.drives.connected_drive import ConnectedDrive


class Exchanges:
    """Cyclic exchanges of one bench. ``running`` holds the session of each bus by its URL."""

    def __init__(self, bench: Bench) -> None:
        self.running: dict[str, CyclicSession] = {}
        self._bench = bench
        self._changing: set[str] = set()
        self._searched: Counter[str] = Counter()
        self._later: set[asyncio.Task[None]] = set()

    async def start(
        self,
        url: str,
        cycle_s: float,
        *,
        by_speed: Collection[str] = (),
        in_job_of: str | None = None,
    ) -> CyclicSession:
        """Exchange process data with all drives of a bus; see `Bench.start_cyclic`."""
        bench = self._bench
        link = await bench.buses.open(url)
        users = [
            m for m in bench.connected_drives.values() if any(p.link is link for p in m.drive.ports)
        ]
        if not users:
            raise NotAllowed("station.no-connected-drives", url=url)
        own = None if in_job_of is None else bench.jobs.moving(in_job_of)
        for connected in users:
            if own is None or bench.jobs.moving(connected.drive.id) is not own:
                bench.motion.require_idle(connected)
        self._require_settled(url)
        if (old := self.running.get(url)) is not None and old.running:
            raise Busy("station.cyclic-exchange-runs-already", url=url)
        # From here on nothing else may change the exchange or begin a motion, not even while the
        # old exchange ends.
        with self._changing_of(url):
            await self._end(url)
            session = CyclicSession(link, [m.drive for m in users], by_speed)
            await session.start(cycle_s)
            self.running[url] = session
            for connected in users:
                connected.axis.session = session
        bench.journal.add(text("journal.exchange-begun", url=url, cycle_ms=f"{cycle_s * 1e3:g}"))
        bench.drives_changed()
        return session

    async def stop(self, url: str) -> None:
        """End the exchange of a bus; moving axes are braked. Does nothing where none runs.

        Raises:
            Busy: it is just being started or ended.
        """
        self._require_settled(url)
        with self._changing_of(url):
            await self._end(url)

    async def stop_when_idle(self, url: str, session: CyclicSession, but: str) -> None:
        """End this exchange, but not while another job moves an axis through it.

        In that case it returns at once, and the exchange is ended when no axis moves any more,
        unless it has been ended by then. ``but``: drive whose own job ends the exchange.

        Raises:
            DriveError: the exchange does not end without an error.
        """
        if self.running.get(url) is not session:
            return
        own = self._bench.jobs.moving(but)
        others = [m for m in self._movers(session) if m.drive.id != but]
        movers = [m for m in others if own is None or m.drive.id not in own.moved]
        if not movers:
            await self.stop(url)
            return
        names = ", ".join(m.drive.name for m in movers)
        self._bench.journal.add(text("journal.exchange-stays", url=url, names=names))
        task = asyncio.create_task(self._stop_later(url, session), name=f"end-exchange-{url}")
        self._later.add(task)
        task.add_done_callback(self._later.discard)

    async def _stop_later(self, url: str, session: CyclicSession) -> None:
        jobs = self._bench.jobs
        while movers := self._movers(session):
            for connected in movers:
                if (job := jobs.moving(connected.drive.id)) is not None:
                    await job.wait()
        if self.running.get(url) is session:
            with contextlib.suppress(DriveError):
                await self.stop(url)

    def _movers(self, session: CyclicSession) -> list[ConnectedDrive]:
        """Axes of this exchange that a job moves."""
        bench = self._bench
        users = [m for m in bench.connected_drives.values() if m.axis.session is session]
        return [m for m in users if bench.jobs.moving(m.drive.id) is not None]

    def require_idle_but(self, connected: ConnectedDrive) -> None:
        """Check that no other axis is moved through the exchange of this axis, so it may be ended.

        Raises:
            Busy: another axis is moved through it.
        """
        session = connected.axis.session
        for other in [] if session is None else self._movers(session):
            if other is not connected:
                raise Busy(
                    "station.shares-cyclic-exchange-moves",
                    drive=connected.drive.name,
                    other_drive=other.drive.name,
                )

    async def close(self) -> None:
        """End all exchanges."""
        for task in list(self._later):
            task.cancel()
        for url in list(self.running):
            with contextlib.suppress(DriveError):
                await self.stop(url)

    # --- who may begin to move --------------------------------------------------------

    @contextlib.contextmanager
    def _changing_of(self, url: str) -> Iterator[None]:
        """Context in which no motion begins on this bus, as its exchange is changed."""
        self._changing.add(url)
        try:
            yield
        finally:
            self._changing.discard(url)

    @contextlib.contextmanager
    def searching(self, url: str) -> Iterator[None]:
        """Context of a scan, in which no motion begins on this bus."""
        self._searched[url] += 1
        try:
            yield
        finally:
            self._searched[url] -= 1

    @contextlib.contextmanager
    def reserved(self, url: str) -> Iterator[None]:
        """Context in which nothing else starts an exchange or a motion on this bus.

        Raises:
            Busy: its exchange runs or is being changed, it is scanned, or a drive on it moves.
        """
        bench = self._bench
        self._require_settled(url)
        if url in self.running:
            raise Busy("station.cyclic-exchange-runs-already", url=url)
        for connected in bench.connected_drives.values():
            if url in bench.buses.urls_of(connected.drive):
                bench.motion.require_idle(connected)
                self.require_calm(connected.drive.name, [url])
        with self._changing_of(url):
            yield

    def require_calm(self, name: str, urls: Collection[str]) -> None:
        """Check that a motion of the axis of this ``name`` may begin.

        Raises:
            Busy: the exchange of one of its buses is being changed, or the bus is scanned.
        """
        for url in urls:
            if url in self._changing:
                raise Busy("station.exchange-being-changed", drive=name, url=url)
            if self._searched[url]:
                raise Busy("station.drives-being-searched", drive=name, url=url)

    def _require_settled(self, url: str) -> None:
        if url in self._changing:
            raise Busy("station.cyclic-exchange-just-being", url=url)

    async def _end(self, url: str) -> None:
        session = self.running.pop(url, None)
        if session is None:
            return
        for connected in self._bench.connected_drives.values():
            if connected.axis.session is session:
                connected.axis.session = None
        await session.stop()
        self._bench.journal.add(text("journal.exchange-ended", url=url))
        self._bench.drives_changed()
