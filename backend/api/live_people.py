"""People on the live connections: control, guests, the enabling button, pointers, chat."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Coroutine, Mapping
from datetime import UTC, datetime
from functools import partial
from typing import Protocol

from pydantic import BaseModel

from backend.access import Notice
from backend.api.live_people_messages import (
    Chat,
    ChatLine,
    CursorMoved,
    EnablePress,
    EnableRelease,
    EnableRenew,
    GrantView,
    InvitationView,
    LeaseAnswer,
    LeaseAsk,
    LeaseHand,
    LeaseNotice,
    LeaseOverride,
    PeopleHere,
    PeopleRequest,
    PersonHere,
    PlotCursor,
    Pointer,
    PointerMoved,
    Where,
)
from backend.api.live_shared import Shared, only
from backend.api.live_watch import PeopleWatch
from backend.api.people_record import PeopleRecord
from backend.bench import Bench
from backend.elapsed import moment_of
from backend.jobs import Job
from backend.people.errors import Forbidden, TooOften
from backend.people.identity import Identity
from backend.people.rights import GRANTABLE, Right
from backend.people.station import People
from backend.people.support import Invitation, Said
from backend.people.throttle import Bucket
from drivers.cia402 import State
from drivers.errors import NotAllowed

#: Lines of a page's chat at once, and a second: nobody talks the log full.
_TALK = (10.0, 1.0)


class Page(Protocol):
    """What is needed of a live connection."""

    id: str
    identity: Identity
    page: str
    since: datetime
    #: Monotonic time of the last message; infinite while one is being carried out.
    heard: float

    def send(self, message: BaseModel | Shared) -> None:
        """Queue a message that must not be lost."""

    def later(self, kind: str, which: str, message: Shared) -> None:
        """Send the newest state of something."""

    def release(self, drive: str | None, reason: str) -> None:
        """End jogs of this page: of one axis, or all."""


class PeopleLive:
    """What all live connections share about people."""

    def __init__(self, bench: Bench, people: People, pages: Mapping[str, Page]) -> None:
        self._bench, self._people, self._pages = bench, people, pages
        self._support = people.support
        self._record = PeopleRecord(bench)
        self._tasks: set[asyncio.Task[object]] = set()
        self._ending: set[str] = set()
        self._talk: dict[str, Bucket] = {}
        self._watch = PeopleWatch(bench, people, pages, self._fell_silent)
        bench.leases.on_notice.append(self._notice)
        bench.on_drives.append(self.changed)
        bench.on_job.append(self._job)
        self._support.on_change.append(self.changed)
        self._support.on_disabled.append(self._disabled)

    # --- who is here ------------------------------------------------------------------

    def changed(self) -> None:
        """Who is here, or what a guest may do, has changed."""
        for page in list(self._pages.values()):
            page.later("people", "", Shared(partial(self.view, page)))

    def view(self, page: Page) -> PeopleHere:
        """People and invitations as this page may see them."""
        identity = self._people.renewed(page.identity) or page.identity
        return PeopleHere(
            people=self.here(page.identity.session, page.id),
            invitations=self.invitations(identity),
            rights=sorted(identity.rights),
        )

    def here(self, session: str, connection: str | None = None) -> list[PersonHere]:
        """Everybody whose page is open, seen from a connection or else from a session."""
        return [
            PersonHere(
                connection=other.id,
                person=other.identity.person,
                role=other.identity.role,
                page=other.page,
                since=other.since,
                holds=self._bench.leases.held_by(other.id),
                me=other.id == connection
                if connection is not None
                else other.identity.session == session,
            )
            for other in self._pages.values()
        ]

    def invitations(self, identity: Identity) -> list[InvitationView]:
        """Invitations that this person may see: a guest only the own one."""
        host = Right.INVITE in identity.rights
        return [
            self.invitation(each, host=host, identity=identity)
            for each in self._support.all()
            if host or (identity.is_guest and each.session == identity.session)
        ]

    def invitation(self, each: Invitation, *, host: bool, identity: Identity) -> InvitationView:
        """One invitation; the code only for those who invite."""
        grant = self._support.running(each)
        return InvitationView(
            id=each.id,
            guest=each.guest,
            allowed=sorted(each.allowed),
            by=each.by,
            created=_moment(each.created),
            expires=_moment(moment_of(each.expires)),
            state=each.state,
            why_ended=each.why_ended,
            grant=None
            if grant is None
            else GrantView(
                rights=sorted(grant.rights),
                until=_moment(moment_of(grant.until)),
                drive=grant.drive,
                by=grant.by,
            ),
            enabled=self._support.enabled(each.id),
            code=each.code if host and each.state == "open" else None,
            mine=each.session == identity.session and identity.is_guest,
        )

    def left(self, page: Page) -> None:
        """A page is gone: what it moved stops, what it held is free.

        Each of it whatever becomes of the rest: a defect in what is told must not leave a motion.
        """
        with contextlib.ExitStack() as then:
            then.callback(self.changed)
            then.callback(self._bench.leases.drop, page.id)
            then.callback(self._let_go, page, "is gone")
            then.callback(self._end_motions, page, "is gone")
            self._talk.pop(page.id, None)
            self._support.release_all(page.id, "the connection on site closed")

    def _fell_silent(self, page: Page) -> None:
        """A page says nothing any more, though its line may look open for some seconds yet."""
        self._let_go(page, "fell silent")
        if self._bench.leases.held_by(page.id):
            page.release(None, "the page fell silent")
            self._bench.leases.lose(page.id)
        self._end_motions(page, "fell silent")

    def _end_motions(self, page: Page, what: str) -> None:
        for job in self._bench.jobs.all():
            own = job.actor is not None and job.actor.connection == page.id
            # A jog ends by its own dead-man, with its ramp; and a second cancelling would disturb
            # the cleanup of the first.
            if not own or not _moves(job) or job.kind == "jog" or job.id in self._ending:
                continue
            self._bench.journal.add(
                f"{job.title}: ended, the page that began it {what}",
                level="warning",
                drive=job.drive,
            )
            self._ending.add(job.id)
            self._spawn(self._end(job))

    def _let_go(self, page: Page, what: str) -> None:
        """Nothing stays enabled that nobody looks after: not what this page enabled and left so.

        Whoever controls or moves the axis by now looks after it from here on.
        """
        for member in self._bench.members.values():
            if member.axis.enabled_by != page.id:
                continue
            drive = member.drive.id
            holder, job = self._bench.leases.holder(drive), self._bench.jobs.moving(drive)
            actor = None if job is None else job.actor
            others = {each.connection for each in (holder, actor) if each is not None}
            heir = next((each for each in others if each not in (None, page.id)), None)
            member.axis.enabled_by = heir
            if heir is None:
                text = f"{member.drive.name} loses its power: the page that enabled it {what}"
                self._bench.journal.add(text, level="warning", drive=drive)
                self._spawn(self._bench.let_go(drive))

    async def _end(self, job: Job) -> None:
        try:
            await self._bench.jobs.cancel(job)
        finally:
            self._ending.discard(job.id)

    # --- requests ---------------------------------------------------------------------

    async def act(self, page: Page, identity: Identity, request: PeopleRequest) -> None:
        """Carry out a request whose right was checked.

        Raises:
            DriveError: it is not possible now.
        """
        match request:
            case LeaseAsk() | LeaseAnswer() | LeaseHand() | LeaseOverride():
                await self._lease(page, identity, request)
            case EnablePress():
                self._press(page, identity, request.invitation)
            case EnableRenew():
                self._support.renew(request.invitation, page.id)
            case EnableRelease():
                why = request.reason or "the enabling button was let go"
                self._support.release(request.invitation, page.id, why)
            case Chat():
                self._say(page, identity, request.text)
            case Where():
                page.page = request.page
                self.changed()
            case Pointer():
                moved = PointerMoved(
                    connection=page.id,
                    person=identity.person,
                    page=page.page,
                    x=request.x,
                    y=request.y,
                )
                self._to_others(page, "pointer", moved)
            case PlotCursor():
                cursor = CursorMoved(
                    connection=page.id, person=identity.person, plot=request.plot,
                    x=request.x, y=request.y,
                )  # fmt: skip
                self._to_others(page, f"cursor {request.plot}", cursor)

    def _to_others(self, page: Page, kind: str, message: BaseModel) -> None:
        """Pointers coalesce: only where it is now is of interest."""
        shared = only(message)
        for other in list(self._pages.values()):
            if other.id != page.id:
                other.later(kind, page.id, shared)

    def _say(self, page: Page, identity: Identity, text: str) -> None:
        if not self._talk.setdefault(page.id, Bucket(*_TALK)).take():
            raise TooOften("too many lines at once", 1.0)
        line = self._support.say(identity, text)
        self._bench.journal.add(f"“{line.text}”", person=identity.person)
        shared = only(chat_line(line))
        for each in list(self._pages.values()):
            each.send(shared)

    # --- control ----------------------------------------------------------------------

    async def _lease(
        self,
        page: Page,
        identity: Identity,
        request: LeaseAsk | LeaseAnswer | LeaseHand | LeaseOverride,
    ) -> None:
        leases, drive = self._bench.leases, request.drive
        self._bench.member(drive)
        match request:
            case LeaseAsk():
                leases.ask(drive, page.id, identity.person)
                self._log(drive, identity, "asks for control")
            case LeaseAnswer(give=True):
                if leases.asked(drive) is not None:
                    page.release(drive, "control was handed over")
                    leases.give(drive, page.id)
                    self._log(drive, identity, "gives control")
            case LeaseAnswer():
                leases.refuse(drive, page.id)
                self._log(drive, identity, "keeps control")
            case LeaseHand():
                to = self._pages.get(request.to)
                if to is None:
                    raise NotAllowed(
                        "this person is not here any more",
                        drive=drive,
                        remedy="take control yourself if it is free",
                    )
                require_control(self._people, to.identity, drive)
                page.release(drive, "control was handed over")
                leases.hand(drive, page.id, to.id, to.identity.person, request.time_s)
                self._log(drive, identity, f"hands control to {to.identity.person}")
            case LeaseOverride():
                await self._override(page, identity, drive)

    async def _override(self, page: Page, identity: Identity, drive: str) -> None:
        holder = self._bench.leases.holder(drive)
        held_by = None if holder is None else self._pages.get(holder.connection)
        from_guest = held_by is not None and held_by.identity.is_guest
        if Right.ADMINISTER not in identity.rights and not from_guest:
            raise Forbidden(
                "only an administrator takes control from somebody",
                drive=drive,
                remedy="ask for control",
            )
        if held_by is not None and held_by.id != page.id:
            held_by.release(drive, "control was taken")
            if self._bench.jobs.moving(drive) is not None:
                # Who watched this motion does not control it any more.
                await self._bench.stop([drive])
        self._bench.leases.override(drive, page.id, identity.person)
        self._log(drive, identity, "takes control by override")

    def _log(self, drive: str, identity: Identity, what: str) -> None:
        text = f"{identity.person} {what}"
        self._record.note("lease", what, text, drive=drive, person=identity.person)

    def _notice(self, notice: Notice) -> None:
        page = self._pages.get(notice.connection)
        if page is not None:
            page.send(LeaseNotice(drive=notice.drive, kind=notice.kind, person=notice.person))

    # --- the enabling button ----------------------------------------------------------

    def _press(self, page: Page, identity: Identity, invitation: str) -> None:
        if identity.is_guest or identity.kind == "token":
            raise Forbidden("the enabling button is for a person on site")
        self._support.press(invitation, page.id)
        self._watch.hold_pressed.set()
        guest = self._support.find(invitation).guest
        self._record.note(
            "invitation",
            "motion enabled",
            f"enabling button held for {guest}",
            target=guest,
            person=identity.person,
        )

    def _disabled(self, invitation: Invitation, why: str) -> None:
        """A guest may not move anything from now on: what moves stops."""
        session = invitation.session
        self._record.note(
            "invitation",
            "motion ended",
            f"{invitation.guest} may not move anything now: {why}",
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
        for page in guests:
            drives |= {d for d in self._bench.leases.held_by(page.id) if self._is_enabled(d)}
            if self._support.running(invitation) is None:
                self._bench.leases.drop(page.id)
        self._stop(drives, f"{invitation.guest}: {why}")

    def _job(self, job: Job) -> None:
        """A guest's motion that began just as the button was let go."""
        actor = job.actor
        if actor is None or not actor.identity.is_guest or not _moves(job) or not job.drive:
            return
        invitation = self._support.of_session(actor.identity.session)
        if invitation is None or not self._support.enabled(invitation.id):
            self._stop({job.drive}, "the enabling button is not held")

    def _stop(self, drives: set[str], why: str) -> None:
        known = [drive for drive in drives if drive in self._bench.members]
        if known:
            for drive in known:
                self._bench.journal.add(f"stopped: {why}", level="warning", drive=drive)
            self._spawn(self._bench.stop(known))

    def _is_enabled(self, drive: str) -> bool:
        member = self._bench.members.get(drive)
        snapshot = None if member is None else member.monitor.snapshot
        return snapshot is not None and snapshot.state is State.OPERATION_ENABLED

    async def run(self) -> None:
        """Let end what ends by itself, for as long as the server lives."""
        await self._watch.run()

    def _spawn(self, work: Coroutine[object, object, object]) -> None:
        task: asyncio.Task[object] = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)


def require_control(people: People, identity: Identity, drive: str) -> None:
    """This person may hold the control of an axis now.

    Raises:
        Forbidden: they may only look, or have a grant for another axis.
    """
    now = people.renewed(identity)
    rights = frozenset() if now is None else now.rights & GRANTABLE
    if now is None or not rights:
        raise Forbidden(
            f"{identity.person} may only look",
            drive=drive,
            remedy="ask the person on site to grant control"
            if identity.is_guest
            else "ask an administrator",
        )
    if now.is_guest:
        found = people.support.of_session(now.session)
        grant = None if found is None else people.support.running(found)
        if grant is not None and grant.drive not in (None, drive):
            raise Forbidden("the grant is for another axis", drive=drive)


def chat_line(said: Said) -> ChatLine:
    """A line as it is sent."""
    return ChatLine(
        number=said.number,
        time=_moment(said.time),
        person=said.person,
        guest=said.guest,
        text=said.text,
    )


def _moves(job: Job) -> bool:
    return job.motion and job.stoppable and job.state == "running"


def _session_of(job: Job) -> str:
    return "" if job.actor is None else job.actor.identity.session


def _moment(seconds: float) -> datetime:
    return datetime.fromtimestamp(seconds, UTC)
