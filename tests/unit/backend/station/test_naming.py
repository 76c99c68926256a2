"""What a drive is called when nobody says."""

from __future__ import annotations

from pathlib import Path

from backend.station.demo import DemoBench
from backend.station.drives.naming import PlaceNames, new_id


def test_a_drive_of_the_demo_is_called_as_its_bench_calls_it(tmp_path: Path) -> None:
    names = PlaceNames(DemoBench(None, tmp_path).names)
    assert names.unused("ethercat://virtual0", 1, []) == "Gantry left"
    # A second port leads to the same drive, which keeps its name to itself.
    assert names.unused("modbus://virtual0", 1, []) == "Low-voltage axis"
    assert names.unused("modbus://virtual0", 1, ["Low-voltage axis"]) == ""
    assert names.unused("modbus:///dev/ttyUSB0", 1, []) == ""


def test_ids_are_plain_and_never_twice() -> None:
    assert new_id("Gantry left", []) == "gantry-left"
    assert new_id("Gantry: left!", {"gantry-left"}) == "gantry-left-2"
    assert new_id("转台", []) == "drive"
