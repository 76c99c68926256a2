"""Doctor and flight recorder at the edge: interface, command line, support bundle."""

from __future__ import annotations

import io
import json
import shutil
import subprocess
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from backend import cli
from backend.station.recording import capture
from drivers.texts.message import speaking
from drivers.virtual.wires.netns import unavailable
from tests.support.station import HANG_S, Station, until

SEGMENT, CAN, LINE = "ethercat://virtual0", "canopen://virtual0", "mlink://virtual0"
BENCH = f"""
[[axis]]
name = "A"
drive = "mms7"
on = "{SEGMENT}"
station = 1

[[axis]]
name = "Z"
drive = "ds_c"
on = "{CAN}"
station = 3

[[axis]]
name = "X"
drive = "mms7"
on = "{LINE}"
station = 1
"""
PCAPNG = bytes.fromhex("0a0d0d0a")


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    folder = Path(tmp_path_factory.mktemp("doctor"))
    bench = folder / "bench.toml"
    bench.write_text(BENCH)
    running = Station(folder, bench, ["--lockstep"])
    running.start()
    running.add(1, SEGMENT, name="A")
    running.add(3, CAN, "ds_c", "Z")
    running.add(1, LINE, name="X")
    yield running
    running.stop()


def decoded(data: bytes, folder: Path, chosen: str) -> list[str]:
    """Protocols of the packets that tshark shows with a display filter."""
    if shutil.which("tshark") is None:
        pytest.skip("tshark is not installed: .ci/run installs it")
    path = folder / "frames.pcapng"
    path.write_bytes(data)
    done = subprocess.run(
        ["tshark", "-r", str(path), "-Y", chosen, "-T", "fields", "-e", "frame.protocols"],
        capture_output=True,
        check=True,
        text=True,
        env={"PATH": "/usr/bin:/bin", "HOME": str(folder)},
    )
    return done.stdout.splitlines()


def command(station: Station, *arguments: str, code: int = 0) -> str:
    done = CliRunner().invoke(cli.app, [*arguments, "--server", station.url])
    assert done.exit_code == code, done.output
    return str(done.output)


# --- the recorder ------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize(
    ("url", "chosen"), [(SEGMENT, "ecat_mailbox.coe"), (CAN, "can.id == 0x583")]
)
def test_the_frames_of_a_bus_are_fetched_and_decoded(
    station: Station, tmp_path: Path, url: str, chosen: str
) -> None:
    answer = station.http.get("/buses/flight", params={"url": url}).raise_for_status()
    assert answer.headers["content-disposition"].endswith('.pcapng"')
    assert answer.content.startswith(PCAPNG)
    assert decoded(answer.content, tmp_path, chosen)


def test_one_node_alone(station: Station, tmp_path: Path) -> None:
    whole = {"url": CAN}
    other = station.http.get("/buses/flight", params=whole | {"station": 9}).content
    assert other.startswith(PCAPNG)
    assert decoded(other, tmp_path, "can.id == 0x583") == []


def test_a_bus_that_is_not_open_is_not_found(station: Station) -> None:
    for path in ("/buses/flight", "/buses/doctor"):
        answer = station.http.get(path, params={"url": "canopen://virtual9"})
        assert answer.status_code == 404
        assert "canopen://virtual9" in answer.json()["detail"]


def test_the_command_writes_the_file(station: Station, tmp_path: Path) -> None:
    out = tmp_path / "bus.pcapng"
    reported = command(station, "bus", "record", CAN, "--out", str(out))
    assert reported == f"{out}: {out.stat().st_size} bytes\n"
    assert decoded(out.read_bytes(), tmp_path, "can")


