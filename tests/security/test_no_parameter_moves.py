"""No way of writing parameters moves an axis: every writable object of every family, on every bus,
as everybody who may write parameters; also of a CiA 402 drive that nothing else is known of, and
of drives by a maker's EDS and ESI file. (On real wires: `test_no_parameter_moves_on_wires`.)

The drives are the virtual ones, with their inputs wired: what the status word says is not asked,
but where the shaft is. A refusal must say why, and where the thing can be done instead.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from backend.axes.drive.readings import Reading
from backend.axes.parameters import set_file as parameter_set
from backend.commands.base import session
from backend.commands.base.options import Place
from backend.commands.drive import local_params, remote_params
from backend.foundation.people.rights import Right, Role
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from drivers.cia402 import State
from drivers.errors import DriveError
from profiles.schema import LinkKind, Parameter, Profile, Raw
from tests.support.firmware_link import STATION, FirmwareLink
from tests.support.guarded import Caller, GuardedServer
from tests.support.imported import EDS_DRIVE, ESI_DRIVE, import_both

PLACES: tuple[tuple[str, LinkKind], ...] = (
    ("mms7", "ethercat"),
    ("mms7", "mlink"),
    ("m6l", "ethercat"),
    ("el7", "ethercat"),
    ("r6l", "ethercat"),
    ("ep3e", "ethercat"),
    ("ds_c", "canopen"),
    ("ds_c", "modbus"),
    ("generic402", "ethercat"),
    ("generic402", "canopen"),
    (EDS_DRIVE, "canopen"),
    (ESI_DRIVE, "ethercat"),
)
#: A shaft that moved by more than this was moved. Physics at standstill is still to far less.
STILL_RAD = 1e-3
#: What the drive is given to react in, of its own time.
REACTION_S = 0.25
#: 6060h = profile velocity; a speed; then the way to Operation enabled (CiA 402-2 clause 8.4).
ATTACK: tuple[tuple[str, int], ...] = (
    ("6060:00", 3),
    ("60FF:00", 1_000_000),
    ("6040:00", 0x06),
    ("6040:00", 0x07),
    ("6040:00", 0x0F),
    ("6040:00", 0x1F),
)


class Scene:
    """A guarded server with one virtual drive as its axis ``x``, and its callers."""

    def __init__(self, folder: Path, family: str, kind: LinkKind) -> None:
        self.link = FirmwareLink(family, kind)
        self.url = f"{kind}://virtual0"
        self.server = GuardedServer(folder, making=self._bench)
        self.server.start()
        self.server.add_people()
        operator = self.server.log_in(Role.OPERATOR)
        guest, self.invitation = self.server.guest(operator, ["parameters"])
        operator.ok(
            "PUT",
            f"/invitations/{self.invitation}/grant",
            {"rights": ["parameters"], "minutes": 60},
        )
        self.callers = {
            "guest with parameters": guest,
            "operator without control": operator,
            "token look+parameters": self.server.token(
                Role.ADMINISTRATOR, Right.LOOK, Right.PARAMETERS
            ),
            "administrator": self.server.log_in(Role.ADMINISTRATOR),
        }
        self.operator = operator
        self.start_rad = self.link.angle_rad

    async def _bench(self, folder: Path) -> tuple[Bench, ConnectedDrive]:
        bench = Bench(folder, {self.url: lambda: self.link})
        connected = await bench.connect(self.url, STATION, self.profile.drive, "X")
        await connected.monitor.close()
        return bench, connected

    @property
    def profile(self) -> Profile:
        return self.link.device.profile

    def writable(self) -> list[Parameter]:
        """Everything that this bus carries and that can be written."""
        drive = self.server.connected.drive
        return [
            p for p in self.profile.parameters if p.access != "ro" and not drive.unreachable_why(p)
        ]

    def wire(self, on: bool) -> None:
        """All inputs as they are wired: on or off."""

        def inject() -> None:
            for place in range(1, 17):
                try:
                    self.link.device.inject(f"di{place}", float(on))
                except ValueError:
                    return

        self.server.call(inject)

    def require_still(self, after: str) -> None:
        """The shaft is where it stood, the motor has no power and nothing enabled it."""

        def look() -> tuple[float, bool]:
            self.link.pass_s(REACTION_S)
            return self.link.angle_rad, self.server.connected.axis.stopped

        angle, _ = self.server.call(look)
        state = self.server.run(self.server.connected.axis.state())
        assert state is not State.OPERATION_ENABLED, after
        assert abs(angle - self.start_rad) < STILL_RAD, (after, angle - self.start_rad)


@pytest.fixture(scope="module", params=PLACES, ids=[f"{f}-{k}" for f, k in PLACES])
def scene(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Scene]:
    family, kind = request.param
    with pytest.MonkeyPatch.context() as patch:
        import_both(tmp_path_factory.mktemp("profiles"), patch)
        found = Scene(tmp_path_factory.mktemp("station"), family, kind)
        yield found
        found.server.stop()


def values_of(parameter: Parameter) -> list[Raw]:
    """Values that are likely to set something going: ends of the range, choices, triggers."""
    if parameter.type in ("STRING", "OCTETS"):
        return ["x"]
    if parameter.key == "6040:00":
        return [0x06, 0x07, 0x0F, 0x1F, 0x3F]
    if parameter.enum and not parameter.bits:
        return sorted(parameter.enum)[:8]
    low, high = parameter.raw_limits
    wanted = [1, high, low, 3]
    inside = [
        v
        for v in wanted
        if v is not None and (low is None or v >= low) and (high is None or v <= high)
    ]
    return list(dict.fromkeys(inside)) or [1]


def energises(parameter: Parameter) -> bool:
    return parameter.motion == "energises"


def require_reported(problem: dict[str, Any], key: str) -> None:
    """Why, and where to go."""
    assert problem["type"] == "urn:servodeck:not-granted", (key, problem)
    assert problem["parameter"] == key
    assert key in problem["detail"]
    assert "can energise the motor" in problem["detail"]
    assert "/api/v1/drives/" in problem["remedy"], problem


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("wired", [False, True], ids=["inputs-off", "inputs-on"])
def test_no_write_by_anybody_moves_the_axis(scene: Scene, wired: bool) -> None:
    """Every writable object at several values, by the table's own route, one after the other."""
    scene.wire(wired)
    scene.require_still("the inputs alone")
    parameters = scene.writable()
    assert any(energises(p) for p in parameters)
    for who, caller in scene.callers.items():
        for turn in range(3 if who == "guest with parameters" else 1):
            wanted = {p.key: {"raw": values_of(p)[turn % len(values_of(p))]} for p in parameters}
            results = caller.ok("PUT", "/drives/x/parameters", {"values": wanted})
            by_key = {row["key"]: row for row in results}
            for parameter in filter(energises, parameters):
                assert not by_key[parameter.key]["ok"], (who, parameter.key)
                require_reported(by_key[parameter.key]["problem"], parameter.key)
            scene.require_still(f"{who}, values {turn}, inputs {wired}")
        for key, raw in ATTACK:
            if scene.profile.parameter(key) is None:
                continue
            answer = caller.ask("PUT", f"/drives/x/parameters/{key}", json={"raw": raw})
            assert answer.status_code == 409, (who, key, answer.text)
            require_reported(answer.json(), key)
        scene.require_still(f"{who} by single writes, inputs {wired}")


