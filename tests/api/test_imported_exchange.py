"""Fixed process data with padding, known from the maker's file alone, are exchanged as they are."""

from __future__ import annotations

from pathlib import Path

import pytest

from profiles.importer import import_file, write_profile
from tests.support.machine import within
from tests.support.station import Station

URL = "ethercat://virtual0"
BENCH = f"""
[[axis]]
name = "P"
drive = "padded"
on = "{URL}"
station = 1
[axis.mechanics.motor]
inertia_kgm2 = 5e-5
rated_torque_nm = 1.27
rated_speed_rpm = 3000
"""
OBJECTS = (
    (0x6040, "UINT", 16, "rw", "R"),
    (0x6041, "UINT", 16, "ro", "T"),
    (0x6060, "SINT", 8, "rw", "R"),
    (0x6061, "SINT", 8, "ro", "T"),
    (0x6064, "DINT", 32, "ro", "T"),
    (0x606C, "DINT", 32, "ro", "T"),
    (0x607A, "DINT", 32, "rw", "R"),
    (0x60FF, "DINT", 32, "rw", "R"),
)
PADDING = "<Entry><Index>#x0</Index><BitLen>8</BitLen></Entry>"


def entry(index: int) -> str:
    kind, bits = next((o[1], o[2]) for o in OBJECTS if o[0] == index)
    return (
        f"<Entry><Index>#x{index:04X}</Index><SubIndex>0</SubIndex><BitLen>{bits}</BitLen>"
        f"<Name>e</Name><DataType>{kind}</DataType></Entry>"
    )


def makers_file() -> bytes:
    rows = "".join(
        f"<Object><Index>#x{index:04X}</Index><Name>Object</Name><Type>{kind}</Type>"
        f"<BitSize>{bits}</BitSize><Flags><Access>{access}</Access>"
        f"<PdoMapping>{mapping}</PdoMapping></Flags></Object>"
        for index, kind, bits, access, mapping in OBJECTS
    )
    out = f"{entry(0x6040)}{entry(0x6060)}{PADDING}{entry(0x607A)}{entry(0x60FF)}"
    back = f"{entry(0x6041)}{entry(0x6061)}{PADDING}{entry(0x6064)}{entry(0x606C)}"
    return (
        "<EtherCATInfo><Vendor><Id>1</Id><Name>Maker</Name></Vendor><Descriptions><Devices>"
        '<Device><Type ProductCode="#x1" RevisionNo="#x1">Drive</Type><Name>Drive</Name>'
        f"<Profile><Dictionary><Objects>{rows}</Objects></Dictionary></Profile>"
        f'<RxPdo Sm="2" Fixed="1"><Index>#x1600</Index><Name>Out</Name>{out}</RxPdo>'
        f'<TxPdo Sm="3" Fixed="1"><Index>#x1A00</Index><Name>In</Name>{back}</TxPdo>'
        "</Device></Devices></Descriptions></EtherCATInfo>"
    ).encode()


@pytest.mark.long
def test_padded_process_data_are_exchanged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SERVODECK_PROFILES", str(tmp_path / "mine"))
    monkeypatch.setenv("SERVODECK_CACHE", str(tmp_path / "cache"))
    write_profile(import_file(makers_file(), "d.xml", drive="padded").profile, tmp_path / "mine")
    bench = tmp_path / "bench.toml"
    bench.write_text(BENCH, "utf-8")
    station = Station(tmp_path, bench)
    station.start()
    try:
        drive = station.add(1, URL, "padded", "P")
        began = station.ok(station.http.post("/buses/cyclic", json={"url": URL, "cycle_us": 2000}))
        assert began["quality"]["details"]["cyclic_expected_wkc"] == 3

        def details() -> dict[str, float]:
            (bus,) = station.ok(station.http.get("/buses"))
            found: dict[str, float] = bus["quality"]["details"]
            return found

        within(10, lambda: details()["cyclic_cycles"] > 200, "the exchange runs")
        assert details()["cyclic_last_wkc"] == 3
        assert station.state(drive)["state"] == "Switch on disabled"
        station.http.request("DELETE", "/buses/cyclic", params={"url": URL})
    finally:
        station.stop()
