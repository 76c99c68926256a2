"""``servodeck health`` from measuring to the trend, through a server's interface and its database.

What an axis would answer is given here; `test_health` measures it on virtual mechanics.
"""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import httpx
import pytest
from typer.testing import CliRunner

from backend import cli
from backend.api.app import make_app
from backend.commands.base.remote import Remote
from backend.commands.measuring import health, measure
from backend.station.bench import Bench
from backend.tools.tool import Run
from backend.tools.watching.health import run as health_run
from backend.tools.watching.health.result import HealthRound, HealthValue
from backend.tools.watching.health.settings import HealthSettings
from drivers.texts.message import speaking
from drivers.virtual.firmware.factory import make_device
from profiles.loader import load_profile
from tests.virtual.tools.direct import DirectLink
from tests.virtual.tools.rig import mechanics

URL = "ethercat://virtual7"
AT = (URL, "--station", "1", "--profile", "mms7", "--server", "http://test")
ON = ("--server", "http://test", "--axis", "X")


class Axis:
    """What its rounds answer, in turn, and the settings that they were asked with."""

    def __init__(self) -> None:
        self.frequencies = iter([60.0, 60.05, 59.95])
        self.asked: list[HealthSettings] = []

    async def round(self, _run: Run, settings: HealthSettings, _part: object) -> HealthRound:
        self.asked.append(settings)
        value = next(self.frequencies)
        return HealthRound(
            values=(HealthValue(quantity="resonance", value=value),), missing=("friction",)
        )


def run(*arguments: str, code: int = 0) -> str:
    done = CliRunner().invoke(cli.app, ["health", *arguments])
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    assert done.exit_code == code, done.output
    return done.output


@pytest.fixture
def axis(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Axis:
    """A server whose bench has one drive, and whose rounds are those of `Axis`."""

    @asynccontextmanager
    async def remote(address: str) -> AsyncIterator[Remote]:
        link = DirectLink(make_device("mms7", mechanics((1e-4, 60.0, 0.006))), load_profile("mms7"))
        bench = Bench(tmp_path, {URL: lambda: link})
        transport = httpx.ASGITransport(make_app(bench, hosts=frozenset({"test"})))
        try:
            async with httpx.AsyncClient(transport=transport, base_url=f"{address}/api/v1") as http:
                body = {"url": URL, "station": 1, "profile": "mms7", "name": "X"}
                (await http.post("/drives", json=body)).raise_for_status()
                yield Remote(address, http)
        finally:
            await bench.close()

    made = Axis()
    monkeypatch.setattr(health_run, "_round", made.round)
    for module in (measure, health):
        monkeypatch.setattr(module, "remote", remote)
    return made


@pytest.mark.long
def test_from_a_measurement_to_a_change(axis: Axis, tmp_path: Path) -> None:
    out = run("measure", *AT, "--rounds", "3", "--speed-rpm", "800", "--consent")
    assert "3 rounds were measured" in out
    assert "Resonance 1, round 2: 60.05 Hz" in out
    assert "without an answer in round 1: friction" in out

    refused = run("baseline", *ON, code=1)
    assert "a baseline is signed by a person" in refused
    assert "no baseline" in run("repeat", *ON, code=1)
    (signed,) = json.loads(run("baseline", *ON, "--person", "Ann", "--json"))
    assert signed["baseline"]["person"] == "Ann"
    assert len(signed["baseline"]["runs"]) == 3
    (file,) = signed["baseline"]["measurements"]
    assert (tmp_path / "measurements" / file).is_file()

    axis.frequencies = iter([60.1, 59.9])
    out = run("repeat", *ON)
    again = axis.asked[-1]
    assert again.speed_limit == 800.0, "the baseline's settings"
    assert not again.consent, "consent is given anew"
    assert "resonance 1: no change of 5 % or more" in out

    axis.frequencies = iter([50.2, 50.3])
    out = run("repeat", *ON, "--consent")
    assert axis.asked[-1].consent
    assert "! resonance 1 has changed by -16" in out
    assert "check the coupling" in out

    # By the server, and from the database when it does not run.
    for place in (("--server", "http://test"), ("--config", str(tmp_path))):
        assert "has changed by -16" in run("compare", *place, code=3)
        (found,) = json.loads(run("trend", *place, "--json", "--axis", "X"))
        values = [each["values"][0]["value"] for each in found["runs"]]
        assert values == [60.0, 60.05, 59.95, 60.1, 59.9, 50.2, 50.3]
        assert found["changed"] == 1
        assert "50.2 Hz" in run("trend", *place)
        (late,) = json.loads(run("trend", *place, "--json", "--since", "2100-01-01"))
        assert not late["runs"]
    with speaking("zh"):
        reported = run("compare", "--config", str(tmp_path), code=3)
        trend = run("trend", "--config", str(tmp_path))
    assert "联轴器" in reported
    assert "谐振 1: 50.2 Hz" in trend
    assert "resonance" not in trend


@pytest.mark.long
def test_what_is_not_there_says_so(axis: Axis, tmp_path: Path) -> None:
    assert "no database" in run("trend", "--config", str(tmp_path / "none"), code=1)
    assert "no drive named Q" in run(
        "baseline", "--server", "http://test", "--axis", "Q", "--person", "Ann", code=1
    )
    run("measure", *AT, "--rounds", "3")
    assert "no health check of an axis named Q" in run(
        "trend", "--config", str(tmp_path), "--axis", "Q", code=1
    )
    assert "X has no baseline" in run("compare", "--config", str(tmp_path))
    assert "no round of this axis has the number 99" in run(
        "baseline", *ON, "--person", "Ann", "--runs", "99", code=1
    )
