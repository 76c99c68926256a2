"""Friction over speed: values known beforehand, from curves of another law than the model's."""

from __future__ import annotations

import numpy as np
import pytest

from backend.analysis.mechanics.stribeck import SpeedModel, speed_model

SPEEDS = np.geomspace(2.0, 1000.0, 10)
BOTH = np.concatenate([-SPEEDS[::-1], SPEEDS])


def modelled(friction: object, speed: np.ndarray = BOTH, noise: float = 0.005) -> SpeedModel:
    random = np.random.default_rng(3)
    torque = np.asarray(friction) + noise * random.standard_normal(speed.size)
    return speed_model(speed, torque, np.full(speed.size, 1.96 * noise))


def tanh_law(speed: np.ndarray) -> np.ndarray:
    size = np.abs(speed)
    return np.sign(speed) * (3.0 + 1.5 * (1.0 - np.tanh(size / 40.0))) + 0.002 * speed


def test_load_coulomb_and_viscous_are_distinguished() -> None:
    found = modelled(0.7 + 3.0 * np.sign(BOTH) + 0.002 * BOTH)
    assert found.best.speed is None
    for index, true in enumerate((0.7, 3.0, 0.002)):
        value, low, high = found.value(index)
        assert value == pytest.approx(true, rel=0.02)
        assert low < true < high
    with pytest.raises(ValueError, match="no Stribeck"):
        found.stribeck_speed()


def test_the_curve_follows_a_law_that_the_model_does_not_have() -> None:
    found = modelled(tanh_law(BOTH))
    speed, torque = (np.array(each) for each in found.curve())
    assert np.max(np.abs(torque / tanh_law(speed) - 1.0)) < 0.02
    assert found.reached
    assert found.value(1)[0] == pytest.approx(3.0, rel=0.02)
    assert found.value(3)[0] == pytest.approx(1.5, rel=0.1)
    speed_s, low, high = found.stribeck_speed()
    assert low < speed_s < high


def test_a_height_that_slow_speeds_do_not_reach_is_not_known() -> None:
    slowest = np.geomspace(60.0, 1000.0, 10)
    speed = np.concatenate([-slowest[::-1], slowest])
    found = modelled(tanh_law(speed), speed)
    assert not found.reached


def test_few_speeds_say_nothing_of_stribeck() -> None:
    speed = np.array([-500.0, -100.0, -5.0, 5.0, 100.0, 500.0])
    found = modelled(tanh_law(speed), speed)
    assert not found.enough
    assert found.best.speed is None


def test_what_the_model_does_not_explain_is_said() -> None:
    bump = np.where(np.abs(np.abs(BOTH) - SPEEDS[6]) < 1e-6, 1.0, 0.0) * np.sign(BOTH)
    assert modelled(tanh_law(BOTH) + bump).misfit() > 0.03
    assert modelled(tanh_law(BOTH)).misfit() < 0.03
