"""Routes of the log-in: who asks, first set-up, password, sessions."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from backend.api.context import Me, ThePeople
from backend.api.people.models import LogIn, PasswordChange, Session, SessionInfo, SetUp
from backend.api.people.record import TheRecord
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
from backend.people.errors import NoSuchPerson, NotLoggedIn

router = APIRouter()


@router.get("/session")
async def session(request: Request, people: ThePeople) -> Session:
    """Who is asking. On a station without accounts the one user is administrator."""
    brought = credentials(request.scope)
    identity = people.identify(brought.cookie, brought.bearer)
    return session_of(people, identity, brought.cookie)


@router.post("/session")
async def log_in(
    request: Request, response: Response, people: ThePeople, record: TheRecord, body: LogIn
) -> Session:
    """Log in. Wrong tries are answered later and later."""
    people.require_accounts()
    try:
        secret, begun = await people.accounts.log_in(
            body.name, body.password, address_of(request), client_of(request), device_of(request)
        )
    except NotLoggedIn:
        record.note(
            "login",
            "refused",
            f"log-in failed for {body.name!r} from {address_of(request)}",
            target=body.name,
            person="",
            outcome="wrong name or password",
            level="warning",
        )
        raise
    made = with_cookie(request, response, people, secret)
    remember_device(request, response, people, begun.account)
    record.note(
        "login",
        "logged in",
        f"{made.person} logged in from {address_of(request)}",
        target=address_of(request),
        person=made.person or "",
    )
    return made


@router.delete("/session", status_code=204)
async def log_out(people: ThePeople, record: TheRecord, me: Me) -> Response:
    """Log out."""
    if me.kind == "session":
        await people.accounts.log_out(me.session)
        record.note("login", "logged out", f"{me.person} logged out", person=me.person)
    elif me.is_guest and (found := people.support.of_session(me.session)) is not None:
        people.support.revoke(found.id, "the guest left")
        record.note("invitation", "left", f"{me.person} left", person=me.person)
    response = Response(status_code=204)
    response.delete_cookie(COOKIE, path="/", httponly=True, samesite="strict")
    response.delete_cookie(SECURE_COOKIE, path="/", secure=True, httponly=True, samesite="strict")
    return response


@router.post("/setup", status_code=201)
async def set_up(
    request: Request, response: Response, people: ThePeople, record: TheRecord, body: SetUp
) -> Session:
    """Make the first administrator, with the code that stands in the terminal."""
    people.require_accounts()
    secret, begun = await people.accounts.set_up(
        body.code, body.name, body.password, address_of(request), client_of(request)
    )
    made = with_cookie(request, response, people, secret)
    remember_device(request, response, people, begun.account)
    record.note(
        "account",
        "made",
        f"{made.person} is the first administrator",
        target=made.person or "",
        person=made.person,
        level="warning",
    )
    return made


@router.put("/session/password", status_code=204)
async def change_password(
    request: Request, people: ThePeople, record: TheRecord, me: Me, body: PasswordChange
) -> Response:
    """Change the own password; other sessions of the account end."""
    account = own_account(people.accounts, me)
    await people.accounts.require_password(account.id, body.present, address_of(request))
    await people.accounts.set_password(account.id, body.password, keep=me.session)
    record.note(
        "account",
        "password changed",
        f"{me.person} changed their password",
        target=me.person,
        person=me.person,
    )
    return Response(status_code=204)


@router.get("/sessions")
async def sessions(people: ThePeople, me: Me) -> list[SessionInfo]:
    """Log-ins that are valid: the own ones; for an administrator all."""
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
    """End a log-in at once: an own one, or as an administrator anybody's."""
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
        f"{me.person} ended a session of {whose}",
        target=whose,
        person=me.person,
    )
    return Response(status_code=204)
