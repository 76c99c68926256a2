"""Lines hidden by friction: the inertia that moves showed, and the model next to such lines."""

from dataclasses import replace

import numpy as np
import pytest

from backend.analysis.loop.measured_plant import measured_plant
from backend.analysis.mechanics.identification import model_fit
from backend.analysis.mechanics.identification.fit_problem import (
    CHAIN,
    MODAL,
    Found,
    KnownInertia,
    Problem,
)
from backend.analysis.mechanics.identification.model_fit import fit_sampled_model
from backend.analysis.mechanics.mechanical_model import MechanicalModel
from backend.analysis.response.frf import Frf
from backend.analysis.response.signal_path.sampled_model import LoopModel, seen_response
from backend.analysis.response.signal_path.sampling import SignalPath
from backend.analysis.signals.arrays import FloatArray

MOTOR, LOAD = 7e-5, 1.27e-4
#: Antiresonance at 9.3 Hz, resonance at 15.6 Hz.
CHAIN_X = np.array([
    np.log(MOTOR), np.log(1e-4), 0.0, 0.0, np.log(2000.0),
    np.log(LOAD), np.log(0.433), np.log(2e-4),
])  # fmt: skip
PATH = SignalPath(2000.0)
LINES = np.arange(6.15, 600.0, 1.54)
HIDDEN = LINES < 22.0


def measured(seed: int, clear: float = 0.02) -> Frf:
    """Lines known to ``clear`` of themselves, those below 22 Hz to half."""
    rng = np.random.default_rng(seed)
    relative = np.where(HIDDEN, 0.5, clear)
    noise = relative * (rng.standard_normal(LINES.size) + 1j * rng.standard_normal(LINES.size))
    seen = seen_response(LINES, CHAIN.model(CHAIN_X), 0.0, PATH, LoopModel())
    none = np.zeros(LINES.size)
    std_db, std_deg = 20.0 / np.log(10.0) * relative, np.degrees(relative)
    return Frf(
        LINES, seen * np.exp(noise), std_db, std_deg, none + 1.0, none, none, 2000.0,
        (5.0, 800.0), 4, 0,
    )  # fmt: skip


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("seed", range(4))
def test_lines_that_hide_the_whole_inertia_leave_what_moves_reported_of_it(seed: int) -> None:
    frf, whole = measured(seed), MOTOR + LOAD
    plain = fit_sampled_model(frf, PATH, max_modes=2).fit.model
    model = fit_sampled_model(frf, PATH, max_modes=2, inertia=KnownInertia(whole, 0.005)).fit.model
    assert model.gain * whole == pytest.approx(1.0, abs=0.06)
    assert abs(np.log(model.gain * whole)) <= abs(np.log(plain.gain * whole)) + 0.01
    true = CHAIN.model(CHAIN_X).response(LINES)
    above = LINES > 12.0
    assert np.median(np.abs(model.response(LINES) / true - 1.0)[above & HIDDEN]) < 0.15


def test_an_inertia_that_moves_hardly_reported_holds_nothing() -> None:
    frf, wrong = measured(0), 2.0 * (MOTOR + LOAD)
    plain = fit_sampled_model(frf, PATH, max_modes=2).fit.model
    vague = KnownInertia(wrong, 5.0)
    model = fit_sampled_model(frf, PATH, max_modes=2, inertia=vague).fit.model
    assert model.gain == pytest.approx(plain.gain, rel=0.1)


@pytest.mark.long
def test_without_the_inertia_such_lines_leave_it_open() -> None:
    found = [fit_sampled_model(measured(n), PATH, max_modes=2).fit.model.gain for n in range(4)]
    assert max(abs(np.log(g * (MOTOR + LOAD))) for g in found) > 0.15


@pytest.mark.parametrize("form", [CHAIN, MODAL])
def test_the_slopes_of_the_whole_inertia_are_those_of_its_value(form) -> None:
    x = CHAIN_X if form is CHAIN else np.append(CHAIN_X, 0.0)
    value, slopes = form.inertia(x)
    for n in range(x.size):
        moved = x.copy()
        moved[n] += 1e-6
        assert (form.inertia(moved)[0] - value) / 1e-6 == pytest.approx(slopes[n], abs=1e-5)
    whole = MOTOR + LOAD if form is CHAIN else 1.0 / MOTOR
    assert np.exp(value) == pytest.approx(whole)


def plant_beside(std_deg: float, *, fitted: bool = True) -> np.ndarray:
    """Where the plant lies between a rigid model (0) and lines that are twice as large (1)."""
    model = MechanicalModel(5e3, 0.1)
    same = np.ones(LINES.size)
    size_db = 20.0 / np.log(10.0) * np.radians(std_deg)
    frf = replace(
        measured(0),
        response=2.0 * model.response(LINES),
        std_db=size_db * same,
        std_deg=std_deg * same,
    )
    plant = measured_plant(frf, model, fitted=fitted)
    inside = (plant.frequency_hz > 10.0) & (plant.frequency_hz < 500.0)
    return np.log(np.abs(plant.correction[inside])) / np.log(2.0)


@pytest.mark.parametrize(
    ("std_deg", "share"), [(1.0, 0.99), (10.0, 0.5), (40.0, 0.06), (np.nan, 1.0)]
)
def test_a_line_counts_beside_the_model_as_exactly_as_it_is_known(
    std_deg: float, share: float
) -> None:
    assert np.mean(plant_beside(std_deg)) == pytest.approx(share, abs=0.01)


def test_a_model_that_is_not_fitted_to_the_lines_takes_nothing_from_them() -> None:
    assert np.mean(plant_beside(40.0, fitted=False)) == pytest.approx(1.0, abs=1e-6)


def test_noise_is_not_searched_for_a_delay(monkeypatch: pytest.MonkeyPatch) -> None:
    """A misfit of 8 % is the noise of lines known to 8 %; of lines known to 2 % it may be one."""
    begun: list[float] = []
    grown = model_fit._grown

    def counted(problem: Problem, start: FloatArray, max_modes: int) -> Found:
        begun.append(float(start[2]))
        return grown(problem, start, max_modes)

    monkeypatch.setattr(model_fit, "_grown", counted)
    noisy = measured(0, clear=0.08)
    found = fit_sampled_model(noisy, PATH, max_modes=1).fit
    assert found.error > 0.05
    assert begun == [0.0]
    late = replace(noisy, std_db=noisy.std_db / 4.0, std_deg=noisy.std_deg / 4.0)
    fit_sampled_model(late, PATH, max_modes=1)
    assert max(begun) == 3.0
