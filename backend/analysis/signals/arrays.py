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


def running_mean(x: FloatArray, first: int, width: int) -> FloatArray:
    """Mean of ``width`` values from ``first`` before each, in one pass; zeros beyond the ends.

    Rounding is that of the sum of all ``x``: for values that are compared with the largest ones.
    """
    sums = np.concatenate([[0.0], np.cumsum(x)])
    at = np.arange(x.size) - first
    return np.asarray((sums[np.clip(at + width, 0, x.size)] - sums[np.clip(at, 0, x.size)]) / width)
