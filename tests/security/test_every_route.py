"""Every route of the interface with everybody: what passes is what the policy says, no more."""

from __future__ import annotations

import re
from datetime import timedelta
from typing import Any

import httpx
import pytest
from fastapi import APIRouter
from websockets.exceptions import ConnectionClosed

from backend.api.security.rights import API, ROUTES, Need
from backend.foundation.people.rights import RIGHTS, Right, Role
from tests.security.conftest import Cast
from tests.support.guarded import PASSWORD, Caller, GuardedServer, Page
from tests.support.servo import URL
from tests.support.station import NO_CERTIFICATES, until

#: For each placeholder something that is not there, so that what is allowed changes nothing.
NOWHERE = {"account_id": "999999", "number": "1"}
#: Would end the session that the other requests use; tested by itself.
ENDS_IT = {"DELETE /api/v1/session"}


def operations(server: GuardedServer) -> list[str]:
    paths = server.interface["paths"]
    return [f"{method.upper()} {path}" for path, known in paths.items() for method in known]


def address(path: str, **known: str) -> str:
    def fill(found: re.Match[str]) -> str:
        return {**NOWHERE, **known}.get(found.group(1), "nowhere")

    return re.sub(r"{(\w+)}", fill, path)


def ask(caller: Caller, operation: str, **options: Any) -> httpx.Response:
    method, path = operation.split(" ")
    body = {"json": {}} if method not in ("GET", "DELETE") else {}
    where = f"{caller.server.url}{address(path)}"
    return caller.http.request(method, where, **{**body, **options})


def may(need: Need, rights: frozenset[Right]) -> bool:
    return need.right in rights if isinstance(need.right, Right) else True


def test_every_route_is_declared_and_nothing_else(server: GuardedServer) -> None:
    declared = {key for key in ROUTES if key.split(" ")[1].startswith(API)}
    own = {f"GET {API}/openapi.json", f"WS {API}/live"}
    assert set(operations(server)) - declared == set(), (
        "say in backend/api/security/rights.py who may"
    )
    assert declared - own - set(operations(server)) == set(), "no such route any more"


@pytest.mark.long
def test_nobody_gets_in(guarded: GuardedServer) -> None:
    # A server of its own: so many requests use up what an address without a login may ask.
    stranger = Caller(guarded)

    def answered(operation: str) -> int | None:
        status = ask(stranger, operation).status_code
        return None if status == 429 else status

    passed = {
        operation: status
        for operation in operations(guarded)
        if ROUTES[operation].right != "public"
        and (status := until(lambda operation=operation: answered(operation))) != 401
    }
    assert passed == {}


@pytest.mark.parametrize("forged", ["", "x" * 43, "../../etc/passwd", "a" * 5000, "é%00"])
def test_a_forged_cookie_is_nobody(server: GuardedServer, forged: str) -> None:
    for name in ("servodeck", "__Host-servodeck"):
        for operation in ("GET /api/v1/drives", "POST /api/v1/stop", "GET /api/v1/accounts"):
            answer = ask(
                Caller(server), operation, headers={"Cookie": f"{name}={forged}".encode("latin-1")}
            )
            assert answer.status_code == 401, (name, operation)


@pytest.mark.parametrize("token", ["-", "sdk_", "sdk_" + "x" * 43, "Basic"])
def test_a_forged_token_is_nobody_even_with_a_good_cookie(
    server: GuardedServer, cast: Cast, token: str
) -> None:
    answer = cast.operator.ask("GET", "/drives", headers={"Authorization": f"Bearer {token}"})
    assert answer.status_code == 401
    basic = cast.operator.ask("GET", "/drives", headers={"Authorization": "Basic eDp5"})
    assert basic.status_code == 401


@pytest.mark.long
@pytest.mark.parametrize("who", ["administrator", "operator", "viewer", "guest", "reader"])
def test_everybody_passes_what_they_may_and_nothing_else(
    server: GuardedServer, cast: Cast, who: str
) -> None:
    caller: Caller = getattr(cast, who)
    rights = {
        "guest": RIGHTS[Role.GUEST],
        "reader": frozenset({Right.LOOK}),
    }.get(who) or RIGHTS[Role(who)]
    wrong = []
    for operation in operations(server):
        need = ROUTES[operation]
        if operation in ENDS_IT:
            continue
        status = ask(caller, operation).status_code
        allowed = may(need, rights)
        if allowed == (status in (401, 403)) and not _own_business(operation, who, status):
            wrong.append(f"{operation}: {status}, allowed: {allowed}")
    assert wrong == []


