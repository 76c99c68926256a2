"""Writing the audit without blocking its callers.

`AuditLog.add` puts an event into a queue and returns, so that STOP, motion and every other caller
continue. A thread appends to the database. While that fails (disk full, server unreachable) events
wait in memory and, where the state folder can be written, in ``audit-pending.jsonl``, which a later
start reads; every page shows `AuditLog.problem`. `AuditLog.settled` delays an answer, for a limited
time, until the events it reports are safely recorded.
"""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from itertools import islice

from sqlalchemy import select

from backend.foundation.people.identity import acting_person
from backend.foundation.store.audit_tables import AuditEntry
from backend.foundation.store.database import DatabaseFailed, Store
from backend.records.audit import chain
from backend.records.audit.facts import Fact, body_of, stamp
from backend.records.audit.pending import PendingFile
from drivers.errors import internal_error
from drivers.texts.message import Text, text

log = logging.getLogger(__name__)

#: Acting person of events without a person.
PROGRAM = "servodeck"
_BATCH = 500
_RETRY_S = (0.5, 1.0, 2.0, 5.0)


@dataclass(slots=True)
class _Queue:
    """Events that are not in the database yet.

    ``spooled``: number of the first ones that are in the file. ``lost``: number of events dropped
    because the queue was full. ``kept``: number of all events so far that are on a disk.
    """

    bodies: deque[str] = field(default_factory=deque)
    spooled: int = 0
    added: int = 0
    kept: int = 0
    lost: int = 0
    lost_since: str = ""
    waiting: list[tuple[int, Future[None]]] = field(default_factory=list)


