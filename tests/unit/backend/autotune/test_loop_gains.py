"""Gains and filters of the drives' loops as raw values, and what is said where there are none.

Corners by hand: a time constant of T is a corner of 1/(2π·T); 0.8 ms are 198.9 Hz.
"""

from __future__ import annotations

import math

import pytest

from backend.analysis.loop.loop_structure import Gains, LoopFilters
from backend.axes.drive.drive import Drive
from backend.tools.tuning.autotune.design.gains import (
    filter_choices,
    plan_design,
    plan_filters,
    plan_gains,
)
from drivers.errors import NotAllowed, OutOfRange
from profiles.loader import load_profile


def drive(name: str) -> Drive:
    """A drive that nobody talks to."""
    return Drive("x", "X", load_profile(name), [])


def test_a_speed_filter_widens_up_to_what_the_drive_can_hold() -> None:
    # MMS7: 2007h:02 in 0.1 Hz, at most 2000 Hz (004:6069).
    mms7 = drive("mms7")
    found = filter_choices(mms7, LoopFilters(speed_hz=1000.0))
    assert [f.speed_hz for f in found] == [pytest.approx(1414.2), pytest.approx(2000.0)]
    assert plan_filters(mms7, found[0]) == {"2007:02": 14142}


def test_a_torque_filter_halves_its_time_down_to_a_tenth_of_a_millisecond() -> None:
    # M6-L: P08.03 in 0.1 ms (000:3393); R6L: P05.48 in 0.01 ms (002:10421).
    for name, raws in (("m6l", [4, 2, 1]), ("r6l", [40, 20, 10])):
        one = drive(name)
        found = filter_choices(one, LoopFilters(torque_hz=198.94))
        corners = [f.torque_hz for f in found]
        assert corners == [pytest.approx(hz, rel=1e-3) for hz in (397.9, 795.8, 1591.5)]
        assert [next(iter(plan_filters(one, f).values())) for f in found] == raws


def test_a_filter_that_is_off_or_unknown_stays_so() -> None:
    assert filter_choices(drive("m6l"), LoopFilters(speed_hz=1000.0)) == ()
    assert plan_filters(drive("m6l"), LoopFilters(speed_hz=1000.0)) == {}


def test_gains_without_a_meaning_are_refused_with_what_can_be_done() -> None:
    with pytest.raises(NotAllowed, match=r"does not print what the gains .* mean") as reported:
        plan_gains(drive("ds_c"), Gains(1.0, 1.0, 1.0, 1.0), 1e-4, 1e-4)
    # DS_C has no stiffness levels to be sent to.
    assert "small steps" in (reported.value.remedy or "")
    assert "stiffness" not in (reported.value.remedy or "")


def test_a_load_ratio_needs_the_motor() -> None:
    with pytest.raises(NotAllowed, match="ratio to the motor inertia") as reported:
        plan_gains(drive("m6l"), Gains(1.0, 1.0, 1.0, 1.0), 1e-4)
    assert "motor inertia" in (reported.value.remedy or "")


J, ROTOR = 1e-4, 5e-5


def designed(hz: float, integral_hz: float | None = None, position: float | None = None) -> Gains:
    return Gains(
        2 * math.pi * hz * J,
        hz / 4 if integral_hz is None else integral_hz,
        hz if position is None else position,
        hz,
    )


@pytest.mark.parametrize(
    ("name", "gains", "key", "more"),
    [
        # MMS7: speed and position loop in 0.1 Hz from 0.1 Hz on, here 0.05 Hz and 0.02 Hz.
        ("mms7", designed(0.05, integral_hz=1.0, position=1.0), "2005:03", 2.0),
        ("mms7", designed(20.0, position=2 * math.pi * 0.02), "2005:01", 5.0),
        # R6L: an integral time of 512 ms at most, which is 0.311 Hz.
        ("r6l", designed(20.0, integral_hz=0.2), "2006:02", 0.3108 / 0.2),
        # EP3E: a position gain of 1/s at least.
        ("ep3e", designed(20.0, position=0.4), "2009:00", 2.5),
    ],
)
def test_a_design_that_the_drive_can_only_hold_with_more_gain_is_refused(
    name: str, gains: Gains, key: str, more: float
) -> None:
    with pytest.raises(OutOfRange) as caught:
        plan_design(drive(name), gains, J, ROTOR)
    assert (caught.value.code, caught.value.parameter) == ("autotune.gain-below-least", key)
    assert caught.value.text.params["more"] == pytest.approx(more, rel=1e-3)
    assert key in caught.value.message


def test_gains_are_rounded_towards_less_where_the_nearest_is_clearly_more() -> None:
    # EP3E: speed in Hz and position in 1/s without decimals; 5.6 and 3.6 were 6 and 4.
    one = drive("ep3e")
    assert plan_gains(one, designed(5.6, position=3.6), J, ROTOR)["2005:00"] == 6
    raw = plan_design(one, designed(5.6, position=3.6), J, ROTOR)
    assert (raw["2005:00"], raw["2009:00"]) == (5, 3)
    # 40.4 and 40.6 Hz are 1 % from the nearest.
    assert [plan_design(one, designed(hz), J, ROTOR)["2005:00"] for hz in (40.4, 40.6)] == [40, 41]


def test_an_inertia_that_is_held_too_high_is_made_up_for() -> None:
    """An axis lighter than its motor, whose load ratio cannot be below 0."""
    raw = plan_design(drive("r6l"), designed(40.0), J, 2 * J)
    assert (raw["2006:0D"], raw["2006:01"]) == (0, 200)
    assert plan_design(drive("r6l"), designed(40.0), J, ROTOR)["2006:01"] == 400


@pytest.mark.parametrize("name", ["mms7", "m6l", "r6l", "el7", "ep3e"])
def test_usual_designs_are_written_as_planned(name: str) -> None:
    for hz in (10.0, 35.0, 120.0):
        gains = designed(hz)
        assert plan_design(drive(name), gains, J, ROTOR) == plan_gains(drive(name), gains, J, ROTOR)
