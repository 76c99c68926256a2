"""Motors that are connected wrongly, and the first power on them as a job makes it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from backend.axes.axis.cyclic_mode import keeping_mode
from backend.tools.mechanics.first_power.result import FirstPowerResult
from backend.tools.mechanics.first_power.run import TOOL
from backend.tools.mechanics.first_power.settings import FirstPowerSettings
from backend.tools.tool import Run
from drivers.virtual.firmware.axis import VirtualAxis
from drivers.virtual.mechanics import MechanicsSpec, PhaseSpec
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import At, mechanics, silent

RATED_NM = 1.27

ASKED = FirstPowerSettings(rated_torque_nm=RATED_NM, nothing_hangs=True)

RIGHT = PhaseSpec()

#: Four pole pairs: exchanged phases have one sign over 1/16 rev.
FAMILIES = ("mms7", "r6l", "ep3e", "m6l")


def motor(
    phases: PhaseSpec = RIGHT,
    *,
    inverted: bool = False,
    counted: float = 1.0,
    brake: bool = False,
    gravity: float = 0.0,
) -> MechanicsSpec:
    spec = mechanics((1e-4, 60.0, 0.006), gravity=gravity)
    encoder = spec.encoder.model_copy(update={"inverted": inverted, "counted_share": counted})
    turned = spec.motor.model_copy(update={"brake": brake, "brake_supplied": not brake})
    return spec.model_copy(update={"phases": phases, "encoder": encoder, "motor": turned})


async def first_power(
    bench: DirectBench,
    asked: FirstPowerSettings = ASKED,
    progress: At | None = None,
    kept: dict[str, Any] | None = None,
) -> FirstPowerResult:
    """As a job or the command line does it; what is read from files is the same."""

    def keep(name: str, arrays: Mapping[str, object], meta: dict[str, object]) -> None:
        if kept is not None:
            kept.update(name=name, arrays=arrays, meta=meta)

    steps = silent() if progress is None else progress.progress
    async with keeping_mode(bench.axis, bench.session):
        found = await TOOL.run(Run(bench.axis, bench.session, steps, keep), asked)
    return FirstPowerResult.model_validate(found.model_dump(mode="json"))


def shaft(bench: DirectBench) -> VirtualAxis:
    return bench.link.device.core.axis


def shaft_rev(bench: DirectBench) -> float:
    """The true angle of the shaft, whatever its encoder counts."""
    return float(shaft(bench)._x[0]) / (2 * math.pi)


def finding(result: FirstPowerResult, name: str) -> tuple[str, str]:
    return next((each.status, each.finding) for each in result.checks if each.name == name)


async def by_hand(
    spec: MechanicsSpec, turned_rev: float, asked: FirstPowerSettings, drive: str = "r6l"
) -> tuple[FirstPowerResult, DirectBench]:
    """A person turns the shaft when asked to."""
    async with direct(spec, drive=drive) as bench:
        turn = At("by hand", lambda: shaft(bench).place(2 * math.pi * turned_rev), 0.06)
        found = await first_power(bench, asked, turn)
        assert turn.done
        return found, bench


HAND = ASKED.model_copy(update={"hand_turn": True, "hand_time_s": 10.0})
