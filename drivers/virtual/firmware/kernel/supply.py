"""Power side of a step: DC bus, braking resistor, temperature and average load."""

from __future__ import annotations

from numba import njit

from drivers.virtual.firmware.kernel import layout as k


@njit(nogil=True)
def supply(p, s, x):  # type: ignore[no-untyped-def]
    """Update DC bus, braking resistor, temperature and average load."""
    current = s[k.S_TORQUE] / p[k.P_KT]
    s[k.S_CURRENT] = current
    copper = 3.0 * p[k.P_RESISTANCE] * current * current
    # Without the power stage the bus receives no energy: shorted windings dissipate it themselves.
    power = s[k.S_TORQUE] * x[1] + copper if int(p[k.P_LOOP]) != k.LOOP_OFF else 0.0
    s[k.S_UQ] = p[k.P_RESISTANCE] * current + p[k.P_KT] * x[1] / 3.0
    volts = s[k.S_VOLTAGE]
    if volts >= p[k.P_BRAKE_ON_V]:
        s[k.S_BRAKE_ON] = 1.0
    elif volts <= p[k.P_BRAKE_OFF_V]:
        s[k.S_BRAKE_ON] = 0.0
    chopper = s[k.S_BRAKE_ON] * p[k.P_BRAKE_ENABLED]
    drain = power / max(volts, 5.0) + chopper * volts / p[k.P_BRAKE_R]
    c = p[k.P_SUPPLY_C]
    # Implicit in the supply's resistance, which is much faster than one step.
    fed = (volts + k.STEP_S / c * (p[k.P_SUPPLY_V] / p[k.P_SUPPLY_R] - drain)) / (
        1.0 + k.STEP_S / (c * p[k.P_SUPPLY_R])
    )
    if fed > p[k.P_SUPPLY_V] and p[k.P_SUPPLY_SINKS] == 0.0:
        fed = max(volts - k.STEP_S / c * drain, min(fed, p[k.P_SUPPLY_V]))
    s[k.S_VOLTAGE] = max(fed, 0.0)
    s[k.S_BRAKE_DUTY] += (chopper - s[k.S_BRAKE_DUTY]) * k.STEP_S / 0.1
    heat = p[k.P_AMBIENT] + copper * p[k.P_THERMAL_K_PER_W]
    s[k.S_TEMPERATURE] += (heat - s[k.S_TEMPERATURE]) * k.STEP_S / p[k.P_THERMAL_S]
    ratio = abs(s[k.S_TORQUE]) / p[k.P_RATED_NM]
    s[k.S_LOAD_RATIO] += (ratio - s[k.S_LOAD_RATIO]) * k.STEP_S / p[k.P_LOAD_RATIO_S]
