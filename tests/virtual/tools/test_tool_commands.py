"""Commands of measurements: by a bus URL on a server as on a bus of one's own, and what derives.

The measurement itself is that of other tests; here its way there and back counts.
"""

from __future__ import annotations

import asyncio
import inspect
import json
import re
import signal
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import get_args

import httpx
import pytest
from typer.testing import CliRunner

from backend import cli
from backend.analysis.mechanics.slow_moves.inertia import InertiaResult, Interval
from backend.api.app import make_app
from backend.api.records.audit.audited import REPORTED_THERE
from backend.api.security.rights import ROUTES
from backend.axes.axis.axis import Axis
from backend.commands.base import session
from backend.commands.base.remote import Remote
from backend.commands.measuring import measure, report
from backend.station.bench import Bench
from backend.tools.mechanics.friction.result import Code
from backend.tools.mechanics.inertia import run as inertia_run
from backend.tools.mechanics.inertia.evaluation import InertiaOutcome, InertiaSettings
from backend.tools.registry import BY_KIND, TOOLS
from backend.tools.tool import AnyTool
from drivers.virtual.firmware.factory import make_device
from profiles.loader import load_profile
from tests.virtual.tools.direct import DirectLink
from tests.virtual.tools.rig import mechanics

ONE = mechanics((1e-4, 60.0, 0.006))
URL = "ethercat://virtual7"
AT = (URL, "--station", "1", "--profile", "mms7", "--server", "http://test")
FOUND = InertiaOutcome(
    InertiaResult(
        Interval(1.5e-4, 1.4e-4, 1.6e-4), Interval(2e-4, 1e-4, 3e-4), Interval(0.03, 0.02, 0.04),
        Interval(0.0, -0.01, 0.01), 2.0, 0.9999, True, (),
    ),
    "host, free", True, None, 2.5, "given",
)  # fmt: skip


def run(*arguments: str) -> tuple[int, str, str]:
    done = CliRunner().invoke(cli.app, list(arguments))
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.exit_code, done.stdout, done.stderr


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[InertiaSettings]:
    """A server without any drive on its bench; what its measurement was asked for."""
    seen: list[InertiaSettings] = []

    async def measured(_axis: Axis, _s: object, settings: InertiaSettings, *_: object) -> object:
        seen.append(settings)
        return FOUND

    @asynccontextmanager
    async def remote(address: str) -> AsyncIterator[Remote]:
        link = DirectLink(make_device("mms7", ONE), load_profile("mms7"))
        bench = Bench(tmp_path, {URL: lambda: link})
        transport = httpx.ASGITransport(make_app(bench, hosts=frozenset({"test"})))
        try:
            async with httpx.AsyncClient(transport=transport, base_url=f"{address}/api/v1") as http:
                yield Remote(address, http)
            assert [m.drive.profile.drive for m in bench.connected_drives.values()] == ["mms7"]
        finally:
            await bench.close()

    monkeypatch.setattr(inertia_run, "inertia", measured)
    for module in (measure, report):
        monkeypatch.setattr(module, "remote", remote)
    return seen


@pytest.mark.long
def test_a_drive_at_a_bus_url_is_put_on_the_servers_bench(asked: list[InertiaSettings]) -> None:
    code, out, err = run("inertia", *AT, "--travel-rev", "2", "--repetitions", "3")
    assert code == 0, err
    assert "Inertia of motor and load: 0.00015 kg·m² (0.00014 to 0.00016)" in out
    (settings,) = asked
    assert settings.envelope.travel_rev == 2.0
    assert settings.repetitions == 3


def test_json_is_all_that_is_printed(asked: list[InertiaSettings], tmp_path: Path) -> None:
    file = tmp_path / "found.json"
    code, out, err = run("inertia", *AT, "--json", "--out", str(file))
    assert code == 0, err
    answer = json.loads(out)
    assert json.loads(file.read_text()) == answer
    assert (answer["tool"], answer["inertia_kgm2"]) == ("inertia", 1.5e-4)
    assert answer["ci95"]["inertia_kgm2"] == [1.4e-4, 1.6e-4]


