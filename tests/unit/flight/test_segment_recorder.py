"""The server's side of the recorder process."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import struct

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
