"""STOP of a drive whose quick stop takes the power off (605Ah = 0) instead of braking."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from backend.drive import Drive
from backend.stopping.facts import StepCode
from backend.stopping.settings import OPTION, braking_option, known_settings
from drivers import cia402
from drivers.cia402 import State
from drivers.errors import DriveError

if TYPE_CHECKING:
    from backend.power import PowerState

#: A status word that was read longer ago says nothing of now.
_SEEN_S = 2.5


async def brake_then_quick_stop(power: PowerState) -> None:
    """Brake by halt, have the quick stop brake, then quick stop.

    A quick stop that would coast is sent only where nothing else brakes.

    Raises:
        DriveError: no word reaches the drive.
    """
    drive, halted = power.drive, False
    if known_settings(drive).halt_brakes and _seen_enabled(drive):
        # Over an axis that is not enabled this word would enable it.
        halt = cia402.ENABLE_OPERATION | cia402.HALT
        await drive.command(drive.require("control_word"), halt)
        power.stop_step(StepCode.HALT)
        halted = True
    brakes = await _let_quick_stop_brake(power)
    if brakes or not halted:
        await power.send_quick_stop()
        power.stop_step(StepCode.QUICK_STOP)


async def _let_quick_stop_brake(power: PowerState) -> bool:
    drive, before = power.drive, known_settings(power.drive).option
    option = braking_option(drive)
    if option is None:
        return False
    problem = ""
    try:
        await drive.command(OPTION, option)
        if await drive.raw(OPTION) != option:
            problem = "the drive keeps its value"
        elif power.option_before is None:
            power.option_before = before
    except DriveError as error:
        problem = error.message
    power.stop_step(StepCode.OPTION_SET, problem, OPTION, {"raw": float(option)})
    return not problem


def _seen_enabled(drive: Drive) -> bool:
    """The status word that was read last, a moment ago, said so."""
    reading = drive.readings.get(drive.require("status_word"))
    if reading is None or not isinstance(reading.raw, int) or reading.time is None:
        return False
    recent = time.time() - reading.time < _SEEN_S
    return recent and drive.decode_state(reading.raw) is State.OPERATION_ENABLED
