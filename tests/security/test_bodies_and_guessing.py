"""Large and slow bodies, slow heads, guessing, paths, and text that wants to be markup."""

from __future__ import annotations

import io
import socket
import time
import zipfile
from datetime import timedelta
from pathlib import Path
from typing import Any

import httpx
import pytest
from argon2 import PasswordHasher, extract_parameters
from argon2.exceptions import VerifyMismatchError

from backend.api.security import body as security_body
from backend.api.security import protocol as security_protocol
from backend.foundation.people.login.passwords import DEFAULT, Passwords
from backend.foundation.people.login.throttle import LONGEST_WAIT_S, Throttle
from backend.foundation.people.rights import Right, Role
from tests.security.conftest import Cast
from tests.support.guarded import NAMES, PASSWORD, Caller, GuardedServer
from tests.support.station import NO_CERTIFICATES, until

# --- bodies ---------------------------------------------------------------------------


def test_a_body_beyond_its_limit_is_refused_before_it_is_read(
    server: GuardedServer, cast: Cast
) -> None:
    answer = cast.operator.ask("POST", "/scan", content=b"x" * (1 << 20) + b"x")
    assert answer.status_code == 413
    assert answer.headers["content-type"] == "application/problem+json"


def test_a_body_that_grows_beyond_its_limit_is_cut_off(server: GuardedServer, cast: Cast) -> None:
    def endless() -> Any:
        while True:
            yield b"x" * 65536

    try:
        status = cast.operator.ask("POST", "/scan", content=endless()).status_code
    except (httpx.WriteError, httpx.ReadError, httpx.RemoteProtocolError):
        status = 413  # the connection went while we were still sending
    assert status == 413
    assert cast.operator.ask("GET", "/health").status_code == 200


@pytest.mark.parametrize("length", ["-1", "abc", "1e3", "99999999999999999999"])
def test_an_odd_length_is_no_request(server: GuardedServer, cast: Cast, length: str) -> None:
    with socket.create_connection(("127.0.0.1", server.port), timeout=30) as line:
        line.sendall(
            f"POST /api/v1/stop HTTP/1.1\r\nHost: localhost\r\nContent-Length: {length}\r\n"
            f"Cookie: servodeck={cast.operator.cookie}\r\n\r\n{{}}".encode()
        )
        status = int(line.recv(65536).split(b" ")[1])
    assert status in (400, 413)


def test_deep_and_wide_json_is_no_defect(cast: Cast) -> None:
    for body in ("[" * 100_000, '{"a":' * 50_000, "9" * 100_000, '"\\ud800"', "\x00", "NaN"):
        answer = cast.operator.ask("POST", "/scan", content=body.encode())
        assert answer.status_code in (400, 422), answer.text[:200]


def test_numbers_without_end_are_refused_in_words(cast: Cast) -> None:
    for method, path, body in (
        ("PUT", "/drives/x/parameters/2005:03", b'{"raw": 1' + b"0" * 400 + b"}"),
        ("POST", "/drives/x/tune/undo", b'{"before": {"2005:03": 1' + b"0" * 400 + b"}}"),
        ("PUT", "/sets/endless", b"version = 1" + b"0" * 5000),
        ("PUT", "/sets/endless", b"saved = 9999-99-99"),
    ):
        answer = cast.operator.ask(method, path, content=body)
        assert answer.status_code in (409, 422), (path, answer.text[:200])


