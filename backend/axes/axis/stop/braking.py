"""STOP of a drive whose quick stop would not brake.

Either it switches the power off (605Ah = 0), or the family only ramps down the torque in its torque
modes (M6-L 000:3019), so that another mode must brake.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from backend.axes.axis.stop.facts import StepCode
from backend.axes.axis.stop.settings import OPTION, braking_option, known_settings
from backend.axes.drive.drive import Drive
from drivers import cia402
from drivers.cia402 import Mode, State
from drivers.errors import DriveError, LinkLost, LinkTimeout, ProtocolError
from drivers.texts.message import Text, text

if TYPE_CHECKING:
    from backend.axes.axis.power import PowerState

#: Greatest age of a reading that counts as the present state [s].
_SEEN_S = 2.5


async def brake_then_quick_stop(power: PowerState) -> None:
    """Brake by speed control or halt, set 605Ah to an option that brakes, then send quick stop.

    A quick stop that would coast is sent only where nothing else brakes.

    Raises:
        DriveError: no control word reaches the drive.
    """
    drive, halted = power.drive, False
    if torque_coasts(drive):
        halted = await _take_speed_control(power)
        if not known_settings(drive).coasts:
            await power.send_quick_stop()
            power.stop_step(StepCode.QUICK_STOP)
            return
    elif known_settings(drive).halt_brakes and _seen_enabled(drive) and not power.quick_stop_out:
        # This word would enable an axis that is not enabled, or that is in a quick stop.
        halted = await _halt(power)
    brakes = await _let_quick_stop_brake(power)
    if brakes or not halted:
        await power.send_quick_stop()
        power.stop_step(StepCode.QUICK_STOP)


def quick_stop_coasts(drive: Drive) -> bool:
    """Whether a quick stop would coast according to the last readings."""
    return known_settings(drive).coasts or torque_coasts(drive)


def torque_coasts(drive: Drive) -> bool:
    """Whether it is enabled in a torque mode in which this family's quick stop lets it coast."""
    profile = drive.profile
    if profile.quirk("torque_stop_by_slope") is None or Mode.PV not in drive.modes:
        return False
    if profile.quirk("mode_change_at_standstill") is not None:
        return False
    shown = _seen(drive, drive.key("mode_display"))
    return shown in (Mode.PT, Mode.CST) and _seen_enabled(drive)


async def _halt(power: PowerState) -> bool:
    """Send halt; False where the drive refuses it, so that a quick stop is needed all the same.

    Raises:
        DriveError: the drive is not reached.
    """
    problem: Text | None = None
    drive = power.drive
    try:
        halt = cia402.ENABLE_OPERATION | cia402.HALT
        await drive.stop_by(drive.require("control_word"), halt)
    except (LinkLost, LinkTimeout, ProtocolError):
        raise
    except DriveError as error:
        problem = error.text
    power.stop_step(StepCode.HALT, problem)
    return problem is None


async def _take_speed_control(power: PowerState) -> bool:
    """Switch to Profile velocity with the target 0, in which the drive brakes by 6084h."""
    problem: Text | None = None
    drive = power.drive
    try:
        await drive.stop_by(drive.require("velocity_target"), 0)
        await drive.stop_by(drive.require("mode"), int(Mode.PV))
        if await drive.raw(drive.require("mode_display")) != Mode.PV:
            problem = text("stopping.mode-not-changed")
    except DriveError as error:
        problem = error.text
    power.stop_step(StepCode.SPEED_CONTROL, problem, drive.key("mode"), {"raw": float(Mode.PV)})
    return problem is None


async def _let_quick_stop_brake(power: PowerState) -> bool:
    drive, before = power.drive, known_settings(power.drive).option
    option = braking_option(drive)
    if option is None:
        return False
    problem: Text | None = None
    try:
        await drive.stop_by(OPTION, option)
        if await drive.raw(OPTION) != option:
            problem = text("stopping.option-not-changed")
        elif power.option_before is None:
            power.option_before = before
    except DriveError as error:
        problem = error.text
    power.stop_step(StepCode.OPTION_SET, problem, OPTION, {"raw": float(option)})
    return problem is None


def _seen_enabled(drive: Drive) -> bool:
    """Whether a status word not older than `_SEEN_S` shows Operation enabled."""
    word = _seen(drive, drive.key("status_word"))
    return word is not None and drive.decode_state(word) is State.OPERATION_ENABLED


def _seen(drive: Drive, key: str | None) -> int | None:
    """Raw value of a reading not older than `_SEEN_S`; None where there is none."""
    reading = drive.readings.get(key or "")
    if reading is None or not isinstance(reading.raw, int) or reading.time is None:
        return None
    # Where the clock was set back since, the age is negative and not known.
    return reading.raw if 0.0 <= time.time() - reading.time < _SEEN_S else None
