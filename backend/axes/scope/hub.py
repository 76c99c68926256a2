"""Delivery of samples: cyclic blocks of a bus, or polled values with their own times.

One sampler per drive reads the union of its subscribers' parameters, so that a second viewer of
the same signals adds no bus load. Every subscription has one bounded queue; when it is full, whole
blocks are dropped and counted in the next one. A slow subscriber therefore disturbs neither the bus
nor the others.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from backend.axes.axis.axis import Axis
from backend.axes.drive.readings import Reading
from drivers.errors import DriveError
from drivers.link import ScopeBlock

log = logging.getLogger(__name__)

#: A block is delivered at least this often [s].
FLUSH_S = 0.04
#: Number of blocks that wait for a slow subscriber before blocks are dropped.
QUEUE_BLOCKS = 50
#: Shortest polling period [s]; a link without wire time would occupy a whole core otherwise.
SHORTEST_PERIOD_S = 0.0005
#: Pause between attempts while the drive does not answer [s].
RETRY_S = 0.25


@dataclass(eq=False, slots=True)
class Subscription:
    """One stream of one drive's channels. ``ready`` wakes the consumer, which empties ``queue``."""

    drive: str
    keys: tuple[str, ...]
    period_s: float
    queue: deque[ScopeBlock] = field(default_factory=deque)
    dropped: int = 0
    sequence: int = 0
    ready: asyncio.Event = field(default_factory=asyncio.Event)
    due: float = 0.0
    rows: list[list[float]] = field(default_factory=list)
    times: list[float] = field(default_factory=list)
    since: float = 0.0
    synchronous: bool = False
    leave: Callable[[], None] | None = None
    sampler: _Sampler | None = None
    sink: Callable[[ScopeBlock], None] | None = None
    """Receives every block at once in place of the queue, so that none is lost; must not block."""

    def take(self, block: ScopeBlock) -> None:
        """Take a block of the cyclic exchange."""
        self.put(block.samples, block.t0_s, block.dt_s, None, block.dropped, block.valid)

    def put(
        self,
        samples: np.ndarray[tuple[int, int], np.dtype[np.float64]],
        t0_s: float,
        dt_s: float,
        times_s: np.ndarray[tuple[int], np.dtype[np.float64]] | None,
        lost: int = 0,
        valid: np.ndarray[tuple[int], np.dtype[np.bool_]] | None = None,
    ) -> None:
        """Queue a block, or count it as dropped."""
        self.dropped += lost
        if self.sink is None and len(self.queue) >= QUEUE_BLOCKS:
            self.dropped += len(samples)
            return
        self.sequence += 1
        block = ScopeBlock(
            sequence=self.sequence,
            t0_s=t0_s,
            dt_s=dt_s,
            channels=self.keys,
            samples=samples,
            dropped=self.dropped,
            times_s=times_s,
            valid=valid,
        )
        self.dropped = 0
        if self.sink is not None:
            self.sink(block)
            return
        self.queue.append(block)
        self.ready.set()


