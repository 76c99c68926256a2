"""Verification steps whose figures are none of noise, and gains raised compared with what the place
does.

A first-order answer reaches a band of ±p of its size after τ·ln(1/p).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from backend.axes.axis.axis import Envelope
from backend.tools.measuring.recording import Recording
from backend.tools.moving.step.evaluate import (
    LEAD_S,
    StepResult,
    StepSettings,
    evaluate,
    significant_size,
)
from backend.tools.tuning.autotune.verification.gain_steps import judged

RATE, TAU_S = 1000.0, 1 / (2 * np.pi * 65.0)
ENVELOPE = Envelope(4.0, 1500.0, 100.0, 60.0)
FloatArray = npt.NDArray[np.float64]


def stepped(
    size_rpm: float, noise_rpm: float = 0.0, torque_nm: FloatArray | None = None
) -> StepResult:
    settings = StepSettings(ENVELOPE, size=size_rpm)
    lead, hold = round(LEAD_S * RATE), round(settings.hold_s * RATE)
    demand = np.concatenate([np.zeros(lead), np.full(hold, size_rpm), np.zeros(hold)])
    t = np.arange(demand.size) / RATE - LEAD_S
    rises = 1 - np.exp(-np.maximum(t, 0.0) / TAU_S)
    falls = 1 - np.exp(-np.maximum(t - settings.hold_s, 0.0) / TAU_S)
    rpm = size_rpm * (rises - falls) + np.random.default_rng(2).normal(size=t.size) * noise_rpm
    speed = rpm * 2 * np.pi / 60
    torque = np.zeros(t.size) if torque_nm is None else torque_nm
    recording = Recording(
        RATE,
        np.cumsum(speed) / RATE,
        speed,
        torque,
        demand,
        np.zeros(t.size),
        np.ones(t.size, dtype=bool),
    )
    return evaluate(recording, demand, settings, 1.0)


def test_noise_widens_the_settling_window_to_ten_times_itself() -> None:
    quiet, noisy = stepped(100.0, 0.05), stepped(100.0, 1.0)
    assert quiet.window == 2.0
    assert not quiet.widened
    assert noisy.widened
    assert noisy.window is not None
    assert noisy.window == pytest.approx(10.0, rel=0.2)
    assert noisy.noise <= noisy.window / 10.0 * (1 + 1e-9)
    assert quiet.step is not None
    assert noisy.step is not None
    assert quiet.step.settling_s == pytest.approx(TAU_S * np.log(50), abs=1.5e-3)
    # Of 2 % the noise would leave the window until the end of the hold.
    share = noisy.window / 100.0
    assert noisy.step.settling_s == pytest.approx(TAU_S * np.log(1 / share), abs=2.5e-3)


def test_a_step_of_significant_size_needs_no_wider_window() -> None:
    size = significant_size(stepped(100.0, 0.6))
    # Ten times 0.6 rpm are 2 % of 300 rpm.
    assert size == pytest.approx(300.0, rel=0.2)
    again = stepped(1.1 * size, 0.6)
    assert not again.widened
    assert again.noise <= 0.02 * 1.1 * size / 10.0


@pytest.mark.parametrize(("noise_rev", "widened"), [(1e-6, False), (2e-3, True)])
def test_the_window_of_a_move_is_ten_times_its_noise(noise_rev: float, widened: bool) -> None:
    """A move of 0.5 rev: 2 % are 0.01 rev, ten times 2e-3 rev are twice as much."""
    settings = StepSettings(ENVELOPE, kind="move", size=0.5)
    way = np.concatenate([np.zeros(50), np.linspace(0.0, 0.5, 200), np.full(250, 0.5)])
    actual = way + np.random.default_rng(4).normal(size=way.size) * noise_rev
    turn = 2 * np.pi
    recording = Recording(
        RATE,
        turn * actual,
        turn * RATE * np.gradient(way),
        np.zeros(way.size),
        turn * way,
        np.zeros(way.size),
        np.ones(way.size, dtype=bool),
    )
    found = evaluate(recording, way, settings, 1.0)
    assert found.widened is widened
    assert found.window == pytest.approx(max(0.01, 10 * noise_rev), rel=0.25)


def torques(*parts: tuple[float, float, float]) -> FloatArray:
    """Nm over time from (size, frequency in Hz, growth per s)."""
    t = np.arange(round((LEAD_S + 0.5) * RATE)) / RATE
    waves = [size * np.sin(2 * np.pi * hz * t) * np.exp(rate * t) for size, hz, rate in parts]
    return np.asarray(np.sum(waves, axis=0))


def test_a_torque_that_grows_with_the_place_is_no_onset() -> None:
    """A ripple that is larger at the end of the way is so with any gain."""
    place = (4e-3, 40.0, 9.0)
    present, settings = stepped(100.0, torque_nm=torques(place)), StepSettings(ENVELOPE)
    raised = stepped(100.0, torque_nm=torques(place, (2e-3, 310.0, 0.0)))
    step = judged(raised, present, settings, 7.0)
    assert step.stable
    assert step.oscillation_percent < 0.3


@pytest.mark.parametrize("growth", [0.0, 15.0])
def test_an_oscillation_beside_it_is_one(growth: float) -> None:
    place = (4e-3, 40.0, 9.0)
    present, settings = stepped(100.0, torque_nm=torques(place)), StepSettings(ENVELOPE)
    size = 0.3 if growth == 0.0 else 3e-3
    raised = stepped(100.0, torque_nm=torques(place, (size, 180.0, growth)))
    assert not judged(raised, present, settings, 7.0).stable
