"""Torques with which both sides of a gantry oppose each other, where the motors are unequal."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from backend.analysis.coupled.modes import CoupledModes
from backend.tools.tuning.gantry.evaluate import Experiments, Shape, _square_rev, _steady

SHAPE = Shape(1000.0, 64, 5, 1, 16)
STIFFNESS_NM_PER_RAD = 3.0


def recorded(
    opposed_nm: float, alike_nm: float, rated_nm: tuple[float, float], friction_nm: float = 0.04
) -> Experiments:
    """Torques of both axes while they turn steadily, forwards and backwards."""
    rng = np.random.default_rng(24)
    count, n = 4, 16 + 5 * 64
    direction = np.array([1.0, -1.0, 1.0, -1.0])
    holding = np.array([alike_nm + opposed_nm, alike_nm - opposed_nm])
    torque = holding[None, :, None] + friction_nm * direction[:, None, None]
    torque = torque + rng.normal(0.0, 1e-3, (count, 2, n))
    nothing = np.zeros((0, 2), np.complex128)
    return Experiments(
        SHAPE, np.array([1, 2, 3]), np.zeros((count, 2, n)), torque, np.zeros((count, 2, n)),
        np.ones((count, n), np.bool_), direction, np.zeros((count, n)), nothing, nothing,
        np.ones((3, 2), np.complex128), True, rated_nm, True, "R",
    )  # fmt: skip


@pytest.mark.parametrize("rated_nm", [(1.27, 1.27), (1.27, 2.39), (2.39, 0.64)])
def test_what_is_out_of_square_does_not_depend_on_the_size_of_the_motors(
    rated_nm: tuple[float, float],
) -> None:
    data = recorded(0.36, 0.1, rated_nm)
    steady = _steady(data, data.records(), None)
    stiffness = SimpleNamespace(
        skew_stiffness_nm_per_rad=STIFFNESS_NM_PER_RAD, skew_stiffness_ci95=(2.97, 3.03)
    )
    square = _square_rev(data, steady, cast(CoupledModes, stiffness))
    assert square is not None
    assert square.value == pytest.approx(0.36 / STIFFNESS_NM_PER_RAD / (2 * np.pi), rel=0.01)
    assert steady.fight.value == pytest.approx(100 * 0.36 / min(rated_nm), rel=0.01)
    for each, rated, torque in zip(steady.holding, rated_nm, (0.46, -0.26), strict=True):
        assert each.value == pytest.approx(100 * torque / rated, rel=0.01)


def test_a_pull_on_both_sides_alike_is_no_opposing_torque_of_unequal_motors() -> None:
    data = recorded(0.0, 0.4, (1.27, 2.39))
    low, high = _steady(data, data.records(), None).fight.ci95
    assert low is not None
    assert high is not None
    assert low < 0.0 < high