class AuditLog:
    """The audit of one station. It opens nothing before the first event, or `start`.

    ``changed`` is called on the writing thread with a new problem, or with None when the problem
    is over.
    """

    def __init__(
        self,
        store: Store,
        station: str,
        *,
        capacity: int = 50_000,
        changed: Callable[[Text | None], None] = lambda _problem: None,
    ) -> None:
        self._store = store
        self.station = station
        self._capacity = capacity
        self._changed = changed
        self._file = PendingFile(store.folder / "audit-pending.jsonl")
        self._queue = _Queue()
        self._wake = threading.Condition()
        self._thread: threading.Thread | None = None
        self._closing = False
        self._file_takes = True
        #: Bodies of failed transactions, which may have been committed nevertheless.
        self._unsure: set[str] = set()
        self._last_time = datetime.min.replace(tzinfo=UTC)
        self.problem: Text | None = None
        """Why events are not in the database yet; None without a problem."""

    # --- adding -----------------------------------------------------------------------

    def add(self, fact: Fact) -> None:
        """Record an event with the present time. Never waits and never fails."""
        person = fact.person if fact.person is not None else acting_person() or PROGRAM
        with self._wake:
            if self._closing:
                log.warning("the audit is closed; not recorded: %s", fact)
                return
            moment = max(datetime.now(UTC), self._last_time + timedelta(microseconds=1))
            self._last_time = moment
            self._start()
            queue = self._queue
            queue.added += 1
            if len(queue.bodies) >= self._capacity:
                queue.lost_since = queue.lost_since or stamp(moment)
                queue.lost += 1
            else:
                queue.bodies.append(
                    body_of(fact, moment=moment, station=self.station, person=person)
                )
            self._wake.notify()

    async def settled(self, timeout_s: float) -> bool:
        """Wait until all events so far are on a disk; False where that takes longer."""
        with self._wake:
            queue = self._queue
            if queue.kept >= queue.added:
                return True
            done: Future[None] = Future()
            queue.waiting.append((queue.added, done))
        try:
            async with asyncio.timeout(timeout_s):
                await asyncio.wrap_future(done)
        except TimeoutError:
            return False
        return True

    @property
    def pending(self) -> int:
        """Number of events that are not in the database yet."""
        with self._wake:
            return len(self._queue.bodies)

    def start(self) -> None:
        """Start the writing thread, which first writes the events of an earlier run."""
        with self._wake:
            self._start()

    def close(self, timeout_s: float = 5.0) -> None:
        """Write the remaining events, to the database or otherwise to the file, and end. Blocks."""
        with self._wake:
            self._closing = True
            self._wake.notify()
            thread = self._thread
        if thread is not None:
            thread.join(timeout_s)

    # --- the writing thread -------------------------------------------------------------

    def _start(self) -> None:
        if self._thread is None and not self._closing:
            # A daemon, as a database that hangs must not prevent the program from ending.
            self._thread = threading.Thread(target=self._run, name="audit", daemon=True)
            self._thread.start()

    def _run(self) -> None:
        self._take_up()
        failures, retry_at = 0, 0.0
        while True:
            with self._wake:
                while not (self._closing or self._ready(retry_at)):
                    rest = max(0.01, retry_at - time.monotonic())
                    self._wake.wait(rest if self._queue.bodies else None)
                closing = self._closing
                batch = list(islice(self._queue.bodies, _BATCH))
                lost = self._lost_note()
            if closing and not (batch or lost):
                return
            # Disk and network only outside the lock: `add` must never wait for them.
            if closing or time.monotonic() >= retry_at:
                try:
                    self._append([*batch, *lost])
                except Exception as error:
                    retry_at = time.monotonic() + _RETRY_S[min(failures, len(_RETRY_S) - 1)]
                    failures += 1
                    self._failed(error, batch)
                else:
                    failures, retry_at = 0, 0.0
                    self._succeeded(batch, bool(lost))
                    continue
            self._spool()
            if closing:
                return

    def _take_up(self) -> None:
        earlier = self._file.read()
        with self._wake:
            queue = self._queue
            queue.bodies.extendleft(reversed(earlier))
            queue.spooled = len(earlier)
            queue.added += len(earlier)
            queue.kept += len(earlier)
        self._unsure.update(earlier)

    def _ready(self, retry_at: float) -> bool:
        """Whether there is something to write now, to the database or otherwise to the file."""
        queue = self._queue
        if not queue.bodies:
            return False
        return time.monotonic() >= retry_at or (
            self._file_takes and len(queue.bodies) > queue.spooled
        )

    def _append(self, bodies: list[str]) -> None:
        """Add to the chain, without entries that a transaction of unknown outcome has added."""
        with self._store.writing() as session:
            uncertain = [body for body in bodies if body in self._unsure]
            if uncertain:
                times = {chain.columns(body)["time"] for body in uncertain}
                found = select(AuditEntry.body).where(AuditEntry.time.in_(times))
                present = set(session.scalars(found))
                bodies = [body for body in bodies if body not in present]
            chain.append(session, bodies)

    def _lost_note(self) -> list[str]:
        queue = self._queue
        if not queue.lost:
            return []
        fact = Fact(
            "audit",
            "lost",
            outcome=text("audit.events-lost", count=queue.lost),
            new=queue.lost,
            detail={"since": queue.lost_since},
        )
        return [body_of(fact, moment=datetime.now(UTC), station=self.station, person=PROGRAM)]

    def _succeeded(self, batch: list[str], lost_reported: bool) -> None:
        self._unsure.difference_update(batch)
        with self._wake:
            queue = self._queue
            for _ in batch:
                queue.bodies.popleft()
            emptied = 0 < queue.spooled <= len(batch)
            queue.kept += max(0, len(batch) - queue.spooled)
            queue.spooled = max(0, queue.spooled - len(batch))
            if lost_reported:
                queue.kept += queue.lost
                queue.lost, queue.lost_since = 0, ""
            self._resolve()
            over = self.problem is not None
            self.problem = None
        if emptied:
            self._file.clear()
        if over:
            self._changed(None)

    def _failed(self, error: Exception, batch: list[str]) -> None:
        self._unsure.update(batch)
        known = isinstance(error, DatabaseFailed)
        why = error.text if isinstance(error, DatabaseFailed) else internal_error(error)
        with self._wake:
            first = self.problem is None
            self.problem = why
            self._file_takes = True
        if first:
            log.error("the audit cannot be written: %s", why, exc_info=None if known else error)
            self._changed(why)

    def _spool(self) -> None:
        """Append events that are only in memory to the file; on failure they stay in memory."""
        with self._wake:
            fresh = list(islice(self._queue.bodies, self._queue.spooled, None))
        # Another process of this station may write them from the file to the database.
        self._unsure.update(fresh)
        taken = not fresh or self._file.append(fresh)
        with self._wake:
            self._file_takes = taken
            if taken:
                self._queue.spooled += len(fresh)
                self._queue.kept += len(fresh)
                self._resolve()

    def _resolve(self) -> None:
        queue = self._queue
        still = []
        for number, done in queue.waiting:
            if number > queue.kept:
                still.append((number, done))
            elif done.set_running_or_notify_cancel():
                done.set_result(None)
        queue.waiting = still
