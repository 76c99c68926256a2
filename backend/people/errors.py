"""What can be wrong with a person's request, as part of the one error tree."""

from __future__ import annotations

from drivers.errors import NotAllowed
from drivers.texts.message import Param, Text, as_text, text


class NotLoggedIn(NotAllowed):
    """Nobody, or somebody whose session has ended (HTTP 401)."""

    kind = "not-logged-in"


class Forbidden(NotAllowed):
    """Known, but this is not for them; or the request did not come from our own page (403)."""

    kind = "forbidden"


class TooOften(NotAllowed):
    """Wait before the next try (429). ``wait_s`` is how long."""

    kind = "too-often"

    def __init__(self, code: str | Text, /, wait_s: float, **params: Param) -> None:
        super().__init__(as_text(code, params), remedy=text("people.wait", wait_s=wait_s))
        self.wait_s = wait_s


class NoSuchPerson(NotAllowed):
    """There is no such account, session, token or invitation (404)."""

    kind = "not-found"
