"""Routes of connected people, and of guests for remote support."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response

from backend.api.live.live import LiveHub
from backend.api.live.people_messages import InvitationView
from backend.api.live.people_views import chat_line
from backend.api.people.models import (
    ChatLog,
    JoinAsGuest,
    MadeInvitation,
    NewGrant,
    NewInvitation,
    PeopleList,
    Session,
)
from backend.api.people.record import TheRecord
from backend.api.requests.context import Me, ThePeople
from backend.api.security.gate import require_right
from backend.api.security.own_session import address_of, with_cookie
from backend.foundation.people.errors import Forbidden, NotLoggedIn
from backend.foundation.people.rights import Right, rights_text
from drivers.texts.message import text

router = APIRouter()


async def _live_of(request: Request) -> LiveHub:
    live = request.app.state.live
    if not isinstance(live, LiveHub):
        raise TypeError("the application was made without a live hub")
    return live


TheLive = Annotated[LiveHub, Depends(_live_of)]


# --- who is here ----------------------------------------------------------------------


@router.get("/people")
async def people_here(live: TheLive, me: Me) -> PeopleList:
    """List the people who are connected."""
    return PeopleList(people=live.people.views.here(me.session))


@router.get("/chat")
async def chat(people: ThePeople) -> ChatLog:
    """Read the last lines of the chat."""
    return ChatLog(lines=[chat_line(said) for said in people.support.chat()])


# --- remote support -------------------------------------------------------------------


@router.post("/guests", status_code=201)
async def join(
    request: Request, response: Response, people: ThePeople, record: TheRecord, body: JoinAsGuest
) -> Session:
    """Join as a guest, by the link and the code of an invitation."""
    people.require_accounts()
    try:
        secret, invitation = people.support.join(body.link, body.code, address_of(request))
    except NotLoggedIn as error:
        record.note(
            "invitation",
            "refused",
            text("journal.guest-refused", address=address_of(request), cause=error.text),
            target=address_of(request),
            person="",
            outcome=error.text,
            level="warning",
        )
        raise
    record.note(
        "invitation",
        "joined",
        text("journal.guest-joined", guest=invitation.guest, address=address_of(request)),
        target=address_of(request),
        person=f"{invitation.guest} (guest)",
        level="warning",
    )
    return with_cookie(request, response, people, secret)


@router.get("/invitations")
async def invitations(live: TheLive, me: Me) -> list[InvitationView]:
    """List invitations since the server was started, newest first."""
    return live.people.views.invitations(me)


@router.post("/invitations", status_code=201)
async def invite(
    people: ThePeople, live: TheLive, record: TheRecord, me: Me, body: NewInvitation
) -> MadeInvitation:
    """Invite a guest. Link and code are to be sent by different ways."""
    people.require_accounts()
    if me.kind == "token":
        raise Forbidden("api-people.script-invites-nobody")
    secret, made = people.support.invite(
        me.person, body.guest, frozenset(body.allowed), body.minutes * 60.0
    )
    allowed = ", ".join(sorted(made.allowed))
    record.note(
        "invitation",
        "made",
        text(
            "journal.guest-invited",
            person=me.person,
            guest=made.guest,
            minutes=f"{body.minutes:g}",
            allowed=allowed or text("people.look-only"),
        ),
        target=made.guest,
        new=f"{allowed or Right.LOOK.value}, {body.minutes:g} min",
        level="warning",
        person=me.person,
    )
    view = live.people.views.invitation(made, host=True, identity=me)
    return MadeInvitation(invitation=view, link=f"/guest/{secret}")


@router.delete("/invitations/{invitation_id}")
async def revoke_invitation(
    people: ThePeople, live: TheLive, record: TheRecord, me: Me, invitation_id: str
) -> InvitationView:
    """End an invitation: the guest's session ends at once and what they move stops."""
    ended = people.support.revoke(invitation_id, text("people.end-by-person", person=me.person))
    record.note(
        "invitation",
        "ended",
        text("journal.invitation-ended", person=me.person, guest=ended.guest),
        target=ended.guest,
        level="warning",
        person=me.person,
    )
    return live.people.views.invitation(ended, host=True, identity=me)


@router.put("/invitations/{invitation_id}/grant")
async def grant(
    people: ThePeople,
    live: TheLive,
    record: TheRecord,
    me: Me,
    invitation_id: str,
    body: NewGrant,
) -> InvitationView:
    """Grant a guest rights for some minutes. Nobody can grant a right that they do not have."""
    for right in body.rights:
        require_right(people, me, right, body.drive)
    if body.drive is not None:
        live.bench.connected(body.drive)
    rights, minutes = ", ".join(sorted(body.rights)), f"{body.minutes:g}"
    granted = people.support.grant(
        invitation_id, me.person, frozenset(body.rights), body.minutes * 60.0, body.drive
    )
    record.note(
        "invitation",
        "granted",
        text(
            "journal.granted",
            person=me.person,
            guest=granted.guest,
            rights=text("people.rights-for", rights=rights_text(body.rights), minutes=minutes),
        ),
        target=granted.guest,
        new=f"{rights}, {minutes} min",
        level="warning",
        drive=body.drive,
        person=me.person,
    )
    return live.people.views.invitation(granted, host=True, identity=me)


@router.delete("/invitations/{invitation_id}/grant")
async def withdraw_grant(
    people: ThePeople, live: TheLive, record: TheRecord, me: Me, invitation_id: str
) -> InvitationView:
    """Withdraw a grant at once; what the guest moves stops."""
    ended = people.support.withdraw(
        invitation_id, text("people.end-grant-withdrawn", person=me.person)
    )
    record.note(
        "invitation",
        "grant withdrawn",
        text("journal.grant-withdrawn", person=me.person, guest=ended.guest),
        target=ended.guest,
        level="warning",
        person=me.person,
    )
    return live.people.views.invitation(ended, host=True, identity=me)
