"""Live connection of one page: states, values, jobs, samples out; watch, jog, STOP in.

Each connection has one sender task. States coalesce (only the newest of each drive is kept);
samples never do: they wait in their subscription's bounded queue, which counts dropped ones.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from datetime import UTC, datetime
from functools import partial

from fastapi import WebSocket, WebSocketDisconnect
from pydantic import ValidationError
from starlette.websockets import WebSocketState

import backend
from backend.api.drive.convert_stop import stop_result
from backend.api.live import news as live_news
from backend.api.live.jog import Jogs
from backend.api.live.messages import (
    DriveRequest,
    Hello,
    JogRenew,
    JogStart,
    JogStop,
    LeaseTake,
    Ping,
    Pong,
    Refused,
    ScopeStart,
    ScopeStop,
    StopAll,
    StopReached,
    StopTaken,
    ToPage,
    WatchState,
    WatchValues,
    from_page,
)
from backend.api.live.people import PeopleLive
from backend.api.live.people_messages import PeopleRequest
from backend.api.live.scope import ScopeStreams
from backend.api.live.shared import Shared, only
from backend.api.messages.errors import message_of, problem_of, words_of
from backend.api.security.messages import require_message
from backend.foundation.people.identity import Actor, Identity, acting, arrived_s
from backend.foundation.people.station import People
from backend.records.audit.asked import Asked, asked
from backend.station.bench import Bench
from backend.tools.moving.jog.release import end_of_jog
from drivers.errors import DriveError
from drivers.texts.message import Text, text
from drivers.texts.validation import reason_of

#: Limit of messages that wait for a slow page; states, values and drive lists
#: coalesce and are not counted.
QUEUE = 500
#: A connection that has not accepted a message for this long [s] is closed.
SEND_TIMEOUT_S = 10.0


class Connection:
    """The live connection of one page."""

    def __init__(
        self,
        name: str,
        socket: WebSocket,
        bench: Bench,
        people: PeopleLive,
        known: People,
        identity: Identity,
    ) -> None:
        self.id = name
        self.identity = identity
        self.page = ""
        self.since = datetime.now(UTC)
        self.heard = time.monotonic()
        self.watched: set[str] = set()
        self._people, self._known = people, known
        self._socket = socket
        self._bench = bench
        self._queue: asyncio.Queue[Shared] = asyncio.Queue(QUEUE)
        self._latest: dict[tuple[str, str], Shared] = {}
        self._values: dict[str, tuple[frozenset[str], Shared]] = {}
        self._wake = asyncio.Event()
        self.jogs = Jogs(bench, name, self.send)
        self.scopes = ScopeStreams(bench, name, self.send, socket.send_bytes)
        self._polls: dict[str, asyncio.Task[None]] = {}
        self._stops: set[asyncio.Task[None]] = set()
        self._overflow = False

    async def run(self) -> None:
        """Serve the connection until the page is gone."""
        self.send(Hello(connection=self.id, version=backend.__version__))
        self.later("drives", "", self.drive_list())
        self._people.changed()
        sender = asyncio.create_task(self._sender(), name=f"live-{self.id}")
        receiver = asyncio.create_task(self._receiver(), name=f"hear-{self.id}")
        scoper = asyncio.create_task(self.scopes.run(), name=f"scopes-{self.id}")
        tasks = (sender, receiver, scoper)
        done, pending = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        # Before any waiting: from now on nobody holds a button on this page.
        self.release(None, text("work.page-gone"))
        for task in pending:
            task.cancel()
        await asyncio.wait(tasks)
        for task in done:
            error = None if task.cancelled() else task.exception()
            # A page may go in the middle of a message, or sleep so long that its messages time out;
            # both are ordinary ends. Samples and texts are sent concurrently: one of them finds the
            # line closed, the other finds it marked as closed.
            known_closed = self._socket.application_state is WebSocketState.DISCONNECTED
            if isinstance(error, RuntimeError) and known_closed:
                continue
            if error is not None and not isinstance(error, (WebSocketDisconnect, TimeoutError)):
                raise error

    async def close(self) -> None:
        """Release everything that depends on this connection; a jog ends at once."""
        self.release(None, text("work.page-gone"))
        for drive in self.watched:
            if (connected := self._bench.connected_drives.get(drive)) is not None:
                connected.monitor.watchers.discard(self.id)
        self.watched = set()
        for task in (*self._polls.values(), *self._stops):
            task.cancel()
        await self.scopes.close()

    def release(self, drive: str | None, reason: Text) -> None:
        """End jogs of this page: of one axis, or of all."""
        self.jogs.release(drive, reason)

    # --- out --------------------------------------------------------------------------

    def send(self, message: ToPage | Shared) -> None:
        """Queue a message that must not be lost; a page that never reads is disconnected."""
        try:
            self._queue.put_nowait(message if isinstance(message, Shared) else only(message))
        except asyncio.QueueFull:
            self._overflow = True
        self._wake.set()

    def later(self, kind: str, which: str, message: Shared) -> None:
        """Send the newest state of something; older ones not yet sent are replaced."""
        self._latest[kind, which] = message
        self._wake.set()

    def fresh_values(self, drive: str, keys: frozenset[str], values: Shared) -> None:
        """Send new readings of a drive; only the newest of each parameter is sent."""
        waiting = self._values.get(drive)
        if waiting is not None and not waiting[0] <= keys:
            keys |= waiting[0]
            values = Shared(partial(live_news.values, self._bench, drive, keys))
        self._values[drive] = keys, values
        self._wake.set()

    def drive_list(self) -> Shared:
        """The list of drives as seen from this connection."""
        return Shared(partial(live_news.drive_list, self._bench, self.id))

    async def _sender(self) -> None:
        while not self._overflow:
            await self._wake.wait()
            self._wake.clear()
            while not self._queue.empty():
                await self._text(self._queue.get_nowait())
            latest, self._latest = self._latest, {}
            for message in latest.values():
                await self._text(message)
            values, self._values = self._values, {}
            for _, message in values.values():
                await self._text(message)
            # States need not arrive faster than a screen can show them.
            await asyncio.sleep(0.03)
        await self._socket.close(code=1013, reason="the page does not read")

    async def _text(self, message: Shared) -> None:
        if (text := message.text) is not None:
            async with asyncio.timeout(SEND_TIMEOUT_S):
                await self._socket.send_text(text)

    # --- in ---------------------------------------------------------------------------

    async def _receiver(self) -> None:
        with contextlib.suppress(WebSocketDisconnect):
            while True:
                message = await self._socket.receive()
                if message["type"] == "websocket.disconnect":
                    return
                text = message.get("text")
                # A page counts as not silent while its request is being carried out.
                self.heard = math.inf
                arrived_s.set(time.monotonic())
                await self._handle(text if isinstance(text, str) else "")
                self.heard = time.monotonic()

    async def _handle(self, text: str) -> None:
        try:
            request = from_page.validate_json(text)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            problem = DriveError("api-live.not-message-interface", first=reason_of(first))
            self.send(Refused(request="?", problem=problem_of(problem)))
            return
        try:
            self.identity = self._known.admit(self.identity, request.type)
            acting.set(Actor(self.identity, self.id))
            asked.set(Asked(request.model_dump))
            require_message(self._known, self.identity, request)
            if isinstance(request, PeopleRequest):
                await self._people.act(self, self.identity, request)
            else:
                await self._act(request)
        except DriveError as error:
            self.send(Refused(request=request.type, problem=problem_of(error)))

    async def _act(self, request: DriveRequest) -> None:
        match request:
            case StopAll():
                await self._stop(request)
            case JogRenew():
                self.jogs.renew(request)
            case JogStop():
                self.jogs.release(request.drive, end_of_jog(request.reason), request.press)
            case JogStart():
                self.jogs.start(request, self.identity.person)
            case WatchState():
                self._watch(set(request.drives))
            case WatchValues():
                self._watch_values(request)
            case LeaseTake():
                self._lease(request)
            case ScopeStart() | ScopeStop():
                self.scopes.request(request)
            case Ping():
                self.send(Pong(n=request.n))

    async def _stop(self, request: StopAll) -> None:
        drives = [request.drive] if request.drive else list(self._bench.connected_drives)
        known = [drive for drive in drives if drive in self._bench.connected_drives]
        problems = await self._bench.motion.stop(known)
        self._bench.journal.add(text("station.stop-pressed"), level="warning", drive=request.drive)
        failed = {drive: why for drive, why in problems.items() if why is not None}
        # On a machine with two axes, the other one is stopped as well.
        stopped = list(problems)
        taken = StopTaken(
            press=request.press,
            drives=stopped,
            problems={drive: words_of(why) for drive, why in failed.items()},
            problem_messages={drive: message_of(why) for drive, why in failed.items()},
        )
        self.send(taken)
        for drive, why in failed.items():
            failure = DriveError("api-live.stop-not-reach", drive=drive, text=why)
            self.send(Refused(request="stop", problem=problem_of(failure)))
        # The connection keeps receiving in the meantime: STOP may be pressed again.
        task = asyncio.create_task(
            self._stopped(request.press, drives, stopped), name=f"stop-answer-{self.id}"
        )
        self._stops.add(task)
        task.add_done_callback(self._stops.discard)

    async def _stopped(self, press: int | None, drives: list[str], stopped: list[str]) -> None:
        found = await self._bench.motion.standstill(stopped)
        result = stop_result(self._bench, drives, found)
        self.send(StopReached(press=press, result=result))

    def _lease(self, request: LeaseTake) -> None:
        self._bench.connected(request.drive)
        if request.take:
            self._bench.leases.take(request.drive, self.id, self.identity.person)
            return
        self.jogs.release(request.drive, text("jog.end-control-given-back"))
        self._bench.leases.give(request.drive, self.id)

    def _watch(self, drives: set[str]) -> None:
        for drive in drives | self.watched:
            if (connected := self._bench.connected_drives.get(drive)) is None:
                continue
            # A drive that was removed and added again is a new object with the same name.
            watchers = connected.monitor.watchers
            if (self.id in watchers) is not (drive in drives):
                watchers ^= {self.id}
                connected.monitor.hurry()
        self.watched = {drive for drive in drives if drive in self._bench.connected_drives}

    def _watch_values(self, request: WatchValues) -> None:
        drive = self._bench.connected(request.drive).drive
        for key in request.keys:
            drive.parameter(key)
        if (old := self._polls.pop(request.drive, None)) is not None:
            old.cancel()
        if request.keys:
            self._polls[request.drive] = asyncio.create_task(
                self._poll(request), name=f"watch-{self.id}-{request.drive}"
            )

    async def _poll(self, request: WatchValues) -> None:
        while (connected := self._bench.connected_drives.get(request.drive)) is not None:
            # The monitor shows a lost link; polling continues until the drive is back.
            with contextlib.suppress(DriveError):
                await connected.drive.read_many(request.keys)
            await asyncio.sleep(request.period_s)
