"""Every route and message that changes something leaves its line in the audit: who, what, values.

Routes show it in one of two ways (see `backend.api.records.audit.audited`): where it happens, which
is asked of each of them here with a real request, or by the wrapper around all routes, which is
asked with every route that there is.
"""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import pytest

from backend.api.messages.models import JobInfo
from backend.api.records.audit.audited import CHANGES_NOTHING, REPORTED_THERE, AuditedAnswers
from backend.api.security.rights import API, ROUTES
from backend.foundation.people.rights import Role
from backend.records.audit import Fact
from tests.security.conftest import Cast
from tests.security.test_every_route import address
from tests.support.guarded import PASSWORD, Caller, GuardedServer
from tests.support.station import until

CHANGING = {key for key in ROUTES if key.split(" ")[0] not in ("GET", "WS")}
#: The first administrator is made on a station of its own, in test_bodies_and_guessing; drives are
#: connected over real buses in tests/api/test_two_ports.
ELSEWHERE = {f"POST {API}{path}" for path in ("/setup", "/drives", "/drives/{drive_id}/ports")}
SUCCESS = ("200", "201", "202")


# --- routes that are shown by the wrapper ----------------------------------------------


@dataclass
class Heard:
    """What the wrapper shows, in place of the audit."""

    facts: list[Fact] = field(default_factory=list)
    problem: str = ""

    def add(self, fact: Fact) -> None:
        self.facts.append(fact)

    async def settled(self, _timeout_s: float) -> bool:
        return True


def through_wrapper(operation: str, body: bytes, status: int = 200) -> list[Fact]:
    """What is informed of one request when the application only says that it went well."""
    method, path = operation.split(" ")
    heard = Heard()

    async def application(_scope: Any, receive: Any, send: Any) -> None:
        while (await receive()).get("more_body"):
            pass
        await send({"type": "http.response.start", "status": status, "headers": []})

    async def receive() -> dict[str, object]:
        return {"type": "http.request", "body": body}

    async def send(_message: object) -> None:
        return None

    wrapper = AuditedAnswers(application, heard, str.upper, f"{API}/stop")
    scope = {"type": "http", "method": method, "path": address(path), "query_string": b"url=u%3A1"}
    asyncio.run(wrapper(scope, receive, send))  # type: ignore[arg-type]
    return heard.facts


@pytest.mark.long
def test_each_change_is_reported_by_one_or_the_other(server: GuardedServer) -> None:
    assert REPORTED_THERE <= CHANGING
    assert CHANGES_NOTHING <= CHANGING
    assert not REPORTED_THERE & CHANGES_NOTHING
    asked = {f"{each.method} {API}{each.path}" for each in REQUESTS}
    assert REPORTED_THERE - jobs(server) - ELSEWHERE - asked == set()


def test_every_other_change_is_reported_by_the_wrapper() -> None:
    body = {"name": "n", "password": "hidden", "list": [1, 2]}
    for operation in CHANGING - REPORTED_THERE - CHANGES_NOTHING:
        method, path = operation.split(" ")
        (fact,) = through_wrapper(operation, json.dumps(body).encode())
        assert fact.target == address(path).removeprefix(API)
        assert fact.action in ("made", "changed", "deleted")
        assert fact.new == '{"url":"u:1","name":"n","list":"[1,2]"}', operation
        assert fact.axis == ("NOWHERE" if "{drive_id}" in path else "")
        assert through_wrapper(operation, b"", status=409) == [], method


@pytest.mark.parametrize("body", [b"", b"\x00\xff", b"[1]", b"[" * 5000, b"{" + b" " * 9000 + b"}"])
def test_a_body_that_is_no_small_json_hinders_nothing(body: bytes) -> None:
    (fact,) = through_wrapper(f"PUT {API}/scope/setups/{{name}}", body)
    assert fact.new == '{"url":"u:1"}'


def jobs(server: GuardedServer) -> set[str]:
    """Routes that answer with a job. Each job is shown by one listener, whatever it does."""
    return {
        f"{method.upper()} {path}"
        for path, known in server.interface["paths"].items()
        for method, operation in known.items()
        if f"/{JobInfo.__name__}" in json.dumps([operation["responses"].get(c) for c in SUCCESS])
    }


