"""Every route with everybody who may not move: no grant is given, and no motion begins.

What is sent is what a page would send, so that it is not refused for its form alone.
"""

from __future__ import annotations

import ast
import json
from pathlib import Path
from typing import Any

import pytest

from backend.api.security.rights import API, ROUTES
from backend.foundation.people.rights import Right, Role
from backend.tools.registry import TOOLS
from tests.security.test_every_route import ENDS_IT, address
from tests.support.guarded import Caller, GuardedServer

_ENVELOPE = {"travel_limit": 2, "speed_limit": 100, "torque_limit": 20, "time_limit_s": 5}
#: What a page sends to these, by the end of their path.
BODIES: dict[str, Any] = {
    "/transition": {"goal": "Operation enabled", "mode": 1},
    "/jobs/move": {"mode": "PP", "target": 1, "travel_limit": 2, "torque_limit": 10},
    "/jobs/home": {"method": 35, "travel_limit": 2, "torque_limit": 10, "timeout_s": 4},
    "/jobs/generate": {"mode": "CSP", "shape": "sine", "amplitude": 0.1, "duration_s": 1,
                       "frequency_hz": 1, "travel_limit": 1, "speed_limit": 60,
                       "torque_limit": 10},
    "/jobs/small_move": {"increments": 100, "torque_limit": 10, "travel_limit": 1},
    "/motion-settings/6060:00": {"raw": 3, "reason": "attack"},
    "/parameters/6060:00": {"raw": 3},
    "/parameters": {"values": {"6060:00": {"raw": 3}, "6040:00": {"raw": 15}}},
    "/stop": {},
}  # fmt: skip
#: Take the axis, the bus or the caller away; what they do to a motion is tested elsewhere.
_TAKES_AWAY = {f"DELETE {API}/drives/{{drive_id}}", f"DELETE {API}/buses", *ENDS_IT}
#: Rights that a token or an invitation may give without the two that move.
WITHOUT = [
    (Right.LOOK,),
    (Right.LOOK, Right.FILES),
    (Right.LOOK, Right.PARAMETERS),
    (Right.LOOK, Right.FILES, Right.PARAMETERS, Right.STATION, Right.INVITE),
]


def _body(path: str) -> dict[str, Any]:
    for end, body in BODIES.items():
        if path.endswith(end):
            return dict(body)
    return dict(_ENVELOPE) if "/jobs/" in path else {}


def _everything(caller: Caller) -> None:
    for operation in ROUTES:
        method, path = operation.split(" ")
        if method == "WS" or not path.startswith(API) or operation in _TAKES_AWAY:
            continue
        where = address(path, drive_id="x", key="6060:00", name="outputs")
        options = {} if method in ("GET", "DELETE") else {"json": _body(where)}
        caller.http.request(method, f"{caller.server.url}{where}", **options)


@pytest.mark.long
@pytest.mark.parametrize("rights", WITHOUT, ids="+".join)
def test_no_route_gives_a_grant_to_who_may_not_move(
    server: GuardedServer, rights: tuple[Right, ...]
) -> None:
    granted: list[str] = []

    def note(drive: str) -> None:
        granted.extend(str(grant.purpose) for grant in server.bench.authority._live(drive))

    server.call(lambda: server.bench.authority.listen(note))
    server.servo.written.clear()
    try:
        _everything(server.token(Role.ADMINISTRATOR, *rights))
        moving = server.call(lambda: server.bench.jobs.moving("x"))
    finally:
        server.call(lambda: server.bench.authority._listeners.remove(note))
    assert granted == []
    assert moving is None or not moving.stoppable
    assert [word for word in server.servo.words() if word & 0x0F == 0x0F] == []


def test_the_attack_above_would_be_seen(server: GuardedServer) -> None:
    """With the right to move the same requests do give grants."""
    granted: list[str] = []

    def note(drive: str) -> None:
        granted.extend(str(grant.purpose) for grant in server.bench.authority._live(drive))

    server.call(lambda: server.bench.authority.listen(note))
    mover = server.token(Role.ADMINISTRATOR, Right.LOOK, Right.MOTION)
    mover.ask("POST", "/drives/x/transition", json=BODIES["/transition"])
    server.call(lambda: server.bench.authority._listeners.remove(note))
    mover.ok("POST", "/stop", {})
    assert granted


def test_every_tool_that_moves_asks_for_a_right_to_move() -> None:
    assert {tool.kind for tool in TOOLS} >= {"health", "brake-test"}
    for tool in TOOLS:
        assert not tool.motion or tool.right in (Right.MEASURE, Right.MOTION), tool.kind


def test_restoring_what_can_move_an_axis_takes_the_right_to_move(server: GuardedServer) -> None:
    """The function of a terminal or a mode that a killed motion left behind."""
    drive = server.connected.drive
    writer = server.token(Role.ADMINISTRATOR, Right.LOOK, Right.PARAMETERS)
    mover = server.token(Role.ADMINISTRATOR, Right.LOOK, Right.PARAMETERS, Right.MOTION)
    for key, motion in (("6060:00", True), ("6085:00", False)):
        server.call(lambda key=key: drive.pending_restores.add({key: 1}))
        first = writer.ask("POST", "/drives/x/jobs/put-back")
        assert (first.status_code == 403) is motion, (key, first.text)
        if motion:
            assert mover.ask("POST", "/drives/x/jobs/put-back").status_code == 202
        server.run(server.bench.jobs.close())
        server.call(lambda key=key: drive.pending_restores.settle([key]))


@pytest.mark.parametrize("motion", ["none", "at_enable", "energises"])
def test_to_open_an_object_to_the_parameter_table_takes_the_right_to_move(
    server: GuardedServer, motion: str
) -> None:
    """A class that lets an object be written as a parameter would be a way round the authority."""
    rights = (Right.LOOK, Right.PARAMETERS, Right.STATION)
    where, body = "/profiles/mms7/parameters/2108:01/motion", {"motion": motion, "reason": "attack"}
    without = server.token(Role.ADMINISTRATOR, *rights).ask("PUT", where, json=body)
    assert (without.status_code == 403) is (motion != "energises"), without.text
    mover = server.token(Role.ADMINISTRATOR, *rights, Right.MOTION)
    allowed = mover.ask("PUT", where, json=body)
    assert allowed.status_code == 409, allowed.text  # its class stands in the manual's profile


def test_no_request_replaces_a_quick_stop_by_torque_zero(server: GuardedServer) -> None:
    """`Envelope.torque_off_only` is set by the brake test, which has seen before that the brake
    holds, and by the first power, whose pulses end after degrees and may close no loop."""
    assert "torque_off_only" not in json.dumps(server.interface)
    named = set()
    root = Path(__file__).parents[2]
    for file in (root / "backend").rglob("*.py"):
        tree = ast.parse(file.read_text())
        if any(
            (isinstance(node, ast.keyword) and node.arg == "torque_off_only")
            or (isinstance(node, ast.Attribute) and node.attr == "torque_off_only")
            for node in ast.walk(tree)
        ):
            named.add(file.relative_to(root).as_posix())
    assert named == {
        "backend/tools/mechanics/brake/run.py",
        "backend/tools/mechanics/first_power/run.py",
    }
