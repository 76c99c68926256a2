"""The first power on motors that are connected wrongly, as physics has it.

With the field at s·(p·θc + 90°) + φ the torque is sin(field - pθ) of what the current makes: -0.5
for phases shifted by 120°, -cos(2pθ - φ) for two exchanged ones, and -cos 0 for an error of 180°.
"""

from __future__ import annotations

import asyncio
import math
from typing import Any

import pytest

from backend.commands.measuring.tools import lines_of
from backend.tools.mechanics.first_power.result import FirstPowerResult
from backend.tools.mechanics.first_power.run import TOOL
from backend.tools.mechanics.first_power.settings import FirstPowerSettings
from drivers.cia402 import State
from drivers.errors import NotAllowed
from drivers.virtual.defects import planted
from drivers.virtual.firmware.axis import VirtualAxis
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.settings import GainSet, LoopSettings
from drivers.virtual.mechanics import MechanicsSpec, PhaseSpec
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import At, settings_of
from tests.virtual.tools.set_ups.first_power import (
    ASKED,
    FAMILIES,
    HAND,
    RATED_NM,
    by_hand,
    finding,
    first_power,
    motor,
    shaft,
    shaft_rev,
)


async def on(
    drive: str, spec: MechanicsSpec, asked: FirstPowerSettings = ASKED, at_rev: float = 0.0
) -> tuple[FirstPowerResult, DirectBench]:
    """Made from this place of the rotor; settings are as before, the axis has no power."""
    async with direct(spec, drive=drive) as bench:
        shaft(bench).place(2 * math.pi * at_rev)
        mode = bench.axis.drive.require("mode")
        before = await settings_of(bench.axis.drive, mode)
        bench.link.highest.update(speed=0.0, torque=0.0)
        kept: dict[str, Any] = {}
        found = await first_power(bench, asked, kept=kept)
        assert TOOL.reevaluate(kept["arrays"], kept["meta"]) == found
        assert await settings_of(bench.axis.drive, mode) == before
        assert await bench.axis.state() is not State.OPERATION_ENABLED
        assert not bench.axis.drive.pending_restores.entries
        # 6077h is in per mille of rated torque.
        assert bench.link.highest["torque"] <= 100
        assert found.travel_rev <= 0.1
        assert abs(shaft_rev(bench) - at_rev) <= 0.1
        return found, bench


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("drive", FAMILIES)
async def test_a_motor_that_is_connected_right(drive: str) -> None:
    found, _ = await on(drive, motor())
    assert finding(found, "phases") == ("passed", "right")
    assert finding(found, "brake") == ("passed", "ok")
    assert finding(found, "supply") == ("passed", "ok")
    assert finding(found, "counts") == ("open", "not_done")
    assert found.verdict == "incomplete"
    assert found.covers_pole_pairs == 3


@pytest.mark.long
async def test_shifted_phases_turn_the_shaft_against_the_torque() -> None:
    found, _ = await on("mms7", planted(motor(), "phases_shifted"))
    assert finding(found, "phases") == ("failed", "reversed")
    assert found.verdict == "failed"
    words = "\n".join(lines_of(TOOL, found))
    assert "the phases are shifted" in words
    assert "Do not close a loop over this motor yet" in words
    assert "Turn the shaft by hand to learn which it is" in words


@pytest.mark.long
@pytest.mark.parametrize(("drive", "at_rev"), [("mms7", 0.0), ("ep3e", 0.05), ("r6l", 0.025)])
async def test_exchanged_phases_lock_the_shaft(drive: str, at_rev: float) -> None:
    found, _ = await on(drive, planted(motor(), "phases_exchanged"), at_rev=at_rev)
    assert finding(found, "phases") == ("failed", "locks")
    words = "\n".join(lines_of(TOOL, found))
    assert "Two motor phases are exchanged" in words
    assert "Exchange two phases or invert the feedback, and repeat" in words