# --- routes that show it themselves ---------------------------------------------------


class Scene:
    """A station with everybody, what was made on it so far, and what its audit says."""

    def __init__(self, server: GuardedServer, cast: Cast) -> None:
        self.server, self.cast = server, cast
        self.made: dict[str, Any] = {}

    def caller(self, who: str) -> Caller:
        found = self.made.get(who) or getattr(self.cast, who)
        assert isinstance(found, Caller)
        return found

    def since(self, number: int) -> list[dict[str, Any]]:
        until(lambda: self.server.bench.audit.pending == 0)
        page = self.cast.administrator.ok("GET", "/audit?limit=200")
        return [each for each in page["events"] if each["number"] > number]

    def head(self) -> int:
        return max((each["number"] for each in self.since(0)), default=0)

    def entry(self) -> str:
        """Id of the set in the library."""
        found = self.cast.operator.ok("GET", "/library")["entries"]
        return str(next(each["id"] for each in found if each["name"] == "reported.sdset"))

    def vera(self) -> str:
        """Another log-in of the viewer's; its id."""
        self.made["vera"] = self.server.log_in(Role.VIEWER)
        sessions = self.made["vera"].ok("GET", "/sessions")
        return str(max(sessions, key=lambda each: each["created"])["id"])


Found = Callable[[Scene], object]


@dataclass(frozen=True)
class Ask:
    """A request, and what must be found in one of the entries that it leaves.

    ``fill`` are the places in the path; functions give what is known only by then. ``keep`` is
    the name of the answer for later. A name with a dot is looked for in the entry's detail.
    """

    method: str
    path: str
    reported: Mapping[str, object]
    fill: Mapping[str, str | Found] = field(default_factory=dict)
    who: str = "operator"
    options: Mapping[str, object] = field(default_factory=dict)
    keep: str = ""
    query: str = ""
    first: Found = lambda _scene: None
    body: Found | None = None


X = "/drives/{drive_id}"
ON_X: dict[str, str | Found] = {"drive_id": "x"}
GAIN = ON_X | {"key": "2005:03"}
SIMULATED = ON_X | {"name": "simulation"}
FILE: dict[str, str | Found] = {"file": "reported.sdset"}
OLAF = {"person": "Olaf"}
BY_OLAF = OLAF | {"axis": "X"}
BY_ANNA = {"person": "Anna"}
ENTRY: dict[str, str | Found] = {"entry_id": Scene.entry}
INVITED: dict[str, str | Found] = {
    "invitation_id": lambda scene: scene.made["invitation"]["invitation"]["id"]
}
ACCOUNT: dict[str, str | Found] = {"account_id": lambda scene: scene.made["account"]["id"]}
NOTCH = {"center_hz": 300.0, "width_hz": 60.0, "depth_db": -20.0}


def joining(scene: Scene) -> dict[str, str]:
    made = scene.made["invitation"]
    return {"link": made["link"].removeprefix("/guest/"), "code": made["invitation"]["code"]}


def settled(scene: Scene) -> None:
    """No job runs any more."""
    jobs_now = scene.server.bench.jobs
    until(lambda: all(job.state != "running" for job in jobs_now.all()))


#: Control words that were sent meanwhile: the first, the last and how many.
SENT = re.compile(r"^\d+( → \d+ \(\d+×\))?$")

