"""Gains and filters of the drives' loops as raw values, and what is said where there are none.

Corners by hand: a time constant of T is a corner of 1/(2π·T); 0.8 ms are 198.9 Hz.
"""

from __future__ import annotations

import pytest

from backend.analysis.loop.loop_structure import Gains, LoopFilters
from backend.drive.drive import Drive
from backend.tools.autotune.gains import filter_choices, plan_filters, plan_gains
from drivers.errors import NotAllowed
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
