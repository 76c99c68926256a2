"""SDO abort codes as text, shared by CANopen and CANopen over EtherCAT.

Source: CiA 301 v4.2.0 clause 7.2.4.3.17 table 22; codes 06010003h to 06010006h are from
ETG.1000.6 table 41.
"""

from __future__ import annotations

from drivers.errors import Rejected
from drivers.texts.message import Text, text

_KNOWN = frozenset(
    {
        0x05030000,
        0x05040000,
        0x05040001,
        0x05040002,
        0x05040003,
        0x05040004,
        0x05040005,
        0x06010000,
        0x06010001,
        0x06010002,
        0x06010003,
        0x06010004,
        0x06010005,
        0x06010006,
        0x06020000,
        0x06040041,
        0x06040042,
        0x06040043,
        0x06040047,
        0x06060000,
        0x06070010,
        0x06070012,
        0x06070013,
        0x06090011,
        0x06090030,
        0x06090031,
        0x06090032,
        0x06090036,
        0x060A0023,
        0x08000000,
        0x08000020,
        0x08000021,
        0x08000022,
        0x08000023,
        0x08000024,
    }
)


def abort_text(code: int) -> Text:
    """Return the message for ``code``; an unknown (manufacturer-specific) code keeps its number."""
    if code in _KNOWN:
        return text(f"sdo-abort.x{code:08x}")
    return text("sdo-abort.unknown", number=code)


def rejected(
    code: int, *, drive: str | None = None, parameter: str | None = None, writing: bool = False
) -> Rejected:
    """Create the error for an abort by the drive; its message contains the code."""
    known = abort_text(code)
    action = "write-refused" if writing else "read-refused"
    listed = "" if code in _KNOWN else "unknown-"
    of = "-of" if parameter else ""
    return Rejected(
        Text(
            f"sdo-abort.{listed}{action}{of}",
            {"parameter": parameter, "abort_code": code, "cause": known},
        ),
        abort_code=code,
        drive=drive,
        parameter=parameter,
        remedy=known.remedy(),
    )
