"""Frequency response and autotune over EtherCAT frames against the analytic mechanics.

Limits are those of `tuning.md`, sections 2, 3 and 5; more mechanics are in `test_families`.
"""

from __future__ import annotations

import pytest

from backend.records.library.measurements import pack, unpack
from backend.station.evaluation import recompute
from backend.tools.measuring.temporary import put_back
from backend.tools.tuning.autotune.run import AutotuneSettings, autotune
from backend.tools.tuning.sweep.evaluation import SweepSettings
from backend.tools.tuning.sweep.run import sweep
from backend.tools.tuning.sweep.stored import answer_of
from drivers.virtual.wires.netns import Namespace
from tests.virtual.tools.rig import AMPLE_S, WIDE, bench, errors, mechanics, silent

TWO = mechanics((1e-4, 20.0, 0.002), (5e-5, 100.0, 0.005))
ONE = mechanics((1e-4, 60.0, 0.006))


@pytest.mark.long
async def test_mechanics_without_a_loop_at_1_khz(namespace: Namespace) -> None:
    kept: list[tuple] = []
    async with bench(namespace, TWO) as b:
        before = await b.values()
        found = await sweep(
            b.axis, b.session, SweepSettings(WIDE), silent(), lambda *raw: kept.append(raw)
        )
        assert await b.values() == before
        assert found.loop == "none"
        direct, model = errors(found.direct, TWO, 5, 250), errors(found.frf, TWO, 250, 400)
        assert direct.magnitude_db < 0.3
        assert direct.phase_deg < 2.0
        assert model.magnitude_db < 0.6
        assert model.phase_deg < 4.0
        assert min(direct.covered, model.covered) >= 0.9
        assert found.motion_s <= 10.0
        # 1/sqrt(J·k) by hand is not exact for a chain: the poles of the chain itself.
        first = next(r for r in found.resonances if r.kind == "resonance")
        assert first.frequency_hz == pytest.approx(114.7, rel=0.01)
        # What was kept gives the same answer again, through a file.
        kind, arrays, meta = kept[0]
        from datetime import UTC, datetime

        file = pack(kind, b.axis.drive, arrays, meta, datetime.now(UTC))
        assert recompute(unpack(file)) == answer_of(found).model_dump(mode="json")


async def test_mechanics_beside_the_speed_loop_at_4_khz(namespace: Namespace) -> None:
    async with bench(namespace, ONE, 2.5e-4) as b:
        before = await b.values()
        found = await sweep(
            b.axis, b.session, SweepSettings(WIDE, loop="speed", realisations=1), silent()
        )
        assert await b.values() == before
        near = errors(found.frf, ONE, 5, 1000)
        assert near.magnitude_db < 0.3
        assert near.phase_deg < 3.0


@pytest.mark.long
async def test_autotune_keeps_its_promise_and_can_be_undone(namespace: Namespace) -> None:
    async with bench(namespace, ONE, 5e-4) as b:
        before = await b.values()
        # One grant for the whole of it, as a job holds.
        with b.axis.granted("autotune"):
            result = await autotune(
                b.axis, b.session, AutotuneSettings(WIDE, budget_s=AMPLE_S), silent()
            )
        assert result.applied is not None
        assert result.verified is not None
        predicted, measured = (
            result.verified.predicted_bandwidth_hz,
            result.verified.measured_bandwidth_hz,
        )
        assert predicted is not None
        assert measured == pytest.approx(predicted, rel=0.1)
        nominal, found = result.applied.nominal, result.verified.sweep.margins
        assert found["phase_margin_deg"] == pytest.approx(nominal.phase_margin_deg, abs=6.0)
        assert found["ms"] <= result.applied.guaranteed.ms * 1.1
        changed = {k for k, v in (await b.values()).items() if v != before[k]}
        assert {"2005:03", "2001:06"} <= changed <= set(result.before)
        await put_back(b.axis, result.before)
        assert await b.values() == before
