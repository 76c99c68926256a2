"""Runs transactions step by step: one frame at a time, with the next step of every station.

Every station has a lane for its mailbox and one for its registers. A lane runs one transaction at a
time; different lanes interleave, so that a slow drive does not delay a fast one, and process data
are sent between any two frames. The accesses of several lanes share one frame.

Within a lane a write precedes waiting reads, also between two objects of a batch. A stop precedes
everything: a transaction in progress is suspended in the middle, after at most `GRACE_S`, and
waiting writes are ended unsent, so that none of them follows the stop.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, Literal, Protocol

from drivers.errors import DriveError, LinkLost, ProtocolError
from drivers.ethercat.wire.coe import stopped_first
from drivers.ethercat.wire.frames import ROOM_BYTES, Request, bytes_of
from drivers.ethercat.wire.steps import Gap, Pause, Read, Step, Steps, Write
from drivers.texts.message import Text

GRACE_S = 0.01
"""Time that a stop leaves for the pending answer [s]: most drives need 1 to 5 ms."""

LaneName = Literal["mailbox", "register"]
Done = Callable[[Any, DriveError | None], None]
"""Called with the result or the error of a transaction."""


class Wire(Protocol):
    """Exchanges one frame with several accesses."""

    def exchange(self, requests: Sequence[Request]) -> list[bytes | None]:
        """As `drivers.ethercat.wire.frames.answers`; all None for a lost frame."""


class Urgency(IntEnum):
    """Priority within a lane."""

    NORMAL = 0
    WRITE = 1
    STOP = 2


@dataclass
class _Job:
    steps: Steps[Any]
    done: Done
    urgency: Urgency
    asked_s: float
    reply: bytes | None = None
    wake_s: float = 0.0
    calm: bool = True
    """No access of the job is pending."""


@dataclass
class _Lane:
    station: int
    waiting: list[_Job] = field(default_factory=list)
    """The most urgent first, in order of arrival within each priority."""
    running: list[_Job] = field(default_factory=list)
    """The last one runs; those before it are suspended."""
    widest: int = 0
    """Most bytes of a frame that one access has taken."""

    def choose(self, now: float) -> _Job | None:
        """Return the job to run now: a waiting one may precede the running one."""
        first = self.waiting[0] if self.waiting else None
        top = self.running[-1] if self.running else None
        if first is not None and (top is None or self._gives_way(top, first, now)):
            self.running.append(self.waiting.pop(0))
        return self.running[-1] if self.running else None

    @staticmethod
    def _gives_way(top: _Job, first: _Job, now: float) -> bool:
        if first.urgency <= top.urgency:
            return False
        return top.calm or (first.urgency is Urgency.STOP and now >= first.asked_s + GRACE_S)

    def due_s(self) -> float | None:
        """Return when its next step is due; None if there is nothing to do."""
        first = self.waiting[0] if self.waiting else None
        if not self.running:
            return None if first is None else 0.0
        top = self.running[-1]
        if first is None or first.urgency <= top.urgency:
            return top.wake_s
        if top.calm:
            return 0.0
        if first.urgency is Urgency.STOP:
            return min(top.wake_s, first.asked_s + GRACE_S)
        return top.wake_s


class Lanes:
    """All lanes of one segment."""

    def __init__(self, wire: Wire, clock: Callable[[], float]) -> None:
        self._wire = wire
        self._clock = clock
        self._lanes: dict[tuple[int, LaneName], _Lane] = {}
        self._order: deque[_Lane] = deque()
        self.frames = 0

    def submit(
        self,
        station: int,
        lane: LaneName,
        steps: Steps[Any],
        done: Done,
        urgency: Urgency = Urgency.NORMAL,
    ) -> None:
        """Queue a transaction; a stop ends the waiting writes."""
        found = self._lanes.get((station, lane))
        if found is None:
            found = self._lanes[station, lane] = _Lane(station)
            self._order.append(found)
        late = (
            []
            if urgency is not Urgency.STOP
            else [job for job in found.waiting if job.urgency is Urgency.WRITE]
        )
        place = sum(job.urgency >= urgency for job in found.waiting)
        found.waiting.insert(place, _Job(steps, done, urgency, self._clock()))
        for job in late:
            found.waiting.remove(job)
            job.done(None, stopped_first())

    def busy(self, station: int, lane: LaneName) -> bool:
        """Return whether a transaction runs or waits in this lane."""
        found = self._lanes.get((station, lane))
        return found is not None and bool(found.running or found.waiting)

    def pending(self) -> bool:
        """Return whether any transaction runs or waits."""
        return any(lane.running or lane.waiting for lane in self._order)

    def wake_s(self) -> float | None:
        """Return when the next step is due; None if there is nothing to do."""
        due = [at for lane in self._order if (at := lane.due_s()) is not None]
        return min(due, default=None)

    def step(self, room: int = ROOM_BYTES) -> bool:
        """Do the next access of every lane that is due, in one frame. False if none is due.

        A lane whose access may no longer fit into ``room`` bytes comes first in the next frame.
        """
        now = self._clock()
        frame: list[tuple[_Job, Request]] = []
        for _ in range(len(self._order)):
            lane = self._order[0]
            if frame and lane.widest > room:
                break
            self._order.rotate(-1)
            taken = self._next_access(lane, now)
            if taken is None:
                continue
            size = bytes_of(taken[1][1])
            lane.widest = max(lane.widest, size)
            if frame and size > room:
                # Never postponed: a stop might come in between.
                self._send(frame)
                frame, room = [], ROOM_BYTES
            frame.append(taken)
            room -= size
        if frame:
            self._send(frame)
        return bool(frame)

    def _send(self, frame: Sequence[tuple[_Job, Request]]) -> None:
        self.frames += 1
        replies = self._wire.exchange([request for _, request in frame])
        for (job, _), reply in zip(frame, replies, strict=True):
            job.reply = reply

    def drop(self, why: Text) -> None:
        """End all running and waiting transactions with an error."""
        for lane in tuple(self._order):
            jobs = [*lane.running, *lane.waiting]
            for job in lane.running:
                job.steps.close()
            lane.running.clear()
            lane.waiting.clear()
            for job in jobs:
                job.done(None, LinkLost(why, remedy="ethercat.tried-again-by-itself"))

    def _next_access(self, lane: _Lane, now: float) -> tuple[_Job, Request] | None:
        """Run a lane up to its next access; None if it has none now."""
        while (job := lane.choose(now)) is not None and job.wake_s <= now:
            step = self._advance(lane, job)
            if isinstance(step, Read | Write):
                return job, (lane.station, step)
            if isinstance(step, Pause):
                return None
        return None

    def _advance(self, lane: _Lane, job: _Job) -> Step | None:
        """Return the next step of a transaction; None when it has ended."""
        try:
            step = job.steps.send(job.reply)
        except StopIteration as stop:
            lane.running.remove(job)
            job.done(stop.value, None)
            return None
        except DriveError as error:
            lane.running.remove(job)
            job.done(None, error)
            return None
        except (struct.error, ValueError, IndexError) as error:
            # Whatever a slave sends must not end the process that moves axes.
            lane.running.remove(job)
            reported = ProtocolError("ethercat.drive-sent-something-cannot", cause=str(error))
            job.done(None, reported)
            return None
        job.calm = isinstance(step, Gap)
        job.wake_s, job.reply = 0.0, b""
        if isinstance(step, Pause):
            job.wake_s = self._clock() + step.seconds
        return step
