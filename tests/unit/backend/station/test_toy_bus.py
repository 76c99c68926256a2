"""A kind of bus that the product has never heard of: one folder with a `BusKind`, and one line."""

from __future__ import annotations

import ast
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from backend.axes.drive.ports import Port
from backend.station import bench as bench_module
from backend.station.bench import Bench
from drivers import urls
from drivers.bus import BusKind, BusUrl
from drivers.errors import OutOfRange
from drivers.link import Address, Found, LinkTraits, Progress
from drivers.texts.message import prose
from profiles import load_profile
from profiles.schema import LinkSpec, Profile
from tests.support.memory_link import MemoryLink

TOY: Any = "toy"
_SEAM = ("drivers.link", "drivers.bus", "drivers.doctor", *(f"drivers.{k}" for k in urls.SCHEMES))
#: Records of the seam that are no buses: a message may be one of several kinds.
_VALUES = {"ObjectInfo", "FileTask"}
STATUS, POSITION = (0x6041, 0), (0x6064, 0)


class ToyLink(MemoryLink):
    """Ten values in a call, of a family that has been attached."""

    def __init__(self, url: BusUrl) -> None:
        super().__init__({STATUS: b"\x50\x02", POSITION: b"\x07\0\0\0", (0x1018, 4): b"\x09\0\0\0"})
        self.kind, self.url = TOY, str(url)
        self.families: dict[int, str] = {}
        self.longest = 0

    def attach(self, station: int, profile: Profile) -> None:
        self.families[station] = profile.drive

    async def scan(
        self,
        progress: Progress,
        stations: Sequence[int] | None = None,
        *,
        stop_after: int | None = None,
    ) -> list[Found]:
        return [Found(3, serial=9, name="Toy")]

    async def read_many(self, station: int, addresses: Sequence[Address]) -> list[Any]:
        self.longest = max(self.longest, len(addresses))
        return await super().read_many(station, addresses)


def require_place(place: str) -> None:
    if not place.startswith("shelf"):
        raise OutOfRange(f"{place!r} is no shelf", value=place, limit="shelf0 to shelf9")


@pytest.fixture
def toy(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the folder drivers/toy and the line in `LinkKind` would do."""
    module = ModuleType("drivers.toy.bus")
    module.BUS = BusKind(  # type: ignore[attr-defined]
        example="toy://shelf0",
        traits=LinkTraits(batch=10, silent=prose("the batteries")),
        require_place=require_place,
        link=ToyLink,
    )
    monkeypatch.setitem(sys.modules, "drivers.toy", ModuleType("drivers.toy"))
    monkeypatch.setitem(sys.modules, "drivers.toy.bus", module)
    monkeypatch.setattr(urls, "SCHEMES", (*urls.SCHEMES, TOY))


@pytest.fixture
def family(monkeypatch: pytest.MonkeyPatch) -> Profile:
    """An MMS7 that could be had with a port to the toy bus."""
    mms7 = load_profile("mms7")
    spec = LinkSpec.model_construct(
        **(mms7.links[0].model_dump() | {"kind": TOY, "watchdog": mms7.links[0].watchdog})
    )
    facts = mms7.model_copy(update={"links": (spec,)})
    monkeypatch.setattr(bench_module, "profile_for", lambda _kind, _name: (facts, spec))
    return facts


def test_its_urls_are_read_and_judged_by_its_own_rules(toy: None) -> None:
    assert isinstance(urls.link_for("toy://shelf1"), ToyLink)
    with pytest.raises(OutOfRange, match="is no shelf"):
        urls.parse_url("toy://cellar")
    with pytest.raises(OutOfRange, match="toy://") as wrong:
        urls.parse_url("tony://shelf0")
    assert "toy://shelf0" in (wrong.value.remedy or "")


async def test_a_drive_on_it_is_found_connected_read_and_written(
    toy: None, family: Profile, tmp_path: Path
) -> None:
    bench = Bench(tmp_path)
    try:
        [found] = await bench.buses.scan("toy://shelf0", None, lambda *_: None)
        member = await bench.connect("toy://shelf0", found.station, "mms7", "T", found=found)
        await member.monitor.close()
        link = member.drive.ports[0].link
        assert isinstance(link, ToyLink)
        assert link.families == {3: "mms7"}
        assert (await member.drive.read("6064:00")).raw == 7
        await member.drive.read_many([p.key for p in family.parameters[:40]])
        assert link.longest == 10, "as its traits say"
    finally:
        await bench.close()


def test_what_its_traits_leave_out_is_not_sent_there(toy: None, family: Profile) -> None:
    register_only = load_profile("ds_c").by_key["PA_4B"]
    port = Port(ToyLink(BusUrl(TOY, "shelf0")), 3, None)
    assert not port.carries(register_only)
    assert port.carries(family.by_key["6064:00"])


def test_nothing_in_the_backend_asks_for_a_kind_of_bus() -> None:
    """Traits are asked for; a comparison with a kind would leave a new bus out."""
    found = []
    for file in sorted(Path(bench_module.__file__).parents[1].rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if not isinstance(node, ast.Compare):
                continue
            sides = [node.left, *node.comparators]
            sides += [part for side in sides if isinstance(side, ast.Tuple) for part in side.elts]
            if any(isinstance(s, ast.Constant) and s.value in urls.SCHEMES for s in sides):
                found.append(f"{file.name}:{node.lineno}")
    # `servodeck virtual` may: it refuses to answer on a real network.
    assert found == ["virtual.py:34"]


def test_nothing_in_the_backend_asks_which_class_a_bus_or_an_exchange_has() -> None:
    """What a bus may lack is a part that is None, so that the types say it."""
    found = []
    for file in sorted(Path(bench_module.__file__).parents[1].rglob("*.py")):
        tree = ast.parse(file.read_text("utf-8"))
        seam = {
            alias.asname or alias.name
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(_SEAM)
            for alias in node.names
        }
        for node in ast.walk(tree):
            if not isinstance(node, ast.Call) or ast.unparse(node.func) != "isinstance":
                continue
            asked = {part.split(".")[-1] for part in ast.unparse(node.args[1]).split(" | ")}
            of_the_seam = ast.unparse(node.args[1]).startswith("bus.")
            if of_the_seam or asked & seam - _VALUES:
                found.append(f"{file.name}:{node.lineno}")
    assert found == []
