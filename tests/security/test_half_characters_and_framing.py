"""Text that is none, bodies with two ends, lists that are programs, and a folder that is gone."""

from __future__ import annotations

import csv
import io
import json
import shutil
import socket
from pathlib import Path

import pytest

from backend.api.security.body import has_half_characters
from backend.foundation.store.spreadsheet import as_text
from backend.records.recording.bundle import _table
from tests.security.conftest import Cast
from tests.support.guarded import Caller, GuardedServer

HALF = "\ud800"

BODIES = [
    ("PUT", "/drives/x/parameters/2005:03", {"raw": HALF}),
    ("PUT", "/drives/x/parameters", {"values": {HALF: 1}}),
    ("PATCH", "/drives/x", {"name": HALF, "notes": ""}),
    ("PATCH", "/drives/x", {"notes": f"ok {HALF}"}),
    ("POST", "/accounts", {"name": HALF, "role": "viewer", "password": "eleven blue horses"}),
    ("POST", "/session", {"name": HALF, "password": "eleven blue horses"}),
    ("POST", "/session", {"name": "Anna", "password": f"{HALF * 20}abc"}),
    ("PUT", "/session/password", {"present": HALF * 12, "password": HALF * 12}),
    ("POST", "/tokens", {"name": HALF, "scopes": ["look"]}),
    ("POST", "/invitations", {"guest": HALF, "minutes": 5}),
    ("POST", "/guests", {"link": HALF, "code": HALF}),
    ("POST", "/scan", {"url": f"mlink:///dev/{HALF}"}),
    ("POST", "/drives", {"url": "mlink:///dev/x", "station": 1, "profile": HALF}),
    ("POST", "/stop", {"drive": HALF}),
    ("POST", "/drives/x/tune/undo", {"before": {HALF: 1}}),
    ("POST", "/drives/x/sets", {"file": HALF, "author": HALF, "notes": HALF}),
    ("PUT", "/drives/x/mechanics", {"name": HALF}),
    ("POST", "/recordings", {"name": HALF}),
    ("POST", "/reports", {"title": HALF}),
]


@pytest.mark.long
@pytest.mark.parametrize(("method", "path", "body"), BODIES, ids=lambda part: ascii(part)[:40])
def test_half_a_character_is_refused(
    cast: Cast, method: str, path: str, body: dict[str, object]
) -> None:
    answer = cast.administrator.ask(
        method,
        path,
        content=json.dumps(body).encode(),
        headers={"Content-Type": "application/json"},
    )
    assert 400 <= answer.status_code < 500, answer.text
    assert cast.administrator.ask("GET", "/drives").status_code == 200


def test_the_one_that_was_found_is_422(cast: Cast) -> None:
    answer = cast.operator.ask("PUT", "/drives/x/parameters/2005:03", content=b'{"raw":"\\ud800"}')
    assert answer.status_code == 422
    assert "surrogate" in answer.json()["detail"]
    assert "\\" in answer.json()["detail"]


FILES = [
    ("PUT", "/sets/half"),
    ("POST", "/sets/list?file=half.csv&profile=mms7"),
    ("POST", "/measurements?name=half"),
    ("POST", "/scope/snapshots/half"),
    ("PUT", "/scope/setups/half"),
    ("POST", "/descriptions"),
]


@pytest.mark.parametrize(("method", "path"), FILES)
def test_half_a_character_in_a_file_is_no_defect(cast: Cast, method: str, path: str) -> None:
    for content in (
        json.dumps({"name": HALF, HALF: HALF, "kind": HALF, "text": HALF}).encode(),
        f'name = "{chr(92)}ud800"\n'.encode(),
        b"key,raw\n" + HALF.encode("utf-8", "surrogatepass"),
    ):
        answer = cast.operator.ask(method, path, content=content)
        assert answer.status_code < 500, answer.text
    for listed in ("/sets", "/measurements", "/scope/setups", "/library"):
        assert cast.operator.ask("GET", listed).status_code < 500


def test_half_a_character_in_an_address_is_no_defect(cast: Cast) -> None:
    for path in (
        "/drives/%ED%A0%80",
        "/sets/%ED%A0%80",
        "/audit?words=%ED%A0%80",
        "/measurements/%ED%A0%80/file",
        "/recordings/%ED%A0%80/file",
    ):
        assert 200 <= cast.administrator.ask("GET", path).status_code < 500


