"""A serial bus of register-based drives as a `Link`: Modbus RTU, and MLink by another layout.

A `Layout` determines the registers of a value; everything else (thread, batches, retries, loss and
return of the adapter, scan) is the same for both.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

from drivers.cia402 import is_stop
from drivers.doctor.examined import Examines
from drivers.errors import (
    DriveError,
    LinkLost,
    LinkTimeout,
    NotAllowed,
    ProtocolError,
    Rejected,
)
from drivers.link import (
    Address,
    Cyclic,
    Found,
    LinkEvent,
    LinkQuality,
    Progress,
    Unsubscribe,
    lists_nothing,
    notify,
)
from drivers.modbus.framing import BUSY, NOT_REACHED
from drivers.modbus.layout import Layout, TableLayout
from drivers.modbus.line import Line
from drivers.modbus.port import LineSettings
from drivers.modbus.registers import (
    Block,
    Place,
    plan_blocks,
    to_bytes,
    to_words,
)
from drivers.modbus.thread import BusThread
from drivers.objects.dictionary import Described
from drivers.texts.message import Text, text
from drivers.urls import bus_kind
from profiles.schema import LinkKind, Profile

T = TypeVar("T")

#: A job on the bus's thread yields to others after this time (and always after a failure).
_TURN_S = 0.005
#: A drive that reports busy is queried again after this time, then after twice as long.
_BUSY_S = 0.05
_REOPEN_S = 0.25
_STATIONS = range(1, 248)
_ASKED_AGAIN = 4
"""Silent addresses queried again after an unexpected answer, which one of them may have sent."""
_PLANS_KEPT = 256


@dataclass(frozen=True, slots=True)
class _Plan:
    """Requests for one list of addresses; ``failed`` are those that are never sent."""

    places: tuple[Place | None, ...]
    blocks: tuple[Block, ...]
    failed: dict[int, DriveError]


@dataclass(slots=True)
class _Batch:
    """A read_many in progress. Only the bus's thread changes it."""

    plan: _Plan
    todo: deque[tuple[Block, int]]
    results: list[bytes | DriveError | None]
    silent_blocks: int = 0
    wait_s: float = 0.0
    """Delay before its next turn [s], as the drive reported busy."""


