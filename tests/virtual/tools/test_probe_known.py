"""A first look at an axis whose inertia was measured before begins where it shows something."""

from __future__ import annotations

from typing import Any

import pytest

from backend.tools.measuring import recording
from backend.tools.measuring.axis_facts import read_facts
from backend.tools.mechanics.inertia import probe
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import WIDE, mechanics

#: 61 times the motor.
HEAVY = mechanics((3e-3, 300.0, 0.05), viscous=1e-3, coulomb=0.06)


async def test_a_known_inertia_saves_half_of_the_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    played = recording.play
    peaks: list[float] = []

    async def noted(axis: Any, session: Any, sequence: Any, *rest: Any) -> Any:
        peaks.append(float(max(abs(sequence.values))) / 1000.0)
        return await played(axis, session, sequence, *rest)

    monkeypatch.setattr(probe, "play", noted)
    rated_nm = HEAVY.motor.rated_torque_nm
    async with direct(HEAVY, drive="r6l") as b:
        facts, home = await read_facts(b.axis), await b.axis.position_raw()
        careful = await probe.probe_axis(b.axis, b.session, WIDE, facts, home)
        slow, peaks[:] = list(peaks), []
        known = await probe.probe_axis(
            b.axis, b.session, WIDE, facts, home, HEAVY.total_inertia_kgm2
        )
    assert slow[0] == pytest.approx(0.02, abs=0.001)
    # 6 rad/s by half a sine of 0.07 s take J·6·π/(2·0.07): 0.41 Nm, and it begins with half of it.
    half = 0.5 * HEAVY.total_inertia_kgm2 * 6.0 * 3.14159 / 2.0 / 0.07 / rated_nm
    assert peaks[0] == pytest.approx(half, abs=0.001)
    assert peaks[0] < 0.25
    assert len(peaks) <= len(slow) - 2
    assert known.inertia_kgm2 == pytest.approx(careful.inertia_kgm2, rel=0.1)
