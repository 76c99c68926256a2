"""Interface of a live connection, as used by the code about people."""

from __future__ import annotations

from datetime import datetime
from typing import Protocol

from backend.api.live.messages import ToPage
from backend.api.live.shared import Shared
from backend.foundation.people.identity import Identity
from drivers.texts.message import Text


class Page(Protocol):
    """A live connection, without its transport."""

    id: str
    identity: Identity
    page: str
    since: datetime
    #: Monotonic time of the last message; infinite while a message is being carried out.
    heard: float

    def send(self, message: ToPage | Shared) -> None:
        """Queue a message that must not be lost."""

    def later(self, kind: str, which: str, message: Shared) -> None:
        """Send the newest state of something."""

    def release(self, drive: str | None, reason: Text) -> None:
        """End jogs of this page: of one axis, or of all."""
