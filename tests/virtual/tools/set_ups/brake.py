"""Axes with a brake of known holding torque, and the brake test as a job makes it."""

from __future__ import annotations

import math
from collections.abc import Mapping

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.tools.mechanics.brake.result import BrakeResult
from backend.tools.mechanics.brake.run import TOOL
from backend.tools.mechanics.brake.settings import BrakeSettings
from backend.tools.tool import Run
from backend.tools.tuning.sweep import profile_speed
from drivers.cia402 import State
from drivers.virtual.mechanics import MechanicsSpec
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import mechanics, settings_of, silent

RATED_NM, COULOMB_NM = 1.27, 0.03

#: One revolution per the torque that a hub of this twist slips at.
WINDUP_REV = 0.004

ASKED = BrakeSettings(rated_torque_nm=RATED_NM, nothing_hangs=True, ramp_s=0.6)

CUT = ASKED.model_copy(update={"brake_supply_cut": True})

#: P01.17 and DO1's function: a brake, and the output for it (000:1360).
M6L = {"2001:12": 1, "2003:10": 18}


def braked(
    holds_nm: float, *, windup_rev: float = 0.0, supplied: bool = True, gravity_nm: float = 0.0
) -> MechanicsSpec:
    spec = mechanics((1e-4, 60.0, 0.006), coulomb=COULOMB_NM, gravity=gravity_nm)
    motor = spec.motor.model_copy(
        update={
            "brake": True,
            "brake_nm": holds_nm,
            "brake_output": True,
            "brake_windup_rad": 2 * math.pi * windup_rev,
            "brake_supplied": supplied,
        }
    )
    return spec.model_copy(update={"motor": motor})


async def brake_of(
    axis: Axis,
    session: CyclicSession,
    asked: BrakeSettings = ASKED,
    kept: dict[str, object] | None = None,
) -> BrakeResult:
    """As a job or the command line does it; what is read from files is the same."""

    def keep(name: str, arrays: Mapping[str, object], meta: dict[str, object]) -> None:
        if kept is not None:
            kept.update(name=name, arrays=arrays, meta=meta)

    async with profile_speed.prepared(axis, session, asked.envelope, True):
        found = await TOOL.run(Run(axis, session, silent(), keep), asked)
    return BrakeResult.model_validate(found.model_dump(mode="json"))


async def on(
    drive: str,
    spec: MechanicsSpec,
    asked: BrakeSettings = ASKED,
    settings: Mapping[str, int] | None = None,
) -> tuple[BrakeResult, DirectBench]:
    async with direct(spec, drive=drive, settings=settings) as bench:
        mode = bench.axis.drive.require("mode")
        before = await settings_of(bench.axis.drive, mode)
        found = await brake_of(bench.axis, bench.session, asked)
        assert await settings_of(bench.axis.drive, mode) == before
        assert await bench.axis.state() is not State.OPERATION_ENABLED
        return found, bench
