"""Server side of the recorder process of an EtherCAT segment: start, requests and end."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import struct
import sys
import time
from collections.abc import Sequence

from drivers.errors import LinkLost
from drivers.flight.process import READY

_LENGTH = struct.Struct("<Q")
_FILE_S, _START_S, _END_S = 30.0, 10.0, 2.0


class SegmentRecorder:
    """Starts and ends with the link, which also works without it."""

    def __init__(self, interface: str, launcher: Sequence[str]) -> None:
        self._interface = interface
        self._launcher = tuple(launcher)
        self._process: asyncio.subprocess.Process | None = None
        self._streams: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None
        self._asking = asyncio.Lock()

    @property
    def process_id(self) -> int | None:
        """Process number of the recorder; None if it does not run."""
        return None if self._process is None else self._process.pid

    async def start(self) -> None:
        """Start recording before any further frame. Without effect while a process records.

        If the process cannot be started, nothing is recorded.
        """
        if self._process is not None:
            return
        ours, theirs = socket.socketpair()
        try:
            with theirs:
                self._process = await asyncio.create_subprocess_exec(
                    *self._launcher, sys.executable, "-m", "drivers.flight.process",
                    self._interface, "--control", str(theirs.fileno()),
                    pass_fds=(theirs.fileno(),), stdin=asyncio.subprocess.DEVNULL,
                )  # fmt: skip
            self._streams = await asyncio.open_connection(sock=ours)
            async with asyncio.timeout(_START_S):
                await self._streams[0].readexactly(len(READY))
        except BaseException as error:
            # Also where the caller was cancelled: the process would record for nobody.
            if self._streams is None:
                ours.close()
            await asyncio.shield(self.stop())
            if not isinstance(error, (OSError, asyncio.IncompleteReadError)):
                raise

    def note(self, text: str, station: int | None = None) -> None:
        """Add an annotation for the next frame."""
        message = {"note": text, "station": station, "time_ns": time.time_ns()}
        if self._streams is not None and not self._streams[1].is_closing():
            self._streams[1].write(json.dumps(message).encode() + b"\n")

    async def file(self, station: int | None = None) -> bytes:
        """Return the last minute as a pcapng file.

        Raises:
            LinkLost: the recorder does not run.
        """
        # An answer is always read to its end: what is left of it would be taken for the next one.
        return await asyncio.shield(asyncio.create_task(self._file(station)))

    async def _file(self, station: int | None) -> bytes:
        async with self._asking:
            if self._streams is None:
                raise self._gone()
            reader, writer = self._streams
            try:
                writer.write(json.dumps({"file": True, "station": station}).encode() + b"\n")
                async with asyncio.timeout(_FILE_S):
                    (size,) = _LENGTH.unpack(await reader.readexactly(_LENGTH.size))
                    return await reader.readexactly(size)
            except (OSError, asyncio.IncompleteReadError, TimeoutError) as error:
                writer.close()
                self._streams = None
                raise self._gone() from error

    async def stop(self) -> None:
        """End the recorder. Further calls have no effect."""
        streams, self._streams = self._streams, None
        if streams is not None:
            streams[1].close()
        process, self._process = self._process, None
        if process is not None:
            try:
                async with asyncio.timeout(_END_S):
                    await process.wait()
            except TimeoutError:
                with contextlib.suppress(ProcessLookupError):
                    process.kill()
                await process.wait()
        if streams is not None:
            # Afterwards: what was not sent yet is discarded only when the other end is gone.
            with contextlib.suppress(OSError):
                await streams[1].wait_closed()

    def _gone(self) -> LinkLost:
        return LinkLost("link.frames-not-being-recorded", interface=self._interface)
