"""Fault history of a drive, with the values that the drive stored at each fault."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from backend.axes.axis.axis import Axis
from backend.axes.drive.catalog import functions_of
from backend.axes.drive.drive import Drive
from backend.axes.drive.faults import integer
from backend.axes.drive.readings import Reading
from drivers.errors import NotAllowed
from drivers.texts.message import Text, prose, text
from profiles.functions import FaultHistory, HistorySlot
from profiles.schema import Fault


@dataclass(frozen=True, slots=True)
class PastFault:
    """One record of the fault history. ``fault`` is None where the code is not in the profile.

    ``name`` identifies the record: its name in the profile, or a message with its number.
    """

    name: Text
    code: int | None
    code_text: str
    fault: Fault | None
    values: tuple[Reading, ...]
    problem: Text | None = None
    """Why the record could not be read."""


def history_of(drive: Drive) -> FaultHistory | None:
    """How this family stores past faults; None where that is not known."""
    return functions_of(drive.profile).history


async def read_history(axis: Axis) -> list[PastFault]:
    """All stored faults, newest first where the manual states the order.

    A record that is reached through a selector is selected by a write; the selector is restored.

    Raises:
        NotAllowed: the drive has no fault history that can be read.
        DriveError: the link is gone, or the selector could not be restored.
    """
    drive = axis.drive
    history = history_of(drive)
    if history is None or history.kind == "unreadable":
        raise NotAllowed(
            "axis.no-fault-history-read", drive=drive.name, profile_title=drive.profile.title
        )
    if history.kind == "slots":
        return await _slots(drive, history)
    return await _selected(axis, history)


async def _slots(drive: Drive, history: FaultHistory) -> list[PastFault]:
    keys = [key for slot in history.slots for key in (slot.code_key, *slot.fields)]
    readings = await drive.read_many(dict.fromkeys(keys))
    found = [
        _past(drive.profile.faults, history, slot, readings, _name(slot, number))
        for number, slot in enumerate(history.slots, start=1)
    ]
    return [each for each in found if each is not None]


async def _selected(axis: Axis, history: FaultHistory) -> list[PastFault]:
    drive = axis.drive
    select, code = history.select_key, history.code_key
    if select is None or code is None:
        raise ValueError(f"{drive.profile.drive}: a selected history needs select_key and code_key")
    found: list[PastFault] = []
    async with axis.restoring(select):
        for number in range(history.size):
            if (await drive.write(select, number)).raw != number:
                raise NotAllowed(
                    "axis.record-cannot-selected", drive=drive.name, parameter=select, value=number
                )
            readings = await drive.read_many((code, *history.fields))
            slot = HistorySlot(code_key=code, fields=history.fields)
            name = _name(slot, number)
            past = _past(drive.profile.faults, history, slot, readings, name)
            if past is not None:
                found.append(past)
    return found


def _name(slot: HistorySlot, number: int) -> Text:
    """Name of the record in the profile; otherwise a message with its number."""
    return prose(slot.name) if slot.name else text("axis.record", number=number)


def _past(
    faults: Sequence[Fault],
    history: FaultHistory,
    slot: HistorySlot,
    readings: dict[str, Reading],
    name: Text,
) -> PastFault | None:
    """One record, or None for an empty one."""
    reading = readings[slot.code_key]
    code = integer(reading)
    if code is None:
        problem = reading.problem or text("axis.record-not-read")
        return PastFault(name, None, "", None, (), problem)
    if code in history.empty_codes:
        return None
    fault = named_fault(faults, history, code)
    shown = fault.code if fault else _code_text(history, code)
    return PastFault(name, code, shown, fault, tuple(readings[key] for key in slot.fields))


def named_fault(faults: Sequence[Fault], history: FaultHistory, code: int) -> Fault | None:
    """The fault of the profile that a stored code stands for.

    Matched by the printed code where the history states its format, otherwise by the value of
    603Fh.
    """
    if history.code_format:
        text = _code_text(history, code)
        return next((fault for fault in faults if fault.code == text), None)
    raw = (code & 0xFFFF) + history.code_base
    return next((fault for fault in faults if fault.code_raw == raw), None)


def _code_text(history: FaultHistory, code: int) -> str:
    if history.code_format:
        return history.code_format.format(code + history.code_base)
    return f"0x{code:04X}"
