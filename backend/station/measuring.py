"""Cyclic exchange for a measurement: the running one, or one that is started for it."""

from __future__ import annotations

import asyncio
import contextlib
from dataclasses import dataclass

from backend.axes.axis.cyclic import CyclicSession
from backend.axes.drive.ports import Port
from backend.foundation.work.jobs import Job
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.tools.tuning.sweep import profile_speed
from drivers.errors import DriveError, LinkTimeout
from drivers.texts.message import text

#: Time limit for ending an exchange and starting again the one that had to be stopped [s].
EXCHANGE_ENDS_S = 60.0
#: Time limit for starting an exchange for a measurement [s]. Its request is then answered within
#: the 30 s that pages and programs wait, even where a segment stops answering meanwhile and ending
#: the exchange takes 15 s more.
SET_UP_S = 14.0


@dataclass
class Exchange:
    """A running exchange of a measurement, and how it is ended afterwards."""

    session: CyclicSession
    bench: Bench
    drive: str
    url: str
    own: bool
    """Whether it was started for this measurement."""
    before_s: float | None = None
    """Cycle time of the exchange that had to be stopped for it [s]; None where none ran."""
    taken: bool = False
    """Whether the measurement has begun, which then ends the exchange itself."""
    late: asyncio.Task[None] | None = None

    def ends_with(self, job: Job) -> None:
        """End the exchange also where STOP cancels the job before its first step.

        No cleanup of the job runs in that case.
        """

        def ended(_task: object) -> None:
            if not self.taken:
                self.late = asyncio.create_task(self.end(), name=f"end-exchange-{self.drive}")

        if job.task is not None:
            job.task.add_done_callback(ended)

    async def end(self) -> None:
        """Return the bus to its earlier state, once no other axis moves through the exchange.

        A failure to start the earlier exchange again is logged.
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
    """The port with process data; otherwise the first port."""
    ports = connected.drive.ports
    return next((port for port in ports if port.link.cyclic is not None), ports[0])


async def exchange_for(bench: Bench, connected: ConnectedDrive, cycle_s: float) -> Exchange:
    """The running exchange where it suits; otherwise one that is started for the measurement.

    A drive without cyclic modes is commanded in Profile velocity mode during a measurement only, so
    a running exchange without this is stopped meanwhile.

    Raises:
        Busy: a drive on the bus is moved.
        NotAllowed: no cyclic data on this bus, or a drive refuses.
        LinkTimeout: not started within `SET_UP_S`; the attempt is cancelled.
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
