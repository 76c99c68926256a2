"""Drives that nobody has listed: profiles from a maker's EDS and ESI file, for virtual drives too.

Each has objects of the maker's own, of which no file says what writing them does.
"""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import pytest

from profiles import load_profile
from profiles.importer import export_eds, import_file, write_profile

EDS_DRIVE, ESI_DRIVE = "maker_eds", "maker_esi"
#: Maker's own objects of both files.
OWN_KEYS = ("2000:00", "2F00:00")

_OBJECTS = (
    (0x1010, "Store", "UDINT", 32, "rw"), (0x6007, "Abort connection", "INT", 16, "rw"),
    (0x603F, "Error code", "UINT", 16, "ro"),
    (0x6040, "Controlword", "UINT", 16, "rw"), (0x6041, "Statusword", "UINT", 16, "ro"),
    (0x605A, "Quick stop option code", "INT", 16, "rw"),
    (0x6060, "Modes of operation", "SINT", 8, "rw"), (0x6061, "Mode display", "SINT", 8, "ro"),
    (0x6064, "Position actual value", "DINT", 32, "ro"),
    (0x6065, "Following error window", "UDINT", 32, "rw"),
    (0x606C, "Velocity actual value", "DINT", 32, "ro"),
    (0x6071, "Target torque", "INT", 16, "rw"), (0x6072, "Max torque", "UINT", 16, "rw"),
    (0x6077, "Torque actual value", "INT", 16, "ro"),
    (0x607A, "Target position", "DINT", 32, "rw"), (0x607E, "Polarity", "USINT", 8, "rw"),
    (0x607F, "Max profile velocity", "UDINT", 32, "rw"),
    (0x6081, "Profile velocity", "UDINT", 32, "rw"),
    (0x6083, "Profile acceleration", "UDINT", 32, "rw"),
    (0x6084, "Profile deceleration", "UDINT", 32, "rw"),
    (0x6085, "Quick stop deceleration", "UDINT", 32, "rw"),
    (0x6098, "Homing method", "SINT", 8, "rw"), (0x609A, "Homing acceleration", "UDINT", 32, "rw"),
    (0x60B8, "Touch probe function", "UINT", 16, "rw"),
    (0x60FF, "Target velocity", "DINT", 32, "rw"),
    (0x2000, "Maker's own", "UINT", 16, "rw"), (0x2F00, "Another", "UINT", 16, "rw"),
)  # fmt: skip


def makers_eds() -> bytes:
    """An EDS file of a CiA 402 drive."""
    text = export_eds(load_profile("generic402"), datetime(2020, 1, 2), "maker.eds")
    text = text.replace("VendorName=any", "VendorName=Maker").replace("=CiA 402 drive", "=M-400")
    for key in OWN_KEYS:
        text += (
            f"[{key[:4]}]\r\nParameterName=Maker's own {key[:4]}\r\nObjectType=7\r\n"
            "DataType=0x0006\r\nAccessType=rw\r\nPDOMapping=0\r\n\r\n"
        )
    return text.encode("latin-1", "replace")


def makers_esi() -> bytes:
    """An ESI file of a CiA 402 drive, speeds in rpm."""
    rows = "".join(
        f"<Object><Index>#x{index:04X}</Index><Name>{name}</Name><Type>{kind}</Type>"
        f"<BitSize>{bits}</BitSize><Flags><Access>{access}</Access></Flags></Object>"
        for index, name, kind, bits, access in _OBJECTS
    )
    rows += "".join(
        f"<Object><Index>#x{index:04X}</Index><Name>Unit</Name><Type>UDINT</Type>"
        f"<BitSize>32</BitSize><Info><DefaultData>{code.to_bytes(4, 'little').hex()}"
        "</DefaultData></Info><Flags><Access>rw</Access></Flags></Object>"
        for index, code in ((0x60A9, 0x00B44700), (0x60AA, 0x00B44700))
    )
    return (
        "<EtherCATInfo><Vendor><Id>1</Id><Name>Maker</Name></Vendor><Descriptions><Devices>"
        '<Device><Type ProductCode="#x1" RevisionNo="#x1">Drive</Type><Name>Drive</Name>'
        f"<Profile><Dictionary><Objects>{rows}</Objects></Dictionary></Profile></Device>"
        "</Devices></Descriptions></EtherCATInfo>"
    ).encode()


def import_both(folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Import both files into a profile folder of this test's own."""
    patch.setenv("SERVODECK_PROFILES", str(folder))
    patch.setenv("SERVODECK_CACHE", str(folder / "cache"))
    for data, file, name in (
        (makers_eds(), "maker.eds", EDS_DRIVE),
        (makers_esi(), "maker.xml", ESI_DRIVE),
    ):
        write_profile(import_file(data, file, drive=name).profile, folder)
