"""Where parts stand: worked out by hand from the mechanics."""

from __future__ import annotations

import math

import pytest

from backend.axes.scales.gear_calculator import Mechanics
from backend.scene.geometry import HALF_TRACK, Track, track_of, travel_of, turn

SCREW = Mechanics(kind="screw", lead_mm=10, motor_turns=2, load_turns=1)
TABLE = Mechanics(kind="rotary", motor_turns=50, load_turns=1)


def test_travel_of_a_revolution() -> None:
    # Two motor turns are one screw turn of 10 mm.
    screw = travel_of(SCREW)
    assert (screw.per_rev, screw.load_turns_per_rev, screw.unit) == (5.0, 0.5, "mm")
    table = travel_of(TABLE)
    assert (table.per_rev, table.load_turns_per_rev, table.unit) == (7.2, 0.02, "°")
    assert travel_of(None).unit == "rev"
    # A dimension is missing: a bare shaft, not a guess.
    assert travel_of(Mechanics(kind="screw")).unit == "rev"


def test_the_carriage_stands_between_the_limits() -> None:
    track = track_of(travel_of(SCREW), 0.0, (-20.0, 60.0))
    assert (track.low, track.high, track.limited) == (-100.0, 300.0, True)
    assert track.place(100.0) == 0.0
    assert track.place(300.0) == pytest.approx(0.8 * HALF_TRACK)
    assert track.place(-100.0) == pytest.approx(-0.8 * HALF_TRACK)
    assert track.place(1e9) == HALF_TRACK
    assert track.showing(1e9) == track


def test_a_track_without_limits_grows_and_keeps_its_middle() -> None:
    track = track_of(travel_of(SCREW), 0.0, None)
    assert (track.low, track.high, track.limited) == (-25.0, 25.0, False)
    assert track.showing(24.0) is track
    assert track.showing(-60.0) == Track(-100.0, 100.0, limited=False)
    # Zero stays on a track that begins far from it.
    far = track_of(travel_of(SCREW), 1000.0, None)
    assert far.low <= 0 <= far.high


@pytest.mark.parametrize("limits", [(5.0, 5.0), (5.0, -5.0)])
def test_limits_without_a_range_limit_nothing(limits: tuple[float, float]) -> None:
    assert not track_of(travel_of(None), 0.0, limits).limited


def test_turns_about_an_axis() -> None:
    half = math.sqrt(0.5)
    assert turn(0.25, "x") == pytest.approx((half, half, 0, 0))
    assert turn(0.5, "z") == pytest.approx((0, 0, 0, 1), abs=1e-12)
    assert turn(-0.25, "y") == pytest.approx((half, 0, -half, 0))
    # A million revolutions later it looks the same.
    assert turn(1_000_000.25, "x") == pytest.approx((half, half, 0, 0), abs=1e-9)
