"""The exchange of process data that a measurement needs: the one that runs, or one of its own."""

from __future__ import annotations

import asyncio
import contextlib
from dataclasses import dataclass

from backend.axis.cyclic import CyclicSession
from backend.drive.ports import Port
from backend.station.bench import Bench
from backend.station.connected_drive import ConnectedDrive
from backend.tools.sweep import profile_speed
from backend.work.jobs import Job
from drivers.errors import DriveError, LinkTimeout
from drivers.texts.message import text

#: Ending an exchange, and starting the one that had to be stopped.
EXCHANGE_ENDS_S = 60.0
#: Setting one up for a measurement; its request is answered then, within the 30 s that pages and
#: programs wait, also where a segment falls silent in the middle and ending it takes 15 s more.
SET_UP_S = 14.0


@dataclass
class Exchange:
    """A running exchange, and what to do with it afterwards."""

    session: CyclicSession
    bench: Bench
    drive: str
    url: str
    own: bool
    """It was started for this measurement."""
    before_s: float | None = None
    """Cycle of the exchange that had to be stopped to it."""
    taken: bool = False
    """The measurement has begun, and ends it."""
    late: asyncio.Task[None] | None = None

    def ends_with(self, job: Job) -> None:
        """End it also where STOP cancels the job before its first step: no cleanup runs then."""

        def ended(_task: object) -> None:
            if not self.taken:
                self.late = asyncio.create_task(self.end(), name=f"end-exchange-{self.drive}")

        if job.task is not None:
            job.task.add_done_callback(ended)

    async def end(self) -> None:
        """Leave the bus as it was, as soon as no other axis moves through the exchange.

        A drive that does not let itself be set up again is informed of.
        """
        if not self.own:
            return
        with contextlib.suppress(DriveError):
            await self.bench.exchanges.stop_when_idle(self.url, self.session, self.drive)
        if self.before_s is None or self.url in self.bench.sessions:
            return
        try:
            await self.bench.start_cyclic(self.url, self.before_s, in_job_of=self.drive)
        except DriveError as error:
            self.bench.journal.add(
                text("journal.exchange-not-again", url=self.url, cause=error.text),
                level="warning",
                drive=self.drive,
            )


def port_of(connected: ConnectedDrive) -> Port:
    """The port with process data, else the first."""
    ports = connected.drive.ports
    return next((port for port in ports if port.link.cyclic is not None), ports[0])


async def exchange_for(bench: Bench, connected: ConnectedDrive, cycle_s: float) -> Exchange:
    """The running exchange if it suits, else one that is started for the measurement.

    A drive without cyclic modes is commanded by its profile velocity during the measurement only,
    so an exchange that runs is stopped meanwhile.

    Raises:
        Busy: a drive of the bus is moved.
        NotAllowed: no cyclic data on this bus, or a drive refuses.
        LinkTimeout: it is not set up within `SET_UP_S`, and is not going to be.
    """
    try:
        async with asyncio.timeout(SET_UP_S):
            return await _exchange_for(bench, connected, cycle_s)
    except TimeoutError as error:
        raise LinkTimeout(
            "station.exchange-not-set-up", drive=connected.drive.name, limit_s=SET_UP_S
        ) from error


async def _exchange_for(bench: Bench, connected: ConnectedDrive, cycle_s: float) -> Exchange:
    port = port_of(connected)
    drive, url = connected.drive.id, bench.buses.url_of(port)
    by_speed = {drive} if profile_speed.needed(connected.drive, port.link) else set[str]()
    running = bench.sessions.get(url)
    before_s = None
    if running is not None and running.running:
        if by_speed <= running.by_speed:
            return Exchange(running, bench, drive, url, own=False)
        for other in bench.connected_drives.values():
            if other.drive in running.drives:
                bench.motion.require_idle(other)
        before_s = running.state.cycle_s if running.state is not None else None
        await bench.stop_cyclic(url)
    try:
        session = await bench.start_cyclic(url, cycle_s, by_speed=by_speed)
    except DriveError:
        if before_s is not None:
            with contextlib.suppress(DriveError):
                await bench.start_cyclic(url, before_s)
        raise
    return Exchange(session, bench, drive, url, own=True, before_s=before_s)
