"""Scope subscriptions of one live connection: bounded, counted, and renewed when buses change.

A subscription may consist of several streams: channels that the cyclic exchange carries in every
cycle, and channels that are polled. When an exchange starts or ends, or a drive comes back, the
streams are made again and the page gets another ScopeInfo.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from fastapi import WebSocketDisconnect

from backend.api.live.messages import ScopeChannelInfo, ScopeInfo, ScopeStart, ScopeStop, ToPage
from backend.api.live.scope_blocks import encode_block
from backend.api.messages.errors import problem_of
from backend.axes.scales.units import AxisUnits
from backend.axes.scope.hub import Subscription
from backend.axes.scope.units import axis_scale
from backend.station.bench import Bench
from drivers.errors import Busy, DriveError

#: Limits of one connection: subscriptions, and waiting requests.
MOST_SUBSCRIPTIONS = 32
MOST_REQUESTS = 200
#: A page that accepts no block for this long [s] is disconnected; lost
#: samples are counted until then.
SEND_TIMEOUT_S = 10.0
#: Size limit of a frame [bytes]; the last block may exceed it.
FRAME_BYTES = 256 * 1024
#: Timeout [s]: reading the gearing of a mute drive must not delay the samples of the others.
UNITS_TIMEOUT_S = 2.0

_Streams = list[tuple[Subscription, tuple[int, ...]]]
SendBytes = Callable[[bytes], Awaitable[None]]


@dataclass(slots=True)
class _Running:
    """A running subscription. Its streams must be made again when ``signature`` changes."""

    request: ScopeStart
    signature: object
    streams: _Streams


class ScopeStreams:
    """All subscriptions of one connection. ``notify`` queues a text message to the page."""

    def __init__(
        self, bench: Bench, name: str, notify: Callable[[ToPage], None], send: SendBytes
    ) -> None:
        self._bench = bench
        self._name = name
        self._notify = notify
        self._send = send
        self._running: dict[int, _Running] = {}
        #: Requests run on a task of their own: ending a poll may wait for a mute drive,
        #: and STOP and jog must not.
        self._requests: asyncio.Queue[ScopeStart | ScopeStop | None] = asyncio.Queue(MOST_REQUESTS)
        #: Set when a block of any stream is waiting.
        self._ready = asyncio.Event()
        self._stuck = False
        self._changed = False

    def request(self, request: ScopeStart | ScopeStop) -> None:
        """Begin or end a subscription, in the order of the requests.

        Raises:
            Busy: too many requests are waiting.
        """
        try:
            self._requests.put_nowait(request)
        except asyncio.QueueFull as error:
            raise Busy(
                "api-live.scope-requests-wait-already",
                limit=str(MOST_REQUESTS),
                most_requests=MOST_REQUESTS,
            ) from error

    def bench_changed(self) -> None:
        """Make the streams again that depend on a changed drive or exchange."""
        if not self._changed:
            self._changed = True
            with contextlib.suppress(asyncio.QueueFull):  # a waiting request handles it as well
                self._requests.put_nowait(None)

    async def run(self) -> None:
        """Serve requests until cancelled; returns when the page accepts no more samples."""
        pump = asyncio.create_task(self._pump(), name=f"scope-{self._name}")
        try:
            while not self._stuck:
                request = await self._requests.get()
                if isinstance(request, ScopeStart):
                    await self._start(request)
                elif isinstance(request, ScopeStop):
                    await self._stop(request.subscription)
                if self._changed:
                    self._changed = False
                    await self._renew()
        finally:
            pump.cancel()

    async def close(self) -> None:
        """End all subscriptions; nothing more is sent, however long the ends take."""
        for subscription in list(self._running):
            await self._stop(subscription)

    # --- subscriptions ----------------------------------------------------------------

    async def _start(self, request: ScopeStart) -> None:
        await self._stop(request.subscription)
        if len(self._running) >= MOST_SUBSCRIPTIONS:
            self._refuse(
                request,
                Busy(
                    "api-live.subscriptions-most-page",
                    limit=str(MOST_SUBSCRIPTIONS),
                    most_subscriptions=MOST_SUBSCRIPTIONS,
                ),
            )
            return
        signature = self._signature(request)
        try:
            streams = await self._subscribe(request)
        except DriveError as error:
            self._refuse(request, error)
            # It is tried again when the bench changes: the drive may come back.
            self._running[request.subscription] = _Running(request, signature, [])
            return
        try:
            described = await self._described(request, streams)
        except BaseException as error:
            # The page or a drive has gone in the meantime: nothing must be polled for it any more.
            for stream, _ in streams:
                await self._bench.scope.unsubscribe(stream)
            if not isinstance(error, DriveError):
                raise
            self._refuse(request, error)
            self._running[request.subscription] = _Running(request, signature, [])
            return
        self._notify(ScopeInfo(subscription=request.subscription, channels=described))
        for stream, _ in streams:
            stream.ready = self._ready
        self._running[request.subscription] = _Running(request, signature, streams)
        self._ready.set()

    def _refuse(self, request: ScopeStart, error: DriveError) -> None:
        problem = problem_of(error)
        self._notify(ScopeInfo(subscription=request.subscription, channels=[], problem=problem))

    async def _subscribe(self, request: ScopeStart) -> _Streams:
        columns: dict[str, list[int]] = {}
        for number, channel in enumerate(request.channels):
            columns.setdefault(channel.drive, []).append(number)
        streams: _Streams = []
        try:
            for drive, numbers in columns.items():
                keys = [request.channels[n].key for n in numbers]
                self._bench.connected(drive)
                for stream, places in self._bench.scope.subscribe(drive, keys, request.period_s):
                    streams.append((stream, tuple(numbers[place] for place in places)))
        except DriveError:
            for stream, _ in streams:
                await self._bench.scope.unsubscribe(stream)
            raise
        return streams

    def _signature(self, request: ScopeStart) -> object:
        """What the streams depend on: identity of the axis objects, and of their exchanges."""
        found: list[object] = []
        for channel in request.channels:
            connected = self._bench.connected_drives.get(channel.drive)
            session = connected.axis.session if connected is not None else None
            carried = (
                connected is not None
                and session is not None
                and session.carries(connected.drive, channel.key)
            )
            found.append((id(connected), id(session) if carried else 0))
        return found

    async def _renew(self) -> None:
        for running in list(self._running.values()):
            if self._signature(running.request) != running.signature:
                await self._start(running.request)

    async def _stop(self, subscription: int) -> None:
        running = self._running.pop(subscription, None)
        if running is None:
            return
        for stream, _ in running.streams:
            await self._bench.scope.unsubscribe(stream)

    async def _described(self, request: ScopeStart, streams: _Streams) -> list[ScopeChannelInfo]:
        carried = {n: stream for stream, numbers in streams for n in numbers}
        units = {drive: await self._units(drive) for drive in {c.drive for c in request.channels}}
        result = []
        for number, channel in enumerate(request.channels):
            drive = self._bench.connected(channel.drive).drive
            parameter = drive.parameter(channel.key)
            known = units[channel.drive]
            unit, factor = axis_scale(known, drive, parameter) if known else ("", None)
            result.append(
                ScopeChannelInfo(
                    drive=channel.drive,
                    key=parameter.key,
                    name=parameter.name,
                    unit=parameter.unit,
                    synchronous=carried[number].synchronous,
                    axis_unit=unit,
                    axis_factor=factor,
                    fault_bit=drive.fault_bit(parameter.key),
                )
            )
        return result

    async def _units(self, drive: str) -> AxisUnits | None:
        """Units of an axis; None if the gearing is unreadable: the drive's own unit is shown."""
        with contextlib.suppress(DriveError, TimeoutError):
            async with asyncio.timeout(UNITS_TIMEOUT_S):
                return await self._bench.connected(drive).axis.units()
        return None

    # --- samples ----------------------------------------------------------------------

    async def _pump(self) -> None:
        """Send the waiting blocks of all streams together: a frame costs more than its content."""
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            while True:
                await self._ready.wait()
                self._ready.clear()
                while frame := self._waiting():
                    try:
                        async with asyncio.timeout(SEND_TIMEOUT_S):
                            await self._send(frame)
                    except TimeoutError:
                        self._stuck = True
                        self.bench_changed()  # wakes `run`, which ends the connection
                        return
                    # A send that need not wait yields to no other task: without this line, all
                    # queued blocks would go to a broken line before any task is notified of it.
                    await asyncio.sleep(0)

    def _waiting(self) -> bytes:
        """Waiting blocks, oldest first within each stream; empty if there are none."""
        blocks: list[bytes] = []
        size = 0
        for subscription, running in self._running.items():
            count = len(running.request.channels)
            for place, (stream, numbers) in enumerate(running.streams):
                while stream.queue and size < FRAME_BYTES:
                    block = stream.queue.popleft()
                    blocks.append(encode_block(subscription, block, numbers, count, place))
                    size += len(blocks[-1])
        return b"".join(blocks)
