"""The signs of torque and speed by the energy of a test move, on a motor with a soft coupling."""

from __future__ import annotations

import numpy as np
import pytest

from backend.tools.inertia.probe import _judged, rough_fit
from backend.tools.measuring.recording import Recording
from drivers.errors import NotAllowed

MOTOR, LOAD, RATE = 1e-4, 1.8e-3, 1000.0


def doublet(stiffness: float, coulomb: float = 0.06, sign: float = 1.0) -> Recording:
    """Motor and load under one period of torque, in steps of 50 µs; ``sign`` of the torque."""
    n, fine = 320, 20
    torque = 0.2 * np.sin(2 * np.pi * np.arange(n * fine) / (n * fine))
    motor = load = twist = 0.0
    rows = []
    for i, drive in enumerate(torque):
        pull = stiffness * twist
        motor += 5e-5 / MOTOR * (drive - pull - coulomb * np.tanh(motor / 0.05))
        load += 5e-5 / LOAD * pull
        twist += 5e-5 * (motor - load)
        if i % fine == fine - 1:
            rows.append((motor, drive))
    v, t = np.array(rows).T
    nothing = np.zeros(v.size)
    return Recording(
        RATE, np.cumsum(v) / RATE, v, sign * t, nothing, nothing, np.ones(v.size, np.bool_)
    )


def soft_one() -> Recording:
    """One whose momentum over its stretches falls while it turns faster."""
    for stiffness in np.geomspace(0.5, 30.0, 60):
        found = doublet(float(stiffness))
        if rough_fit(found.torque_nm, found.velocity_rad_s, RATE, found.valid).inertia_kgm2 <= 0:
            return found
    raise AssertionError("no such axis")


def test_a_load_that_swings_is_no_wrong_sign() -> None:
    probed = _judged("X", soft_one(), 1.27)
    assert 0.5 * MOTOR < probed.inertia_kgm2 < 3.0 * (MOTOR + LOAD)


@pytest.mark.parametrize("stiffness", [2.0, 10.0, 1000.0])
def test_a_wrong_sign_is_still_named(stiffness: float) -> None:
    with pytest.raises(NotAllowed) as caught:
        _judged("X", doublet(stiffness, sign=-1.0), 1.27)
    assert caught.value.code == "inertia.moves-against-torque-sign"
