"""``servodeck autotune``: in virtual time, by itself and by a server in the same process."""

from __future__ import annotations

import json
import re
import signal
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace

import httpx
import pytest
from typer.testing import CliRunner

from backend import cli
from backend.api.app import make_app
from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.drive.drive import Drive
from backend.commands.base.remote import Remote
from backend.commands.measuring import measure, tools
from backend.foundation.work.jobs import Progress
from backend.records.library.measurements import unpack
from backend.station.bench import Bench
from backend.station.evaluation import recompute
from backend.tools.measuring.temporary import write_settings
from backend.tools.mechanics.inertia.result import InertiaAnswer
from backend.tools.tuning.autotune import tool
from backend.tools.tuning.autotune.result import (
    AutotuneAnswer,
    CandidateInfo,
    FiltersInfo,
    GainsInfo,
    GoalsInfo,
    MarginsInfo,
    NotchInfo,
    VerifiedInfo,
)
from backend.tools.tuning.autotune.run import AutotuneSettings
from backend.tools.tuning.sweep.result import SweepAnswer
from backend.tools.wire_message import wire_messages
from drivers.cia402 import State
from drivers.texts.message import prose, text
from drivers.virtual.firmware.factory import make_device
from profiles.loader import load_profile
from tests.support import measurements as known
from tests.virtual.tools.direct import DirectLink, direct
from tests.virtual.tools.rig import mechanics

ONE = mechanics((1e-4, 60.0, 0.006))
URL = "ethercat://eth7"
#: Bandwidth of the speed loop and inertia, which every design changes.
GAINS = ("2005:03", "2001:06")


def run(*arguments: str) -> tuple[int, str]:
    done = CliRunner().invoke(cli.app, ["autotune", *arguments])
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.exit_code, done.output


