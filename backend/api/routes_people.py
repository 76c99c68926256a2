"""Routes of people: session, set-up, accounts, tokens, invitations."""

from __future__ import annotations

from datetime import timedelta
from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response

from backend.api.context import Me, ThePeople
from backend.api.live import LiveHub
from backend.api.live_people import chat_line
from backend.api.live_people_messages import InvitationView
from backend.api.models_people import (
    AccountChange,
    AccountInfo,
    ChatLog,
    JoinAsGuest,
    LogIn,
    MadeInvitation,
    MadeToken,
    NewAccount,
    NewGrant,
    NewInvitation,
    NewToken,
    PasswordChange,
    PeopleList,
    Session,
    SessionInfo,
    SetUp,
    TokenInfo,
)
from backend.api.people_record import PeopleRecord
from backend.api.security import COOKIE, SECURE_COOKIE, credentials, require_right
from backend.people.accounts import Accounts
from backend.people.credentials import csrf_of
from backend.people.errors import Forbidden, NoSuchPerson, NotLoggedIn
from backend.people.identity import Identity
from backend.people.records import Account, Token
from backend.people.rights import Right
from backend.people.station import People

router = APIRouter()


def _live_of(request: Request) -> LiveHub:
    live = request.app.state.live
    if not isinstance(live, LiveHub):
        raise TypeError("the application was made without a live hub")
    return live


def _record_of(request: Request) -> PeopleRecord:
    return PeopleRecord(_live_of(request).bench)


TheLive = Annotated[LiveHub, Depends(_live_of)]
TheRecord = Annotated[PeopleRecord, Depends(_record_of)]


# --- session --------------------------------------------------------------------------


@router.get("/session")
async def session(request: Request, people: ThePeople) -> Session:
    """Who is asking. On a station without accounts the one user is administrator."""
    brought = credentials(request.scope)
    identity = people.identify(brought.cookie, brought.bearer)
    return _session(people, identity, brought.cookie)


def _session(people: People, identity: Identity | None, cookie: str | None) -> Session:
    by_cookie = identity is not None and identity.kind in ("session", "guest") and cookie
    return Session(
        person=None if identity is None else identity.person,
        role=None if identity is None else identity.role,
        rights=[] if identity is None else sorted(identity.rights),
        login_required=people.accounts_needed,
        setup_required=people.setup_needed,
        guest=identity is not None and identity.is_guest,
        csrf=csrf_of(cookie) if by_cookie and cookie else None,
        expires=None if identity is None else people.expires(identity),
    )


def _with_cookie(request: Request, response: Response, people: People, secret: str) -> Session:
    secure = request.url.scheme == "https" or request.headers.get("origin", "").startswith("https:")
    response.set_cookie(
        SECURE_COOKIE if secure else COOKIE,
        secret,
        httponly=True,
        secure=secure,
        samesite="strict",
        path="/",
    )
    return _session(people, people.identify(secret, None), secret)


def _address(request: Request) -> str:
    return request.client.host if request.client else ""


def _client(request: Request) -> str:
    return request.headers.get("user-agent", "")


