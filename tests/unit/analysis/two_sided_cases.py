"""Drawn axes with a gap between motor and load, moved as the tool plans it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from backend.analysis.mechanics.load_side import LoadSide, Value, load_side
from backend.analysis.mechanics.load_side_samples import (
    TwoSides,
)
from backend.tools.mechanics.load_side.run import Plan, Room, planned
from backend.tools.mechanics.load_side.settings import LoadSideSettings
from tests.unit.analysis.two_sided_axis import RATE_HZ, TURN, Axis, moved

AXES = 52

TRAVEL_REV, SPEED_RPM, TORQUE = 4.0, 2000.0, 0.8


@dataclass(frozen=True)
class Case:
    """An axis, and its rated torque in Nm."""

    axis: Axis
    rated_nm: float

    @property
    def count_rad(self) -> float:
        """One count of the load's encoder, in rad of the motor."""
        return TURN * self.axis.gear / self.axis.counts


def drawn(seed: int) -> Case:
    """Servo axes as they are built: 20 to 200 Hz with the motor held, gaps up to 1.1°."""
    r = np.random.default_rng(seed)
    motor = float(np.exp(r.uniform(np.log(2e-5), np.log(2e-4))))
    load = motor * float(np.exp(r.uniform(np.log(0.5), np.log(6.0))))
    own_hz = float(np.exp(r.uniform(np.log(20.0), np.log(200.0))))
    stiffness = load * (TURN * own_hz) ** 2
    rated = motor * 2e4
    gap = 0.0 if r.random() < 0.1 else float(np.exp(r.uniform(np.log(5e-4), np.log(2e-2))))
    axis = Axis(
        motor_kgm2=motor, load_kgm2=load, stiffness=stiffness,
        damping=2.0 * r.uniform(0.04, 0.2) * math.sqrt(stiffness * load), gap_rad=gap,
        gear=float(r.choice([1.0, 1.0, 1.0, 3.0, 5.0])),
        motor_coulomb=rated * r.uniform(0.01, 0.04), motor_stiction=rated * r.uniform(0.0, 0.02),
        load_coulomb=rated * r.uniform(0.0, 0.02), viscous=rated * r.uniform(0.0, 2e-4),
        pull=0.0 if r.random() < 0.7 else rated * r.uniform(-0.01, 0.01),
        cogging=rated * r.uniform(0.0, 0.01), counts=int(2 ** r.integers(13, 21)),
        eccentric_rad=r.uniform(0.0, 2e-3), second_rad=r.uniform(0.0, 5e-4),
        phase_rad=r.uniform(0.0, 6.0), noise_counts=r.uniform(0.0, 0.5),
        torque_step=rated * 1e-3, torque_noise=rated * 1e-3, bandwidth_hz=r.uniform(25.0, 60.0),
    )  # fmt: skip
    return Case(axis, rated)


def plan_of(case: Case, travel_rev: float = TRAVEL_REV) -> Plan:
    axis = case.axis
    free = TORQUE * case.rated_nm - axis.motor_coulomb - axis.load_coulomb - abs(axis.pull)
    room = Room(
        0.8 * travel_rev,
        0.85 * SPEED_RPM / 60.0,
        90.0,
        0.5 * free / (axis.motor_kgm2 + axis.load_kgm2),
        (axis.motor_coulomb + axis.load_coulomb + abs(axis.pull))
        / (axis.motor_kgm2 + axis.load_kgm2),
    )
    asked = LoadSideSettings(
        travel_limit=travel_rev,
        speed_limit=SPEED_RPM,
        torque_limit=100 * TORQUE,
        gear_ratio=axis.gear,
    )
    return planned(asked, room, RATE_HZ)


def sides_of(case: Case, seed: int, travel_rev: float = TRAVEL_REV) -> TwoSides:
    plan = plan_of(case, travel_rev)
    speed = np.concatenate([plan.slow_rpm, plan.moves_rpm]) * TURN / 60.0
    angle, counts, torque = moved(case.axis, speed, seed)
    part = np.concatenate([plan.slow_part, plan.moves_part])
    valid = np.ones(part.size, dtype=np.bool_)
    return TwoSides(RATE_HZ, angle, counts, torque, valid, part, case.axis.gear)


@cache
def campaign() -> tuple[tuple[Case, LoadSide], ...]:
    cases = [drawn(seed) for seed in range(AXES)]
    return tuple(
        (case, load_side(sides_of(case, seed), case.axis.motor_kgm2))
        for seed, case in enumerate(cases)
    )


def holds(value: Value, truth: float) -> bool:
    return abs(value.value - truth) <= value.half


def stiffness_of(found: LoadSide) -> Value | None:
    """J over J/k with the interval of both, as the tool makes it."""
    if found.twist_s2 is None or found.load_inertia_kgm2 is None:
        return None
    value = found.load_inertia_kgm2.value / found.twist_s2.value
    off = math.hypot(
        found.load_inertia_kgm2.half / found.load_inertia_kgm2.value,
        found.twist_s2.half / found.twist_s2.value,
    )
    return Value(value, value * off)
