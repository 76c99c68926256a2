"""EtherCAT through the interface: from scan to motion with one setpoint per cycle.

The segment's clock follows the frames, so a busy test machine changes nothing but the time that
the tests take.
"""

from __future__ import annotations

import json
import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from backend import cli
from drivers.virtual.wires.netns import unavailable
from tests.support.machine import Stopwatch, within
from tests.support.station import Live, Station

URL = "ethercat://virtual0"
BENCH = """
[[axis]]
name = "A"
drive = "mms7"
on = "ethercat://virtual0"
station = 1

[[axis]]
name = "B"
drive = "mms7"
on = "ethercat://virtual0"
station = 2
"""
STALLED = ("no valid process data", "not renewed in time")
JOG = {"speed": 300.0, "acceleration": 3000.0, "travel_limit": 20.0, "torque_limit": 200.0}


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    folder = Path(tmp_path_factory.mktemp("ethercat"))
    bench = folder / "bench.toml"
    bench.write_text(BENCH)
    running = Station(folder, bench, ["--lockstep"])
    running.start()
    yield running
    running.stop()


@pytest.fixture
def axes(station: Station) -> Iterator[tuple[str, str]]:
    names = station.add(1, URL, name="A"), station.add(2, URL, name="B")
    yield names
    station.http.post("/stop", json={})
    station.http.delete("/buses/cyclic", params={"url": URL})
    station.remove(*names)


@pytest.fixture
def cyclic(station: Station, axes: tuple[str, str]) -> tuple[str, str]:
    bus = station.ok(station.http.post("/buses/cyclic", json={"url": URL, "cycle_us": 1000}))
    assert bus["cyclic"]["running"]
    return axes


def traces(blocks: list[bytes]) -> tuple[np.ndarray, np.ndarray, int]:
    """Times [n], samples [n, k] and dropped samples of scope frames."""
    times, rows_, dropped = [], [], 0
    for block in blocks:
        _magic, _sub, _seq, lost, rows, count, flags, t0, dt = struct.unpack_from(
            "<IIIIHHIdd", block
        )
        assert not flags & 1, "synchronous blocks need no times of their own"
        times.append(t0 + dt * np.arange(rows))
        # Bit 1: large positions come as a base in float64 and the distance from it.
        based = bool(flags & 2)
        bases = np.frombuffer(block, "<f8", count, 40) if based else np.zeros(count)
        samples = np.frombuffer(block, "<f4", rows * count, 40 + 8 * count * based)
        rows_.append(samples.reshape(rows, count) + bases)
        dropped += lost
    return np.concatenate(times), np.concatenate(rows_), dropped


def hold(page: Live, drive: str, seconds: float) -> None:
    with page.holding(drive):
        time.sleep(seconds)


def undisturbed(motion: Callable[[], Any]) -> Any:
    """The motion's outcome. One that a machine without time for it ended is done again.

    A computer that stops the bus' process for 30 ms, or the server for 200 ms, must end the
    motion: the product is right then, and the test has not seen what it wants to see.
    """
    for _ in range(5):
        watch = Stopwatch()
        outcome = motion()
        problem = outcome.get("problem")
        stalled = problem is not None and any(s in problem["detail"] for s in STALLED)
        if not stalled or not watch.busy():
            return outcome
    raise AssertionError(f"this machine stalls too often: {outcome}")


@pytest.mark.long
def test_scan_read_write_save(station: Station, axes: tuple[str, str]) -> None:
    result = station.done(station.http.post("/scan", json={"url": URL}))
    assert [drive["station"] for drive in result["found"]] == [1, 2]
    assert result["found"][0]["matches"][0]["profile"] == "mms7"
    a, _ = axes
    result = station.done(station.http.post(f"/drives/{a}/jobs/read_all", json={}), 60)
    assert result["failed"] == {}
    answer = station.ok(station.http.put(f"/drives/{a}/parameters/2005:03", json={"value": 150}))
    assert answer["raw"] == 1500
    assert answer["pending"] == "write_settings"
    station.done(station.http.post(f"/drives/{a}/procedures/save", json={"confirmed": True}))
    answer = station.ok(station.http.get(f"/drives/{a}/parameters/2005:03"))
    assert (answer["pending"], answer["unsaved"]) == ("", False)


