"""The preflight through the command line and the interface, on loopback and on a private cable."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from drivers.computer.network.sockets import hold_name
from drivers.virtual.wires.netns import Namespace, unavailable
from tests.support.station import Station

ROOT = Path(__file__).resolve().parents[2]


def command(*arguments: str, inside: Namespace | None = None) -> subprocess.CompletedProcess[str]:
    argv = [sys.executable, "-m", "backend", "preflight", *arguments]
    return subprocess.run(
        inside.command(argv) if inside else argv,
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=100,
    )


@pytest.mark.long
@pytest.mark.skipif(unavailable() is not None, reason="no network namespaces here")
def test_frames_on_a_private_cable(tmp_path: Path) -> None:
    """Loopback inside a namespace of its own returns every frame."""
    with Namespace.create() as namespace:
        options = ("--json", "--seconds", "1", "--config", str(tmp_path))
        done = command("lo", *options, inside=namespace)
        result = json.loads(done.stdout)
        runs = {one["period_us"]: one for one in result["measured"]}
        assert set(runs) == {1000, 250}
        assert sum(runs[1000]["round_trip"]["counts"]) > 100
        assert [one["purpose"] for one in result["verdicts"]] == [
            "parameters",
            "scope_1khz",
            "response_1khz",
            "response_4khz",
        ]
        silent = json.loads(command("ec0m", *options, inside=namespace).stdout)
        assert silent["measured"][0]["round_trip"] is None
        assert silent["measured"][0]["unanswered"] > 0
    assert set(json.loads((tmp_path / "preflight.json").read_text())) == {"lo", "ec0m"}


@pytest.mark.long
def test_an_interface_that_is_not_there_blocks_and_is_named_first(tmp_path: Path) -> None:
    done = command("nosuch0", "--seconds", "0", "--config", str(tmp_path))
    assert done.returncode == 1, done.stderr
    assert "-> There is no network interface nosuch0." in done.stdout
    assert "not suitable" in done.stdout


@pytest.mark.long
def test_a_bus_in_use_is_left_alone(tmp_path: Path) -> None:
    with hold_name("servodeck-ethercat-lo"):
        done = command("lo", "--seconds", "1", "--config", str(tmp_path))
    assert done.returncode == 1
    assert "an EtherCAT master of servodeck uses lo" in done.stderr


@pytest.mark.long
def test_a_measurement_is_a_job_and_its_result_is_kept(station: Station) -> None:
    before = station.ok(station.http.get("/preflight"))
    assert {one["grade"] for one in before["verdicts"]} <= {"suitable", "not_measured"}
    job = station.done(station.http.post("/preflight", json={"seconds": 1}))
    assert set(job["verdicts"]) == {one["purpose"] for one in before["verdicts"]}
    after = station.ok(station.http.get("/preflight", params={"language": "zh"}))
    assert after["measured"] is not None
    for run in after["runs"]:
        assert sum(run["lateness"]) == run["cycles"]
        assert len(run["lateness"]) == len(run["edges_us"]) + 1
    assert "1 kHz 示波器" in {one["name"] for one in after["verdicts"]}


@pytest.mark.long
def test_a_name_that_is_no_interface_is_refused(station: Station) -> None:
    answer = station.http.get("/preflight", params={"interface": "../etc"})
    assert answer.status_code == 422
