"""Measurements and tuning on virtual drives of several families, without a wire.

The same tools as over EtherCAT frames (see `test_accuracy`), on more mechanics than frames leave
time for; limits are those of `tuning.md`, truth is the analytic response of the chain.
"""

from __future__ import annotations

import pytest
from pydantic import TypeAdapter

from backend.commands.measuring.tools import lines_of
from backend.tools.measuring.temporary import put_back
from backend.tools.mechanics.inertia.evaluation import InertiaSettings, answer_of
from backend.tools.mechanics.inertia.run import TOOL as INERTIA
from backend.tools.mechanics.inertia.run import inertia
from backend.tools.results import ToolOutcome
from backend.tools.tuning.autotune.result import AutotuneAnswer
from backend.tools.tuning.autotune.run import AutotuneResult, AutotuneSettings, autotune
from backend.tools.tuning.autotune.tool import answer_of as answer_of_autotune
from backend.tools.tuning.notch.meaning import meaning_of
from backend.tools.tuning.sweep.evaluation import SweepSettings
from backend.tools.tuning.sweep.run import sweep
from drivers.virtual.mechanics import MechanicsSpec, PlaceSpec
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import AMPLE_S, WIDE, errors, mechanics, silent

ONE = mechanics((1e-4, 60.0, 0.006))
SOFT = mechanics((5e-4, 12.0, 0.03), viscous=5e-4, coulomb=0.05)
# Its antiresonance lies in the band of 1 kHz sampling, its resonance at three times that rate.
FAR = mechanics((1e-3, 6e3, 0.06), coulomb=0.04)
THREE = mechanics((1e-4, 20.0, 0.002), (5e-5, 100.0, 0.005), (3e-5, 150.0, 0.004))
LIMITED = mechanics((1e-4, 200.0, 0.005), travel=(-1.2, 0.8))
HEAVY = mechanics((3e-3, 300.0, 0.05), viscous=1e-3, coulomb=0.06)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    ("drive", "spec", "khz"),
    [
        ("mms7", FAR, 1.0),
        ("mms7", THREE, 4.0),
        ("m6l", ONE, 1.0),
        ("r6l", ONE, 1.0),
        ("el7", ONE, 1.0),  # the worked example of a profile
    ],
)
async def test_mechanics_of_every_family(drive: str, spec: MechanicsSpec, khz: float) -> None:
    async with direct(spec, 1e-3 / khz, drive=drive) as b:
        found = await sweep(b.axis, b.session, SweepSettings(WIDE), silent())
    assert found.trusted
    assert found.motion_s <= 10.0
    near = errors(found.direct, spec, 5, 250 * khz)
    assert near.magnitude_db < 0.3
    assert near.phase_deg < (2.0 if khz == 1 else 3.0)
    assert near.covered >= 0.9


@pytest.mark.long
@pytest.mark.parametrize("loop", ["speed", "position"])
async def test_mechanics_beside_a_closed_loop(loop: str) -> None:
    async with direct(ONE) as b:
        found = await sweep(b.axis, b.session, SweepSettings(WIDE, loop=loop), silent())  # type: ignore[arg-type]
    near = errors(found.frf, ONE, 5, 200)
    assert near.magnitude_db < 0.4
    assert near.phase_deg < 3.0
    assert near.covered >= 0.9


@pytest.mark.long
@pytest.mark.parametrize(
    ("drive", "spec", "limit"),
    [("mms7", SOFT, 0.02), ("mms7", HEAVY, 0.05), ("m6l", ONE, 0.02), ("r6l", ONE, 0.02)],
)
async def test_inertia_of_every_family(drive: str, spec: MechanicsSpec, limit: float) -> None:
    async with direct(spec, drive=drive) as b:
        found = (await inertia(b.axis, b.session, InertiaSettings(WIDE), silent())).result
    assert found.reasons == ()
    assert found.inertia_kgm2.value == pytest.approx(spec.total_inertia_kgm2, rel=limit)
    assert found.coulomb_nm.value == pytest.approx(spec.friction.coulomb_nm, rel=0.1)