@pytest.mark.long
def test_cyclic_exchange_tells_what_it_carries(station: Station, cyclic: tuple[str, str]) -> None:
    (bus,) = station.ok(station.http.get("/buses"))
    assert bus["cyclic"]["cycle_us"] == 1000
    a, b = cyclic
    for name in (a, b):
        assert f"{name}/6064:00" in bus["cyclic"]["channels"]
    again = station.http.post("/buses/cyclic", json={"url": URL})
    assert again.status_code == 409
    refused = station.job(station.http.post("/scan", json={"url": URL}))
    assert refused["state"] == "failed", "a scan would reset drives that exchange process data"


@pytest.mark.long
def test_jog_plays_one_position_per_cycle(station: Station, cyclic: tuple[str, str]) -> None:
    a, b = cyclic
    with station.live() as page:
        channels = [{"drive": a, "key": "607A:00"}, {"drive": b, "key": "6064:00"}]
        page.send(type="scope_start", subscription=1, channels=channels)
        info = page.wait("scope_info", subscription=1)
        assert all(channel["synchronous"] for channel in info["channels"])

        def jog() -> Any:
            page.binary.clear()
            page.send(type="jog_start", drive=a, direction=1, **JOG)
            with page.holding(a):
                # Held by the axis' time, which passes slowly on a busy computer.
                # Looked at now and then: this process is the server's too, and must let it answer.
                while len(page.binary) % 10 or at_speed(page.binary) <= 300:
                    if (message := page.receive())["type"] == "jog_ended":
                        return message
            page.send(type="jog_stop", drive=a)
            return page.wait("jog_ended", drive=a, timeout_s=60)

        for _ in range(5):
            ended = undisturbed(jog)
            assert ended["problem"] is None, ended
            if at_speed(page.binary) > 300:
                break
            # As in `tests.support.jogging`: a stall of 200 ms ends a jog, rightly.
            assert "500 ms" in ended["reason"], ended
        page.send(type="scope_stop", subscription=1)
    steps = steps_of(page.binary)
    assert steps.max() <= 329, "nothing is faster"
    assert at_speed(page.binary) > 300
    assert station.state(a)["state"] == "Switch on disabled"


def steps_of(frames: list[bytes]) -> np.ndarray:
    """Steps of the first channel from cycle to cycle [n]."""
    if not frames:
        return np.empty(0)
    times, samples, _dropped = traces(frames)
    assert len(times) == len(samples)
    # A cycle that the host missed is no sample; only neighbours in time are compared.
    steps = np.diff(samples[:, 0])[np.diff(times) < 0.0015]
    return steps[~np.isnan(steps)]


def at_speed(frames: list[bytes]) -> int:
    """In how many cycles the target went on by 300 rpm: 327.68 increments in 1 ms."""
    return int(np.count_nonzero(np.abs(steps_of(frames) - 327.68) < 1.5))


def test_silence_of_the_page_brakes(station: Station, cyclic: tuple[str, str]) -> None:
    a, _ = cyclic
    with station.live() as page:

        def jog() -> Any:
            page.send(type="jog_start", drive=a, direction=1, **JOG)
            hold(page, a, 1.5)
            return page.wait("jog_ended", drive=a, timeout_s=20)

        ended = undisturbed(jog)
    assert "500 ms" in ended["reason"]
    within(5, lambda: abs(station.state(a)["velocity"]) < 2, "it stands")


def test_stop_brakes_cyclic_motion(station: Station, cyclic: tuple[str, str]) -> None:
    a, _ = cyclic
    with station.live() as page:
        page.send(type="jog_start", drive=a, direction=-1, **JOG)
        hold(page, a, 1.5)
        assert a in station.ok(station.http.post("/stop", json={}))["stopped"]
        hold(page, a, 0.3)
        page.wait("jog_ended", drive=a, timeout_s=20)
        within(5, lambda: abs(station.state(a)["velocity"]) < 2, "it stands")
        now = station.state(a)
    assert now["state"] != "Operation enabled"


