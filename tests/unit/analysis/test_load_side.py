"""Backlash, stiffness and transmission error of drawn axes, against what they were drawn with.

The axes are integrated from their equations of motion (`two_sided_axis`): bouncing, presliding
friction, a Stribeck curve, cogging, an eccentric encoder, quantised and noisy signals. The moves
are those of the tool, as the tool plans them for such an axis.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from backend.analysis.mechanics.load_side import load_side
from backend.analysis.mechanics.load_side_samples import (
    FewSamples,
    LoadStands,
    unwrapped,
)
from backend.tools.mechanics.load_side.run import Room, planned
from backend.tools.mechanics.load_side.settings import LoadSideSettings
from drivers.errors import OutOfRange
from tests.unit.analysis.two_sided_axis import RATE_HZ, TURN
from tests.unit.analysis.two_sided_cases import (
    Case,
    campaign,
    drawn,
    holds,
    sides_of,
    stiffness_of,
)

pytestmark = pytest.mark.timeout(600)


@pytest.mark.long
def test_backlash_is_within_five_percent_or_two_counts_in_nine_of_ten_axes() -> None:
    found = [(case, each.backlash_rad) for case, each in campaign() if each.backlash_rad]
    assert len(found) >= 40
    off = [
        (case.axis.gap_rad, value)
        for case, value in found
        if abs(value.value - case.axis.gap_rad) > max(0.05 * case.axis.gap_rad, 2 * case.count_rad)
    ]
    assert len(off) <= 0.1 * len(found), off
    assert all(value.value > -value.half for _, value in found)


@pytest.mark.long
def test_stiffness_is_within_ten_percent_in_nine_of_ten_axes() -> None:
    found = [(case, value) for case, each in campaign() if (value := stiffness_of(each))]
    assert len(found) >= 40
    off = [(c.axis.stiffness, v) for c, v in found if abs(v.value / c.axis.stiffness - 1.0) > 0.1]
    assert len(off) <= 0.1 * len(found), off
    assert all(abs(value.value / c.axis.stiffness - 1.0) < 0.25 for c, value in found)


@pytest.mark.long
def test_intervals_hold_the_truth_in_nine_of_ten_axes() -> None:
    gaps = [holds(each.backlash_rad, c.axis.gap_rad) for c, each in campaign() if each.backlash_rad]
    stiff = [
        holds(value, c.axis.stiffness) for c, each in campaign() if (value := stiffness_of(each))
    ]
    assert len(gaps) >= 40
    assert np.mean(gaps) >= 0.9
    assert len(stiff) >= 40
    assert np.mean(stiff) >= 0.9


@pytest.mark.long
def test_the_error_of_an_eccentric_encoder_is_seen_once_per_revolution() -> None:
    for case, found in campaign():
        if not found.whole_revolution:
            continue
        first = dict(found.orders)[1.0]
        truth = case.axis.eccentric_rad * case.axis.gear
        assert first.value == pytest.approx(truth, abs=max(0.05 * truth, 2 * case.count_rad))


def test_friction_that_keeps_the_load_on_its_flank_hides_the_gap() -> None:
    case = drawn(3)
    heavy = replace(
        case.axis,
        gap_rad=5e-3,
        load_coulomb=0.25 * case.rated_nm,
        gear=1.0,
        counts=2**18,
        pull=0.0,
    )
    found = load_side(sides_of(Case(heavy, case.rated_nm), 3), heavy.motor_kgm2)
    truth = 5e-3 + 2.0 * heavy.load_coulomb / heavy.stiffness
    assert found.backlash_rad is None
    assert found.lost_motion_rad.value == pytest.approx(truth, rel=0.05)


def test_a_pull_that_holds_the_flank_leaves_both_open() -> None:
    case = drawn(4)
    hanging = replace(case.axis, pull=0.3 * case.rated_nm, gap_rad=5e-3, counts=2**18)
    found = load_side(sides_of(Case(hanging, case.rated_nm), 4), hanging.motor_kgm2)
    assert found.pulled
    assert found.backlash_rad is None
    assert found.twist_s2 is None


@pytest.mark.long
def test_no_whole_revolution_of_the_load_is_said() -> None:
    case = drawn(5)
    geared = Case(
        replace(case.axis, gear=20.0, gap_rad=6e-3, counts=2**20, pull=0.0), case.rated_nm
    )
    found = load_side(sides_of(geared, 5), None)
    assert not found.whole_revolution
    assert found.load_inertia_kgm2 is None
    assert found.backlash_rad is not None
    assert found.backlash_rad.value == pytest.approx(6e-3, rel=0.05)


def test_counts_that_do_not_follow_are_refused() -> None:
    sides = sides_of(drawn(1), 1)
    stuck = replace(sides, load_counts=np.round(np.sin(np.arange(sides.angle_rad.size))))
    with pytest.raises(LoadStands):
        load_side(stuck, None)
    with pytest.raises(FewSamples):
        load_side(replace(sides, valid=np.zeros_like(sides.valid)), None)


def test_a_counter_that_wraps_goes_on() -> None:
    straight = np.cumsum(np.full(50, 1e8)) + 2.0**31 - 5e8
    wrapped = (straight + 2.0**31) % 2.0**32 - 2.0**31
    np.testing.assert_allclose(np.diff(unwrapped(wrapped)), 1e8)


def test_limits_that_leave_no_room_or_time_are_named() -> None:
    asked = LoadSideSettings(travel_limit=3, speed_limit=1200, torque_limit=80)
    with pytest.raises(OutOfRange) as narrow:
        planned(asked, Room(0.05, 17.0, 90.0, 500.0, 50.0), RATE_HZ)
    assert narrow.value.code == "load-side.no-room"
    with pytest.raises(OutOfRange) as short:
        planned(asked, Room(2.4, 17.0, 20.0, 500.0, 50.0), RATE_HZ)
    assert short.value.code == "load-side.no-time"


def test_the_moves_stay_inside_travel_speed_and_acceleration() -> None:
    asked = LoadSideSettings(travel_limit=3, speed_limit=1200, torque_limit=80, gear_ratio=5.0)
    room = Room(2.4, 17.0, 90.0, 400.0, 50.0)
    plan = planned(asked, room, RATE_HZ)
    for speed in (plan.slow_rpm, plan.moves_rpm):
        place = np.cumsum(speed) / 60.0 / RATE_HZ
        assert np.max(np.abs(place)) <= room.travel_rev
        assert np.max(np.abs(speed)) <= 60.0 * room.speed_rps
        assert abs(place[-1]) < 1e-6
    rise = np.diff(plan.moves_rpm) * TURN / 60.0 * RATE_HZ
    assert np.max(np.abs(rise)) <= 1.05 * room.acceleration_rad_s2
    assert (plan.slow_rpm.size + plan.moves_rpm.size) / RATE_HZ <= room.time_s
