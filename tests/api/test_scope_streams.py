"""Scope streams when pages sleep or vanish and buses change: bounded, counted, kept alive."""

from __future__ import annotations

import itertools
import json
import socket
import struct
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from backend.api.live import connection as live_connection
from backend.api.live import scope as live_scope
from backend.station.demo import DemoBench
from drivers.virtual.wires.netns import unavailable
from tests.api.test_ethercat import BENCH, URL
from tests.browser.cable import Cable
from tests.support.station import HANG_S, Live, Station, until

POSITION, VELOCITY, TORQUE = "6064:00", "606C:00", "6077:00"
SERIAL = """
[[axis]]
name = "S"
drive = "mms7"
on = "mlink://virtual0"
station = 1
"""


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    folder = Path(tmp_path_factory.mktemp("streams"))
    bench = folder / "bench.toml"
    bench.write_text(BENCH + SERIAL)
    running = Station(folder, bench)
    # Every cycle has its exact time, however busy the computer is.
    running.drives = DemoBench(bench, folder / "wires", folder / "nvm", steady=True)
    running.start()
    yield running
    running.stop()


@pytest.fixture
def axis(station: Station) -> Iterator[str]:
    name = station.add(1, URL, name="A")
    yield name
    station.http.delete("/buses/cyclic", params={"url": URL})
    station.remove(name)


@pytest.fixture
def serial(station: Station) -> Iterator[str]:
    name = station.add(1, name="S")
    yield name
    station.remove(name)


def exchange(station: Station, *, run: bool) -> None:
    if run:
        body = {"url": URL, "cycle_us": 1000}
        # A computer that is kept busy by others may keep a drive from answering in time.
        until(lambda: station.http.post("/buses/cyclic", json=body).is_success, 60, "it runs")
    else:
        station.ok(station.http.delete("/buses/cyclic", params={"url": URL}))


def begin(page: Live, drive: str, keys: tuple[str, ...], number: int = 1) -> Any:
    channels = [{"drive": drive, "key": key} for key in keys]
    page.send(type="scope_start", subscription=number, channels=channels)
    return page.wait("scope_info", subscription=number)


def blocks(frame: bytes) -> Iterator[tuple[tuple[Any, ...], bytes]]:
    """Head and rest of the blocks of a frame, by the layout in `backend.api.live.messages`."""
    at = 0
    while at < len(frame):
        head = struct.unpack_from("<IIIIHHIdd", frame, at)
        rows, columns, flags = head[4:7]
        size = 4 * rows * columns + 8 * rows * (flags & 1) + 8 * columns * (flags >> 1 & 1)
        yield head, frame[at + 40 : at + 40 + size]
        at += 40 + size
    assert at == len(frame)


def heads(frames: list[bytes], number: int = 1) -> list[tuple[Any, ...]]:
    """(sequence, dropped, rows, flags, t0, dt) of the frames of a subscription."""
    found = [head for frame in frames for head, _ in blocks(frame)]
    return [(h[2], h[3], h[4], h[6], h[7], h[8]) for h in found if h[1] == number]


@pytest.mark.long
def test_a_subscription_follows_the_exchange_as_it_starts_and_ends(
    station: Station, axis: str
) -> None:
    with station.live() as page:
        assert [c["synchronous"] for c in begin(page, axis, (POSITION, VELOCITY))["channels"]] == [
            False,
            False,
        ]
        until(lambda: page.receive() and len(heads(page.binary)) > 3, HANG_S, "polled samples")
        exchange(station, run=True)
        info = page.wait("scope_info", 20)
        assert [c["synchronous"] for c in info["channels"]] == [True, True]
        page.binary.clear()
        until(
            lambda: page.receive() and len(heads(page.binary)) > 3, HANG_S, "samples of the cycle"
        )
        first = heads(page.binary)[-1]
        assert first[3] & 1 == 0, "equally spaced"
        assert first[5] == pytest.approx(0.001)
        exchange(station, run=False)
        info = page.wait("scope_info", 20)
        assert [c["synchronous"] for c in info["channels"]] == [False, False]
        page.binary.clear()
        until(lambda: page.receive() and len(heads(page.binary)) > 3, HANG_S, "polled again")
        assert heads(page.binary)[-1][4] > first[4], "one clock throughout"


@pytest.mark.long
def test_what_the_cycle_does_not_carry_is_a_stream_of_its_own(station: Station, axis: str) -> None:
    exchange(station, run=True)
    with station.live() as page:
        info = begin(page, axis, (POSITION, "2040:00"))
        assert [c["synchronous"] for c in info["channels"]] == [True, False]

        def both() -> bool:
            page.receive()
            return len({head[3] >> 8 for head in heads(page.binary)}) == 2

        until(both, HANG_S, "both streams")
        until(lambda: page.receive() and len(page.binary) > 15, HANG_S)
        for stream in (0, 1):
            sequences = [h[0] for h in heads(page.binary) if h[3] >> 8 == stream]
            assert sequences == list(range(1, len(sequences) + 1)), "each counts for itself"


def test_a_drive_that_comes_back_is_sampled_again(station: Station, serial: str) -> None:
    with station.live() as page:
        assert begin(page, serial, (POSITION,))["problem"] is None
        until(lambda: page.receive() and len(page.binary) > 2, HANG_S)
        station.ok(station.http.delete(f"/drives/{serial}"))
        gone = page.wait("scope_info")
        assert serial in gone["problem"]["detail"]
        assert station.add(1, name="S") == serial
        back = page.wait("scope_info")
        assert back["problem"] is None
        page.binary.clear()
        until(lambda: page.receive() and len(page.binary) > 2, HANG_S, "samples of the new one")


