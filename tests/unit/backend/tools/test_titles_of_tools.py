"""A started measurement is called by the title of its tool, in the language of the reader."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from types import SimpleNamespace

import httpx
import pytest

from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.station.measuring import Exchange
from backend.tools.registry import TOOLS
from backend.tools.tool import AnyTool
from drivers.texts.message import Text
from tests.support.servo import URL

LIMITS = {"travel_limit": 0.1, "speed_limit": 100, "torque_limit": 5, "consent": True}
#: As the command line and the page's forms call the tools.
TITLES = {
    "first-power": ("First power", "首次通电"),
    "inertia": ("Inertia and friction", "惯量与摩擦"),
    "sweep": ("Frequency response", "频率响应"),
    "autotune": ("Tune", "整定"),
    "step": ("Step response", "阶跃响应"),
    "friction": ("Friction map", "摩擦图谱"),
    "load-side": ("Load side", "负载侧"),
    "gantry": ("Gantry", "龙门"),
    "brake-test": ("Brake test", "抱闸测试"),
    "health": ("Health check", "健康检查"),
    "safety-check": ("Safety acceptance record", "安全验收记录"),
    "shaping": ("Command shaping", "指令整形"),
    "vibration": ("Vibration over speed", "振动-速度图谱"),
    "dwell": ("Dwell at one frequency", "定频激振"),
    "cycle": ("Load of the machine's cycle", "机器循环负载"),
}


class Idle:
    """An exchange through which nothing is moved."""

    running, trouble = True, None

    async def stop(self) -> None:
        """End it."""


@pytest.fixture
def waiting(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """Measurements get an exchange and wait before the axis is enabled."""

    async def exchange(*_args: object) -> Exchange:
        return Exchange(Idle(), bench, "x", URL, own=False)  # type: ignore[arg-type]

    @asynccontextmanager
    async def forever(*_args: object) -> AsyncIterator[None]:
        await asyncio.Event().wait()
        yield

    partner = SimpleNamespace(drive=SimpleNamespace(id="partner"), axis=None)
    monkeypatch.setattr(bench.jobs, "_permit", lambda _drive: None)
    for place, put in {
        "exchange_for": exchange,
        "partner_of": lambda *_args: partner,
        "profile_speed.require_consent": lambda *_args: None,
        "profile_speed.prepared": forever,
        "keeping_mode": forever,
    }.items():
        monkeypatch.setattr(f"backend.api.tuning.measure.{place}", put)


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("tool", TOOLS, ids=lambda tool: tool.kind)
@pytest.mark.usefixtures("waiting")
async def test_a_started_measurement_has_its_title_in_both_languages(
    bench: Bench, x: ConnectedDrive, http: httpx.AsyncClient, tool: AnyTool
) -> None:
    english, chinese = TITLES[tool.kind]
    spoken = {"Accept-Language": "zh-CN"}
    given = LIMITS if tool.motion else {}
    answer = await http.post(f"/drives/x/jobs/{tool.kind}", json=given, headers=spoken)
    assert answer.status_code == 202, answer.text
    job = answer.json()
    assert chinese in job["title"]
    assert english not in job["title"]
    title = Text.from_wire(job["title_message"])
    assert english in title.words("en")
    assert title.words("zh") == job["title"]
    logged = (await http.get("/log", headers=spoken)).json()[0]
    assert logged["text"] == job["title"]
    assert x.drive.name in job["title"]
    running = bench.jobs.get(job["id"])
    assert running is not None
    assert (bench.jobs.moving("x") is running) is tool.motion
    await bench.jobs.cancel(running)
