"""What is no servo drive is not offered as one, and an unknown drive as no maker's."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from backend import cli
from backend.commands.base import session
from backend.commands.buses.doctor import _fitting
from backend.commands.drive.scales import _farther
from backend.station.drives.matching import match_profiles
from drivers.link import Found
from tests.support.memory_link import MemoryLink

_UNKNOWN = 0x0BAD


@pytest.mark.parametrize(
    ("device_profile", "drives"),
    [(402, True), (0, True), (None, True), (5001, False), (401, False)],
)
def test_a_terminal_on_the_bus_matches_no_profile(device_profile: int | None, drives: bool) -> None:
    """1000h of CiA 301: 402 for drives, 401 and 5001 for inputs and outputs."""
    found = Found(1, vendor_id=_UNKNOWN, product_code=1, device_profile=device_profile)
    assert bool(match_profiles("ethercat", found)) is drives


def test_the_doctor_takes_an_unknown_drive_up_by_the_standards_objects() -> None:
    unknown = Found(1, vendor_id=_UNKNOWN, product_code=1, device_profile=402)
    fitting = _fitting("ethercat", unknown)
    assert fitting is not None
    assert fitting.drive == "generic402"
    assert _fitting("ethercat", None) is None


@pytest.mark.parametrize(("moved", "most", "next_move"), [
    (500, 4990, 4990), (500, 10_000, 5000), (-500, 4990, -4990),
])  # fmt: skip
def test_the_next_small_move_is_one_that_may_be_made(moved: int, most: int, next_move: int) -> None:
    """A drive that arrives one increment short may move ten times as far as it has come."""
    assert _farther(moved, most) == next_move


class _Bus(MemoryLink):
    """A CAN bus with these stations, none of which is a drive."""

    def __init__(self, *stations: int) -> None:
        super().__init__({})
        self.kind = "canopen"
        self.doctor = SimpleNamespace()  # type: ignore[assignment]
        self._stations = stations

    async def scan(self, *_: object, **__: object) -> list[Found]:
        return [Found(n, vendor_id=_UNKNOWN, device_profile=401) for n in self._stations]


@pytest.mark.parametrize(
    ("stations", "code", "said"),
    [((), 1, "no station answers: check"), ((5,), 0, "no servo drive")],
)
def test_the_doctor_says_that_no_station_answers(
    monkeypatch: pytest.MonkeyPatch, stations: tuple[int, ...], code: int, said: str
) -> None:
    monkeypatch.setattr(session, "link_for", lambda _url: _Bus(*stations))
    done = CliRunner().invoke(cli.app, ["doctor", "canopen://socketcan/can9"])
    assert done.exit_code == code
    assert said in done.output


def test_the_doctor_gives_scripts_an_empty_list_then(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "link_for", lambda _url: _Bus())
    done = CliRunner().invoke(cli.app, ["doctor", "canopen://socketcan/can9", "--json"])
    assert (done.exit_code, done.stdout.strip()) == (1, "[]")


def test_a_device_that_is_no_drive_is_named_beside_the_json(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(session, "link_for", lambda _url: _Bus(5))
    done = CliRunner().invoke(cli.app, ["doctor", "canopen://socketcan/can9", "--json"])
    assert (done.exit_code, done.stdout.strip()) == (0, "[]")
    assert "no servo drive" in done.stderr
