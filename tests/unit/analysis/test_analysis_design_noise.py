"""What noise does to a design: little, whichever seed of a search its lines favour."""

import numpy as np
import pytest

from backend.analysis.loop.design import design
from backend.analysis.loop.loop_goals import stable
from backend.analysis.loop.loop_structure import DriveLoops
from backend.analysis.loop.measured_plant import MeasuredPlant
from backend.analysis.loop.notch import Notch
from backend.analysis.mechanics.mechanical_model import MechanicalModel, Mode

MOTOR, LOAD, STIFFNESS, DAMPING = 5e-5, 1e-4, 40.0, 3e-3
WHOLE = MOTOR + LOAD
REDUCED = MOTOR * LOAD / WHOLE
OMEGA = np.sqrt(STIFFNESS / REDUCED)
MODEL = MechanicalModel(
    1 / WHOLE,
    1e-3,
    (Mode(OMEGA / 2 / np.pi, DAMPING / REDUCED / 2 / OMEGA, LOAD / (MOTOR * WHOLE), 0.0),),
)
LOOPS = DriveLoops(1000.0, 400e-6, highest_speed_bandwidth_hz=400.0)


def by_levels(notch, f):
    """A drive with a twentieth of the centre per width level, a hundredth of what is left."""
    centre = round(notch.center_hz)
    width = max(3, round(notch.width_hz / centre * 20)) / 20 * centre
    left = max(1, round(100 * 10 ** (notch.depth_db / 20))) / 100
    return Notch(float(centre), width, 20 * np.log10(left)).response(f)


def noisy(seed):
    """The axis as measured, each of its lines off by 0.09 dB and 0.6°."""
    near = [np.geomspace(0.85 * x, 1.18 * x, 60) for x in (100.6, 174.3)]
    f = np.unique(np.concatenate([np.geomspace(1, 6000, 400), *near]))
    lines = np.log(np.geomspace(5, 400, 60))
    real, imag = np.random.default_rng(seed).normal(size=(2, 60)) * 0.01
    off = [np.interp(np.log(f), lines, part, 0, 0) for part in (real, imag)]
    return MeasuredPlant(f, np.exp(off[0] + 1j * off[1]), MODEL, 400.0)


@pytest.mark.long
@pytest.mark.timeout(300)
def test_noise_does_not_choose_between_one_notch_and_two():
    """One seed or another was worth a per cent or not: 70 Hz with one notch, 83 Hz with two."""
    found = []
    for seed in (0, 4, 5):
        table = design(noisy(seed), WHOLE, LOOPS, "medium", slots=3, notch_response=by_levels)
        found.append(next(c for c in table if "balanced" in c.marks))
    gains = [c.gains.speed_bandwidth_hz for c in found]
    assert max(gains) < 1.12 * min(gains)
    assert min(gains) > 88.0
    assert all(len(c.notches) > 1 for c in found)


def test_stability_is_what_following_the_curve_says():
    f = np.geomspace(1, 6000, 500)
    s = 2j * np.pi * f
    random = np.random.default_rng(1)
    agree = []
    for _ in range(300):
        gain, mode, zero = 2 * np.pi * random.uniform([5, 20, 20], [800, 800, 800])
        damping, delay = random.uniform([0.005, 1e-4], [0.1, 2e-3])
        top, bottom = ((s * s + 2 * damping * w * s + w * w) / (w * w) for w in (zero, mode))
        loop = gain / s * (1 + gain / 10 / s) * top / bottom * np.exp(-s * delay)
        turn = np.degrees(np.unwrap(np.angle(1 + loop)[::-1])[-1])
        agree.append((bool(stable(loop[np.newaxis])[0]), -270 < turn < 90))
    assert all(new == old for new, old in agree)
    assert {new for new, _ in agree} == {True, False}
