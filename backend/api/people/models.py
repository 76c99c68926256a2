"""Messages of the routes about people."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from pydantic import Field

from backend.api.live.people_messages import ChatLine, InvitationView, PersonHere
from backend.api.messages.models import Message
from backend.foundation.people.login.passwords import MAX_LENGTH
from backend.foundation.people.rights import Right, Role

PersonName = Annotated[str, Field(min_length=1, max_length=60)]
#: Checked by `backend.foundation.people.login.passwords`; only its length is limited here.
Password = Annotated[str, Field(min_length=1, max_length=MAX_LENGTH)]
Code = Annotated[str, Field(min_length=1, max_length=40)]


class Session(Message):
    """The person of this session and their rights. ``csrf`` is sent in a header of every change."""

    person: str | None
    role: Role | None
    rights: list[Right]
    login_required: bool
    setup_required: bool
    guest: bool
    csrf: str | None
    expires: datetime | None


class LogIn(Message):
    """Name and password."""

    name: PersonName
    password: Password


class SetUp(Message):
    """The first administrator; ``code`` is the set-up code in the terminal of the machine."""

    code: Code
    name: PersonName
    password: Password


class JoinAsGuest(Message):
    """The secret of an invitation's link, and the code given to the guest."""

    link: Annotated[str, Field(min_length=1, max_length=100)]
    code: Code


class AccountInfo(Message):
    """An account, with its numbers of sessions and tokens."""

    id: int
    name: str
    role: Role
    created: datetime
    sessions: int
    tokens: int
    me: bool


class NewAccount(Message):
    """A new account."""

    name: PersonName
    role: Role
    password: Password


class AccountChange(Message):
    """New role or new password; null leaves the value unchanged."""

    role: Role | None = None
    password: Password | None = None


class PasswordChange(Message):
    """Present and new password of one's own account."""

    present: Password
    password: Password


class SessionInfo(Message):
    """A log-in session that is still valid."""

    id: str
    person: str
    client: str
    created: datetime
    used: datetime
    expires: datetime
    me: bool


class TokenInfo(Message):
    """A token for scripts."""

    id: str
    person: str
    name: str
    scopes: list[Right]
    created: datetime
    expires: datetime


class NewToken(Message):
    """A token to make: name, scopes and lifetime."""

    name: PersonName
    scopes: list[Right] = Field(min_length=1, max_length=len(Right))
    days: float = Field(default=30, gt=0, le=366, allow_inf_nan=False)


class MadeToken(Message):
    """A new token. ``secret`` is shown only here."""

    token: TokenInfo
    secret: str


class NewInvitation(Message):
    """An invitation for one guest: rights that may be granted, and lifetime."""

    guest: PersonName
    allowed: list[Right] = Field(default=[], max_length=len(Right))
    minutes: float = Field(default=60, ge=1, le=1440, allow_inf_nan=False)


class MadeInvitation(Message):
    """A new invitation. ``link`` is the part of the address after the #, shown only here."""

    invitation: InvitationView
    link: str


class NewGrant(Message):
    """Rights for a guest for some minutes, on one axis or (null) on all."""

    rights: list[Right] = Field(min_length=1, max_length=len(Right))
    minutes: float = Field(ge=0.2, le=480, allow_inf_nan=False)
    drive: str | None = Field(default=None, max_length=100)


class PeopleList(Message):
    """People who are connected."""

    people: list[PersonHere]


class ChatLog(Message):
    """The last lines of the chat, oldest first."""

    lines: list[ChatLine]
