"""``servodeck demo --defect``: the command is started with defects, and the tools find them.

The bench file is healthy. The defects here are those of a motor and its brake; a loose coupling and
a worn belt are found in simulated time (`tests/virtual/tools`), a gantry out of square through the
page (`tests/browser`), all on benches that `DemoBench` makes as the command does.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest

from drivers.virtual.defects import DEFECT_WORDS, SLIPS, Defect
from drivers.virtual.wires.netns import unavailable
from tests.support.station import NO_CERTIFICATES, until

pytestmark = pytest.mark.timeout(400)

RATED_NM, COULOMB_NM = 1.27, 0.03
AXIS = """
[[axis]]
name = "{name}"
drive = "r6l"
on = "ethercat://virtual0"
station = {station}
connected = true
[axis.mechanics.motor]
inertia_kgm2 = 5e-5
rated_torque_nm = {rated}
rated_speed_rpm = 3000
[axis.mechanics.friction]
viscous_nms = 2e-4
coulomb_nm = {coulomb}
"""
#: What first power finds of the phases, and the next step.
BY_FIRST_POWER: dict[Defect, tuple[str, str]] = {
    "phases_shifted": ("reversed", "Turn the shaft by hand to learn which it is"),
    "phases_exchanged": ("locks", "Exchange two phases or invert the feedback, and repeat"),
    "feedback_inverted": ("locks", "Exchange two phases or invert the feedback, and repeat"),
    "brake_closed": ("no_motion", "Listen whether the brake opens"),
}
SLIPPING = "Slipping"
PLANTED: tuple[tuple[str, Defect], ...] = (
    *((name, name) for name in BY_FIRST_POWER),
    (SLIPPING, "brake_slips"),
    # Its supply is disconnected for the test, as this drive itself cannot keep it closed.
    (SLIPPING, "brake_closed"),
)
#: First power needs no fast cycle, and a computer has less to do with a slow one.
ASKED = {"rated_torque_nm": RATED_NM, "nothing_hangs": True}
CYCLE_US = 2000


@dataclass
class Demo:
    """The running command: its interface, and what it printed before it served."""

    http: httpx.Client
    printed: str

    def __post_init__(self) -> None:
        self.drives = {each["name"]: each["id"] for each in self.ok(self.http.get("/drives"))}

    def ok(self, answer: httpx.Response) -> Any:
        assert answer.is_success, answer.text
        return answer.json()

    def measured(self, name: str, tool: str, **asked: object) -> Any:
        """The result of a tool on this axis."""
        path = f"/drives/{self.drives[name]}/jobs/{tool}"
        begun = self.ok(self.http.post(path, json={**ASKED, **asked}))

        def ended() -> Any:
            job = self.ok(self.http.get(f"/jobs/{begun['id']}"))
            return job if job["state"] != "running" else None

        job = until(ended, what=f"{tool} of {name}")
        assert job["state"] == "done", (job["problem"], job["cancellation"])
        return job["result"]

    def report(self, name: str) -> str:
        """The commissioning report of an axis, as HTML."""
        asked = {"format": "html", "language": "en"}
        made = self.ok(self.http.post(f"/drives/{self.drives[name]}/reports", json=asked))
        return self.http.get(f"/reports/{made['file']}").text


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Demo]:
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    folder = Path(tmp_path_factory.mktemp("demo"))
    bench = folder / "bench.toml"
    axes = [
        AXIS.format(name=name, station=station, rated=RATED_NM, coulomb=COULOMB_NM)
        for station, name in enumerate(dict(PLANTED), 1)
    ]
    bench.write_text("".join(axes), "utf-8")
    command = [sys.executable, "-m", "backend", "demo", "--port", "0"]
    command += ["--bench", str(bench), "--config", str(folder / "state")]
    for name, defect in PLANTED:
        command += ["--defect", f"{name}={defect}"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        printed = ""
        try:
            for line in process.stdout:
                printed += line
                if at := re.search(r"servodeck is at (\S+)/", line):
                    break
            else:
                raise AssertionError(f"the demo ended: {printed}")
            base = f"{at[1]}/api/v1"
            with httpx.Client(base_url=base, timeout=60.0, verify=NO_CERTIFICATES) as http:
                demo = Demo(http, printed)
                cycle = {"url": "ethercat://virtual0", "cycle_us": CYCLE_US}
                demo.ok(http.post("/buses/cyclic", json=cycle))
                yield demo
        finally:
            process.terminate()
            process.wait(30)


def test_every_defect_is_named_at_the_start(demo: Demo) -> None:
    for name, defect in PLANTED:
        words = DEFECT_WORDS[defect].words("en")
        assert f"{name} has a planted defect: {words}" in demo.printed


@pytest.mark.parametrize("defect", BY_FIRST_POWER)
def test_first_power_finds_it_and_names_the_next_step(demo: Demo, defect: Defect) -> None:
    result = demo.measured(defect, "first-power")
    code, next_step = BY_FIRST_POWER[defect]
    checks = {each["name"]: each["finding"] for each in result["checks"]}
    assert checks["phases"] == code
    assert result["travel_rev"] <= 0.1
    assert result["torque_percent"] <= 10.0
    assert next_step in demo.report(defect)


def test_the_brake_test_finds_a_brake_that_slips(demo: Demo) -> None:
    result = demo.measured(SLIPPING, "brake-test", brake_supply_cut=True)
    assert result["verdict"] == "slipped"
    # Holding torque of the brake and dry friction of the shaft.
    truth = 100.0 * (SLIPS * RATED_NM + COULOMB_NM) / RATED_NM
    assert result["torque_percent"] == pytest.approx(truth, rel=0.05)
    words = "secure the load, and have the brake repaired or replaced"
    assert words in demo.report(SLIPPING)
