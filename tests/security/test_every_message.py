"""Every message of the live connection with everybody, and what a connection must not do."""

from __future__ import annotations

import asyncio
import contextlib
import re
import socket
import time
from types import SimpleNamespace
from typing import Any, get_args

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from backend.api.live import messages as live
from backend.api.security import socket as security_socket
from backend.api.security.messages import MESSAGES
from backend.commands.server.serve import PING_S, PONG_S
from backend.foundation.people.identity import Actor, acting
from backend.foundation.people.rights import RIGHTS, Right, Role
from tests.security.conftest import Cast
from tests.support.guarded import Caller, GuardedServer, Page
from tests.support.machine import OwnTime
from tests.support.station import until

AXIS: dict[str, object] = {"drive": "x"}
#: A message of each type that is well formed, so that only the right decides.
EXAMPLES: dict[str, dict[str, object]] = {
    "stop": {"drive": "nowhere"},
    "jog_stop": AXIS,
    "ping": {"n": 5},
    "watch_state": {"drives": ["x"]},
    "watch_values": {**AXIS, "keys": []},
    "scope_start": {"subscription": 1, "channels": [{"drive": "x", "key": "6064:00"}]},
    "scope_stop": {"subscription": 1},
    "jog_renew": AXIS,
    "jog_start": {
        "drive": "nowhere",
        "direction": 1,
        "speed": 1,
        "acceleration": 1,
        "travel_limit": 1,
        "torque_limit": 1,
    },
    "lease": {**AXIS, "take": True},
    "lease_ask": AXIS,
    "lease_override": {"drive": "nowhere"},
    "lease_answer": {**AXIS, "give": False},
    "lease_hand": {**AXIS, "to": "c0"},
    "where": {"page": "/connect"},
    "pointer": {"x": 0.5, "y": 0.5},
    "plot_cursor": {"plot": "scope", "x": 1.0},
    "chat": {"text": "hello"},
    "enable_press": {"invitation": "none"},
    "enable_renew": {"invitation": "none"},
    "enable_release": {"invitation": "none"},
}


def types() -> dict[str, type]:
    members = [*get_args(live.DriveRequest), *get_args(live.PeopleRequest)]
    return {kind.model_fields["type"].default: kind for kind in members}


def test_every_message_says_who_may_send_it() -> None:
    assert set(types().values()) == set(MESSAGES)
    assert set(types()) == set(EXAMPLES)


def expected(kind: str, rights: frozenset[Right]) -> bool:
    need = MESSAGES[types()[kind]]
    if need == "always":
        return True
    if need == "control":
        return bool(rights & {Right.PARAMETERS, Right.MEASURE, Right.MOTION})
    return need in rights


@pytest.mark.long
@pytest.mark.parametrize("who", ["administrator", "operator", "viewer", "guest", "reader"])
def test_everybody_sends_what_they_may_and_nothing_else(
    server: GuardedServer, cast: Cast, who: str
) -> None:
    caller: Caller = getattr(cast, who)
    rights = RIGHTS.get(Role(who)) if who != "reader" else frozenset({Right.LOOK})
    wrong = []
    with caller.live() as page:
        for kind, fields in EXAMPLES.items():
            problem = page.refused(type=kind, **fields)
            refused = problem is not None and problem["status"] in (401, 403)
            if refused == expected(kind, rights or frozenset()):
                wrong.append(f"{kind}: {problem}")
        page.send(type="lease", drive="x", take=False)
    assert wrong == []


def handshake(server: GuardedServer, headers: dict[str, str], path: str = "/api/v1/live") -> int:
    """HTTP status that refuses a websocket; 101 where it opens."""
    try:
        connect(f"{server.url.replace('http', 'ws')}{path}", additional_headers=headers).close()
    except InvalidStatus as refused:
        return refused.response.status_code
    return 101