class RegisterLink:
    """A `drivers.link.Link` over one serial line."""

    cyclic: Cyclic | None = None
    doctor: Examines | None = None

    def __init__(
        self,
        url: str,
        settings: LineSettings,
        layout: Layout,
        line: Callable[..., Line] = Line,
    ) -> None:
        self.kind: LinkKind = layout.kind
        self.traits = bus_kind(layout.kind).traits
        self.url = url
        self._settings = settings
        self._layout = layout
        self._line = line(settings, on_change=self._changed)
        self._thread: BusThread | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._watcher: asyncio.Task[None] | None = None
        self._listeners: list[Callable[[LinkEvent], None]] = []
        self._plans: dict[tuple[int, tuple[Address, ...]], _Plan] = {}
        self._refused_blocks: set[tuple[int, int, int]] = set()

    def attach(self, station: int, profile: Profile) -> None:
        """See `drivers.link.Link.attach`: word order and block lengths."""
        self._layout.configure(station, profile)
        self._plans.clear()
        self._refused_blocks.clear()

    def unreachable(self, station: int, address: Address) -> Text | None:
        """See `drivers.link.Link.unreachable`."""
        try:
            self._layout.place(station, address)
        except NotAllowed as error:
            return error.text
        return None

    async def enumerate(self, station: int, progress: Progress) -> list[Described]:
        """See `drivers.link.Link.enumerate`: no drive lists its objects over registers."""
        del progress
        raise lists_nothing(self.kind, station)

    async def open(self) -> None:
        """Open the adapter. See `drivers.link.Link.open`."""
        if self._thread is not None:
            return
        self._loop = asyncio.get_running_loop()
        thread = BusThread(f"line {self._settings.device}")
        try:
            await thread.run(self._line.open)
        except BaseException:
            thread.stop()
            raise
        self._thread = thread

    async def close(self) -> None:
        """Close the adapter. Further calls have no effect."""
        thread, self._thread = self._thread, None
        if self._watcher is not None:
            self._watcher.cancel()
            self._watcher = None
        if thread is not None:
            await thread.run(self._line.close, urgent=True)
            thread.stop()

    async def scan(
        self,
        progress: Progress,
        stations: Sequence[int] | None = None,
        *,
        stop_after: int | None = None,
    ) -> list[Found]:
        """Query each address once (1 to 247 unless given) and identify those that answer.

        A refusal counts as an answer. If an answer seems to have come too late, the addresses that
        may have sent it are queried again at the end. ``stop_after`` ends the search after this
        many drives.
        """
        found: list[Found] = []
        damaged: list[int] = []
        silent: list[int] = []
        again: list[int] = []
        wanted = deque(stations if stations is not None else _STATIONS)
        number, share, strays = 0, 0.0, self._line.strays
        while wanted and (stop_after is None or len(found) < stop_after):
            station = wanted.popleft()
            share = max(share, number / (number + 1 + len(wanted)))
            progress(share, text("modbus.asking-address", station=station))
            number += 1
            # After the last one no request follows: late answers arrive in this time.
            brief = wanted and station not in again
            limit_s = self._settings.scan_timeout_s if brief else self._settings.timeout_s
            there = await self._run(partial(self._is_there, station, limit_s))
            if there is None:
                damaged.append(station)
            elif there:
                found.append(await self._identify(station))
            if self._line.strays != strays:
                strays = self._line.strays
                again += silent[-_ASKED_AGAIN:]
                wanted.extend(silent[-_ASKED_AGAIN:])
                silent.clear()
            if there is False and station not in again:
                silent.append(station)
        found.sort(key=lambda drive: drive.station)
        progress(1.0, _summary(found, damaged))
        return found

    async def read(self, station: int, address: Address) -> bytes:
        """Read one value. See `drivers.link.Link.read`."""
        result = (await self.read_many(station, (address,)))[0]
        if isinstance(result, DriveError):
            raise result
        return result

    async def read_many(
        self, station: int, addresses: Sequence[Address]
    ) -> list[bytes | DriveError]:
        """Read several values, neighbours in one request if the layout allows it.

        Only reads are repeated (``retries`` of the settings), also if the drive reports busy, which
        leaves the line free for others meanwhile. After two requests without any answer the rest
        fails at once, without waiting for each time-out.
        """
        plan = self._plan(station, tuple(addresses))
        results: list[bytes | DriveError | None] = [None] * len(plan.places)
        for item, error in plan.failed.items():
            results[item] = _again(error)
        batch = _Batch(plan, deque((block, 0) for block in plan.blocks), results)
        while batch.todo:
            await self._run(partial(self._read_turn, station, batch))
            if batch.wait_s:
                await asyncio.sleep(batch.wait_s)
        return [_decided(result) for result in results]

    async def write(self, station: int, address: Address, data: bytes) -> None:
        """Write one value; precedes all waiting reads. See `drivers.link.Link.write`."""
        place = self._layout.place(station, address)
        words = to_words(place, data)
        stop = is_stop(address.index, address.subindex, data)
        write = partial(self._line.write, station, place.start, words, at_any_rate=stop)
        await self._run(write, urgent=True)

    def quality(self, station: int | None = None) -> LinkQuality:
        """Return the counters. See `drivers.link.Link.quality`."""
        return self._line.quality(station)

    def listen(self, listener: Callable[[LinkEvent], None]) -> Unsubscribe:
        """Subscribe to loss and return of the adapter."""
        self._listeners.append(listener)

        def unsubscribe() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)

        return unsubscribe

    @property
    def frames(self) -> RegisterLink:
        """The link itself, which keeps the last minute of its frames."""
        return self

    async def flight(self, station: int | None = None) -> bytes:
        """See `drivers.link.RecordsFrames`."""
        return await asyncio.to_thread(self._line.ring.file, station)

    # --- on the bus's thread ---

    def _read_turn(self, station: int, batch: _Batch) -> None:
        """Work on a batch until its turn is over; a failure ends the turn."""
        end = time.monotonic() + _TURN_S
        batch.wait_s = 0.0
        while batch.todo:
            block, attempt = batch.todo.popleft()
            try:
                data = self._line.read(station, block.start, block.count)
            except DriveError as error:
                self._failed_block(station, batch, block, attempt, error)
                return
            batch.silent_blocks = 0
            self._cut(batch, block, data)
            if time.monotonic() >= end:
                return

    def _cut(self, batch: _Batch, block: Block, data: bytes) -> None:
        for item in block.items:
            place = batch.plan.places[item]
            assert place is not None
            first = 2 * (place.start - block.start)
            try:
                batch.results[item] = to_bytes(place, data[first : first + 2 * place.count])
            except ProtocolError as error:
                batch.results[item] = error

    def _failed_block(
        self, station: int, batch: _Batch, block: Block, attempt: int, error: DriveError
    ) -> None:
        busy = isinstance(error, Rejected) and error.abort_code == BUSY
        if busy and attempt < self._settings.retries:
            self._line.count_retry(station)
            batch.wait_s = _BUSY_S * 2**attempt
            batch.todo.appendleft((block, attempt + 1))
            return
        unreached = isinstance(error, Rejected) and error.abort_code in NOT_REACHED
        refused = isinstance(error, Rejected) and not busy and not unreached
        if refused and len(block.items) > 1:
            # One of its registers is refused: read them one by one, now and later.
            self._refused_blocks.add((station, block.start, block.count))
            self._plans.clear()
            batch.todo.extendleft(
                (single, 0) for single in reversed(_singles(batch.plan.places, block))
            )
            return
        mute = isinstance(error, LinkTimeout)
        repeatable = mute or isinstance(error, ProtocolError)
        if repeatable and attempt < self._settings.retries and not batch.silent_blocks:
            self._line.count_retry(station)
            batch.todo.appendleft((block, attempt + 1))
            return
        for item in block.items:
            batch.results[item] = _again(error)
        batch.silent_blocks = batch.silent_blocks + 1 if mute or unreached else 0
        if isinstance(error, LinkLost) or batch.silent_blocks >= 2:
            for rest, _ in batch.todo:
                for item in rest.items:
                    batch.results[item] = _again(error)
            batch.todo.clear()

    def _is_there(self, station: int, limit_s: float) -> bool | None:
        """Return True if it answers, False if not, None if only damaged answers come."""
        place = self._layout.place(station, self._layout.identity()[0])
        for _ in range(2):
            try:
                self._line.seek(station, place.start, place.count, limit_s)
            except ProtocolError:
                continue
            except LinkTimeout:
                return False
            except Rejected:
                return True
            return True
        return None

    def _changed(self, up: bool, why: Text) -> None:
        self._line.ring.note(why.words())
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._notify, up, why)

    # --- on the event loop ---

    async def _run(self, job: Callable[[], T], *, urgent: bool = False) -> T:
        if self._thread is None:
            raise LinkLost("modbus.not-open", url=self.url)
        return await self._thread.run(job, urgent=urgent)

    def _notify(self, up: bool, why: Text) -> None:
        if self._thread is None:
            return
        notify(self._listeners, LinkEvent("back" if up else "lost", None, why))
        if not up and (self._watcher is None or self._watcher.done()):
            self._watcher = asyncio.ensure_future(self._watch())

    async def _watch(self) -> None:
        """Open the adapter again as soon as it is back."""
        while True:
            await asyncio.sleep(_REOPEN_S)
            if await self._run(self._line.reopen):
                return

    async def _identify(self, station: int) -> Found:
        results = await self.read_many(station, self._layout.identity())
        values = [
            None if isinstance(r, DriveError) else int.from_bytes(r, "little") for r in results
        ]
        return self._layout.describe(station, values)

    def _plan(self, station: int, addresses: tuple[Address, ...]) -> _Plan:
        """Return the requests for these addresses; cached, because pollers repeat them."""
        plan = self._plans.get((station, addresses))
        if plan is None:
            if len(self._plans) >= _PLANS_KEPT:
                self._plans.clear()
            plan = self._plans[station, addresses] = self._new_plan(station, addresses)
        return plan

    def _new_plan(self, station: int, addresses: tuple[Address, ...]) -> _Plan:
        places: list[Place | None] = []
        failed: dict[int, DriveError] = {}
        for item, address in enumerate(addresses):
            try:
                places.append(self._layout.place(station, address))
            except DriveError as error:
                places.append(None)
                failed[item] = error
        known = [item for item, place in enumerate(places) if place is not None]
        limits = self._layout.limits(station)
        blocks: list[Block] = []
        for raw in plan_blocks(
            [place for place in places if place is not None], limits.max_registers, limits.max_gap
        ):
            block = Block(raw.start, raw.count, tuple(known[i] for i in raw.items))
            if (station, block.start, block.count) in self._refused_blocks:
                blocks.extend(_singles(tuple(places), block))
            else:
                blocks.append(block)
        return _Plan(tuple(places), tuple(blocks), failed)


def _singles(places: tuple[Place | None, ...], block: Block) -> list[Block]:
    """Return the values of a block, each in a request of its own."""
    found: list[Block] = []
    for item in block.items:
        place = places[item]
        if place is not None:
            found.append(Block(place.start, place.count, (item,)))
    return found


def _summary(found: Sequence[Found], damaged: Sequence[int]) -> Text:
    if not damaged:
        return text("modbus.found", count=len(found))
    places = ", ".join(map(str, damaged))
    return text("modbus.found-and-damaged", count=len(found), places=places)


def _again(error: DriveError) -> DriveError:
    """Copy an error: callers add the parameter concerned."""
    if isinstance(error, Rejected):
        return Rejected(error.text, abort_code=error.abort_code, remedy=error.remedy_text)
    return type(error)(
        error.text, value=error.value, limit=error.limit_text, remedy=error.remedy_text
    )


def _decided(result: bytes | DriveError | None) -> bytes | DriveError:
    if result is None:
        raise ProtocolError("modbus.value-neither-read-nor")
    return result


def modbus_link(url: str, settings: LineSettings) -> RegisterLink:
    """Create the link of a Modbus RTU bus without opening it."""
    return RegisterLink(url, settings, TableLayout())
