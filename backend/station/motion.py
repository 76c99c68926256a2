"""Permission for axes of a bench to begin a motion, and STOP."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from backend.axes.axis.stop.facts import AxisStop, Verdict
from backend.axes.stopping.stop_message import stop_message
from backend.axes.stopping.watch import StopWatch
from backend.station.drives.connected_drive import ConnectedDrive
from drivers.cia402 import State
from drivers.errors import Busy, DriveError, internal_error
from drivers.texts.message import Text, text

if TYPE_CHECKING:
    from backend.foundation.work.jobs import Job
    from backend.station.bench import Bench

log = logging.getLogger(__name__)

_STOP_PRESSED = text("motion.stop-was-pressed")


class Motion:
    """Motion of one bench: interlocks, STOP of all axes, and switching the power off."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._stops: set[asyncio.Task[dict[str, Text | None]]] = set()
        self._later: set[asyncio.Task[None]] = set()
        #: Supervision of each stopped axis, by drive; it continues when nobody waits for it.
        self._watches: dict[str, asyncio.Task[AxisStop]] = {}
        #: Drives with a change in progress during which no motion may begin.
        self._still: Counter[str] = Counter()
        #: Drives that are being removed.
        self._parting: set[str] = set()

    @contextlib.contextmanager
    def keeping_still(self, connected: ConnectedDrive) -> Iterator[None]:
        """Context in which no motion of this axis begins, as settings it relies on are changed.

        STOP works meanwhile.

        Raises:
            Busy: a job moves the axis already.
        """
        self.require_idle(connected)
        self._still[connected.drive.id] += 1
        try:
            yield
        finally:
            self._still[connected.drive.id] -= 1

    def require_idle(self, connected: ConnectedDrive) -> None:
        """Check that no job moves this axis.

        Raises:
            Busy: a job does.
        """
        if (job := self._bench.jobs.moving(connected.drive.id)) is not None:
            raise Busy("station.moved", drive=connected.drive.name, job_title=job.title_text)

    @contextlib.contextmanager
    def parting(self, connected: ConnectedDrive) -> Iterator[None]:
        """Context of removing a drive: no motion may begin, as STOP reaches listed axes only."""
        self._parting.add(connected.drive.id)
        try:
            yield
        finally:
            self._parting.discard(connected.drive.id)

    def require_stays(self, connected: ConnectedDrive) -> None:
        """Check that this drive is not being removed.

        Raises:
            Busy: it is.
        """
        if connected.drive.id in self._parting:
            raise Busy("station.being-taken-off-bench", drive=connected.drive.name)

    def permit(self, drive_id: str) -> None:
        """Permit a new motion by a person's command; it cancels an earlier STOP.

        Raises:
            Busy: the exchange of its bus is being started or ended, its settings are being changed,
                or the drive is being removed.
            NotAllowed: STOP was pressed after the command had been given.
        """
        connected = self._bench.connected(drive_id)
        self.require_stays(connected)
        if self._still[drive_id]:
            raise Busy("station.settings-just-being-changed", drive=connected.drive.name)
        self._bench.exchanges.require_calm(
            connected.drive.name, self._bench.buses.urls_of(connected.drive)
        )
        connected.axis.permit()
        # The earlier supervision notices the permit and ends; a STOP of the new motion gets its
        # own.
        self._watches.pop(drive_id, None)

    def granted(self, job: Job) -> contextlib.AbstractContextManager[object]:
        """Grants that a job holds for its duration, one for each axis that it moves.

        Work that STOP does not cancel (`Job.stoppable` is False) has none, as it keeps its axis at
        standstill. When the grant ends before the job, the job is cancelled and stops its axis.
        """
        found = [self._bench.connected_drives.get(each) for each in job.moved]
        drives = [connected.drive for connected in found if connected is not None]
        if not drives or not job.stoppable:
            return contextlib.nullcontext()

        @contextlib.contextmanager
        def grants() -> Iterator[None]:
            with contextlib.ExitStack() as held:
                for drive in drives:
                    held.enter_context(
                        self._bench.authority.granted(
                            drive.id, drive.name, job.title_text, ended=job.cancel
                        )
                    )
                yield

        return grants()

    def scales_changed(self, drive_id: str, keys: Sequence[str]) -> None:
        """End a motion that was planned with scales other than the present ones."""
        connected = self._bench.connected_drives.get(drive_id)
        authority = self._bench.authority
        if connected is None or authority.mover_of(drive_id) is None:
            return
        drive = connected.drive
        word = drive.readings.get(drive.require("status_word"))
        raw = None if word is None else word.integer
        if raw is None or drive.decode_state(raw) is not State.OPERATION_ENABLED:
            return  # it has no power yet: enabling compares the scales itself
        line = text("scales.changed-in-motion", drive=drive.name, parameter=", ".join(keys))
        self._bench.journal.add(line, level="error", drive=drive_id)
        authority.end_motion(drive_id, line)

    def unattended(self, drive_id: str, why: Text) -> None:
        """Switch off the power of an axis that nobody may leave enabled any longer."""
        connected = self._bench.connected_drives.get(drive_id)
        if connected is None or connected.axis.stopped:
            return  # STOP switches the power off and reports the result
        line = text("station.loses-power-unattended", drive=connected.drive.name, why=why)
        self._bench.journal.add(line, level="warning", drive=drive_id)
        task = asyncio.create_task(self.let_go(drive_id), name=f"unattended-{drive_id}")
        self._later.add(task)
        task.add_done_callback(self._later.discard)

    def awoke(self, gap_s: float) -> None:
        """Stop every axis that may move or is enabled: the computer slept for ``gap_s`` [s]."""
        line = text("station.computer-slept", gap_s=gap_s)
        self._bench.journal.add(line, level="warning")
        granted = self._bench.authority.grant_of
        drives = [each for each in self._bench.connected_drives if granted(each) is not None]
        if drives:
            task = asyncio.create_task(self._stop_after_sleep(drives, line), name="stop-awoke")
            self._later.add(task)
            task.add_done_callback(self._later.discard)

    async def _stop_after_sleep(self, drive_ids: Sequence[str], why: Text) -> None:
        await self.stop(drive_ids, why)

    async def stop(
        self, drive_ids: Sequence[str], why: Text = _STOP_PRESSED
    ) -> dict[str, Text | None]:
        """Quick stop of these drives, all at once; motion jobs are cancelled because of ``why``.

        The write does not wait for any job's cleanup, and is sent even when the caller has been
        cancelled. Returns the problem by drive id, None where the stop was delivered. From then on
        the axis is supervised until standstill; `standstill` returns the result. The other axis of
        a job that moves two axes on one machine is stopped as well.
        """
        moved = [job.moved for each in drive_ids if (job := self._bench.jobs.moving(each))]
        drive_ids = list(dict.fromkeys([*drive_ids, *(each for two in moved for each in two)]))
        connected_drives = [self._bench.connected(drive_id) for drive_id in drive_ids]
        for connected in connected_drives:
            # Before anything else runs: nothing in progress may enable the axis from here on.
            connected.axis.forbid()
            self._bench.authority.revoke(connected.drive.id, why)
            job = self._bench.jobs.moving(connected.drive.id)
            if job is not None and job.stoppable:
                # Cancelled before the write, so that after it only the job's cleanup is sent.
                job.cancel(why)
        task = asyncio.create_task(self._stop(connected_drives), name="stop")
        self._stops.add(task)
        task.add_done_callback(self._stops.discard)
        self._bench.recorder.stopped(drive_ids)
        return await asyncio.shield(task)

    async def _stop(self, connected_drives: Sequence[ConnectedDrive]) -> dict[str, Text | None]:
        async def one(connected: ConnectedDrive) -> Text | None:
            problem: Text | None = None
            try:
                await connected.axis.stop()
            except DriveError as error:
                problem = error.text
            except Exception as error:
                # A defect at one axis must not hide the results of the others.
                log.exception("the stop of %s failed", connected.drive.name)
                problem = internal_error(error)
            self._begin_watch(connected, problem)
            connected.monitor.hurry()
            return problem

        problems = await asyncio.gather(*(one(connected) for connected in connected_drives))
        return {m.drive.id: problem for m, problem in zip(connected_drives, problems, strict=True)}

    def _begin_watch(self, connected: ConnectedDrive, problem: Text | None) -> None:
        """Begin the supervision of a stopped axis, unless an earlier one still runs.

        Only one runs per axis: a second STOP has sent its control word again anyway.
        """
        drive_id = connected.drive.id
        if self.stopping(drive_id):
            return

        async def end_process_data() -> bool:
            session = connected.axis.session
            if session is None or not session.running:
                return False
            await self._bench.exchanges.stop(session.link.url)
            return True

        async def work() -> AxisStop:
            try:
                found = await StopWatch(connected.axis, end_process_data).run(problem)
            except Exception as error:
                # A supervision that failed must not be taken for an axis at standstill.
                log.exception("the stop of %s cannot be watched", connected.drive.name)
                why = internal_error(error)
                found = AxisStop(drive_id, Verdict.STILL_MOVING, 0.0, problem=why)
            self._note(connected, found)
            return found

        self._watches[drive_id] = asyncio.create_task(work(), name=f"stop-watch-{drive_id}")

    def _note(self, connected: ConnectedDrive, found: AxisStop) -> None:
        connected.monitor.hurry()
        line = stop_message(connected.drive.name, found)
        if line is not None and not found.superseded:
            self._bench.journal.add(line, level="error", drive=connected.drive.id)

    async def standstill(self, drive_ids: Sequence[str]) -> list[AxisStop]:
        """Results of the last STOP of these drives; waits for outstanding verdicts.

        Drives that were never stopped are left out. A drive that is removed from the axis list
        meanwhile is reported as unreachable, as its standstill was not observed. May take some
        seconds.
        """
        watches = {each: self._watches[each] for each in drive_ids if each in self._watches}
        if watches:
            # Not gathered: a cancelled supervision must not raise here and hide the others'
            # results.
            await asyncio.wait(watches.values())
        return [
            _unseen(drive_id) if watch.cancelled() else watch.result()
            for drive_id, watch in watches.items()
        ]

    def stopping(self, drive_id: str) -> bool:
        """Whether a STOP of this axis is still being supervised."""
        watch = self._watches.get(drive_id)
        return watch is not None and not watch.done()

    async def end_watches(self, drive_id: str | None = None) -> None:
        """End the supervision of one drive that is removed, or of all where the bench is closed."""
        ids = list(self._watches) if drive_id is None else [drive_id]
        watches = [found for each in ids if (found := self._watches.pop(each, None)) is not None]
        for watch in watches:
            watch.cancel()
        await asyncio.gather(*watches, return_exceptions=True)

    async def let_go(self, drive_id: str) -> None:
        """Switch off the power of an axis that was left enabled; raises no DriveError."""
        connected = self._bench.connected_drives.get(drive_id)
        if connected is not None:
            job = self._bench.jobs.moving(drive_id)
            if job is not None:
                # The job of a closed page is being ended; it stops the axis first.
                await job.wait()
            await self.let_go_of(connected)
            connected.monitor.hurry()

    async def let_go_of(self, connected: ConnectedDrive) -> None:
        """Switch off the power of an axis now; on failure its stop is pending; no error."""
        try:
            await connected.axis.let_go()
        except Exception as error:
            # The stop is sent as soon as the drive answers, also after it was added again.
            connected.axis.stop_pending = True
            cause = error.text if isinstance(error, DriveError) else internal_error(error)
            line = text("station.may-still-be-enabled", drive=connected.drive.name, cause=cause)
            self._bench.journal.add(line, level="error", drive=connected.drive.id)

    async def let_go_of_all(self) -> None:
        """Switch off the power of every axis of the bench at once; raises no DriveError."""
        await asyncio.gather(
            *(self.let_go_of(connected) for connected in self._bench.connected_drives.values())
        )


def _unseen(drive_id: str) -> AxisStop:
    """Result for an axis whose supervision was ended before it had a verdict."""
    why = text("stopping.ended-unwatched")
    return AxisStop(drive_id, Verdict.UNREACHABLE, 0.0, problem=why)
