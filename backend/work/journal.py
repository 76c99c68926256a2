"""The tool's own log: what happened when, to which drive, by whom. Bounded in memory."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from backend.people.identity import acting_person
from drivers.texts.message import Text

Level = Literal["info", "warning", "error"]


@dataclass(frozen=True, slots=True)
class Entry:
    """One line; ``time`` in epoch seconds, ``message`` is what happened, as code and facts."""

    time: float
    level: Level
    drive: str | None
    person: str
    message: Text

    @property
    def text(self) -> str:
        """What happened, in English."""
        return self.message.words()


class Journal:
    """The last two thousand entries, and whoever wants to hear of new ones."""

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
        """Write an entry with the present time; without ``person`` it is of whoever acts."""
        entry = Entry(time.time(), level, drive, person or acting_person(), line)
        self._entries.append(entry)
        for listener in self._listeners:
            listener(entry)

    def entries(self, drive: str | None = None) -> list[Entry]:
        """Entries, newest first; only those of ``drive`` where given."""
        return [e for e in reversed(self._entries) if drive is None or e.drive == drive]
