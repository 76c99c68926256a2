"""Every change of an axis asks who has control: a route or message that forgets fails here."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import get_args

import httpx
import pytest

from backend.api import live_messages as messages
from backend.api.app import make_app
from backend.bench import Bench
from tests.support.servo import URL, Servo, bench_with

#: Changes nothing on an axis, or must be possible for everyone; and why.
FREE = {
    "POST /stop": "everyone may stop",
    "POST /drives/{drive_id}/jobs/read_all": "reads only",
    "POST /drives/{drive_id}/notches/preview": "computes only",
    "POST /drives/{drive_id}/tune/candidates": "computes only",
    "POST /drives/{drive_id}/tune/predict": "computes only",
}
#: No axis in the path: files of the server, or what asks by itself (tested below).
ELSEWHERE = {
    "DELETE /buses": "only a bus that no drive uses",
    "DELETE /jobs/{job_id}": "cancelling a motion is a stop; other work of a drive asks",
    "POST /buses/cyclic": "asks for every drive of the bus",
    "DELETE /buses/cyclic": "asks for every drive of the bus",
    "POST /scan": "asks for every drive of the bus",
    "POST /drives": "asks for every drive of the bus",
    "POST /descriptions/from-drive": "looks at one station; moving drives refuse it",
    "POST /search-line": "only a bus that no drive uses can change its settings",
    "POST /ethercat/alias": "asks for the drive at the station",
    "POST /ethercat/counters/clear": "counters only",
}
FILES = ("/sets", "/library", "/descriptions", "/recordings", "/bundles", "/measurements")


@pytest.fixture
async def bench(tmp_path: Path) -> AsyncIterator[Bench]:
    bench, _ = await bench_with(Servo(), tmp_path)
    bench.leases.take("x", "somebody else", "Anna")
    yield bench
    await bench.close()


@pytest.fixture
async def http(bench: Bench) -> AsyncIterator[httpx.AsyncClient]:
    transport = httpx.ASGITransport(make_app(bench, hosts=frozenset({"test"})))
    async with httpx.AsyncClient(transport=transport, base_url="http://test/api/v1") as client:
        yield client


def changes(bench: Bench) -> list[tuple[str, str]]:
    paths = make_app(bench, hosts=frozenset()).openapi()["paths"]
    return [
        (method.upper(), path.removeprefix("/api/v1"))
        for path, operations in paths.items()
        for method in operations
        if method != "get"
    ]


async def test_every_change_of_a_drive_asks_for_control(
    bench: Bench, http: httpx.AsyncClient
) -> None:
    unguarded = []
    for method, path in changes(bench):
        if "{drive_id}" not in path or f"{method} {path}" in FREE:
            continue
        address = path.replace("{drive_id}", "x").replace("{key}", "2005:03")
        answer = await http.request(method, address.replace("{name}", "save"), json={})
        if answer.status_code != 409 or "has control" not in answer.json()["detail"]:
            unguarded.append(f"{method} {path}: {answer.status_code}")
    assert unguarded == []


async def test_every_other_change_is_known(bench: Bench) -> None:
    unknown = [
        f"{method} {path}"
        for method, path in changes(bench)
        if "{drive_id}" not in path
        and f"{method} {path}" not in FREE | ELSEWHERE
        and not path.startswith(FILES)
    ]
    assert unknown == [], "say here why it needs no control of an axis, or make it ask"


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [
        ("POST", "/scan", {"url": URL}),
        ("POST", "/drives", {"url": URL, "station": 2, "profile": "mms7"}),
        ("POST", "/buses/cyclic", {"url": URL}),
        ("DELETE", f"/buses/cyclic?url={URL}", {}),
    ],
)
async def test_what_touches_a_whole_bus_asks_for_its_drives(
    http: httpx.AsyncClient, method: str, path: str, body: dict[str, object]
) -> None:
    answer = await http.request(method, path, json=body)
    assert answer.status_code == 409, answer.text
    assert "has control" in answer.json()["detail"]


async def test_somebody_elses_load_cannot_be_cancelled(
    bench: Bench, http: httpx.AsyncClient
) -> None:
    async def forever(_progress: object) -> None:
        await asyncio.Event().wait()

    job = bench.jobs.start("load_set", "Load", forever, drive="x", motion=True, stoppable=False)
    assert (await http.delete(f"/jobs/{job.id}")).status_code == 409
    await http.post("/stop", json={})
    assert job.state == "running"
    await bench.jobs.cancel(job)


def test_every_message_of_the_page_is_known() -> None:
    """JogStart takes the lease; the others change no axis, or only stop it."""
    union = get_args(get_args(messages.FromPage)[0])
    known = (
        "WatchState WatchValues JogStart JogRenew JogStop StopAll LeaseTake ScopeStart ScopeStop "
        "Ping"
    )
    assert {kind.__name__ for kind in union} == set(known.split()), (
        "a new message: make it ask for control where it changes an axis, and name it here"
    )
