"""Views of the people and invitations, as each page may see them."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime

from backend.api.live.page import Page
from backend.api.live.people_messages import (
    ChatLine,
    GrantView,
    InvitationView,
    PeopleHere,
    PersonHere,
)
from backend.api.messages.errors import message_or_none, words_of
from backend.foundation.people.elapsed import moment_of
from backend.foundation.people.identity import Identity
from backend.foundation.people.rights import Right
from backend.foundation.people.station import People
from backend.foundation.people.support import Invitation, Said
from backend.station.bench import Bench


class PeopleViews:
    """What each page is shown of people and invitations, for all live connections of a server."""

    def __init__(self, bench: Bench, people: People, pages: Mapping[str, Page]) -> None:
        self._bench, self._people, self._pages = bench, people, pages
        self._support = people.support

    def view(self, page: Page) -> PeopleHere:
        """People and invitations as this page may see them."""
        identity = self._people.renewed(page.identity) or page.identity
        return PeopleHere(
            people=self.here(page.identity.session, page.id),
            invitations=self.invitations(identity),
            rights=sorted(identity.rights),
        )

    def here(self, session: str, connection: str | None = None) -> list[PersonHere]:
        """All people with open pages; ``me`` is set by connection, or by session without one."""
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
        """Invitations that this person may see: a guest sees only their own."""
        host = Right.INVITE in identity.rights
        return [
            self.invitation(each, host=host, identity=identity)
            for each in self._support.all()
            if host or (identity.is_guest and each.session == identity.session)
        ]

    def invitation(self, each: Invitation, *, host: bool, identity: Identity) -> InvitationView:
        """One invitation; with the code only for people who may invite."""
        grant = self._support.running(each)
        return InvitationView(
            id=each.id,
            guest=each.guest,
            allowed=sorted(each.allowed),
            by=each.by,
            created=_moment(each.created),
            expires=_moment(moment_of(each.expires)),
            state=each.state,
            why_ended=words_of(each.why_ended),
            why_ended_message=message_or_none(each.why_ended),
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


def chat_line(said: Said) -> ChatLine:
    """A chat line as a message."""
    return ChatLine(
        number=said.number,
        time=_moment(said.time),
        person=said.person,
        guest=said.guest,
        text=said.text,
    )


def _moment(seconds: float) -> datetime:
    return datetime.fromtimestamp(seconds, UTC)
