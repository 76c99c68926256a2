"""The built page as the server hands it out."""

from __future__ import annotations

import asyncio
import gzip
from collections.abc import Callable
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI

from backend.api import app

Get = Callable[[str, str], httpx.Response]
SCRIPT = b"export const page = 1\n" * 100


@pytest.fixture
def page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Get:
    """Asks for a path with the packings that are understood."""
    assets = tmp_path / "assets"
    assets.mkdir()
    (tmp_path / "index.html").write_text("<!doctype html>", "utf-8")
    (assets / "a-1.js").write_bytes(SCRIPT)
    (assets / "a-1.js.gz").write_bytes(gzip.compress(SCRIPT))
    (assets / "b-1.css").write_bytes(b"body {}")
    monkeypatch.setattr(app, "_PAGE_FOLDERS", (tmp_path,))
    server = FastAPI()
    app._add_page(server)

    async def ask(path: str, packings: str) -> httpx.Response:
        wire = httpx.ASGITransport(server)
        async with httpx.AsyncClient(transport=wire, base_url="http://localhost") as client:
            return await client.get(path, headers={"Accept-Encoding": packings})

    return lambda path, packings: asyncio.run(ask(path, packings))


def test_a_browser_gets_the_packed_script(page: Get) -> None:
    answer = page("/assets/a-1.js", "gzip, br")
    assert answer.headers["content-encoding"] == "gzip"
    assert answer.headers["vary"] == "Accept-Encoding"
    assert "javascript" in answer.headers["content-type"]
    assert int(answer.headers["content-length"]) < len(SCRIPT) / 5
    assert answer.content == SCRIPT


def test_who_takes_nothing_packed_gets_it_plain(page: Get) -> None:
    answer = page("/assets/a-1.js", "identity")
    assert "content-encoding" not in answer.headers
    assert answer.content == SCRIPT


def test_what_was_not_packed_comes_as_it_is(page: Get) -> None:
    answer = page("/assets/b-1.css", "gzip")
    assert "content-encoding" not in answer.headers
    assert answer.headers["content-type"].startswith("text/css")
