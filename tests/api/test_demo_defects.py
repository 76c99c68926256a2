"""``servodeck demo --defect``: the command is started with defects, and the tools find them.

The bench files are healthy: one of this test for the defects of a motor and its brake, and the
product's own with a gantry and an encoder at the load. What takes a baseline, a loose coupling and
the friction of a worn belt, is found in simulated time (`tests/virtual/tools`).
"""

from __future__ import annotations

import math
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest

from drivers.virtual.defects import (
    DEFECT_WORDS,
    OUT_OF_SQUARE_RAD,
    SLIPS,
    Defect,
)
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
#: No job of these takes as long.
LONGEST_S = 150.0


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

    def exchange(self, cycle_us: int, url: str = "ethercat://virtual0") -> None:
        """Start the cyclic exchange of a segment."""
        body = {"url": url, "cycle_us": cycle_us}
        assert self.ok(self.http.post("/buses/cyclic", json=body))["cyclic"]["running"]

    def measured(self, name: str, tool: str, **asked: object) -> Any:
        """The result of a tool on this axis."""
        path = f"/drives/{self.drives[name]}/jobs/{tool}"
        begun = self.ok(self.http.post(path, json=asked))

        def ended() -> Any:
            job = self.ok(self.http.get(f"/jobs/{begun['id']}"))
            return job if job["state"] != "running" else None

        job = until(ended, LONGEST_S, f"{tool} of {name}")
        assert job["state"] == "done", (job["problem"], job["cancellation"])
        return job["result"]

    def report(self, name: str) -> str:
        """The commissioning report of an axis, as HTML."""
        asked = {"format": "html", "language": "en"}
        made = self.ok(self.http.post(f"/drives/{self.drives[name]}/reports", json=asked))
        return self.http.get(f"/reports/{made['file']}").text


@contextmanager
def running(folder: Path, *arguments: str) -> Iterator[Demo]:
    """The command with its state in a folder, until it serves; ended afterwards."""
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    command = [sys.executable, "-m", "backend", "demo", "--port", "0"]
    command += ["--config", str(folder / "state"), *arguments]
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
                yield Demo(http, printed)
        finally:
            process.terminate()
            process.wait(30)


def planting(*planted: tuple[str, Defect]) -> list[str]:
    """Options of the command."""
    return [part for name, defect in planted for part in ("--defect", f"{name}={defect}")]


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Demo]:
    folder = Path(tmp_path_factory.mktemp("demo"))
    bench = folder / "bench.toml"
    axes = [
        AXIS.format(name=name, station=station, rated=RATED_NM, coulomb=COULOMB_NM)
        for station, name in enumerate(dict(PLANTED), 1)
    ]
    bench.write_text("".join(axes), "utf-8")
    with running(folder, "--bench", str(bench), *planting(*PLANTED)) as demo:
        demo.exchange(CYCLE_US)
        yield demo


@pytest.mark.long
def test_every_defect_is_named_at_the_start(demo: Demo) -> None:
    for name, defect in PLANTED:
        words = DEFECT_WORDS[defect].words("en")
        assert f"{name} has a planted defect: {words}" in demo.printed


@pytest.mark.long
@pytest.mark.parametrize("defect", BY_FIRST_POWER)
def test_first_power_finds_it_and_names_the_next_step(demo: Demo, defect: Defect) -> None:
    result = demo.measured(defect, "first-power", **ASKED)
    code, next_step = BY_FIRST_POWER[defect]
    checks = {each["name"]: each["finding"] for each in result["checks"]}
    assert checks["phases"] == code
    assert result["travel_rev"] <= 0.1
    assert result["torque_percent"] <= 10.0
    assert next_step in demo.report(defect)


@pytest.mark.long
def test_the_brake_test_finds_a_brake_that_slips(demo: Demo) -> None:
    result = demo.measured(SLIPPING, "brake-test", **ASKED, brake_supply_cut=True)
    assert result["verdict"] == "slipped"
    # Holding torque of the brake and dry friction of the shaft.
    truth = 100.0 * (SLIPS * RATED_NM + COULOMB_NM) / RATED_NM
    assert result["torque_percent"] == pytest.approx(truth, rel=0.05)
    words = "secure the load, and have the brake repaired or replaced"
    assert words in demo.report(SLIPPING)


# --- Defects of a gantry and of a drive train ----------------------------------------------


@pytest.fixture(scope="module")
def gantry(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Demo]:
    folder = Path(tmp_path_factory.mktemp("gantry"))
    defects = planting(("Left", "out_of_square"), ("Table", "belt_worn"))
    with running(folder, "--bench", "gantry", *defects) as demo:
        yield demo


LIMITS = {"travel_limit": 3.0, "speed_limit": 600.0, "torque_limit": 60.0, "time_limit_s": 60.0}


@pytest.mark.long
def test_the_gantry_tool_finds_a_beam_out_of_square(gantry: Demo) -> None:
    gantry.exchange(1000)
    asked = {"partner": "Right", "lead_mm": 10.0, "resolution_hz": 5.0}
    result = gantry.measured("Left", "gantry", **LIMITS, **asked)
    assert result["findings"][0]["code"] == "out_of_square"
    truth_rev = -OUT_OF_SQUARE_RAD / (2 * math.pi)
    assert result["out_of_square_rev"]["value"] == pytest.approx(truth_rev, rel=0.1)
    report = gantry.report("Left")
    assert "The gantry is out of square" in report
    assert "Correct the reference (homing offset)" in report
