"""Control lease: per axis one holder at a time, bound to a live connection."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from drivers.errors import Busy


@dataclass(frozen=True, slots=True)
class Holder:
    """Who controls an axis. ``connection`` is the live websocket, ``since`` epoch seconds."""

    connection: str
    person: str
    since: float


class Leases:
    """Who may write to and move which axis. STOP never asks here."""

    def __init__(self, changed: Callable[[str], None] = lambda _drive: None) -> None:
        self._holders: dict[str, Holder] = {}
        self._changed = changed

    def holder(self, drive: str) -> Holder | None:
        """The present holder, or None while the axis is free."""
        return self._holders.get(drive)

    def take(self, drive: str, connection: str, person: str) -> Holder:
        """Take a free axis; taking again is fine.

        Raises:
            Busy: somebody else holds it.
        """
        self.require(drive, connection)
        holder = self._holders.get(drive)
        if holder is None:
            holder = Holder(connection, person, time.time())
            self._holders[drive] = holder
            self._changed(drive)
        return holder

    def give(self, drive: str, connection: str) -> None:
        """Give an axis back; does nothing for one that is not held by this connection."""
        holder = self._holders.get(drive)
        if holder is not None and holder.connection == connection:
            del self._holders[drive]
            self._changed(drive)

    def require(self, drive: str, connection: str | None) -> None:
        """A change is allowed on a free axis and on one's own.

        Raises:
            Busy: somebody else holds it.
        """
        holder = self._holders.get(drive)
        if holder is not None and holder.connection != connection:
            raise Busy(
                f"{holder.person} has control of this axis",
                drive=drive,
                remedy="ask for control; STOP works for everyone",
            )

    def drop(self, connection: str) -> list[str]:
        """The connection is gone: its axes are free. Returns their ids."""
        dropped = [d for d, h in self._holders.items() if h.connection == connection]
        for drive in dropped:
            del self._holders[drive]
            self._changed(drive)
        return dropped
