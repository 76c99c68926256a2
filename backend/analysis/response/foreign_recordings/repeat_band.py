"""The band of a response: the range in which a repeated run of the same machine puts each line.

Noise between periods is its smallest part. Friction, backlash, ripple and the measured current
distort each line by an amount that depends on the excitation's phases (stochastic nonlinear
contribution, Pintelon & Schoukens 2012, section 3.4): in a single recording it appears as roughness
from line to line, and on lines that are not excited. A second run has its own distortion, whose
variance adds. Changes with the level are smooth over the lines and not visible in one run; they are
included by what friction and backlash can move: the pole of friction, and frequency and damping of
modes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.analysis.response.foreign_recordings.local_polynomial import smooth_residual
from backend.analysis.response.foreign_recordings.modes_found import FoundMode
from backend.analysis.response.foreign_recordings.product_model import ProductModel, jacobian
from backend.analysis.signals.arrays import ComplexArray, FloatArray, neighbour_mean
from backend.analysis.thresholds import repeat_band as threshold

MODE_SHIFT = threshold.MODE_SHIFT
DAMPING_SHIFT = threshold.DAMPING_SHIFT
FRICTION_SHIFT = threshold.FRICTION_SHIFT
_GAIN = float(np.hypot(threshold.BY_TEMPERATURE, threshold.BY_PLACE))
#: Phase error from sampling, rad.
_TURN = 0.01
#: Factor on the variance for the difference of two runs: at half the level noise and friction
#: distortion are twice as large relative to the lines, so the other run has four times the
#: variance.
_BOTH = 1.0 + 2.0**2


@dataclass(frozen=True)
class RepeatBand:
    """Deviations [lines] of the logarithm: ``real`` (magnitude) and ``imag`` (phase, radians).

    ``scatter`` is the stochastic deviation of one run's line, per component;
    ``level`` the possible change with the level, both components.
    """

    real: FloatArray
    imag: FloatArray
    scatter: FloatArray
    level: FloatArray


def line_scatter(left: ComplexArray, known: FloatArray) -> FloatArray:
    """Return the scatter [lines] per component, from the logarithm's residual of a model.

    ``known`` [lines] is the part that noise explains, which is the lower limit.
    """
    rough, kept = smooth_residual(left, threshold.REACH)
    variance = neighbour_mean(np.abs(rough) ** 2 / (2.0 * np.maximum(kept, 0.2)), threshold.POOL)
    return np.asarray(np.sqrt(np.maximum(variance, known**2)))


def repeat_band(
    f: FloatArray, scatter: FloatArray, model: ProductModel | None, modes: tuple[FoundMode, ...]
) -> RepeatBand:
    """Return the band from the scatter of the lines and the possible changes with the level."""
    real = np.full(f.size, _GAIN**2)
    imag = np.full(f.size, _TURN**2)
    if model is not None:
        for change in _level_changes(f, model, modes):
            real = real + change.real**2
            imag = imag + change.imag**2
    both = _BOTH * scatter**2
    return RepeatBand(
        np.sqrt(both + real), np.sqrt(both + imag), scatter, np.sqrt(0.5 * (real + imag))
    )


def _level_changes(
    f: FloatArray, model: ProductModel, modes: tuple[FoundMode, ...]
) -> list[ComplexArray]:
    slopes = jacobian(model, f)
    first = 2 + len(model.poles_hz)
    changes: list[ComplexArray] = []
    for mode in modes:
        column = first + 2 * mode.pair
        changes.append(np.asarray(MODE_SHIFT * slopes[:, column]))
        changes.append(np.asarray(DAMPING_SHIFT * slopes[:, column + 1]))
    lowest = min(model.poles_hz, default=np.inf)
    if lowest < threshold.FRICTION_BELOW * f[0]:
        # The pole moves while the inertia, and so the gain well above it, stays.
        changes.append(np.asarray(-FRICTION_SHIFT / (1.0 + 1j * f / lowest)))
    return changes