@pytest.mark.long
def test_the_bundle_of_a_fault_has_the_frames(
    station: Station, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(capture, "AFTER_S", 0.3)
    old = {row["name"] for row in station.ok(station.http.get("/bundles"))["bundles"]}
    station.drives.command(do="inject", axis="Z", what="overload")

    def fresh() -> Any:
        rows = station.ok(station.http.get("/bundles"))["bundles"]
        return next((row["name"] for row in rows if row["name"] not in old), None)

    name = until(fresh, HANG_S, "the bundle of the fault")
    data = station.http.get(f"/bundles/{name}").raise_for_status().content
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        frames = {n: archive.read(n) for n in archive.namelist() if n.startswith("frames/")}
    assert set(frames) == {
        "frames/ethercat-virtual0.pcapng",
        "frames/canopen-virtual0.pcapng",
        "frames/mlink-virtual0.pcapng",
    }
    # Emergencies travel with 80h + node-ID (CiA 301 clause 7.3.3).
    assert decoded(frames["frames/canopen-virtual0.pcapng"], tmp_path, "can.id == 0x083")


# --- the doctor --------------------------------------------------------------------------


def doctor(running: Station, url: str, **query: int) -> list[dict[str, Any]]:
    found = running.ok(running.http.get("/buses/doctor", params={"url": url, **query}))
    return list(found)


def test_a_segment_that_is_not_started(station: Station) -> None:
    (only,) = doctor(station, SEGMENT)
    assert (only["station"], only["reached"]) == (1, False)
    assert only["causes"][0]["remedy"]
    assert only["causes"][0]["remedy_zh"]


@pytest.mark.long
def test_a_node_that_waits_to_be_started_and_one_that_has_a_fault(station: Station) -> None:
    drive = next(d for d in station.ok(station.http.get("/drives")) if d["name"] == "Z")["id"]
    station.drives.command(do="inject", axis="Z", what="overload")
    until(lambda: station.state(drive)["faults"], what="the fault")
    (only,) = doctor(station, CAN)
    assert (only["station"], only["reached"]) == (3, False)
    assert only["causes"][0]["code"] == "can_drive_fault"
    station.ok(station.http.post(f"/drives/{drive}/fault-reset", json={}))
    until(lambda: not station.state(drive)["faults"], what="no fault")
    (only,) = doctor(station, CAN, station=3)
    assert [cause["code"] for cause in only["causes"]] == ["can_not_started"], only


@pytest.mark.long
def test_a_mute_node_is_named(station: Station) -> None:
    station.drives.command(do="mute", wire=CAN, on=True)
    try:
        (only,) = doctor(station, CAN, station=3)
    finally:
        station.drives.command(do="mute", wire=CAN, on=False)
    first = only["causes"][0]
    assert first["code"] in {"can_node_silent", "can_heartbeat_lost"}
    assert first["title_zh"]


def test_a_serial_line_has_no_doctor(station: Station) -> None:
    answer = station.http.get("/buses/doctor", params={"url": LINE})
    assert answer.status_code == 409
    assert "EtherCAT and CANopen" in answer.json()["detail"]


@pytest.mark.long
def test_the_command_shows_causes_with_facts_and_ends_with_1(station: Station) -> None:
    shown = command(station, "doctor", CAN, "--station", "3", code=1)
    assert "1. " in shown
    assert "remedy: " in shown
    rows = json.loads(command(station, "doctor", CAN, "--station", "3", "--json", code=1))
    assert rows[0]["station"] == 3
    assert rows[0]["causes"][0]["facts"]
    with speaking("zh"):
        chinese = command(station, "doctor", CAN, "--station", "3", code=1)
    assert rows[0]["causes"][0]["title_zh"] in chinese
    assert rows[0]["causes"][0]["remedy_zh"] in chinese
    assert "the doctor supports" in command(station, "doctor", LINE, code=1)


def slave(running: Station, command: str, **arguments: Any) -> Any:
    return running.drives.segments[SEGMENT].command(command, slave=0, **arguments)


@pytest.mark.long
def test_a_setting_is_tried_kept_and_undone(station: Station) -> None:
    """The drive refuses Safe-Op at first, and takes the setting later, as after a repair."""
    slave(station, "refuse", state="SAFEOP", code=0x0030)  # ETG.1020: invalid DC SYNC configuration
    try:
        refused = station.http.post("/buses/cyclic", json={"url": SEGMENT, "cycle_us": 2000})
        assert refused.status_code == 409, refused.text
        (seen,) = doctor(station, SEGMENT)
        assert seen["causes"][0]["code"] == "clock_mode_wrong"
        assert seen["kept"] is None
        offered = {(each["setting"], each["after"]): each for each in seen["trials"]}
        # Without an ESI file AssignActivate is 0300h; 0330h puts SYNC0 on its pin as well.
        trial = offered["bring_up.clock_modes", "0330h"]
        assert trial["before"] == "0300h"
        body = {"url": SEGMENT, "station": 1, "setting": trial["setting"], "after": "0330h"}
        result = station.done(station.http.post("/buses/doctor/trials", json=body))
        assert not result["reached"]
        assert result["refusal"]["code"].startswith("ethercat.")
        early = station.http.put("/buses/doctor/kept", json=body)
        assert early.status_code == 409
        assert "did not reach Operational" in early.json()["detail"]
    finally:
        slave(station, "refuse", state="SAFEOP", code=None)
    result = station.done(station.http.post("/buses/doctor/trials", json=body))
    assert (result["reached"], result["refusal"]) == (True, None)
    assert not any(bus["cyclic"] for bus in station.ok(station.http.get("/buses")))

    assert station.ok(station.http.put("/buses/doctor/kept", json=body)) == trial
    (seen,) = doctor(station, SEGMENT)
    assert (seen["kept"], seen["trials"]) == (trial, [])
    bus = station.ok(station.http.post("/buses/cyclic", json={"url": SEGMENT, "cycle_us": 2000}))
    assert bus["cyclic"]["running"]
    # Register 0980h has the AssignActivate with which the exchange was started (ETG.1000.4).
    assert slave(station, "register", address=0x0980) == 0x0330, "the kept setting counts"
    running = station.http.delete("/buses/doctor/kept", params={"url": SEGMENT, "station": 1})
    assert running.status_code == 409
    station.ok(station.http.delete("/buses/cyclic", params={"url": SEGMENT}))
    station.ok(station.http.delete("/buses/doctor/kept", params={"url": SEGMENT, "station": 1}))
    (seen,) = doctor(station, SEGMENT)
    assert seen["kept"] is None
    station.ok(station.http.post("/buses/cyclic", json={"url": SEGMENT, "cycle_us": 2000}))
    assert slave(station, "register", address=0x0980) == 0x0300
    station.ok(station.http.delete("/buses/cyclic", params={"url": SEGMENT}))

    rows = station.ok(station.http.get("/audit", params={"limit": 100}))["events"]
    audited = [(row["action"], row["target"]) for row in rows if "doctor" in row["target"]]
    assert ("changed", "/buses/doctor/kept") in audited
    assert ("deleted", "/buses/doctor/kept") in audited
    assert ("made", "/buses/doctor/trials") in audited


def test_what_is_not_offered_is_not_tried(station: Station) -> None:
    body = {"url": SEGMENT, "station": 1, "setting": "pdo.remappable", "after": "other"}
    job = station.job(station.http.post("/buses/doctor/trials", json=body))
    assert job["state"] == "failed"
    assert "does not offer" in job["problem"]["detail"]
    on_the_line = station.http.post("/buses/doctor/trials", json=body | {"url": LINE})
    assert on_the_line.status_code == 409
    unknown = body | {"url": "canopen://virtual9"}
    assert station.http.post("/buses/doctor/trials", json=unknown).status_code == 404
