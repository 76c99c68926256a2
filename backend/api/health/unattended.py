"""Unattended health checks: on a schedule, or triggered by a controller.

Each needs the standing permission of a person who may move the axis
(`backend.tools.watching.trend.permission`), and the axis free and at standstill. Otherwise nothing
moves, and the obstacle is recorded.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta

from backend.api.health.kept import records_of
from backend.api.tuning.measure import start_tool
from backend.axes.stopping.speed import SpeedWatch, units_of
from backend.foundation.people.identity import Actor, Identity, acting, arrived_s, by_itself
from backend.foundation.people.rights import MOVING, RIGHTS, Role
from backend.foundation.people.station import People
from backend.foundation.store.files import StorageFailed
from backend.foundation.work.jobs import Job
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.tools.registry import BY_KIND
from backend.tools.thresholds import trend_compare
from backend.tools.watching.health.settings import HealthSettings
from backend.tools.watching.trend.permission import (
    WINDOW,
    Attempt,
    Cause,
    Outcome,
    Permission,
    Permissions,
    due,
    require_term,
    why_of,
)
from backend.tools.watching.trend.records import Baseline, axis_of
from backend.tools.watching.trend.words import message_of
from drivers.cia402 import State
from drivers.errors import Busy, DriveError, LinkLost, NotAllowed
from drivers.texts.message import Text, text

log = logging.getLogger(__name__)

#: Time between the announcement of a scheduled run and its motion [s].
NOTICE_S = 30.0
_LOOK_S = 1.0
#: Time within which standstill must be measured, and time between samples [s].
_STANDS_S, _BETWEEN_S = 1.0, 0.05
#: A refusal is not recorded again within this time while a controller repeats its trigger.
_NOTED_AGAIN = timedelta(minutes=1)
_POWERED = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE)


class Unattended:
    """Scheduler of one server. ``now`` is the clock of the schedule, in UTC."""

    def __init__(
        self,
        bench: Bench,
        people: People,
        *,
        now: Callable[[], datetime] = lambda: datetime.now(UTC),
        notice_s: float = NOTICE_S,
    ) -> None:
        self._bench, self._people = bench, people
        self._now, self._notice_s = now, notice_s
        self.permissions = Permissions(bench.state_folder / "health-permissions.json")
        self._writing = asyncio.Lock()
        self._running: dict[str, Job] = {}
        self._ends: set[asyncio.Task[None]] = set()
        self._task: asyncio.Task[None] | None = None

    async def open(self) -> None:
        """Load the permissions given before a restart of the server, and start the schedule."""
        await asyncio.to_thread(self.permissions.load)
        self._task = asyncio.create_task(self._run(), name="health-schedule", context=by_itself())

    async def close(self) -> None:
        """Stop the schedule; no further run begins."""
        tasks = [task for task in (self._task, *self._ends) if task is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    # --- permission -------------------------------------------------------------------

    async def permit(self, connected: ConnectedDrive, me: Identity, asked: Permission) -> None:
        """Store a permission that a person gives now.

        Raises:
            NotAllowed: it is from a guest, for too long, for nothing, without a
            name or without a baseline.
        """
        if me.is_guest:
            raise NotAllowed("health.permission-guest", drive=connected.drive.name)
        if not asked.person.strip():
            raise NotAllowed("health.permission-needs-name", parameter="person")
        if not asked.days and not asked.trigger:
            raise NotAllowed("health.permission-for-nothing")
        require_term(asked.given, asked.until)
        await self.baseline(connected)
        await self.withdraw(connected.drive.id)
        async with self._writing:
            await asyncio.to_thread(self.permissions.put, asked)

    async def withdraw(self, drive: str) -> Permission | None:
        """End the permission of a drive, and a run that it started."""
        async with self._writing:
            gone = await asyncio.to_thread(self.permissions.take_back, drive)
        if gone is not None:
            self._end(gone)
        return gone

    def _end(self, permission: Permission) -> None:
        job = self._running.get(permission.id)
        if job is not None:
            job.cancel(text("health.permission-withdrawn"))

    async def baseline(self, connected: ConnectedDrive) -> Baseline:
        """The baseline of an axis; a permission covers its settings.

        Raises:
            NotAllowed: there is none, or it differs from what was signed.
        """
        axis = axis_of(connected.drive, self._bench.records.station)
        found = await self._bench.records.store.call(records_of(self._bench).condition, axis)
        if found.baseline is None:
            raise NotAllowed("health.no-baseline", axis=axis.name)
        if not found.baseline.intact:
            raise NotAllowed("health.baseline-changed", axis=axis.name)
        return found.baseline

    # --- schedule ---------------------------------------------------------------------

    async def _run(self) -> None:
        while True:
            for permission in self.permissions.all():
                try:
                    await self._look_after(permission)
                except Exception:
                    # A failing permission must not end the others.
                    log.exception("the schedule of %s", permission.drive)
            await asyncio.sleep(_LOOK_S)

    async def _look_after(self, permission: Permission) -> None:
        now = self._now()
        if permission.id in self._running:
            if self.ended(permission) is not None:
                self._end(permission)
            return
        at = due(permission, now)
        if at is None or at > permission.until or (self._running and now - at <= WINDOW):
            return  # one run after another: they may share a bus
        # Stored before the run begins: a server that this run brings down must not begin it again.
        if not await self._change(permission, lambda known: _handled(known, at)):
            self.permissions.skip(_handled(permission, at))
            return
        if now - at > WINDOW:
            await self._note(permission, Attempt(at=at, cause="schedule", outcome="missed"))
            return
        await self._scheduled(permission)

    async def _scheduled(self, permission: Permission) -> None:
        """Announce the run, wait, and begin it."""
        try:
            connected, _ = await self._require(permission)
            line = text("journal.health-begins", drive=connected.drive.name, wait_s=self._notice_s)
            self._bench.journal.add(line, level="warning", drive=permission.drive)
            await asyncio.sleep(self._notice_s)
            known = self.permissions.of(permission.drive)
            if known is None or known.id != permission.id:
                return  # it was withdrawn in the meantime
            role = self._role(known) or Role.VIEWER
            rights = RIGHTS[role] & MOVING
            who = Identity(f"{known.person} (schedule)", role, "token", known.session, rights)
            acting.set(Actor(who))
            await self.begin(known, "schedule")
        except DriveError as error:
            await self._not_made(permission, "schedule", error)
        finally:
            acting.set(None)

    # --- one run ----------------------------------------------------------------------

    async def triggered(self, connected: ConnectedDrive) -> Job:
        """Begin a run for the person or controller of this request.

        Raises:
            DriveError: it is not permitted, or something prevents it; nothing has moved.
        """
        permission = self.permissions.of(connected.drive.id)
        if permission is None or not permission.trigger:
            raise NotAllowed("health.trigger-not-permitted", drive=connected.drive.name)
        try:
            return await self.begin(permission, "trigger")
        except DriveError as error:
            await self._not_made(permission, "trigger", error)
            raise

    async def begin(self, permission: Permission, cause: Cause) -> Job:
        """Begin the measurements of the baseline.

        Raises:
            DriveError: something prevents it; nothing has moved.
        """
        arrived = arrived_s.set(time.monotonic())  # a STOP pressed from now on ends it
        try:
            connected, baseline = await self._require(permission)
            settings = HealthSettings.model_validate(
                {**baseline.settings, "rounds": trend_compare.CHECKS, "consent": False}
            )
            info = await start_tool(self._bench, connected, BY_KIND["health"], settings)
        finally:
            arrived_s.reset(arrived)
        job = self._bench.jobs.get(info.id)
        assert job is not None, "it was begun just now"
        self._running[permission.id] = job
        at = self._now()
        if self._gone(permission):
            self._end(permission)  # it was withdrawn while the exchange was started
        task = asyncio.create_task(self._watch(permission, job, at, cause), context=by_itself())
        self._ends.add(task)
        task.add_done_callback(self._ends.discard)
        return job

    async def _watch(self, permission: Permission, job: Job, at: datetime, cause: Cause) -> None:
        """Record that the run has begun, and how it ended."""
        try:
            await self._note(permission, Attempt(at=at, cause=cause, outcome="running"))
            await job.wait()
        finally:
            self._running.pop(permission.id, None)
        ends: dict[str, Outcome] = {"done": "done", "cancelled": "cancelled"}
        why = why_of(job.error) if isinstance(job.error, DriveError) else None
        if job.state == "cancelled" and job.cancel_cause is not None:
            why = job.cancel_cause.to_wire()
        outcome = ends.get(job.state, "failed")
        await self._note(permission, Attempt(at=at, cause=cause, outcome=outcome, why=why))
        if outcome == "done":
            await self._log_changes(permission)

    async def _log_changes(self, permission: Permission) -> None:
        """Log the changes that were found, as nobody waits for the result."""
        connected = self._bench.connected_drives.get(permission.drive)
        if connected is None:
            return
        axis = axis_of(connected.drive, self._bench.records.station)
        try:
            found = await self._bench.records.store.call(records_of(self._bench).condition, axis)
        except DriveError as error:
            self._bench.journal.add(error.text, level="warning", drive=permission.drive)
            return
        for each in found.findings:
            if each.code in ("changed", "not_seen"):
                line = text("journal.health-found", drive=axis.name, finding=message_of(each))
                self._bench.journal.add(line, level="warning", drive=permission.drive)

    # --- what must be true ------------------------------------------------------------

    async def _require(self, permission: Permission) -> tuple[ConnectedDrive, Baseline]:
        """The axis and its baseline, after checking that a run may begin now.

        Raises:
            DriveError: something prevents it.
        """
        now = self._now()
        if (over := self.ended(permission)) is not None:
            raise NotAllowed(over)
        known = self.permissions.of(permission.drive) or permission
        begun = known.begun
        if begun is not None and now - begun < timedelta(seconds=permission.pause_s):
            raise NotAllowed("health.run-too-soon", pause_min=permission.pause_s / 60.0)
        connected = self._bench.connected(permission.drive)
        name = connected.drive.name
        if axis_of(connected.drive, self._bench.records.station).key != permission.axis_key:
            raise NotAllowed("health.run-other-drive", drive=name)
        baseline = await self.baseline(connected)
        if baseline.id != permission.baseline:
            raise NotAllowed("health.run-other-baseline", drive=name)
        self._require_free(connected)
        await _require_rest(connected)
        self._require_free(connected)
        return connected, baseline

    def _require_free(self, connected: ConnectedDrive) -> None:
        drive, axis, bench = connected.drive, connected.axis, self._bench
        actor = acting.get()
        holder = bench.leases.holder(drive.id)
        if holder is not None and (actor is None or holder.connection != actor.connection):
            raise Busy("people.control-axis", drive=drive.name, person=holder.person)
        bench.motion.require_idle(connected)
        if (grant := bench.authority.grant_of(drive.id)) is not None:
            raise Busy("motion.moved-already", drive=drive.name, purpose=grant.purpose)
        if axis.stopped or axis.stop_pending or bench.motion.stopping(drive.id):
            # Only a person may cancel a STOP.
            raise NotAllowed("health.run-after-stop", drive=drive.name)
        snapshot = connected.monitor.snapshot
        if not snapshot.fresh:
            raise LinkLost("health.run-not-connected", drive=drive.name)
        if drive.identity_warning is not None:
            raise NotAllowed("health.run-other-drive", drive=drive.name)
        if drive.pending_restores.entries:
            raise NotAllowed("health.run-pending", drive=drive.name)
        if snapshot.state in (State.FAULT, State.FAULT_REACTION) or snapshot.faults:
            raise NotAllowed("health.run-fault", drive=drive.name)

    def ended(self, permission: Permission) -> Text | None:
        """Why the permission is no longer valid; None while it is."""
        if self._gone(permission) or self._now() >= permission.until:
            return text("health.permission-ended")
        role = self._role(permission)
        if role is None or not RIGHTS[role] >= MOVING:
            return text("health.permission-person", person=permission.person)
        return None

    def _gone(self, permission: Permission) -> bool:
        known = self.permissions.of(permission.drive)
        return known is None or known.id != permission.id

    def _role(self, permission: Permission) -> Role | None:
        """Current role of the person who gave the permission; None if the account is gone."""
        if not self._people.accounts_needed:
            return Role.ADMINISTRATOR
        accounts = self._people.accounts.directory.all()
        return next((each.role for each in accounts if each.id == permission.account), None)

    # --- notes ------------------------------------------------------------------------

    async def _not_made(self, permission: Permission, cause: Cause, error: DriveError) -> None:
        made = Attempt(at=self._now(), cause=cause, outcome="not_made", why=why_of(error))
        known = self.permissions.of(permission.drive)
        last = known.attempts[-1] if known is not None and known.attempts else made
        if cause == "trigger" and last is not made and made.at - last.at < _NOTED_AGAIN:
            again = last.model_copy(update={"at": made.at})
            if again == made:
                return
        await self._note(permission, made)
        name = self._bench.name_of(permission.drive)
        line = text("journal.health-not-made", drive=name, cause=error.text)
        self._bench.journal.add(line, level="warning", drive=permission.drive)

    async def _note(self, permission: Permission, attempt: Attempt) -> None:
        await self._change(permission, lambda known: known.noted(attempt))

    async def _change(
        self, permission: Permission, how: Callable[[Permission], Permission]
    ) -> bool:
        """Change a stored permission; False, with a line in the log, if it could not be stored."""
        async with self._writing:
            try:
                await asyncio.to_thread(self.permissions.change, permission, how)
            except StorageFailed as error:
                self._bench.journal.add(error.text, level="error", drive=permission.drive)
                return False
        return True


def _handled(permission: Permission, at: datetime) -> Permission:
    return permission.model_copy(update={"handled": at})


async def _require_rest(connected: ConnectedDrive) -> None:
    """Check that the axis has no power and is at standstill, by position and speed.

    Raises:
        Busy: the axis is enabled or turns.
        DriveError: the drive does not answer.
    """
    axis, name = connected.axis, connected.drive.name
    watch = SpeedWatch(axis, await units_of(axis))
    begun = time.monotonic()
    while True:
        sample = await watch.look()
        if sample.state in _POWERED:
            raise Busy("health.run-enabled", drive=name)
        if watch.stands():
            return
        if time.monotonic() - begun > _STANDS_S:
            raise Busy("health.run-turning", drive=name)
        await asyncio.sleep(_BETWEEN_S)