@pytest.mark.long
async def test_where_exchanged_phases_make_no_torque_the_next_step_is_named() -> None:
    # cos(2pθ) is zero at θ = 1/(8p).
    found, _ = await on("r6l", motor(PhaseSpec(order="exchanged")), at_rev=1.0 / 32)
    assert finding(found, "phases") in (("open", "no_motion"), ("failed", "locks"))
    assert found.verdict != "passed"


@pytest.mark.long
async def test_an_inverted_encoder_that_commutates_locks_too() -> None:
    found, _ = await on("m6l", planted(motor(), "feedback_inverted"))
    assert finding(found, "phases") == ("failed", "locks")


@pytest.mark.long
async def test_a_wrong_angle_beyond_a_quarter_turn_reverses_the_torque() -> None:
    found, _ = await on("ep3e", motor(PhaseSpec(angle_deg=180.0)))
    assert finding(found, "phases") == ("failed", "reversed")


@pytest.mark.long
async def test_a_hand_turn_tells_an_inverted_encoder_from_shifted_phases() -> None:
    hall = PhaseSpec(commutation="hall")
    found, _ = await by_hand(planted(motor(hall), "feedback_inverted"), 1.0, HAND)
    assert finding(found, "counts") == ("passed", "ok")
    assert finding(found, "direction") == ("failed", "backwards")
    assert finding(found, "phases") == ("failed", "feedback_inverted")
    words = "\n".join(lines_of(TOOL, found))
    assert "turning forwards counts down" in words
    assert "invert the feedback in the drive" in words
    found, _ = await by_hand(motor(PhaseSpec(order="shifted")), 1.01, HAND)
    assert finding(found, "direction") == ("passed", "ok")
    assert finding(found, "phases") == ("failed", "phases_reversed")


@pytest.mark.long
async def test_an_axis_that_only_counts_the_other_way_has_right_phases() -> None:
    # Phases exchanged and encoder inverted: both signs together are right again.
    found, _ = await by_hand(motor(PhaseSpec(order="exchanged"), inverted=True), 1.0, HAND)
    assert finding(found, "phases") == ("passed", "right")
    assert finding(found, "direction") == ("failed", "backwards")


@pytest.mark.parametrize("share", [0.25, 4.0])
async def test_wrong_counts_are_found_before_anything_is_energised(share: float) -> None:
    found, bench = await by_hand(motor(counted=share), 1.0, HAND)
    assert finding(found, "counts") == ("failed", "wrong")
    assert finding(found, "phases") == ("open", "counts_first")
    assert found.pulses == ()
    assert shaft_rev(bench) == 1.0


@pytest.mark.long
@pytest.mark.parametrize(
    ("drive", "coulomb_nm", "found_as"),
    [
        ("mms7", 0.01, {"right"}),
        ("r6l", 0.01, {"right"}),
        # One pulse takes it nearly through the travel: what is left may not suffice for another.
        ("mms7", 0.004, {"right", "short"}),
    ],
)
async def test_a_shaft_that_sticks_stays_within_the_travel(
    drive: str, coulomb_nm: float, found_as: set[str]
) -> None:
    """It breaks away at 8 % of rated torque, and then nearly nothing holds a bare rotor."""
    spec = motor()
    friction = spec.friction.model_copy(update={"static_nm": 0.1, "coulomb_nm": coulomb_nm})
    bare = spec.model_copy(update={"friction": friction, "load": ()})
    async with direct(bare, drive=drive) as bench:
        found = await first_power(bench)
        assert finding(found, "phases")[1] in found_as
        assert found.travel_rev <= 0.1
        assert abs(shaft_rev(bench)) <= 0.1


@pytest.mark.long
async def test_a_shaft_that_was_moved_out_of_the_travel_is_moved_back() -> None:
    """Somebody pushes it while it is measured forwards: backwards it is still not blocked."""
    async with direct(motor(), drive="r6l") as bench:
        push = At("pulses", lambda: shaft(bench).place(2 * math.pi * 0.15), 0.52)
        found = await first_power(bench, progress=push)
        assert push.done
        assert finding(found, "phases") == ("passed", "right")
        assert found.pulses[-1].to_rev < 0.1


