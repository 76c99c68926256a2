"""Protections and supply where a manual prints none.

Values that no manual prints (thresholds of the power stage, the overload curve) are specific to
this virtual drive: I²t trips when the integral of (torque/rated)² − 1 reaches 24 s, that is after 3
s at three times the rated torque.
"""

from __future__ import annotations

import math

from drivers.virtual.firmware.objects.settings import MotorData, ProtectionSettings

I2T_S = 24.0
#: Rectified 220 V mains; a family that states no supply uses the bench's own 48 V.
MAINS_V = 310.0


def own(motor: MotorData) -> ProtectionSettings:
    """Return protections as shares of the supply and of the ratings."""
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
