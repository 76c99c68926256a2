"""Npcap and bpf: what the registry and the device say, and what helps."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace

import pytest

from drivers.adapters import require_ethercat_adapter
from drivers.computer.locks import hold_file
from drivers.computer.network.packet_capture import (
    Capture,
    adapters,
    bpf_state,
    npcap_state,
)
from drivers.computer.registry import RegistryValue
from drivers.errors import OutOfRange

SERVICE = r"SYSTEM\CurrentControlSet\Services\npcap"
UNINSTALL = r"SOFTWARE\WOW6432Node\Microsoft\Windows\CurrentVersion\Uninstall\NpcapInst"
INSTALLED = {
    (SERVICE, "ImagePath"): r"\SystemRoot\system32\DRIVERS\npcap.sys",
    (UNINSTALL, "DisplayVersion"): "1.79",
    (rf"{SERVICE}\Parameters", "AdminOnly"): 0,
}
GUID = "{4D36E972-E325-11CE-BFC1-08002BE10318}"


def registry(values: Mapping[tuple[str, str], str | int]) -> RegistryValue:
    return lambda key, name: values.get((key, name))


@pytest.mark.parametrize(
    ("changes", "administrator", "wanted"),
    [
        ({}, False, Capture.READY),
        ({(UNINSTALL, "DisplayVersion"): "0.9997"}, False, Capture.NPCAP_TOO_OLD),
        ({(UNINSTALL, "DisplayVersion"): "1.10"}, False, Capture.READY),
        ({(rf"{SERVICE}\Parameters", "AdminOnly"): 1}, False, Capture.NPCAP_ADMINISTRATORS),
        ({(rf"{SERVICE}\Parameters", "AdminOnly"): 1}, True, Capture.READY),
    ],
)
def test_npcap_as_the_registry_has_it(
    changes: dict[tuple[str, str], str | int], administrator: bool, wanted: Capture
) -> None:
    state = npcap_state(registry(INSTALLED | changes), administrator=administrator)
    assert state.capture is wanted
    assert state.ready is (wanted is Capture.READY)


def test_without_npcap_the_way_to_it_is_named() -> None:
    state = npcap_state(registry({}), administrator=True)
    assert state.capture is Capture.NPCAP_MISSING
    assert "npcap.com" in state.remedy.words()
    assert "not part of servodeck" in state.remedy.words()


def test_a_version_that_is_not_stated_is_not_judged() -> None:
    values = {key: value for key, value in INSTALLED.items() if key[1] != "DisplayVersion"}
    assert npcap_state(registry(values), administrator=False).ready


def test_a_packet_filter_that_cannot_be_opened_is_explained(tmp_path: Path) -> None:
    denied = bpf_state(tmp_path / "bpf0")
    assert denied.capture is Capture.BPF_DENIED
    assert "access_bpf" in denied.remedy.words()
    allowed = tmp_path / "bpf1"
    allowed.touch()
    assert bpf_state(allowed).ready


def test_adapters_have_the_name_that_a_person_knows() -> None:
    found = [
        SimpleNamespace(name=rf"\Device\NPF_{GUID}", desc="Büro-Adapter 以太网".encode()),
        SimpleNamespace(name="en0", desc=b""),
    ]
    windows, mac = adapters(found)
    assert (windows.name, windows.title) == (f"NPF_{GUID}", "Büro-Adapter 以太网")
    assert windows.device == rf"\Device\NPF_{GUID}"
    assert (mac.name, mac.device, mac.title) == ("en0", "en0", "en0")
    for one in (windows, mac):
        require_ethercat_adapter(one.name)


@pytest.mark.parametrize(
    "place",
    [
        rf"\Device\NPF_{GUID}", "NPF_{}", f"NPF_{GUID}/../x", f"rpcap://host/NPF_{GUID}",
        rf"\\host\pipe\NPF_{GUID}", f"NPF_{GUID}\n", "NPF_Loopback\0",
    ],
)  # fmt: skip
def test_no_other_form_is_an_adapter(place: str) -> None:
    with pytest.raises(OutOfRange):
        require_ethercat_adapter(place)


def test_a_name_is_held_by_one_process_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    name = rf"servodeck-ethercat-NPF_{GUID}"
    with hold_file(name), hold_file("another"), pytest.raises(BlockingIOError):
        hold_file(name)
    hold_file(name).close()
