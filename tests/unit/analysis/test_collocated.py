"""Where a recording contradicts that torque and speed belong to one shaft."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from backend.analysis.response.foreign_recordings.collocated import contradiction
from backend.analysis.response.foreign_recordings.foreign import ForeignResponse
from backend.analysis.response.foreign_recordings.repeat_band import RepeatBand

F = np.arange(10.0, 110.0)


def response(lag_deg: np.ndarray, std_deg: np.ndarray) -> ForeignResponse:
    one, nothing = np.ones(F.size), np.zeros(F.size)
    band = RepeatBand(nothing, np.radians(std_deg), nothing, nothing)
    fit: Any = None
    return ForeignResponse(
        F, np.exp(-1j * np.radians(lag_deg)), one, nothing, nothing, band, fit, (), "periodic",
        "periods", 1.0, 5, 1, (F[0], F[-1]), 0.0,
    )  # fmt: skip


def test_a_single_line_refutes_nothing_and_is_not_what_is_shown() -> None:
    lag, std = np.full(F.size, 80.0), np.full(F.size, 1.0)
    lag[20] = 160.0
    assert contradiction(response(lag, std), None, 0.0) is None
    lag[60:66] = [108.0, 112.0, 118.0, 115.0, 110.0, 107.0]
    found = contradiction(response(lag, std), None, 0.0)
    assert found is not None
    assert found.frequency_hz == F[62]
    assert found.phase_deg == pytest.approx(-118.0)


def test_a_line_that_is_not_known_is_not_what_is_shown() -> None:
    lag, std = np.full(F.size, 80.0), np.full(F.size, 1.0)
    lag[60:66] = [108.0, 112.0, 118.0, 115.0, 110.0, 107.0]
    std[5] = np.nan
    found = contradiction(response(lag, std), None, 0.0)
    assert found is not None
    assert found.frequency_hz == F[62]


def test_lines_within_their_bands_refute_nothing() -> None:
    lag = np.full(F.size, 115.0)
    assert contradiction(response(lag, np.full(F.size, 10.0)), None, 0.0) is None