@pytest.mark.long
@pytest.mark.parametrize(("mode", "amplitude"), [("CSP", 0.25), ("CSV", 120.0), ("CST", 4.0)])
def test_signal_generator(
    station: Station, cyclic: tuple[str, str], mode: str, amplitude: float
) -> None:
    a, _ = cyclic
    body = {"mode": mode, "shape": "sine", "amplitude": amplitude, "duration_s": 1.0,
            "frequency_hz": 4.0, "travel_limit": 5, "speed_limit": 1500,
            "torque_limit": 250}  # fmt: skip
    job = undisturbed(
        lambda: station.job(station.http.post(f"/drives/{a}/jobs/generate", json=body), 60)
    )
    assert job["state"] == "done", job
    assert job["result"]["cycles"] == 1000
    assert station.state(a)["state"] == "Switch on disabled"


@pytest.mark.long
def test_signal_outside_the_envelope_moves_nothing(
    station: Station, cyclic: tuple[str, str]
) -> None:
    a, _ = cyclic
    before = station.state(a)["position"]
    body = {"mode": "CSP", "shape": "trapezoid", "amplitude": 8.0, "duration_s": 2.0,
            "travel_limit": 1, "speed_limit": 300, "torque_limit": 100}  # fmt: skip
    job = station.job(station.http.post(f"/drives/{a}/jobs/generate", json=body), 60)
    assert job["state"] == "failed"
    assert "envelope allows" in job["problem"]["detail"]
    assert station.state(a)["position"] == pytest.approx(before, abs=0.001)


@pytest.mark.long
def test_profile_moves_are_refused_while_cyclic(station: Station, cyclic: tuple[str, str]) -> None:
    a, _ = cyclic
    body = {"mode": "PP", "target": 1.0, "relative": True, "travel_limit": 3, "torque_limit": 100}
    job = station.job(station.http.post(f"/drives/{a}/jobs/move", json=body), 60)
    assert job["state"] == "failed"
    assert "cyclic" in job["problem"]["detail"]


def command(station: Station, *arguments: str, code: int = 0) -> str:
    """What `servodeck` prints when it asks the running server."""
    done = CliRunner().invoke(cli.app, [*arguments, "--server", station.url])
    assert done.exit_code == code, done.output
    return str(done.output)


def test_command_line_finds_reads_writes_and_saves(station: Station, axes: tuple[str, str]) -> None:
    found = json.loads(command(station, "scan", URL, "--json"))
    best = [(row["station"], row["profiles"][0]) for row in found]
    assert best == [(1, "mms7"), (2, "mms7")]
    at_b = ("--station", "2")
    reported = command(station, "params", "set", URL, "2005:03=160", *at_b)
    assert reported.startswith("2005:03  ")
    assert "= 160.0 " in reported
    assert "[raw 1600]" in reported
    assert reported in command(station, "params", "get", URL, "2005:03", "6041:00", *at_b)
    assert "saved in the drive's memory" in command(station, "params", "save", URL, *at_b)
    _, b = axes
    reading = station.ok(station.http.get(f"/drives/{b}/parameters/2005:03"))
    assert (reading["raw"], reading["unsaved"]) == (1600, False)
    whole = command(station, "params", "dump", URL, *at_b)
    assert 'profile = "mms7"' in whole
    refused = command(station, "params", "set", URL, "2005:03=-5", *at_b, code=1)
    assert "2005:03" in refused
    assert "try:" in refused