class ScopeHub:
    """Samplers of all drives. ``axis_of`` returns the axis of a drive id."""

    def __init__(self, axis_of: Callable[[str], Axis]) -> None:
        self._axis_of = axis_of
        self._samplers: dict[str, _Sampler] = {}

    def subscribe(
        self, drive: str, keys: Sequence[str], period_s: float
    ) -> list[tuple[Subscription, tuple[int, ...]]]:
        """Begin sampling ``keys`` of a drive, at least ``period_s`` apart (0: as fast as possible).

        Returns streams, each with the positions in ``keys`` that it carries: one for the signals
        that the cyclic exchange carries in every cycle, and one for the others, which are polled.

        Raises:
            NotAllowed: the drive does not have a key, or no port carries it.
        """
        axis = self._axis_of(drive)
        parameters = [axis.drive.parameter(key) for key in keys]
        for parameter in parameters:
            axis.drive.port_for(parameter)
        # Readings and channels are identified by key, also where the maker's number was given.
        keys = [parameter.key for parameter in parameters]
        session = axis.session
        cyclic = [n for n, k in enumerate(keys) if session and session.carries(axis.drive, k)]
        polled = [n for n in range(len(keys)) if n not in cyclic]
        streams: list[tuple[Subscription, tuple[int, ...]]] = []
        if cyclic and session is not None:
            stream = Subscription(drive, tuple(keys[n] for n in cyclic), 0.0, synchronous=True)
            stream.leave = session.subscribe(axis.drive, stream.keys, stream.take)
            streams.append((stream, tuple(cyclic)))
        if polled:
            wanted = [keys[n] for n in polled]
            streams.append((self._poll(axis, drive, wanted, period_s), tuple(polled)))
        return streams

    def _poll(self, axis: Axis, drive: str, keys: Sequence[str], period_s: float) -> Subscription:
        subscription = Subscription(drive, tuple(keys), period_s)
        sampler = self._samplers.get(drive)
        if sampler is None or sampler.axis is not axis:
            # A drive that was removed from the axis list and added again is another object.
            sampler = self._samplers[drive] = _Sampler(axis)
        sampler.add(subscription)
        subscription.sampler = sampler
        return subscription

    async def unsubscribe(self, subscription: Subscription) -> None:
        """End a stream; the sampler ends with its last one."""
        if subscription.leave is not None:
            subscription.leave()
            return
        sampler, subscription.sampler = subscription.sampler, None
        if sampler is not None and sampler.remove(subscription):
            if self._samplers.get(subscription.drive) is sampler:
                del self._samplers[subscription.drive]
            await sampler.close()

    async def close(self) -> None:
        """End all streams."""
        samplers, self._samplers = list(self._samplers.values()), {}
        await asyncio.gather(*(sampler.close() for sampler in samplers))


class _Sampler:
    """Polls one drive for all its subscribers."""

    def __init__(self, axis: Axis) -> None:
        self.axis = axis
        self._subscriptions: list[Subscription] = []
        self._added = asyncio.Event()
        self._task = asyncio.create_task(self._run(), name=f"scope-{axis.drive.id}")

    def add(self, subscription: Subscription) -> None:
        self._subscriptions.append(subscription)
        self._added.set()

    def remove(self, subscription: Subscription) -> bool:
        """Remove a subscription; return whether none is left."""
        with contextlib.suppress(ValueError):
            self._subscriptions.remove(subscription)
        return not self._subscriptions

    async def close(self) -> None:
        self._task.cancel()
        await asyncio.wait([self._task])

    async def _run(self) -> None:
        drive = self.axis.drive
        while True:
            now = time.monotonic()
            due = [s for s in self._subscriptions if s.due <= now]
            if not due:
                self._added.clear()
                waits = [s.due - now for s in self._subscriptions]
                # A new subscriber does not wait for the turn of a slow one.
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(min(waits, default=FLUSH_S)):
                        await self._added.wait()
                continue
            for subscription in due:
                period = max(subscription.period_s, SHORTEST_PERIOD_S)
                subscription.due = max(subscription.due + period, now)
            keys = list(dict.fromkeys(key for s in due for key in s.keys))
            before = time.monotonic()
            try:
                readings = await drive.read_many(keys)
            except DriveError:
                # The monitor shows the cause; here it appears as a gap in time.
                await asyncio.sleep(RETRY_S)
                continue
            except Exception:
                # A sampler that ended unnoticed would deliver nothing to anybody any more.
                log.exception("the signals of %s cannot be sampled", drive.name)
                await asyncio.sleep(RETRY_S)
                continue
            middle = (before + time.monotonic()) / 2
            for subscription in due:
                _append(subscription, readings, middle)


def _append(subscription: Subscription, readings: dict[str, Reading], t_s: float) -> None:
    if not subscription.rows:
        subscription.since = t_s
    subscription.rows.append([_number(readings[key]) for key in subscription.keys])
    subscription.times.append(t_s)
    if t_s - subscription.since < FLUSH_S and subscription.period_s < FLUSH_S:
        return
    times = np.asarray(subscription.times)
    spacing = float(times[-1] - times[0]) / max(1, len(times) - 1)
    subscription.put(np.asarray(subscription.rows), float(times[0]), spacing, times)
    subscription.rows, subscription.times = [], []


def _number(reading: Reading) -> float:
    return float(reading.value) if isinstance(reading.value, (int, float)) else float("nan")
