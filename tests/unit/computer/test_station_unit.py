"""The systemd unit grants what the check of permissions asks for; the documentation shows it."""

from __future__ import annotations

import re
from pathlib import Path

from backend.station.install.service import systemd_unit
from drivers.computer import permissions

#: linux/capability.h
NUMBERS = {"CAP_NET_ADMIN": 12, "CAP_NET_RAW": 13, "CAP_IPC_LOCK": 14, "CAP_SYS_NICE": 23}


def granted(line: str) -> set[str]:
    found = re.search(rf"^{line}=(.*)$", systemd_unit(), re.MULTILINE)
    assert found is not None
    return set(found[1].split())


def test_with_the_units_capabilities_nothing_is_missing() -> None:
    held = sum(1 << NUMBERS[name] for name in granted("AmbientCapabilities"))
    report = permissions.check("lo", status=f"CapEff:\t{held:016x}\n")
    assert (report.missing, report.advised) == ((), ())


def test_without_any_one_of_them_the_check_names_it() -> None:
    names = granted("AmbientCapabilities")
    for name in names:
        held = sum(1 << NUMBERS[other] for other in names - {name})
        report = permissions.check("lo", status=f"CapEff:\t{held:016x}\n")
        assert {*report.missing, *report.advised} == {name}


def test_no_capability_beyond_them_can_be_had() -> None:
    assert granted("CapabilityBoundingSet") == granted("AmbientCapabilities") == set(NUMBERS)


def test_the_documentation_shows_the_unit_that_is_printed() -> None:
    text = (Path(__file__).resolve().parents[3] / "docs" / "station.md").read_text("utf-8")
    assert f"```ini\n{systemd_unit()}```" in text
