"""A virtual drive of an imported profile: it turns by what the maker's file says of its units."""

from __future__ import annotations

import struct

import pytest

from drivers.virtual.firmware import make_device
from drivers.virtual.firmware.servo import VirtualServo
from profiles.importer import import_file
from profiles.schema import PdoPart, PdoSet, PdoSpec, Profile

from .servo_bench import Bench, rigid

#: Increments of a virtual encoder where the file names no resolution.
TURN = 10_000

OBJECTS = (
    (0x6040, "Controlword", "UINT", 16, "rw"),
    (0x6041, "Statusword", "UINT", 16, "ro"),
    (0x6060, "Modes of operation", "SINT", 8, "rw"),
    (0x6061, "Mode display", "SINT", 8, "ro"),
    (0x6064, "Position actual value", "DINT", 32, "ro"),
    (0x606C, "Velocity actual value", "DINT", 32, "ro"),
    (0x607A, "Target position", "DINT", 32, "rw"),
    (0x6081, "Profile velocity", "UDINT", 32, "rw"),
    (0x6083, "Profile acceleration", "UDINT", 32, "rw"),
    (0x6084, "Profile deceleration", "UDINT", 32, "rw"),
    (0x60FF, "Target velocity", "DINT", 32, "rw"),
    (0x2000, "Maker's own", "UINT", 16, "rw"),
)


def profile(**units: int) -> Profile:
    """The import of a file with these defaults of 60A8h, 60A9h and 60AAh."""
    rows = "".join(
        f"<Object><Index>#x{index:04X}</Index><Name>{name}</Name><Type>{kind}</Type>"
        f"<BitSize>{bits}</BitSize><Flags><Access>{access}</Access></Flags></Object>"
        for index, name, kind, bits, access in OBJECTS
    ) + "".join(
        f"<Object><Index>#x{index}</Index><Name>Unit</Name><Type>UDINT</Type><BitSize>32</BitSize>"
        f"<Info><DefaultData>{struct.pack('<I', code).hex()}</DefaultData></Info>"
        "<Flags><Access>rw</Access></Flags></Object>"
        for index, code in ((name[1:], code) for name, code in units.items())
    )
    text = (
        "<EtherCATInfo><Vendor><Id>1</Id><Name>Maker</Name></Vendor><Descriptions><Devices>"
        '<Device><Type ProductCode="#x1" RevisionNo="#x1">Drive</Type><Name>Drive</Name>'
        f"<Profile><Dictionary><Objects>{rows}</Objects></Dictionary></Profile></Device>"
        "</Devices></Descriptions></EtherCATInfo>"
    )
    return import_file(text.encode(), "drive.xml", drive="someones_drive").profile


@pytest.mark.parametrize(
    ("codes", "raw"),
    [
        ({"x60A9": 0x00B44700, "x60AA": 0x00B44700}, 60),  # rpm
        ({"x60A9": 0xFFB44700, "x60AA": 0x00B44700}, 600),  # 0.1 rpm
        ({"x60A9": 0x00B50300, "x60AA": 0x00B55700}, TURN),  # inc/s
    ],
)
def test_one_revolution_a_second(codes: dict[str, int], raw: int) -> None:
    servo = make_device(profile(**codes), rigid())
    assert isinstance(servo, VirtualServo)
    drive = Bench(servo)
    for ramp in ("6083:00", "6084:00"):
        drive.set(ramp, 1000 * TURN if codes["x60A9"] == 0x00B50300 else 60_000)
    drive.enable(3)
    drive.set("60FF:00", raw)
    drive.run(0.5)
    start = drive.get("6064:00")
    drive.run(1.0)
    assert drive.get("6064:00") - start == pytest.approx(TURN, rel=0.02)
    assert drive.get("606C:00") == pytest.approx(raw, rel=0.05)


def test_a_makers_own_object_keeps_its_value() -> None:
    servo = make_device(profile(), rigid())
    assert isinstance(servo, VirtualServo)
    drive = Bench(servo)
    drive.set("2000:00", 17)
    assert drive.get("2000:00") == 17


def test_units_that_the_firmware_has_not_are_refused() -> None:
    with pytest.raises(ValueError, match=r"speeds are in '°/s'"):
        make_device(profile(x60A9=0x00410300))
    with pytest.raises(ValueError, match="60A9h = 00AC4700h"):
        make_device(profile(x60A9=0x00AC4700))


def test_single_bits_in_process_data_are_refused() -> None:
    known = profile()
    one = PdoSet(
        index=0x1A00,
        direction="tx",
        entries=("6041:00",),
        fixed=True,
        source="drive.xml",
        layout=(PdoPart(key="6041:00", bits=16), PdoPart(bits=1), PdoPart(bits=7)),
    )
    spec = PdoSpec(
        sets=(one,), default_rx=0x1600, default_tx=0x1A00, max_entries=8, source="drive.xml"
    )
    with pytest.raises(ValueError, match="1A00h holds single bits"):
        make_device(known.model_copy(update={"pdo": spec}))