def test_units_of_the_axis_are_reported(station: Station, serial: str) -> None:
    with station.live() as page:
        position, torque = begin(page, serial, (POSITION, TORQUE))["channels"]
        assert position["axis_unit"] == "rev"
        assert position["axis_factor"] == pytest.approx(1 / 65536)
        assert (torque["unit"], torque["axis_factor"]) == ("%", None)


@pytest.fixture
def asleep(station: Station) -> Iterator[ClientConnection]:
    """A page that reads nothing, with as little room on its way as the system allows."""
    wire = socket.socket()
    wire.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    wire.connect(("127.0.0.1", station.port))
    url = f"ws://127.0.0.1:{station.port}/api/v1/live"
    with connect(url, sock=wire, max_size=None, max_queue=1, ping_interval=None) as page:
        yield page


def ask_for_much(page: ClientConnection, axis: str, numbers: range) -> None:
    """The same channels many times over, so that little time fills what room there is."""
    channels = [{"drive": axis, "key": key} for key in (POSITION, VELOCITY, TORQUE)] * 10
    for number in numbers:
        page.send(json.dumps({"type": "scope_start", "subscription": number, "channels": channels}))


@pytest.mark.long
def test_a_sleeping_page_loses_only_its_own_view_and_every_sample_is_counted(
    station: Station, axis: str, asleep: ClientConnection, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (live_connection, live_scope):
        monkeypatch.setattr(module, "SEND_TIMEOUT_S", 60.0)  # it sleeps, it is not gone
    exchange(station, run=True)
    ask_for_much(asleep, axis, range(1, 31))
    with station.live() as awake:
        begin(awake, axis, (POSITION, VELOCITY, TORQUE))
        awake.binary.clear()
        until(lambda: awake.receive() and awake.binary, HANG_S, "samples")
        began = heads(awake.binary)[0][4]
        # It sleeps by the axis' time, which passes slowly on a busy computer.
        until(lambda: awake.receive() and heads(awake.binary[-1:])[0][4] - began > 4.5, 75)
        seen = heads(awake.binary)
    assert all(b[0] == a[0] + 1 for a, b in itertools.pairwise(seen)), "none is missing"
    # It wakes; what is left of its traffic is little enough to catch up with.
    for number in range(2, 31):
        asleep.send(json.dumps({"type": "scope_stop", "subscription": number}))
    asleep.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
    came: list[tuple[Any, ...]] = []
    lost = 0  # since the first block
    while not (lost > 1000 and came[-1][1] == 0):
        message = asleep.recv(timeout=10)  # more than a second was lost, and it is reported
        for head in heads([message] if isinstance(message, bytes) else []):
            lost += head[1] if came else 0
            came.append(head)
    for before, after in itertools.pairwise(came):
        _, _, rows, _, t0, dt = before
        assert after[0] == before[0] + 1
        gap = round((after[4] - t0) / dt) - rows
        assert after[1] == gap, "what did not come is counted in the block that follows"


def read_on(page: ClientConnection) -> None:
    """What is on its way, until the connection ends."""
    while True:
        page.recv(timeout=10)


@pytest.mark.long
def test_a_page_that_never_reads_is_cut_off(
    station: Station,
    axis: str,
    asleep: ClientConnection,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    monkeypatch.setattr(live_scope, "SEND_TIMEOUT_S", 0.5)
    exchange(station, run=True)
    with station.live() as page:
        here = len(page.wait("people")["people"])
        ask_for_much(asleep, axis, range(1, 31))
        while len(page.wait("people", 30)["people"]) >= here:
            pass  # it is still counted among those who are here
        with pytest.raises(ConnectionClosed):
            read_on(asleep)
        assert begin(page, axis, (POSITION,))["problem"] is None
    assert not [r for r in caplog.records if r.levelname == "ERROR"], "an ordinary end"


@pytest.mark.long
def test_a_half_open_connection_ends_and_with_it_the_polling(
    station: Station, serial: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert station._server is not None
    for name in ("ws_ping_interval", "ws_ping_timeout"):
        monkeypatch.setattr(station._server.config, name, 1.0)  # 20 s each otherwise

    def transactions() -> int:
        return int(station.ok(station.http.get(f"/drives/{serial}"))["quality"]["transactions"])

    def quiet() -> bool:
        """What is left is the monitor's, about ten a second."""
        before = transactions()
        time.sleep(0.5)
        return transactions() - before < 60

    cable = Cable(station.port)
    try:
        page = Live(cable.url.replace("http", "ws") + "api/v1/live")
        begin(page, serial, (POSITION,))
        until(lambda: not quiet(), HANG_S, "it polls fast")
        cable.stall()
        until(quiet, HANG_S, "the polling has ended")
    finally:
        cable.close()


def test_many_subscriptions_and_requests_are_refused_in_words(
    station: Station, serial: str
) -> None:
    with station.live() as page:
        channels = [{"drive": serial, "key": POSITION}]
        for number in range(1, live_scope.MOST_SUBSCRIPTIONS + 2):
            page.send(type="scope_start", subscription=number, channels=channels, period_s=1)
        number = live_scope.MOST_SUBSCRIPTIONS + 1
        info = page.wait("scope_info", 20, subscription=number)
        assert "one page can have at most" in info["problem"]["detail"]
