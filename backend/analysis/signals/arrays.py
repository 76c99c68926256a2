"""Array types that every analysis module shares."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

# The precision is numpy's own type parameter: its functions return the abstract kinds.
FloatArray = NDArray[np.floating[Any]]
ComplexArray = NDArray[np.complexfloating[Any, Any]]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def magnitude_db(response: ComplexArray) -> FloatArray:
    """20·log10 of the magnitude; zeros become about -6000 dB instead of a warning."""
    return np.asarray(20.0 * np.log10(np.maximum(np.abs(response), 1e-300)), dtype=np.float64)


def phase_deg(response: ComplexArray) -> FloatArray:
    """Unwrapped phase in degrees, the first line in (-180, 180]."""
    return np.asarray(np.degrees(np.unwrap(np.angle(response))), dtype=np.float64)


def neighbour_mean(x: FloatArray, reach: int) -> FloatArray:
    """Mean over a line and ``reach`` lines on each side (fewer at the ends)."""
    width = 2 * reach + 1
    kernel = np.ones(width)
    return np.asarray(
        np.convolve(x, kernel, "same")[: x.size]
        / np.convolve(np.ones(x.size), kernel, "same")[: x.size]
        if x.size >= width
        else np.full(x.size, np.mean(x))
    )
