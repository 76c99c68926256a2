"""Active faults of a drive, from fault bits and from the error code."""

from __future__ import annotations

from collections.abc import Mapping

from backend.axes.drive.drive import Drive
from backend.axes.drive.readings import Reading
from drivers.texts.profile_words import FAULT_BY_RECORD, FAULT_LOOK_UP, FAULT_UNKNOWN
from profiles.schema import Fault


def fault_keys(drive: Drive) -> list[str]:
    """Parameters that report faults, where a connected port carries them."""
    keys = {match.key for fault in drive.profile.faults for match in fault.match}
    reachable = {key for key in keys if not drive.unreachable_why(drive.parameter(key))}
    if (code := drive.key("error_code")) is not None:
        reachable.add(code)
    kind = drive.profile.quirk("warning_bit_7")
    if kind is not None and kind.key is not None:
        reachable.add(kind.key)
    history = drive.profile.functions.history
    if history is not None and history.kind == "selected":
        # The newest record identifies the fault where 603Fh does not (R6L, 002:12361).
        for key in (history.select_key, history.code_key, drive.key("status_word")):
            if key is not None and not drive.unreachable_why(drive.parameter(key)):
                reachable.add(key)
    return sorted(reachable)


async def read_active_faults(drive: Drive) -> list[Fault]:
    """Faults and warnings that the drive reports, read now.

    Raises:
        DriveError: the drive does not answer, so its faults are not known.
    """
    readings = await drive.read_many(fault_keys(drive))
    if all(reading.raw is None for reading in readings.values()):
        # No object was read: the drive lacks them all, or does not answer at all.
        await drive.read(drive.require("status_word"))
    return active_faults(drive, readings)


def active_faults(drive: Drive, readings: Mapping[str, Reading]) -> list[Fault]:
    """Faults and warnings in these readings; an unknown code becomes a record of its own."""
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
    if not found and (newest := _newest_record(drive, readings)) is not None:
        found.append(newest)
    if code and not found:
        found.append(
            Fault(
                code=f"0x{code:04X}",
                name=str(FAULT_UNKNOWN),
                remedies=(str(FAULT_LOOK_UP),),
                source="drive",
            )
        )
    return found


def _of_the_present_kind(
    drive: Drive, readings: Mapping[str, Reading], found: list[Fault]
) -> list[Fault]:
    """Of a fault and a warning with the same number, the one that status word bit 7 indicates."""
    quirk = drive.profile.quirk("warning_bit_7")
    status = integer(readings.get(quirk.key or "")) if quirk is not None else None
    if status is None:
        return found
    kind = "warning" if status >> 7 & 1 else "fault"
    return [fault for fault in found if fault.kind == kind] or found


def _newest_record(drive: Drive, readings: Mapping[str, Reading]) -> Fault | None:
    """Fault of the newest record of a drive in Fault, where the selector is on that record."""
    history = drive.profile.functions.history
    if history is None or history.kind != "selected" or not history.code_format:
        return None
    status = integer(readings.get(drive.key("status_word") or "")) or 0
    if not status & 0x08 or integer(readings.get(history.select_key or "")) != 0:
        return None
    number = integer(readings.get(history.code_key or "")) or 0
    code = history.code_format.format(number + history.code_base)
    found = next((fault for fault in drive.profile.faults if fault.code == code), None)
    if found is None:
        return None
    # The manual does not state which record is newest (002:12361), so the source is stated.
    return found.model_copy(update={"causes": (str(FAULT_BY_RECORD), *found.causes)})


def integer(reading: Reading | None) -> int | None:
    """Raw value of an integer reading, or None."""
    return None if reading is None else reading.integer
