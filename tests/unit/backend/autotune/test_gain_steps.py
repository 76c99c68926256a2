"""Raised gains of a simulated loop: what is stable is seen as stable, what is not never is.

The loop is simulated in time, with delay, noise, a torque limit and a load that swings; what it
does with a gain is known from its gain margin, which is computed from the same parameters at all
frequencies. Nothing of it is shared with the judgement.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import pytest
import scipy

from backend.axes.axis.axis import Envelope
from backend.tools.measuring.figures import figures_of
from backend.tools.moving.step.evaluate import LEAD_S, StepResult, StepSettings
from backend.tools.thresholds import autotune_gain_steps as threshold
from backend.tools.tuning.autotune.result import GainStepsInfo
from backend.tools.tuning.autotune.verification.gain_steps import (
    GainStep,
    GainSteps,
    judged,
    levels_to,
)

FloatArray = npt.NDArray[np.float64]
SETTINGS = StepSettings(Envelope(4.0, 1500.0, 100.0, 60.0))
STEP_S, RATED_NM, LIMIT_NM = 50e-6, 1.3, 3.9
MOTOR, LOAD = 3e-5, 4.5e-4
AXES = 10


@dataclass(frozen=True)
class Loop:
    """A motor with a load on a spring; gain in Nm·s, delay in steps, noise of the speed in rad/s.

    The load swings at ``swing_hz`` where the motor is held, which is what a stiff loop does.
    """

    gain: float
    delay: int = 12
    noise: float = 0.0
    swing_hz: float = 28.0
    damping: float = 0.04

    @property
    def spring(self) -> tuple[float, float]:
        w = 2 * np.pi * self.swing_hz
        return LOAD * w**2, 2 * self.damping * w * LOAD

    def gain_margin_db(self) -> float:
        """Over all frequencies of the loop in steps; the speed is one step late by itself."""
        f = np.linspace(100.0, 5000.0, 200_000)
        s = 2j * np.pi * f
        k, d = self.spring
        plant = (LOAD * s**2 + d * s + k) / (
            s * (MOTOR * LOAD * s**2 + (MOTOR + LOAD) * (d * s + k))
        )
        held = (1 - np.exp(-s * STEP_S)) / (s * STEP_S)
        loop = self.gain * plant * held * np.exp(-s * STEP_S * self.delay)
        crosses = np.flatnonzero((loop.imag[1:] > 0) != (loop.imag[:-1] > 0))
        levels = [-loop.real[i] for i in crosses if loop.real[i] < 0]
        return float(-20 * np.log10(max(levels)))

    def steps(self, seed: int, rpm: float = 100.0) -> list[StepResult]:
        """The torque of `AXES` steps at once, sampled at 1 kHz: what is faster is folded."""
        count = round((LEAD_S + 2 * SETTINGS.hold_s) / STEP_S)
        rng = np.random.default_rng(seed)
        k, d = self.spring
        motor, load, turn = np.zeros(AXES), np.zeros(AXES), np.zeros(AXES)
        given = np.zeros((self.delay, AXES))
        torque = np.zeros((count, AXES))
        demand = np.zeros(count)
        begin, end = round(LEAD_S / STEP_S), round((LEAD_S + SETTINGS.hold_s) / STEP_S)
        demand[begin:end] = rpm * 2 * np.pi / 60
        for i in range(count):
            seen = motor + rng.normal(size=AXES) * self.noise
            wanted = np.clip(self.gain * (demand[i] - seen), -LIMIT_NM, LIMIT_NM)
            acts = given[i % self.delay].copy()
            given[i % self.delay] = wanted
            between = k * turn + d * (motor - load)
            motor += (acts - between) / MOTOR * STEP_S
            load += between / LOAD * STEP_S
            turn += (motor - load) * STEP_S
            torque[i] = acts
        every = round(1e-3 / STEP_S)
        time = np.arange(count)[::every] * STEP_S
        percent = torque[::every] / RATED_NM * 100.0
        none = np.zeros(time.size)
        return [
            StepResult("speed", time, none, none, column, None, None, 0.0, 0.0)
            for column in percent.T
        ]


def with_margin(db: float, **options: float) -> Loop:
    """The loop with this gain margin."""
    first = Loop(0.01, **options)  # type: ignore[arg-type]
    gain = 0.01 * 10 ** ((first.gain_margin_db() - db) / 20.0)
    return Loop(gain, **options)  # type: ignore[arg-type]


def raised(loop: Loop, db: float) -> Loop:
    return Loop(loop.gain * 10 ** (db / 20.0), loop.delay, loop.noise, loop.swing_hz, loop.damping)


def seen_stable(loop: Loop, db: float, seed: int = 1) -> float:
    """Share of steps with so much more gain that are judged stable."""
    pairs = zip(loop.steps(seed), raised(loop, db).steps(seed + 1), strict=True)
    return float(np.mean([judged(step, now, SETTINGS, db).stable for now, step in pairs]))


def test_the_simulated_loop_has_the_margin_that_is_computed() -> None:
    """Just below its margin it stays bounded, just above it does not."""
    loop = with_margin(10.0)

    def last(db: float) -> float:
        return float(np.std(raised(loop, db).steps(0)[0].torque_percent[-100:]))

    assert last(9.5) < 3.0
    assert last(10.3) > 30.0


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("noise", [0.0, 0.7])
@pytest.mark.parametrize("left_db", [2.0, 4.0])
@pytest.mark.parametrize("swing_hz", [14.0, 60.0])
def test_a_loop_that_has_margin_left_is_stable(
    noise: float, left_db: float, swing_hz: float
) -> None:
    """Noise rises with the gain, and a heavy load swings longer the stiffer the motor is held."""
    loop = with_margin(9.0 + left_db, noise=noise, swing_hz=swing_hz)
    assert seen_stable(loop, 9.0) == 1.0


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("noise", [0.0, 0.3])
@pytest.mark.parametrize("beyond_db", [0.3, 2.0])
@pytest.mark.parametrize("delay", [6, 12, 20])
def test_an_unstable_loop_is_never_stable(noise: float, beyond_db: float, delay: int) -> None:
    """Phase crossovers from 250 to 800 Hz: the upper ones are folded by a sample every 1 ms."""
    loop = with_margin(7.0 - beyond_db, noise=noise, delay=delay)
    assert seen_stable(loop, 7.0) == 0.0


def shown(after: FloatArray, before: FloatArray) -> GainStep:
    """Torques in % of the rated during the second half of the hold, 1 kHz."""

    def step(part: FloatArray) -> StepResult:
        time = np.arange(round((LEAD_S + SETTINGS.hold_s) * 1000.0)) / 1000.0
        torque = np.zeros(time.size)
        torque[-part.size :] = part
        none = np.zeros(time.size)
        return StepResult("speed", time, none, none, torque, None, None, 0.0, 0.0)

    return judged(step(after), step(before), SETTINGS, 9.0)


T = np.arange(125) / 1000.0
NOISE = np.random.default_rng(8).normal(size=(400, 125))


@pytest.mark.parametrize("hz", [12.0, 30.0, 75.0])
def test_what_decays_is_no_oscillation(hz: float) -> None:
    """A swing of 3.9 % at first that falls to half within 63 ms, next to noise of 0.26 %.

    It comes to 2.0 % over all, more than 2.5 times the noise with 9 dB (1.8 %).
    """
    swing = 3.9 * np.exp(-T * np.log(2.0) / 0.0625) * np.sin(2 * np.pi * hz * T)
    stable = [
        shown(swing + 0.26 * 2.8 * after, 0.26 * before).stable
        for before, after in zip(NOISE[:100], NOISE[100:200], strict=True)
    ]
    assert np.std(swing) > 1.4
    assert np.mean(stable) >= 0.99


@pytest.mark.parametrize("hz", [30.0, 180.0, 430.0])
def test_an_oscillation_that_settles_at_a_size_of_its_own_is_one(hz: float) -> None:
    """It begins larger, and goes on: backlash and saturation make such limit cycles."""
    shrinks = 3.0 + 9.0 * np.exp(-T / 0.02)
    cycle = shrinks * np.sin(2 * np.pi * hz * T)
    assert not any(shown(cycle + 0.5 * n, 0.2 * n[::-1]).stable for n in NOISE[:50])


def test_noise_that_rises_with_the_gain_is_seldom_an_oscillation() -> None:
    """White, and of a resonance 40 Hz wide, as 2 dB of margin make of it: 400 steps of each."""
    b, a = scipy.signal.iirpeak(300.0, 300.0 / 40.0, fs=1000.0)
    narrow = scipy.signal.lfilter(b, a, np.random.default_rng(3).normal(size=(400, 600)))[:, -125:]
    narrow *= np.sqrt(2.0) / np.std(narrow)
    for after in (NOISE, 0.7 * NOISE[::-1] + narrow):
        pairs = zip(1.0 * NOISE, 2.8 * after, strict=True)
        alarms = sum(not shown(raised, now).stable for now, raised in pairs)
        # Ten of 400 would be 2.5 %.
        assert alarms <= 2


def test_a_step_that_the_drive_ended_is_part_of_the_result() -> None:
    ended = GainSteps(6.0, 9.0, (GainStep(6.0, 0.4, True), GainStep(9.0, float("inf"), False)))
    shown = GainStepsInfo.model_validate(figures_of(ended))
    assert [each.oscillation_percent for each in shown.steps] == [0.4, None]
    assert shown.onset_db == 9.0


@pytest.mark.parametrize(
    ("wanted_db", "surely_db", "levels"),
    [
        (9.0, 0.0, [2.25, 4.5, 6.75, 9.0]),
        (9.0, 20.0, [4.5, 9.0]),
        (20.0, 12.0, [4.0, 8.0, 12.0, 14.0, 16.0, 18.0, 20.0]),
        (6.0, 1.0, [2.0, 4.0, 6.0]),
        (1.5, 0.0, [1.5]),
    ],
)
def test_gains_that_no_possible_loop_is_unstable_with_are_passed_in_larger_steps(
    wanted_db: float, surely_db: float, levels: list[float]
) -> None:
    found = levels_to(wanted_db, surely_db)
    assert found == pytest.approx(levels)
    # Beyond them each raise is as small as without them.
    beyond = [b - a for a, b in pairwise([0.0, *found]) if b > surely_db + 1e-9]
    assert max(beyond, default=0.0) <= threshold.STEP_DB + 1e-9