@pytest.mark.long
def test_command_line_compares_and_loads(
    station: Station, axes: tuple[str, str], tmp_path: Path
) -> None:
    at_b = ("--station", "2")
    file = tmp_path / "b.sdset"
    command(station, "params", "set", URL, "2005:03=170", *at_b)
    command(station, "params", "dump", URL, "--out", str(file), *at_b)
    assert command(station, "params", "diff", URL, str(file), *at_b) == ""
    command(station, "params", "set", URL, "2005:03=180", *at_b)
    shown = command(station, "params", "diff", URL, str(file), *at_b, code=1)
    assert "2005:03" in shown
    assert "drive 180.0 Hz  [raw 1800] → file 170.0 Hz  [raw 1700]" in shown
    reported = json.loads(
        command(station, "params", "diff", URL, str(file), "--json", *at_b, code=1)
    )
    assert [(row["key"], row["drive_value"], row["unit"]) for row in reported] == [
        ("2005:03", 180.0, "Hz")
    ]
    done = command(station, "params", "load", URL, str(file), "--yes", *at_b)
    assert "written 1, failed 0" in done
    assert "the values before are in before load" in done
    assert "[raw 1700]" in command(station, "params", "get", URL, "2005:03", *at_b)
    assert "nothing to write" in command(station, "params", "load", URL, str(file), *at_b)
    other = tmp_path / "other.sdset"
    other.write_text(file.read_text().replace('profile = "mms7"', 'profile = "m6l"'))
    refused = command(station, "params", "diff", URL, str(other), *at_b, code=2)
    assert "is of a m6l drive, this is a mms7" in refused
    refused = command(station, "params", "diff", URL, str(tmp_path / "none"), *at_b, code=2)
    assert "cannot be read: No such file" in refused


@pytest.mark.long
def test_command_line_tells_terminals_faults_and_gear(
    station: Station, axes: tuple[str, str]
) -> None:
    at_b = ("--station", "2")
    found = json.loads(command(station, "io", URL, "--json", *at_b))
    assert [terminal["name"] for terminal in found] == ["DI1", "DI2", "DI3", "DI4", "DO1", "DO2"]
    assert found[0]["function_name"] == "not used"
    assert "20 past faults" in command(station, "faults", URL, *at_b)
    screw = ("--kind", "screw", "--lead", "10", *at_b)
    before = command(station, "params", "get", URL, "6092:01", *at_b)
    assert "6092:01 Feed: 10000" in command(station, "gear", URL, *screw)
    assert command(station, "params", "get", URL, "6092:01", *at_b) == before, "only planned"
    assert "'6092:01': 65536" in command(station, "gear", URL, *screw, "--write")
    assert "10000" in command(station, "params", "get", URL, "6092:01", *at_b)
    command(station, "params", "set", URL, "6092:01=65536", "--raw", *at_b)


@pytest.mark.long
def test_command_line_jogs_and_records(
    station: Station, axes: tuple[str, str], tmp_path: Path
) -> None:
    _, b = axes
    before = station.state(b)["position"]
    turn = ("--station", "2", "--speed", "300", "--seconds", "0.8", "--travel", "20",
            "--torque", "200", "--acceleration", "3000", "--cycle-us", "1000")  # fmt: skip
    said = command(station, "jog", URL, *turn)
    assert "ended: " in said
    assert station.state(b)["position"] > before + 0.5, said
    assert station.ok(station.http.get("/buses"))[0]["cyclic"] is None, "as it was before"
    file = tmp_path / "x.csv"
    reported = command(
        station, "scope", URL, "6064:00", "606C:00", "--station", "1", "--station", "2",
        "--seconds", "1", "--out", str(file), "--cycle-us", "1000",
    )  # fmt: skip
    assert "lost on the way" in reported
    head, *rows = file.read_text().splitlines()
    assert head.startswith("time [s],")
    assert [title.split()[:2] for title in head.replace('"', "").split(",")[1:]] == [
        ["A", "6064:00"],
        ["A", "606C:00"],
        ["B", "6064:00"],
        ["B", "606C:00"],
    ]
    times = np.array([float(row.split(",")[0]) for row in rows])
    assert len(times) > 100
    assert np.median(np.diff(times)) == pytest.approx(0.001)
    assert np.diff(times).min() > 0
    middle = rows[len(rows) // 2].split(",")
    assert len(middle) == 5
    assert all(middle), "all axes in one row"


def test_command_line_tells_that_no_server_answers(tmp_path: Path) -> None:
    done = CliRunner().invoke(cli.app, ["scan", URL, "--server", "http://127.0.0.1:9"])
    assert done.exit_code == 1
    assert "no server answers at http://127.0.0.1:9" in done.output
    assert "servodeck demo" in done.output
