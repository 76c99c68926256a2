"""People on the live connections: control, guests, the enabling button, pointers, chat."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from functools import partial

from backend.api.live.control import PeopleControl
from backend.api.live.messages import ToPage
from backend.api.live.page import Page
from backend.api.live.people_messages import (
    Chat,
    CursorMoved,
    EnablePress,
    EnableRelease,
    EnableRenew,
    LeaseAnswer,
    LeaseAsk,
    LeaseHand,
    LeaseOverride,
    PeopleRequest,
    PlotCursor,
    Pointer,
    PointerMoved,
    Where,
)
from backend.api.live.people_motion import PeopleMotions
from backend.api.live.people_views import PeopleViews, chat_line
from backend.api.live.shared import Shared, only
from backend.api.live.watch import SILENT_END_S, PeopleWatch
from backend.api.people.record import PeopleRecord
from backend.foundation.people.errors import Forbidden, TooOften
from backend.foundation.people.identity import Identity
from backend.foundation.people.login.throttle import Bucket
from backend.foundation.people.station import People
from backend.station.bench import Bench
from backend.tools.moving.jog.release import END_OF_ENABLING, end_of_enabling
from drivers.texts.message import prose, text

#: Chat lines of a page: burst, and lines per second; limited so that nobody floods the log.
_TALK = (10.0, 1.0)


class PeopleLive:
    """Requests about people, for all live connections."""

    def __init__(self, bench: Bench, people: People, pages: Mapping[str, Page]) -> None:
        self._bench, self._people, self._pages = bench, people, pages
        self._support = people.support
        self._record = PeopleRecord(bench)
        self._talk: dict[str, Bucket] = {}
        self.views = PeopleViews(bench, people, pages)
        self._motions = PeopleMotions(bench, people, pages)
        self._control = PeopleControl(bench, people, pages)
        self._watch = PeopleWatch(bench, people, pages, self._fell_silent)
        bench.on_drives.append(self.changed)
        self._support.on_change.append(self.changed)

    # --- who is here ------------------------------------------------------------------

    def changed(self) -> None:
        """Send all pages the people who are here and what guests may do."""
        for page in list(self._pages.values()):
            page.later("people", "", Shared(partial(self.views.view, page)))

    def left(self, page: Page) -> None:
        """Stop what a page moved and free what it held, after it has gone.

        The steps are independent: an error in a report must not leave a motion running.
        """
        with contextlib.ExitStack() as then:
            then.callback(self.changed)
            then.callback(self._bench.leases.drop, page.id)
            then.callback(self._motions.let_go, page, text("api-live.is-gone"))
            then.callback(self._motions.end, page, text("api-live.is-gone"), text("work.page-gone"))
            self._talk.pop(page.id, None)
            self._support.release_all(page.id, END_OF_ENABLING["connection-lost"])

    def _fell_silent(self, page: Page) -> None:
        """Stop what a silent page moves and free its axes; its line may look open for seconds."""
        self._motions.let_go(page, text("api-live.fell-silent"))
        why = text("work.page-not-reachable", silent_s=SILENT_END_S)
        if self._bench.leases.held_by(page.id):
            page.release(None, why)
            self._bench.leases.lose(page.id)
        self._motions.end(page, text("api-live.fell-silent"), why)

    # --- requests ---------------------------------------------------------------------

    async def act(self, page: Page, identity: Identity, request: PeopleRequest) -> None:
        """Carry out a request whose right was checked.

        Raises:
            DriveError: it is not possible now.
        """
        match request:
            case LeaseAsk() | LeaseAnswer() | LeaseHand() | LeaseOverride():
                await self._control.act(page, identity, request)
            case EnablePress():
                self._press(page, identity, request.invitation)
            case EnableRenew():
                self._support.renew(request.invitation, page.id)
            case EnableRelease():
                why = end_of_enabling(request.reason)
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
                    connection=page.id,
                    person=identity.person,
                    plot=request.plot,
                    x=request.x,
                    y=request.y,
                )
                self._to_others(page, f"cursor {request.plot}", cursor)

    def _to_others(self, page: Page, kind: str, message: ToPage) -> None:
        """Send to all other pages; pointers coalesce, as only the newest position matters."""
        shared = only(message)
        for other in list(self._pages.values()):
            if other.id != page.id:
                other.later(kind, page.id, shared)

    def _say(self, page: Page, identity: Identity, text: str) -> None:
        if not self._talk.setdefault(page.id, Bucket(*_TALK)).take():
            raise TooOften("api-live.too-many-lines-once", 1.0)
        line = self._support.say(identity, text)
        self._bench.journal.add(prose(f"“{line.text}”"), person=identity.person)
        shared = only(chat_line(line))
        for each in list(self._pages.values()):
            each.send(shared)

    # --- the enabling button ----------------------------------------------------------

    def _press(self, page: Page, identity: Identity, invitation: str) -> None:
        if identity.is_guest or identity.kind == "token":
            raise Forbidden("api-live.enabling-button-person-site")
        self._support.press(invitation, page.id)
        self._watch.hold_pressed.set()
        guest = self._support.find(invitation).guest
        self._record.note(
            "invitation",
            "motion enabled",
            text("journal.enabling-held", guest=guest),
            target=guest,
            person=identity.person,
        )

    async def run(self) -> None:
        """Watch for timeouts and silent pages, for as long as the server runs."""
        await self._watch.run()
