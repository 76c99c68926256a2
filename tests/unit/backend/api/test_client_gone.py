"""A page that is closed while it sends a file: no error of the server, and nothing is kept."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest
from starlette.types import Message, Scope

from backend.api.app import make_app
from backend.station.bench import Bench


async def test_an_upload_that_breaks_off(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    bench = Bench(tmp_path / "state")
    app = make_app(bench, hosts=frozenset({"test"}))
    scope: Scope = {
        "type": "http",
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "method": "POST",
        "scheme": "http",
        "path": "/api/v1/descriptions",
        "raw_path": b"/api/v1/descriptions",
        "query_string": b"file=x.xml",
        "headers": [(b"host", b"test"), (b"content-type", b"application/octet-stream")],
        "client": ("127.0.0.1", 1),
        "server": ("test", 80),
        "root_path": "",
    }
    coming: list[Message] = [
        {"type": "http.request", "body": b"<EtherCATInfo>", "more_body": True},
        {"type": "http.disconnect"},
    ]
    sent: list[Message] = []

    async def receive() -> Message:
        return coming.pop(0) if coming else {"type": "http.disconnect"}

    async def send(message: Message) -> None:
        sent.append(message)

    await app(scope, receive, send)
    assert not [
        r for r in caplog.records if r.name.startswith("backend") and r.levelno >= logging.ERROR
    ], caplog.text
    assert "the client went within its request" in caplog.text
