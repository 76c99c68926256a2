"""An axis with an encoder at its load, and the measurement of both sides as a job makes it."""

from __future__ import annotations

from typing import Any

from backend.tools.mechanics.load_side.result import LoadSideResult
from backend.tools.mechanics.load_side.run import TOOL
from backend.tools.mechanics.load_side.settings import LoadSideSettings
from backend.tools.tool import Run
from drivers.virtual.mechanics import MechanicsSpec
from tests.virtual.tools.direct import DirectBench
from tests.virtual.tools.rig import silent

MOTOR, LOAD, STIFFNESS, GAP, RATED = 5e-5, 1.5e-4, 60.0, 0.004, 1.27

DRIVE, CYCLE_S = "generic402", 2e-3

#: 60A9h and 60AAh of this drive state increments; 6076h states its rated torque.
ASKED = LoadSideSettings(
    travel_limit=3.0,
    speed_limit=1200.0,
    torque_limit=80.0,
    time_limit_s=90.0,
    rated_torque_nm=RATED,
    motor_inertia_kgm2=MOTOR,
)


def axis(gap: float = GAP, **encoder: Any) -> MechanicsSpec:
    return MechanicsSpec.model_validate({
        "motor": {"inertia_kgm2": MOTOR, "rated_torque_nm": RATED, "rated_speed_rpm": 3000},
        "friction": {
            "viscous_nms": 2e-4, "coulomb_nm": 0.03, "static_nm": 0.04, "load_coulomb_nm": 0.01,
        },
        "ripple": {"cogging_nm": 0.004, "revolution_nm": 0.002},
        "encoder": {"noise_counts": 2},
        "load": [{
            "inertia_kgm2": LOAD, "stiffness_nm_per_rad": STIFFNESS,
            "damping_nms_per_rad": 0.01, "backlash_rad": gap,
        }],
        "load_encoder": {
            "counts_per_rev": 2**17, "eccentricity_rad": 1e-3, "second_rad": 2e-4,
            "phase_rad": 0.7, "noise_counts": 0.3, **encoder,
        },
    })  # fmt: skip


async def measured(
    bench: DirectBench, asked: LoadSideSettings = ASKED, **run: Any
) -> LoadSideResult:
    found = await TOOL.run(Run(bench.axis, bench.session, silent(), **run), asked)
    return LoadSideResult.model_validate(found.model_dump(mode="json"))
