"""A second double click: the page of the server that runs, never a second server."""

from __future__ import annotations

import asyncio
import socket
from pathlib import Path
from types import SimpleNamespace

import pytest

from backend.commands import serve as serving_module
from backend.commands.serve import Serving, serve
from backend.station.bench import Bench
from drivers.computer import sockets
from drivers.errors import Busy


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    pages: list[str] = []
    monkeypatch.setattr(serving_module.webbrowser, "open", pages.append)

    async def nothing() -> None:
        """Libraries that the server loads after its start are not needed here."""

    monkeypatch.setattr(serving_module, "settle", nothing)
    return pages


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


async def _started_twice(folder: Path, port: int, *, open_page: bool) -> None:
    answers = asyncio.Event()

    async def ready() -> None:
        answers.set()

    running = asyncio.create_task(serve(Bench(folder), Serving(port=port), ready))
    try:
        waiting = asyncio.create_task(answers.wait())
        await asyncio.wait({waiting, running}, return_when=asyncio.FIRST_COMPLETED)
        await serve(Bench(folder), Serving(port=port, open_page=open_page))
    finally:
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)


def test_the_page_of_the_running_server_is_opened(
    tmp_path: Path, opened: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    port = free_port()
    asyncio.run(_started_twice(tmp_path, port, open_page=True))
    assert opened == [f"http://localhost:{port}/"]
    assert "runs already" in capsys.readouterr().out


def test_without_a_page_to_open_it_is_an_error(tmp_path: Path, opened: list[str]) -> None:
    with pytest.raises(Busy):
        asyncio.run(_started_twice(tmp_path, free_port(), open_page=False))
    assert opened == []


def test_another_program_on_the_port_is_not_taken_for_it(tmp_path: Path, opened: list[str]) -> None:
    async def other() -> None:
        async def answer(_reader: object, writer: asyncio.StreamWriter) -> None:
            writer.write(b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\n{}")
            writer.close()

        server = await asyncio.start_server(answer, "127.0.0.1", 0)
        port = server.sockets[0].getsockname()[1]
        held = Bench(tmp_path)
        held.records.claim()
        try:
            await serve(Bench(tmp_path), Serving(port=port, open_page=True))
        finally:
            held.records.release()
            server.close()

    with pytest.raises(Busy):
        asyncio.run(other())
    assert opened == []


def test_a_port_is_never_shared_with_another_program(monkeypatch: pytest.MonkeyPatch) -> None:
    """On Windows SO_REUSEADDR would let two programs listen on one port."""
    asked: list[int] = []
    listening = SimpleNamespace(setsockopt=lambda _level, option, _value: asked.append(option))
    sockets.take_port_alone(listening)  # type: ignore[arg-type]
    assert asked == [socket.SO_REUSEADDR]
    exclusive = -5  # winsock2.h: ~SO_REUSEADDR
    monkeypatch.setattr(sockets.socket, "SO_EXCLUSIVEADDRUSE", exclusive, raising=False)
    monkeypatch.setattr(sockets, "sys", SimpleNamespace(platform="win32"))
    sockets.take_port_alone(listening)  # type: ignore[arg-type]
    assert asked == [socket.SO_REUSEADDR, exclusive]
