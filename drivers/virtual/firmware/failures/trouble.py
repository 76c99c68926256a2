"""Deliberate failures, for tests and training."""

from __future__ import annotations

from typing import Final

from drivers.virtual.firmware.control import DeviceControl
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.loop_parameters import TURN
from drivers.virtual.firmware.objects.panel import Panel
from drivers.virtual.firmware.terminals import Terminals
from profiles.schema import Fault

_FAULTS: Final = {
    "over_current": k.F_OVER_CURRENT, "under_voltage": k.F_UNDER_VOLTAGE,
    "locked_rotor": k.F_LOCKED, "power_stage": k.F_POWER_STAGE, "overload": k.F_OVERLOAD,
    "position_limit": k.F_POSITION_LIMIT, "sensor": k.F_SENSOR, "memory": k.F_MEMORY,
    "over_temperature": k.F_OVER_TEMPERATURE, "over_voltage": k.F_OVER_VOLTAGE,
    "over_speed": k.F_OVER_SPEED, "speed_error": k.F_SPEED_ERROR, "watchdog": k.F_WATCHDOG,
    "following_error": k.F_FOLLOWING,
}  # fmt: skip
_PHYSICS: Final = {
    "supply_v": k.P_SUPPLY_V,
    "ambient_c": k.P_AMBIENT,
    "load_nm": k.P_GRAVITY,
    "coulomb_nm": k.P_COULOMB,
    "encoder_loss": k.P_ENCODER_DEAD,
}


def make_trouble(
    core: Core, control: DeviceControl, panel: Panel | Terminals, what: str, value: float
) -> None:
    """Cause one failure by name; see `VirtualServo.inject`.

    Raises:
        ValueError: this drive does not support this failure.
    """
    if what in _PHYSICS:
        core.axis.p[_PHYSICS[what]] = value
    elif what == "turn_to_rev":
        core.axis.place(value * TURN)
    elif what == "temperature_c":
        core.axis.s[k.S_TEMPERATURE] = value
    elif what in _FAULTS:
        control.faults.raise_bits(_FAULTS[what])
    elif what.startswith("di") and what[2:].isdigit():
        place = int(what[2:]) - 1
        if not 0 <= place < len(panel.external):
            raise ValueError(f"{core.profile.drive} has no input {what}")
        panel.external[place] = value > 0
    elif (fault := _entry(control, what)) is not None:
        bit = _protection_of(core, fault.code)
        if bit:
            control.faults.raise_bits(bit)
        else:
            control.faults.raise_entry(fault)
    else:
        control.faults.raise_bits(_fault_by_code(core, what))


def _entry(control: DeviceControl, what: str) -> Fault | None:
    """Return an entry of the fault table by its code or the value of 603Fh."""
    found = control.alarms.find(what)
    if found is None and what.startswith("0x"):
        found = control.alarms.find_raw(int(what, 16))
    return found


def _protection_of(core: Core, code: str) -> int:
    """Return the protection that reports this entry, 0 if none does."""
    return next((b for b, info in core.family.traits.faults.items() if info.fault == code), 0)


def _fault_by_code(core: Core, what: str) -> int:
    try:
        code = int(what, 0)
    except ValueError:
        raise ValueError(f"a virtual drive knows no trouble named {what!r}") from None
    for bit, info in core.family.traits.faults.items():
        if info.code == code:
            return bit
    raise ValueError(f"{core.profile.drive} has no fault with code {what}")
