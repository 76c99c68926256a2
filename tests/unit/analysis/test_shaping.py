"""Shapers against the physics of an oscillator, and against the published figures."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lsim

from backend.analysis.duty.shaping import Kind, designed, settled_s, vibration_of

RATE = 1000.0


def residual(command: np.ndarray[tuple[int], np.dtype[np.float64]], f: float, z: float) -> float:
    """Highest deviation after the command's end of an oscillator that follows it."""
    w = 2 * np.pi * f
    rest = np.concatenate([command, np.full(2000, command[-1])])
    time = np.arange(rest.size) / RATE
    _, y, _ = lsim(([w * w], [1.0, 2 * z * w, w * w]), rest, time)
    return float(np.max(np.abs(y[command.size :] - command[-1])))


@pytest.mark.parametrize("kind", ["zv", "zvd", "ei"])
@pytest.mark.parametrize(("f", "z"), [(5.0, 0.01), (9.0, 0.05), (20.0, 0.1)])
def test_the_vibration_is_gone_at_the_stated_mode(kind: Kind, f: float, z: float) -> None:
    shaper = designed(kind, f, z)
    assert np.sum(shaper.shares) == pytest.approx(1.0)
    step = np.concatenate([np.zeros(1), np.ones(1)])
    bare, shaped = residual(step, f, z), residual(shaper.applied(step, RATE), f, z)
    limit = {"zv": 0.02, "zvd": 0.02, "ei": 0.07}[kind]
    assert shaped < limit * bare


def test_how_far_off_the_frequency_may_be() -> None:
    """Singer and Seering: ZV leaves less than 5 % within ±3 % of the frequency, ZVD within ±14 %;
    EI (Singhose) within ±20 %."""
    for kind, width in (("zv", 0.03), ("zvd", 0.14), ("ei", 0.19)):
        shaper = designed(kind, 10.0, 0.0)  # type: ignore[arg-type]
        for f in (10.0 * (1 - width), 10.0 * (1 + width)):
            assert shaper.leaves(f, 0.0) < 0.0525
        assert shaper.leaves(10.0 * (1 + 1.5 * width), 0.0) > 0.05


def test_the_prediction_is_what_an_oscillator_does() -> None:
    shaper = designed("zvd", 8.0, 0.03)
    step = np.concatenate([np.zeros(1), np.ones(1)])
    for f in (6.0, 8.0, 9.5):
        # The command is longer by the delay, in which also the bare vibration decays.
        decay = np.exp(-0.03 * 2 * np.pi * f * shaper.delay_s)
        bare = residual(step, f, 0.03) * decay
        told = shaper.leaves(f, 0.03) / decay
        assert residual(shaper.applied(step, RATE), f, 0.03) == pytest.approx(
            told * bare, abs=0.03
        )


def test_a_vibration_is_found_in_noise_and_drift() -> None:
    time = np.arange(0.0, 1.2, 1.0 / RATE)
    random = np.random.default_rng(2)
    decay = np.exp(-0.04 * 2 * np.pi * 7.3 * time)
    signal = 5.0 + 2.0 * time + 3.0 * decay * np.sin(2 * np.pi * 7.3 * time + 0.4)
    found = vibration_of(signal + 0.2 * random.normal(size=time.size), RATE, 2.0, 40.0)
    assert found is not None
    assert found.frequency_hz == pytest.approx(7.3, rel=0.01)
    assert found.damping == pytest.approx(0.04, abs=0.01)
    assert found.amplitude == pytest.approx(3.0, rel=0.1)
    assert vibration_of(random.normal(size=time.size), RATE, 2.0, 40.0) is None


def test_when_a_signal_has_settled() -> None:
    time = np.arange(0.0, 2.0, 1.0 / RATE)
    signal = np.exp(-3.0 * time)
    assert settled_s(signal, RATE, 0.05) == pytest.approx(np.log(20.0) / 3.0, rel=0.05)
    assert settled_s(np.sin(20.0 * time), RATE, 0.05) is None
    assert settled_s(np.zeros(100), RATE, 0.05) == 0.0
