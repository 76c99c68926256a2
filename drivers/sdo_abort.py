"""SDO abort codes in words, shared by CANopen and CANopen over EtherCAT.

Source: CiA 301 v4.2.0 clause 7.2.4.3.17 table 22; codes 06010003h to 06010006h are from
ETG.1000.6 table 41.
"""

from __future__ import annotations

from dataclasses import dataclass

from drivers.errors import Rejected

_READ_ONLY_HINT = "it is only for reading; change the parameter that it follows from"
_MODEL_HINT = "this model or firmware may not have it: compare with the drive's own dictionary"
_STATE_HINT = "take the drive out of operation (disable it) and try again"
_RETRY_HINT = "try again; if it comes back, check the wiring and the termination"


@dataclass(frozen=True, slots=True)
class AbortText:
    """What an abort code means and what to do about it."""

    text: str
    remedy: str


_TABLE: dict[int, AbortText] = {
    0x05030000: AbortText("the toggle bit did not alternate", _RETRY_HINT),
    0x05040000: AbortText("the drive's SDO protocol timed out", _RETRY_HINT),
    0x05040001: AbortText(
        "the drive does not know this SDO command", "it may not offer block transfer"
    ),
    0x05040002: AbortText("invalid block size", _RETRY_HINT),
    0x05040003: AbortText("invalid sequence number in a block transfer", _RETRY_HINT),
    0x05040004: AbortText("the checksum of a block transfer is wrong", _RETRY_HINT),
    0x05040005: AbortText("the drive is out of memory", "restart the drive"),
    0x06010000: AbortText("unsupported access to an object", _MODEL_HINT),
    0x06010001: AbortText("the object can only be written", "it has no value to read"),
    0x06010002: AbortText("the object can only be read", _READ_ONLY_HINT),
    0x06010003: AbortText(
        "the subindex cannot be written while subindex 0 is not 0",
        "set subindex 0 to 0 first, then write the entries, then the count",
    ),
    0x06010004: AbortText(
        "the object cannot be accessed as a whole", "read and write its subindices one by one"
    ),
    0x06010005: AbortText("the object is longer than the drive's mailbox", _MODEL_HINT),
    0x06010006: AbortText(
        "the object is in the cyclic data, so it cannot be written",
        "stop the cyclic exchange or take the object out of the process data",
    ),
    0x06020000: AbortText("the drive has no such object", _MODEL_HINT),
    0x06040041: AbortText("the object cannot be mapped to process data", "poll it instead"),
    0x06040042: AbortText(
        "the mapped objects are longer than the process data may be", "map fewer signals"
    ),
    0x06040043: AbortText(
        "the parameter does not fit the other parameters", "check what it depends on"
    ),
    0x06040047: AbortText("internal incompatibility in the drive", "restart the drive"),
    0x06060000: AbortText(
        "a hardware error in the drive prevented it", "read the drive's active faults"
    ),
    0x06070010: AbortText("the length does not fit the object's type", _MODEL_HINT),
    0x06070012: AbortText("the value is longer than the object", _MODEL_HINT),
    0x06070013: AbortText("the value is shorter than the object", _MODEL_HINT),
    0x06090011: AbortText("the object has no such subindex", _MODEL_HINT),
    0x06090030: AbortText(
        "the drive does not accept this value", "choose one of the values in the help text"
    ),
    0x06090031: AbortText("the value is too high for the drive", "choose a lower value"),
    0x06090032: AbortText("the value is too low for the drive", "choose a higher value"),
    0x06090036: AbortText(
        "the maximum would be below the minimum", "change the other limit of the pair first"
    ),
    0x060A0023: AbortText("the drive has no free SDO connection", "close other masters"),
    0x08000000: AbortText("the drive reports a general error", "read its active faults"),
    0x08000020: AbortText(
        "the drive could not take over or store the value",
        "check that it is not write-protected and not busy, then try again",
    ),
    0x08000021: AbortText(
        "the drive is under local control", "leave its own panel or programme and try again"
    ),
    0x08000022: AbortText("the drive's present state does not allow it", _STATE_HINT),
    0x08000023: AbortText("the drive has no object dictionary", "restart the drive"),
    0x08000024: AbortText("the drive has no data there", "nothing has been recorded yet"),
}


def abort_text(code: int) -> AbortText:
    """Words for ``code``; unknown codes say so and keep their number (maker-specific)."""
    return _TABLE.get(
        code,
        AbortText(
            f"the drive aborted with code {code:#010x}, which CiA 301 does not list",
            "look the code up in the drive's manual",
        ),
    )


def rejected(
    code: int, *, drive: str | None = None, parameter: str | None = None, writing: bool = False
) -> Rejected:
    """The error for an abort from the drive, in words, with the code kept in the message."""
    known = abort_text(code)
    action = "refused the write" if writing else "refused the read"
    where = f" of {parameter}" if parameter else ""
    number = "" if code not in _TABLE else f" (abort {code:08X}h)"
    return Rejected(
        "link.drive",
        code=code,
        drive=drive,
        parameter=parameter,
        remedy=known.remedy_text,
        action=action,
        where=where,
        text=known.text,
        number=number,
    )
