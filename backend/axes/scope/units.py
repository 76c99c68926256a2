"""Conversion factors for traces, from a drive's own unit to the unit of its axis."""

from __future__ import annotations

from backend.axes.drive.drive import Drive
from backend.axes.scales.units import AxisUnits
from profiles.schema import Parameter

#: Roles of each quantity, for parameters that may state another unit.
_ROLES = {
    "position": (
        "position_actual",
        "position_demand",
        "position_target",
        "position_offset",
        "following_error",
    ),
    "velocity": ("velocity_actual", "velocity_demand", "velocity_target", "velocity_offset"),
    "torque": ("torque_actual", "torque_demand", "torque_target", "torque_offset"),
}


def axis_scale(units: AxisUnits, drive: Drive, parameter: Parameter) -> tuple[str, float | None]:
    """Unit of the axis, and the factor from the parameter's unit to it.

    ``("", None)`` where the parameter is not a position, velocity or torque, or has that unit
    already.
    """
    kind = _kind(units, drive, parameter)
    if kind is None or parameter.scale == 0 or parameter.offset:
        return "", None
    raw_to_axis = {"position": units.position, "velocity": units.velocity, "torque": units.torque}
    unit, factor = units.names[kind], raw_to_axis[kind](1.0) / parameter.scale
    if unit == parameter.unit:
        return "", None
    return unit, factor


def _kind(units: AxisUnits, drive: Drive, parameter: Parameter) -> str | None:
    for kind, roles in _ROLES.items():
        if any(drive.key(role) == parameter.key for role in roles):
            return kind
    printed = {
        "position": units.spec.position,
        "velocity": units.spec.velocity,
        "torque": units.spec.torque,
    }
    return next((kind for kind, unit in printed.items() if unit == parameter.unit), None)