def test_who_may_open_a_websocket(server: GuardedServer, cast: Cast) -> None:
    good = {"Cookie": f"servodeck={cast.viewer.cookie}"}
    for path in ("/api/v1/live", "/rerun/feed"):
        assert handshake(server, {}, path) == 403
        assert handshake(server, {"Cookie": "servodeck=" + "x" * 43}, path) == 403
        assert handshake(server, good | {"Origin": "http://evil.example"}, path) == 403
        assert handshake(server, good | {"Origin": "null"}, path) == 403
        assert handshake(server, good | {"Host": "evil.example"}, path) in (400, 403)
    assert handshake(server, good, "/api/v1/drives") == 403
    assert handshake(server, good, "/viser/") in (403, 404)
    assert handshake(server, good | {"Origin": server.url}) == 101


# --- malformed, too much, too slow ----------------------------------------------------


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "null", '{"type": "nothing"}', '{"type": "ping"}',
     '{"type": "ping", "n": 1e999}',
     '{"type": "stop", "more": 1}', "\u0000", "[" * 20_000, '{"type": "pointer", "x": NaN, "y": 0}',
     '{"type": "chat", "text": "' + "x" * 501 + '"}'],
    ids=lambda text: text[:20],
)  # fmt: skip
def test_what_is_no_message_is_refused_and_the_next_is_heard(cast: Cast, text: str) -> None:
    with cast.operator.live() as page:
        page.socket.send(text)
        problem = page.wait("refused")
        assert "not a message" in problem["problem"]["detail"]
        page.send(type="ping", n=7)
        page.wait("pong", n=7)


def test_a_binary_message_is_none(cast: Cast) -> None:
    with cast.operator.live() as page:
        page.socket.send(b"\x00\xff" * 100)
        assert page.wait("refused")


def test_a_message_of_megabytes_ends_the_connection(cast: Cast) -> None:
    def send(page: Page) -> None:
        page.socket.send("x" * (1 << 20))
        drain(page)

    with cast.operator.live() as page, pytest.raises(ConnectionClosed) as closed:
        send(page)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1009


def drain(page: Page) -> None:
    while True:
        page.receive(10)


@pytest.mark.parametrize(
    ("first", "more"),
    [
        (b"", b"\x89\x80\x00\x00\x00\x00"),  # pings, whose answers nobody reads
        (b"", b"\x8a\x80\x00\x00\x00\x00"),  # pongs that nobody asked for
        (b"\x01\x80\x00\x00\x00\x00", b"\x00\x80\x00\x00\x00\x00"),  # a message without end
    ],
    ids=["ping", "pong", "part"],
)
def test_a_flood_of_frames_that_are_no_messages_ends_the_connection(
    server: GuardedServer, cast: Cast, first: bytes, more: bytes
) -> None:
    known = server.connections
    with socket.create_connection(("127.0.0.1", server.port), timeout=15) as line:
        line.sendall(upgrade(server, cast))
        assert b" 101 " in line.recv(65536)
        (flooded,) = server.connections - known
        line.sendall(first + more * 200)
        until(lambda: flooded not in server.connections, 5, "it is ended")
    assert cast.operator.ask("GET", "/health").status_code == 200


def upgrade(server: GuardedServer, cast: Cast) -> bytes:
    """The beginning of a live connection of the operator's."""
    return (
        f"GET /api/v1/live HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nUpgrade: websocket\r\n"
        "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
        f"Cookie: servodeck={cast.operator.cookie}\r\n\r\n"
    ).encode()