def test_half_a_character_in_a_message_is_refused(cast: Cast) -> None:
    with cast.operator.live() as page:
        for text in (
            '{"type":"chat","text":"\\ud800"}',
            '{"type":"\\ud800"}',
            '{"type":"lease","drive":"\\ud800"}',
        ):
            page.socket.send(text)
        page.send(type="ping", n=1)
        while True:
            got = page.receive(10)
            if got["type"] == "pong":
                break
            assert got["type"] != "chat_said", got
    assert cast.operator.ask("GET", "/chat").status_code == 200


def test_whole_characters_pass() -> None:
    for body in (b'"\\ud83d\\ude00"', b'"\\\\ud800"', b'"ud800"', b"\\ud800", b"", b"[" * 100_000):
        assert not has_half_characters(body)
    for body in (
        b'"\\ud800"',
        b'"\\uDC00\\uD800"',
        b'{"\\udfff": 1}',
        b'[[["\\ud83dx"]]]',
        b'"\\\\\\ud800"',
    ):
        assert has_half_characters(body)


# --- framing --------------------------------------------------------------------------


def raw(server: GuardedServer, head: str, body: bytes) -> bytes:
    with socket.create_connection(("127.0.0.1", server.port), timeout=30) as line:
        line.sendall(head.encode() + body)
        answer = b""
        while part := line.recv(65536):
            answer += part
    return answer


@pytest.mark.parametrize(
    "framing",
    [
        "Content-Length: 30\r\nTransfer-Encoding: chunked",
        "Content-Length: 5\r\nContent-Length: 6",
        "Transfer-Encoding: chunked\r\nContent-Length: 5",
        "Transfer-Encoding: chunked\r\nTransfer-Encoding: identity",
    ],
)
@pytest.mark.parametrize("path", ["/stop", "/session"])
def test_a_body_with_two_ends_is_refused(
    server: GuardedServer, cast: Cast, path: str, framing: str
) -> None:
    """One request, one answer: what a proxy took for the body is no second request."""
    head = (
        f"POST /api/v1{path} HTTP/1.1\r\nHost: localhost\r\nCookie: servodeck="
        f"{cast.operator.cookie}\r\nContent-Type: application/json\r\n{framing}\r\n\r\n"
    )
    answer = raw(server, head, b"2\r\n{}\r\n0\r\n\r\nGET /api/v1/health HTTP/1.1\r\n\r\n")
    status = answer.split(b"\r\n")[0]
    assert b" 400 " in status or b" 501 " in status, answer
    assert answer.count(b"HTTP/1.1 ") == 1


# --- lists ----------------------------------------------------------------------------

FORMULAS = ['=HYPERLINK("http://x")', "+1", "-2+3", "@SUM(A1)", "\t=1", "\r=1", " =1", "＝1"]


@pytest.mark.parametrize("name", FORMULAS, ids=ascii)
def test_names_in_lists_are_text(name: str) -> None:
    assert as_text(name) == f"'{name}"
    _, cells = csv.reader(io.StringIO(_table(["x"], [[name, -5, "a=b"]]), newline=""))
    assert cells[0] == f"'{name}"
    assert cells[1:] == ["-5", "a=b"]


# --- the state folder -----------------------------------------------------------------


def test_a_state_folder_that_is_gone_is_reported(tmp_path: Path) -> None:
    server = GuardedServer(tmp_path / "station", accounts=False)
    (tmp_path / "station").mkdir()
    server.start()
    try:
        me = Caller(server)
        assert me.ok("GET", "/audit/status")["problem"] == ""
        shutil.rmtree(tmp_path / "station")
        assert "no longer exists" in me.ok("GET", "/audit/status")["problem"]
        assert me.ask("POST", "/stop", json={}).status_code == 200
        status = me.ok("GET", "/audit/status")
        assert str(tmp_path / "station") in status["problem"]
    finally:
        server.stop()


def test_a_database_that_was_replaced_is_reported(tmp_path: Path) -> None:
    server = GuardedServer(tmp_path, accounts=False).start()
    try:
        me = Caller(server)
        database = tmp_path / "servodeck.db"
        copy = tmp_path / "copy"
        shutil.copy(database, copy)
        copy.replace(database)
        assert "removed or replaced" in me.ok("GET", "/audit/status")["problem"]
    finally:
        server.stop()
