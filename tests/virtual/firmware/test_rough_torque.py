"""Rough options of a virtual axis do what they say, by physics; without them nothing changes."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.virtual.firmware.axis import VirtualAxis
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.settings import GainSet, LoopSettings
from drivers.virtual.mechanics import (
    EncoderSpec,
    FrictionSpec,
    LoadSpec,
    MechanicsSpec,
    MotorSpec,
    RoughTorqueSpec,
)

MOTOR = MotorSpec(inertia_kgm2=1e-4, rated_torque_nm=1.27, rated_speed_rpm=3000)


def axis_of(coulomb: float = 0.0, **rough: object) -> VirtualAxis:
    spec = MechanicsSpec(
        motor=MOTOR,
        friction=FrictionSpec(coulomb_nm=coulomb),
        encoder=EncoderSpec(),
        rough_torque=RoughTorqueSpec.model_validate(rough),
    )
    axis = VirtualAxis(spec)
    gains = GainSet(10.0, 0.02, 0.2)
    loops = LoopSettings(
        first=gains, second=gains, homing=None, speed_output_nm=3.0, torque_mode_speed_rad_s=1e4
    )
    axis.apply_loops(loops)
    axis.run_cyclic(k.LOOP_TORQUE)
    return axis


def reported(axis: VirtualAxis, steps: int) -> np.ndarray:
    values = []
    for _ in range(steps):
        axis.run(1)
        values.append(float(axis.s[k.S_TORQUE_REPORTED]))
    return np.array(values)


def test_a_held_set_point_is_there_at_once() -> None:
    held, line = axis_of(holds_torque=True), axis_of()
    for axis in (held, line):
        axis.set_cyclic(0.0, 0.0, 0.1, 20)
        axis.run(10)
    assert held.s[k.S_T_DEMAND] == pytest.approx(0.1)
    assert line.s[k.S_T_DEMAND] == pytest.approx(0.05)


@pytest.mark.parametrize("option", ["reported_filter_s", "torque_filter_s"])
def test_a_filter_of_a_millisecond_reaches_63_percent_in_it(option: str) -> None:
    axis = axis_of(holds_torque=True, **{option: 1e-3})
    axis.set_cyclic(0.0, 0.0, 0.1, 20)
    # 1 ms next to a current loop of 1 kHz (0.16 ms) and the step that computes it.
    shown = reported(axis, 60)
    reached = np.flatnonzero(shown >= 0.0632)[0] * 50e-6
    assert reached == pytest.approx(1.16e-3, abs=0.1e-3)
    slow = float(axis.s[k.S_TORQUE]) < 0.098
    assert slow is (option == "torque_filter_s")


def test_a_copy_of_the_demand_knows_no_current_loop() -> None:
    axis = axis_of(holds_torque=True, reported="demand")
    axis.set_cyclic(0.0, 0.0, 0.1, 20)
    assert reported(axis, 2)[-1] == pytest.approx(0.1)
    assert axis.s[k.S_TORQUE] < 0.06


def test_torque_constant_moves_the_axis_and_is_not_reported() -> None:
    axis = axis_of(holds_torque=True, torque_constant=1.08)
    axis.set_cyclic(0.0, 0.0, 0.1, 20)
    axis.run(2000)
    assert axis.s[k.S_TORQUE_REPORTED] == pytest.approx(0.1, rel=1e-3)
    # ω = T·t/J, less 0.16 ms of the current loop.
    assert axis.speed_rad_s == pytest.approx(0.108 / 1e-4 * 0.0998, rel=0.01)


def test_friction_that_begins_as_a_spring_holds_and_yields() -> None:
    """Below its limit Dahl's friction is a spring of limit over rest length; above it slides."""
    axis = axis_of(coulomb=0.05, presliding_rad=1e-3, holds_torque=True)
    axis.set_cyclic(0.0, 0.0, 0.06, 20)
    axis.run(4000)
    assert axis.s[k.S_ROUGH_FRICTION] == pytest.approx(0.05, rel=0.01)
    assert axis.speed_rad_s == pytest.approx(0.01 / 1e-4 * 0.2, rel=0.1)


def test_a_dip_takes_its_share_of_the_torque() -> None:
    axis = axis_of(holds_torque=True, dip_share=0.5, dip_s=0.01, dip_every_s=0.02)
    axis.set_cyclic(0.0, 0.0, 0.1, 20)
    shown = reported(axis, 800)
    assert np.min(shown[400:]) == pytest.approx(0.05, rel=0.02)
    assert np.max(shown[400:]) == pytest.approx(0.1, rel=0.02)


def test_a_longer_loop_period_changes_the_torque_once_in_it() -> None:
    axis = axis_of(loop_period_s=250e-6, reported="demand")
    axis.set_cyclic(0.0, 0.0, 0.1, 20)
    shown = reported(axis, 30)
    changes = np.flatnonzero(np.diff(shown)) + 1
    assert np.all(np.diff(changes) == 5)


@pytest.mark.parametrize("loads", [1, 2, 3])
def test_a_stiffness_that_varies_by_place_twists_both_sides(loads: int) -> None:
    """Without torque from outside the angular momentum of the whole axis stays."""
    load = LoadSpec(inertia_kgm2=2e-4, stiffness_nm_per_rad=30.0)
    spec = MechanicsSpec(
        motor=MOTOR,
        load=(load,) * loads,
        friction=FrictionSpec(coulomb_nm=0.0, viscous_nms=0.0),
        encoder=EncoderSpec(),
        rough_torque=RoughTorqueSpec(stiffness_share=0.4),
    )
    axis = VirtualAxis(spec)
    speeds = [1, *range(4, 4 + 2 * loads, 2)]
    inertias = np.array([1e-4] + [2e-4] * loads)
    axis._x[1] = 60.0
    axis._x[3] = 0.05
    before = float(np.sum(inertias * axis._x[speeds]))
    twists = []
    for _ in range(400):
        axis.run(5)
        twists.append(float(axis._x[3]))
    assert np.ptp(twists) > 0.05
    assert float(np.sum(inertias * axis._x[speeds])) == pytest.approx(before, rel=1e-3)
