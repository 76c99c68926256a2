"""A rigid axis that a controller moves in cycles, and its torque by the equation of motion."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from backend.axes.axis.axis import Envelope
from backend.tools.measuring.axis_facts import read_facts
from backend.tools.mechanics.inertia.moves import speed_move
from drivers.virtual.mechanics import MechanicsSpec
from tests.virtual.tools.direct import DirectBench

FloatArray = npt.NDArray[np.float64]

RATED_NM, INERTIA, COULOMB, VISCOUS = 1.27, 4e-4, 0.05, 3e-4

SPEED_RPM, RAMP_S, HOLD_S, STAND_S = 900.0, 0.2, 0.15, 0.25

#: Of the controller, not of the tool.
ROOM = Envelope(travel_rev=8.0, speed_rpm=1500.0, torque_percent=150.0, time_s=60.0)

PERIOD_S = 2 * (2 * RAMP_S + HOLD_S + STAND_S)

RPM = 2 * math.pi / 60.0


def rigid() -> MechanicsSpec:
    return MechanicsSpec.model_validate({
        "motor": {"inertia_kgm2": INERTIA, "rated_torque_nm": RATED_NM, "rated_speed_rpm": 3000},
        "friction": {"viscous_nms": VISCOUS, "coulomb_nm": COULOMB},
    })  # fmt: skip


def speeds() -> FloatArray:
    """One period to and fro in rpm, 1 kHz; ramps are raised cosines, which the loop follows."""
    up = 0.5 - 0.5 * np.cos(np.pi * np.arange(round(RAMP_S * 1000)) / (RAMP_S * 1000))
    one = np.concatenate(
        [up, np.ones(round(HOLD_S * 1000)), up[::-1], np.zeros(round(STAND_S * 1000))]
    )
    return SPEED_RPM * np.concatenate([one, -one])


def torques_nm(time_s: FloatArray, speed_rpm: FloatArray) -> FloatArray:
    """J·α + Coulomb + viscous friction of the speeds that the axis really had."""
    even = np.convolve(speed_rpm * RPM, np.ones(5) / 5.0, mode="same")
    standing = np.abs(even) < 1.0
    friction = np.where(standing, 0.0, COULOMB * np.sign(even) + VISCOUS * even)
    return np.asarray(INERTIA * np.gradient(even, time_s) + friction)


async def machine(bench: DirectBench, cycles: int) -> None:
    """The controller: it moves the axis and has no data of who reads."""
    facts = await read_facts(bench.axis)
    await speed_move(
        bench.axis, bench.session, np.tile(speeds(), cycles), ROOM, facts, lambda _x: None
    )
