"""Axes of known friction and ripple, and the friction map as a job makes it.

Friction falls by 1 - tanh there, and by exp(-(v/vs)^δ) in the tool's model.
"""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import numpy as np

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.foundation.work.jobs import Progress
from backend.tools.mechanics.friction.result import FrictionResult
from backend.tools.mechanics.friction.run import TOOL
from backend.tools.mechanics.friction.settings import FrictionSettings
from backend.tools.tool import Run
from backend.tools.tuning.sweep import profile_speed
from drivers.virtual.mechanics import FrictionSpec, MechanicsSpec, RippleSpec, friction_nm
from tests.virtual.tools.can_rig import can_bench, incremental
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import mechanics, silent

RATED_NM = 1.27

FRICTION = FrictionSpec(
    viscous_nms=3e-4, coulomb_nm=0.04, static_nm=0.06, stribeck_rad_s=4.0, stribeck_law="tanh"
)

RIPPLE = RippleSpec(
    revolution_nm=0.004,
    cogging_nm=0.012,
    cogging_second_nm=0.005,
    cogging_per_rev=24,
    phase_rad=0.4,
)

SMOOTH = mechanics((1e-4, 60.0, 0.006)).model_copy(update={"friction": FRICTION})

RIPPLED = SMOOTH.model_copy(update={"ripple": RIPPLE})

ASKED = FrictionSettings(
    travel_limit=3.0,
    speed_limit=1200.0,
    torque_limit=80.0,
    time_limit_s=50.0,
    speeds=6,
    slowest_rpm=10.0,
    rated_torque_nm=RATED_NM,
)


async def mapped(
    axis: Axis,
    session: CyclicSession,
    asked: FrictionSettings = ASKED,
    progress: Progress | None = None,
) -> FrictionResult:
    """As a job or the command line does it."""
    async with profile_speed.prepared(axis, session, asked.envelope, True):
        found = await TOOL.run(Run(axis, session, progress or silent()), asked)
    return FrictionResult.model_validate(found.model_dump(mode="json"))


@asynccontextmanager
async def under(drive: str, spec: MechanicsSpec) -> AsyncIterator[tuple[Axis, CyclicSession]]:
    if drive == "ds_c":
        async with can_bench(incremental(spec), pace=40.0) as b:
            yield b.axis, b.session
    else:
        async with direct(spec, drive=drive) as d:
            yield d.axis, d.session


def true_percent(spec: MechanicsSpec, rpm: object) -> np.ndarray:
    speed = np.asarray(rpm, float) * 2 * np.pi / 60.0
    return friction_nm(spec, speed) / RATED_NM * 100.0


def largest_error(found: FrictionResult, spec: MechanicsSpec) -> float:
    truth = true_percent(spec, found.curve_speed_rpm)
    return float(np.max(np.abs(np.array(found.curve_percent) / truth - 1.0)))
