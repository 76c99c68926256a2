"""Objects whose value is a measurement or a state of the firmware."""

from __future__ import annotations

from collections.abc import Callable

from drivers.virtual.firmware import kernel as k
from drivers.virtual.firmware.control import DeviceControl
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.dictionary import Number
from drivers.virtual.firmware.panel import Panel
from drivers.virtual.firmware.states import State

_TURN_INCREMENTS = 65536
"""Increments of the internal unit INC per motor revolution (004:6984-6986)."""


def live_values(
    core: Core, control: DeviceControl, panel: Panel
) -> dict[str, Callable[[], Number]]:
    """Getters by parameter key; a drive connects those that its dictionary has."""
    item = core.axis.s.item
    inc_per_rad = _TURN_INCREMENTS / (2 * 3.141592653589793)

    def position() -> int:
        return round((item(k.S_THETA) - core.zero_rad) * core.units.position_per_rad)

    def demand() -> int:
        return round((item(k.S_P_DEMAND) - core.zero_rad) * core.units.position_per_rad)

    def velocity() -> int:
        return round(item(k.S_OMEGA) * core.units.speed_per_rad_s)

    def torque() -> int:
        return round(item(k.S_TORQUE) * core.units.torque_per_nm)

    def status_word() -> int:
        word = control.status_word()
        panel.target_reached = bool(word & 1 << 10)
        panel.alarm = control.state in (State.FAULT, State.FAULT_REACTION)
        return word

    def digital_inputs() -> int:
        status_word()
        return panel.digital_inputs()

    def current_ma() -> int:
        return round(item(k.S_CURRENT) * 1e3)

    return {
        "1001:00": lambda: control.error_register,
        "603F:00": lambda: control.error_code,
        "6041:00": status_word,
        "6061:00": lambda: control.modes.mode,
        "6062:00": demand,
        "6063:00": lambda: round((item(k.S_THETA) - core.zero_rad) * inc_per_rad),
        "6064:00": position,
        "606B:00": lambda: (
            round(item(k.S_SPEED_REFERENCE) * core.units.speed_per_rad_s)
            if control.state is State.OPERATION_ENABLED
            else 0
        ),
        "606C:00": velocity,
        "6074:00": lambda: round(item(k.S_TORQUE_COMMAND) * core.units.torque_per_nm),
        "6077:00": torque,
        "6078:00": torque,
        "6079:00": lambda: round(item(k.S_VOLTAGE) * 1e3),
        "60B9:00": panel.probe_status,
        "60BA:00": lambda: panel.latched("60BA:00"),
        "60BB:00": lambda: panel.latched("60BB:00"),
        "60BC:00": lambda: panel.latched("60BC:00"),
        "60BD:00": lambda: panel.latched("60BD:00"),
        "60F4:00": lambda: demand() - position(),
        "60FC:00": lambda: round((item(k.S_P_DEMAND) - core.zero_rad) * inc_per_rad),
        "60FD:00": digital_inputs,
        "200B:0B": lambda: core.axis.faults,
        "200E:01": lambda: 0,
        "200E:02": current_ma,
        "200E:03": lambda: 0,
        "200E:04": lambda: round(item(k.S_UQ) * 1e3),
        "200E:05": lambda: round(item(k.S_TORQUE) * 1e3),
        "200E:06": lambda: round(item(k.S_THETA) * inc_per_rad),
        "200E:07": lambda: round(item(k.S_THETA_FILTERED) * inc_per_rad),
        "200E:09": lambda: round(item(k.S_OMEGA) * inc_per_rad),
        "200E:0B": lambda: round(item(k.S_LOAD_RATIO) * 1000),
        "200E:0C": lambda: round(item(k.S_BRAKE_DUTY) * 100),
        "2040:00": lambda: round(item(k.S_TEMPERATURE)),
    }
