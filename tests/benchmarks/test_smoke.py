"""Every benchmark runs to its end, here in its smallest form: `make bench` prints the figures."""

from __future__ import annotations

import importlib
import pkgutil
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pytest

import benchmarks
from benchmarks import __main__ as all_of_them

ROOT = Path(__file__).resolve().parents[2]
MODULES = {m.name for m in pkgutil.iter_modules(benchmarks.__path__) if m.name[0] != "_"}


@dataclass(frozen=True)
class Smallest:
    """Arguments and numbers of the module with which it takes seconds.

    ``long``: left to the long suite, for its servers, browsers and buses in real time, or as a test
    of `make test` runs the same.
    """

    arguments: tuple[str, ...] = ()
    numbers: Mapping[str, object] = field(default_factory=dict)
    long: bool = False


SMALLEST = {
    "analysis_accuracy": Smallest(("rigid",), {"RATES_HZ": (1000.0,), "LOOPS": ((0.0, False),)}),
    "analysis_campaign": Smallest(("--seeds", "0", "1", "--khz", "1")),
    "analysis_comparison": Smallest(("rigid",), {"RATES_HZ": (1000.0,)}),
    "canopen_sync": Smallest(("--seconds", "0.5")),
    "canopen_throughput": Smallest((), {"READS": 20, "RUNS": 1}),
    "cycle_load": Smallest(),
    "doctor": Smallest(("--count", "1", "--bus", "canopen")),
    "ethercat_cycle": Smallest(("--seconds", "0.5", "--rates", "1000", "--slaves", "1"), long=True),
    "ethercat_parameters": Smallest(("--drives", "1"), {"ROUNDS": 1}),
    "flight_recorder": Smallest(
        ("--pairs", "2", "--seconds", "0.5"), {"_SETTLE_S": 0.1}, long=True
    ),
    "handover_table": Smallest(long=True),
    "health_trend": Smallest((), {"AXES": 2, "RUNS": 5, "binaries": lambda: None}),
    "import_accuracy": Smallest(("--benches", "1")),
    "independent_slave": Smallest(),
    "install": Smallest(("nowhere",)),
    "jog_stop": Smallest((), {"RUNS": 2}, long=True),
    "modbus_dump": Smallest((), {"RUNS": 1}),
    "people_load": Smallest((), {"VIEWERS": 2, "ROUNDS": 1}, long=True),
    "profile_load": Smallest((), {"_RUNS": 1}),
    "recording": Smallest((), {"TURNS": 1, "SECONDS": 2, "ROUNDS": 1}),
    "rough_campaign": Smallest(("--axes", "1", "--tune", "0"), long=True),
    "scope_latency": Smallest((), {"SECONDS": 1.0, "PAGES": (0, 1)}, long=True),
    "scope_soak": Smallest((), {"SECONDS": 3.0, "BASELINE_S": 1.0}, long=True),
    "serial_throughput": Smallest((), {"SECONDS_EACH": 0.1, "SPEEDS": (("115200 baud", 115_200),)}),
    "station_rights": Smallest(("nowhere",)),
    "station_soak": Smallest((), {"SECONDS": 2.0}, long=True),
    "thresholds": Smallest(("--only", "nothing"), {"AXES": ((1, 1000.0),)}),
    "tune_accuracy": Smallest(("--khz", "1", "--only", "motor alone", "--wire", "none"), long=True),
    "virtual_kernel": Smallest(("0.01",)),
}


#: Their small forms are tests of their own.
ELSEWHERE = {
    "chaos": "tests/virtual/test_mixed_chaos.py",
    "commissioning": "tests/virtual/tools/test_commissioning_benchmark.py",
}


def marked(name: str) -> object:
    return pytest.param(name, marks=pytest.mark.long) if SMALLEST[name].long else name


@pytest.mark.parametrize("name", [marked(name) for name in sorted(SMALLEST)])
def test_it_runs_to_its_end(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    module = importlib.import_module(f"benchmarks.{name}")
    for number, value in SMALLEST[name].numbers.items():
        monkeypatch.setattr(module, number, value)
    monkeypatch.setattr(sys, "argv", [name, *SMALLEST[name].arguments])
    module.main()
    assert capsys.readouterr().out


def test_every_benchmark_is_here() -> None:
    """Its import alone would have found those that `make bench` stumbled over."""
    runnable = {n for n in MODULES if hasattr(importlib.import_module(f"benchmarks.{n}"), "main")}
    assert runnable == SMALLEST.keys() | ELSEWHERE.keys()
    assert all((ROOT / file).is_file() for file in ELSEWHERE.values())


def test_one_that_ends_the_program_does_not_end_the_others(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("benchmarks.install.main", lambda: sys.exit(2))
    monkeypatch.setattr("benchmarks.modbus_dump.main", lambda: print("measured"))
    monkeypatch.setattr(sys, "argv", ["benchmarks", "install", "modbus_dump"])
    assert all_of_them.main() == 1
    assert "broken: SystemExit: 2" in (printed := capsys.readouterr().out)
    assert "measured" in printed
