"""The parent's side of the EtherCAT process, with the child's end of the pipe in hand."""

from __future__ import annotations

import asyncio
import errno
import os
import socket
from pathlib import Path
from types import SimpleNamespace

import pytest

from drivers.errors import LinkLost, LinkTimeout
from drivers.ethercat.exchange.ring import Ring
from drivers.ethercat.process import protocol
from drivers.ethercat.process.channel import ServerEnd, SocketServerEnd
from drivers.ethercat.process.hostprocess import HostProcess


def host() -> HostProcess:
    return HostProcess("eth9", (), lambda _message: None, lambda _why: None)


def descriptors() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


async def connected(process: HostProcess) -> socket.socket:
    """As if a child ran; returns its end."""
    ours, theirs = socket.socketpair()
    ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
    ours.setblocking(False)
    theirs.setblocking(False)
    process._channel = SocketServerEnd(ours)
    process._process = SimpleNamespace(returncode=None, pid=0)  # type: ignore[assignment]
    process._ready = asyncio.get_running_loop().create_future()
    process._ready.set_result(None)
    return theirs


async def test_a_halt_comes_whole_after_a_motion_that_was_cancelled_while_it_was_sent() -> None:
    """STOP cancels a motion while its long trajectory goes into a full pipe, then sends the halt.

    What is left of a cut-off message would swallow the halt.
    """
    process = host()
    child = await connected(process)
    trajectory = {"op": "play", "trajectories": [{"values": bytes(1_000_000)}]}
    play = asyncio.create_task(process.call(trajectory, 5.0))
    await asyncio.sleep(0.01)
    play.cancel()
    await asyncio.wait([play])
    assert play.cancelled()
    halt = asyncio.create_task(process.call({"op": "halt", "station": 1}, 5.0))
    unpacker = protocol.Unpacker()
    got: list[protocol.Message] = []
    async with asyncio.timeout(60):
        while not any(message["op"] == "halt" for message in got):
            data = await asyncio.get_running_loop().sock_recv(child, 1 << 16)
            got += unpacker.feed(data)
    assert [message["op"] for message in got] == ["play", "halt"]
    halt.cancel()
    await asyncio.wait([halt])
    child.close()
    assert process._channel is not None
    process._channel.close()


async def test_a_process_that_cannot_be_started_is_a_lost_link_and_leaves_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Too many open files, no memory: whoever looks after it tries again, and must not die of it.

    Its file descriptors are counted before and after: there will be many tries.
    """

    def full() -> int:
        raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))

    monkeypatch.setattr(Ring, "create", staticmethod(full))
    before = descriptors()
    for _ in range(3):
        with pytest.raises(LinkLost, match=r"eth9 cannot be started: Too many open files"):
            await host()._spawn(1.0)
    assert descriptors() == before


async def test_a_process_that_is_slow_to_start_is_waited_for_and_one_that_hangs_is_reported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A restart that gave up while the child was still loading would begin again for ever."""
    process = host()
    ends: list[ServerEnd | socket.socket] = []
    children: list[socket.socket] = []

    async def launched() -> ServerEnd:
        child = await connected(process)
        assert process._channel is not None
        ends.extend((process._channel, child))
        children.append(child)
        return process._channel

    async def over() -> None:
        assert process._reader is not None
        process._reader.cancel()
        await asyncio.wait([process._reader])
        for end in ends:
            end.close()

    monkeypatch.setattr(process, "_launch", launched)
    with pytest.raises(LinkTimeout, match=r"did not start within 0\.01 s") as caught:
        await process._spawn(0.01)
    assert "keep this computer busy" in (caught.value.remedy or "")
    await over()
    starting = asyncio.create_task(process._spawn())
    await asyncio.sleep(0.05)
    assert not starting.done()
    ready = protocol.pack({"event": "ready", "fifo": 0, "notes": []})
    await asyncio.get_running_loop().sock_sendall(children[-1], ready)
    await starting
    await over()


def test_a_ring_that_gets_no_memory_leaves_no_descriptor(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_descriptor: int, _size: int) -> None:
        raise OSError(errno.EFBIG, os.strerror(errno.EFBIG))

    before = descriptors()
    monkeypatch.setattr(os, "ftruncate", full)
    with pytest.raises(OSError, match="File too large"):
        Ring.create()
    assert descriptors() == before


async def test_a_request_that_could_not_be_sent_leaves_no_error_that_nobody_takes() -> None:
    """The process dies while a request waits for room in its pipe: it was reported twice."""
    process = host()
    child = await connected(process)
    load = {"op": "play", "trajectories": [{"values": bytes(1_000_000)}]}
    asking = asyncio.create_task(process.call(load, 5.0))
    await asyncio.sleep(0.01)
    ((answer, _progress),) = process._waiting.values()
    process._gone("the EtherCAT process ended")
    child.close()
    with pytest.raises(LinkLost, match="ended"):
        await asking
    # What asyncio looks at when it says that an exception was never retrieved.
    assert answer.done()
    assert not answer._log_traceback
    assert process._channel is not None
    process._channel.close()
