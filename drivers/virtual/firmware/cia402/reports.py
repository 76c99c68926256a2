"""How the protections of a family are reported: entries of its fault table, or standard codes."""

from __future__ import annotations

import re
from collections.abc import Mapping

from drivers.virtual.firmware.cia402.base import FaultInfo
from drivers.virtual.firmware.kernel import layout as k
from profiles.schema import Profile

#: Printed names of faults per protection, and the standard's code (CiA 402-2).
_FAULT_WORDS: tuple[tuple[int, str, int], ...] = (
    (k.F_OVER_CURRENT, r"over.?current", 0x2310),
    (k.F_UNDER_VOLTAGE, r"under.?voltage", 0x3220),
    (k.F_OVER_VOLTAGE, r"over.?voltage", 0x3210),
    (k.F_OVER_TEMPERATURE, r"over.?(heat|temperature)|temperature.*(high|too)", 0x4310),
    (k.F_LOCKED, r"lock(ed)?.?(rotor)?|rotor.?lock|stall", 0x7121),
    (k.F_OVERLOAD, r"over.?load", 0x3230),
    (k.F_SENSOR, r"encoder.*(disconnect|error|fault|communication|signal)|encoder", 0x7305),
    (k.F_MEMORY, r"eeprom|memory|parameter.*(stor|read|writ)", 0x5530),
    (k.F_OVER_SPEED, r"over.?speed", 0x8400),
    (k.F_SPEED_ERROR, r"speed.*(deviation|error)", 0x8401),
    (k.F_FOLLOWING, r"position.*(deviation|out.?of.?toler|error)|following", 0x8611),
    (
        k.F_WATCHDOG,
        r"(bus|ethercat|can|communication).*(disconnect|lost|time.?out|abnormal)",
        0x8130,
    ),
    (k.F_POSITION_LIMIT, r"(limit|over.?travel)", 0x8612),
    (k.F_POWER_STAGE, r"(ipm|power.?(stage|module))", 0x5400),
)


def faults_of(profile: Profile, protections: Mapping[int, str]) -> dict[int, FaultInfo]:
    """Return how the protections are reported: the named entries of the table.

    For a family that names none (a profile made from a file), the printed names are searched. If
    the table has no code of 603Fh (R6L), the standard's is used.
    """
    found: dict[int, FaultInfo] = {}
    for bit, words, standard in _FAULT_WORDS:
        named = protections.get(bit)
        if protections and named is None:
            continue
        match = next(
            (
                fault
                for fault in profile.faults
                if fault.kind == "fault"
                and (
                    fault.code == named
                    if named is not None
                    else fault.code_raw is not None and re.search(words, fault.name, re.IGNORECASE)
                )
            ),
            None,
        )
        code = standard if match is None or match.code_raw is None else match.code_raw
        found[bit] = FaultInfo(
            code,
            fixed=bit in (k.F_OVER_CURRENT, k.F_SENSOR, k.F_POWER_STAGE),
            fault="" if match is None else match.code,
        )
    return found
