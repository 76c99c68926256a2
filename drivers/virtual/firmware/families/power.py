"""Protections, supply and holding brake of each family, where its manual prints parameters.

What no manual prints (thresholds of the power stage, the shape of the overload curve) is this
virtual drive's own: I²t trips when the surplus of (torque/rated)² − 1 adds up to 24 s, that is
after 3 s at three times the rated torque.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from drivers.virtual.firmware.dictionary import ObjectDictionary
from drivers.virtual.firmware.families.base import RPM, BrakeTimes
from drivers.virtual.firmware.settings import MotorData, ProtectionSettings

_MS = 1e-3
I2T_S = 24.0
#: Rectified 220 V mains of M6-L, R6L and EP3E; DS_C and MMS7 take the bench's own 48 V.
MAINS_V = 310.0
SUPPLY_V: dict[str, float] = {"m6l": MAINS_V, "r6l": MAINS_V, "ep3e": MAINS_V}

Refine = Callable[[ObjectDictionary, MotorData, ProtectionSettings], ProtectionSettings]
Brake = Callable[[ObjectDictionary], BrakeTimes | None]


def own(motor: MotorData) -> ProtectionSettings:
    """Shares of the supply and of the ratings."""
    supply = motor.supply_v
    return ProtectionSettings(
        over_current_a=3.5 * math.sqrt(2) * motor.rated_current_a,
        under_voltage_v=0.6 * supply,
        over_voltage_v=1.3 * supply,
        brake_on_v=1.2 * supply,
        brake_off_v=1.15 * supply,
        brake_enabled=True,
        locked_s=math.inf,
        i2t_s=I2T_S,
        i2t_rated_nm=motor.rated_torque_nm,
        over_temperature_c=100.0,
        over_speed_rad_s=1.3 * motor.rated_speed_rad_s,
    )


def m6l(od: ObjectDictionary, motor: MotorData, base: ProtectionSettings) -> ProtectionSettings:
    """P10.07, P10.09, P10.10, P10.12, P02.18 and P02.20 (000:3480-3485, 000:3245-3247)."""
    resistor = int(od.number("2002:13"))
    external = float(od.number("2002:15"))
    over_speed = float(od.number("200A:0D"))
    return replace(
        base,
        i2t_rated_nm=max(od.number("200A:08", 1000), 200) / 1000 * motor.rated_torque_nm,
        over_speed_rad_s=over_speed * RPM if over_speed else math.inf,
        brake_enabled=resistor != 2,
        braking_ohm=external if resistor == 1 and external else 50.0,
        locked_s=od.number("200A:0B", 200) * _MS if od.number("200A:0A") else math.inf,
        locked_angle_rad=0.02,
    )


def r6l(od: ObjectDictionary, motor: MotorData, base: ProtectionSettings) -> ProtectionSettings:
    """P01.24 to P01.27, P01.48, P01.49, P01.57 to P01.61, P01.80, P01.82 and P00.21."""
    resistor = int(od.number("2001:19", 1))
    limit = min(od.number("60E0:00", 3000), od.number("6072:00", 3000), 3000) / 1000
    own_level = od.number("2001:53", 2400) / 1000
    stall = {1: limit, 2: own_level, 3: max(limit, own_level)}.get(int(od.number("2001:3B", 1)))
    on_v = float(od.number("2001:1C", 380))
    fastest = float(od.number("2000:16"))
    return replace(
        base,
        over_voltage_v=float(od.number("2001:31", 420)),
        under_voltage_v=float(od.number("2001:32", 200)),
        brake_on_v=on_v,
        brake_off_v=0.97 * on_v,
        brake_enabled=resistor != 2,
        # 50 Ω built in (002:242), or what P01.26 says of an external one.
        braking_ohm=50.0 if resistor == 0 else max(float(od.number("2001:1B", 50)), 1.0),
        over_speed_rad_s=(fastest or 1.2 * motor.rated_speed_rad_s / RPM) * RPM
        if not od.number("2001:51")
        else math.inf,
        i2t_s=I2T_S if int(od.number("2001:3E", 3)) & 1 else math.inf,
        i2t_rated_nm=max(od.number("2001:3C", 100), 40) / 100 * motor.rated_torque_nm,
        locked_s=od.number("2001:3A", 200) * _MS if stall is not None else math.inf,
        # A little below, so that a torque at its limit counts.
        locked_nm=0.99 * (stall or 0.0) * motor.rated_torque_nm,
        locked_angle_rad=0.02,
    )


def ds_c(od: ObjectDictionary, motor: MotorData, base: ProtectionSettings) -> ProtectionSettings:
    """2506h (003:591): the current that may flow for long; no over-speed fault is printed."""
    continuous = od.number("2506:00", 2500) / 1000
    return replace(
        base,
        over_speed_rad_s=math.inf,
        over_temperature_c=math.inf,
        i2t_rated_nm=max(continuous, 0.1) * motor.rated_torque_nm,
    )


def m6l_brake(od: ObjectDictionary) -> BrakeTimes | None:
    """P01.17, P02.10 to P02.13 and an output with function 18 (000:1360-1425)."""
    assigned = any(od.number(f"2003:{sub:02X}", -1) == 18 for sub in range(0x10, 0x15))
    if od.number("2001:12") != 1 or not assigned:
        return None
    return BrakeTimes(
        command_s=od.number("2002:0B", 250) * _MS,
        hold_s=od.number("2002:0C", 150) * _MS,
        hold_moving_s=0.04,  # 000:1405
        moving_s=od.number("2002:0E", 500) * _MS,
        speed_rad_s=od.number("2002:0D", 10) * RPM,
    )


def r6l_brake(od: ObjectDictionary) -> BrakeTimes | None:
    """P01.04, P01.05, P01.11 to P01.13 and an output with function 0 (002:8117-8273)."""
    if all(od.number(f"2002:{sub:02X}", -1) != 0 for sub in (0x21, 0x23, 0x25, 0x27)):
        return None
    hold = od.number("2001:0E", 200) * _MS
    return BrakeTimes(
        release_s=od.number("2001:0C") * _MS,
        command_s=od.number("2001:0D", 100) * _MS,
        hold_s=hold,
        hold_moving_s=hold,
        moving_s=od.number("2001:05", 500) * _MS,
        speed_rad_s=od.number("2001:06", 30) * RPM,
    )


def ds_c_brake(od: ObjectDictionary) -> BrakeTimes | None:
    """2401h, 2402h and an output with function 6 (003:544-549)."""
    if all(od.number(f"2400:{sub:02X}", -1) != 6 for sub in (0x0D, 0x0E, 0x0F)):
        return None
    closing = od.number("2402:00") * _MS
    return BrakeTimes(command_s=od.number("2401:00") * _MS, hold_s=closing, hold_moving_s=closing)


def follows_power(od: ObjectDictionary) -> BrakeTimes | None:  # noqa: ARG001 - the seam's
    """A brake output without printed times (EP3E: BRK and BRKNET, 001:22, 001:27)."""
    return BrakeTimes()


REFINE: dict[str, Refine] = {"m6l": m6l, "r6l": r6l, "ds_c": ds_c}
BRAKES: dict[str, Brake] = {
    "m6l": m6l_brake,
    "r6l": r6l_brake,
    "ds_c": ds_c_brake,
    "ep3e": follows_power,
}

__all__ = ["BRAKES", "REFINE", "SUPPLY_V", "own"]
