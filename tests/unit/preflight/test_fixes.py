"""Fixes change settings and restore them; what was there is on the disk before."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from backend.foundation.preflight.findings import Code, Fix, findings
from backend.foundation.preflight.fixes import RESTORE_LIST, Fixes
from drivers.computer.timing.host_settings import HostSettings, Setting, command
from drivers.errors import NotAllowed
from tests.support.computer import FakeComputer
from tests.unit.preflight.test_findings import balanced, deep_idle

GOVERNORS = [f"sys/devices/system/cpu/cpu{core}/cpufreq/scaling_governor" for core in (0, 1)]


def fixes(fake: FakeComputer) -> Fixes:
    return Fixes(fake.root / "state", HostSettings(fake.computer, fake.write_card))


def trouble(fake: FakeComputer) -> None:
    for file in GOVERNORS:
        fake.write(file, "powersave")
    fake.card.update({"rx-usecs": 50, "tx-usecs": 12, "gro": 1})
    deep_idle(fake)
    balanced(fake)


@pytest.mark.parametrize("fix", list(Fix))
def test_each_fix_mends_its_finding_and_is_undone(tmp_path: Path, fix: Fix) -> None:
    fake = FakeComputer(tmp_path)
    trouble(fake)
    before = {one.code for one in findings(fake.computer.facts("eth1")) if one.fix is fix}
    assert before
    changes = fixes(fake).apply(fix, "eth1")
    assert changes
    assert not before & {one.code for one in findings(fake.computer.facts("eth1"))}
    undone = fixes(fake).undo()  # another process, as after a crash
    assert len(undone.restored) == len(changes)
    assert before <= {one.code for one in findings(fake.computer.facts("eth1"))}
    assert fixes(fake).pending() == []


def test_what_somebody_changed_since_is_left(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path)
    trouble(fake)
    fixes(fake).apply(Fix.GOVERNOR, "eth1")
    fake.write(GOVERNORS[0], "schedutil")
    undone = fixes(fake).undo()
    assert [str(one.setting) for one in undone.left] == [f"/{GOVERNORS[0]}"]
    assert [fake.read(file) for file in GOVERNORS] == ["schedutil", "powersave"]


def test_the_restore_list_is_on_the_disk_before_anything_changes(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path)
    trouble(fake)

    def stopped(_interface: str, _name: str, _value: int) -> None:
        kept = json.loads((tmp_path / "state" / RESTORE_LIST).read_text())
        assert [(one["place"], one["before"]) for one in kept] == [
            ("rx-usecs", "50"),
            ("tx-usecs", "12"),
        ]
        raise KeyboardInterrupt  # the process ends here

    with pytest.raises(KeyboardInterrupt):
        Fixes(tmp_path / "state", HostSettings(fake.computer, stopped)).apply(
            Fix.COALESCING, "eth1"
        )
    assert len(fixes(fake).pending()) == 2
    assert fixes(fake).undo().restored == []  # nothing had been changed yet


def test_without_permission_nothing_stays_changed_and_the_command_is_named(tmp_path: Path) -> None:
    fake = FakeComputer(tmp_path)
    trouble(fake)

    def refuse(_interface: str, name: str, value: int) -> None:
        if name == "tx-usecs":
            raise PermissionError(1, "Operation not permitted")
        fake.card[name] = value

    with pytest.raises(NotAllowed) as caught:
        Fixes(tmp_path / "state", HostSettings(fake.computer, refuse)).apply(Fix.COALESCING, "eth1")
    assert "sudo ethtool -C eth1 tx-usecs 0" in (caught.value.remedy or "")
    assert fake.card["rx-usecs"] == 50
    assert fixes(fake).pending() == []
    assert Code.COALESCING in {one.code for one in findings(fake.computer.facts("eth1"))}


@pytest.mark.parametrize(
    "place", ["etc/shadow", "proc/irq/../../etc/shadow", "sys/kernel/realtime", "/proc/irq/1"]
)
def test_a_forged_restore_list_writes_nowhere_else(tmp_path: Path, place: str) -> None:
    folder = tmp_path / "state"
    folder.mkdir()
    forged = [{"fix": "governor", "place": place, "card": "", "before": "x", "after": ""}]
    (folder / RESTORE_LIST).write_text(json.dumps(forged))
    with pytest.raises(NotAllowed, match="cannot be read"):
        Fixes(folder).undo()


def test_commands_by_hand() -> None:
    assert command(Setting("gro", "eth1"), "0") == "sudo ethtool -K eth1 gro off"
    assert command(Setting(GOVERNORS[0]), "performance").endswith(f"sudo tee /{GOVERNORS[0]}")
