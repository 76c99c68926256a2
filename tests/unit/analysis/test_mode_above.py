"""A resonance above the measured band: the last lines of a spring show it, and a design counts it.

The axis is a motor with one or two loads on springs, computed from masses and springs alone.
"""

from __future__ import annotations

import numpy as np
import pytest

from backend.analysis.loop.loop_goals import worst_of
from backend.analysis.loop.loop_structure import Gains, speed_loop
from backend.analysis.loop.measured_plant import measured_plant
from backend.analysis.loop.mode_above import modes_above
from backend.analysis.mechanics.mechanical_model import MechanicalModel
from backend.analysis.response.frf import Frf
from backend.analysis.signals.arrays import ComplexArray, FloatArray

F = np.unique(np.concatenate([np.arange(6.0, 92.0, 1.5), np.arange(93.0, 247.0, 5.0)]))


def axis(
    f: FloatArray, motor: float, loads: list[tuple[float, float]], damping: float = 0.006
) -> ComplexArray:
    """Torque to speed; ``loads`` are an inertia and the frequency of its own coupling when held."""
    s = 2j * np.pi * f
    beyond = np.zeros(f.size, np.complex128)
    for inertia, held_hz in reversed(loads):
        w = 2 * np.pi * held_hz
        spring = (w**2 + 2 * damping * w * s) * inertia
        mass = inertia * s**2 + beyond
        beyond = spring * mass / (spring + mass)
    return np.asarray(s / (motor * s**2 + beyond))


def frf_of(response: ComplexArray, seed: int = 1) -> Frf:
    rng = np.random.default_rng(seed)
    noise = 0.01 * (rng.standard_normal(F.size) + 1j * rng.standard_normal(F.size))
    same = np.ones(F.size)
    return Frf(
        F, response * np.exp(noise), 0.1 * same, 0.6 * same, 0.99 * same, same, same, 1000.0,
        (5.0, 246.0), 4, 0,
    )  # fmt: skip


#: Ten loads with an antiresonance at 90 Hz: the resonance follows at 298 Hz.
MOTOR, LOAD, HELD_HZ = 3e-5, 3e-4, 90.0
RESONANCE_HZ = HELD_HZ * np.sqrt(1.0 + LOAD / MOTOR)


@pytest.mark.parametrize("seed", range(5))
def test_a_mode_that_follows_is_among_those_that_are_possible(seed: int) -> None:
    found = modes_above(frf_of(axis(F, MOTOR, [(LOAD, HELD_HZ)]), seed), 0.8)
    assert found
    frequencies = [each.frequency_hz for each in found]
    assert min(frequencies) <= 1.02 * RESONANCE_HZ
    assert max(frequencies) >= 0.98 * RESONANCE_HZ
    assert min(frequencies) > 246.0


@pytest.mark.parametrize(
    "loads",
    [[], [(LOAD, 45.0)], [(LOAD, 1500.0)]],
    ids=["the motor alone", "its resonance is measured", "as good as rigid"],
)
def test_none_is_assumed_where_the_lines_show_no_spring(loads: list[tuple[float, float]]) -> None:
    assert modes_above(frf_of(axis(F, MOTOR, loads)), 0.8) == ()


def test_a_loop_that_crosses_at_that_mode_is_not_sound() -> None:
    """4 Hz on the whole axis keep 79° without the mode that follows, and less than 30° with it."""
    frf = frf_of(axis(F, MOTOR, [(LOAD, HELD_HZ)]))
    inertia = MOTOR + LOAD
    rigid = MechanicalModel(1.0 / inertia, 1e-3)
    alone = (MechanicalModel(1.0 / MOTOR, 1e-3),)
    gains = Gains(2 * np.pi * 4.0 * inertia, 0.4, 4.0, 4.0)

    def worst_deg(f: FloatArray, plants: ComplexArray) -> float:
        fixed = np.exp(-2j * np.pi * f * 800e-6)
        return worst_of(speed_loop(f, plants, fixed, gains)).phase_margin_deg

    dense = np.geomspace(1.0, 6000.0, 20_000)
    true_deg = worst_deg(dense, axis(dense, MOTOR, [(LOAD, HELD_HZ)])[None, :])
    assert true_deg < 30.0
    without = measured_plant(frf, rigid, variants=alone, fitted=False)
    assert worst_deg(without.frequency_hz, without.shifted()) > 60.0
    above = modes_above(frf, 0.8)
    plant = measured_plant(frf, rigid, variants=alone, fitted=False, above=above)
    assert worst_deg(plant.frequency_hz, plant.shifted()) < true_deg + 5.0
