"""Start, supervision, killing and restart of the host process. Runs on the event loop."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import os
import socket
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from drivers.errors import DriveError, LinkLost, LinkTimeout, why_of
from drivers.ethercat.exchange.ring import Ring
from drivers.ethercat.process import protocol
from drivers.ethercat.process.channel import PipeServerEnd, ServerEnd, SocketServerEnd
from drivers.ethercat.process.ending import end_task
from drivers.ethercat.process.protocol import Message
from drivers.link import Progress
from drivers.texts.message import Text, text

_WATCH_S = 0.1
_RESTART_PAUSE_S = (0.2, 1.0, 3.0, 10.0)
_FAREWELL_S = 3.0
_PIPE_LIMIT = 1 << 20
"""Bytes of a child's messages buffered for the server before the child has to wait."""
START_S = 30.0
"""Time-out [s] for a child that hangs while starting; one that dies is detected at once. Loading
alone takes ten seconds on a busy computer, and a shorter time would restart it endlessly.
"""


class HostProcess:
    """One child; ``received`` receives its events, ``restarted`` the reason of every restart."""

    def __init__(
        self,
        interface: str,
        launcher: Sequence[str],
        received: Callable[[Message], None],
        restarted: Callable[[Text], None],
        options: Sequence[str] = (),
        *,
        raw_frames: bool = True,
    ) -> None:
        """Store the options. Without ``raw_frames`` the child inherits no descriptors."""
        self._options = tuple(options)
        self._raw_frames = raw_frames
        self._ring_file: Path | None = None
        self.restarts = 0
        self.why, self._opened = text("ethercat.process-not-opened"), False
        self.granted: tuple[Text, ...] = ()
        self.ring: Ring | None = None
        self._interface = interface
        self._launcher = tuple(launcher)
        self._received = received
        self._restarted = restarted
        self._process: asyncio.subprocess.Process | None = None
        self._channel: ServerEnd | None = None
        self._numbers = itertools.count(1)
        self._waiting: dict[int, tuple[asyncio.Future[Any], Progress | None]] = {}
        self._ready: asyncio.Future[None] | None = None
        self._care: asyncio.Task[None] | None = None
        self._outgoing = asyncio.Lock()
        self._wanted = False

    @property
    def running(self) -> bool:
        """Whether the child runs and has opened its interface."""
        return (
            self._process is not None
            and self._process.returncode is None
            and self._ready is not None
            and self._ready.done()
            and self._ready.exception() is None
        )

    @property
    def pid(self) -> int | None:
        """Process number of the child."""
        return None if self._process is None else self._process.pid

    async def start(self) -> None:
        """Start the child and wait until it has opened the interface.

        Raises:
            DriveError: why the interface could not be opened.
        """
        if self._wanted:
            return
        self._wanted = True
        try:
            await self._spawn()
        except BaseException:
            self._wanted = False
            await self._end(kill=True)
            raise
        self._care = asyncio.get_running_loop().create_task(self._look_after())

    async def stop(self) -> None:
        """End the child in an orderly way, by force after some seconds."""
        self._wanted = False
        try:
            if self._care is not None:
                await end_task(self._care)
        finally:
            # Also where the caller was cancelled meanwhile: the child would keep the interface.
            self._care = None
            await self._end(kill=False)
            self.why = text("ethercat.process-closed")

    async def call(
        self, message: Message, timeout_s: float, progress: Progress | None = None
    ) -> Any:
        """Send a request and wait for its reply.

        Raises:
            LinkLost: the child does not run, or ended meanwhile.
            LinkTimeout: no reply in time.
            ProtocolError: the request is too long.
            DriveError: the error that the child reports.
        """
        if not self.running or self._channel is None:
            raise LinkLost(
                "ethercat.ethercat-process-not-running", interface=self._interface, words=self.why
            )
        number = next(self._numbers)
        packed = protocol.pack(message | {"id": number})
        protocol.require_length(len(packed))
        future: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        self._waiting[number] = (future, progress)
        try:
            # A truncated message would corrupt those after it, a halt among them: when the caller
            # gives up waiting (STOP cancels a motion), the message is still sent completely.
            sending = asyncio.create_task(self._write(packed))
            sending.add_done_callback(_noticed)
            await asyncio.shield(sending)
            async with asyncio.timeout(timeout_s):
                return await future
        except TimeoutError:
            raise LinkTimeout(
                "ethercat.ethercat-process-not-answer", message=message["op"], timeout_s=timeout_s
            ) from None
        finally:
            self._waiting.pop(number, None)
            if future.done() and not future.cancelled():
                # Marks the error as retrieved: the caller already has this one, or the one that
                # prevented sending.
                future.exception()

    async def _spawn(self, timeout_s: float = START_S) -> None:
        loop = asyncio.get_running_loop()
        try:
            ours = await self._launch()
        except OSError as error:
            # No memory, file descriptor or process available: all of these may be temporary.
            raise LinkLost(
                "ethercat.ethercat-process-cannot-started",
                interface=self._interface,
                strerror=str(error.strerror or error),
            ) from error
        self._channel = ours
        self._ready = loop.create_future()
        self._reader = loop.create_task(self._read(ours))
        self.why = text("ethercat.process-starting")
        try:
            async with asyncio.timeout(timeout_s):
                await asyncio.shield(self._ready)
        except TimeoutError:
            raise LinkTimeout(
                "ethercat.ethercat-process-not-start",
                interface=self._interface,
                timeout_s=timeout_s,
            ) from None
        self.why, self._opened = text("ethercat.process-open"), True

    async def _launch(self) -> ServerEnd:
        """Start the child and return our end of its channel. Raises OSError after cleaning up."""
        return await (self._launch_inheriting() if self._raw_frames else self._launch_portably())

    async def _launch_portably(self) -> ServerEnd:
        """Use the child's standard input and output for messages, and a file for samples."""
        self._ring_file = path = Ring.create_file()
        self.ring = Ring.of_file(path)
        self._process = process = await asyncio.create_subprocess_exec(
            *self._launcher, sys.executable, "-m", "drivers.ethercat.process.host",
            self._interface, "--ring-file", str(path), "--library-frames", *self._options,
            env=_environment(), stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
            limit=_PIPE_LIMIT,
        )  # fmt: skip
        assert process.stdin is not None
        assert process.stdout is not None
        return PipeServerEnd(process.stdout, process.stdin)

    async def _launch_inheriting(self) -> ServerEnd:
        """Use a pair of sockets and a memory file, both inherited."""
        ours, theirs = socket.socketpair()
        try:
            with theirs:
                ring_fd = Ring.create()
                try:
                    self.ring = Ring(ring_fd)
                    self._process = await asyncio.create_subprocess_exec(
                        *self._launcher, sys.executable, "-m", "drivers.ethercat.process.host",
                        self._interface, "--control", str(theirs.fileno()),
                        "--ring", str(ring_fd), *self._options,
                        pass_fds=(theirs.fileno(), ring_fd), env=_environment(),
                        stdin=asyncio.subprocess.DEVNULL,
                    )  # fmt: skip
                finally:
                    os.close(ring_fd)
        except BaseException:
            ours.close()
            raise
        return SocketServerEnd(ours)

    async def _read(self, ours: ServerEnd) -> None:
        unpacker = protocol.Unpacker()
        while True:
            data = await ours.receive()
            if not data:
                self._gone(text("ethercat.ethercat-process-ended"))
                return
            try:
                for message in unpacker.feed(data):
                    self._take(message)
            except (DriveError, ValueError, KeyError, TypeError) as error:
                # The protocol is violated: the child is replaced.
                self._gone(text("ethercat.process-unreadable", cause=why_of(error)))
                if self._process is not None and self._process.returncode is None:
                    self._process.kill()
                return

    def _take(self, message: Message) -> None:
        number = message.get("id")
        if number is None:
            self._take_event(message)
            return
        future, progress = self._waiting.get(number, (None, None))
        if "progress" in message:
            if progress is not None:
                progress(message["progress"], Text.from_wire(message["text"]))
        elif future is None or future.done():
            return
        elif "error" in message:
            future.set_exception(protocol.error_from_wire(message["error"]))
        else:
            future.set_result(message["result"])

    def _take_event(self, message: Message) -> None:
        ready = self._ready
        if message["event"] == "ready":
            self.granted = tuple(Text.from_wire(note) for note in message["notes"])
            if ready is not None and not ready.done():
                ready.set_result(None)
        elif message["event"] == "failed":
            error = protocol.error_from_wire(message["error"])
            self.why, self._opened = error.text, False
            if ready is not None and not ready.done():
                ready.set_exception(error)
        else:
            self._received(message)

    def _gone(self, why: Text) -> None:
        self.why, self._opened = why, False
        lost = LinkLost(why, remedy="ethercat.started-again-by-itself")
        if self._ready is not None and not self._ready.done():
            self._ready.set_exception(lost)
        for future, _ in self._waiting.values():
            if not future.done():
                future.set_exception(LinkLost(why, remedy="ethercat.started-again-by-itself"))

    async def _write(self, data: bytes) -> None:
        ours = self._channel
        if ours is None:
            raise LinkLost(self.why)
        async with self._outgoing:
            try:
                await ours.send(data)
            except OSError as error:
                raise LinkLost("ethercat.ethercat-process-ended") from error

    async def _look_after(self) -> None:
        """Send keep-alives, and replace a child that died or hangs."""
        while True:
            await asyncio.sleep(_WATCH_S)
            ring, process = self.ring, self._process
            if ring is None or process is None:
                continue
            now = time.monotonic_ns()
            ring.server_lives(now)
            if process.returncode is not None:
                await self._replace(text("event.process-died", status=process.returncode))
            elif 0 < ring.host_deadline_ns() < now:
                doing = ring.host_doing() or "ethercat.doing-frames"
                await self._replace(text("event.process-hung", doing=text(doing)))

    async def _replace(self, why: Text) -> None:
        self.restarts += 1
        self._restarted(text("event.process-started-again", cause=why))
        await self._end(kill=True)
        for pause_s in itertools.chain(_RESTART_PAUSE_S, itertools.repeat(_RESTART_PAUSE_S[-1])):
            await asyncio.sleep(pause_s)
            try:
                await self._spawn()
            except DriveError as error:
                await self._end(kill=True)
                self.why = error.text
                continue
            self._received(
                {
                    "event": "link",
                    "kind": "back",
                    "station": None,
                    "code": None,
                    "text": text("event.process-runs-again").to_wire(),
                }
            )
            return

    async def _end(self, *, kill: bool) -> None:
        process, self._process = self._process, None
        if self._channel is not None:
            # Closing the channel makes the child brake its axes and end.
            self._hang_up()
        if process is not None and process.returncode is None:
            if kill:
                process.kill()
            try:
                async with asyncio.timeout(_FAREWELL_S):
                    await process.wait()
            except TimeoutError:
                process.kill()
                await process.wait()
        self._gone(text("ethercat.process-ended") if self._opened else self.why)
        if self._ready is not None and self._ready.done() and not self._ready.cancelled():
            self._ready.exception()
        self._ready = None
        self._close_ring()

    def _hang_up(self) -> None:
        assert self._channel is not None
        self._reader.cancel()
        self._channel.close()
        self._channel = None

    def _close_ring(self) -> None:
        ring, self.ring = self.ring, None
        if ring is not None:
            ring.close()
        path, self._ring_file = self._ring_file, None
        if path is not None:
            # Windows cannot remove a file that a reader still uses; it is a temporary one.
            with contextlib.suppress(OSError):
                path.unlink()


def _noticed(sending: asyncio.Task[None]) -> None:
    """Retrieve the error: a waiting caller gets it anyway, and without one it does not matter."""
    if not sending.cancelled():
        sending.exception()


def _environment() -> dict[str, str]:
    root = str(Path(__file__).resolve().parents[3])
    path = os.environ.get("PYTHONPATH")
    return {**os.environ, "PYTHONPATH": f"{root}{os.pathsep}{path}" if path else root}