REQUESTS = [
    Ask("PUT", f"{X}/parameters/{{key}}", BY_OLAF | {
        "kind": "write", "target": "2005:03", "old": 2000, "new": 41}, GAIN,
        options={"json": {"raw": 41}},
        first=lambda scene: scene.cast.operator.ok("GET", "/drives/x/parameters/2005:03")),
    Ask("PUT", f"{X}/parameters", BY_OLAF | {
        "kind": "write", "target": "2005:03", "old": 41, "new": 42}, ON_X,
        options={"json": {"values": {"2005:03": {"raw": 42}}}}),
    Ask("PUT", f"{X}/motion-settings/{{key}}", BY_OLAF | {
        "kind": "write", "target": "200B:07", "new": 1, "detail.reason": "test"},
        ON_X | {"key": "200B:07"}, options={"json": {"raw": 1, "reason": "test"}}),
    Ask("POST", f"{X}/transition", BY_OLAF | {
        "kind": "motion", "action": "started", "detail.goal": "Ready to switch on"}, ON_X,
        options={"json": {"goal": "Ready to switch on"}}),
    Ask("POST", f"{X}/fault-reset", BY_OLAF | {
        "kind": "motion", "action": "done", "detail.6040:00": SENT}, ON_X,
        first=lambda scene: scene.server.servo.trip()),
    # one listener shows all jobs, so that this one and the move below stand for the others
    Ask("POST", f"{X}/procedures/{{name}}", BY_OLAF | {
        "kind": "procedure", "action": "started", "detail.title": "Write settings: X"},
        ON_X | {"name": "write_settings"}, options={"json": {}}),
    Ask("PUT", f"{X}/io/probes/{{number}}", BY_OLAF | {"kind": "write", "target": "60B8:00"},
        ON_X | {"number": "1"}, options={"json": {"on": True}}),
    Ask("POST", f"{X}/io/forcing/{{name}}", BY_OLAF | {"kind": "job", "action": "started"},
        SIMULATED, options={"json": {"confirmed": True}}, first=settled),
    Ask("PUT", f"{X}/io/forcing/{{name}}", BY_OLAF | {"kind": "write"}, SIMULATED,
        options={"json": {"values": {"DI1": True}}}),
    Ask("DELETE", f"{X}/io/forcing/{{name}}", {"action": "deleted", "person": "Vera"}, SIMULATED,
        "viewer"),
    Ask("PUT", f"{X}/notches", BY_OLAF | {"kind": "write"}, ON_X,
        options={"json": {"notches": [NOTCH]}}),
    Ask("PUT", f"{X}/gains", BY_OLAF | {"kind": "write"}, ON_X, options={"json": {"level": 12}},
        keep="gains"),
    Ask("POST", f"{X}/tune/undo", BY_OLAF | {"kind": "write"}, ON_X,
        body=lambda scene: scene.made["gains"]),
    Ask("POST", f"{X}/sets", BY_OLAF | {"kind": "file", "target": "reported.sdset"}, ON_X,
        options={"json": {"file": "reported"}}),
    Ask("PUT", "/sets/{file}", OLAF | {"kind": "file", "target": "reported.sdset"}, FILE,
        query="?overwrite=true",
        first=lambda scene: scene.made.update(
            file=scene.cast.operator.ask("GET", "/sets/reported.sdset").content)),
    Ask("POST", "/sets/list", OLAF | {"kind": "file", "target": "listed.sdset"},
        query="?profile=mms7&file=listed", options={"content": b"key,raw\n2005:03,41\n"}),
    Ask("PATCH", "/library/{entry_id}", OLAF | {"kind": "file", "target": "reported.sdset"}, ENTRY,
        options={"json": {"notes": "reported", "tags": ["a"]}}),
    Ask("DELETE", "/library/{entry_id}", OLAF | {"kind": "file", "action": "deleted"}, ENTRY),
    Ask("DELETE", "/sets/{file}", OLAF | {"kind": "file", "action": "deleted"},
        {"file": "listed.sdset"}),
    Ask("POST", "/stop", BY_OLAF | {"kind": "stop", "action": "pressed"}),
    Ask("POST", f"{X}/jobs/move", BY_OLAF | {
        "kind": "motion", "action": "started", "detail.mode": "PP", "detail.target": 0.25,
        "detail.travel_limit": 1.0, "detail.torque_limit": 50.0}, ON_X,
        options={"json": {"mode": "PP", "target": 0.25, "speed": 60, "travel_limit": 1,
                          "torque_limit": 50, "relative": True}}, keep="move"),
    Ask("DELETE", "/jobs/{job_id}", {"kind": "job", "action": "deleted", "person": "Vera"},
        {"job_id": lambda scene: scene.made["move"]["id"]}, "viewer"),
    # people
    Ask("POST", "/session", {"person": "Vera", "kind": "login", "action": "logged in"}, {},
        "nobody", {"json": {"name": "Vera", "password": PASSWORD}}),
    Ask("POST", "/accounts", BY_ANNA | {
        "kind": "account", "action": "made", "target": "Theo", "new": "viewer"}, {},
        "administrator",
        {"json": {"name": "Theo", "role": "viewer", "password": PASSWORD}}, "account"),
    Ask("PATCH", "/accounts/{account_id}", BY_ANNA | {
        "action": "role changed", "target": "Theo", "old": "viewer", "new": "operator"}, ACCOUNT,
        "administrator", {"json": {"role": "operator"}}),
    Ask("DELETE", "/accounts/{account_id}", BY_ANNA | {"action": "deleted", "target": "Theo"},
        ACCOUNT, "administrator"),
    Ask("POST", "/tokens", OLAF | {"action": "token made", "target": "reported", "new": "look"}, {},
        options={"json": {"name": "reported", "scopes": ["look"]}}, keep="token"),
    Ask("DELETE", "/tokens/{token_id}", OLAF | {"action": "token revoked", "target": "reported"},
        {"token_id": lambda scene: scene.made["token"]["token"]["id"]}),
    Ask("POST", "/invitations", OLAF | {
        "kind": "invitation", "action": "made", "target": "Gina", "new": "parameters, 5 min"}, {},
        options={"json": {"guest": "Gina", "minutes": 5, "allowed": ["parameters"]}},
        keep="invitation"),
    Ask("POST", "/guests", {"person": "Gina (guest)", "action": "joined"}, {}, "nobody",
        body=joining),
    Ask("PUT", "/invitations/{invitation_id}/grant", OLAF | {
        "action": "granted", "target": "Gina", "new": "parameters, 2 min"}, INVITED,
        options={"json": {"rights": ["parameters"], "minutes": 2}}),
    Ask("DELETE", "/invitations/{invitation_id}/grant", OLAF | {
        "action": "grant withdrawn", "target": "Gina"}, INVITED),
    Ask("DELETE", "/invitations/{invitation_id}", OLAF | {"action": "ended", "target": "Gina"},
        INVITED),
    Ask("DELETE", "/sessions/{session_id}", BY_ANNA | {
        "kind": "login", "action": "session ended", "target": "Vera"},
        {"session_id": Scene.vera}, "administrator"),
    Ask("PUT", "/session/password", {"person": "Vera", "action": "password changed"}, {}, "vera",
        {"json": {"present": PASSWORD, "password": PASSWORD + "s"}}, first=Scene.vera),
    Ask("DELETE", "/session", {"person": "Vera", "action": "logged out"}, {}, "vera"),
    Ask("DELETE", X, BY_OLAF | {"kind": "station", "action": "taken off the bench"}, ON_X),
]  # fmt: skip