def _own_business(operation: str, who: str, status: int) -> bool:
    """Routes of one's own account: the gate lets everybody known pass, the route asks for one."""
    own = ("/tokens", "/sessions", "/session/password", "/session", "/setup", "/guests")
    return status in (401, 403) and operation.split(" ")[1].removeprefix(API).startswith(own)


def test_without_the_token_of_the_page_nothing_changes(server: GuardedServer, cast: Cast) -> None:
    bare = Caller(server, cookie=cast.administrator.cookie)
    passed = []
    for wrong in (None, "", cast.operator.http.headers["X-Servodeck-CSRF"]):
        del bare.http.headers["X-Servodeck-CSRF"]
        bare.http.headers["X-Servodeck-CSRF"] = wrong or ""
        if wrong is None:
            del bare.http.headers["X-Servodeck-CSRF"]
        for operation in operations(server):
            if operation.startswith("GET") or ROUTES[operation].right in ("stop", "public"):
                continue
            if (status := ask(bare, operation).status_code) != 403:
                passed.append(f"{operation} {wrong!r}: {status}")
        bare.http.headers["X-Servodeck-CSRF"] = "-"
    assert passed == []


FOREIGN = [
    {"Host": "evil.example"},
    {"Host": "127.0.0.1.evil.example"},
    {"Host": "localhost@evil.example"},
    {"Host": "localhost:80@evil.example"},
    {"Host": "[::1].evil.example"},
    {"Host": "[::1]evil.example:80"},
    {"Origin": "http://evil.example"},
    {"Origin": "null"},
    {"Origin": "https://localhost"},
    {"Origin": "http://localhost:1"},
    {"Sec-Fetch-Site": "cross-site"},
]


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("headers", FOREIGN, ids=str)
def test_other_pages_reach_nothing(
    server: GuardedServer, cast: Cast, headers: dict[str, str]
) -> None:
    passed = []
    for operation in operations(server):
        if "Sec-Fetch-Site" in headers and operation.startswith("GET"):
            continue  # a link from elsewhere may be followed; it changes nothing
        status = ask(cast.administrator, operation, headers=headers).status_code
        if status != 403:
            passed.append(f"{operation}: {status}")
    assert passed == []


def test_our_own_origin_is_fine(server: GuardedServer, cast: Cast) -> None:
    answer = cast.operator.ask("POST", "/stop", json={}, headers={"Origin": server.url})
    assert answer.status_code == 200


def test_a_header_that_is_there_twice(server: GuardedServer, cast: Cast) -> None:
    for name in (b"Origin", b"Authorization", b"X-Servodeck-CSRF"):
        headers = [(name, b"x"), (name, server.url.encode())]
        answer = cast.operator.http.request("POST", "/stop", json={}, headers=headers)
        if name != b"X-Servodeck-CSRF":
            assert answer.status_code == 403, name
    assert (
        cast.operator.ask(
            "POST",
            "/scan",
            json={},
            headers=[(b"X-Servodeck-CSRF", b"a"), (b"X-Servodeck-CSRF", b"b")],  # type: ignore[arg-type]
        ).status_code
        == 403
    )


# --- control --------------------------------------------------------------------------


def test_every_change_of_an_axis_asks_for_control(server: GuardedServer, cast: Cast) -> None:
    server.call(lambda: server.bench.leases.take("x", "c0", "Otto"))
    try:
        unguarded = []
        for operation in operations(server):
            need = ROUTES[operation]
            method, path = operation.split(" ")
            if need.lease != "drive":
                continue
            where = address(path, drive_id="x", key="2005:03", name="save")
            answer = cast.administrator.http.request(method, server.url + where, json={})
            if answer.status_code != 409 or "has control" not in answer.json()["detail"]:
                unguarded.append(f"{operation}: {answer.status_code}")
        assert unguarded == []
    finally:
        server.call(lambda: server.bench.leases.give("x", "c0"))


