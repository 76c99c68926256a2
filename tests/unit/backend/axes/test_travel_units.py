"""Motions typed in mm or degrees: converted once, and reported about in the same unit.

A screw of 10 mm behind a gearbox 3:1 moves 10/3 mm per motor revolution; a table behind 2:1 turns
180°.
"""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from backend.api.drive import convert_motion
from backend.api.drive.models_motion import (
    GenerateRequest,
    HomeRequest,
    MoveRequest,
    SequenceRequest,
)
from backend.api.live.messages import JogStart
from backend.axes.axis.axis import Envelope
from backend.axes.axis.remembered import AxisRecord
from backend.axes.motion.travel_unit import REVOLUTIONS, TravelUnit
from backend.axes.scales.gear_calculator import Mechanics
from backend.foundation.work.jobs import Progress
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.tools.moving.jog import run as jogging
from backend.tools.moving.jog.cyclic import _require_inside
from backend.tools.moving.moves import move as moving
from drivers.errors import NotAllowed, OutOfRange
from tests.support.servo import Servo, bench_with

SCREW = Mechanics(kind="screw", lead_mm=10, motor_turns=3)
TABLE = Mechanics(kind="rotary", motor_turns=2)
MM = TravelUnit("mm", 10 / 3)
DEGREES = TravelUnit("°", 180.0)
LIMITS: dict[str, Any] = {"travel_limit": 20, "torque_limit": 50}


@pytest.fixture
async def bench(tmp_path: Path) -> AsyncIterator[Bench]:
    bench, _ = await bench_with(Servo(), tmp_path)
    yield bench
    await bench.close()


def quiet() -> Progress:
    return lambda _share, _text: None


def test_travel_speed_and_acceleration() -> None:
    assert MM.rev(20) == pytest.approx(6)
    assert MM.rpm(20) == pytest.approx(360)  # 20 mm/s, or 20 mm/s² to rpm/s
    assert MM.travel(6) == pytest.approx(20)
    assert MM.speed(360) == pytest.approx(20)
    assert DEGREES.rpm(90) == pytest.approx(30)
    assert (REVOLUTIONS.rev(2.5), REVOLUTIONS.rpm(60)) == (2.5, 60)
    assert [u.speed_name for u in (REVOLUTIONS, MM, DEGREES)] == ["rpm", "mm/s", "°/s"]


def test_a_move_is_converted_by_its_mode() -> None:
    common: dict[str, Any] = {"speed": 20, "acceleration": 100, "deceleration": 50, **LIMITS}
    move = convert_motion.move_settings(MoveRequest(mode="PP", target=10, **common), MM)
    assert (move.target, move.speed_rpm) == (pytest.approx(3), pytest.approx(360))
    assert (move.acceleration_rpm_s, move.deceleration_rpm_s) == (
        pytest.approx(1800),
        pytest.approx(900),
    )
    assert (move.envelope.travel_rev, move.envelope.speed_rpm) == (
        pytest.approx(6),
        pytest.approx(360),
    )
    speed = convert_motion.move_settings(MoveRequest(mode="PV", target=-20, **LIMITS), MM)
    assert (speed.target, speed.envelope.speed_rpm) == (pytest.approx(-360), pytest.approx(360))
    torque = convert_motion.move_settings(MoveRequest(mode="PT", target=30, speed=20, **LIMITS), MM)
    assert (torque.target, torque.envelope.torque_percent) == (30, 50)


def test_the_other_motions_are_converted() -> None:
    there = SequenceRequest(first=0, second=180, speed=90, acceleration=900, **LIMITS)
    sequence = convert_motion.sequence_settings(there, DEGREES)
    assert (sequence.second, sequence.speed_rpm, sequence.acceleration_rpm_s) == (1, 30, 300)
    search = HomeRequest(method=1, speed_switch=90, speed_zero=9, offset=-90, **LIMITS)
    home = convert_motion.homing_settings(search, DEGREES)
    assert (home.speed_switch_rpm, home.speed_zero_rpm, home.offset_rev) == (30, 3, -0.5)
    assert home.acceleration_rpm_s is None
    wave = {"shape": "sine", "duration_s": 1, "acceleration": 360, "speed_limit": 180, **LIMITS}
    for mode, amplitude, slope in (("CSP", 0.5, 2.0), ("CSV", 30.0, 120.0), ("CST", 90.0, 360.0)):
        request = GenerateRequest.model_validate({"mode": mode, "amplitude": 90, **wave})
        signal = convert_motion.generator_settings(request, DEGREES)
        assert (signal.amplitude, signal.acceleration) == (amplitude, slope)
    jog = convert_motion.jog_settings(
        JogStart(drive="x", direction=-1, speed=180, acceleration=1800, **LIMITS), DEGREES
    )
    assert (jog.speed_rpm, jog.acceleration_rpm_s) == (60, 600)
    assert jog.travel_rev == pytest.approx(20 / 180)


async def test_the_unit_comes_from_the_mechanics_that_are_kept(
    bench: Bench, x: ConnectedDrive
) -> None:
    assert await convert_motion.unit_of(bench, x, "rev") is REVOLUTIONS
    with pytest.raises(NotAllowed, match="needs mechanics"):
        await convert_motion.unit_of(bench, x, "mm")
    bench.axis_records.put("x", AxisRecord(mechanics=SCREW))
    assert await convert_motion.unit_of(bench, x, "mm") == TravelUnit("mm", float(10 / 3))
    with pytest.raises(NotAllowed) as refused:
        await convert_motion.unit_of(bench, x, "°")
    assert refused.value.limit == "rev, mm"


async def test_refusals_name_the_unit_of_the_request(x: ConnectedDrive) -> None:
    """A target 30 mm away with a limit of 20 mm; nobody hears of revolutions."""
    request = MoveRequest(mode="PP", target=30, relative=True, speed=20, unit="mm", **LIMITS)
    settings = convert_motion.move_settings(request, MM)
    with pytest.raises(OutOfRange) as refused:
        await moving.move(x.axis, settings, quiet())
    assert "+30 mm from the start" in str(refused.value)
    assert refused.value.limit == "20 mm from the start"
    assert refused.value.value == pytest.approx(30)
    assert "rev" not in str(refused.value)


async def test_a_speed_above_the_envelope_is_reported_in_its_unit(x: ConnectedDrive) -> None:
    envelope = Envelope(6.0, 180.0, 50.0, 10.0, "mm", 10 / 3)
    settings = moving.MoveSettings("PP", 1.0, envelope, speed_rpm=360.0)
    with pytest.raises(OutOfRange) as refused:
        await moving.move(x.axis, settings, quiet())
    assert "20 mm/s is above the envelope's 10 mm/s" in str(refused.value)


async def test_a_jog_too_slow_to_count_is_reported_in_its_unit(x: ConnectedDrive) -> None:
    settings = jogging.JogSettings(1, 1e-4, 600.0, 5.0, 50.0, shown=DEGREES)
    with pytest.raises(OutOfRange, match=r"0\.0003 °/s is below"):
        await jogging.jog(x.axis, settings, jogging.Hold(), quiet())


def test_an_amplitude_beyond_the_envelope_is_reported_in_its_unit(x: ConnectedDrive) -> None:
    request = GenerateRequest(
        mode="CSP", shape="step", amplitude=40, duration_s=1, speed_limit=100, unit="mm", **LIMITS
    )
    with pytest.raises(OutOfRange, match=r"40 mm is more than the envelope allows \(20 mm\)"):
        _require_inside(x.drive, convert_motion.generator_settings(request, MM))
