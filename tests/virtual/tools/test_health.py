"""A baseline, then a loose coupling and a worn belt: planted in the mechanics, found and named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from backend.health.compare import Finding, compare
from backend.health.records import AxisOf, HealthRecords
from backend.health.words import message_of
from backend.store.database import Store
from backend.tools.health.result import HealthResult
from backend.tools.health.run import TOOL
from backend.tools.health.settings import HealthSettings
from backend.tools.tool import Arrays, Meta, Run
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
        viscous_nms=VISCOUS * friction, coulomb_nm=COULOMB * friction,
        static_nm=0.05 * friction, stribeck_rad_s=4.0, stribeck_law="tanh",
    )  # fmt: skip
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


@pytest.mark.timeout(300)
async def test_a_loose_coupling_and_a_worn_belt_are_found(tmp_path: Path) -> None:
    healthy = await checked(axis_of(), 3)
    first = {each.quantity: each.value for each in healthy.rounds[0].values}
    assert first["resonance"] == pytest.approx(resonance_hz(), rel=0.02)
    records = HealthRecords(Store(tmp_path), "hall 3")
    runs = records.add(AXIS, ASKED, healthy.rounds, {"a.sdmeas": "0" * 64}, "Ann")
    records.sign(AXIS.key, runs, "Ann")

    loose = await checked(axis_of(stiffness=0.7), 2)
    records.add(AXIS, ASKED, loose.rounds, {"b.sdmeas": "1" * 64}, "Ben")
    found = changed(records.condition(AXIS).findings)
    records._store.close()
    assert set(found) == {"resonance 1"}, "friction is what it was"
    assert found["resonance 1"].change == pytest.approx(np.sqrt(0.7) - 1, abs=0.02)
    words = message_of(found["resonance 1"])
    assert "as with a stiffness changed by -" in words.words("en")
    step = words.remedy()
    assert step is not None
    assert "check the coupling" in step.words("en")
    assert "联轴器" in step.words("zh")

    worn = await checked(axis_of(friction=1.2), 2, response=False)
    found = changed(compare(healthy.rounds, worn.rounds))
    assert set(found) == {"friction 1"}
    assert found["friction 1"].direction == "higher"
    assert found["friction 1"].change == pytest.approx(0.2, abs=0.04)
    step = message_of(found["friction 1"]).remedy()
    assert step is not None
    assert "belt" in step.words("en")
