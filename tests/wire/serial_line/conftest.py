from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Coroutine
from pathlib import Path

import pytest
import pytest_asyncio

from drivers.link import Link
from drivers.urls import link_for

OpenLink = Callable[[str], Coroutine[None, None, Link]]


@pytest.fixture
def port(tmp_path: Path) -> Path:
    """Where the test's wire is."""
    return tmp_path / "ttyV0"


@pytest_asyncio.fixture
async def opened() -> AsyncIterator[OpenLink]:
    """Opens links and closes them after the test."""
    links: list[Link] = []

    async def open_link(url: str) -> Link:
        link = link_for(url)
        links.append(link)
        await link.open()
        return link

    yield open_link
    for link in links:
        await link.close()
