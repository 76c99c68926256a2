"""Routes of the log-in: current session, first set-up, password, sessions."""

from __future__ import annotations

import asyncio

from fastapi import APIRouter, Request, Response

from backend.api.messages.errors import NotFound
from backend.api.people.models import LogIn, PasswordChange, Session, SessionInfo, SetUp
from backend.api.people.record import TheRecord
from backend.api.requests.context import Me, TheBench, ThePeople
from backend.api.security.gate import COOKIE, SECURE_COOKIE, credentials
from backend.api.security.own_session import (
    address_of,
    client_of,
    device_of,
    own_account,
    remember_device,
    session_of,
    whose_sessions,
    with_cookie,
)
from backend.foundation.people.errors import NoSuchPerson, NotLoggedIn
from backend.foundation.people.tls import authority_file
from drivers.texts.message import text

router = APIRouter()


@router.get("/session")
async def session(request: Request, people: ThePeople) -> Session:
    """Read the current session. On a station without accounts its person is administrator."""
    brought = credentials(request.scope)
    identity = people.identify(brought.cookie, brought.bearer)
    return session_of(people, identity, brought.cookie)


@router.get(
    "/certificate",
    response_class=Response,
    responses={200: {"content": {"application/x-x509-ca-cert": {}}}},
)
async def certificate(request: Request, bench: TheBench) -> Response:
    """Download the certificate of the station's authority, for a device that is to trust it."""
    file = authority_file(bench.state_folder)
    if request.url.scheme != "https" or not await asyncio.to_thread(file.is_file):
        raise NotFound("api-people.no-authority")
    return Response(
        await asyncio.to_thread(file.read_bytes),
        media_type="application/x-x509-ca-cert",
        headers={"Content-Disposition": 'attachment; filename="servodeck.crt"'},
    )


@router.post("/session")
async def log_in(
    request: Request, response: Response, people: ThePeople, record: TheRecord, body: LogIn
) -> Session:
    """Log in. Each wrong try lengthens the wait."""
    people.require_accounts()
    try:
        secret, begun = await people.accounts.log_in(
            body.name, body.password, address_of(request), client_of(request), device_of(request)
        )
    except NotLoggedIn:
        record.note(
            "login",
            "refused",
            text("journal.log-in-failed", name=repr(body.name), address=address_of(request)),
            target=body.name,
            person="",
            outcome=text("people.wrong-name-or-password"),
            level="warning",
        )
        raise
    made = with_cookie(request, response, people, secret)
    remember_device(request, response, people, begun.account)
    record.note(
        "login",
        "logged in",
        text("journal.logged-in", person=made.person or "", address=address_of(request)),
        target=address_of(request),
        person=made.person or "",
    )
    return made


@router.delete("/session", status_code=204)
async def log_out(people: ThePeople, record: TheRecord, me: Me) -> Response:
    """Log out."""
    if me.kind == "session":
        await people.accounts.log_out(me.session)
        line = text("journal.logged-out", person=me.person)
        record.note("login", "logged out", line, person=me.person)
    elif me.is_guest and (found := people.support.of_session(me.session)) is not None:
        people.support.revoke(found.id, text("people.end-guest-left"))
        line = text("journal.guest-left", person=me.person)
        record.note("invitation", "left", line, person=me.person)
    response = Response(status_code=204)
    response.delete_cookie(COOKIE, path="/", httponly=True, samesite="strict")
    response.delete_cookie(SECURE_COOKIE, path="/", secure=True, httponly=True, samesite="strict")
    return response


@router.post("/setup", status_code=201)
async def set_up(
    request: Request, response: Response, people: ThePeople, record: TheRecord, body: SetUp
) -> Session:
    """Make the first administrator, with the code that is shown in the terminal."""
    people.require_accounts()
    secret, begun = await people.accounts.set_up(
        body.code, body.name, body.password, address_of(request), client_of(request)
    )
    made = with_cookie(request, response, people, secret)
    remember_device(request, response, people, begun.account)
    record.note(
        "account",
        "made",
        text("journal.first-administrator", person=made.person or ""),
        target=made.person or "",
        person=made.person,
        level="warning",
    )
    return made


@router.put("/session/password", status_code=204)
async def change_password(
    request: Request, people: ThePeople, record: TheRecord, me: Me, body: PasswordChange
) -> Response:
    """Change one's own password; other sessions of the account end."""
    account = own_account(people.accounts, me)
    await people.accounts.require_password(account.id, body.present, address_of(request))
    await people.accounts.set_password(account.id, body.password, keep=me.session)
    record.note(
        "account",
        "password changed",
        text("journal.password-changed", person=me.person),
        target=me.person,
        person=me.person,
    )
    return Response(status_code=204)


@router.get("/sessions")
async def sessions(people: ThePeople, me: Me) -> list[SessionInfo]:
    """List valid log-in sessions: one's own; for an administrator all."""
    accounts = people.accounts
    return [
        SessionInfo(
            id=each.id,
            person=accounts.directory.account(each.account).name,
            client=each.client,
            created=each.created,
            used=each.used,
            expires=each.expires,
            me=each.id == me.session,
        )
        for each in accounts.directory.sessions(whose_sessions(accounts, me))
    ]


@router.delete("/sessions/{session_id}", status_code=204)
async def end_session(people: ThePeople, record: TheRecord, me: Me, session_id: str) -> Response:
    """End a log-in session at once: one's own, or as an administrator anybody's."""
    accounts = people.accounts
    found = next(
        (
            s
            for s in accounts.directory.sessions(whose_sessions(accounts, me))
            if s.id == session_id
        ),
        None,
    )
    if found is None:
        raise NoSuchPerson("api-people.no-session", value=session_id)
    whose = accounts.directory.account(found.account).name
    await accounts.log_out(session_id)
    record.note(
        "login",
        "session ended",
        text("journal.session-ended", person=me.person, whose=whose),
        target=whose,
        person=me.person,
    )
    return Response(status_code=204)
