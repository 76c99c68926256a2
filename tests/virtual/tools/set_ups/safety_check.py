"""An axis whose power stage opens, and the safety record as a job makes it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from backend.axes.axis.cyclic_mode import keeping_mode
from backend.tools.tool import Run
from backend.tools.watching.safety_check.result import SafetyResult
from backend.tools.watching.safety_check.run import TOOL
from backend.tools.watching.safety_check.settings import SafetySettings
from drivers.cia402 import State
from drivers.virtual.firmware.cia402.states import State as Firmware
from tests.virtual.tools.direct import DirectBench
from tests.virtual.tools.rig import At, mechanics, silent

RATED_NM, COULOMB_NM = 1.27, 0.1

#: Motor and load on a stiff shaft.
INERTIA = 5e-5 + 1e-4

RPM = 600.0

ASKED = SafetySettings(
    travel_limit=60.0, speed_limit=900.0, torque_limit=100.0, rated_torque_nm=RATED_NM,
    speed_rpm=RPM, wait_s=3.0, watch_s=1.0, nothing_hangs=True, device="S1", person="Ann",
)  # fmt: skip


def stiff() -> Any:
    return mechanics((1e-4, 3000.0, 0.02), coulomb=COULOMB_NM, viscous=0.0)


def off(bench: DirectBench) -> None:
    """The power stage opens and the drive says so: what STO is to do."""
    core, control = bench.link.device.core, bench.link.device.control
    control.modes.end()
    core.axis.power_off()
    control.state = Firmware.SWITCH_ON_DISABLED


def braked(bench: DirectBench) -> None:
    """A controlled stop by a ramp; the power goes at standstill: SS1."""
    control = bench.link.device.control
    control.modes.end()
    bench.link.device.core.axis.stop_ramp(2 * math.pi * RPM / 60.0 / 0.2)
    control.state = Firmware.FAULT_REACTION
    control._after_stop = lambda: off(bench)


async def recorded(
    bench: DirectBench,
    act: Callable[[DirectBench], None] | None,
    asked: SafetySettings = ASKED,
    kept: dict[str, Any] | None = None,
) -> SafetyResult:
    """As a job does it; what is read from files is the same."""
    kept = {} if kept is None else kept

    def keep(name: str, arrays: Mapping[str, object], meta: dict[str, object]) -> None:
        kept.update(arrays=arrays, meta=meta)

    steps = silent()
    if act is not None:
        steps = At("trigger the safety function", lambda: act(bench), 0.35).progress
    async with keeping_mode(bench.axis, bench.session):
        found = await TOOL.run(Run(bench.axis, bench.session, steps, keep), asked)
    assert TOOL.reevaluate(kept["arrays"], kept["meta"]) == found
    assert await bench.axis.state() is not State.OPERATION_ENABLED
    return SafetyResult.model_validate(found.model_dump(mode="json"))
