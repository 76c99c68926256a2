"""AL states and AL status codes as text (ETG.1000.6 clause 5.3, table 11; ETG.1020 clause 5)."""

from __future__ import annotations

from enum import IntEnum

from drivers.texts.message import Text, text


class AlState(IntEnum):
    """Application layer states, as in registers 0x120 and 0x130."""

    INIT = 1
    PREOP = 2
    BOOT = 3
    SAFEOP = 4
    OP = 8


ERROR_BIT = 0x10
"""In 0x130 the slave has fallen back to a lower state; in 0x120 the master acknowledges that."""


#: Codes listed in ETG.1020, each with a text in the catalogue.
_KNOWN = frozenset(
    {
        0x0000,
        0x0001,
        0x0002,
        0x0003,
        0x0004,
        0x0006,
        0x0007,
        0x000E,
        0x0011,
        0x0012,
        0x0013,
        0x0014,
        0x0015,
        0x0016,
        0x0017,
        0x0018,
        0x0019,
        0x001A,
        0x001B,
        0x001C,
        0x001D,
        0x001E,
        0x001F,
        0x0020,
        0x0021,
        0x0022,
        0x0023,
        0x0024,
        0x0025,
        0x0026,
        0x0027,
        0x0028,
        0x0029,
        0x002A,
        0x002B,
        0x002C,
        0x002D,
        0x002E,
        0x0030,
        0x0031,
        0x0032,
        0x0033,
        0x0034,
        0x0035,
        0x0036,
        0x0037,
        0x0041,
        0x0042,
        0x0043,
        0x0044,
        0x0045,
        0x004F,
        0x0050,
        0x0051,
        0x0052,
        0x0060,
        0x0061,
        0x0062,
        0x0063,
        0x0064,
        0x0065,
        0x0066,
        0x00F0,
    }
)


def al_status_text(code: int) -> Text:
    """Return the message of an AL status code; 0x8000 and above are manufacturer-specific."""
    if code in _KNOWN:
        return text(f"al-status.x{code:04x}")
    return text("al-status.of-the-maker" if code >= 0x8000 else "al-status.unknown", number=code)


def state_name(status: int) -> str:
    """Return ``SAFEOP`` or ``SAFEOP + error`` for the low byte of register 0x130."""
    try:
        name = AlState(status & 0x0F).name
    except ValueError:
        name = "no answer" if status == 0 else f"state {status & 0x0F}"
    return f"{name} + error" if status & ERROR_BIT else name
