"""The server's side of the recorder process."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import struct
import sys

from drivers.flight.segment import SegmentRecorder


async def test_a_request_that_nobody_waits_for_any_more_does_not_spoil_the_next() -> None:
    """The page was left during a download: the next file began in the middle of that one."""
    ours, theirs = socket.socketpair()
    reader, writer = await asyncio.open_connection(sock=theirs)
    recorder = SegmentRecorder("eth9", ())
    recorder._streams = await asyncio.open_connection(sock=ours)
    half = asyncio.Event()

    async def recording() -> None:
        for number in range(2):
            assert json.loads(await reader.readline())["station"] == number
            data = bytes([number]) * 100
            writer.write(struct.pack("<Q", len(data)) + data[:50])
            await writer.drain()
            half.set()
            await asyncio.sleep(0.05)
            writer.write(data[50:])

    process = asyncio.create_task(recording())
    first = asyncio.create_task(recorder.file(0))
    await half.wait()
    await asyncio.sleep(0)
    first.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await first
    assert first.cancelled()
    async with asyncio.timeout(5):
        assert await recorder.file(1) == bytes([1]) * 100
    await process
    await recorder.stop()
    writer.close()


async def test_a_start_that_is_cancelled_leaves_no_process() -> None:
    """The recorder ran on until the server ended when a page was left during the connection."""
    silent = "import os, sys; os.read(int(sys.argv[-1]), 1)"
    recorder = SegmentRecorder("eth9", [sys.executable, "-c", silent])
    starting = asyncio.create_task(recorder.start())
    async with asyncio.timeout(10):
        while recorder._streams is None:  # noqa: ASYNC110 - nothing reports it
            await asyncio.sleep(0)
    process = recorder._process
    assert process is not None
    starting.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await starting
    assert starting.cancelled()
    assert process.returncode is not None
    assert recorder._streams is None


async def test_the_end_leaves_nothing_to_the_event_loop() -> None:
    """A connection that closes later is an error where the loop ends first."""
    recorder = SegmentRecorder("eth9", ())
    ours, theirs = socket.socketpair()
    with theirs:
        recorder._streams = reader, writer = await asyncio.open_connection(sock=ours)
        await recorder.stop()
        assert writer.is_closing()
        assert reader.at_eof()
        assert ours.fileno() == -1
