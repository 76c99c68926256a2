"""Possible causes of a refused enable that the status word does not show.

They are hints from what the drive reports at this moment, and are read only after a change of
state was refused, when a person looks for the reason.
"""

from __future__ import annotations

import contextlib

from backend.axes.drive.drive import Drive
from backend.axes.drive.faults import integer
from backend.axes.drive.terminals import read_terminals
from drivers.errors import DriveError
from drivers.texts.message import Text, profile_text, text

#: Words in the names of input functions that stop an axis (tables of DI functions in the manuals).
_STOPPING = ("emergency stop", "external fault", "signal stop")
_POSITIVE_LIMIT, _NEGATIVE_LIMIT = 1, 0


async def hints(drive: Drive) -> list[Text]:
    """Inputs that stop the axis, limit switches that are on, and a mode that is not set.

    Values that cannot be read are left out, as the hints only explain another error.
    """
    found: list[Text] = []
    for source in (_terminals, _limits, _mode):
        with contextlib.suppress(DriveError):
            found += await source(drive)
    return found


async def _terminals(drive: Drive) -> list[Text]:
    """Active inputs whose function stops the axis."""
    return [
        text(
            "axis.cause-input",
            terminal=state.terminal.name,
            function=profile_text(drive.profile.drive, state.function_name),
        )
        for state in await read_terminals(drive)
        if state.terminal.direction == "in"
        and state.on
        and any(words in state.function_name for words in _STOPPING)
    ]


async def _limits(drive: Drive) -> list[Text]:
    """Limit switches that are on (60FDh, CiA 402-2; some families have the bits swapped)."""
    key = drive.key("digital_inputs")
    if key is None:
        return []
    raw = integer(await drive.read(key))
    if raw is None or key != "60FD:00":
        return []
    positive, negative = _POSITIVE_LIMIT, _NEGATIVE_LIMIT
    if drive.profile.quirk("limit_bits_swapped") is not None:
        positive, negative = negative, positive
    codes = (("axis.cause-limit-positive", positive), ("axis.cause-limit-negative", negative))
    return [text(code) for code, bit in codes if raw >> bit & 1]


async def _mode(drive: Drive) -> list[Text]:
    """Missing mode of a family that must have a mode before it is enabled (001:488)."""
    display = drive.key("mode_display")
    if drive.profile.quirk("mode_before_enable") is None or display is None:
        return []
    return [] if await drive.raw(display) else [text("axis.cause-no-mode")]