def a_set(scene: Scene) -> bytes:
    """A parameter set that holds every writable object, made as the product makes one."""
    drive = scene.server.connected.drive
    readings = [Reading(p.key, values_of(p)[-1], None, 1.0) for p in scene.writable()]
    return parameter_set.dump(drive, readings, author="somebody", notes="", saved=datetime.now(UTC))


def loaded(scene: Scene, caller: Caller, file: str, keys: list[str]) -> dict[str, Any]:
    """The report of loading a set, by key."""
    body = {
        "file": file,
        "keys": keys,
        "accept_other_identity": True,
        "accept_motor_individual": True,
    }
    job = caller.ok("POST", "/drives/x/jobs/load_set", body)

    async def ended() -> Any:
        found = scene.server.bench.jobs.get(job["id"])
        assert found is not None
        await found.wait()
        assert found.error is None, found.error
        return found.result

    result = scene.server.run(ended())
    return {row["key"]: row for row in result["rows"]} | {"": result}


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("way", ["set", "csv", "undo"])
def test_no_set_moves_the_axis(scene: Scene, way: str) -> None:
    """A set, a CSV list and the undo of a set, loaded by a script with the right to write."""
    administrator = scene.callers["administrator"]
    caller = scene.callers["token look+parameters"]
    scene.wire(True)
    file = f"{way} {scene.profile.drive}"
    data = a_set(scene)
    if way == "csv":
        rows = [f"{p.key},{values_of(p)[-1]}" for p in scene.writable()]
        answer = administrator.http.post(
            "/sets/list",
            params={"profile": scene.profile.drive, "file": file},
            content="\n".join(["key,raw", *rows]),
        )
        assert answer.is_success, answer.text
        file = answer.json()["file"]
    else:
        answer = administrator.http.put(f"/sets/{file}.sdset", content=data)
        assert answer.is_success, answer.text
        file = f"{file}.sdset"
    rows = administrator.ok("GET", f"/drives/x/diff?file={file}")["rows"]
    offered = {row["key"]: row for row in rows}
    moving = [p for p in scene.writable() if energises(p) and p.key in offered]
    assert moving
    for parameter in moving:
        row = offered[parameter.key]
        assert not row["selected"]
        if row["status"] == "energises":
            assert "/api/v1/drives/" in row["problem"]
        else:
            assert row["status"] in ("same", "invalid", "not_in_drive"), row
    usable = ("differs", "same", "energises")
    good = [key for key, row in offered.items() if row["status"] in usable and row["file_raw"]]
    report = loaded(scene, caller, file, good)
    if way == "undo":
        report = loaded(scene, caller, report[""]["backup"], [k for k in report if k])
    for parameter in moving:
        if parameter.key in report:
            assert not report[parameter.key]["ok"], parameter.key
            assert "/api/v1/drives/" in report[parameter.key]["problem"]
    harmless = [key for key in report if key and not energises(scene.profile.by_key[key])]
    assert any(report[key]["ok"] for key in harmless), "everything else still loads"
    scene.require_still(f"after {way}")


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("where", ["local", "server"])
def test_the_command_line_moves_nothing(
    scene: Scene, where: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """``params set`` and ``params load``, on a bus of its own and through the server."""
    scene.wire(True)
    link = FirmwareLink(scene.profile.drive, scene.link.kind)
    start = link.angle_rad
    monkeypatch.setattr(session, "link_for", lambda _url: link)
    token = scene.callers["token look+parameters"].token
    monkeypatch.setenv("SERVODECK_TOKEN", token or "")
    verbs = local_params if where == "local" else remote_params
    place = Place(
        scene.url, STATION, scene.profile.drive, None if where == "local" else scene.server.url
    )
    for parameter in filter(energises, scene.writable()):
        with pytest.raises(DriveError) as refusal:
            asyncio.run(verbs.put(place, [f"{parameter.key}={values_of(parameter)[0]}"], raw=True))
        reported = f"{refusal.value.message} {refusal.value.advice}"
        assert parameter.key in reported
        assert "/api/v1/drives/" in reported
    if where == "local":
        file = tmp_path / "all.sdset"
        file.write_bytes(a_set(scene))
        asyncio.run(local_params.load(place, file, yes=True, other_drive=True))
        link.pass_s(1.0)
        assert abs(link.angle_rad - start) < STILL_RAD
    scene.require_still(f"command line, {where}")


@pytest.mark.long(keep=2)
def test_a_visit_that_is_over_leaves_nothing_turning(scene: Scene) -> None:
    """What was found: the axis turned on after the visit, and after the end of the server."""
    guest = scene.callers["guest with parameters"]
    for key, raw in ATTACK:
        guest.ask("PUT", f"/drives/x/parameters/{key}", json={"raw": raw})
    scene.operator.ask("DELETE", f"/invitations/{scene.invitation}")
    scene.require_still("after the visit")
