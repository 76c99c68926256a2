"""A second double click: the page of the server that runs, never a second server."""

from __future__ import annotations

import asyncio
import socket
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace

import pytest

from backend.api.station.models import Health
from backend.commands.server import serve as serving_module
from backend.commands.server.serve import Serving, serve
from backend.station.bench import Bench
from drivers.computer.network import sockets
from drivers.errors import Busy

HEALTH = Health(version="0.2.0", time=datetime.now(UTC), demo=False, tour=False).model_dump_json()


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    pages: list[str] = []
    monkeypatch.setattr(serving_module.webbrowser, "open", pages.append)
    return pages


def started_beside(folder: Path, answer: str, *, open_page: bool = True) -> int:
    """Start while another server has the folder, and its port gives this answer; the port."""

    async def work() -> int:
        async def reply(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            asked = await reader.readline()
            assert asked.startswith(b"GET /api/v1/health ")
            head = f"HTTP/1.1 200 OK\r\nContent-Length: {len(answer)}\r\nConnection: close\r\n\r\n"
            writer.write((head + answer).encode())
            await writer.drain()
            writer.close()

        server = await asyncio.start_server(reply, "127.0.0.1", 0)
        port = int(server.sockets[0].getsockname()[1])
        running = Bench(folder)
        running.records.claim()
        try:
            await serve(Bench(folder), Serving(port=port, open_page=open_page))
        finally:
            running.records.release()
            server.close()
        return port

    return asyncio.run(work())


def test_the_page_of_the_running_server_is_opened(
    tmp_path: Path, opened: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    port = started_beside(tmp_path, HEALTH)
    assert opened == [f"http://localhost:{port}/"]
    assert "runs already" in capsys.readouterr().out


def test_without_a_page_to_open_it_is_an_error(tmp_path: Path, opened: list[str]) -> None:
    with pytest.raises(Busy):
        started_beside(tmp_path, HEALTH, open_page=False)
    assert opened == []


@pytest.mark.parametrize("answer", ["{}", "", "<html></html>"])
def test_another_program_on_the_port_is_not_taken_for_it(
    tmp_path: Path, opened: list[str], answer: str
) -> None:
    with pytest.raises(Busy):
        started_beside(tmp_path, answer)
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
