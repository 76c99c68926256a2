"""Routes of accounts, and of tokens for scripts."""

from __future__ import annotations

from datetime import timedelta

from fastapi import APIRouter, Response

from backend.api.people.models import (
    AccountChange,
    AccountInfo,
    MadeToken,
    NewAccount,
    NewToken,
    TokenInfo,
)
from backend.api.people.record import TheRecord
from backend.api.requests.context import Me, ThePeople
from backend.api.security.own_session import own_account, whose_sessions
from backend.foundation.people.accounts import Accounts
from backend.foundation.people.errors import NoSuchPerson
from backend.foundation.people.identity import Identity
from backend.foundation.people.records import Account, Token
from backend.foundation.people.rights import rights_text, role_text
from drivers.texts.message import text

router = APIRouter()


# --- tokens ---------------------------------------------------------------------------


@router.get("/tokens")
async def tokens(people: ThePeople, me: Me) -> list[TokenInfo]:
    """List tokens for scripts: one's own; for an administrator all."""
    accounts = people.accounts
    return [
        _token(accounts, each) for each in accounts.directory.tokens(whose_sessions(accounts, me))
    ]


def _token(accounts: Accounts, token: Token) -> TokenInfo:
    return TokenInfo(
        id=token.id,
        person=accounts.directory.account(token.account).name,
        name=token.name,
        scopes=sorted(token.scopes),
        created=token.created,
        expires=token.expires,
    )


@router.post("/tokens", status_code=201)
async def make_token(people: ThePeople, record: TheRecord, me: Me, body: NewToken) -> MadeToken:
    """Make a token for a script. Its rights are limited to those of its owner."""
    account = own_account(people.accounts, me)
    secret, token = await people.accounts.make_token(
        account.id, body.name, frozenset(body.scopes), timedelta(days=body.days)
    )
    record.note(
        "account",
        "token made",
        text(
            "journal.token-made",
            person=me.person,
            name=token.name,
            scopes=rights_text(token.scopes),
        ),
        target=token.name,
        new=", ".join(sorted(token.scopes)),
        person=me.person,
    )
    return MadeToken(token=_token(people.accounts, token), secret=secret)


@router.delete("/tokens/{token_id}", status_code=204)
async def revoke_token(people: ThePeople, record: TheRecord, me: Me, token_id: str) -> Response:
    """Revoke a token at once."""
    accounts = people.accounts
    found = next(
        (t for t in accounts.directory.tokens(whose_sessions(accounts, me)) if t.id == token_id),
        None,
    )
    if found is None:
        raise NoSuchPerson("api-people.no-token", value=token_id)
    await accounts.revoke_token(found)
    record.note(
        "account",
        "token revoked",
        text("journal.token-revoked", person=me.person, name=found.name),
        target=found.name,
        person=me.person,
    )
    return Response(status_code=204)


# --- accounts -------------------------------------------------------------------------


@router.get("/accounts")
async def accounts(people: ThePeople, me: Me) -> list[AccountInfo]:
    """List the accounts."""
    return [_account(people.accounts, each, me) for each in people.accounts.directory.all()]


def _account(accounts: Accounts, account: Account, me: Identity) -> AccountInfo:
    sessions = accounts.directory.sessions(account.id)
    return AccountInfo(
        id=account.id,
        name=account.name,
        role=account.role,
        created=account.created,
        sessions=len(sessions),
        tokens=len(accounts.directory.tokens(account.id)),
        me=any(each.id == me.session for each in sessions),
    )


@router.post("/accounts", status_code=201)
async def add_account(
    people: ThePeople, record: TheRecord, me: Me, body: NewAccount
) -> AccountInfo:
    """Add an account."""
    people.require_accounts()
    made = await people.accounts.add(body.name, body.password, body.role)
    record.note(
        "account",
        "made",
        text("journal.account-made", person=me.person, name=made.name, role=role_text(made.role)),
        target=made.name,
        new=made.role,
        person=me.person,
    )
    return _account(people.accounts, made, me)


@router.patch("/accounts/{account_id}")
async def change_account(
    people: ThePeople, record: TheRecord, me: Me, account_id: int, body: AccountChange
) -> AccountInfo:
    """Change role or password; a new password ends all sessions of the account."""
    known = people.accounts.directory.account(account_id)
    before = known.role
    if body.role is not None:
        known = await people.accounts.set_role(account_id, body.role)
        record.note(
            "account",
            "role changed",
            text(
                "journal.role-changed",
                person=me.person,
                name=known.name,
                role=role_text(known.role),
            ),
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
            text("journal.password-set", person=me.person, name=known.name),
            target=known.name,
            person=me.person,
        )
    return _account(people.accounts, people.accounts.directory.account(account_id), me)


@router.delete("/accounts/{account_id}", status_code=204)
async def remove_account(people: ThePeople, record: TheRecord, me: Me, account_id: int) -> Response:
    """Delete an account; its sessions and tokens end at once."""
    name = people.accounts.directory.account(account_id).name
    await people.accounts.remove(account_id)
    record.note(
        "account",
        "deleted",
        text("journal.account-deleted", person=me.person, name=name),
        target=name,
        person=me.person,
    )
    return Response(status_code=204)
