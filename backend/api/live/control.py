"""Control of axes: requests, hand-overs and overrides between people with open pages."""

from __future__ import annotations

from collections.abc import Mapping

from backend.api.live.page import Page
from backend.api.live.people_messages import (
    LeaseAnswer,
    LeaseAsk,
    LeaseHand,
    LeaseNotice,
    LeaseOverride,
)
from backend.api.people.record import PeopleRecord
from backend.foundation.people.errors import Forbidden
from backend.foundation.people.identity import Identity
from backend.foundation.people.lease import Notice
from backend.foundation.people.rights import GRANTABLE, Right
from backend.foundation.people.station import People
from backend.records.audit.facts import Action
from backend.station.bench import Bench
from drivers.errors import NotAllowed
from drivers.texts.message import Text, text


class PeopleControl:
    """Control of axes for all live connections of a server."""

    def __init__(self, bench: Bench, people: People, pages: Mapping[str, Page]) -> None:
        self._bench, self._people, self._pages = bench, people, pages
        self._record = PeopleRecord(bench)
        bench.leases.on_notice.append(self._notice)

    async def act(
        self,
        page: Page,
        identity: Identity,
        request: LeaseAsk | LeaseAnswer | LeaseHand | LeaseOverride,
    ) -> None:
        """Carry out a request for control.

        Raises:
            NotAllowed, Forbidden, Busy: it is not possible now.
        """
        leases, drive = self._bench.leases, request.drive
        self._bench.connected(drive)
        match request:
            case LeaseAsk():
                leases.ask(drive, page.id, identity.person)
                line = text("journal.asks-control", person=identity.person)
                self._log(drive, "asks", line, identity)
            case LeaseAnswer() if not self._is_asked(drive, page):
                pass  # the answer is late: control has passed on, or the request is gone
            case LeaseAnswer(give=True):
                page.release(drive, text("jog.end-control-handed-over"))
                leases.give(drive, page.id)
                line = text("journal.gives-control", person=identity.person)
                self._log(drive, "gives", line, identity)
            case LeaseAnswer():
                leases.refuse(drive, page.id)
                line = text("journal.keeps-control", person=identity.person)
                self._log(drive, "keeps", line, identity)
            case LeaseHand():
                to = self._pages.get(request.to)
                if to is None:
                    raise NotAllowed("api-live.person-not-more", drive=drive)
                require_control(self._people, to.identity, drive)
                page.release(drive, text("jog.end-control-handed-over"))
                leases.hand(drive, page.id, to.id, to.identity.person, request.time_s)
                line = text(
                    "journal.hands-control", person=identity.person, other=to.identity.person
                )
                self._log(drive, "hands over", line, identity)
            case LeaseOverride():
                await self._override(page, identity, drive)

    def _is_asked(self, drive: str, page: Page) -> bool:
        """Whether this page holds control and somebody asks it for control."""
        holder = self._bench.leases.holder(drive)
        asked = self._bench.leases.asked(drive)
        return asked is not None and holder is not None and holder.connection == page.id

    async def _override(self, page: Page, identity: Identity, drive: str) -> None:
        holder = self._bench.leases.holder(drive)
        held_by = None if holder is None else self._pages.get(holder.connection)
        from_guest = held_by is not None and held_by.identity.is_guest
        if Right.ADMINISTER not in identity.rights and not from_guest:
            raise Forbidden("api-live.administrator-takes-control-somebody", drive=drive)
        if held_by is not None and held_by.id != page.id:
            why = text("work.control-taken", person=identity.person)
            held_by.release(drive, why)
            if self._bench.jobs.moving(drive) is not None:
                # The person who watched this motion no longer controls it.
                await self._bench.motion.stop([drive], why)
        self._bench.leases.override(drive, page.id, identity.person)
        line = text("journal.overrides-control", person=identity.person)
        self._log(drive, "overrides", line, identity)

    def _log(self, drive: str, action: Action, line: Text, identity: Identity) -> None:
        self._record.note("lease", action, line, drive=drive, person=identity.person)

    def _notice(self, notice: Notice) -> None:
        page = self._pages.get(notice.connection)
        if page is not None:
            page.send(LeaseNotice(drive=notice.drive, kind=notice.kind, person=notice.person))


def require_control(people: People, identity: Identity, drive: str) -> None:
    """Check that this person may control an axis now.

    Raises:
        Forbidden: they may only look, or have a grant for another axis.
    """
    now = people.renewed(identity)
    rights = frozenset() if now is None else now.rights & GRANTABLE
    if now is None or not rights:
        raise Forbidden(
            "api-live.may-look",
            drive=drive,
            remedy=(
                text("api-live.try-ask-person-site-grant")
                if identity.is_guest
                else text("api-live.try-ask-administrator")
            ),
            person=identity.person,
        )
    if now.is_guest:
        found = people.support.of_session(now.session)
        grant = None if found is None else people.support.running(found)
        if grant is not None and grant.drive not in (None, drive):
            raise Forbidden("api-live.grant-another-axis", drive=drive)
