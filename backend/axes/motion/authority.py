"""Issues and checks the permission to move an axis: whatever can energise a motor needs a grant.

A grant is held by the asyncio task that requested it and by the tasks that this task starts, such
as cleanups. A route that runs at the same time as a motion of the axis does not hold its grant.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from dataclasses import dataclass

from backend.axes.motion.envelope import Envelope
from backend.axes.motion.grant import Grant, NotGranted
from backend.foundation.people.identity import acting_person, acting_session
from drivers.errors import Busy
from drivers.texts.message import Text, text

#: Default duration of a grant, s. A longer motion needs a new request.
LONGEST_S = 4 * 3600.0
#: Time after which an axis loses its power that was left enabled without a page, s.
UNATTENDED_S = 600.0

#: Called with the reason when a grant ends before the work that holds it: its time has expired, or
#: the person who requested it may no longer move any axis.
Ended = Callable[[Text], None]

_TIME_OVER = text("motion.time-is-over")

_held: ContextVar[tuple[Grant, ...]] = ContextVar("grants", default=())


@dataclass(slots=True, eq=False)
class _Record:
    """A grant that was issued and not yet returned. ``why`` it ended; None while it is live."""

    grant: Grant
    ended: Ended | None
    why: Text | None = None
    timer: asyncio.TimerHandle | None = None


class MotionAuthority:
    """Issues the grants for all axes of one bench, or for one drive outside a server."""

    def __init__(self) -> None:
        self._records: dict[str, list[_Record]] = {}
        self._listeners: list[Callable[[str], None]] = []

    def listen(self, listener: Callable[[str], None]) -> None:
        """Call ``listener`` with a drive's id after each of its grants began or ended."""
        self._listeners.append(listener)

    # --- who may move -------------------------------------------------------------------

    def grant_of(self, drive: str) -> Grant | None:
        """Return the innermost live grant of this axis; None where there is none."""
        live = self._live(drive)
        whole = [grant for grant in live if grant.keys is None]
        return (whole or live)[-1] if live else None

    def mover_of(self, drive: str) -> Grant | None:
        """Return the live grant of the motion in progress; None where there is none.

        An axis that is only left enabled, or whose terminals are only forced, has no such grant.
        """
        live = [g for g in self._live(drive) if not g.standing and g.keys is None]
        return live[-1] if live else None

    def drives_of(self, session: str) -> set[str]:
        """Return the axes of which this session, token or invitation has any live grant."""
        if not session:
            return set()
        return {
            drive
            for drive in self._records
            if any(grant.session == session for grant in self._live(drive))
        }

    def held(self, drive: str, key: str | None = None) -> Grant | None:
        """Return the grant of this axis that the calling work holds, even if it has ended
        meanwhile.

        With ``key``: only a grant that covers this object.
        """
        known = {record.grant for record in self._records.get(drive, ())}
        for grant in reversed(_held.get()):
            if grant in known and (key is None or grant.covers(key)):
                return grant
        return None

    def outermost(self, drive: str) -> Grant | None:
        """Return the first grant of this axis that the calling work holds: the whole motion's."""
        known = {record.grant for record in self._records.get(drive, ())}
        return next((grant for grant in _held.get() if grant in known), None)

    def require_held(self, drive: str, name: str, key: str | None = None) -> Grant:
        """Return the grant as `held` does, or raise.

        Raises:
            NotGranted: the calling work holds none.
        """
        grant = self.held(drive, key)
        if grant is None:
            raise NotGranted("motion.nobody-asked-motion-not", drive=name, parameter=key)
        return grant

    def may_move(self, drive: str) -> bool:
        """Whether the calling work holds a live grant of this axis."""
        grant = self.held(drive)
        return grant is not None and self._ended(grant) is None

    def require(
        self, grant: Grant, drive: str, name: str, key: str, *, restores: bool = False
    ) -> None:
        """Check that this grant permits writing this object of this drive now.

        A grant that has ended still permits restoring changed values (``restores``).

        Raises:
            NotGranted: the grant is for another drive or object, or it has ended.
        """
        record = self._record(grant)
        if grant.drive != drive or record is None or not grant.covers(key):
            raise NotGranted("motion.move-axis-permission-hand", drive=name, parameter=key)
        why = self._ended(grant)
        if why is not None and not restores:
            raise NotGranted(
                "motion.permission-move-ended",
                drive=name,
                parameter=key,
                purpose=grant.purpose,
                why=why,
            )

    # --- issuing and ending -------------------------------------------------------------

    @contextlib.contextmanager
    def granted(
        self,
        drive: str,
        name: str,
        purpose: str | Text,
        *,
        envelope: Envelope | None = None,
        keys: frozenset[str] | None = None,
        lasts_s: float = LONGEST_S,
        ended: Ended | None = None,
    ) -> Iterator[Grant]:
        """Issue a grant for the duration of the block, held by the calling work.

        Inside another grant of the same work, it ends no later than that one. ``ended`` is called
        when the grant ends before the block does; the work must then bring its axis to standstill.

        Raises:
            Busy: other work has a grant for this axis.
            NotGranted: the grant of this axis that the calling work holds has ended, by STOP or
                otherwise.
        """
        grant = self._issue(drive, name, purpose, envelope, keys, lasts_s, ended)
        _held.set((*_held.get(), grant))
        try:
            yield grant
        finally:
            _held.set(tuple(each for each in _held.get() if each is not grant))
            self.end(grant)

    def standing(self, drive: str, purpose: str | Text, *, lasts_s: float, ended: Ended) -> Grant:
        """Issue a grant for an axis left enabled, valid until `end`; it replaces an earlier one."""
        for record in list(self._records.get(drive, ())):
            if record.grant.standing:
                self.end(record.grant)
        until = time.monotonic() + lasts_s
        grant = Grant(
            drive, acting_person(), purpose, until, standing=True, session=acting_session()
        )
        self._add(_Record(grant, ended))
        return grant

    def end(self, grant: Grant) -> None:
        """Return a grant. The work that held it receives no command."""
        record = self._record(grant)
        if record is None:
            return
        if record.timer is not None:
            record.timer.cancel()
        self._records[grant.drive].remove(record)
        if not self._records[grant.drive]:
            del self._records[grant.drive]
        self._changed(grant.drive)

    def revoke(self, drive: str, why: Text) -> None:
        """End all grants of this axis now, whoever holds them, so that no further setpoint is
        accepted.

        The holders are not notified: the caller brings the axis to standstill.
        """
        for record in self._records.get(drive, ()):
            record.why = record.why or why
        self._changed(drive)

    def end_of(self, session: str, why: Text) -> None:
        """End all grants requested by this session, token or invitation now, on every axis.

        The holders are notified as when a grant expires: each stops its axis.
        """
        if not session:
            return  # the one user of a station without accounts, or the program itself
        for record in [each for kept in self._records.values() for each in kept]:
            if record.grant.session == session:
                self._expire(record, why)

    def end_motion(self, drive: str, why: Text) -> bool:
        """End the grants by which this axis is moved, and notify their holders.

        An axis that is only left enabled keeps its grant. Returns False where no grant moves it.
        """
        moving = [
            r for r in list(self._records.get(drive, ())) if not r.grant.standing and not r.why
        ]
        for record in moving:
            self._expire(record, why)
        return bool(moving)

    def _expire(self, record: _Record, why: Text = _TIME_OVER) -> None:
        if record.why:
            return
        record.why = why
        self._changed(record.grant.drive)
        if record.ended is not None:
            record.ended(why)

    def _issue(
        self,
        drive: str,
        name: str,
        purpose: str | Text,
        envelope: Envelope | None,
        keys: frozenset[str] | None,
        lasts_s: float,
        ended: Ended | None,
    ) -> Grant:
        outer = self.held(drive)
        if outer is not None and (why := self._ended(outer)) is not None:
            # Work that STOP has ended must not obtain a new grant.
            raise NotGranted(
                "motion.permission-move-ended", drive=name, purpose=outer.purpose, why=why
            )
        mine = set(_held.get())
        for other in self._live(drive):
            if other.standing or other in mine:
                continue
            apart = keys is not None and other.keys is not None and not keys & other.keys
            if keys is None and other.keys is not None:
                continue  # forced terminals may coexist with a motion
            if keys is not None and other.keys is None:
                continue
            if not apart:
                raise Busy("motion.moved-already", drive=name, purpose=other.purpose)
        until = time.monotonic() + lasts_s
        if outer is not None:
            until = min(until, outer.until)
        grant = Grant(
            drive, acting_person(), purpose, until, envelope, keys, session=acting_session()
        )
        self._add(_Record(grant, ended))
        return grant

    def _add(self, record: _Record) -> None:
        grant = record.grant
        self._records.setdefault(grant.drive, []).append(record)
        left_s = grant.until - time.monotonic()
        if math.isfinite(left_s):
            loop = asyncio.get_running_loop()
            record.timer = loop.call_later(max(0.0, left_s), self._expire, record)
        self._changed(grant.drive)

    def _live(self, drive: str) -> list[Grant]:
        now = time.monotonic()
        records = self._records.get(drive, ())
        return [r.grant for r in records if not r.why and now <= r.grant.until]

    def _ended(self, grant: Grant) -> Text | None:
        """Return the reason why this grant is no longer live; None while it is live."""
        record = self._record(grant)
        if record is None or time.monotonic() > grant.until:
            return _TIME_OVER if record is None else record.why or _TIME_OVER
        return record.why

    def _record(self, grant: Grant) -> _Record | None:
        records = self._records.get(grant.drive, ())
        return next((record for record in records if record.grant is grant), None)

    def _changed(self, drive: str) -> None:
        for listener in self._listeners:
            listener(drive)
