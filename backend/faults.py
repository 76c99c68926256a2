"""Which faults of the profile are present, told by bits and by the error code."""

from __future__ import annotations

from collections.abc import Mapping

from backend.drive import Drive, Reading
from profiles.schema import Fault


def fault_keys(drive: Drive) -> list[str]:
    """Parameters that tell of faults, where a connected port carries them."""
    keys = {match.key for fault in drive.profile.faults for match in fault.match}
    reachable = {key for key in keys if not drive.unreachable_why(drive.parameter(key))}
    if (code := drive.key("error_code")) is not None:
        reachable.add(code)
    kind = drive.profile.quirk("warning_bit_7")
    if kind is not None and kind.key is not None:
        reachable.add(kind.key)
    return sorted(reachable)


def active_faults(drive: Drive, readings: Mapping[str, Reading]) -> list[Fault]:
    """Faults and warnings in these readings; an unknown code makes a record of its own."""
    code = integer(readings.get(drive.key("error_code") or "")) or 0
    masked = code & 0xFF if drive.profile.quirk("error_code_low_byte") else code
    found: list[Fault] = []
    for fault in drive.profile.faults:
        by_bit = any(
            (raw := integer(readings.get(match.key))) is not None and raw >> match.bit & 1
            for match in fault.match
        )
        if by_bit or (code and fault.code_raw is not None and fault.code_raw in (code, masked)):
            found.append(fault)
    found = _of_the_present_kind(drive, readings, found)
    if code and not found:
        found.append(
            Fault(
                code=f"0x{code:04X}",
                name="not in the profile",
                remedies=("look the code up in the manual of this firmware",),
                source="drive",
            )
        )
    return found


def _of_the_present_kind(
    drive: Drive, readings: Mapping[str, Reading], found: list[Fault]
) -> list[Fault]:
    """Where fault and alarm share a number, the one that bit 7 of the status word means."""
    quirk = drive.profile.quirk("warning_bit_7")
    status = integer(readings.get(quirk.key or "")) if quirk is not None else None
    if status is None:
        return found
    kind = "warning" if status >> 7 & 1 else "fault"
    return [fault for fault in found if fault.kind == kind] or found


def integer(reading: Reading | None) -> int | None:
    """Raw value of an integer reading, or None."""
    return reading.raw if reading is not None and isinstance(reading.raw, int) else None
