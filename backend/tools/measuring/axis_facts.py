"""Data of a drive that the tuning tools need, in SI units, read by its profile."""

from __future__ import annotations

import math
from dataclasses import dataclass

from backend.axes.axis.axis import Axis
from backend.axes.drive.drive import Drive
from backend.axes.drive.optional import existing
from drivers.errors import NotAllowed
from profiles.schema import Parameter

_TURN = 2.0 * math.pi
#: Factors from the units printed for parameters to SI.
_SI = {
    "Nm": 1.0, "mNm": 1e-3, "0.1 Nm": 0.1, "0.01 Nm": 0.01, "A": 1.0, "mA": 1e-3, "0.1 A": 0.1,
    "Nm/A": 1.0, "mNm/A": 1e-3, "kg·m²": 1.0, "kg·cm²": 1e-4, "g·cm²": 1e-7, "Hz": 1.0,
    "kHz": 1e3, "1/s": 1.0, "rad/s": 1.0, "ms": 1e-3, "s": 1.0, "µs": 1e-6, "rpm": 1.0,
    "%": 0.01,
}  # fmt: skip


def si_value(parameter: Parameter, value: float) -> float | None:
    """Engineering value of a parameter in SI units; None where its unit is not known here."""
    factor = _SI.get(parameter.unit)
    return None if factor is None else float(value) * factor


def si_raw(parameter: Parameter, value: float) -> int:
    """Raw value of a quantity given in SI units.

    Raises:
        NotAllowed: the parameter's unit has no known meaning in SI.
    """
    factor = _SI.get(parameter.unit)
    if factor is None:
        raise NotAllowed(
            "autotune.unit-cannot-converted",
            parameter=parameter.key,
            key=parameter.name,
            parameter_unit=parameter.unit,
        )
    return round(parameter.to_raw(value / factor))


@dataclass(frozen=True, slots=True)
class AxisFacts:
    """Data of drive and motor; None where neither the drive nor the profile states it.

    ``rated_torque_nm`` is the torque at 100 %; where it is unknown (``torque_known`` False) it is
    1.0, so that "Nm" then means "of rated torque". ``interpolates``: whether the drive interpolates
    linearly between cyclic setpoints (60C2h).
    """

    rated_torque_nm: float
    torque_known: bool
    rated_speed_rpm: float | None
    current_bandwidth_hz: float | None
    speed_filter_hz: float | None
    motor_inertia_kgm2: float | None
    drive_inertia_kgm2: float | None
    interpolates: bool
    torque_filter_hz: float | None = None
    """Corner of the first-order torque command filter that the profile names, while it is on."""


async def si(drive: Drive, key: str | None) -> float | None:
    """Read a parameter in SI units; None where it does not exist or is not readable."""
    if key is None:
        return None
    parameter = drive.parameter(key)
    if drive.unreachable_why(parameter) or parameter.access == "wo":
        return None
    reading = (await existing(drive, (key,))).get(key)
    value = None if reading is None else reading.value
    return None if not isinstance(value, (int, float)) else si_value(parameter, value)


async def brake_opens_s(drive: Drive) -> float:
    """Time that the drive waits for its brake before it follows setpoints, by its parameters [s].

    It starts at Operation enabled; 0 where the family documents no such time.
    """
    timing = drive.profile.functions.brake
    if timing is None:
        return 0.0
    found = [await si(drive, key) for key in (timing.open_delay_key, timing.command_delay_key)]
    return sum(each for each in found if each) + (timing.open_fixed_ms or 0.0) / 1e3


async def read_facts(
    axis: Axis, rated_torque_nm: float | None = None, motor_inertia_kgm2: float | None = None
) -> AxisFacts:
    """Read the data; the given values replace the drive's.

    Raises:
        DriveError: a parameter cannot be read.
    """
    drive = axis.drive
    gains = drive.profile.gains
    torque = rated_torque_nm or await si(drive, drive.key("rated_torque"))
    if not torque:
        constant = await si(drive, drive.key("torque_constant"))
        current = await si(drive, drive.key("rated_current"))
        torque = constant * current if constant and current else None
    inertia = await si(drive, gains.inertia if gains else None)
    meaning = gains.inertia_meaning if gains else None
    rotor = motor_inertia_kgm2 or await si(drive, drive.key("motor_inertia"))
    total = inertia if meaning == "total" else None
    if meaning in ("ratio", "ratio_percent") and rotor and inertia is not None:
        total = rotor * (1.0 + inertia)
    elif meaning == "load" and rotor and inertia is not None:
        total = rotor + inertia
    filter_s = await si(drive, gains.torque_filter if gains else None)
    return AxisFacts(
        rated_torque_nm=torque or 1.0,
        torque_known=bool(torque),
        rated_speed_rpm=await si(drive, drive.key("rated_speed")),
        current_bandwidth_hz=await si(drive, gains.current_bandwidth if gains else None),
        speed_filter_hz=await si(drive, gains.speed_filter if gains else None),
        motor_inertia_kgm2=rotor or None,
        drive_inertia_kgm2=total or None,
        interpolates="60C2:01" in drive.profile.by_key,
        torque_filter_hz=1.0 / (_TURN * filter_s) if filter_s else None,
    )
