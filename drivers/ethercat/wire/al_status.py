"""AL states and AL status codes in words (ETG.1000.6 clause 5.3, table 11; ETG.1020 clause 5)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


class AlState(IntEnum):
    """Application layer states, as in registers 0x120 and 0x130."""

    INIT = 1
    PREOP = 2
    BOOT = 3
    SAFEOP = 4
    OP = 8


ERROR_BIT = 0x10
"""In 0x130 the slave has fallen back; in 0x120 the master acknowledges that."""


@dataclass(frozen=True, slots=True)
class AlText:
    """What an AL status code means and what to do about it."""

    text: str
    remedy: str


_MAILBOX = "rescan; if it comes back, the drive's EEPROM and firmware do not belong together"
_MAPPING = "choose other signals; the drive's manual lists what it can map, and how much"
_DC = "choose another cycle time; the manual lists the cycle times that the drive supports"
_RESTART = "switch the drive off and on"
_EEPROM = "switch the drive off and on; if it comes back, the maker must rewrite its EEPROM"
_CABLE = "check cables and link quality, and that no other programme starves the cyclic exchange"

_TABLE: dict[int, tuple[str, str]] = {
    0x0000: ("no error", ""),
    0x0001: ("unspecified error", "read the drive's active faults"),
    0x0002: ("the drive is out of memory", _RESTART),
    0x0003: ("invalid device set-up", "check modules and options of the drive"),
    0x0004: ("invalid revision: process data do not fit this firmware", _MAPPING),
    0x0006: ("the EEPROM content does not match the firmware", _EEPROM),
    0x0007: ("the firmware update failed; the old firmware runs", "repeat the download"),
    0x000E: ("licence error", "ask the drive's maker"),
    0x0011: ("invalid requested state change", "go through INIT, PREOP, SAFEOP and OP in turn"),
    0x0012: ("unknown requested state", "go through INIT, PREOP, SAFEOP and OP in turn"),
    0x0013: ("the drive has no bootstrap state", "firmware cannot be loaded over EtherCAT"),
    0x0014: ("no valid firmware", "load the firmware again"),
    0x0015: ("invalid mailbox configuration in BOOT", _MAILBOX),
    0x0016: ("invalid mailbox configuration in PREOP", _MAILBOX),
    0x0017: ("invalid sync manager configuration (process data size)", _MAPPING),
    0x0018: ("no valid inputs available", "read the drive's active faults"),
    0x0019: ("no valid outputs: the drive waits for process data", _CABLE),
    0x001A: ("synchronisation error", _DC),
    0x001B: ("sync manager watchdog: process data stayed away, the drive stopped", _CABLE),
    0x001C: ("invalid sync manager types", _MAPPING),
    0x001D: ("invalid output configuration", _MAPPING),
    0x001E: ("invalid input configuration", _MAPPING),
    0x001F: ("invalid watchdog configuration", "choose a longer watchdog time"),
    0x0020: ("the drive needs a cold start", _RESTART),
    0x0021: ("the drive needs INIT first", "request INIT, then try again"),
    0x0022: ("the drive needs PREOP first", "request PREOP, then try again"),
    0x0023: ("the drive needs SAFEOP first", "request SAFEOP, then try again"),
    0x0024: ("invalid input mapping", _MAPPING),
    0x0025: ("invalid output mapping", _MAPPING),
    0x0026: ("inconsistent settings", "check the sync mode in 1C32h and 1C33h"),
    0x0027: ("free run is not supported", "use distributed clocks"),
    0x0028: ("this synchronisation mode is not supported", "use another synchronisation"),
    0x0029: ("free run needs 3-buffer mode", "use distributed clocks"),
    0x002A: ("background watchdog", _RESTART),
    0x002B: ("no valid inputs and outputs", _CABLE),
    0x002C: ("fatal synchronisation error: SYNC0 came and went", _DC),
    0x002D: ("no SYNC0 signal", "the distributed clock did not start: try again"),
    0x002E: ("the cycle time is too small", _DC),
    0x0030: ("invalid DC SYNC configuration", _DC),
    0x0031: ("invalid DC latch configuration", _DC),
    0x0032: ("the drive's PLL did not lock on SYNC0", _DC),
    0x0033: ("DC sync I/O error", _DC),
    0x0034: ("DC sync timed out: too many process data came late", _CABLE),
    0x0035: ("invalid DC sync cycle time", _DC),
    0x0036: ("invalid SYNC0 cycle time", _DC),
    0x0037: ("invalid SYNC1 cycle time", _DC),
    0x0041: ("error in AoE over the mailbox", _RESTART),
    0x0042: ("error in EoE over the mailbox", _RESTART),
    0x0043: ("error in CoE over the mailbox", _RESTART),
    0x0044: ("error in FoE over the mailbox", "repeat the file transfer"),
    0x0045: ("error in SoE over the mailbox", _RESTART),
    0x004F: ("error in VoE over the mailbox", _RESTART),
    0x0050: ("the drive cannot access its EEPROM", _EEPROM),
    0x0051: ("EEPROM error", _EEPROM),
    0x0052: ("external hardware is not ready", "check that the power stage has its supply"),
    0x0060: ("the drive restarted by itself", "read the drive's active faults"),
    0x0061: ("the device identification value was changed", _RESTART),
    0x0062: ("the detected modules differ from the configured ones", "check the modules"),
    0x0063: ("supply voltage too low", "check the drive's supply"),
    0x0064: ("supply voltage too high", "check the drive's supply"),
    0x0065: ("temperature too low", "let the drive warm up"),
    0x0066: ("temperature too high", "let the drive cool down and check its ventilation"),
    0x00F0: ("the application controller is available again", ""),
}


def al_status_text(code: int) -> AlText:
    """Words for an AL status code; 0x8000 and above are the maker's own."""
    if known := _TABLE.get(code):
        return AlText(*known)
    owner = "the maker's own" if code >= 0x8000 else "an unknown"
    return AlText(f"{owner} AL status code {code:#06x}", "look the code up in the drive's manual")


def state_name(status: int) -> str:
    """``SAFEOP`` or ``SAFEOP + error`` for the low byte of register 0x130."""
    try:
        name = AlState(status & 0x0F).name
    except ValueError:
        name = "no answer" if status == 0 else f"state {status & 0x0F}"
    return f"{name} + error" if status & ERROR_BIT else name
