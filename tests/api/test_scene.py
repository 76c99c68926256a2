"""The 3D scene through our own origin: viser's messages show where the parts stand."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Iterator
from importlib.metadata import version
from typing import Any

import httpx
import msgspec
import pytest
import zstandard
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Subprotocol

from tests.support.jogging import jogged
from tests.support.machine import within
from tests.support.station import HANG_S, Station, until

PROTOCOL = Subprotocol(f"viser-v{version('viser')}")


def open_scene(station: Station, **more: Any) -> Connection:
    return connect(
        f"ws://127.0.0.1:{station.port}/viser", subprotocols=[PROTOCOL], max_size=None, **more
    )


@pytest.fixture
def scene(station: Station, x: str) -> Iterator[Connection]:
    with open_scene(station) as socket:
        yield socket


class Seen:
    """What a viewer knows after the messages so far: the state of every node by its name."""

    def __init__(self, socket: Connection) -> None:
        self._socket = socket
        self.nodes: dict[str, dict[str, Any]] = {}

    def watch(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            try:
                data = self._socket.recv(timeout=left)
            except TimeoutError:
                return
            assert isinstance(data, bytes)
            for message in messages(data):
                node = self.nodes.setdefault(message.get("name", ""), {})
                node.update({k: v for k, v in message.items() if v is not None})

    def of(self, part: str) -> dict[str, Any]:
        return next((n for name, n in self.nodes.items() if name.endswith(part)), {})


def messages(data: bytes) -> list[dict[str, Any]]:
    """viser's frames: two 64-bit lengths, then MessagePack packed by zstd, then arrays."""
    packed = int.from_bytes(data[8:16], "little")
    found = msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(data[16 : 16 + packed]))
    return [message for message in found["messages"] if isinstance(message, dict)]


def a_good_way_off(now: Any, _start: float) -> bool:
    return float(now["position"]) > 1.3


@pytest.mark.long
def test_parts_follow_the_motor(station: Station, x: str) -> None:
    screw = {"mechanics": {"kind": "screw", "lead_mm": 10, "motor_turns": 2}}
    station.ok(station.http.put(f"/drives/{x}/mechanics", json=screw))
    with open_scene(station) as socket, station.live() as page:
        seen = Seen(socket)
        seen.watch(1)
        limits = {"speed": 300, "acceleration": 3000, "travel_limit": 50, "torque_limit": 100}
        with jogged(station.http, page, x, a_good_way_off, **limits):
            page.send(type="jog_stop", drive=x)
        assert page.wait("jog_ended", drive=x)["problem"] is None
        seen.watch(1)
        turns = float(station.state(x)["position"])
    assert {"/axes/x/screw/rod", "/axes/x/carriage/body"} <= set(seen.nodes)
    # A turn by φ about x is cos(φ/2), sin(φ/2), 0, 0; the screw turns half as far as the motor.
    for part, revolutions in (("/shaft", turns), ("/screw", turns / 2)):
        wanted = (math.cos(math.pi * revolutions), math.sin(math.pi * revolutions), 0, 0)
        seen_as = seen.of(part)["wxyz"]
        sign = math.copysign(1, wanted[0] * seen_as[0] + wanted[1] * seen_as[1])
        assert [sign * value for value in seen_as] == pytest.approx(wanted, abs=0.02)
    # 10 mm for two revolutions of the motor; the track shows ±25 mm around zero to begin with.
    # The name, the sign of the state and the place; words of the state are in no language here.
    label = re.fullmatch(r"X \[([IO])\] (-?[0-9.]+) mm", seen.of("/name")["updates"]["text"])
    assert label is not None
    assert label[1] == ("I" if station.state(x)["state"] == "Operation enabled" else "O")
    assert float(label[2]) == pytest.approx(turns * 5, abs=0.1)
    assert seen.of("/carriage")["position"][0] == pytest.approx(0.9 * turns * 5 / 25, abs=0.01)


@pytest.mark.long
def test_the_scene_is_built_anew_with_the_bench(station: Station, scene: Connection) -> None:
    seen = Seen(scene)
    seen.watch(1)
    assert "/axes/x" in seen.nodes
    y = station.add(2, name="Y")
    try:
        seen.watch(1.5)
        assert f"/axes/{y}/motor" in seen.nodes
    finally:
        station.ok(station.http.delete(f"/drives/{y}"))


def test_strangers_and_other_versions_stay_outside(station: Station) -> None:
    with pytest.raises(InvalidStatus):
        open_scene(station, origin="http://evil.example")
    with pytest.raises(InvalidStatus):
        connect(f"ws://127.0.0.1:{station.port}/viser", subprotocols=[Subprotocol("viser-v0.0.1")])


def test_the_page_may_only_run_its_own_script(station: Station) -> None:
    page = httpx.get(f"{station.url}/viser/")
    assert page.status_code == 200
    policy = page.headers["content-security-policy"]
    scripts = policy.split("script-src ")[1].split(";")[0]
    assert "sha256-" in scripts
    assert "'unsafe-inline'" not in scripts
    assert "'unsafe-eval'" not in scripts


@pytest.mark.long
def test_what_a_page_sends_is_not_passed_on(
    station: Station, x: str, capfd: pytest.CaptureFixture[str]
) -> None:
    """viser would open a tunnel to the internet for a page that asks for one."""
    with open_scene(station) as socket:
        Seen(socket).watch(0.5)
        socket.send(msgspec.msgpack.encode({"type": "ShareUrlRequest"}))
        socket.send(b"no message at all")
        seen = Seen(socket)
        seen.watch(1)
        assert "ShareUrlUpdated" not in str(seen.nodes)
    assert "Share URL requested" not in "".join(capfd.readouterr())


@pytest.mark.long
def test_without_a_viewer_the_bus_is_left_alone(station: Station, x: str) -> None:
    def count() -> int:
        buses = station.ok(station.http.get("/buses"))
        return int(
            next(b for b in buses if b["url"] == "mlink://virtual0")["quality"]["transactions"]
        )

    def reads(seconds: float) -> int:
        before = count()
        time.sleep(seconds)
        return count() - before

    with open_scene(station) as socket:
        Seen(socket).watch(1)
        before = count()
        within(1.0, lambda: count() - before > 25, "30 pictures a second")
    until(lambda: reads(1.0) < 25, HANG_S, "only the state is polled, once a second")
