"""Errors of authentication and authorization, as part of the one error tree."""

from __future__ import annotations

from drivers.errors import NotAllowed
from drivers.texts.message import Param, Text, as_text, text


class NotLoggedIn(NotAllowed):
    """No valid session or token, or a wrong password or code (HTTP 401)."""

    kind = "not-logged-in"


class Forbidden(NotAllowed):
    """The person has no right to do this, or the request is not from our own page (HTTP 403)."""

    kind = "forbidden"


class TooOften(NotAllowed):
    """Too many tries (HTTP 429); ``wait_s`` is the time until the next one [s]."""

    kind = "too-often"

    def __init__(self, code: str | Text, /, wait_s: float, **params: Param) -> None:
        super().__init__(as_text(code, params), remedy=text("people.wait", wait_s=wait_s))
        self.wait_s = wait_s


class NoSuchPerson(NotAllowed):
    """There is no such account, session, token or invitation (HTTP 404)."""

    kind = "not-found"
