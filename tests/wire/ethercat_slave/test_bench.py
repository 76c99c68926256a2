"""Which drives a segment has, and namespaces that a system forbids."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from drivers.errors import NotAllowed
from drivers.virtual.wires import netns
from drivers.virtual.wires.ethercat.bench import axes_by_name, axes_of_bench

BENCH = """
[[axis]]
name = "Y"
drive = "mms7"
on = "ethercat://virtual0"
station = {second}
[[axis]]
name = "X"
drive = "m6l"
on = "ethercat://virtual0"
station = 1
[[axis]]
name = "serial"
drive = "mms7"
on = "mlink://virtual0"
"""


def bench(folder: Path, text: str) -> Path:
    path = folder / "bench.toml"
    path.write_text(text, "utf-8")
    return path


def test_drives_hang_on_the_cable_in_the_order_of_their_stations(tmp_path: Path) -> None:
    axes = axes_of_bench(bench(tmp_path, BENCH.format(second=2)), None)
    assert [(axis.name, axis.drive) for axis in axes] == [("X", "m6l"), ("Y", "mms7")]


def test_a_bus_is_chosen_by_its_url(tmp_path: Path) -> None:
    more = '[[axis]]\nname = "Z"\ndrive = "r6l"\non = "ethercat://virtual1"\n'
    path = bench(tmp_path, BENCH.format(second=2) + more)
    assert [a.name for a in axes_of_bench(path, "ethercat://virtual1")] == ["Z"]
    with pytest.raises(NotAllowed, match="2 EtherCAT buses"):
        axes_of_bench(path, None)
    with pytest.raises(NotAllowed, match="no drive on ethercat://virtual7"):
        axes_of_bench(path, "ethercat://virtual7")


def test_a_gap_in_the_cable_is_refused(tmp_path: Path) -> None:
    with pytest.raises(NotAllowed, match=r"must be 1…2, not 1, 3"):
        axes_of_bench(bench(tmp_path, BENCH.format(second=3)), None)


def test_drives_by_name_count_on() -> None:
    assert [axis.station for axis in axes_by_name(["mms7", "mms7"], 3)] == [3, 4]


def test_a_system_that_forbids_namespaces_says_so_in_a_sentence(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    refusal = "print('the system forbids user namespaces (Operation not permitted)')"
    monkeypatch.setattr(netns, "_python", lambda: [sys.executable, "-c", refusal])
    reason = netns.unavailable()
    assert reason is not None
    assert "forbids user namespaces (Operation not permitted)" in reason
    assert "kernel.unprivileged_userns_clone=1" in reason
    assert "run as root" in reason


@pytest.mark.parametrize("name", ["", "sixteen-letters!"])
def test_interface_names_have_1_to_15_bytes(name: str) -> None:
    with pytest.raises(ValueError, match="1 to 15 bytes"):
        netns.Namespace.create([("ok0", name)])


def test_entering_the_namespace_of_a_process_that_is_gone() -> None:
    with pytest.raises(netns.NamespaceUnavailable, match=r"/proc/\d+/ns/user: No such file"):
        netns.enter(2**22 + 1)
