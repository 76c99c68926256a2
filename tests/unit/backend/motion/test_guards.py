"""What touches several axes asks who has control of each (one axis: tests/security)."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest

from backend.station.bench import Bench
from tests.support.servo import URL, Servo, bench_with


@pytest.fixture
async def bench(tmp_path: Path) -> AsyncIterator[Bench]:
    bench, _ = await bench_with(Servo(), tmp_path)
    bench.leases.take("x", "somebody else", "Anna")
    yield bench
    await bench.close()


@pytest.mark.long(keep=3)
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