@pytest.mark.long
async def test_inertia_between_ends_that_are_found() -> None:
    async with direct(LIMITED) as b:
        before = await _raws(b)
        settings = InertiaSettings(WIDE, "limited", repetitions=2, search_speed_rpm=60.0)
        found = await inertia(b.axis, b.session, settings, silent())
        assert await _raws(b) == before
        assert found.ends_rev == pytest.approx((-1.2, 0.8), abs=0.02)
        assert found.result.inertia_kgm2.value == pytest.approx(1.5e-4, rel=0.02)
        # The drive holds the rotor's inertia, 5e-5 kg·m², from the factory.
        assert found.result.load_ratio == pytest.approx(2.0, rel=0.03)
        units = await b.axis.units()
        assert abs(units.position(await b.axis.position_raw())) < 0.05


@pytest.mark.long
@pytest.mark.parametrize("drive", ["mms7", "m6l", "r6l", "el7"])
async def test_autotune_of_a_family_and_back(drive: str) -> None:
    # M6-L does not report its motor's inertia, which its inertia ratio counts in.
    settings = AutotuneSettings(
        WIDE, budget_s=AMPLE_S, motor_inertia_kgm2=None if drive == "mms7" else 5e-5
    )
    async with direct(ONE, 5e-4, drive=drive) as b:
        # One grant for the whole of it, as a job holds.
        with b.axis.granted("autotune"):
            result = await autotune(b.axis, b.session, settings, silent())
        assert result.applied is not None
        assert result.verified is not None
        # A resonance at 213.5 Hz limits it.
        assert result.applied.notches
        # What width and depth of the notches mean was measured where no manual prints it.
        assert (meaning_of(b.axis.drive) is None) is (drive == "mms7")
        assert _moving_s(result) < 60.0
        found, guaranteed = result.verified.sweep.margins, result.verified.guaranteed
        assert isinstance(found["phase_margin_deg"], float)
        assert found["phase_margin_deg"] >= guaranteed.phase_margin_deg - 1.0
        assert isinstance(found["ms"], float)
        assert found["ms"] <= guaranteed.ms * 1.03
        assert result.verified.measured_bandwidth_hz == pytest.approx(
            result.applied.bandwidth_hz, rel=0.1
        )
        await put_back(b.axis, result.before)
        for key, raw in result.before.items():
            assert await b.axis.drive.raw(key) == raw
        published = TypeAdapter[ToolOutcome](ToolOutcome).validate_json(
            answer_of_autotune(result).model_dump_json()
        )
        assert isinstance(published, AutotuneAnswer)
        assert published.before == result.before
        assert published.mechanics.kind == "mechanics"


def _moving_s(result: AutotuneResult) -> float:
    """Axis time of the parts, a notch's trials of two seconds each included."""
    assert result.verified is not None
    trials = 8 * 2.2
    return (
        result.inertia.motion_s
        + result.mechanics.motion_s
        + trials
        + result.verified.sweep.motion_s
        + 1.0
    )


async def _raws(b: DirectBench) -> dict[str, int]:
    keys = ["2001:06", "2005:01", "2005:03", "2005:04", "2008:01", *_limits(b)]
    return {key: await b.axis.drive.raw(key) for key in keys}


def _limits(b: DirectBench) -> list[str]:
    roles = ("torque_limit_positive", "torque_limit_negative", "max_torque")
    return [key for role in roles if (key := b.axis.drive.key(role)) is not None]


@pytest.mark.long
@pytest.mark.parametrize(
    ("drive", "place"),
    [
        # A load out of balance on the shaft, and an arm behind a gear whose weight grows.
        ("mms7", PlaceSpec(torque_nm=0.2, at_rev=0.1)),
        ("r6l", PlaceSpec(torque_nm=0.3, period_rev=50.0)),
    ],
)
async def test_a_load_that_pulls_by_its_place_is_no_inertia(drive: str, place: PlaceSpec) -> None:
    spec = ONE.model_copy(update={"place": place})
    async with direct(spec, drive=drive) as b:
        outcome = await inertia(b.axis, b.session, InertiaSettings(WIDE), silent())
    found, answer = outcome.result, answer_of(outcome)
    assert found.reasons == ()
    assert found.inertia_kgm2.value == pytest.approx(spec.total_inertia_kgm2, rel=0.02)
    assert found.coulomb_nm.value == pytest.approx(spec.friction.coulomb_nm, rel=0.1)
    assert found.load_terms.place_nm > 0.02
    assert answer.place_nm == found.load_terms.place_nm
    assert answer.fan_nm is None
    reported = lines_of(INERTIA, answer)
    assert any("Position-dependent torque" in line for line in reported)
    assert not any("fan, pump" in line for line in reported)
