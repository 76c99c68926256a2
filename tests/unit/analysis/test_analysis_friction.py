"""Friction that noise hides, and noise that is none, from spectra whose truth is set."""

from dataclasses import replace

import numpy as np
import pytest

from backend.analysis.mechanics.friction import estimate_coulomb
from backend.analysis.response.signal_path.sampling import SignalPath
from backend.analysis.signals.line_spectra import LineSpectra, continuous_input, friction_input

PATH = SignalPath(1000.0)
LINES = np.arange(4, 124)
SAMPLES = 800


def _spectra(coulomb_nm, seed):
    """Four realisations of two periods: 20 mNm a line, noise of 12 mNm, a rigid 1e-4 kg·m²."""
    rng = np.random.default_rng(seed)

    def normal(rows):
        parts = rng.normal(size=(2, rows, LINES.size)) / np.sqrt(2.0)
        return (parts[0] + 1j * parts[1]) * SAMPLES / 2

    f = LINES * 1000.0 / SAMPLES
    turns = rng.uniform(0.0, 2 * np.pi, (4, LINES.size))
    sent = tuple(np.tile(0.02 * np.exp(1j * t) * SAMPLES / 2, (2, 1)) for t in turns)
    direction = tuple(np.tile(0.05 * normal(1), (2, 1)) for _ in range(4))
    s = LineSpectra(f, LINES, sent, (), (), direction, (0, 0, 1, 1), SAMPLES, 8, 0)
    inputs = continuous_input(s, PATH, "torque_mode")
    taken = friction_input(s, PATH, "torque_mode", inputs)
    plant = 1.0 / (2j * np.pi * f * 1e-4)
    response = [
        plant * (u - coulomb_nm * d + 0.012 * normal(2)) for u, d in zip(inputs, taken, strict=True)
    ]
    return replace(s, response=tuple(response))


def test_friction_is_found_that_makes_a_twentieth_of_the_scatter():
    """(40 mNm · 0.05)² next to 12² / 2 mNm² of noise, known to 1/6 from 120 lines of 3 draws."""
    found = [estimate_coulomb(_spectra(0.04, seed), PATH, "torque_mode") for seed in range(12)]
    assert min(found) > 0.0
    assert np.mean(found) == pytest.approx(0.04, rel=0.15)


def test_noise_is_hardly_ever_taken_for_friction():
    """Three deviations to one side: once in 700."""
    found = [estimate_coulomb(_spectra(0.0, seed), PATH, "torque_mode") for seed in range(40)]
    assert np.count_nonzero(found) <= 1
