"""The bench: opened buses, connected drives, and their monitoring."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Awaitable, Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.axis.remembered import AxisStore
from backend.axes.drive.drive import Drive
from backend.axes.drive.identity import place_of, read_serial
from backend.axes.drive.ports import Port
from backend.axes.drive.readings import Reading
from backend.axes.motion.authority import MotionAuthority
from backend.axes.restore.store import RestoreStore
from backend.axes.scales.taught import TaughtDrive
from backend.axes.scope.hub import ScopeHub
from backend.foundation.people.lease import Leases
from backend.foundation.store.files import StorageFailed
from backend.foundation.work.jobs import Job, JobRunner
from backend.foundation.work.journal import Journal, Level
from backend.records.audit.recorder import AuditRecorder
from backend.records.library.measurements import MeasurementStore
from backend.station.buses import Buses
from backend.station.doctor import Doctor
from backend.station.drives.connected_drive import ConnectedDrive
from backend.station.drives.drive_list import DriveList, SavedDrive, SavedPort
from backend.station.drives.matching import profile_for
from backend.station.drives.monitor import Monitor, Snapshot
from backend.station.drives.naming import PlaceNames, new_id
from backend.station.drives.reconnection import Reconnection
from backend.station.exchanges import Exchanges
from backend.station.motion import Motion
from backend.station.records import Records
from drivers.errors import Busy, DriveError, NotAllowed, why_of
from drivers.link import Found, Link
from drivers.texts.message import Text, text
from drivers.texts.profile_errors import profile_error_text
from profiles.loader import ProfileError

log = logging.getLogger(__name__)


class Bench:
    """Buses and drives of one server.

    ``wires`` as in `Buses`. ``names``: default names of drives by bus URL and station.
    ``state_folder`` holds the list of drives across restarts, and the data of `Records`.
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
        self.buses = Buses(self, wires or {})
        self._names = PlaceNames(names or {})
        self.journal = Journal()
        self.records = Records(state_folder, self.journal, database, blobs)
        self.audit = self.records.audit
        self.sets = self.records.sets
        self.measurements = MeasurementStore(state_folder / "measurements")
        self.connected_drives: dict[str, ConnectedDrive] = {}
        self.on_snapshot: list[Callable[[str, Snapshot], None]] = []
        self.on_readings: list[Callable[[str, list[Reading]], None]] = []
        self.on_job: list[Callable[[Job], None]] = []
        self.on_drives: list[Callable[[], None]] = []
        self.motion = Motion(self)
        #: Motion authority shared by all drives of the bench.
        self.authority = MotionAuthority()
        self.jobs = JobRunner(self._job_changed, self.motion.permit, self.motion.granted)
        #: Bus and station of removed drives to which a stop was never delivered.
        self._unstopped: set[tuple[str, int]] = set()
        self.exchanges = Exchanges(self)
        self.sessions = self.exchanges.running
        self.doctor = Doctor(self)
        self.leases = Leases(self._lease_changed)
        self.recorder = AuditRecorder(self.audit, self.name_of)
        self.on_job.append(self.recorder.job_changed)
        self.reconnection = Reconnection(self, RestoreStore(state_folder, "a server"))
        self.scope = ScopeHub(lambda drive: self.connected(drive).axis)
        self.state_folder = state_folder
        self.axis_records = AxisStore(state_folder / "axes")
        self._list = DriveList(state_folder / "bench.json")
        #: Drives of the list that could not be connected, and ports of connected ones by drive id:
        #: they stay in the list, as an adapter may be missing at one start only.
        self._unreached: list[SavedDrive] = []
        self._unreached_ports: dict[str, tuple[SavedPort, ...]] = {}
        self._restoring = False

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

        ``by_speed`` as in `CyclicSession`. ``in_job_of``: drive whose own job requests the
        exchange.

        Raises:
            NotAllowed: no drives, no cyclic data on this bus, or a drive refuses.
            Busy: the exchange runs already, or a drive is moving.
        """
        return await self.exchanges.start(url, cycle_s, by_speed=by_speed, in_job_of=in_job_of)

    async def stop_cyclic(self, url: str) -> None:
        """End the exchange of a bus; moving axes are braked. Does nothing where none runs.

        Raises:
            Busy: it is just being started or ended.
        """
        await self.exchanges.stop(url)

    # --- drives -----------------------------------------------------------------------

    def connected(self, drive_id: str) -> ConnectedDrive:
        """The drive of this id.

        Raises:
            NotAllowed: there is none.
        """
        connected = self.connected_drives.get(drive_id)
        if connected is None:
            raise NotAllowed("station.no-drive-bench", drive=drive_id)
        return connected

    async def connect(
        self,
        url: str,
        station: int,
        profile: str,
        name: str = "",
        *,
        found: Found | None = None,
        drive_id: str = "",
        serial: int | None = None,
    ) -> ConnectedDrive:
        """Add the drive at a station to the bench, with this id or a new one.

        ``serial``: its serial number by the list of drives.

        Raises:
            Busy: another drive uses this station.
            LinkLost: the bus cannot be opened.
            NotAllowed: no such profile, or its drives have no port for this kind of bus.
        """
        link = await self.buses.open(url)
        self._require_free(link, url, station)
        facts, spec = profile_for(link.kind, profile)
        link.attach(station, facts)
        if name and not drive_id:
            # A person who gives the name of a missing drive has it at another place now.
            missing = next((each for each in self._unreached if each.name == name), None)
            if missing is not None:
                self._unreached.remove(missing)
                drive_id = missing.id
        name = name or self._names.unused(
            url, station, [m.drive.name for m in self.connected_drives.values()]
        )
        if not drive_id or drive_id in self.connected_drives:
            # What is kept of an axis that is missing now must not become that of another one.
            taken = {*self.connected_drives, *(each.id for each in self._unreached)}
            drive_id = new_id(name or f"{profile}-{station}", taken)
        drive = Drive(
            drive_id, name or drive_id, facts, [Port(link, station, spec)], self.authority
        )
        drive.found = found
        return self._add(drive, serial)

    async def add_port(
        self,
        drive_id: str,
        url: str,
        station: int,
        check: Callable[[Drive, Port], Awaitable[None]] | None = None,
    ) -> ConnectedDrive:
        """Connect a drive over a second bus, so that each parameter uses the port that carries it.

        ``check`` is called with drive and port before the port is used, and raises where it must
        not.

        Raises:
            NotAllowed: its family has no such link.
            Busy: the station is in use, or the drive is moved.
        """
        connected = self.connected(drive_id)
        drive = connected.drive
        self.motion.require_idle(connected)
        link = await self.buses.open(url)
        self._require_free(link, url, station)
        spec = drive.profile.link(link.kind)
        if spec is None:
            raise NotAllowed(
                "station.no-port",
                drive=drive.name,
                value=url,
                limit=", ".join(known.kind for known in drive.profile.links),
                profile_title=drive.profile.title,
                kind=link.kind,
            )
        link.attach(station, drive.profile)
        port = Port(link, station, spec)
        if check is not None:
            await check(drive, port)
            self._require_free(link, url, station)
            self.motion.require_idle(connected)
        drive.ports = (*drive.ports, port)
        self._remember()
        line = text("journal.reached-over-too", drive=drive.name, url=url)
        self.journal.add(line, drive=drive.id)
        self.drives_changed()
        return connected

    def _require_free(self, link: Link, url: str, station: int) -> None:
        for connected in self.connected_drives.values():
            if any(p.link is link and p.station == station for p in connected.drive.ports):
                raise Busy(
                    "station.station-already-connected",
                    drive=connected.drive.name,
                    url=url,
                    station=station,
                )

    def _add(self, drive: Drive, serial: int | None) -> ConnectedDrive:
        axis = Axis(drive)
        places = {(self.buses.url_of(port), port.station) for port in drive.ports}
        axis.stop_pending = bool(places & self._unstopped)
        axis.unattended = partial(self.motion.unattended, drive.id)
        axis.scales_changed = partial(self.motion.scales_changed, drive.id)
        self._unstopped -= places
        drive_id = drive.id
        monitor = Monitor(
            axis,
            self.journal,
            lambda snapshot: self._snapshot(drive_id, snapshot),
            lambda: self.reconnection.returned(drive_id),
            lambda: self._may_turn(drive_id),
        )
        connected = ConnectedDrive(drive, axis, monitor)
        self.connected_drives[drive_id] = connected
        drive.listeners.add(lambda readings: self._readings(drive_id, readings))
        drive.listeners.add_writes(self.recorder.wrote)
        drive.listeners.add_commands(self.recorder.commanded)
        drive.listeners.add_refusals(self.recorder.refused)
        drive.pending_restores.listen(self.drives_changed)
        self.reconnection.begin(axis)
        self._take_scales(axis, serial)
        monitor.start()
        self._remember()
        line = text("journal.connected", drive=drive.name, profile_title=drive.profile.title)
        self.journal.add(line, drive=drive_id)
        self.drives_changed()
        return connected

    def taught_drive(self, drive: Drive, serial: int | None = None) -> TaughtDrive:
        """What is known of a drive, to tell whether scales were stated for it."""
        found = drive.found
        return TaughtDrive(
            profile=drive.profile.drive,
            serial=(found.serial if found is not None else None) or serial,
            places=tuple(place_of(port.url, port.station) for port in self._ports_of(drive)),
        )

    def _take_scales(self, axis: Axis, serial: int | None) -> None:
        """Set the scales stated for this drive; those of another one with its id are not used."""
        drive = axis.drive
        taught = self.axis_records.get(drive.id).scales
        if taught is None:
            return
        if taught.drive is not None and taught.drive.is_same(self.taught_drive(drive, serial)):
            axis.teach(taught)
            return
        axis.teach(None, taught.not_used)
        line = text("journal.scales-not-used", drive=drive.name, not_used=taught.not_used)
        self.journal.add(line, level="warning", drive=drive.id)
        if taught.drive is None:
            # Of an earlier version, for a drive that is in the list no more: at the next start
            # they would be taken for those of this drive.
            self._forget_scales(drive.id)

    def _forget_scales(self, drive_id: str) -> None:
        """Remove stored scales; a failure is logged."""
        record = self.axis_records.get(drive_id)
        try:
            self.axis_records.put(drive_id, record.model_copy(update={"scales": None}))
        except StorageFailed as error:
            line = text("journal.scales-not-removed", drive=drive_id, cause=error.text)
            self.journal.add(line, level="error")

    def _forget_scales_without_serial(self, drive_id: str) -> None:
        """Remove the scales of a drive that leaves the list, where it has no known serial number.

        The next drive of this name at this place may be another one.
        """
        taught = self.axis_records.get(drive_id).scales
        if taught is not None and (taught.drive is None or taught.drive.serial is None):
            self._forget_scales(drive_id)

    def _may_turn(self, drive_id: str) -> bool:
        """Whether this axis may turn: it is moved by a job, under a grant, or being stopped."""
        connected = self.connected_drives.get(drive_id)
        if connected is None:
            return True
        moved = self.jobs.moving(drive_id) is not None or self.motion.stopping(drive_id)
        return moved or self.authority.grant_of(drive_id) is not None

    async def remove(self, drive_id: str) -> None:
        """Remove a drive from the bench, or one from its list that could not be connected.

        Raises:
            Busy: it is moving, or another axis moves through the exchange that would end with it.
            StorageFailed: it was not connected, and the list could not be stored.
        """
        if (missing := self.missing(drive_id)) is not None:
            self._remove_missing(missing)
            return
        connected = self.connected(drive_id)
        self.motion.require_stays(connected)
        self.motion.require_idle(connected)
        self.exchanges.require_idle_but(connected)
        with self.motion.parting(connected):
            # A STOP in progress is completed, and its caller receives the verdict.
            await self.motion.standstill([drive_id])
            await self.motion.end_watches(drive_id)
            await self.motion.let_go_of(connected)
            for url, session in list(self.sessions.items()):
                if connected.drive in session.drives:
                    self.exchanges.require_idle_but(connected)
                    await self.stop_cyclic(url)
            if connected.axis.stop_pending:
                self._unstopped.update(
                    (self.buses.url_of(p), p.station) for p in connected.drive.ports
                )
            del self.connected_drives[drive_id]
            self._unreached_ports.pop(drive_id, None)
            # Pending restores are shown first on an axis' pages: whoever removes it has read them.
            connected.drive.pending_restores.settle(
                [entry.key for entry in connected.drive.pending_restores.entries]
            )
            self._forget_scales_without_serial(drive_id)
        await connected.monitor.close()
        self._remember()
        self.drives_changed()

    def missing(self, drive_id: str) -> SavedDrive | None:
        """The drive of the list with this id that could not be connected; None without one."""
        if self._restoring or drive_id in self.connected_drives:
            return None
        return next((each for each in self._unreached if each.id == drive_id), None)

    def _remove_missing(self, missing: SavedDrive) -> None:
        before = self._unreached
        self._unreached = [each for each in before if each is not missing]
        try:
            self._save()
        except StorageFailed:
            self._unreached = before
            raise
        self._forget_scales_without_serial(missing.id)

    def rename(self, drive_id: str, name: str | None, notes: str | None) -> ConnectedDrive:
        """Change name or notes; None leaves them unchanged.

        Raises:
            StorageFailed: they could not be stored and are unchanged.
        """
        connected = self.connected(drive_id)
        drive = connected.drive
        before = drive.name, drive.notes
        drive.name = drive.name if name is None else name
        drive.notes = drive.notes if notes is None else notes
        try:
            self._save()
        except StorageFailed:
            drive.name, drive.notes = before
            raise
        self.drives_changed()
        return connected

    # --- events -----------------------------------------------------------------------

    def _snapshot(self, drive_id: str, snapshot: Snapshot) -> None:
        if (connected := self.connected_drives.get(drive_id)) is not None:
            self.reconnection.seen(connected, snapshot)
            self.buses.seen(connected.drive)
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
                # A failing listener must not prevent the others from acting, nor the job from
                # ending.
                log.exception("a change of the job %s could not be known", job.id)

    def _lease_changed(self, drive_id: str) -> None:
        self.recorder.lease_changed(drive_id, self.leases.holder(drive_id))
        self.drives_changed()

    def tell(self, line: Text, connected: ConnectedDrive, level: Level = "info") -> None:
        """Add a journal line about a drive, and notify that the list of drives may have changed."""
        self.journal.add(line, level=level, drive=connected.drive.id)
        self.drives_changed()

    def name_of(self, drive_id: str) -> str:
        """Name of a drive; its id where it is not in the list."""
        connected = self.connected_drives.get(drive_id)
        if connected is not None:
            return connected.drive.name
        missing = self.missing(drive_id)
        return missing.name if missing is not None else drive_id

    def drives_changed(self) -> None:
        """Notify all listeners that the list of drives or buses may have changed."""
        for listener in self.on_drives:
            listener()

    async def accept_identity(self, drive_id: str) -> ConnectedDrive:
        """Accept the drive that answers at this station, as confirmed by the user."""
        connected = self.connected(drive_id)
        drive = connected.drive
        serial = await read_serial(drive)
        drive.found = replace(drive.found or Found(drive.ports[0].station), serial=serial)
        drive.identity_warning = None
        # Scales stated for the earlier drive do not hold for this one.
        connected.axis.teach(None)
        connected.axis.small_moves = None
        record = self.axis_records.get(drive_id)
        if record.scales is not None:
            self.axis_records.put(drive_id, record.model_copy(update={"scales": None}))
        drive.pending_restores.settle([entry.key for entry in drive.pending_restores.entries])
        line = text("journal.serial-accepted", drive=drive.name, serial=str(serial))
        self.journal.add(line, drive=drive.id)
        self._remember()
        self.drives_changed()
        return connected

    # --- across restarts --------------------------------------------------------------

    def _remember(self) -> None:
        """Store the list of drives; a failure is logged and does not stop the bench.

        While the drives of the list are being connected, it stays as it is.
        """
        if self._restoring:
            return
        try:
            self._save()
        except StorageFailed as error:
            line = text("journal.list-not-stored", cause=error.text)
            self.journal.add(line, level="error")

    def _save(self) -> None:
        here = [
            SavedDrive(
                name=m.drive.name,
                notes=m.drive.notes,
                profile=m.drive.profile.drive,
                ports=self._ports_of(m.drive),
                serial=m.drive.found.serial if m.drive.found else None,
                id=m.drive.id,
            )
            for m in self.connected_drives.values()
        ]
        # Whoever connects another drive at the same place has replaced the one of the list.
        taken = {port for drive in here for port in drive.ports}
        for each in [each for each in self._unreached if taken & set(each.ports)]:
            self._unreached.remove(each)
            self._forget_scales_without_serial(each.id)
        self._list.store([*here, *self._unreached])

    def _ports_of(self, drive: Drive) -> tuple[SavedPort, ...]:
        ports = [SavedPort(self.buses.url_of(port), port.station) for port in drive.ports]
        more = (p for p in self._unreached_ports.get(drive.id, ()) if p not in ports)
        return (*ports, *more)

    async def restore(self) -> None:
        """Connect the drives of the last session.

        Those that fail are logged, and stay in the list for the next start.
        """
        await self.records.open()
        saved, problems = self._list.load()
        for problem in problems:
            self.journal.add(problem, level="error")
        self._restoring = True
        self._unreached = _with_ids(saved)
        self._complete_scales()
        try:
            for item in list(self._unreached):
                await self._restore_drive(item)
        finally:
            self._restoring = False

    def _complete_scales(self) -> None:
        """State in scales of earlier versions the drive of the list that they were used for."""
        for item in self._unreached:
            record = self.axis_records.get(item.id)
            if record.scales is None or record.scales.drive is not None:
                continue
            drive = TaughtDrive(
                profile=item.profile,
                serial=item.serial,
                places=tuple(place_of(port.url, port.station) for port in item.ports),
            )
            scales = record.scales.model_copy(update={"drive": drive})
            with contextlib.suppress(StorageFailed):
                self.axis_records.put(item.id, record.model_copy(update={"scales": scales}))

    async def _restore_drive(self, item: SavedDrive) -> None:
        first, *others = item.ports
        try:
            connected = await self.connect(
                first.url,
                first.station,
                item.profile,
                item.name,
                drive_id=item.id,
                serial=item.serial,
            )
        except (DriveError, ProfileError) as error:
            self._not_connected(item, error)
            line = text("journal.stays-in-list", drive=item.name, id=item.id)
            self.journal.add(line, level="warning")
            return
        self._unreached.remove(item)
        drive = connected.drive
        drive.notes = item.notes
        if item.serial is not None:
            drive.found = Found(first.station, serial=item.serial)
        for other in others:
            try:
                await self.add_port(drive.id, other.url, other.station)
            except DriveError as error:
                missing = self._unreached_ports.get(drive.id, ())
                self._unreached_ports[drive.id] = (*missing, other)
                self._not_connected(item, error)
        if item.serial is not None:
            self.reconnection.returned(drive.id)

    def _not_connected(self, item: SavedDrive, error: DriveError | ProfileError) -> None:
        why = profile_error_text(error) if isinstance(error, ProfileError) else why_of(error)
        line = text("journal.not-connected", drive=item.name, cause=why)
        self.journal.add(line, level="warning")

    async def close(self) -> None:
        """Stop all motion, then close every bus; a failure does not prevent the other steps."""
        async with contextlib.AsyncExitStack() as then:
            then.push_async_callback(self.records.close)
            then.push_async_callback(self._close_buses)
            then.push_async_callback(self.scope.close)
            then.push_async_callback(self.exchanges.close)
            then.push_async_callback(self.motion.let_go_of_all)
            then.push_async_callback(self.motion.end_watches)
            await self.jobs.close()

    async def _close_buses(self) -> None:
        await asyncio.gather(*(m.monitor.close() for m in self.connected_drives.values()))
        await self.buses.close_all()


def _with_ids(saved: Sequence[SavedDrive]) -> list[SavedDrive]:
    """The drives of a list, each with an id of its own: the stored one, else as it was made."""
    taken: set[str] = set()
    found = []
    for item in saved:
        name, drive_id = item.name or f"{item.profile}-{item.ports[0].station}", item.id
        if not drive_id or drive_id in taken or drive_id != new_id(drive_id, ()):
            drive_id = new_id(name, {*taken, *(each.id for each in saved)})
        taken.add(drive_id)
        found.append(replace(item, id=drive_id))
    return found
