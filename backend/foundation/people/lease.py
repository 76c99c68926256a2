"""Control lease: per axis one holder at a time, bound to a live connection."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

from backend.foundation.people.elapsed import elapsed_s
from drivers.errors import Busy, NotAllowed

#: A request that the holder does not answer passes control on after this
#: time [s], if nothing moves.
ANSWER_WITHIN_S = 30.0
LONGEST_HAND_OVER_S = 8 * 3600.0


@dataclass(frozen=True, slots=True)
class Holder:
    """Holder of control over an axis. ``connection``: live websocket, ``since``: epoch seconds.

    ``until`` (`elapsed_s`) is the end of a temporary hand-over; the axis then returns to ``giver``.
    """

    connection: str
    person: str
    since: float
    until: float | None = None
    giver: Holder | None = None


@dataclass(frozen=True, slots=True)
class Asked:
    """Request for control. ``until`` (`elapsed_s`) is when a missing answer counts as consent."""

    connection: str
    person: str
    until: float


NoticeKind = Literal["asked", "refused", "given", "overridden", "returned", "expired", "lost"]


@dataclass(frozen=True, slots=True)
class Notice:
    """Notice to the person at ``connection``; ``person`` is the other person involved."""

    connection: str
    drive: str
    kind: NoticeKind
    person: str


class Leases:
    """Control of axes: who may write to and move which one. STOP is never checked here."""

    def __init__(
        self,
        changed: Callable[[str], None] = lambda _drive: None,
        ticks: Callable[[], float] = elapsed_s,
    ) -> None:
        self._holders: dict[str, Holder] = {}
        self._asked: dict[str, Asked] = {}
        self._changed = changed
        self._ticks = ticks
        #: Called with each notice that somebody must receive.
        self.on_notice: list[Callable[[Notice], None]] = []

    def holder(self, drive: str) -> Holder | None:
        """The present holder, or None while the axis is free."""
        return self._holders.get(drive)

    def taken_by(self, drive: str, connection: str | None) -> str | None:
        """Person who controls the drive through another connection; None if nobody does."""
        holder = self.holder(drive)
        return None if holder is None or holder.connection == connection else holder.person

    def asked(self, drive: str) -> Asked | None:
        """The pending request for control of an axis, or None."""
        return self._asked.get(drive)

    def held_by(self, connection: str) -> list[str]:
        """Axes that this connection holds."""
        return [d for d, h in self._holders.items() if h.connection == connection]

    def take(self, drive: str, connection: str, person: str) -> Holder:
        """Take control of a free axis; has no effect where the connection holds it already.

        Raises:
            Busy: somebody else holds it.
        """
        self.require(drive, connection)
        holder = self._holders.get(drive)
        if holder is None:
            holder = self._set(drive, Holder(connection, person, time.time()))
        return holder

    def give(self, drive: str, connection: str) -> None:
        """Give up control of an axis; does nothing for one that this connection does not hold.

        Control passes to whoever has requested it, or else to the giver of a temporary hand-over.
        """
        holder = self._holders.get(drive)
        if holder is None or holder.connection != connection:
            return
        asked = self._asked.get(drive)
        if asked is not None:
            self._set(drive, Holder(asked.connection, asked.person, time.time()))
            self._notify(asked.connection, drive, "given", holder.person)
        elif holder.giver is not None:
            self._return(drive, holder)
        else:
            self._free(drive)

    def require(self, drive: str, connection: str | None) -> None:
        """Check that this connection may change the axis: it is free, or the connection holds it.

        Raises:
            Busy: somebody else holds it.
        """
        holder = self._holders.get(drive)
        if holder is not None and holder.connection != connection:
            raise Busy("people.control-axis", drive=drive, person=holder.person)

    # --- asking and handing over ------------------------------------------------------

    def ask(self, drive: str, connection: str, person: str) -> None:
        """Ask the holder for control; a free axis is taken at once.

        Raises:
            Busy: somebody else is asking already.
        """
        holder = self._holders.get(drive)
        if holder is None:
            self.take(drive, connection, person)
            return
        if holder.connection == connection:
            return
        other = self._asked.get(drive)
        if other is not None and other.connection != connection:
            raise Busy("people.already-asking-control", drive=drive, person=other.person)
        if other is None:
            until = self._ticks() + ANSWER_WITHIN_S
            self._asked[drive] = Asked(connection, person, until)
            self._notify(holder.connection, drive, "asked", person)
            self._changed(drive)

    def refuse(self, drive: str, connection: str) -> None:
        """Refuse a request for control; the holder keeps it."""
        holder, asked = self._holders.get(drive), self._asked.get(drive)
        if holder is not None and asked is not None and holder.connection == connection:
            del self._asked[drive]
            self._notify(asked.connection, drive, "refused", holder.person)
            self._changed(drive)

    def hand(
        self, drive: str, connection: str, to: str, person: str, time_s: float | None = None
    ) -> None:
        """Hand control to another connection, temporarily for ``time_s`` or permanently.

        Raises:
            NotAllowed: the connection does not hold control, or the time is out of range.
        """
        holder = self._holders.get(drive)
        if holder is None or holder.connection != connection:
            raise NotAllowed("people.control-hand-over", drive=drive)
        if time_s is not None and not 1.0 <= time_s <= LONGEST_HAND_OVER_S:
            raise NotAllowed(
                "people.hand-over-lasts", value=time_s, limit=f"{LONGEST_HAND_OVER_S:.0f} s"
            )
        if to == connection:
            return
        until = None if time_s is None else self._ticks() + time_s
        # Control returns to the first giver: a chain of temporary hand-overs
        # would have no known end.
        giver = None if time_s is None else holder.giver or holder
        self._set(drive, Holder(to, person, time.time(), until, giver))
        self._notify(to, drive, "given", holder.person)

    def override(self, drive: str, connection: str, person: str) -> None:
        """Take control from its holder. The caller has checked the right and stopped the axis."""
        before = self._holders.get(drive)
        if before is not None and before.connection == connection:
            return
        self._set(drive, Holder(connection, person, time.time()))
        if before is not None:
            self._notify(before.connection, drive, "overridden", person)

    # --- what ends by itself ----------------------------------------------------------

    def drop(self, connection: str) -> list[str]:
        """Free or return the axes of a connection that is gone. Returns the axes that it held."""
        dropped = self.held_by(connection)
        for drive, asked in list(self._asked.items()):
            if asked.connection == connection:
                del self._asked[drive]
                self._changed(drive)
        for drive, holder in list(self._holders.items()):
            if holder.giver is not None and holder.giver.connection == connection:
                self._holders[drive] = replace(holder, giver=None)
        for drive in dropped:
            self.give(drive, connection)
        return dropped

    def lose(self, connection: str) -> list[str]:
        """Like `drop`, for a connection that is silent but not closed; its person gets a notice."""
        dropped = self.drop(connection)
        for drive in dropped:
            self._notify(connection, drive, "lost", "")
        return dropped

    def tick(self, moves: Callable[[str], bool]) -> None:
        """End hand-overs and requests whose time is over, on axes that do not move."""
        now = self._ticks()
        for drive, holder in list(self._holders.items()):
            if holder.until is not None and now >= holder.until and not moves(drive):
                self._notify(holder.connection, drive, "expired", "")
                if holder.giver is None:
                    # The giver is gone: whoever is waiting for control gets it.
                    self.give(drive, holder.connection)
                else:
                    self._return(drive, holder)
        for drive, asked in list(self._asked.items()):
            held = self._holders.get(drive)
            if held is not None and now >= asked.until and not moves(drive):
                self._set(drive, Holder(asked.connection, asked.person, time.time()))
                self._notify(held.connection, drive, "overridden", asked.person)
                self._notify(asked.connection, drive, "given", held.person)

    def _return(self, drive: str, holder: Holder) -> None:
        giver = holder.giver
        if giver is None:
            raise ValueError("nobody to return it to")
        self._set(drive, Holder(giver.connection, giver.person, time.time()))
        self._notify(giver.connection, drive, "returned", holder.person)

    def _set(self, drive: str, holder: Holder) -> Holder:
        """Make somebody the holder; whoever else asked receives the refusal."""
        self._holders[drive] = holder
        asked = self._asked.pop(drive, None)
        if asked is not None and asked.connection != holder.connection:
            self._notify(asked.connection, drive, "refused", holder.person)
        self._changed(drive)
        return holder

    def _free(self, drive: str) -> None:
        del self._holders[drive]
        self._asked.pop(drive, None)
        self._changed(drive)

    def _notify(self, connection: str, drive: str, kind: NoticeKind, person: str) -> None:
        for listener in self.on_notice:
            listener(Notice(connection, drive, kind, person))
