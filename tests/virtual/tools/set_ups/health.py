"""An axis that loosens and wears, and its health check as a job makes it."""

from __future__ import annotations

import numpy as np

from backend.tools.tool import Arrays, Meta, Run
from backend.tools.watching.health.result import HealthResult
from backend.tools.watching.health.run import TOOL
from backend.tools.watching.health.settings import HealthSettings
from backend.tools.watching.trend.compare import Finding
from backend.tools.watching.trend.records import AxisOf
from drivers.virtual.mechanics import FrictionSpec, MechanicsSpec
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import mechanics, silent

STIFFNESS, COULOMB, VISCOUS = 60.0, 0.04, 3e-4

MOTOR, LOAD = 5e-5, 1e-4

ASKED = HealthSettings(
    travel_limit=3.0, speed_limit=900.0, torque_limit=80.0, time_limit_s=40.0, speeds=3,
    slowest_rpm=60.0, rated_torque_nm=1.27, rounds=3, inertia=False,
)  # fmt: skip

AXIS = AxisOf("2e1-30-7", "X", "mms7", 0x2E1, 0x30, None, 7)


def axis_of(stiffness: float = 1.0, friction: float = 1.0) -> MechanicsSpec:
    """Friction falls by 1 - tanh towards Coulomb's, which no model of the tools is."""
    spec = mechanics((LOAD, STIFFNESS * stiffness, 0.006))
    worn = FrictionSpec(
        viscous_nms=VISCOUS * friction,
        coulomb_nm=COULOMB * friction,
        static_nm=0.05 * friction,
        stribeck_rad_s=4.0,
        stribeck_law="tanh",
    )
    return spec.model_copy(update={"friction": worn})


def resonance_hz(stiffness: float = 1.0) -> float:
    """Of two inertias and a spring."""
    return float(np.sqrt(STIFFNESS * stiffness * (1 / MOTOR + 1 / LOAD)) / (2 * np.pi))


async def checked(spec: MechanicsSpec, rounds: int, *, response: bool = True) -> HealthResult:
    kept: list[tuple[Arrays, Meta]] = []
    asked = {"rounds": rounds, "response": response}

    def keep(name: str, arrays: Arrays, meta: Meta) -> None:
        if name == "health":
            kept.append((arrays, meta))

    async with direct(spec) as d:
        run = Run(d.axis, d.session, silent(), keep)
        found = await TOOL.run(run, ASKED.model_copy(update=asked))
    (stored,) = kept
    assert TOOL.reevaluate(*stored) == found, "what is stored says the same"
    return found


def changed(found: tuple[Finding, ...] | list[Finding]) -> dict[str, Finding]:
    return {f"{each.quantity} {each.number}": each for each in found if each.code == "changed"}
