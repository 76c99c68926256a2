"""Objects whose value is a measurement or a state of the firmware."""

from __future__ import annotations

from collections.abc import Callable

from drivers.virtual.firmware.cia402.states import State
from drivers.virtual.firmware.control import DeviceControl
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.motion.load_encoder import KEY as LOAD_POSITION
from drivers.virtual.firmware.motion.load_encoder import LoadEncoder
from drivers.virtual.firmware.objects.dictionary import Number
from drivers.virtual.firmware.objects.monitors import monitors
from drivers.virtual.firmware.objects.panel import Panel
from drivers.virtual.firmware.rough.rough_feedback import position_value, speed_value
from drivers.virtual.firmware.terminals import Terminals

_TURN_INCREMENTS = 65536
"""Increments of the internal unit INC per motor revolution (004:6984-6986)."""


_STANDARD_OF_ROLE = {
    "error_code": "603F:00",
    "status_word": "6041:00",
    "mode_display": "6061:00",
    "position_actual": "6064:00",
    "velocity_actual": "606C:00",
    "torque_actual": "6077:00",
    "digital_inputs": "60FD:00",
}


def live_values(
    core: Core, control: DeviceControl, panel: Panel | Terminals
) -> dict[str, Callable[[], Number]]:
    """Return getters by parameter key; a drive connects those in its dictionary."""
    item = core.axis.s.item
    inc_per_rad = _TURN_INCREMENTS / (2 * 3.141592653589793)

    def position() -> int:
        return round(core.shown_position(item(k.S_THETA)))

    def demand() -> int:
        return round(core.shown_position(item(k.S_P_DEMAND)))

    def velocity() -> int:
        return round(item(k.S_OMEGA) * core.units.speed_per_rad_s)

    def torque() -> int:
        return round(item(k.S_TORQUE_REPORTED) * core.units.torque_per_nm)

    def digital_inputs() -> int:
        if isinstance(panel, Panel):
            panel.target_reached = control.target_reached
            panel.alarm = control.state in (State.FAULT, State.FAULT_REACTION)
        return panel.digital_inputs()

    def plain_inputs() -> int:
        """Return CiA 402 bits 0 to 2 by the switches as the loop receives them."""
        bits = int(item(k.S_SIGNALS)) & 7
        if core.family.traits.limit_bits_swapped:
            bits = bits & 4 | (bits & 1) << 1 | bits >> 1 & 1
        return bits

    has_terminals = core.family.traits.assigns_terminals or isinstance(panel, Terminals)
    values: dict[str, Callable[[], Number]] = {
        "1001:00": lambda: control.alarms.error_register,
        "603F:00": lambda: control.faults.error_code,
        "6041:00": control.status_word,
        "6061:00": lambda: control.modes.mode,
        "6062:00": demand,
        "6063:00": lambda: round((item(k.S_THETA) - core.zero_rad) * inc_per_rad),
        "6064:00": position_value(core, position),
        "606B:00": lambda: (
            round(item(k.S_SPEED_REFERENCE) * core.speed_raw_per_rad_s("606B:00"))
            if control.state is State.OPERATION_ENABLED
            else 0
        ),
        "606C:00": speed_value(core, velocity),
        "6074:00": lambda: round(item(k.S_TORQUE_COMMAND) * core.units.torque_per_nm),
        "6077:00": torque,
        "6078:00": torque,
        "6079:00": lambda: round(item(k.S_VOLTAGE) * 1e3),
        "60B9:00": panel.probe_status,
        "60BA:00": lambda: panel.latched("60BA:00"),
        "60BB:00": lambda: panel.latched("60BB:00"),
        "60BC:00": lambda: panel.latched("60BC:00"),
        "60BD:00": lambda: panel.latched("60BD:00"),
        "60F4:00": lambda: round(
            (item(k.S_P_DEMAND) - item(k.S_THETA)) * core.units.position_per_rad
        ),
        "60FC:00": lambda: round((item(k.S_P_DEMAND) - core.zero_rad) * inc_per_rad),
        "60FD:00": digital_inputs if has_terminals else plain_inputs,
    }
    if core.family.traits.error_status_key is not None:
        values[core.family.traits.error_status_key] = lambda: core.axis.faults & 0x1FFF
    if core.axis.spec.load_encoder is not None:
        values[LOAD_POSITION] = LoadEncoder(core.axis, core.axis.spec.load_encoder)
    values |= core.family.readings(core.axis)
    values |= monitors(core, control, panel if isinstance(panel, Terminals) else None)
    # The same quantity under a number of the manufacturer's own (2102h is DS_C's error code).
    for role, standard in _STANDARD_OF_ROLE.items():
        parameter = core.profile.by_role.get(role)
        if parameter is not None and parameter.access == "ro":
            values.setdefault(parameter.key, values[standard])
    return values
