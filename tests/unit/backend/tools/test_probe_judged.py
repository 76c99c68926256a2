"""What the first careful test of an axis concludes: rough inertia, or a wrong sign."""

from __future__ import annotations

import numpy as np
import pytest

from backend.tools.measuring import excite
from backend.tools.measuring.recording import Recording
from backend.tools.mechanics.inertia.probe import Probed, _judged
from drivers.errors import NotAllowed

RATE, STEPS, RATED = 1000.0, 20, 1.27
MOTOR = 1.7e-4


def recorded(load: float, stiffness: float, coulomb: float, *, sign: float = 1.0) -> Recording:
    """The doublet on a motor with a load behind a spring, integrated in steps of 50 µs."""
    torque = excite.probe(RATE, 0.2, 0.28, 1e-3)
    dt = 1.0 / RATE / STEPS
    twist = motor = other = 0.0
    speeds = []
    for given in torque:
        for _ in range(STEPS):
            spring = stiffness * twist
            push = given - spring
            held = abs(motor) < 1e-3 and abs(push) < coulomb
            motor += 0.0 if held else dt * (push - coulomb * np.sign(motor or push)) / MOTOR
            other += dt * spring / load
            twist += dt * (motor - other)
        speeds.append(motor)
    speed = np.array(speeds)
    nothing, valid = np.zeros(speed.size), np.ones(speed.size, bool)
    return Recording(RATE, np.cumsum(speed) / RATE, speed, sign * torque, nothing, nothing, valid)


def judged(recording: Recording) -> Probed:
    return _judged("X", recording, RATED)


def test_a_stiff_axis_has_its_whole_inertia() -> None:
    found = judged(recorded(5e-4, 5e3, 0.02))
    assert found.inertia_kgm2 == pytest.approx(MOTOR + 5e-4, rel=0.1)


@pytest.mark.parametrize("hz", [2.0, 3.0, 4.0, 5.0, 7.0, 8.0, 10.0])
def test_a_heavy_load_on_a_soft_coupling_is_no_wrong_sign(hz: float) -> None:
    """It swings at some hertz against the motor: the excitation is scaled between both inertias."""
    load = 12 * MOTOR
    found = judged(recorded(load, load * (2 * np.pi * hz) ** 2, 0.03))
    assert 0.5 * MOTOR < found.inertia_kgm2 < 1.2 * (MOTOR + load)


@pytest.mark.parametrize(
    ("load", "hz"), [(3 * MOTOR, 300.0), (12 * MOTOR, 4.0), (12 * MOTOR, 10.0)]
)
def test_a_wrong_sign_of_the_torque_is_found(load: float, hz: float) -> None:
    with pytest.raises(NotAllowed) as refused:
        judged(recorded(load, load * (2 * np.pi * hz) ** 2, 0.03, sign=-1.0))
    assert refused.value.code == "inertia.moves-against-torque-sign"


def test_a_wrong_sign_is_found_without_friction() -> None:
    with pytest.raises(NotAllowed):
        judged(recorded(5e-4, 5e3, 0.0, sign=-1.0))
    assert judged(recorded(5e-4, 5e3, 0.0)).inertia_kgm2 == pytest.approx(6.7e-4, rel=0.1)
