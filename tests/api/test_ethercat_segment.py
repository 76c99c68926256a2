"""Segment view, alias, firmware and permissions through the interface."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from backend import cli
from drivers.virtual.wires.netns import unavailable
from tests.support import firmware_drive
from tests.support.station import Station, until

URL = "ethercat://virtual0"
AXIS = '[[axis]]\nname = "{name}"\ndrive = "{drive}"\non = "ethercat://virtual0"\nstation = {at}\n'


@contextmanager
def started(folder: Path, *, steady: bool) -> Iterator[Station]:
    """Two drives, of which the profile of the first says that it takes firmware."""
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    firmware_drive.write_profile(folder / "profiles")
    bench = folder / "bench.toml"
    names = [("A", 1), ("B", 2)]
    bench.write_text(
        "".join(AXIS.format(name=n, drive=firmware_drive.NAME, at=at) for n, at in names)
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SERVODECK_PROFILES", str(folder / "profiles"))
        running = Station(folder, bench, ["--factory", firmware_drive.FACTORY], steady=steady)
        running.start()
        running.add(1, URL, profile=firmware_drive.NAME, name="A")
        running.add(2, URL, profile="mms7", name="B")
        yield running
        running.stop()


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    with started(Path(tmp_path_factory.mktemp("segment")), steady=True) as running:
        yield running


@pytest.fixture
def in_real_time(tmp_path: Path) -> Iterator[Station]:
    """Its own clock, which alone can show how late a cycle was."""
    with started(tmp_path, steady=False) as running:
        yield running


def view(station: Station) -> Any:
    return station.ok(station.http.get("/ethercat/segment", params={"url": URL}))


@pytest.mark.long
def test_stations_in_the_order_of_the_cable(station: Station) -> None:
    seen = view(station)
    assert (seen["connected"], seen["problem"], seen["private_network"]) == (True, "", True)
    assert seen["permissions"] is None, "a private network needs none"
    first, second = seen["stations"]
    assert [(s["station"], s["drive"], s["state"]) for s in (first, second)] == [
        (1, "a", "PREOP"),
        (2, "b", "PREOP"),
    ]
    assert (first["behind_station"], second["behind_station"], second["behind_port"]) == (0, 1, 1)
    assert [port["communicating"] for port in first["ports"]] == [True, True, False, False]
    assert [port["communicating"] for port in second["ports"]] == [True, False, False, False]
    assert (first["reference_clock"], second["reference_clock"]) == (True, False)
    assert (first["foe"], second["foe"]) == (True, False)
    assert seen["exchange"] is None
    assert second["clock_ahead_ns"] is None, "nobody keeps it current without exchange"


@pytest.mark.long
def test_figures_of_the_exchange(in_real_time: Station) -> None:
    station = in_real_time
    body = {"url": URL, "cycle_us": 1000}

    # A computer that is kept busy by others may keep a drive from answering in time.
    def begun() -> bool:
        answer = station.http.post("/buses/cyclic", json=body)
        assert answer.is_success or answer.status_code in (502, 503, 504), answer.text
        return answer.is_success

    until(begun, 60, "it runs")
    try:
        seen = until(lambda: (now := view(station))["exchange"]["cycles"] > 100 and now, 60)
        figures = seen["exchange"]
        assert [s["state"] for s in seen["stations"]] == ["OP", "OP"]
        # One wake-up per cycle; LRW counts 1 for reading and 2 for writing, per slave.
        assert sum(each["count"] for each in figures["late"]) == figures["cycles"]
        assert [each["below_us"] for each in figures["late"][:4]] == [1, 2, 4, 8]
        assert figures["late"][-1]["below_us"] is None
        assert figures["expected_wkc"] == 2 * (1 + 2)
        assert figures["dc"]
        assert seen["stations"][1]["clock_ahead_ns"] is not None
        busy = station.http.post(
            "/ethercat/alias", json={"url": URL, "station": 2, "alias": 7, "confirmed": True}
        )
        assert busy.status_code == 409
        assert "stop the cyclic exchange" in busy.json()["remedy"]
    finally:
        station.http.delete("/buses/cyclic", params={"url": URL})


@pytest.mark.long
def test_alias_wants_to_be_confirmed_and_is_read_back_after_power_on(station: Station) -> None:
    body = {"url": URL, "station": 2, "alias": 1234}
    asked = station.http.post("/ethercat/alias", json=body)
    assert asked.status_code == 409
    assert "EEPROM" in asked.json()["detail"]
    refused = station.http.post("/ethercat/alias", json=body | {"alias": 70000})
    assert refused.status_code == 422
    station.ok(station.http.post("/ethercat/alias", json=body | {"confirmed": True}))
    station.drives.segments[URL].command("power_cycle", slave=1, off_s=0.1)
    # SOEM refuses the slave with its new alias, so the segment is searched again by itself.
    until(lambda: [s["alias"] for s in view(station)["stations"]] == [0, 1234], 60, "new alias")


def eeprom(station: Station, way: str, data: bytes = b"", **query: Any) -> Any:
    return station.http.post(
        f"/ethercat/eeprom/{way}", params={"url": URL, "station": 2, **query}, content=data
    )


@pytest.mark.long
def test_an_eeprom_is_saved_compared_and_restored_after_two_confirmations(
    station: Station,
) -> None:
    segment = station.drives.segments[URL]
    answer = station.http.get("/ethercat/eeprom", params={"url": URL, "station": 2})
    saved = answer.raise_for_status().content
    assert saved.hex() == segment.command("eeprom", slave=1)["data"]
    assert answer.headers["content-disposition"].endswith('.bin"')
    segment.command("eeprom", slave=1, word=0x50, data="1234")
    written = segment.command("eeprom", slave=1)["words_written"]
    compared = station.ok(eeprom(station, "compare", saved))
    assert compared["sound"]
    assert len(compared["differences"]) == 1
    plan = station.ok(eeprom(station, "plan", saved))
    assert plan["words"] == 1
    unconfirmed = eeprom(station, "restore", saved, digest=plan["digest"])
    assert unconfirmed.status_code == 409
    other = eeprom(station, "restore", saved, digest="0" * 16, confirmed=True)
    assert other.status_code == 409
    assert other.json()["code"] == "ethercat.eeprom-plan-changed"
    assert segment.command("eeprom", slave=1)["words_written"] == written
    done = station.ok(eeprom(station, "restore", saved, digest=plan["digest"], confirmed=True))
    assert done["words"] == 1
    assert segment.command("eeprom", slave=1)["data"] == saved.hex()
    rows = station.ok(station.http.get("/audit"))["events"]
    (row,) = [each for each in rows if each["target"] == "/ethercat/eeprom/restore"][:1]
    assert plan["digest"] in row["new"]
    assert not station.ok(eeprom(station, "plan", saved))["changes"]


def test_nobody_writes_an_eeprom_or_alias_under_the_control_of_another(station: Station) -> None:
    saved = bytes.fromhex(station.drives.segments[URL].command("eeprom", slave=1)["data"])
    drive = station.ok(station.http.get("/drives"))[0]["id"]
    with station.live() as other:
        other.send(type="lease", drive=drive, take=True)
        until(lambda: station.ok(station.http.get(f"/drives/{drive}"))["lease"]["holder"])
        restore = eeprom(station, "restore", saved, digest="-", confirmed=True)
        alias = station.http.post(
            "/ethercat/alias", json={"url": URL, "station": 1, "alias": 7, "confirmed": True}
        )
    for refused in (restore, alias):
        assert refused.status_code == 409
        assert "has control" in refused.json()["detail"]
    assert station.drives.segments[URL].command("eeprom", slave=1)["data"] == saved.hex()


def test_no_eeprom_is_touched_while_the_exchange_runs(station: Station) -> None:
    saved = bytes.fromhex(station.drives.segments[URL].command("eeprom", slave=1)["data"])
    station.ok(station.http.post("/buses/cyclic", json={"url": URL, "cycle_us": 2000}))
    try:
        busy = eeprom(station, "restore", saved, digest="0" * 16, confirmed=True)
        assert busy.status_code == 409
        assert "stop the cyclic exchange" in busy.json()["remedy"]
    finally:
        station.http.delete("/buses/cyclic", params={"url": URL})


@pytest.mark.long
def test_the_command_line_saves_compares_and_restores(station: Station, tmp_path: Path) -> None:
    file = tmp_path / "eeprom.bin"
    at = ["--station", "2", "--server", station.url]
    run = CliRunner().invoke
    reported = run(cli.app, ["eeprom", "read", URL, "--out", str(file), *at])
    assert reported.exit_code == 0, reported.output
    assert run(cli.app, ["eeprom", "compare", URL, str(file), *at]).exit_code == 0
    station.drives.segments[URL].command("eeprom", slave=1, word=0x51, data="1234")
    differs = run(cli.app, ["eeprom", "compare", URL, str(file), "--json", *at])
    assert differs.exit_code == 1
    assert len(json.loads(differs.output)) == 1
    refused = run(cli.app, ["eeprom", "restore", URL, str(file), *at], input="wrong\n")
    assert refused.exit_code == 1
    plan = station.ok(eeprom(station, "plan", file.read_bytes()))
    given = f"{plan['digest']}\ny\n"
    done = run(cli.app, ["eeprom", "restore", URL, str(file), *at], input=given)
    assert done.exit_code == 0, done.output
    assert run(cli.app, ["eeprom", "compare", URL, str(file), *at]).exit_code == 0


def load(station: Station, drive: str, data: bytes, **query: bool) -> Any:
    return station.http.post(
        f"/drives/{drive}/jobs/firmware", params={"file": "app.efw", **query}, content=data
    )


def test_firmware_goes_only_where_the_profile_says_so(station: Station) -> None:
    refused = load(station, "b", b"x", confirmed=True)
    assert refused.status_code == 409
    assert "does not state that it accepts firmware" in refused.json()["detail"]
    asked = load(station, "a", b"x")
    assert asked.status_code == 409
    assert "without firmware" in asked.json()["detail"]
    assert load(station, "a", b"", confirmed=True).status_code == 422


def test_firmware_is_loaded_to_the_end_even_if_cancelled(station: Station) -> None:
    data = bytes(n % 253 for n in range(20_000))
    station.drives.segments[URL].command("timing", slave=0, sdo_s=0.01)
    job = station.ok(load(station, "a", data, confirmed=True))
    seen = until(
        lambda: (now := station.ok(station.http.get(f"/jobs/{job['id']}")))["progress"] > 0 and now,
        60,
    )
    assert "bytes: do not switch off" in seen["step"]
    second = load(station, "a", data, confirmed=True)
    assert second.status_code == 409, "the axis is held meanwhile"
    station.http.post("/stop", json={})
    ended = station.ok(station.http.delete(f"/jobs/{job['id']}"))
    assert ended["state"] == "done", ended
    assert ended["result"] == {"bytes": 20_000, "file": "app.efw", "state": "BOOT"}
    until(lambda: view(station)["stations"][0]["state"] == "PREOP", 60, "up again")


def test_firmware_that_fails_says_how_far_it_came_and_what_to_do(station: Station) -> None:
    segment = station.drives.segments[URL]
    segment.command("timing", slave=0, sdo_s=0.0)
    segment.command("firmware", slave=0, fail_at=1999)
    job = station.ok(load(station, "a", bytes(4000), confirmed=True))
    until(lambda: station.ok(station.http.get(f"/jobs/{job['id']}"))["state"] != "running", 60)
    ended = station.ok(station.http.get(f"/jobs/{job['id']}"))
    assert ended["state"] == "failed", ended
    reported = ended["problem"]["detail"]
    assert "flash memory error" in reported
    assert "after 1500 of 4000 bytes" in reported
    assert "it may be without firmware" in reported
    segment.command("firmware", slave=0)
    job = station.ok(load(station, "a", bytes(4000), confirmed=True))
    until(lambda: station.ok(station.http.get(f"/jobs/{job['id']}"))["state"] == "done", 60)


def test_permissions_of_an_interface_that_is_not_there(station: Station) -> None:
    query = {"url": "ethercat://nosuch0"}
    reported = station.ok(station.http.get("/ethercat/permissions", params=query))
    assert reported["ready"] is False
    assert reported["text"] == "there is no network interface 'nosuch0' on this computer"
    wrong = station.http.get("/ethercat/permissions", params={"url": "canopen://x"})
    assert wrong.status_code == 422
    unknown = station.http.get("/ethercat/segment", params={"url": "ethercat://other"})
    assert unknown.status_code == 404