def agrees(entry: Mapping[str, Any], reported: Mapping[str, object]) -> bool:
    flat = {**entry, **{f"detail.{key}": value for key, value in entry["detail"].items()}}
    return all(
        value.search(str(flat.get(key)))
        if isinstance(value, re.Pattern)
        else flat.get(key) == value
        for key, value in reported.items()
    )


@pytest.mark.long
def test_each_change_tells_who_did_what_from_what_to_what(
    server: GuardedServer, cast: Cast
) -> None:
    scene, silent = Scene(server, cast), []
    for each in REQUESTS:
        each.first(scene)
        fill = {k: v if isinstance(v, str) else str(v(scene)) for k, v in each.fill.items()}
        options: dict[str, Any] = dict(each.options)
        if each.body is not None:
            options["json"] = each.body(scene)
        if each.method == "PUT" and each.path == "/sets/{file}":
            options["content"] = scene.made["file"] + b"# again\n"
        before = scene.head()
        cast.nobody.http.cookies.clear()
        path = each.path.format(**fill) + each.query
        answer = scene.caller(each.who).ask(each.method, path, **options)
        assert answer.is_success, (each.method, path, answer.text)
        if each.keep:
            scene.made[each.keep] = answer.json()
        entries = scene.since(before)
        if not any(agrees(entry, each.reported) for entry in entries):
            silent.append((each.method, path, each.reported, entries))
    assert silent == []