def test_one_log_in_does_not_take_all_places(
    server: GuardedServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert security_socket.MOST_PER_SESSION <= 100
    monkeypatch.setattr(security_socket, "MOST_PER_SESSION", 3)
    caller = server.log_in(Role.VIEWER)
    cookie = {"Cookie": f"servodeck={caller.cookie}"}
    with contextlib.ExitStack() as pages:
        for _ in range(3):
            pages.enter_context(caller.live())
        assert handshake(server, cookie) == 403
        assert (
            handshake(server, {"Cookie": f"servodeck={server.log_in(Role.VIEWER).cookie}"}) == 101
        )
        assert caller.ask("POST", "/stop", json={}).status_code == 200
    until(lambda: handshake(server, cookie) == 101, 5)


def test_nobody_talks_the_log_full(cast: Cast) -> None:
    with cast.operator.live() as page:
        problems = [page.refused(type="chat", text=f"line {n}") for n in range(12)]
    assert [problem["status"] for problem in problems if problem] == [429, 429]


def test_a_flood_ends_the_connection(cast: Cast) -> None:
    def flood(page: Page) -> None:
        for _ in range(3000):
            page.send(type="ping", n=1)
        drain(page)

    with cast.operator.live() as page, pytest.raises(ConnectionClosed) as closed:
        flood(page)
    assert closed.value.rcvd is not None
    # Too many in, or too many answers that nobody takes: whichever is noticed first.
    assert closed.value.rcvd.code in (4429, 1013)


#: A frame that closes (RFC 6455 clause 5.5.1), with its code.
CLOSED = re.compile(rb"\x88.(\x03.)", re.DOTALL)


def raw(server: GuardedServer, head: bytes, frame: bytes, until_seen: re.Pattern[bytes]) -> bytes:
    """What comes back until something is seen, or the server closes."""
    with socket.create_connection(("127.0.0.1", server.port), timeout=15) as line:
        line.sendall(head)
        answer = line.recv(65536)
        line.sendall(frame)
        while not until_seen.search(answer) and (chunk := _receive(line)):
            answer += chunk
        return answer


def _receive(line: socket.socket) -> bytes:
    try:
        return line.recv(65536)
    except ConnectionResetError:
        return b""


@pytest.mark.parametrize(
    "frame",
    [
        b"\x81\x05hello",  # not masked, as a client must (RFC 6455 clause 5.1)
        b"\xf1\x80\x00\x00\x00\x00",  # reserved bits
        b"\x8f\x80\x00\x00\x00\x00",  # unknown operation
        b"\x89\xfe\x00\x80" + b"\x00" * 132,  # a ping of more than 125 bytes
        b"\x81\xff\x7f\xff\xff\xff\xff\xff\xff\xff\x00\x00\x00\x00",  # 2^63 bytes to come
        b"\x81\x82\x00\x00\x00\x00\xff\xfe",  # not UTF-8
    ],
)
def test_a_malformed_frame_ends_its_connection_only(
    server: GuardedServer, cast: Cast, frame: bytes
) -> None:
    answer = raw(server, upgrade(server, cast), frame, until_seen=CLOSED)
    assert b"101 Switching Protocols" in answer
    closed = CLOSED.search(answer)
    assert closed is not None
    assert int.from_bytes(closed.group(1), "big") in (1002, 1007, 1009)
    assert cast.operator.ask("GET", "/health").status_code == 200


# --- control and time -----------------------------------------------------------------


@pytest.mark.long
def test_a_silent_connection_loses_control_within_two_seconds(
    server: GuardedServer, cast: Cast
) -> None:
    with cast.operator.live() as page:
        began = time.monotonic()
        page.send(type="lease", drive="x", take=True)
        until(lambda: server.bench.leases.holder("x"), 10)
        with OwnTime() as silent:
            until(lambda: server.bench.leases.holder("x") is None, 10, "control is lost")
        assert time.monotonic() - began > 1.0
        assert silent.s < 2.2
        assert page.wait("lease_notice", drive="x")["kind"] == "lost"


def began_by(server: GuardedServer, cast: Cast, page: Page) -> Any:
    """A motion that would go on for ever, begun by the operator through this page."""

    async def forever(_progress: object) -> None:
        await asyncio.Event().wait()

    def start() -> Any:
        identity = server.people.identify(cast.operator.cookie, None)
        assert identity is not None
        acting.set(Actor(identity, page.connection))
        return server.bench.jobs.start("sweep", "Sweep", forever, drive="x", motion=True)

    return server.call(start)


def test_a_closed_connection_ends_what_it_began(server: GuardedServer, cast: Cast) -> None:
    """A motion cannot outlive the page of the person who asked for it."""
    with cast.operator.live() as page:
        job = began_by(server, cast, page)
        assert job.person == "Olaf"
    until(lambda: job.state == "cancelled", 3, "the job has ended")


@pytest.mark.long
def test_a_line_that_is_dead_but_open_moves_nothing_and_is_given_up(
    server: GuardedServer, cast: Cast
) -> None:
    """A laptop's lid is shut: no word, no end of the connection, no answer to pings."""
    live = server.app.state.live
    known = set(live.connections)
    config = server.config
    config.ws_ping_interval, config.ws_ping_timeout = 0.5, 2.5
    try:
        with socket.create_connection(("127.0.0.1", server.port), timeout=15) as line:
            line.sendall(upgrade(server, cast))
            (name,) = until(lambda: set(live.connections) - known, 5)
            page = live.connections[name]
            server.call(lambda: server.bench.leases.take("x", name, "Olaf"))
            job = began_by(server, cast, SimpleNamespace(connection=name))  # type: ignore[arg-type]
            with OwnTime() as silent:
                until(lambda: server.bench.leases.holder("x") is None, 10, "control is lost")
                until(lambda: job.state == "cancelled", 2, "the motion has ended")
            assert silent.s < 2.2
            assert name in live.connections, "and all that while the line still looked open"
            until(lambda: name not in live.connections, 5, "the line is given up")
            assert page.id not in {
                each["connection"] for each in cast.viewer.ok("GET", "/people")["people"]
            }
    finally:
        config.ws_ping_interval, config.ws_ping_timeout = PING_S, PONG_S


def test_dead_lines_are_given_up_within_a_quarter_minute(server: GuardedServer) -> None:
    config = server.config
    assert (config.ws_ping_interval or 99) + (config.ws_ping_timeout or 99) <= 15


def test_a_viewer_stops_what_moves(server: GuardedServer, cast: Cast) -> None:
    for caller in (cast.viewer, cast.guest):
        before = len(server.servo.words())
        with caller.live() as page:
            assert page.refused(type="stop", drive="x") is None
        assert len(server.servo.words()) > before
        assert caller.ask("POST", "/stop", json={"drive": "x"}).json()["stopped"] == ["x"]
    assert cast.reader.ask("POST", "/stop", json={}).status_code == 200


def test_a_guest_cannot_hold_the_enabling_button(server: GuardedServer, cast: Cast) -> None:
    cast.operator.ok(
        "PUT", f"/invitations/{cast.invitation}/grant", {"rights": ["motion"], "minutes": 5}
    )
    try:
        for caller in (cast.guest, cast.viewer, cast.reader):
            with caller.live() as page:
                problem = page.refused(type="enable_press", invitation=cast.invitation)
                assert problem["status"] == 403
        move = cast.guest.ask("POST", "/drives/x/transition", json={"goal": "Ready to switch on"})
        assert move.status_code == 403
        assert "enabling button" in move.json()["detail"]
    finally:
        cast.operator.ok("DELETE", f"/invitations/{cast.invitation}/grant")


def test_a_guest_gets_what_is_granted_where_and_as_long(server: GuardedServer, cast: Cast) -> None:
    write = {"value": 40}
    path = "/drives/x/parameters/2005:03"
    grant = f"/invitations/{cast.invitation}/grant"
    ticks = server.people.support._ticks
    assert cast.guest.ask("PUT", path, json=write).status_code == 403
    assert (
        cast.operator.ask("PUT", grant, json={"rights": ["station"], "minutes": 5}).status_code
        == 409
    )
    cast.operator.ok("PUT", grant, {"rights": ["parameters"], "minutes": 5, "drive": "x"})
    assert cast.guest.ask("PUT", path, json=write).status_code != 403
    other = cast.guest.ask("PUT", "/drives/y/parameters/2005:03", json=write)
    assert other.status_code == 403
    try:
        server.people.support._ticks = lambda: ticks() + 301
        assert cast.guest.ask("PUT", path, json=write).status_code == 403
    finally:
        server.people.support._ticks = ticks
        cast.operator.ok("DELETE", grant)


def test_the_button_on_site_is_dead_within_200_ms(
    server: GuardedServer, cast: Cast, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No release comes: the page on site has frozen. What the guest moves is stopped."""
    cast.operator.ok(
        "PUT", f"/invitations/{cast.invitation}/grant", {"rights": ["motion"], "minutes": 5}
    )
    now = [time.monotonic()]
    monkeypatch.setattr(server.people.support, "_ticks", lambda: now[0])
    with cast.operator.live() as site:

        def renew() -> None:
            site.send(type="enable_renew", invitation=cast.invitation)
            site.send(type="ping", n=1)
            site.wait("pong", n=1)  # it was heard

        site.send(type="enable_press", invitation=cast.invitation)
        until(lambda: server.people.support.enabled(cast.invitation), 10)
        job = server.call(lambda: _guest_motion(server, cast))
        before = len(server.servo.words())
        for _ in range(10):
            now[0] += 0.1
            renew()
        assert job.state == "running"
        assert len(server.servo.words()) == before
        with OwnTime() as took:
            now[0] += 0.2
            until(lambda: len(server.servo.words()) > before, 10, "the quick stop is written")
        assert took.s < 0.1, "it is looked for 50 times a second"
        until(lambda: job.state == "cancelled", 2)
        renew()  # what has expired is not revived
        assert not server.call(lambda: server.people.support.enabled(cast.invitation))
        late = server.call(lambda: _guest_motion(server, cast))
        until(lambda: late.state == "cancelled", 2, "a motion that began just then is stopped")
    cast.operator.ok("DELETE", f"/invitations/{cast.invitation}/grant")


def _guest_motion(server: GuardedServer, cast: Cast) -> Any:
    async def forever(_progress: object) -> None:
        await asyncio.Event().wait()

    identity = server.people.identify(cast.guest.cookie, None)
    assert identity is not None
    acting.set(Actor(identity, None))
    return server.bench.jobs.start("move", "Move", forever, drive="x", motion=True)


def test_a_link_works_once_and_its_code_cannot_be_guessed(
    server: GuardedServer, cast: Cast
) -> None:
    nobody = Caller(server)
    made = cast.operator.ok("POST", "/invitations", {"guest": "Gina", "minutes": 5})
    link, code = made["link"].removeprefix("/guest/"), made["invitation"]["code"]
    assert nobody.ask("POST", "/guests", json={"link": "x" * 43, "code": code}).status_code == 401
    for _ in range(4):
        wrong = nobody.ask("POST", "/guests", json={"link": link, "code": "AAAA-AAAA"})
        assert wrong.status_code == 401
    joined = nobody.ask("POST", "/guests", json={"link": link, "code": code})
    assert joined.status_code == 201
    again = Caller(server).ask("POST", "/guests", json={"link": link, "code": code})
    assert again.status_code == 401
    nobody = Caller(server)
    made = cast.operator.ok("POST", "/invitations", {"guest": "Gina", "minutes": 5})
    link, code = made["link"].removeprefix("/guest/"), made["invitation"]["code"]
    server.people.support._throttle.succeeded("127.0.0.1")
    codes = [
        nobody.ask("POST", "/guests", json={"link": link, "code": "AAAA-AAAA"}).status_code
        for _ in range(5)
    ]
    assert set(codes) <= {401, 429}
    server.people.support._throttle.succeeded("127.0.0.1")
    good = nobody.ask("POST", "/guests", json={"link": link, "code": code})
    assert good.status_code in (401, 429), "five wrong codes end an invitation"
