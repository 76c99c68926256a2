"""Inertia by samples of a torque that is a sawtooth in step with them, as held setpoints make it.

A rigid axis under a PI speed loop of 50 µs, whose setpoints are held for a cycle or interpolated.
"""

from __future__ import annotations

import numpy as np
import pytest

from backend.analysis.mechanics.slow_moves.identification_path import MoveLimits, design_moves
from backend.analysis.mechanics.slow_moves.inertia import InertiaResult
from backend.axes.axis.axis import Envelope
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.recording import Recording
from backend.tools.mechanics.inertia.evaluation import InertiaSettings, _loop_gain, evaluate

J, COULOMB, VISCOUS = 4e-4, 0.03, 3e-4
RATE, STEPS = 1000.0, 20
FACTS = AxisFacts(1.27, True, 3000.0, 1000.0, None, None, None, True)
SETTINGS = InertiaSettings(Envelope(3.0, 1500.0, 100.0, 60.0))


def moved(loop_1_s: float, held: bool, *, offset: bool = False) -> Recording:
    """Moves under a loop of this gain over inertia; setpoints as raw values of a drive."""
    path = design_moves(
        MoveLimits(15.0, 100.0, 0.3), J, RATE, friction_nm=COULOMB, repetitions=4,
        smoothing_s=0.03, dwell_s=0.1,
    )  # fmt: skip
    wanted = path.velocity_rad_s
    ahead = 0.5 * J * np.gradient(wanted) * RATE if offset else np.zeros(wanted.size)
    gain, step_s = loop_1_s * J, 1.0 / RATE / STEPS
    speed = position = integral = 0.0
    rows = []
    for k in range(1, wanted.size):
        for i in range(STEPS):
            share = 1.0 if held else (i + 1) / STEPS
            error = wanted[k - 1] + share * (wanted[k] - wanted[k - 1]) - speed
            integral += 0.25 * loop_1_s * gain * error * step_s
            torque = gain * error + integral + ahead[k]
            before = speed
            speed += step_s / J * (torque - VISCOUS * speed - COULOMB * np.tanh(speed / 0.02))
            position += 0.5 * step_s * (before + speed)
        rows.append((position, speed, torque))
    p, v, t = np.array(rows).T
    raw = np.asarray(4000.0 * wanted[1:], np.float64)
    sent = np.asarray(1270.0 * ahead[1:], np.float64)
    return Recording(RATE, p, v, t, raw, sent, np.ones(p.size, np.bool_))


def found(recording: Recording) -> InertiaResult:
    return evaluate(recording, SETTINGS, FACTS)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("offset", [False, True])
@pytest.mark.parametrize("loop_1_s", [15.0, 60.0])
def test_the_gain_of_the_loop_is_seen_whatever_the_units(loop_1_s: float, offset: bool) -> None:
    for held in (False, True):
        gain = _loop_gain(moved(loop_1_s, held, offset=offset))
        assert gain == pytest.approx(loop_1_s * J, rel=0.1)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("loop_1_s", [15.0, 60.0])
def test_setpoints_that_are_held_bend_the_inertia_within_its_interval(loop_1_s: float) -> None:
    result = found(moved(loop_1_s, held=True))
    inertia = result.inertia_kgm2
    # The torque is sampled at the end of its sawtooth, half a cycle of gain below its mean.
    assert inertia.value / J - 1.0 == pytest.approx(-0.5e-3 * loop_1_s, rel=0.35)
    assert result.identifiable
    assert inertia.low <= J <= inertia.high


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("loop_1_s", [15.0, 60.0])
def test_interpolated_setpoints_leave_the_interval_narrow(loop_1_s: float) -> None:
    inertia = found(moved(loop_1_s, held=False)).inertia_kgm2
    assert inertia.low <= J <= inertia.high
    # Half a loop period of 50 µs of the gain, to both sides.
    assert (inertia.high - inertia.low) / J < 0.0101 + 2 * 25e-6 * loop_1_s
