"""Soft arms with friction, backlash and a second mode, and command shaping as a job makes it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from backend.tools.tool import Run
from backend.tools.tuning.shaping.result import ShapingResult
from backend.tools.tuning.shaping.run import TOOL
from backend.tools.tuning.shaping.settings import ShapingSettings
from backend.tools.tuning.sweep import profile_speed
from drivers.virtual.mechanics import MechanicsSpec
from tests.virtual.tools.direct import DirectBench
from tests.virtual.tools.rig import silent

FloatArray = npt.NDArray[np.float64]

ASKED = ShapingSettings(
    travel_limit=2.0, speed_limit=900.0, torque_limit=200.0, time_limit_s=60.0, size=1.0,
    speed=600.0, acceleration=6000.0, hold_s=1.5,
)  # fmt: skip


def arm(
    frequency_hz: float,
    *,
    damping: float = 0.01,
    load: float = 1e-4,
    coulomb: float = 0.01,
    backlash: float = 0.0,
    second_hz: float | None = None,
) -> MechanicsSpec:
    """A motor with a soft load: it oscillates at this frequency while the motor is held."""
    stiffness = load * (2 * math.pi * frequency_hz) ** 2
    loads: list[dict[str, float]] = []
    if second_hz is not None:
        first = 5e-5 * (2 * math.pi * second_hz) ** 2
        loads.append(
            {"inertia_kgm2": 5e-5, "stiffness_nm_per_rad": first, "damping_nms_per_rad": 2e-3}
        )
    loads.append(
        {
            "inertia_kgm2": load,
            "stiffness_nm_per_rad": stiffness,
            "backlash_rad": backlash,
            "damping_nms_per_rad": 2 * damping * math.sqrt(stiffness * load),
        }
    )
    return MechanicsSpec.model_validate(
        {
            "motor": {"inertia_kgm2": 5e-5, "rated_torque_nm": 1.27, "rated_speed_rpm": 3000},
            "friction": {"viscous_nms": 2e-4, "coulomb_nm": coulomb},
            "encoder": {"noise_counts": 4.0},
            "load": loads,
        }
    )


class Load:
    """Cycle by cycle the position setpoint, and the speed of the last inertia in rad/s.

    The speed is read from the mechanics, of which the tool sees the motor alone.
    """

    def __init__(self, bench: DirectBench) -> None:
        self._link = bench.link
        self.targets: list[int] = []
        self.speeds: list[float] = []
        bench.link.late = self._look

    def _look(self) -> int:
        servo: Any = self._link.device
        loop = self._link._loop
        assert loop is not None
        self.targets.append(loop.outputs[self._link._written[0x607A]])
        self.speeds.append(float(servo.axis._x[-1]))
        return 0

    def ends(self) -> list[int]:
        """Cycles at which a move has ended, after which the setpoint stands for more than 1 s."""
        moving = np.flatnonzero(np.diff(self.targets))
        last = moving[np.diff(moving, append=len(self.targets)) > 1000]
        return [int(each) + 1 for each in last]

    def left(self, end: int) -> float:
        """Half of peak to peak of the speed from 0.1 to 0.4 s after a move."""
        return 0.5 * float(np.ptp(self.speeds[end + 100 : end + 400]))


async def shape(
    bench: DirectBench, asked: ShapingSettings = ASKED, keep: Any = None, progress: Any = None
) -> ShapingResult:
    """As a job does it, and as the result is stored."""
    run = Run(bench.axis, bench.session, progress or silent(), keep)
    async with profile_speed.prepared(bench.axis, bench.session, asked.envelope, True):
        found = await TOOL.run(run, asked)
    return ShapingResult.model_validate(found.model_dump(mode="json"))


ROUGH = {"coulomb": 0.03, "backlash": 0.002, "second_hz": 60.0}


def zero_crossings_hz(speed: FloatArray) -> float:
    """Frequency of what is left of a signal, by its mean spacing of rising crossings at 1 kHz."""
    about = speed - np.mean(speed)
    rising = np.flatnonzero((about[:-1] < 0.0) & (about[1:] >= 0.0)).astype(float)
    exact = rising + about[rising.astype(int)] / (
        about[rising.astype(int)] - about[rising.astype(int) + 1]
    )
    return 1000.0 / float(np.mean(np.diff(exact)))