TRIAL = {"url": URL, "station": 1, "setting": "cycle", "after": "2"}


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [
        ("POST", "/scan", {"url": URL}),
        ("POST", "/drives", {"url": URL, "station": 2, "profile": "mms7"}),
        ("POST", "/buses/cyclic", {"url": URL}),
        ("DELETE", f"/buses/cyclic?url={URL}", None),
        ("POST", "/buses/doctor/trials", TRIAL),
        ("PUT", "/buses/doctor/kept", TRIAL),
        ("DELETE", f"/buses/doctor/kept?url={URL}&station=1", None),
    ],
)
def test_what_touches_a_bus_asks_for_its_drives(
    server: GuardedServer, cast: Cast, method: str, path: str, body: object
) -> None:
    server.call(lambda: server.bench.leases.take("x", "c0", "Otto"))
    try:
        answer = cast.operator.ask(method, path, json=body)
        assert answer.status_code == 409
        assert "has control" in answer.json()["detail"]
    finally:
        server.call(lambda: server.bench.leases.give("x", "c0"))


def test_every_drive_route_that_changes_says_whose_control(server: GuardedServer) -> None:
    """Where a right is needed that changes drives, the lease is not forgotten."""
    changing = {Right.PARAMETERS, Right.MEASURE, Right.MOTION}
    forgotten = [
        key for key, need in ROUTES.items() if need.right in changing and need.lease == "none"
    ]
    assert forgotten == []


def test_a_connection_of_somebody_else_is_not_believed(server: GuardedServer, cast: Cast) -> None:
    with cast.administrator.live() as page:
        page.send(type="lease", drive="x", take=True)
        page.refused(type="ping", n=0)
        body = {"name": "X"}
        named = {"X-Servodeck-Connection": page.connection}
        other = cast.operator.ask("PATCH", "/drives/x", json=body, headers=named)
        assert other.status_code == 409
        own = cast.administrator.ask("PATCH", "/drives/x", json=body, headers=named)
        assert own.status_code == 200, own.text


def test_what_a_page_asked_is_not_done_after_its_connection_ended(
    server: GuardedServer, cast: Cast
) -> None:
    """As when the network hung: a move must not begin half a minute after it was asked for."""
    with cast.administrator.live() as page:
        page.refused(type="ping", n=0)
        named = {"X-Servodeck-Connection": page.connection}
        assert rename(cast, named).status_code == 200
    late = until(lambda: refused(rename(cast, named)), 5, "the connection has ended")
    assert "has ended: nothing was done" in late.json()["detail"]
    assert cast.administrator.ask("POST", "/stop", json={}, headers=named).status_code == 200
    assert rename(cast, {}).status_code == 200, "programs name no connection"


def rename(cast: Cast, headers: dict[str, str]) -> httpx.Response:
    return cast.administrator.ask("PATCH", "/drives/x", json={"name": "X"}, headers=headers)


def refused(answer: httpx.Response) -> httpx.Response | None:
    return answer if answer.status_code == 409 else None


# --- default deny ---------------------------------------------------------------------


def test_a_route_that_forgot_to_say_is_closed_to_everybody(
    server: GuardedServer, cast: Cast
) -> None:
    forgetful = APIRouter()

    @forgetful.get("/api/v1/forgotten")
    @forgetful.post("/api/v1/forgotten")
    @forgetful.get("/api/v1/drives/{drive_id}/forgotten")
    @forgetful.get("/forgotten")
    async def forgotten() -> str:
        raise AssertionError("this must not run")

    server.call(lambda: server.app.include_router(forgetful))
    server.app.router.routes.insert(0, server.app.router.routes.pop())
    for method, path in (
        ("GET", "/api/v1/forgotten"),
        ("POST", "/api/v1/forgotten"),
        ("GET", "/api/v1/drives/x/forgotten"),
        ("GET", "/forgotten"),
    ):
        for caller, status in ((cast.administrator, 404), (cast.nobody, 401)):
            answer = caller.http.request(method, server.url + path)
            assert answer.status_code == status, (method, path, answer.text)
    server.app.router.routes.pop(0)


