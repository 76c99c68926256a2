"""Ends motion whose page is gone or whose person has lost the right to it."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine, Mapping

from backend.api.live.page import Page
from backend.api.people.record import PeopleRecord
from backend.foundation.people.station import People
from backend.foundation.people.support import Invitation
from backend.foundation.work.jobs import Job
from backend.station.bench import Bench
from drivers.cia402 import State
from drivers.texts.message import Text, text


class PeopleMotions:
    """Motions of people, for all live connections of a server."""

    def __init__(self, bench: Bench, people: People, pages: Mapping[str, Page]) -> None:
        self._bench, self._pages = bench, pages
        self._support = people.support
        self._record = PeopleRecord(bench)
        self._tasks: set[asyncio.Task[object]] = set()
        self._ending: set[str] = set()
        bench.on_job.append(self._job)
        self._support.on_disabled.append(self._disabled)

    def end(self, page: Page, what: Text, why: Text) -> None:
        """End the motion jobs of a page because of ``why``; ``what`` has happened to the page."""
        for job in self._bench.jobs.all():
            own = job.actor is not None and job.actor.connection == page.id
            # A jog ends by its own dead-man timeout, with its ramp; and a second cancellation would
            # disturb the cleanup of the first.
            if not own or not _moves(job) or job.kind == "jog" or job.id in self._ending:
                continue
            line = text("api-live.job-ended-with-page", job_title=job.title_text, what=what)
            self._bench.journal.add(line, level="warning", drive=job.drive)
            self._ending.add(job.id)
            self._spawn(self._cancel(job, why))

    def let_go(self, page: Page, what: Text) -> None:
        """Disable the axes that a page enabled and left unattended.

        If somebody else controls or moves the axis, they become responsible for it instead.
        """
        for connected in self._bench.connected_drives.values():
            if connected.axis.enabled_by != page.id:
                continue
            drive = connected.drive.id
            holder, job = self._bench.leases.holder(drive), self._bench.jobs.moving(drive)
            actor = None if job is None else job.actor
            others = {each.connection for each in (holder, actor) if each is not None}
            heir = next((each for each in others if each not in (None, page.id)), None)
            connected.axis.enabled_by = heir
            if heir is None:
                line = text("api-live.loses-power", drive=connected.drive.name, what=what)
                self._bench.journal.add(line, level="warning", drive=drive)
                self._spawn(self._bench.motion.let_go(drive))

    async def _cancel(self, job: Job, why: Text) -> None:
        try:
            await self._bench.jobs.cancel(job, why)
        finally:
            self._ending.discard(job.id)

    def _disabled(self, invitation: Invitation, why: Text) -> None:
        """Stop what a guest moves or enabled, after the grant or the button's hold has ended."""
        session = invitation.session
        self._record.note(
            "invitation",
            "motion ended",
            text("journal.guest-may-not-move", guest=invitation.guest, why=why),
            target=invitation.guest,
            outcome=why,
        )
        guests = [p for p in self._pages.values() if session and p.identity.session == session]
        for page in guests:
            page.release(None, why)
        drives = {
            job.drive
            for job in self._bench.jobs.all()
            if _moves(job) and job.drive and _session_of(job) == session
        }
        # Axes that the guest left enabled or forced, whether or not they had control.
        drives |= self._bench.authority.drives_of(session)
        for page in guests:
            drives |= {d for d in self._bench.leases.held_by(page.id) if self._is_enabled(d)}
            if self._support.running(invitation) is None:
                self._bench.leases.drop(page.id)
        self._stop(drives, invitation.guest, why)

    def _job(self, job: Job) -> None:
        """Stop a guest's motion that began just as the enabling button was released."""
        actor = job.actor
        if actor is None or not actor.identity.is_guest or not _moves(job) or not job.drive:
            return
        invitation = self._support.of_session(actor.identity.session)
        if invitation is None or not self._support.enabled(invitation.id):
            why = text("people.enabling-not-held")
            self._stop({job.drive}, actor.identity.person, why)

    def _stop(self, drives: set[str], guest: str, why: Text) -> None:
        known = [drive for drive in drives if drive in self._bench.connected_drives]
        if known:
            for drive in known:
                line = text("api-live.stopped-why", guest=guest, why=why)
                self._bench.journal.add(line, level="warning", drive=drive)
            self._spawn(
                self._bench.motion.stop(known, text("work.guest-stopped", guest=guest, why=why))
            )

    def _is_enabled(self, drive: str) -> bool:
        connected = self._bench.connected_drives.get(drive)
        snapshot = None if connected is None else connected.monitor.snapshot
        return snapshot is not None and snapshot.state is State.OPERATION_ENABLED

    def _spawn(self, work: Coroutine[object, object, object]) -> None:
        task: asyncio.Task[object] = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)


def _moves(job: Job) -> bool:
    return job.motion and job.stoppable and job.state == "running"


def _session_of(job: Job) -> str:
    return "" if job.actor is None else job.actor.identity.session