@pytest.mark.long
async def test_a_closed_brake_moves_nothing() -> None:
    found, _ = await on("r6l", planted(motor(), "brake_closed"))
    assert finding(found, "brake") == ("open", "not_seen")
    assert finding(found, "phases") == ("open", "no_motion")
    assert found.verdict == "incomplete"
    words = "\n".join(lines_of(TOOL, found))
    assert "The brake is closed" in words
    assert "Listen whether the brake opens" in words


async def test_nothing_moves_without_a_statement_of_what_hangs() -> None:
    async with direct(motor(), drive="r6l") as bench:
        with pytest.raises(NotAllowed) as refused:
            await first_power(bench, ASKED.model_copy(update={"nothing_hangs": False}))
        assert refused.value.code == "first-power.say-what-hangs"
        assert shaft_rev(bench) == 0.0


@pytest.mark.long
async def test_a_stop_meanwhile_takes_the_power_off_and_closes_no_loop() -> None:
    async with direct(motor(PhaseSpec(order="shifted")), drive="mms7") as bench:
        task: asyncio.Task[FirstPowerResult]
        modes = set[float]()

        def stop() -> None:
            shaft_axis = shaft(bench)
            begin = shaft_axis._begin

            def seen(generator: int, loop: int) -> None:
                modes.add(loop)
                begin(generator, loop)

            shaft_axis._begin = seen  # type: ignore[method-assign]
            task.cancel()

        at = At("pulses", stop, 0.55)
        task = asyncio.create_task(first_power(bench, progress=at))
        with pytest.raises(asyncio.CancelledError):
            await task
        assert at.done
        assert modes <= {k.LOOP_OFF, k.LOOP_TORQUE}
        assert await bench.axis.state() is not State.OPERATION_ENABLED
        assert not bench.axis.drive.pending_restores.entries
        assert abs(shaft_rev(bench)) <= 0.1


@pytest.mark.parametrize(
    ("spec", "runs_away"),
    [
        (motor(), False),
        (motor(PhaseSpec(order="shifted")), True),
        (motor(PhaseSpec(commutation="hall"), inverted=True), True),
    ],
)
def test_a_closed_loop_runs_away_over_a_wrong_motor(spec: MechanicsSpec, runs_away: bool) -> None:
    """The plant alone: a speed loop at 50 rpm, with no protection."""
    axis = VirtualAxis(spec)
    gains = GainSet(20.0, 0.02, 1.0)
    axis.apply_loops(LoopSettings(first=gains, second=gains, homing=None))
    axis.set_limits(RATED_NM, RATED_NM, math.inf)
    axis.run_velocity(5.0, 1e3, 1e3)
    for _ in range(40):
        axis.run(100)
    fast = abs(float(axis._x[1]))
    assert (fast > 50.0) is runs_away
    if not runs_away:
        assert fast == pytest.approx(5.0, rel=0.05)


@pytest.mark.parametrize(
    "spec",
    [motor(), motor(PhaseSpec(order="shifted")), motor(inverted=True)],
    ids=["right", "shifted", "inverted"],
)
def test_shorted_windings_brake_a_wrong_motor_too(spec: MechanicsSpec) -> None:
    """Induced currents need neither the phase order of the drive nor an encoder."""
    axis = VirtualAxis(spec)
    axis.run_torque(0.2 * RATED_NM, math.inf)
    for _ in range(20):
        axis.run(10)
    before = abs(float(axis._x[1]))
    axis.power_off(dynamic_brake=True)
    for _ in range(20):
        axis.run(10)
    assert before > 1.0
    assert abs(float(axis._x[1])) < 0.3 * before


def test_exchanged_phases_hold_the_rotor_at_a_multiple_of_half_an_electrical_turn() -> None:
    """A constant torque command of -T·cos(2pθ): it stops where the cosine is zero."""
    spec = motor(PhaseSpec(order="exchanged"))
    axis = VirtualAxis(spec)
    axis.run_torque(0.5 * RATED_NM, math.inf)
    for _ in range(400):
        axis.run(100)
    electrical = 2 * 4 * float(axis._x[0])
    assert abs(math.cos(electrical)) < 0.06