def test_a_slow_body_is_given_up(
    server: GuardedServer, cast: Cast, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(security_body, "BODY_S", 0.3)
    head = (
        f"POST /api/v1/scan HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n"
        f"X-Servodeck-CSRF: {cast.operator.http.headers['X-Servodeck-CSRF']}\r\n"
        f"Cookie: servodeck={cast.operator.cookie}\r\n\r\n"
    )
    with socket.create_connection(("127.0.0.1", server.port), timeout=30) as line:
        line.sendall(head.encode() + b'{"u')
        began = time.monotonic()
        assert b" 408 " in line.recv(65536).split(b"\r\n")[0]
        assert time.monotonic() - began < 5


def test_slow_heads_are_closed_and_do_not_keep_others_out(
    server: GuardedServer, cast: Cast, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(security_protocol, "HEAD_S", 0.5)
    lines = [socket.create_connection(("127.0.0.1", server.port), timeout=30) for _ in range(50)]
    try:
        for line in lines:
            line.sendall(b"GET /api/v1/health HTTP/1.1\r\nHost: loc")
        assert cast.operator.ask("POST", "/stop", json={}).status_code == 200
        for line in lines:
            assert line.recv(100) == b""
    finally:
        for line in lines:
            line.close()


@pytest.mark.long
def test_who_does_not_read_the_answers_is_cut_off(
    server: GuardedServer, cast: Cast, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(security_protocol, "DRAIN_S", 0.5)
    head = (
        "GET /api/v1/openapi.json HTTP/1.1\r\nHost: localhost\r\n"
        f"Cookie: servodeck={cast.operator.cookie}\r\n\r\n"
    )
    known = set(server.connections)
    with socket.socket() as line:
        line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8192)
        line.connect(("127.0.0.1", server.port))
        line.sendall(head.encode() * 60)
        (stuck,) = until(lambda: set(server.connections) - known, 5)
        until(lambda: stuck not in server.connections, 10, "the connection is given up")
        assert stuck.transport.get_write_buffer_size() == 0
    assert cast.operator.ask("GET", "/health").status_code == 200


# --- guessing -------------------------------------------------------------------------


def try_in(server: GuardedServer, name: str, password: str = "wrong password") -> httpx.Response:
    return httpx.post(
        f"{server.url}/api/v1/session",
        json={"name": name, "password": password},
        timeout=30,
        verify=NO_CERTIFICATES,
    )


def test_guessing_a_password_gets_slower_and_does_not_tell_names(server: GuardedServer) -> None:
    server.run(server.people.accounts.add("Gustav", PASSWORD, Role.OPERATOR))
    unknown, known = try_in(server, "Nobody here"), try_in(server, "Gustav")
    assert unknown.status_code == known.status_code == 401
    assert unknown.json() == known.json()
    for _ in range(4):
        assert try_in(server, "gustav").status_code == 401
    blocked = try_in(server, "GUSTAV", PASSWORD)
    assert blocked.status_code == 429, "the right password must not be found by guessing on"
    assert int(blocked.headers["Retry-After"]) >= 1
    # Somebody else is not kept out.
    assert try_in(server, NAMES[Role.VIEWER], PASSWORD).status_code == 200


def test_waits_double_up_to_a_quarter_of_an_hour() -> None:
    now = 0.0
    throttle = Throttle(5, lambda: now)
    waits = []
    for _ in range(20):
        throttle.failed("x")
        waits.append(throttle.wait_s("x"))
        now += throttle.wait_s("x")
    assert waits[:8] == [0, 0, 0, 0, 2, 4, 8, 16]
    assert waits[-1] == LONGEST_WAIT_S == 900
    now += 3601
    assert throttle.wait_s("x") == 0


@pytest.mark.long
def test_a_password_costs_what_rfc_9106_asks() -> None:
    """Second recommendation of clause 4: 64 MiB and three passes."""
    kept = Passwords(DEFAULT)
    assert kept.decoy.startswith("$argon2id$v=19$m=65536,t=3,")
    assert extract_parameters(kept.decoy) == extract_parameters(kept.hash(PASSWORD))
    with pytest.raises(VerifyMismatchError):  # it is decoded and hashed, so that it takes as long
        DEFAULT.verify(kept.decoy, PASSWORD)
    assert kept.verify(kept.hash(PASSWORD), PASSWORD)
    assert not kept.verify(kept.hash(PASSWORD), PASSWORD + " ")
    assert not Passwords(PasswordHasher(1, 8, 1)).verify("no hash", PASSWORD)


def test_no_secret_is_kept_or_reported(server: GuardedServer, cast: Cast) -> None:
    script = server.token(Role.OPERATOR, Right.LOOK)
    reported = [
        caller.ask("GET", path).text
        for caller in (cast.administrator, cast.guest)
        for path in ("/accounts", "/sessions", "/tokens", "/log", "/people", "/invitations",
                     "/chat", "/audit")
    ]  # fmt: skip
    files = [f.read_bytes() for f in Path(server.folder).rglob("*") if f.is_file()]
    for secret in (PASSWORD, cast.operator.cookie, cast.guest.cookie, script.token):
        assert secret
        assert not any(secret in text for text in reported)
        assert not any(secret.encode() in data for data in files)
    database = next(Path(server.folder).glob("servodeck.db"))
    assert database.stat().st_mode & 0o077 == 0, "only its user may read it"


def test_cookies_are_for_the_browser_alone(server: GuardedServer) -> None:
    flags = try_in(server, NAMES[Role.VIEWER], PASSWORD).headers["set-cookie"].lower()
    assert "httponly" in flags
    assert "samesite=strict" in flags
    assert "domain" not in flags
    behind = httpx.post(
        f"{server.url}/api/v1/session",
        json={"name": NAMES[Role.VIEWER], "password": PASSWORD},
        headers={"X-Forwarded-Proto": "https"},
        timeout=30,
    ).headers["set-cookie"]
    assert "__Host-" not in behind, "a proxy is believed only where one was announced"


def test_headers_of_every_answer(server: GuardedServer, cast: Cast) -> None:
    for answer in (
        cast.nobody.http.get(server.url + "/"),
        cast.nobody.ask("GET", "/drives"),
        cast.operator.ask("GET", "/drives"),
        cast.operator.ask("GET", "/nothing"),
        cast.operator.ask("POST", "/scan", content=b"x" * (2 << 20)),
    ):
        assert "frame-ancestors 'self'" in answer.headers["Content-Security-Policy"]
        assert (
            "unsafe-inline" not in answer.headers["Content-Security-Policy"].split("style-src")[0]
        )
        assert answer.headers["X-Content-Type-Options"] == "nosniff"
        assert answer.headers["Referrer-Policy"] == "no-referrer"
        assert "server" not in answer.headers
    assert cast.operator.ask("GET", "/drives").headers["Cache-Control"] == "no-store"


# --- set-up and tokens ----------------------------------------------------------------


def test_the_first_administrator_needs_the_code(tmp_path: Path) -> None:
    server = GuardedServer(tmp_path).start()
    try:
        nobody = Caller(server)
        assert nobody.ask("GET", "/session").json()["setup_required"]
        body = {"name": "Anna", "password": PASSWORD, "code": "AAAA-AAAA-AAAA"}
        assert nobody.ask("POST", "/setup", json=body).status_code == 403
        good = body | {"code": server.people.accounts.setup_code.lower().replace("-", " ")}
        weak = nobody.ask("POST", "/setup", json=good | {"password": "short"})
        assert weak.status_code == 409
        assert "10 to 200" in weak.json()["detail"]
        assert nobody.ask("POST", "/setup", json=good).status_code == 201
        again = Caller(server).ask("POST", "/setup", json=good | {"name": "Mallory"})
        assert again.status_code == 403, "the code works once"
    finally:
        server.stop()


def test_a_token_does_no_more_than_its_scopes_and_its_owner(
    server: GuardedServer, cast: Cast
) -> None:
    viewer = server.log_in(Role.VIEWER)
    beyond = viewer.ask("POST", "/tokens", json={"name": "t", "scopes": ["look", "motion"]})
    assert beyond.status_code == 409
    made = viewer.ok("POST", "/tokens", {"name": "t", "scopes": ["look"], "days": 1})
    script = Caller(server, token=made["secret"])
    assert script.ask("GET", "/drives").status_code == 200
    assert script.ask("POST", "/tokens", json={"name": "u", "scopes": ["look"]}).status_code == 403
    assert script.ask("GET", "/sessions").status_code == 403
    try:
        server.ahead = timedelta(days=1, minutes=1)
        assert script.ask("GET", "/drives").status_code == 401
    finally:
        server.ahead = timedelta(0)
    assert script.ask("GET", "/drives").status_code == 200
    assert viewer.ask("DELETE", f"/tokens/{made['token']['id']}").status_code == 204
    assert script.ask("GET", "/drives").status_code == 401
    other = cast.operator.ok("POST", "/tokens", {"name": "o", "scopes": ["look"]})
    assert viewer.ask("DELETE", f"/tokens/{other['token']['id']}").status_code == 404


def test_the_last_administrator_stays(server: GuardedServer, cast: Cast) -> None:
    anna = next(a for a in cast.administrator.ok("GET", "/accounts") if a["name"] == "Anna")
    for method, body in (("DELETE", None), ("PATCH", {"role": "viewer"})):
        answer = cast.administrator.ask(method, f"/accounts/{anna['id']}", json=body)
        assert answer.status_code == 409
        assert "only administrator" in answer.json()["detail"]


def test_a_new_password_ends_the_other_sessions(server: GuardedServer) -> None:
    server.run(server.people.accounts.add("Paula", PASSWORD, Role.OPERATOR))
    first, second = (
        Caller(server, cookie=try_in(server, "Paula", PASSWORD).cookies["servodeck"])
        for _ in range(2)
    )
    wrong = {"present": "not this one", "password": "seven green apples"}
    assert first.ask("PUT", "/session/password", json=wrong).status_code == 403
    first.ok("PUT", "/session/password", wrong | {"present": PASSWORD})
    assert first.ask("GET", "/drives").status_code == 200
    assert second.ask("GET", "/drives").status_code == 401


# --- names of files, and text ---------------------------------------------------------

EVIL = ["../x", "..", "../../etc/passwd", "..%2f..%2fetc%2fpasswd", "/etc/passwd", "a/../../b",
        "..\\..\\x", ".hidden", "x\x00.toml", "con\r\nSet-Cookie: a=b", "%2e%2e%2fx", "~root",
        "x" * 300]  # fmt: skip


@pytest.mark.long(keep=11)
@pytest.mark.parametrize("name", EVIL, ids=repr)
def test_a_file_name_leads_nowhere_else(server: GuardedServer, cast: Cast, name: str) -> None:
    outside = {p for p in Path(server.folder).parent.rglob("*") if server.folder not in p.parents}
    quoted = name.encode().hex()
    escaped = "".join(f"%{quoted[i : i + 2]}" for i in range(0, len(quoted), 2))
    for method, path in (
        ("GET", "/sets/{}"), ("PUT", "/sets/{}"), ("DELETE", "/sets/{}"),
        ("GET", "/recordings/{}/file"), ("DELETE", "/recordings/{}"), ("GET", "/bundles/{}"),
        ("GET", "/measurements/{}/file"), ("DELETE", "/measurements/{}"),
        ("GET", "/scope/snapshots/{}"), ("PUT", "/scope/setups/{}"), ("DELETE", "/reports/{}"),
        ("GET", "/reports/{}"),
    ):  # fmt: skip
        for written in (escaped, name.replace("\x00", "%00").replace("\r\n", "%0d%0a")):
            body = {"content": b"x"} if method == "PUT" else {}
            answer = cast.operator.ask(method, path.format(written), **body)
            assert 400 <= answer.status_code < 500, (method, path, written, answer.text[:200])
            assert "set-cookie" not in answer.headers
            assert b"root:" not in answer.content
    after = {p for p in Path(server.folder).parent.rglob("*") if server.folder not in p.parents}
    assert after == outside


def test_entries_of_an_uploaded_zip_lead_nowhere(server: GuardedServer, cast: Cast) -> None:
    """Files that are zip archives inside are read, never unpacked to names of their own."""
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        archive.writestr("../../../../tmp/servodeck-evil.txt", "evil")
        archive.writestr("/tmp/servodeck-evil.txt", "evil")
    for method, path in (
        ("POST", "/descriptions/devices?file=x.zip"),
        ("PUT", "/sets/x"),
        ("POST", "/measurements?name=x"),
        ("POST", "/scope/snapshots/x"),
        ("POST", "/sets/list?file=x"),
    ):
        answer = cast.operator.ask(method, path, content=data.getvalue())
        assert answer.status_code < 500, (path, answer.text[:200])
        assert answer.status_code >= 400 or answer.json() == [], path
    assert not Path("/tmp/servodeck-evil.txt").exists()


MARKUP = "<script>alert(1)</script><img src=x onerror=alert(1)>"


def test_markup_in_free_text_stays_text(server: GuardedServer, cast: Cast) -> None:
    """It comes back as it was given, only ever as JSON that no browser takes for a page."""
    cast.operator.ok("PATCH", "/drives/x", {"name": MARKUP[:40], "notes": MARKUP})
    cast.administrator.ok(
        "POST", "/accounts", {"name": MARKUP[:50], "role": "viewer", "password": PASSWORD}
    )
    cast.operator.ok("POST", "/invitations", {"guest": MARKUP[:50], "minutes": 5})
    with cast.operator.live() as page:
        page.send(type="chat", text=MARKUP)
        assert page.wait("chat_said")["text"] == MARKUP
    for path in ("/drives", "/accounts", "/invitations", "/chat", "/log"):
        answer = cast.administrator.ask("GET", path)
        assert answer.headers["content-type"] == "application/json"
        assert "<script>" in answer.text or "<script>alert(1)</script><img" in answer.text
    refused = cast.operator.ask("GET", f"/drives/{MARKUP.replace('/', '')}")
    assert refused.headers["content-type"] == "application/problem+json"
    cast.operator.ok("PATCH", "/drives/x", {"name": "X", "notes": ""})


def test_bad_names_of_people(server: GuardedServer, cast: Cast) -> None:
    for name in ("", " ", "a\nb", "a\x00b", "x" * 61, "ＡＮＮＡ"):
        answer = cast.administrator.ask(
            "POST", "/accounts", json={"name": name, "role": "viewer", "password": PASSWORD}
        )
        assert answer.status_code in (409, 422), name


# --- one user, without accounts -------------------------------------------------------


def test_the_one_user_of_a_machine_is_asked_nothing_but_guests_cannot_come(tmp_path: Path) -> None:
    server = GuardedServer(tmp_path, accounts=False).start()
    try:
        me = Caller(server)
        assert me.ask("GET", "/session").json()["role"] == "administrator"
        assert me.ask("GET", "/drives").status_code == 200
        for headers in (
            {"Host": "evil.example"},
            {"Origin": "http://evil.example"},
            {"Sec-Fetch-Site": "cross-site"},
        ):
            assert me.ask("POST", "/stop", json={}, headers=headers).status_code == 403
        refused = me.ask("POST", "/invitations", json={"guest": "Gert"})
        assert refused.status_code == 409
        assert "--accounts" in refused.json()["remedy"]
    finally:
        server.stop()
    until(lambda: True)
