"""Actions when a drive answers again: everything is read again, as it may have restarted."""

from __future__ import annotations

from typing import TYPE_CHECKING

from backend.axes.axis.axis import Axis
from backend.axes.drive.drive import Drive
from backend.axes.drive.identity import confirm_identity
from backend.axes.restore.identity import identity_of
from backend.axes.restore.keep import keep_list
from backend.axes.restore.store import RestoreStore
from backend.foundation.store.files import StorageFailed
from backend.foundation.work.jobs import Job, JobResult, Progress
from backend.station.drives.monitor import Snapshot
from backend.tools.measuring.restore import settle
from drivers.cia402 import State
from drivers.errors import Busy, NotAllowed
from drivers.link import Found
from drivers.texts.message import text

if TYPE_CHECKING:
    from backend.station.bench import Bench
    from backend.station.drives.connected_drive import ConnectedDrive

_STANDS_S, _STANDS_RPM = 0.5, 5.0


class Reconnection:
    """Reconnection of the drives of one bench."""

    def __init__(self, bench: Bench, lists: RestoreStore) -> None:
        self._bench = bench
        self._lists = lists
        #: Drives with pending restores whose axis was enabled, moving or in a job at their return.
        self._awaited: set[str] = set()

    def begin(self, axis: Axis) -> None:
        """Load the restore list that an earlier server or command left, and keep it from now on.

        An axis that was moved by a process killed a moment ago is stopped: a motion that the drive
        carries out by itself, such as homing, continues without the process.
        """
        drive, journal = axis.drive, self._bench.journal
        known = self._lists.list_of(identity_of(drive), drive.id)
        pending = known.pending
        if pending.moved:
            axis.stop_pending = True
        if pending.held_by:
            line = text("journal.held-by-another", drive=drive.name, holder=pending.held_by)
            journal.add(line, level="warning", drive=drive.id)

        for file in pending.unreadable:
            line = text("restore.list-damaged", drive=drive.name, file=str(file))
            journal.add(line, level="error", drive=drive.id)

        def failed(error: StorageFailed) -> None:
            line = text("journal.restore-list-not-kept", cause=error.text)
            journal.add(line, level="warning", drive=drive.id)

        # A stop that did not reach the drive stays pending for the next server as well.
        keep_list(
            drive,
            known,
            in_motion=lambda: drive.pending_restores.in_motion or axis.stop_pending,
            failed=failed,
        )
        if drive.found is None and pending.serial is not None:
            # The pending restores belong to this serial number: another drive is detected by it.
            drive.found = Found(drive.ports[0].station, serial=pending.serial)

    def returned(self, drive_id: str) -> None:
        """Read everything again and restore pending values, as the drive may have restarted."""
        connected = self._bench.connected_drives.get(drive_id)
        if connected is None:
            return
        drive = connected.drive
        keys = [key for key, r in drive.readings.items() if r.raw is not None]
        drive.forget()
        connected.axis.forget()

        async def reread(progress: Progress) -> JobResult:
            if await self._is_the_same(connected) and drive.pending_restores:
                await self._settled(connected)
            await drive.read_many(keys, progress)
            return {"parameters": len(keys)}

        # Not limited in number: the drives of a whole bench may return at one moment.
        self._bench.jobs.start(
            "reread",
            text("station.read-anew", drive_name=drive.name),
            reread,
            drive=drive_id,
            by_person=False,
        )

    async def _is_the_same(self, connected: ConnectedDrive) -> bool:
        """Whether the connected drive answers; detects another drive before anything is written."""
        drive = connected.drive
        if _serial(drive) is None:
            return True
        try:
            await confirm_identity(drive)
        except NotAllowed as error:
            self._bench.tell(drive.identity_warning or error.text, connected, "error")
            return False
        return True

    async def _settled(self, connected: ConnectedDrive) -> None:
        """Restore pending values now, or later where the axis is enabled, moving or in a job."""
        drive_id = connected.drive.id
        if self._bench.jobs.moving(drive_id) is not None:
            self._awaited.add(drive_id)
            return
        enabled = await connected.axis.state() is State.OPERATION_ENABLED
        if enabled or not await connected.axis.standstill(_STANDS_S):
            self._awaited.add(drive_id)
            return
        try:
            job = self.start(connected, asked=False)
        except Busy:
            # The drive was lost and returned once more during these checks.
            self._awaited.add(drive_id)
            return
        await job.wait()

    def seen(self, connected: ConnectedDrive, snapshot: Snapshot) -> None:
        """Restore pending values once an axis that could not be restored at once is free.

        Tried once; values that cannot be restored then remain offered to the user.
        """
        drive = connected.drive
        if drive.id not in self._awaited or not snapshot.fresh:
            return
        turns = abs(snapshot.values.get("velocity") or 0.0) > _STANDS_RPM
        if snapshot.state is State.OPERATION_ENABLED or turns or self._bench.jobs.moving(drive.id):
            return
        self._awaited.discard(drive.id)
        if drive.pending_restores:
            self.start(connected, asked=False)

    def start(self, connected: ConnectedDrive, *, asked: bool) -> Job:
        """Restore pending values, as a job during which the axis cannot be moved.

        ``asked``: a person requested it.

        Raises:
            Busy: another job moves the axis.
        """
        bench, drive = self._bench, connected.drive

        async def work(_progress: Progress) -> JobResult:
            found = await settle(connected.axis, asked=asked)
            for what in ("back", "left"):
                values = found[what]
                if isinstance(values, dict) and values:
                    words = ", ".join(f"{key} = {value}" for key, value in values.items())
                    restored = what == "back"
                    line = text(
                        "journal.restored" if restored else "journal.not-restored",
                        drive=drive.name,
                        values=words,
                    )
                    bench.tell(line, connected, "warning")
            return found

        return bench.jobs.start(
            "put-back",
            text("station.put-back-motion-left", drive_name=drive.name),
            work,
            drive=drive.id,
            motion=True,
            stoppable=False,
            by_person=asked,
        )


def _serial(drive: Drive) -> int | None:
    return drive.found.serial if drive.found is not None else None