def test_a_report_of_a_drive_at_a_bus_url(asked: list[InertiaSettings], tmp_path: Path) -> None:
    file = tmp_path / "report.html"
    code, out, err = run("report", *AT, "--json", "--out", str(file))
    assert code == 0, err
    assert json.loads(out) == {"written": str(file)}
    assert "<html" in file.read_text()
    assert not asked


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.usefixtures("asked")
def test_ctrl_c_ends_with_130(monkeypatch: pytest.MonkeyPatch, number: signal.Signals) -> None:
    ended: list[bool] = []

    async def interrupted(*_: object) -> object:
        try:
            # The command is reported first that its job has begun.
            await asyncio.sleep(1.0)
            signal.raise_signal(number)
            await asyncio.sleep(3600.0)
        finally:
            ended.append(True)
        return FOUND

    monkeypatch.setattr(inertia_run, "inertia", interrupted)
    code, out, err = run("inertia", *AT)
    assert code == 130, err
    assert "cancelled" in err
    assert not out
    assert ended, "the server's job is cancelled with it"


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["inertia"], 1, "give a bus URL and --station, or --server and --axis"),
        (["friction"], 1, "give a bus URL and --station, or --server and --axis"),
        (["sweep"], 1, "give a bus URL and --station, or --server and --axis"),
        (["report", "--out", "a.pdf"], 1, "give either measurement files, or a bus URL"),
        (["report", "ethercat://eth7", "--out", "a.pdf"], 1, "is made by a running server"),
        (["inertia", URL, "--end-low-rev", "0.5"], 2, "give both --end-low-rev and --end-high-rev"),
        (["friction", URL, "--speeds", "1"], 2, "speeds: Input should be greater than or equal"),
        (["inertia", URL, "--scheme", "wide"], 2, "'wide' is not one of"),
    ],
)
def test_wrong_words(words: list[str], code: int, said: str) -> None:
    done = CliRunner().invoke(cli.app, words)
    assert done.exit_code == code
    assert said in re.sub(r"[\s│]+", " ", done.output)


@pytest.mark.parametrize("tool", TOOLS, ids=lambda tool: tool.kind)
def test_everything_around_a_tool_is_there(tool: AnyTool) -> None:
    path = f"POST /api/v1/drives/{{drive_id}}/jobs/{tool.kind}"
    assert path in REPORTED_THERE
    assert ROUTES[path].right is tool.right
    assert tool.kind in cli.COMMANDS
    own = set(tool.settings.model_fields) - set(inspect.getmro(tool.settings)[1].model_fields)  # type: ignore[attr-defined]
    for name in ("title", "help", *(f"field.{each}" for each in own)):
        english, chinese = tool.text(name, "en"), tool.text(name, "zh")
        assert english
        assert chinese
        assert english != chinese


def test_every_finding_of_a_friction_map_has_words() -> None:
    texts = BY_KIND["friction"].texts
    assert {f"finding.{code}" for code in get_args(Code)} == {
        name for name in texts if name.startswith("finding.")
    }


@pytest.mark.long
@pytest.mark.usefixtures("asked")
def test_a_cycle_is_read_by_a_server_without_a_motion(tmp_path: Path) -> None:
    """An axis at standstill: nothing moved meanwhile, and that is what is said."""
    file = tmp_path / "cycle.json"
    code, out, err = run("cycle", *AT, "--duration-s", "2", "--out", str(file))
    assert code == 0, err
    assert "The axis neither moved nor carried torque meanwhile" in out
    answer = json.loads(file.read_text())
    assert (answer["tool"], answer["verdict"]) == ("cycle", "idle")
    assert len(answer["measurements"]) == 1


def test_a_cycle_is_read_on_a_bus_of_ones_own(monkeypatch: pytest.MonkeyPatch) -> None:
    link = DirectLink(make_device("mms7", ONE), load_profile("mms7"))
    touched: list[object] = []

    async def forbidden(*words: object) -> None:
        touched.append(words)

    for name in ("write", "configure", "start", "play", "drive_to"):
        monkeypatch.setattr(link, name, forbidden)
    monkeypatch.setattr(session, "link_for", lambda _url: link)
    code, out, err = run(
        "cycle", "ethercat://eth7", "--station", "1", "--profile", "mms7", "--duration-s", "2",
        "--json",
    )  # fmt: skip
    assert code == 0, err
    assert json.loads(out)["verdict"] == "idle"
    assert touched == []


def test_half_of_an_overload_is_refused() -> None:
    done = CliRunner().invoke(cli.app, ["cycle", URL, "--overload-percent", "300"])
    assert done.exit_code == 2
    assert "give both overload_percent and overload_s" in re.sub(r"[\s│]+", " ", done.output)
