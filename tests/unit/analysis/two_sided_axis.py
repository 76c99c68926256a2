"""A motor and a load with a gap between them, as its equations of motion have it.

Nothing of the analysis is used: contact is a spring with a dead zone and damping that acts in
contact alone, friction of the load is Dahl's (it grows with the way before it slides), friction of
the motor has a Stribeck curve, the loop is a PI with a filtered speed and setpoints
that are interpolated, and both encoders count.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit

FloatArray = npt.NDArray[np.float64]
STEP_S = 25e-6
RATE_HZ = 1000.0
TURN = 2 * math.pi


@dataclass(frozen=True)
class Axis:
    """SI units at the motor shaft; ``counts`` of one load revolution, ``gear`` motor turns long."""

    motor_kgm2: float
    load_kgm2: float
    stiffness: float
    damping: float
    gap_rad: float
    motor_coulomb: float
    motor_stiction: float
    load_coulomb: float
    viscous: float
    pull: float = 0.0
    cogging: float = 0.0
    gear: float = 1.0
    counts: int = 2**20
    eccentric_rad: float = 0.0
    second_rad: float = 0.0
    phase_rad: float = 0.0
    noise_counts: float = 0.0
    torque_step: float = 1e-3
    torque_noise: float = 0.0
    bandwidth_hz: float = 40.0


@njit
def _simulate(reference, a):  # type: ignore[no-untyped-def]
    (jm, jl, k, d, gap, fm, fs, fl, b, pull, cog, bandwidth) = a
    per = round(1.0 / RATE_HZ / STEP_S)
    n = reference.shape[0]
    motor, load, torque = np.empty(n), np.empty(n), np.empty(n)
    tm = wm = tl = wl = dahl = integral = seen = 0.0
    before = 0.0
    gain = TURN * bandwidth * (jm + jl)
    counts = 2.0**20 / TURN
    bristle = max(fl, 1e-9) / 2e-4
    command = 0.0
    for i in range(n):
        motor[i], load[i], torque[i] = tm, tl, command
        for j in range(per):
            if j % 10 == 0:
                angle = math.floor(tm * counts) / counts
                speed = (angle - before) / (10 * STEP_S)
                before = angle
                seen += 0.3 * (speed - seen)
                share = j / per
                error = (1.0 - share) * reference[max(i - 1, 0)] + share * reference[i] - seen
                integral += error * 10 * STEP_S
                command = gain * (error + 0.15 * TURN * bandwidth * integral)
            twist = tm - tl
            coupled = 0.0
            if abs(twist) > 0.5 * gap:
                deep = twist - math.copysign(0.5 * gap, twist)
                coupled = k * deep + d * (wm - wl)
                if coupled * twist < 0.0:
                    coupled = 0.0
            slow = wm / 1.5
            rub = (fm + fs * math.exp(-slow * slow)) * math.tanh(wm / 0.02) + b * wm
            rub += cog * math.sin(24.0 * tm + 0.4) + 0.3 * cog * math.sin(tm)
            dahl += bristle * wl * (1.0 - math.copysign(1.0, wl) * dahl / max(fl, 1e-9)) * STEP_S
            dahl = min(max(dahl, -fl), fl)
            wm += (command - rub - coupled) / jm * STEP_S
            wl += (coupled - dahl - pull) / jl * STEP_S
            tm += wm * STEP_S
            tl += wl * STEP_S
    return motor, load, torque


def moved(
    axis: Axis, speed_rad_s: FloatArray, seed: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Motor angle in rad, counts of the load, torque in Nm: [n] each, at 1 kHz."""
    given = (
        axis.motor_kgm2, axis.load_kgm2, axis.stiffness, axis.damping, axis.gap_rad,
        axis.motor_coulomb, axis.motor_stiction, axis.load_coulomb, axis.viscous, axis.pull,
        axis.cogging, axis.bandwidth_hz,
    )  # fmt: skip
    motor, load, torque = _simulate(speed_rad_s, given)
    random = np.random.default_rng(seed)
    place = load / axis.gear
    place = place + axis.eccentric_rad * np.sin(place + axis.phase_rad)
    place = place + axis.second_rad * np.sin(2.0 * place + 1.3 * axis.phase_rad)
    counts = place * axis.counts / TURN + axis.noise_counts * random.standard_normal(place.size)
    torque = torque + axis.torque_noise * random.standard_normal(torque.size)
    shown = np.round(torque / axis.torque_step) * axis.torque_step
    step = TURN / 2**20
    return np.floor(motor / step) * step, np.floor(counts), shown
