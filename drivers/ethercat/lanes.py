"""Runs transactions step by step: one frame at a time, stations in turn.

Every station has a lane for its mailbox and one for its registers. A lane runs one transaction
at a time, different lanes interleave, so that a slow drive does not hold up a fast one, and
process data go out between any two frames.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

from drivers.errors import DriveError, LinkLost, ProtocolError
from drivers.ethercat.mailbox import Pause, Read, Steps

LaneName = Literal["mailbox", "register"]
Done = Callable[[Any, DriveError | None], None]
"""Called with the result or the error of a transaction."""


class Wire(Protocol):
    """One frame each, station counted from 1."""

    def read(self, station: int, register: int, size: int) -> bytes | None:
        """Bytes, or None when nobody answered."""

    def write(self, station: int, register: int, data: bytes) -> bool:
        """Whether somebody took it."""


@dataclass
class _Lane:
    station: int
    waiting: deque[tuple[Steps[Any], Done]] = field(default_factory=deque)
    steps: Steps[Any] | None = None
    done: Done | None = None
    reply: bytes | None = None
    wake_s: float = 0.0


class Lanes:
    """All lanes of one segment."""

    def __init__(self, wire: Wire, clock: Callable[[], float]) -> None:
        self._wire = wire
        self._clock = clock
        self._lanes: dict[tuple[int, LaneName], _Lane] = {}
        self._order: deque[_Lane] = deque()
        self.frames = 0

    def submit(self, station: int, lane: LaneName, steps: Steps[Any], done: Done) -> None:
        """Queue a transaction."""
        found = self._lanes.get((station, lane))
        if found is None:
            found = self._lanes[station, lane] = _Lane(station)
            self._order.append(found)
        found.waiting.append((steps, done))

    def busy(self, station: int, lane: LaneName) -> bool:
        """Whether a transaction runs or waits there."""
        found = self._lanes.get((station, lane))
        return found is not None and (found.steps is not None or bool(found.waiting))

    def pending(self) -> bool:
        """Whether anything runs or waits."""
        return any(lane.steps is not None or lane.waiting for lane in self._order)

    def wake_s(self) -> float | None:
        """When the next step is due; None when there is nothing to do."""
        due = [
            lane.wake_s if lane.steps is not None else 0.0
            for lane in self._order
            if lane.steps is not None or lane.waiting
        ]
        return min(due, default=None)

    def step(self) -> bool:
        """Do one frame of the next lane that is due. False when none is."""
        now = self._clock()
        # Twice round: a lane that ends without a frame may have the next one waiting.
        for _ in range(2 * len(self._order)):
            lane = self._order[0]
            self._order.rotate(-1)
            if lane.steps is None:
                if not lane.waiting:
                    continue
                lane.steps, lane.done = lane.waiting.popleft()
                lane.reply, lane.wake_s = None, 0.0
            if lane.wake_s > now:
                continue
            if self._advance(lane):
                return True
        return False

    def drop(self, why: str) -> None:
        """End everything that runs or waits with an error."""
        for lane in tuple(self._order):
            jobs = list(lane.waiting)
            lane.waiting.clear()
            if lane.steps is not None and lane.done is not None:
                lane.steps.close()
                jobs.insert(0, (lane.steps, lane.done))
            lane.steps = lane.done = None
            for _, done in jobs:
                done(None, LinkLost(why, remedy="it is tried again by itself; or scan again"))

    def _advance(self, lane: _Lane) -> bool:
        """Run the lane up to its next frame; True when a frame went out."""
        assert lane.steps is not None
        assert lane.done is not None
        done = lane.done
        try:
            step = lane.steps.send(lane.reply)
        except StopIteration as stop:
            lane.steps = lane.done = None
            done(stop.value, None)
            return False
        except DriveError as error:
            lane.steps = lane.done = None
            done(None, error)
            return False
        except (struct.error, ValueError, IndexError) as error:
            # Whatever a slave sends, the process that moves axes goes on.
            lane.steps = lane.done = None
            done(None, ProtocolError(f"the drive sent something that cannot be read ({error})"))
            return False
        if isinstance(step, Pause):
            lane.wake_s = self._clock() + step.seconds
            lane.reply = b""
            return False
        lane.wake_s = 0.0
        self.frames += 1
        if isinstance(step, Read):
            lane.reply = self._wire.read(lane.station, step.register, step.size)
        else:
            taken = self._wire.write(lane.station, step.register, step.data)
            lane.reply = b"" if taken else None
        return True