class Alone:
    """The command with a virtual drive in the place of a bus, and what it leaves behind."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.before: dict[str, int] = {}
        self.after: dict[str, int] = {}
        self.state: State | None = None
        monkeypatch.setattr(measure, "exchanging", self.exchanging)

    @asynccontextmanager
    async def exchanging(
        self, *_where: object, **_how: object
    ) -> AsyncIterator[tuple[Axis, CyclicSession]]:
        async with direct(ONE) as bench:
            drive = bench.axis.drive
            self.before = {key: await drive.raw(key) for key in GAINS}
            try:
                yield bench.axis, bench.session
            finally:
                self.after = {key: await drive.raw(key) for key in GAINS}
                self.state = await bench.axis.state()


def test_a_kept_design_is_verified_and_in_force(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    alone, file = Alone(monkeypatch), tmp_path / "tuned.json"
    code, reported = run(URL, "--keep", "--mark", "robust", "--out", str(file))
    assert code == 0, reported
    answer = json.loads(file.read_text())
    for mark in ("robust", "balanced", "fast"):
        assert re.search(rf"^\S*{mark}\S* .* Hz .* Hz", reported, re.MULTILINE), reported
    shown = re.search(r"^Bandwidth +([\d.]+) Hz +([\d.]+) Hz$", reported, re.MULTILINE)
    assert shown, reported
    verified = answer["verified"]
    assert float(shown[1]) == pytest.approx(verified["predicted_bandwidth_hz"], abs=0.01)
    assert float(shown[2]) == pytest.approx(verified["measured_bandwidth_hz"], abs=0.01)
    assert "they are not stored in the drive yet" in reported
    assert alone.after != alone.before
    assert {key: answer["before"][key] for key in GAINS} == alone.before
    assert alone.state is not State.OPERATION_ENABLED


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_and_a_termination_leave_everything_as_it_was(
    monkeypatch: pytest.MonkeyPatch, number: signal.Signals
) -> None:
    alone = Alone(monkeypatch)
    before = signal.getsignal(signal.SIGTERM)

    def ending() -> Progress:
        def changed() -> None:
            # How often a fast computer reports its progress depends on how fast it is.
            if shown.step.startswith("3 of 6: frequency response: measuring") and not sent:
                sent.append(True)
                signal.raise_signal(number)

        sent: list[bool] = []
        shown = Progress(changed)
        return shown

    monkeypatch.setattr(tools, "progress", ending)
    code, reported = run(URL, "--apply")
    assert code == 130
    assert "as before" in reported
    assert alone.after == alone.before
    assert alone.state is not State.OPERATION_ENABLED
    assert signal.getsignal(signal.SIGTERM) == before


NOTHING = MarginsInfo(
    crossover_hz=None, phase_margin_deg=None, phase_margin_hz=None, gain_margin_db=None,
    gain_margin_hz=None, ms=None, ms_hz=None, stable=True,
)  # fmt: skip
DESIGN = CandidateInfo(
    marks=("balanced",),
    notches=(NotchInfo(center_hz=156.0, width_hz=30.0, depth_db=-12.0),),
    gains=GainsInfo(speed_nms=0.2, integral_hz=22.0, position_1_s=140.0, speed_bandwidth_hz=220.0),
    bandwidth_hz=92.0,
    position_bandwidth_hz=None,
    nominal=NOTHING,
    promised=GoalsInfo(phase_margin_deg=48.0, gain_margin_db=9.0, ms=1.8),
    phase_cost_deg=4.0,
    settling_s=0.02,
    overshoot_percent=25.0,
    filters=FiltersInfo(speed_hz=None, torque_hz=None),
)


def answer(
    drive: Drive, before: dict[str, int], after: Mapping[str, int] | None = None
) -> AutotuneAnswer:
    """A design that was applied and verified, on measurements whose results are known."""
    loop, moves = (
        recompute(unpack(known.file_of(drive, made, datetime.now(UTC))))
        for made in (known.speed_loop(), known.inertia())
    )
    sweep = SweepAnswer.model_validate(loop)
    margins: dict[str, float | bool | None] = {
        "phase_margin_deg": 56.6,
        "gain_margin_db": None,
        "ms": 1.12,
    }
    verified = VerifiedInfo(
        verdict=None,
        gain_steps=None,
        sweep=sweep.model_copy(update={"margins": margins}),
        predicted_bandwidth_hz=92.0,
        measured_bandwidth_hz=91.5,
        expected=None,
    )
    return AutotuneAnswer(
        inertia=InertiaAnswer.model_validate(moves), mechanics=sweep, load="stiff",
        candidates=(DESIGN,), applied=DESIGN, verified=verified, again=None, step=None,
        before=before, after=dict(after or {}), tried=("300 Hz: too fast",), tried_messages=TRIED,
        notes=(), note_messages=(), cautious=False,
    )  # fmt: skip


TRIED = wire_messages([text("autotune.candidate", bandwidth_hz=300.0, why=prose("too fast"))])


@pytest.mark.long
@pytest.mark.parametrize("keep", [False, True])
def test_by_a_server_a_design_is_taken_back_or_kept(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, keep: bool
) -> None:
    """The way to the server and back; the tuning itself is that of the test above."""
    seen: dict[str, dict[str, int]] = {}
    asked: list[AutotuneSettings] = []

    async def tuned(
        axis: Axis, _session: object, settings: AutotuneSettings, *_: object
    ) -> SimpleNamespace:
        asked.append(settings)
        before = await write_settings(axis, {"2005:03": 2200, "2001:06": 1500})
        seen["meanwhile"] = {key: await axis.drive.raw(key) for key in GAINS}
        return SimpleNamespace(before=before, drive=axis.drive)

    def answer_of(found: SimpleNamespace, after: Mapping[str, int]) -> AutotuneAnswer:
        return answer(found.drive, found.before, after)

    @asynccontextmanager
    async def remote(address: str) -> AsyncIterator[Remote]:
        link = DirectLink(make_device("mms7", ONE), load_profile("mms7"))
        bench = Bench(tmp_path, {URL: lambda: link})
        drive = (await bench.connect(URL, 1, "mms7", "Spindle")).drive
        seen["before"] = {key: await drive.raw(key) for key in GAINS}
        transport = httpx.ASGITransport(make_app(bench, hosts=frozenset({"test"})))
        async with httpx.AsyncClient(transport=transport, base_url=f"{address}/api/v1") as http:
            yield Remote(address, http)
        seen["after"] = {key: await drive.raw(key) for key in GAINS}
        assert not bench.sessions, "the exchange that it started is ended"
        await bench.close()

    monkeypatch.setattr(tool, "autotune", tuned)
    monkeypatch.setattr(tool, "answer_of", answer_of)
    monkeypatch.setattr(measure, "remote", remote)
    how = "--keep" if keep else "--apply"
    code, reported = run(
        "--server", "http://test", "--axis", "Spindle", how, "--mark", "fast", "--load", "stiff",
        "--travel-rev", "2", "--torque-percent", "50",
    )  # fmt: skip
    assert code == 0, reported
    (settings,) = asked
    assert (settings.mark, settings.load, settings.apply) == ("fast", "stiff", True)
    assert (settings.envelope.travel_rev, settings.envelope.torque_percent) == (2.0, 50.0)
    assert re.search(r"^balanced +220\.0 Hz +92\.0 Hz .*156 Hz$", reported, re.MULTILINE), reported
    assert re.search(r"^phase margin, at least +48\.00° +56\.60°$", reported, re.MULTILINE), (
        reported
    )
    assert re.search(r"^gain margin, at least +9\.00 dB +—$", reported, re.MULTILINE), reported
    assert "not kept: 300 Hz: too fast" in reported
    assert seen["meanwhile"] != seen["before"]
    assert seen["after"] == seen["meanwhile" if keep else "before"]
    assert ("undone: all parameters are as before" in reported) is not keep


def test_a_drive_that_the_server_does_not_have(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    @asynccontextmanager
    async def remote(address: str) -> AsyncIterator[Remote]:
        app = make_app(Bench(tmp_path), hosts=frozenset({"test"}))
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url=f"{address}/api/v1") as http:
            yield Remote(address, http)

    monkeypatch.setattr(measure, "remote", remote)
    code, reported = run("--server", "http://test", "--axis", "Table")
    assert code == 1
    assert "http://test has no drive 'Table'" in reported


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ([], 1, "give a bus URL and --station, or --server and --axis"),
        ([URL, "--end-low-rev", "0.5"], 2, "give both --end-low-rev and --end-high-rev"),
        ([URL, "--mark", "quick"], 2, "'quick' is not one of"),
    ],
)
def test_wrong_words(words: list[str], code: int, said: str) -> None:
    done = CliRunner().invoke(cli.app, ["autotune", *words])
    assert done.exit_code == code
    assert said in re.sub(r"[\s│]+", " ", done.output)
