"""Every writable object of every profile over the real wire of each bus, as everybody.

`test_no_parameter_moves` does the same and more on firmware without a wire, where inputs are
switched and time is counted. Here the bytes go through EtherCAT frames of a network of its own,
CANopen, Modbus RTU and MLink: what another path of a link could let through shows on the drive.
Values are written in one request for each drive and caller. The judge asks the virtual drive past
the wire: the angle of its shaft, whatever units have been written, and its status word.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from backend.foundation.people.rights import Right, Role
from backend.station.bench import Bench
from backend.station.demo import DemoBench
from backend.station.drives.connected_drive import ConnectedDrive
from drivers import cia402
from drivers.cia402 import State
from drivers.errors import LinkTimeout
from drivers.virtual.wires.netns import unavailable
from profiles.schema import Parameter, Raw
from tests.support.guarded import GuardedServer
from tests.support.imported import EDS_DRIVE, ESI_DRIVE, import_both
from tests.support.station import HANG_S

ETHERCAT = "ethercat://virtual0"
CAN, MODBUS, MLINK = "canopen://virtual0", "modbus://virtual0", "mlink://virtual0"


@dataclass(frozen=True)
class Place:
    """A drive on a wire. ``slave`` is its place on the EtherCAT segment."""

    name: str
    family: str
    url: str
    station: int
    slave: int | None = None


_SEGMENTS = (("mms7", "m6l", "r6l"), ("ep3e", "generic402", ESI_DRIVE))
#: What runs at once: a computer with little time carries no more drives in real time.
PLACES: dict[str, tuple[Place, ...]] = {
    **{
        f"ethercat {' '.join(segment)}": tuple(
            Place(f"E{n}", family, ETHERCAT, n + 1, n) for n, family in enumerate(segment)
        )
        for segment in _SEGMENTS
    },
    "serial and CAN": (
        Place("L1", "mms7", MLINK, 1),
        Place("C1", "ds_c", CAN, 1),
        Place("C2", "generic402", CAN, 2),
        Place("C3", EDS_DRIVE, CAN, 3),
        Place("M1", "ds_c", MODBUS, 1),
    ),
}
#: A shaft that moved by more than this part of a revolution was moved.
STILL_REV = 1e-3
#: Written last, since what comes after them may find the drive away: restarts and restores.
LAST = ("1010", "1011", "200C:01", "200C:08", "200D:00", "2202:00", "2002:17", "2011:1B")
ATTACK: tuple[tuple[str, int], ...] = (
    ("6060:00", 3),
    ("60FF:00", 1_000_000),
    ("6040:00", 0x06),
    ("6040:00", 0x07),
    ("6040:00", 0x0F),
    ("6040:00", 0x1F),
)


class Wires:
    """A guarded server on virtual drives behind real wires, and its callers."""

    def __init__(self, folder: Path, places: tuple[Place, ...]) -> None:
        self.places = places
        file = folder / "bench.toml"
        file.write_text("".join(_axis(place) for place in places), "utf-8")
        self.drives = DemoBench(file, folder / "wires", folder / "nvm", steady=True)
        self.drives.start()
        assert not self.drives.problems, self.drives.problems
        self.ids: dict[str, str] = {}
        self.server = GuardedServer(folder, making=self._bench)
        self.server.start()
        self.server.add_people()
        operator = self.server.log_in(Role.OPERATOR)
        guest, invitation = self.server.guest(operator, ["parameters"])
        grant = {"rights": ["parameters"], "minutes": 60}
        operator.ok("PUT", f"/invitations/{invitation}/grant", grant)
        script = self.server.token(Role.ADMINISTRATOR, Right.LOOK, Right.PARAMETERS)
        self.callers = {
            "guest with parameters": guest,
            "operator without control": operator,
            "token look+parameters": script,
            "administrator": self.server.log_in(Role.ADMINISTRATOR),
        }
        self.start = {place: self.shaft_rev(place) for place in places}

    async def _bench(self, folder: Path) -> tuple[Bench, ConnectedDrive]:
        bench = Bench(folder, dict(self.drives.wires))
        connected_drives = []
        for place in self.places:
            connected = await bench.connect(place.url, place.station, place.family, place.name)
            await connected.monitor.close()
            self.ids[place.name] = connected.drive.id
            connected_drives.append(connected)
        return bench, connected_drives[0]

    def connected(self, place: Place) -> ConnectedDrive:
        return self.server.bench.connected_drives[self.ids[place.name]]

    def stop(self) -> None:
        self.server.stop()
        self.drives.stop()

    # --- past the wire ----------------------------------------------------------------

    def _ask(self, place: Place, do: str, **what: object) -> Any:
        if place.slave is None:
            return self.drives.command(do=do, axis=place.name, **what)
        segment = self.drives.segments[place.url]
        end = time.monotonic() + HANG_S
        while True:
            try:
                return segment.command(do, slave=place.slave, **what)
            except LinkTimeout:  # a busy computer: it computes the drives' time first
                if time.monotonic() > end:
                    raise

    def shaft_rev(self, place: Place) -> float:
        """Angle of the motor."""
        return float(self._ask(place, "shaft"))

    def require_still(self, place: Place, after: str) -> None:
        """The shaft is where it stood, and nothing enabled the motor."""
        reported = str(self._ask(place, "read", index=0x6041, subindex=0))
        word, own = int.from_bytes(bytes.fromhex(reported), "little"), place.family == "ds_c"
        assert cia402.decode_state(word, echoes_control=own) is not State.OPERATION_ENABLED, after
        moved = abs(self.shaft_rev(place) - self.start[place])
        assert moved < STILL_REV, (after, moved)

    # --- what is written --------------------------------------------------------------

    def writable(self, place: Place) -> list[Parameter]:
        """Everything that this bus carries and that can be written, what restarts it last."""
        drive = self.connected(place).drive
        found = [
            p for p in drive.profile.parameters if p.access != "ro" and not drive.unreachable_why(p)
        ]
        return sorted(found, key=lambda p: p.key.startswith(LAST))


def _axis(place: Place) -> str:
    return (
        f'[[axis]]\nname = "{place.name}"\ndrive = "{place.family}"\non = "{place.url}"\n'
        f"station = {place.station}\n"
    )


@pytest.fixture(scope="module", params=PLACES)
def wires(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Wires]:
    places = PLACES[request.param]
    if (why := unavailable()) and any(place.url == ETHERCAT for place in places):
        pytest.skip(why)
    folder = Path(tmp_path_factory.mktemp("wires"))
    with pytest.MonkeyPatch.context() as patch:
        import_both(folder / "mine", patch)
        found = Wires(folder, places)
        try:
            yield found
        finally:
            found.stop()


def value_of(parameter: Parameter, turn: int) -> Raw:
    """One of the values that are likely to set something going, by turns."""
    if parameter.type in ("STRING", "OCTETS"):
        return "x"
    if parameter.enum and not parameter.bits:
        choices: list[Raw] = [*sorted(parameter.enum)[:8]]
        return choices[(turn + 1) % len(choices)]
    low, high = parameter.raw_limits
    inside = [
        v
        for v in (1, high, low, 3)
        if v is not None and (low is None or v >= low) and (high is None or v <= high)
    ]
    values: list[Raw] = [*dict.fromkeys(inside)] or [1]
    return values[turn % len(values)]


def attack(wires: Wires, place: Place) -> int:
    """Everything at this drive, as everybody; how many writes that was."""
    path, sent = f"/drives/{wires.ids[place.name]}/parameters", 0
    parameters = wires.writable(place)
    moving = {p.key for p in parameters if p.motion == "energises"}
    assert moving, place
    for turn, (who, caller) in enumerate(wires.callers.items()):
        # All that can move an axis as everybody; the rest, which the wire must carry, by turns.
        part = [p for n, p in enumerate(parameters) if p.key in moving or n % 4 == turn]
        values = {p.key: {"raw": value_of(p, turn)} for p in part}
        rows = caller.ok("PUT", path, {"values": values})
        sent += len(rows)
        for row in rows:
            if row["key"] in moving:
                assert not row["ok"], (place, who, row)
                require_refused(row["problem"], row["key"])
        for key, raw in ATTACK:
            if key in moving:
                answer = caller.ask("PUT", f"{path}/{key}", json={"raw": raw})
                assert answer.status_code == 409, (place, who, key, answer.text)
                require_refused(answer.json(), key)
                sent += 1
        wires.require_still(place, f"{place.name} {place.family} after {who}")
    return sent


def require_refused(problem: dict[str, Any], key: str) -> None:
    """Why, and where to go."""
    assert problem["type"] == "urn:servodeck:not-granted", (key, problem)
    assert problem["parameter"] == key
    assert "/api/v1/drives/" in problem["remedy"], problem


@pytest.mark.long(keep=1)
def test_no_write_moves_an_axis_on_a_real_wire(wires: Wires) -> None:
    """All drives at once, as pages of several people would."""
    places = wires.places
    with ThreadPoolExecutor(len(places)) as pool:
        for place, sent in zip(places, pool.map(lambda p: attack(wires, p), places), strict=True):
            assert sent > 20, (place, sent)
    for place in places:
        wires.require_still(place, "in the end")
