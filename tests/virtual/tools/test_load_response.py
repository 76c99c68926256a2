"""The frequency response of the load next to that of the motor, by the drive's own object 60E4h.

Truth follows from the equations of motion of two inertias and a spring; the encoder's scale is not
an input of the tool.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from backend.tools.tool import Run
from backend.tools.tuning.sweep.result import SweepAnswer
from backend.tools.tuning.sweep.run import TOOL
from backend.tools.tuning.sweep.settings import SweepRequest
from drivers.virtual.mechanics import MechanicsSpec
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import silent
from tests.virtual.tools.set_ups.load_side import DRIVE, LOAD, MOTOR, RATED, STIFFNESS, axis

pytestmark = pytest.mark.timeout(600)

CYCLE_S, DAMPING, VISCOUS = 1e-3, 0.01, 2e-4
ASKED = SweepRequest(
    travel_limit=3.0,
    speed_limit=1200.0,
    torque_limit=80.0,
    rated_torque_nm=RATED,
    loop="none",
    realisations=1,
)


def truth(frequency_hz: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Speed of the load over the torque of the motor: (d·s + k)·s over both equations of motion."""
    s = 2j * np.pi * frequency_hz
    spring = STIFFNESS + DAMPING * s
    motor, load = MOTOR * s**2 + VISCOUS * s + spring, LOAD * s**2 + spring
    return np.asarray(s * spring / (motor * load - spring**2))


async def swept(spec: MechanicsSpec, keep: Any = None, asked: SweepRequest = ASKED) -> SweepAnswer:
    async with direct(spec, CYCLE_S, drive=DRIVE) as bench:
        return await TOOL.run(Run(bench.axis, bench.session, silent(), keep), asked)


@pytest.mark.long
async def test_the_response_of_the_load_is_that_of_the_mechanics() -> None:
    kept: dict[str, Any] = {}

    def keep(_name: str, arrays: dict[str, Any], meta: dict[str, object]) -> None:
        kept.update(arrays=arrays, meta=meta)

    # Behind a gear of 2, counting backwards, its counter about to overflow.
    spec = axis(gap=0.0, gear=2.0, inverted=True, offset_counts=2**31 - 5000)
    found = await swept(spec, keep)
    load = found.load
    assert load is not None
    assert load.counts_per_motor_rev == pytest.approx(-(2**17) / 2, rel=0.01)
    f = np.array(load.frequency_hz)
    true = truth(f)
    low, high = load.valid_band_hz
    # Beyond the resonance the load hardly moves: a count of its encoder is more.
    use = (f >= low) & (f <= high) & (np.array(load.coherence) > 0.9)
    assert f[use][0] < 8.0
    assert f[use][-1] > 200.0
    off_db = np.array(load.magnitude_db) - 20 * np.log10(np.abs(true))
    off_deg = np.angle(np.exp(1j * (np.radians(load.phase_deg) - np.angle(true))), deg=True)
    assert np.median(np.abs(off_db[use])) < 0.3
    for off, std in ((off_db, load.std_db), (off_deg, load.std_deg)):
        inside = np.abs(off) <= 1.96 * np.array(std, dtype=np.float64)
        assert np.mean(inside[use]) > 0.93
    again = TOOL.reevaluate(kept["arrays"], kept["meta"])
    assert again.load == load
    # A file of an older version, or of a drive without the encoder.
    old = {name: value for name, value in kept["arrays"].items() if "load" not in name}
    assert len(old) < len(kept["arrays"])
    assert TOOL.reevaluate(old, kept["meta"]).load is None


@pytest.mark.long
async def test_an_encoder_that_does_not_follow_is_said_and_not_shown() -> None:
    spec = axis(gap=0.0, counts_per_rev=16)
    loose = {"stiffness_nm_per_rad": 1e-6, "damping_nms_per_rad": 0.0}
    # The motor alone is faster than with its load.
    asked = ASKED.model_copy(update={"speed_limit": 2500.0, "travel_limit": 8.0})
    alone = spec.model_copy(update={"load": (spec.load[0].model_copy(update=loose),)})
    found = await swept(alone, asked=asked)
    assert found.load is None
    codes = [each.code for each in found.warning_messages]
    assert "sweep.load-does-not-follow" in codes


@pytest.mark.long
async def test_without_a_second_encoder_nothing_is_said_of_the_load() -> None:
    found = await swept(axis(gap=0.0).model_copy(update={"load_encoder": None}))
    assert found.load is None
    codes = [each.code for each in found.warning_messages]
    assert "sweep.load-does-not-follow" not in codes