@router.post("/session")
async def log_in(
    request: Request, response: Response, people: ThePeople, record: TheRecord, body: LogIn
) -> Session:
    """Log in. Wrong tries are answered later and later."""
    people.require_accounts()
    try:
        secret, _ = await people.accounts.log_in(
            body.name, body.password, _address(request), _client(request)
        )
    except NotLoggedIn:
        record.note(
            "login",
            "refused",
            f"log-in failed for {body.name!r} from {_address(request)}",
            target=body.name,
            person="",
            outcome="wrong name or password",
            level="warning",
        )
        raise
    made = _with_cookie(request, response, people, secret)
    record.note(
        "login",
        "logged in",
        f"{made.person} logged in from {_address(request)}",
        target=_address(request),
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
    secret, _ = await people.accounts.set_up(
        body.code, body.name, body.password, _address(request), _client(request)
    )
    made = _with_cookie(request, response, people, secret)
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
    account = _own_account(people.accounts, me)
    await people.accounts.require_password(account.id, body.present, _address(request))
    await people.accounts.set_password(account.id, body.password, keep=me.session)
    record.note(
        "account",
        "password changed",
        f"{me.person} changed their password",
        target=me.person,
        person=me.person,
    )
    return Response(status_code=204)


def _own_account(accounts: Accounts, me: Identity) -> Account:
    """The account behind a log-in; a token or a guest has none that it may change.

    Raises:
        Forbidden: there is none.
    """
    if me.kind != "session":
        raise Forbidden("this needs a log-in with a password", remedy="log in")
    return accounts.owner(me.session)


@router.get("/sessions")
async def sessions(people: ThePeople, me: Me) -> list[SessionInfo]:
    """Log-ins that are valid: the own ones; for an administrator all."""
    accounts = people.accounts
    return [
        SessionInfo(
            id=each.id,
            person=accounts.account(each.account).name,
            client=each.client,
            created=each.created,
            used=each.used,
            expires=each.expires,
            me=each.id == me.session,
        )
        for each in accounts.sessions(_whose(accounts, me))
    ]


def _whose(accounts: Accounts, me: Identity) -> int | None:
    """None for everybody's, which administrators see.

    Raises:
        Forbidden: a guest or the one user of a station without accounts has none.
    """
    if Right.ADMINISTER in me.rights:
        return None
    return _own_account(accounts, me).id


@router.delete("/sessions/{session_id}", status_code=204)
async def end_session(people: ThePeople, record: TheRecord, me: Me, session_id: str) -> Response:
    """End a log-in at once: an own one, or as an administrator anybody's."""
    accounts = people.accounts
    found = next((s for s in accounts.sessions(_whose(accounts, me)) if s.id == session_id), None)
    if found is None:
        raise NoSuchPerson("there is no such session", value=session_id)
    whose = accounts.account(found.account).name
    await accounts.log_out(session_id)
    record.note(
        "login",
        "session ended",
        f"{me.person} ended a session of {whose}",
        target=whose,
        person=me.person,
    )
    return Response(status_code=204)


# --- tokens ---------------------------------------------------------------------------


@router.get("/tokens")
async def tokens(people: ThePeople, me: Me) -> list[TokenInfo]:
    """Tokens for scripts: the own ones; for an administrator all."""
    accounts = people.accounts
    return [_token(accounts, each) for each in accounts.tokens(_whose(accounts, me))]


def _token(accounts: Accounts, token: Token) -> TokenInfo:
    return TokenInfo(
        id=token.id,
        person=accounts.account(token.account).name,
        name=token.name,
        scopes=sorted(token.scopes),
        created=token.created,
        expires=token.expires,
    )


@router.post("/tokens", status_code=201)
async def make_token(people: ThePeople, record: TheRecord, me: Me, body: NewToken) -> MadeToken:
    """Make a token for a script. It can do no more than its owner."""
    account = _own_account(people.accounts, me)
    secret, token = await people.accounts.make_token(
        account.id, body.name, frozenset(body.scopes), timedelta(days=body.days)
    )
    record.note(
        "account",
        "token made",
        f"{me.person} made the token {token.name} ({', '.join(sorted(token.scopes))})",
        target=token.name,
        new=", ".join(sorted(token.scopes)),
        person=me.person,
    )
    return MadeToken(token=_token(people.accounts, token), secret=secret)


@router.delete("/tokens/{token_id}", status_code=204)
async def revoke_token(people: ThePeople, record: TheRecord, me: Me, token_id: str) -> Response:
    """Revoke a token at once."""
    accounts = people.accounts
    found = next((t for t in accounts.tokens(_whose(accounts, me)) if t.id == token_id), None)
    if found is None:
        raise NoSuchPerson("there is no such token", value=token_id)
    await accounts.revoke_token(found)
    record.note(
        "account",
        "token revoked",
        f"{me.person} revoked the token {found.name}",
        target=found.name,
        person=me.person,
    )
    return Response(status_code=204)


# --- accounts -------------------------------------------------------------------------


@router.get("/accounts")
async def accounts(people: ThePeople, me: Me) -> list[AccountInfo]:
    """Who may log in."""
    return [_account(people.accounts, each, me) for each in people.accounts.all()]


def _account(accounts: Accounts, account: Account, me: Identity) -> AccountInfo:
    sessions = accounts.sessions(account.id)
    return AccountInfo(
        id=account.id,
        name=account.name,
        role=account.role,
        created=account.created,
        sessions=len(sessions),
        tokens=len(accounts.tokens(account.id)),
        me=any(each.id == me.session for each in sessions),
    )


@router.post("/accounts", status_code=201)
async def add_account(
    people: ThePeople, record: TheRecord, me: Me, body: NewAccount
) -> AccountInfo:
    """Make an account."""
    people.require_accounts()
    made = await people.accounts.add(body.name, body.password, body.role)
    record.note(
        "account",
        "made",
        f"{me.person} made the account {made.name} ({made.role})",
        target=made.name,
        new=made.role,
        person=me.person,
    )
    return _account(people.accounts, made, me)


@router.patch("/accounts/{account_id}")
async def change_account(
    people: ThePeople, record: TheRecord, me: Me, account_id: int, body: AccountChange
) -> AccountInfo:
    """Change role or password; with the password all sessions of the account end."""
    known = people.accounts.account(account_id)
    before = known.role
    if body.role is not None:
        known = await people.accounts.set_role(account_id, body.role)
        record.note(
            "account",
            "role changed",
            f"{me.person} made {known.name} {known.role}",
            target=known.name,
            old=before,
            new=known.role,
            person=me.person,
        )
    if body.password is not None:
        await people.accounts.set_password(account_id, body.password)
        record.note(
            "account",
            "password set",
            f"{me.person} set a password for {known.name}",
            target=known.name,
            person=me.person,
        )
    return _account(people.accounts, people.accounts.account(account_id), me)


@router.delete("/accounts/{account_id}", status_code=204)
async def remove_account(people: ThePeople, record: TheRecord, me: Me, account_id: int) -> Response:
    """Delete an account; its sessions and tokens end at once."""
    name = people.accounts.account(account_id).name
    await people.accounts.remove(account_id)
    record.note(
        "account",
        "deleted",
        f"{me.person} deleted the account {name}",
        target=name,
        person=me.person,
    )
    return Response(status_code=204)


# --- who is here ----------------------------------------------------------------------


@router.get("/people")
async def people_here(live: TheLive, me: Me) -> PeopleList:
    """Who is connected."""
    return PeopleList(people=live.people.here(me.session))


@router.get("/chat")
async def chat(people: ThePeople) -> ChatLog:
    """The last lines of the chat."""
    return ChatLog(lines=[chat_line(said) for said in people.support.chat()])


# --- remote support -------------------------------------------------------------------


@router.post("/guests", status_code=201)
async def join(
    request: Request, response: Response, people: ThePeople, record: TheRecord, body: JoinAsGuest
) -> Session:
    """Come in as a guest, by the link and the code of an invitation."""
    people.require_accounts()
    try:
        secret, invitation = people.support.join(body.link, body.code, _address(request))
    except NotLoggedIn as error:
        record.note(
            "invitation",
            "refused",
            f"a guest was refused from {_address(request)}: {error.message}",
            target=_address(request),
            person="",
            outcome=error.message,
            level="warning",
        )
        raise
    record.note(
        "invitation",
        "joined",
        f"{invitation.guest} joined as a guest from {_address(request)}",
        target=_address(request),
        person=f"{invitation.guest} (guest)",
        level="warning",
    )
    return _with_cookie(request, response, people, secret)


@router.get("/invitations")
async def invitations(live: TheLive, me: Me) -> list[InvitationView]:
    """Invitations since the server was started, newest first."""
    return live.people.invitations(me)


@router.post("/invitations", status_code=201)
async def invite(
    people: ThePeople, live: TheLive, record: TheRecord, me: Me, body: NewInvitation
) -> MadeInvitation:
    """Invite a guest. The link and the code go to them by different ways."""
    people.require_accounts()
    if me.kind == "token":
        raise Forbidden("a script invites nobody", remedy="do it on the page")
    secret, made = people.support.invite(
        me.person, body.guest, frozenset(body.allowed), body.minutes * 60.0
    )
    allowed = ", ".join(sorted(made.allowed)) or "look only"
    record.note(
        "invitation",
        "made",
        f"{me.person} invited {made.guest} for {body.minutes:g} min ({allowed})",
        target=made.guest,
        new=f"{allowed}, {body.minutes:g} min",
        level="warning",
        person=me.person,
    )
    view = live.people.invitation(made, host=True, identity=me)
    return MadeInvitation(invitation=view, link=f"/guest/{secret}")


@router.delete("/invitations/{invitation_id}")
async def revoke_invitation(
    people: ThePeople, live: TheLive, record: TheRecord, me: Me, invitation_id: str
) -> InvitationView:
    """End an invitation; its guest is out at once and what they move stops."""
    ended = people.support.revoke(invitation_id, f"ended by {me.person}")
    record.note(
        "invitation",
        "ended",
        f"{me.person} ended the invitation of {ended.guest}",
        target=ended.guest,
        level="warning",
        person=me.person,
    )
    return live.people.invitation(ended, host=True, identity=me)


@router.put("/invitations/{invitation_id}/grant")
async def grant(
    people: ThePeople,
    live: TheLive,
    record: TheRecord,
    me: Me,
    invitation_id: str,
    body: NewGrant,
) -> InvitationView:
    """Let a guest do more for some minutes. One cannot give what one does not have."""
    for right in body.rights:
        require_right(people, me, right, body.drive)
    if body.drive is not None:
        live.bench.member(body.drive)
    rights = f"{', '.join(sorted(body.rights))} for {body.minutes:g} min"
    granted = people.support.grant(
        invitation_id, me.person, frozenset(body.rights), body.minutes * 60.0, body.drive
    )
    record.note(
        "invitation",
        "granted",
        f"{me.person} granted {granted.guest} {rights}",
        target=granted.guest,
        new=rights,
        level="warning",
        drive=body.drive,
        person=me.person,
    )
    return live.people.invitation(granted, host=True, identity=me)


@router.delete("/invitations/{invitation_id}/grant")
async def withdraw_grant(
    people: ThePeople, live: TheLive, record: TheRecord, me: Me, invitation_id: str
) -> InvitationView:
    """Withdraw a grant at once; what the guest moves stops."""
    ended = people.support.withdraw(invitation_id, f"the grant was withdrawn by {me.person}")
    record.note(
        "invitation",
        "grant withdrawn",
        f"{me.person} withdrew the grant of {ended.guest}",
        target=ended.guest,
        level="warning",
        person=me.person,
    )
    return live.people.invitation(ended, host=True, identity=me)
