"""The station's log: what happened when, to which drive, by whom. Bounded in memory."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from backend.foundation.people.identity import acting_person
from drivers.texts.message import Text

Level = Literal["info", "warning", "error"]


@dataclass(frozen=True, slots=True)
class Entry:
    """One line of the log: ``time`` in epoch seconds, ``message`` the event as code and facts."""

    time: float
    level: Level
    drive: str | None
    person: str
    message: Text

    @property
    def text(self) -> str:
        """The event, in English."""
        return self.message.words()


class Journal:
    """The last two thousand entries, and listeners for new ones."""

    KEEP = 2000

    def __init__(self) -> None:
        self._entries: deque[Entry] = deque(maxlen=self.KEEP)
        self._listeners: list[Callable[[Entry], None]] = []

    def listen(self, listener: Callable[[Entry], None]) -> None:
        """Call ``listener`` with every new entry."""
        self._listeners.append(listener)

    def add(
        self,
        line: Text,
        *,
        level: Level = "info",
        drive: str | None = None,
        person: str = "",
    ) -> None:
        """Add an entry with the current time; ``person`` defaults to the person who acts now."""
        entry = Entry(time.time(), level, drive, person or acting_person(), line)
        self._entries.append(entry)
        for listener in self._listeners:
            listener(entry)

    def entries(self, drive: str | None = None) -> list[Entry]:
        """Entries, newest first; only those of ``drive`` if given."""
        return [e for e in reversed(self._entries) if drive is None or e.drive == drive]
