"""Name and roles of a station's network ports: what may be chosen, and what they forbid."""

from __future__ import annotations

import re
import socket
from pathlib import Path

import pytest

from backend.station.install.box.kept import Box, keep, names_of, read
from backend.station.install.box.roles import checked, require_not_office
from backend.station.install.box.shown import phone_address, scan_code
from drivers.computer.network.interfaces import Interface
from drivers.errors import DriveError, NotAllowed

PORTS = [
    Interface("eth0", up=True, is_wired=True, is_can=False),
    Interface("eth1", up=False, is_wired=True, is_can=False),
    Interface("wlan0", up=True, is_wired=False, is_can=False),
    Interface("can0", up=True, is_wired=False, is_can=True),
]


def refused(box: Box, used: str = "") -> str:
    with pytest.raises(DriveError) as found:
        checked(box, PORTS, used)
    assert found.value.remedy
    return found.value.text.code


@pytest.mark.parametrize("name", ["a", "0", "Cabinet-3", " box ", "a" * 63])
def test_names_that_a_network_knows(name: str) -> None:
    assert checked(Box(name), PORTS, "").name == name.strip().lower()


@pytest.mark.parametrize(
    "name", ["", " ", "-a", "a-", "a.b", "a b", "ü", "a_b", "a" * 64, "localhost"]
)
def test_names_that_rfc_1123_does_not_allow(name: str) -> None:
    assert refused(Box(name)) == "station.box-name"


def test_roles_are_those_of_ports_that_can_have_them() -> None:
    both = Box("box", "eth1", "eth0")
    assert checked(both, PORTS, "eth0") == both
    assert checked(Box("box", "eth1", "wlan0"), PORTS, "") == Box("box", "eth1", "wlan0")
    assert refused(Box("box", "wlan0", "eth0")) == "station.box-no-port"
    assert refused(Box("box", "eth0", "can0")) == "station.box-no-port"
    assert refused(Box("box", "eth7", "")) == "station.box-no-port"
    assert refused(Box("box", "eth0", "eth0")) == "station.box-one-port-for-both"
    assert refused(Box("box", "eth0", "eth1"), "eth0") == "station.box-port-of-this-page"


def test_it_is_kept_and_read_again(tmp_path: Path) -> None:
    assert read(tmp_path) is None
    assert names_of(None) == frozenset()
    made = Box("cabinet-3", "eth1", "eth0")
    keep(tmp_path, made)
    assert read(tmp_path) == made
    assert names_of(made) == {"cabinet-3", "cabinet-3.local"}


def test_no_ethercat_on_the_offices_port(tmp_path: Path) -> None:
    require_not_office(tmp_path, "ethercat://eth0")
    keep(tmp_path, Box("box", "eth1", "eth0"))
    require_not_office(tmp_path, "ethercat://eth1")
    require_not_office(tmp_path, "canopen://socketcan/eth0")
    for url in ("ethercat://eth0", " ethercat://eth0 ", "ethercat://eth0?cycle_us=1000"):
        with pytest.raises(DriveError) as found:
            require_not_office(tmp_path, url)
        assert found.value.text.code == "station.box-office-port"
        assert str(found.value.limit) == "eth1"


def test_another_name_of_the_offices_port_is_the_offices_port(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """ip-link(8): a port may have alternative names."""
    numbers = {"eth0": 2, "enp1s0": 2, "eth1": 3}
    monkeypatch.setattr(socket, "if_nametoindex", numbers.__getitem__)
    keep(tmp_path, Box("box", "eth1", "eth0"))
    require_not_office(tmp_path, "ethercat://eth1")
    with pytest.raises(NotAllowed):
        require_not_office(tmp_path, "ethercat://enp1s0")


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"name": 1, "ethercat": "", "office": ""}'])
def test_where_the_roles_cannot_be_read_no_port_is_opened(tmp_path: Path, content: str) -> None:
    (tmp_path / "box.json").write_text(content)
    with pytest.raises(NotAllowed) as found:
        require_not_office(tmp_path, "ethercat://eth1")
    assert found.value.text.code == "station.box-file-damaged"
    require_not_office(tmp_path, "mlink:///dev/ttyUSB0")
    keep(tmp_path, Box("box"))
    require_not_office(tmp_path, "ethercat://eth1")


def test_the_address_for_a_phone_is_one_that_it_can_reach() -> None:
    assert phone_address("192.0.2.7", 8420) == "https://192.0.2.7:8420/"
    assert phone_address("2001:db8::7", 8420) == "https://[2001:db8::7]:8420/"
    assert re.fullmatch(r"https://[^/:]+:8420/", phone_address("0.0.0.0", 8420))


def test_the_code_on_the_console_is_a_square_with_its_quiet_zone() -> None:
    """ISO/IEC 18004: 29 bytes at level M take version 3, 29 modules, and 4 light ones around."""
    lines = scan_code("https://192.168.100.200:8420/")[:-1].split("\n")
    plain = [re.sub(r"\x1b\[[0-9;]*m", "", line) for line in lines]
    assert {len(line) for line in plain} == {29 + 2 * 4}
    assert len(plain) == (29 + 2 * 4 + 1) // 2
