"""The mechanics calculator against the worked examples of the manuals and plain geometry."""

from __future__ import annotations

import math

import pytest

from backend.axes.scales.gear_calculator import GearPlan, Mechanics, plan_gear
from drivers.errors import OutOfRange
from profiles import load_profile

_23_BIT = 8388608


def raws(plan: GearPlan) -> dict[str, int]:
    return {value.parameter.key: value.raw for value in plan.values}


def test_ep3e_ball_screw_of_the_manual() -> None:
    # 001:1028 to 001:1045: 8 mm pitch, 17 bits, 0.001 mm: feed 8000, gear 1:1.
    screw = Mechanics(kind="screw", lead_mm=8, resolution=0.001)
    plan = plan_gear(load_profile("ep3e"), screw, 131072)
    assert raws(plan) == {"6091:01": 1, "6091:02": 1, "6092:01": 8000, "6092:02": 1}
    assert plan.reached == 8000


def test_ep3e_indexing_table_of_the_manual() -> None:
    # 001:1047 to 001:1060: reduction 1/3, 0.1°: feed 3600, 3 motor to 1 shaft revolutions.
    table = Mechanics(kind="rotary", motor_turns=3, load_turns=1, resolution=0.1)
    plan = plan_gear(load_profile("ep3e"), table, _23_BIT)
    assert raws(plan) == {"6091:01": 3, "6091:02": 1, "6092:01": 3600, "6092:02": 1}
    # Its ratio of 6990 breaks the manual's own bound of 1000: reported, not refused.
    assert "Err80" in plan.warnings[0].words()


def test_ep3e_belt_of_the_manual() -> None:
    # 001:1062: roller of 200 mm, 1/10, 0.01 mm: 62800 with 3.14 for π.
    belt = Mechanics(kind="belt", diameter_mm=200, motor_turns=10, resolution=0.01)
    plan = plan_gear(load_profile("ep3e"), belt, _23_BIT)
    found = raws(plan)
    assert (found["6091:01"], found["6091:02"]) == (10, 1)
    assert found["6092:01"] / found["6092:02"] == pytest.approx(math.pi * 200 / 0.01, rel=1e-9)


def test_m6l_screw_of_the_manual() -> None:
    # 000:1322: 5 mm lead, 0.001 mm: 5000 command units per revolution of the load.
    plan = plan_gear(load_profile("m6l"), Mechanics(kind="screw", lead_mm=5), None)
    assert raws(plan) == {"2005:06": 5000, "6091:01": 1, "6091:02": 1}


def test_m6l_takes_the_rest_of_an_uneven_ratio_into_6091() -> None:
    # Motor 3 to load 7: 5000 · 7/3 units per motor revolution is not whole.
    screw = Mechanics(kind="screw", lead_mm=5, motor_turns=3, load_turns=7)
    plan = plan_gear(load_profile("m6l"), screw, None)
    assert raws(plan) == {"2005:06": 35000, "6091:01": 3, "6091:02": 1}
    assert plan.error_ppm == 0


def test_m6l_refuses_what_its_manual_forbids() -> None:
    # 000:1277: 0.001 < B/A < 30000 of encoder pulses to command units.
    with pytest.raises(OutOfRange, match=r"Er\.061") as refused:
        plan_gear(load_profile("m6l"), Mechanics(kind="screw", lead_mm=5, resolution=0.1), None)
    assert refused.value.limit == "0.001 to 30000"


def test_r6l_ratio_is_encoder_increments_over_user_increments() -> None:
    # 002:2557; 131072 / 8000 = 2048 / 125, with a 23-bit encoder 64 times as much.
    profile = load_profile("r6l")
    screw = Mechanics(kind="screw", lead_mm=8)
    assert raws(plan_gear(profile, screw, None)) == {"6091:01": 2048, "6091:02": 125}
    assert raws(plan_gear(profile, screw, _23_BIT)) == {"6091:01": 131072, "6091:02": 125}


def test_a_gear_of_sixteen_bits_is_rounded_and_reported() -> None:
    belt = Mechanics(kind="belt", diameter_mm=200, motor_turns=10, resolution=0.01)
    plan = plan_gear(load_profile("ds_c"), belt, None)
    found = raws(plan)
    assert all(1 <= raw <= 65535 for raw in found.values())
    wanted = math.pi * 200 / 0.01 / 10
    assert plan.reached == pytest.approx(10000 * found["2301:00"] / found["2300:00"])
    assert plan.error_ppm == pytest.approx((plan.reached / wanted - 1) * 1e6, rel=1e-3)
    assert any("cannot be set exactly" in each.words() for each in plan.warnings)


@pytest.mark.parametrize(
    ("mechanics", "travel"),
    [
        (Mechanics(kind="screw", lead_mm=10), 10),
        (Mechanics(kind="screw", lead_mm=10, motor_turns=5, load_turns=2), 4),
        (Mechanics(kind="belt", pitch_mm=5, teeth=24), 120),
        (Mechanics(kind="belt", diameter_mm=50), math.pi * 50),
        (Mechanics(kind="rack", module_mm=2, teeth=20), math.pi * 40),
        (Mechanics(kind="rack", pitch_mm=5, teeth=30), 150),
        (Mechanics(kind="rotary", motor_turns=100), 3.6),
    ],
)
def test_travel_of_a_motor_turn(mechanics: Mechanics, travel: float) -> None:
    assert float(mechanics.travel_per_motor_turn()) == pytest.approx(travel, rel=1e-9)


def test_what_follows_from_a_plan() -> None:
    plan = plan_gear(load_profile("mms7"), Mechanics(kind="screw", lead_mm=10), 65536)
    assert plan.unit == "mm"
    assert plan.encoder_travel == pytest.approx(10 / 65536)
    assert plan.range_travel == pytest.approx(2**31 * 0.001)
    assert plan.warnings == ()


def test_an_increment_finer_than_the_encoder_is_reported() -> None:
    plan = plan_gear(load_profile("ds_c"), Mechanics(kind="screw", lead_mm=20), None)
    assert any("finer than the encoder" in each.words() for each in plan.warnings)


def test_a_missing_dimension_is_named() -> None:
    with pytest.raises(OutOfRange, match="pitch mm is missing"):
        plan_gear(load_profile("mms7"), Mechanics(kind="rack", teeth=20), None)
    with pytest.raises(OutOfRange, match="lead mm"):
        plan_gear(load_profile("mms7"), Mechanics(kind="screw"), None)


def test_a_family_without_a_gear_is_refused() -> None:
    profile = load_profile("mms7")
    bare = profile.model_copy(
        update={"units": profile.units.model_copy(update={"gear_numerator": None})}
    )
    with pytest.raises(OutOfRange, match="no electronic gear"):
        plan_gear(bare, Mechanics(kind="rotary"), None)