def test_wrong_methods_and_odd_paths(server: GuardedServer, cast: Cast) -> None:
    answer = cast.operator.ask("DELETE", "/health")
    assert answer.status_code == 405
    assert answer.headers["Allow"] == "GET"
    for path in ("/api/v1//drives", "/api/v1/drives/", "/API/V1/drives", "/api/v1/../v1/drives",
                 "/api/v1/drives%2fx", "/assets/../../../etc/passwd", "/assets/%2e%2e/index.html",
                 "/rerun/../api/v1/drives", "/%2e%2e/%2e%2e/etc/passwd"):  # fmt: skip
        assert cast.nobody.http.get(server.url + path).status_code in (401, 404), path


# --- time -----------------------------------------------------------------------------


def test_a_session_ends_and_can_still_stop_for_a_day(server: GuardedServer) -> None:
    caller = server.log_in(Role.OPERATOR)
    assert caller.ask("GET", "/drives").status_code == 200
    try:
        server.ahead = timedelta(hours=1, minutes=59)
        assert caller.ask("GET", "/drives").status_code == 200  # and now it was used
        server.ahead = timedelta(hours=4)
        for method, path in (("GET", "/drives"), ("POST", "/scan"), ("GET", "/session")):
            answer = caller.ask(method, path, json=None)
            assert answer.status_code == 401 or answer.json()["person"] is None
        # The page may not know yet, and its STOP must work.
        assert caller.ask("POST", "/stop", json={}).status_code == 200
        server.ahead = timedelta(hours=40)
        assert caller.ask("POST", "/stop", json={}).status_code == 401
    finally:
        server.ahead = timedelta(0)


def test_twelve_hours_are_the_longest(server: GuardedServer) -> None:
    caller = server.log_in(Role.VIEWER)
    try:
        for hours in range(1, 12):
            server.ahead = timedelta(hours=hours)
            assert caller.ask("GET", "/drives").status_code == 200
        server.ahead = timedelta(hours=12, minutes=1)
        assert caller.ask("GET", "/drives").status_code == 401
    finally:
        server.ahead = timedelta(0)


def test_log_out_is_at_once_and_for_good(server: GuardedServer) -> None:
    caller = server.log_in(Role.OPERATOR)
    cookie = caller.cookie
    with caller.live() as page:
        assert caller.ask("DELETE", "/session").status_code == 204
        closed = _closed(page)
    assert closed == 4401
    for method, path in (("GET", "/drives"), ("POST", "/stop")):
        again = httpx.request(
            method,
            f"{server.url}/api/v1{path}",
            headers={"Cookie": f"servodeck={cookie}"},
            timeout=30,
            verify=NO_CERTIFICATES,
        )
        assert again.status_code == 401


def drain(page: Page) -> None:
    while True:
        page.receive(5)


def _closed(page: Page) -> int:
    """The code with which the server closes."""
    with pytest.raises(ConnectionClosed) as closed:
        drain(page)
    assert closed.value.rcvd is not None
    return int(closed.value.rcvd.code)


def test_a_role_taken_away_is_gone_with_the_next_request(server: GuardedServer) -> None:
    accounts = server.people.accounts
    made = server.run(accounts.add("Rolf", PASSWORD, Role.OPERATOR))
    answer = httpx.post(
        f"{server.url}/api/v1/session", json={"name": "rolf", "password": PASSWORD}, timeout=30
    )
    caller = Caller(server, cookie=answer.cookies["servodeck"])
    assert caller.ask("PUT", "/bundles/armed", json={}).status_code == 422
    with caller.live() as page:
        server.run(accounts.set_role(made.id, Role.VIEWER))
        assert caller.ask("PUT", "/bundles/armed", json={}).status_code == 403
        problem = page.refused(type="lease", drive="x", take=True)
        assert problem["status"] == 403
        server.run(accounts.remove(made.id))
        assert caller.ask("GET", "/drives").status_code == 401
        assert _closed(page) == 4401


@pytest.mark.long
def test_a_cookie_of_another_station_is_nobody(
    server: GuardedServer, cast: Cast, tmp_path_factory: pytest.TempPathFactory
) -> None:
    other = GuardedServer(tmp_path_factory.mktemp("other")).start()
    try:
        other.add_people()
        foreign = other.log_in(Role.ADMINISTRATOR)
        used = Caller(server, cookie=foreign.cookie)
        assert used.ask("GET", "/accounts").status_code == 401
    finally:
        other.stop()
