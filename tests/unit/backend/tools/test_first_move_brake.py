"""Whether a brake held an axis at the beginning of its first move: positions by kinematics."""

from __future__ import annotations

import numpy as np
import pytest

from backend.tools.measuring.recording import Recording
from backend.tools.mechanics.inertia.moves import _stood

RATE = 1000.0


def hump() -> np.ndarray:
    """Speed in rpm of a way of 0.12 rev in 0.35 s, and back."""
    n = 350
    forth = (1.0 - np.cos(2 * np.pi * (np.arange(n) + 0.5) / n)) * 0.12 / 0.35 * 60.0
    return np.concatenate([forth, -forth, np.zeros(100)])


def recorded(speed_rpm: np.ndarray) -> Recording:
    zeros = np.zeros(speed_rpm.size)
    position = np.cumsum(speed_rpm) / 60.0 / RATE * 2 * np.pi
    return Recording(RATE, position, speed_rpm * np.pi / 30.0, zeros, zeros, zeros, zeros == 0.0)


@pytest.mark.parametrize("opens_s", [0.12, 0.143, 0.2, 0.3])
def test_an_axis_that_begins_late_was_held(opens_s: float) -> None:
    speed = hump()
    held = np.arange(speed.size) / RATE < opens_s
    assert _stood(recorded(np.where(held, 0.0, speed)), speed)


@pytest.mark.parametrize("bandwidth_hz", [2.0, 5.0, 50.0])
def test_a_slow_loop_has_begun(bandwidth_hz: float) -> None:
    """A first-order lag of the demanded speed."""
    speed = hump()
    share = 1.0 - np.exp(-2 * np.pi * bandwidth_hz / RATE)
    moved, now = np.empty(speed.size), 0.0
    for i, wanted in enumerate(speed):
        now += share * (wanted - now)
        moved[i] = now
    assert not _stood(recorded(moved), speed)
