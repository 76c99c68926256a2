"""A notch is found with a closed speed loop, whatever friction and the mechanics do meanwhile.

The loop is played step by step at 20 kHz here; nothing is shared with the estimator but the
notch's transfer function as it is printed (004:3494-3499).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.signal import cont2discrete

from backend.analysis.loop.measured_plant import MeasuredPlant
from backend.analysis.loop.notch import Notch
from backend.analysis.loop.notch_effect import LoopLines, fit_effect_in_loop
from backend.analysis.mechanics.mechanical_model import MechanicalModel, Mode
from backend.analysis.response.signal_path.sampled_model import LoopModel
from backend.analysis.response.signal_path.sampling import SignalPath
from backend.tools.tuning.notch.in_loop import safe_centre_hz

TURN = 2 * np.pi
RATE, STEPS, PERIOD, PERIODS = 2000.0, 10, 1300, 4
DT = 1.0 / RATE / STEPS
LINES = np.arange(4, 520, 2)
KP, CORNER = 0.03, TURN * 4.0
"""Crossover at about 30 Hz with the inertia below."""
INERTIA, COULOMB, CURRENT_HZ = 1.5e-4, 0.04, 1000.0
PATH = SignalPath(RATE, current_bandwidth_hz=CURRENT_HZ)
LOOP = LoopModel(KP, KP * CORNER)


@dataclass
class _Biquad:
    b: list[float]
    a: list[float]
    x: tuple[float, float] = (0.0, 0.0)
    y: tuple[float, float] = (0.0, 0.0)

    def __call__(self, now: float) -> float:
        out = self.b[0] * now + self.b[1] * self.x[0] + self.b[2] * self.x[1]
        out -= self.a[1] * self.y[0] + self.a[2] * self.y[1]
        self.x, self.y = (now, self.x[0]), (out, self.y[0])
        return out


def biquad(notch: Notch | None) -> _Biquad:
    if notch is None:
        return _Biquad([1.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    w, g, d = TURN * notch.center_hz, TURN * notch.width_hz, 10 ** (notch.depth_db / 20)
    b, a, _ = cont2discrete(([1.0, d * g, w * w], [1.0, g, w * w]), DT, "bilinear")
    return _Biquad([float(x) for x in np.ravel(b)], [float(x) for x in a])


def reference_rad_s() -> np.ndarray:
    """One period: all lines alike, peak 3 rad/s."""
    spectrum = np.zeros(PERIOD // 2 + 1, np.complex128)
    spectrum[LINES] = np.exp(2j * np.pi * np.random.default_rng(1).random(LINES.size))
    one = np.fft.irfft(spectrum, PERIOD)
    return np.asarray(3.0 * one / np.max(np.abs(one)))


def played(notch: Notch | None, *, noise_nm: float = 0.0, seed: int = 7) -> LoopLines:
    """A rigid axis with friction and a load that pulls, under its PI speed loop."""
    rng, one = np.random.default_rng(seed), reference_rad_s()
    slow = 15.0 * np.sin(TURN * np.arange(PERIOD) / PERIOD)
    through, lag = biquad(notch), float(np.exp(-TURN * CURRENT_HZ * DT))
    speed, torque, integral = 0.0, 0.2, 0.2
    seen = np.zeros((PERIODS * PERIOD, 2))
    for k in range(PERIODS * PERIOD):
        seen[k] = torque, speed
        reference = float(one[k % PERIOD] + slow[k % PERIOD])
        for _ in range(STEPS):
            error = reference - speed
            integral += KP * CORNER * error * DT
            wanted = through(KP * error + integral)
            torque = wanted + (torque - wanted) * lag
            pull = 0.2 + COULOMB * float(np.tanh(speed / 0.02))
            speed += (torque - pull) / INERTIA * DT
    seen[:, 0] += noise_nm * rng.normal(size=len(seen))
    blocks = np.fft.rfft(seen.reshape(PERIODS, PERIOD, 2)[1:], axis=1)[:, LINES]
    return LoopLines.of(np.fft.rfft(one)[LINES], blocks[..., 0], blocks[..., 1])


FREQUENCY_HZ = LINES * RATE / PERIOD
PLAIN = played(None)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    "truth", [Notch(240.0, 120.0, -30.0), Notch(240.0, 36.0, -14.0), Notch(150.0, 240.0, -8.0)]
)
def test_a_notch_is_read_beside_a_closed_loop(truth: Notch) -> None:
    found = fit_effect_in_loop(FREQUENCY_HZ, PLAIN, played(truth), LOOP, PATH)
    assert found.notch.center_hz == pytest.approx(truth.center_hz, rel=0.01)
    assert found.notch.width_hz == pytest.approx(truth.width_hz, rel=0.05)
    assert found.notch.depth_db == pytest.approx(
        truth.depth_db, abs=2.0 if truth.depth_db < -20 else 0.4
    )
    assert found.deviation < 0.02


def test_noise_is_stated_and_what_it_hides_is_refused() -> None:
    """White noise of σ per sample is σ·√(n/3) on a line of three periods of n samples."""
    truth, noise_nm = Notch(240.0, 120.0, -20.0), 1e-3

    def pair(noise_nm: float) -> tuple[LoopLines, LoopLines]:
        return played(None, noise_nm=noise_nm, seed=1), played(truth, noise_nm=noise_nm, seed=2)

    found = fit_effect_in_loop(FREQUENCY_HZ, *pair(noise_nm), LOOP, PATH)
    assert found.notch.width_hz == pytest.approx(120.0, rel=0.1)
    sent = float(np.median(np.abs(np.fft.rfft(reference_rad_s())[LINES])))
    # Two torques, of which hold and current loop take up to 3 dB at the upper lines.
    stated = np.sqrt(2.0) * noise_nm * np.sqrt(PERIOD / 3) / (sent * KP)
    assert stated < found.deviation < 1.6 * stated
    with pytest.raises(ValueError, match=r"lines .*known to 10%"):
        fit_effect_in_loop(FREQUENCY_HZ, *pair(noise_nm * 0.3 / stated), LOOP, PATH)


def test_a_loop_that_a_notch_does_not_change_is_said() -> None:
    with pytest.raises(ValueError, match="no effect"):
        fit_effect_in_loop(FREQUENCY_HZ, PLAIN, played(None, seed=3), LOOP, PATH)


def lag(f: np.ndarray) -> np.ndarray:
    return np.asarray(np.exp(-2j * np.pi * f * 50e-6) / (1 + 1j * f / CURRENT_HZ))


def plant(model: MechanicalModel) -> MeasuredPlant:
    f = np.geomspace(0.5, 6000.0, 3000)
    return MeasuredPlant(f, np.ones(f.size, np.complex128), model, 800.0)


def test_no_notch_is_tried_where_it_might_make_the_loop_swing() -> None:
    """Above the crossover a notch takes phase below it; the loop of twice the gain needs twice."""
    rigid = MechanicalModel(1.0 / INERTIA, 1e-3)

    def lowest(factor: float) -> float | None:
        kp = factor * KP
        return safe_centre_hz(LoopModel(kp, kp * CORNER), plant(rigid), lag)

    crossover_hz = 3 * KP / INERTIA / TURN
    stiff, stiffer = lowest(3.0), lowest(4.5)
    assert stiff is not None
    assert stiffer is not None
    assert 0.7 * crossover_hz < stiff < 2.0 * crossover_hz
    assert 1.3 < stiffer / stiff < 1.9
    # Delay and current loop alone leave this one too little for a notch more.
    assert lowest(10.0) is None
    # A mode so far up that delay and current loop turn its torque against it, and high enough.
    mode = Mode(2500.0, 0.01, 10.0 / INERTIA, 0.0)
    assert safe_centre_hz(LOOP, plant(MechanicalModel(1.0 / INERTIA, 1e-3, (mode,))), lag) is None
