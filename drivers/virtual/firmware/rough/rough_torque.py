"""Options of a non-ideal axis as parameters of the 50 µs loop."""

from __future__ import annotations

import math

from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.loop_parameters import Parameters
from drivers.virtual.mechanics import MechanicsSpec


def write_rough_torque(p: Parameters, spec: MechanicsSpec) -> None:
    """Write all of `RoughTorqueSpec`; presliding friction replaces that of the plant.

    Must follow `loop_parameters.write_physics`, whose Coulomb friction it replaces.
    """
    rough = spec.rough_torque
    p[k.P_ROUGH_ON] = rough.active
    p[k.P_ROUGH_HOLDS_TORQUE], p[k.P_ROUGH_HOLDS_SPEED] = rough.holds_torque, rough.holds_speed
    p[k.P_ROUGH_JITTER_STEPS] = round(rough.jitter_s / k.STEP_S)
    p[k.P_ROUGH_COPY] = rough.reported == "demand"
    p[k.P_ROUGH_REPORT_LAG] = _lag(rough.reported_filter_s)
    p[k.P_ROUGH_LAG] = _lag(rough.torque_filter_s)
    p[k.P_ROUGH_PERIOD] = rough.loop_period_s / k.STEP_S
    p[k.P_ROUGH_CONSTANT] = rough.torque_constant
    p[k.P_ROUGH_PRESLIDING] = rough.presliding_rad
    if rough.presliding_rad > 0:
        p[k.P_ROUGH_COULOMB], p[k.P_COULOMB] = spec.friction.coulomb_nm, 0.0
    p[k.P_ROUGH_COG], p[k.P_ROUGH_COG_PER_REV] = rough.cogging_nm, rough.cogging_per_rev
    p[k.P_ROUGH_DRAG], p[k.P_ROUGH_DRAG_RAD] = rough.drag_nm, rough.drag_rad
    p[k.P_ROUGH_INERTIA] = rough.inertia_share * spec.motor.inertia_kgm2
    p[k.P_ROUGH_INERTIA_PER_REV] = rough.inertia_per_rev
    stiffness = spec.load[0].stiffness_nm_per_rad if spec.load else 0.0
    p[k.P_ROUGH_STIFFNESS] = rough.stiffness_share * stiffness
    p[k.P_ROUGH_FIRST_INERTIA] = spec.load[0].inertia_kgm2 if spec.load else 1.0
    p[k.P_ROUGH_STIFF_PER_REV] = rough.stiffness_per_rev
    p[k.P_ROUGH_SLIP] = rough.slip_per_s
    p[k.P_ROUGH_DIP_SHARE] = rough.dip_share
    p[k.P_ROUGH_DIP_STEPS] = round(rough.dip_s / k.STEP_S)
    p[k.P_ROUGH_DIP_EVERY] = round(rough.dip_every_s / k.STEP_S)
    p[k.P_ROUGH_INTERPOLATION] = rough.interpolation_rad
    p[k.P_ROUGH_INTERPOLATION_PER_REV] = rough.interpolation_per_rev


def _lag(time_constant_s: float) -> float:
    return 1.0 if time_constant_s <= 0 else 1.0 - math.exp(-k.STEP_S / time_constant_s)
