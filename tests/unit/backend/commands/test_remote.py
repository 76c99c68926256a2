"""The command line next to a running server: which buses it asks it about, and what it records."""

from __future__ import annotations

import asyncio
import io

import httpx
import numpy as np
import pytest

from backend.api.live.messages import ScopeChannelInfo, ScopeInfo
from backend.api.live.scope_blocks import encode_block
from backend.commands.base.options import DEFAULT_SERVER, server_for
from backend.commands.base.remote import Remote
from backend.commands.drive.live import Recording
from backend.commands.drive.samples import Samples, decode
from drivers.errors import OutOfRange, ProtocolError
from drivers.link import ScopeBlock
from drivers.texts.message import prose


@pytest.mark.parametrize(
    ("url", "named", "asked"),
    [
        ("ethercat://virtual0", None, DEFAULT_SERVER),
        ("mlink://virtual1", None, DEFAULT_SERVER),
        ("ethercat://eth0", None, None),
        ("mlink:///dev/ttyUSB0", None, None),
        ("ethercat://eth0", "http://station:8420", "http://station:8420"),
        ("ethercat://virtual0", "http://station:8420", "http://station:8420"),
    ],
)
def test_virtual_buses_are_those_of_the_server(
    url: str, named: str | None, asked: str | None
) -> None:
    assert server_for(url, named) == asked


def test_what_is_no_bus_is_asked_of_nobody() -> None:
    with pytest.raises(OutOfRange, match="not a bus URL"):
        server_for("eth0", None)


def test_blocks_are_taken_apart() -> None:
    values = np.array([[1.0, 2.0**31 - 1], [np.nan, 2.0**31]])
    block = ScopeBlock(0, 5.0, 0.25, ("a", "b"), values, dropped=3)
    (found, again) = decode(encode_block(1, block, (0, 2), 3) * 2)
    assert again.values.shape == (2, 3)
    assert found.times_s.tolist() == [5.0, 5.25]
    assert found.dropped == 3
    assert found.values[:, 2].tolist() == [2.0**31 - 1, 2.0**31]
    assert np.isnan(found.values[1, 0])
    assert np.isnan(found.values[:, 1]).all()


@pytest.mark.parametrize("frame", [b"", b"x" * 60, b"SCKB" + bytes(10)])
def test_what_is_no_block_is_reported(frame: bytes) -> None:
    with pytest.raises(ProtocolError, match="not a scope block"):
        decode(frame)


def test_samples_of_one_moment_make_one_row_whatever_comes_first() -> None:
    file = io.StringIO()
    recorded = Recording(file, {"x": "X", "y": "Y"})
    nan = float("nan")
    recorded.add(Samples(np.array([7.0, 7.001]), np.array([[1.0, nan], [2.0, nan]]), 0))
    info = [
        ScopeChannelInfo(drive=d, key="6064:00", name="Position", unit=u, synchronous=True)
        for d, u in (("x", "inc"), ("y", ""))
    ]
    recorded.head(ScopeInfo(subscription=1, channels=info))
    recorded.add(Samples(np.array([7.001, 7.002]), np.array([[nan, 8.0], [nan, 9.0]]), 4))
    recorded.end()
    assert file.getvalue().splitlines() == [
        'time [s],"X 6064:00 Position [inc]","Y 6064:00 Position"',
        "0.000000,1,",
        "0.001000,2,8",
        "0.002000,,9",
    ]
    assert (recorded.rows, recorded.dropped) == (3, 4)


async def test_a_job_that_was_only_just_started_is_cancelled_with_the_command() -> None:
    asked: list[tuple[str, str]] = []
    begun, going_on = asyncio.Event(), asyncio.Event()

    async def answer(request: httpx.Request) -> httpx.Response:
        asked.append((request.method, request.url.path))
        if request.method == "DELETE":
            return httpx.Response(204)
        begun.set()
        # The axis moves already while the answer is on its way.
        await going_on.wait()
        job = {
            "id": "jog-1", "kind": "jog", "drive": "x", "title": "Jog", "state": "running",
            "title_message": prose("Jog").to_wire(), "progress": 0.0, "step": "",
            "step_message": prose("").to_wire(), "started": "2026-01-01T00:00:00Z",
            "ended": None, "motion": True, "result": None, "problem": None,
        }  # fmt: skip
        return httpx.Response(200, json=job)

    async with httpx.AsyncClient(
        transport=httpx.MockTransport(answer), base_url="http://station"
    ) as http:
        work = asyncio.create_task(Remote("http://station", http).result("/jobs/jog", {}))
        await begun.wait()
        work.cancel()
        await asyncio.sleep(0)
        going_on.set()
        with pytest.raises(asyncio.CancelledError):
            await work
    assert asked == [("POST", "/jobs/jog"), ("DELETE", "/jobs/jog-1")]
