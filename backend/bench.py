"""The bench: opened buses, the drives on them, and everything that watches over them."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections import Counter
from collections.abc import Awaitable, Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from backend.access import Leases
from backend.audit.witness import Witness
from backend.axis import Axis
from backend.axis_store import AxisStore
from backend.cyclic import CyclicSession
from backend.drive import Drive
from backend.drive_list import DriveList, SavedDrive, SavedPort
from backend.exchanges import Exchanges
from backend.files import StorageFailed
from backend.jobs import Job, JobRunner
from backend.journal import Journal, Level
from backend.matching import profile_for
from backend.measurements import MeasurementStore
from backend.monitor import Monitor, Snapshot
from backend.naming import PlaceNames, new_id
from backend.owed_store import OwedStore
from backend.people.identity import by_itself
from backend.ports import Port
from backend.readings import Reading
from backend.records import Records
from backend.returning import Returning
from backend.scope import ScopeHub
from drivers.errors import Busy, DriveError, NotAllowed
from drivers.link import Found, Link, LinkEvent, NeedsProfile
from drivers.modbus.link import RegisterLink
from drivers.urls import link_for
from profiles.loader import ProfileError

log = logging.getLogger(__name__)


class Member:
    """A drive of the bench with its axis and monitor."""

    def __init__(self, drive: Drive, axis: Axis, monitor: Monitor) -> None:
        self.drive = drive
        self.axis = axis
        self.monitor = monitor


class Bench:
    """Buses and drives of one server.

    ``wires`` are the wires of a demo bench: URLs such as ``mlink://virtual0`` and what makes
    their links. ``names`` are those of its drives by bus URL and station, for who gives none.
    ``state_folder`` keeps the list of drives over restarts, and what `Records` keeps.
    """

    def __init__(
        self,
        state_folder: Path,
        wires: Mapping[str, Callable[[], Link]] | None = None,
        *,
        database: str | None = None,
        blobs: str | None = None,
        names: Mapping[tuple[str, int], str] | None = None,
    ) -> None:
        self.wires = dict(wires or {})
        self._names = PlaceNames(names or {})
        self.journal = Journal()
        self.records = Records(state_folder, self.journal, database, blobs)
        self.audit = self.records.audit
        self.sets = self.records.sets
        self.measurements = MeasurementStore(state_folder / "measurements")
        self.members: dict[str, Member] = {}
        self.links: dict[str, Link] = {}
        self.on_snapshot: list[Callable[[str, Snapshot], None]] = []
        self.on_readings: list[Callable[[str, list[Reading]], None]] = []
        self.on_job: list[Callable[[Job], None]] = []
        self.on_drives: list[Callable[[], None]] = []
        self.jobs = JobRunner(self._job_changed, self._permit)
        self._stops: set[asyncio.Task[dict[str, str]]] = set()
        #: Drives of which something is changed that no motion may begin with.
        self._still: Counter[str] = Counter()
        #: Drives that are being removed.
        self._parting: set[str] = set()
        #: Bus and station of drives that left the bench and never took their stop.
        self._unstopped: set[tuple[str, int]] = set()
        self.exchanges = Exchanges(self)
        self.sessions = self.exchanges.running
        self.leases = Leases(self._lease_changed)
        self._witness = Witness(self.audit, self.name_of)
        self.on_job.append(self._witness.job_changed)
        self.returning = Returning(self, OwedStore(state_folder / "owed"))
        self.scope = ScopeHub(lambda drive: self.member(drive).axis)
        self.state_folder = state_folder
        self.axis_records = AxisStore(state_folder / "axes")
        self._list = DriveList(state_folder / "bench.json")
        self._opening = asyncio.Lock()

    # --- buses ------------------------------------------------------------------------

    async def link(self, url: str) -> Link:
        """The opened bus of this URL; opens it on first use.

        Raises:
            LinkLost: it cannot be opened. NotAllowed: no such kind of bus.
        """
        async with self._opening:
            link = self.links.get(url)
            if link is None:
                make = self.wires.get(url)
                link = make() if make is not None else link_for(url)
                await link.open()
                link.listen(lambda event: by_itself().run(self._bus_event, url, event))
                self.links[url] = link
                self.journal.add(f"opened {url}")
                self.drives_changed()
            return link

    async def close_link(self, url: str) -> None:
        """Close a bus that no drive uses.

        Raises:
            Busy: drives use it. NotAllowed: it is not open.
        """
        users = [m.drive.name for m in self.members.values() if url in self._urls(m.drive)]
        if users:
            raise Busy(f"{url} is used by {', '.join(users)}", remedy="remove these drives first")
        link = self.links.pop(url, None)
        if link is None:
            raise NotAllowed(
                f"{url} is not open", value=url, remedy="open the bus on the page Connect"
            )
        await link.close()
        self.drives_changed()

    def _urls(self, drive: Drive) -> list[str]:
        return [url for url, link in self.links.items() if any(p.link is link for p in drive.ports)]

    def url_of(self, port: Port) -> str:
        """The URL a port was opened by, as the user knows it."""
        return next((u for u, link in self.links.items() if link is port.link), port.link.url)

    async def scan(
        self,
        url: str,
        stations: Sequence[int] | None,
        progress: Callable[[float, str], None],
        *,
        stop_after_first: bool = False,
    ) -> list[Found]:
        """Look for drives on a bus.

        Raises:
            LinkLost: the bus cannot be opened.
            Busy: a drive of it is moving; a scan may reset what it finds.
        """
        link = await self.link(url)
        for member in self.members.values():
            if any(port.link is link for port in member.drive.ports):
                self.require_idle(member)
        with self.exchanges.searching(url):
            if stop_after_first and isinstance(link, RegisterLink):
                # Only there is one address asked after the other, each at the price of a time-out.
                found = await link.scan(progress, stations, stop_after=1)
            else:
                found = await link.scan(progress, stations)
        self.journal.add(f"{url}: {len(found)} {'drive' if len(found) == 1 else 'drives'} found")
        return found

    def _bus_event(self, url: str, event: LinkEvent) -> None:
        drive = next(
            (
                m.drive
                for m in self.members.values()
                for p in m.drive.ports
                if self.url_of(p) == url and event.station in (None, p.station)
            ),
            None,
        )
        self.journal.add(
            f"{url}: {event.text}",
            level="info" if event.kind in ("boot", "back", "state") else "warning",
            drive=drive.id if drive else None,
        )
        if drive is not None and event.kind in ("boot", "back"):
            self.returning.returned(drive.id)

    # --- cyclic exchange --------------------------------------------------------------

    async def start_cyclic(
        self,
        url: str,
        cycle_s: float,
        *,
        by_speed: Collection[str] = (),
        in_job_of: str | None = None,
    ) -> CyclicSession:
        """Exchange process data with all drives of a bus.

        ``by_speed`` as in `CyclicSession`. ``in_job_of`` is the drive whose own job asks for it.

        Raises:
            NotAllowed: no drives, no cyclic data on this bus, or a drive refuses.
            Busy: it runs already, or a drive is moving.
        """
        return await self.exchanges.start(url, cycle_s, by_speed=by_speed, in_job_of=in_job_of)

    async def stop_cyclic(self, url: str) -> None:
        """End the exchange of a bus; what moves is braked. Does nothing where none runs.

        Raises:
            Busy: it is just being started or ended.
        """
        await self.exchanges.stop(url)

    @contextlib.contextmanager
    def keeping_still(self, member: Member) -> Iterator[None]:
        """Nothing begins to move this axis meanwhile, as what it relies on is changed. STOP works.

        Raises:
            Busy: something moves it already.
        """
        self.require_idle(member)
        self._still[member.drive.id] += 1
        try:
            yield
        finally:
            self._still[member.drive.id] -= 1

    def require_idle(self, member: Member) -> None:
        """Nothing moves this axis.

        Raises:
            Busy: a job does.
        """
        if (job := self.jobs.moving(member.drive.id)) is not None:
            raise Busy(
                f"{member.drive.name} is moved by {job.title!r}",
                drive=member.drive.name,
                remedy="wait for it to end, or stop it",
            )

    # --- drives -----------------------------------------------------------------------

    def member(self, drive_id: str) -> Member:
        """The drive of this id.

        Raises:
            NotAllowed: there is none.
        """
        member = self.members.get(drive_id)
        if member is None:
            raise NotAllowed(
                f"there is no drive {drive_id!r} on this bench",
                drive=drive_id,
                remedy="connect it on the Connect page",
            )
        return member

    async def connect(
        self, url: str, station: int, profile: str, name: str = "", *, found: Found | None = None
    ) -> Member:
        """Make a station a drive of the bench.

        Raises:
            Busy: another drive uses this station. LinkLost: the bus cannot be opened.
            NotAllowed: no such profile, or one of drives that have no such port.
        """
        link = await self.link(url)
        self._require_free(link, url, station)
        facts, spec = profile_for(link.kind, profile)
        if isinstance(link, NeedsProfile):
            link.configure_station(station, facts)
        name = name or self._names.unused(
            url, station, [m.drive.name for m in self.members.values()]
        )
        drive_id = new_id(name or f"{profile}-{station}", self.members)
        drive = Drive(drive_id, name or drive_id, facts, [Port(link, station, spec)])
        drive.found = found
        return self._add(drive)

    async def add_port(
        self,
        drive_id: str,
        url: str,
        station: int,
        check: Callable[[Drive, Port], Awaitable[None]] | None = None,
    ) -> Member:
        """Connect a drive over a second bus, so that each parameter goes the way that carries it.

        ``check`` looks at the port before it is used, and raises what speaks against it.

        Raises:
            NotAllowed: its family has no such link. Busy: the station is in use.
        """
        member = self.member(drive_id)
        drive = member.drive
        self.require_idle(member)
        link = await self.link(url)
        self._require_free(link, url, station)
        spec = drive.profile.link(link.kind)
        if spec is None:
            raise NotAllowed(
                f"{drive.profile.title} has no {link.kind} port",
                drive=drive.name,
                value=url,
                limit=", ".join(known.kind for known in drive.profile.links),
                remedy="choose one of its links",
            )
        if isinstance(link, NeedsProfile):
            link.configure_station(station, drive.profile)
        port = Port(link, station, spec)
        if check is not None:
            await check(drive, port)
            self._require_free(link, url, station)
            self.require_idle(member)
        drive.ports = (*drive.ports, port)
        self._remember()
        self.journal.add(f"{drive.name} is reached over {url} too", drive=drive.id)
        self.drives_changed()
        return member

    def _require_free(self, link: Link, url: str, station: int) -> None:
        for member in self.members.values():
            if any(p.link is link and p.station == station for p in member.drive.ports):
                raise Busy(
                    f"{url} station {station} is already connected as {member.drive.name}",
                    drive=member.drive.name,
                    remedy="use that drive, or remove it first",
                )

    def _add(self, drive: Drive) -> Member:
        axis = Axis(drive)
        places = {(self.url_of(port), port.station) for port in drive.ports}
        axis.owes_stop = bool(places & self._unstopped)
        self._unstopped -= places
        drive_id = drive.id
        monitor = Monitor(
            axis,
            self.journal,
            lambda snapshot: self._snapshot(drive_id, snapshot),
            lambda: self.returning.returned(drive_id),
        )
        member = Member(drive, axis, monitor)
        self.members[drive_id] = member
        drive.listen(lambda readings: self._readings(drive_id, readings))
        drive.listen_writes(self._witness.wrote)
        drive.listen_commands(self._witness.commanded)
        drive.owed.listen(self.drives_changed)
        self.returning.begin(axis)
        monitor.start()
        self._remember()
        self.journal.add(f"connected {drive.name} ({drive.profile.title})", drive=drive_id)
        self.drives_changed()
        return member

    async def remove(self, drive_id: str) -> None:
        """Take a drive off the bench.

        Raises:
            Busy: it is moving, or another axis moves through the exchange that would end with it.
        """
        member = self.member(drive_id)
        self._require_stays(member)
        self.require_idle(member)
        self.exchanges.require_idle_but(member)
        # STOP reaches what is on the bench: nothing may begin to move on its way off it.
        self._parting.add(drive_id)
        try:
            await self._let_go(member)
            for url, session in list(self.sessions.items()):
                if member.drive in session.drives:
                    self.exchanges.require_idle_but(member)
                    await self.stop_cyclic(url)
            if member.axis.owes_stop:
                self._unstopped.update((self.url_of(p), p.station) for p in member.drive.ports)
            del self.members[drive_id]
            # Whoever takes it off has read what it is owed: on its axis' pages it stands first.
            member.drive.owed.settle([debt.key for debt in member.drive.owed.debts])
        finally:
            self._parting.discard(drive_id)
        await member.monitor.close()
        self._remember()
        self.drives_changed()

    def _require_stays(self, member: Member) -> None:
        if member.drive.id in self._parting:
            raise Busy(
                f"{member.drive.name} is being taken off the bench",
                drive=member.drive.name,
                remedy="wait until it is gone, then add it again if it is still needed",
            )

    async def let_go(self, drive_id: str) -> None:
        """Take the power off an axis that was enabled here and left so; never raises."""
        member = self.members.get(drive_id)
        if member is not None:
            job = self.jobs.moving(drive_id)
            if job is not None:
                # Of the page that is gone, and being ended: the axis is brought to rest first.
                await job.wait()
            await self._let_go(member)
            member.monitor.hurry()

    async def _let_go(self, member: Member) -> None:
        try:
            await member.axis.let_go()
        except DriveError as error:
            # Told to stop as soon as it answers, here or after it was put back on the bench.
            member.axis.owes_stop = True
            text = f"{member.drive.name} may still be enabled: {error.message}"
            self.journal.add(text, level="error", drive=member.drive.id)

    def rename(self, drive_id: str, name: str | None, notes: str | None) -> Member:
        """Change name or notes; None leaves them.

        Raises:
            StorageFailed: they could not be stored and are as before.
        """
        member = self.member(drive_id)
        drive = member.drive
        before = drive.name, drive.notes
        drive.name = drive.name if name is None else name
        drive.notes = drive.notes if notes is None else notes
        try:
            self._save()
        except StorageFailed:
            drive.name, drive.notes = before
            raise
        self.drives_changed()
        return member

    # --- moving and stopping ----------------------------------------------------------

    def _permit(self, drive_id: str) -> None:
        """A new motion begins by a person's command; it takes back an earlier STOP.

        Raises:
            Busy: the exchange of its bus is being started or ended, or it leaves the bench.
        """
        member = self.member(drive_id)
        self._require_stays(member)
        if self._still[drive_id]:
            raise Busy(
                f"{member.drive.name}: its settings are just being changed",
                drive=member.drive.name,
                remedy="try again when they have been",
            )
        self.exchanges.require_calm(member.drive.name, self._urls(member.drive))
        member.axis.permit()

    async def stop(self, drive_ids: Sequence[str]) -> dict[str, str]:
        """Quick stop of these drives, all at once; motion jobs are cancelled.

        The write does not wait for any job's cleanup, and goes out even when whoever asked for
        it is gone by then. Returns drive id to problem, empty text where the drive took the stop.
        """
        members = [self.member(drive_id) for drive_id in drive_ids]
        for member in members:
            # Before anything else runs: nothing in progress may enable the axis from here on.
            member.axis.stopped = True
            job = self.jobs.moving(member.drive.id)
            if job is not None and job.stoppable and job.task is not None:
                # Cancelled before the write, so that it sends nothing after it but its cleanup.
                job.task.cancel()
        task = asyncio.create_task(self._stop(members), name="stop")
        self._stops.add(task)
        task.add_done_callback(self._stops.discard)
        self._witness.stopped(drive_ids)
        return await asyncio.shield(task)

    async def _stop(self, members: Sequence[Member]) -> dict[str, str]:
        async def one(member: Member) -> str:
            problem = ""
            try:
                await member.axis.stop()
            except DriveError as error:
                problem = error.message
            member.monitor.hurry()
            return problem

        problems = await asyncio.gather(*(one(member) for member in members))
        return {m.drive.id: text for m, text in zip(members, problems, strict=True)}

    # --- events -----------------------------------------------------------------------

    def _snapshot(self, drive_id: str, snapshot: Snapshot) -> None:
        if (member := self.members.get(drive_id)) is not None:
            self.returning.seen(member, snapshot)
        for listener in self.on_snapshot:
            listener(drive_id, snapshot)

    def _readings(self, drive_id: str, readings: list[Reading]) -> None:
        for listener in self.on_readings:
            listener(drive_id, readings)

    def _job_changed(self, job: Job) -> None:
        for listener in self.on_job:
            try:
                listener(job)
            except Exception:
                # The next one may be who stops it, and the job itself must come to its end.
                log.exception("a change of the job %s could not be told", job.id)

    def _lease_changed(self, drive_id: str) -> None:
        self._witness.lease_changed(drive_id, self.leases.holder(drive_id))
        self.drives_changed()

    def tell(self, text: str, member: Member, level: Level = "info") -> None:
        """A line of the journal about a drive; the list of drives may have changed with it."""
        self.journal.add(text, level=level, drive=member.drive.id)
        self.drives_changed()

    def name_of(self, drive_id: str) -> str:
        """Name of a drive, or its id where it is not on the bench."""
        member = self.members.get(drive_id)
        return member.drive.name if member is not None else drive_id

    def drives_changed(self) -> None:
        """Tell everybody that the list of drives and buses may look different now."""
        for listener in self.on_drives:
            listener()

    async def accept_identity(self, drive_id: str) -> Member:
        """The user says that the drive at this place is the right one."""
        member = self.member(drive_id)
        drive = member.drive
        serial = await drive.read_serial()
        drive.found = replace(drive.found or Found(drive.ports[0].station), serial=serial)
        drive.identity_warning = ""
        # What was left in the drive that was here before is no matter of this one.
        drive.owed.settle([debt.key for debt in drive.owed.debts])
        self.journal.add(f"{drive.name}: serial number {serial} accepted", drive=drive.id)
        self._remember()
        self.drives_changed()
        return member

    # --- over restarts ----------------------------------------------------------------

    def _remember(self) -> None:
        """Store the list of drives; where that fails the bench works on, and says so."""
        try:
            self._save()
        except StorageFailed as error:
            text = f"the list of drives is not stored, a restart begins with the old one: {error}"
            self.journal.add(text, level="error")

    def _save(self) -> None:
        self._list.store(
            SavedDrive(
                name=m.drive.name,
                notes=m.drive.notes,
                profile=m.drive.profile.drive,
                ports=tuple(SavedPort(self.url_of(p), p.station) for p in m.drive.ports),
                serial=m.drive.found.serial if m.drive.found else None,
            )
            for m in self.members.values()
        )

    async def restore(self) -> None:
        """Connect the drives of the last session; those that cannot be are logged and kept out."""
        await self.records.open()
        saved, problems = self._list.load()
        for problem in problems:
            self.journal.add(problem, level="error")
        for item in saved:
            try:
                first, *others = item.ports
                member = await self.connect(first.url, first.station, item.profile, item.name)
                member.drive.notes = item.notes
                for other in others:
                    await self.add_port(member.drive.id, other.url, other.station)
            except (DriveError, ProfileError) as error:
                self.journal.add(f"{item.name}: not connected: {error}", level="warning")
                continue
            if item.serial is not None:
                member.drive.found = Found(first.station, serial=item.serial)
                self.returning.returned(member.drive.id)

    async def close(self) -> None:
        """Stop what moves, then let go of every bus; what fails keeps nothing else from its end."""
        async with contextlib.AsyncExitStack() as then:
            then.push_async_callback(self.records.close)
            then.push_async_callback(self._close_links)
            then.push_async_callback(self.scope.close)
            then.push_async_callback(self.exchanges.close)
            then.push_async_callback(self._let_go_of_all)
            await self.jobs.close()

    async def _let_go_of_all(self) -> None:
        await asyncio.gather(*(self._let_go(member) for member in self.members.values()))

    async def _close_links(self) -> None:
        await asyncio.gather(*(m.monitor.close() for m in self.members.values()))
        await asyncio.gather(
            *(link.close() for link in self.links.values()), return_exceptions=True
        )
