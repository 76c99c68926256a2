"""Corner of a speed loop's integral from a recording, where no gain of the drive has a meaning.

The loop makes its torque of the reference less the speed, both by K·(1 + a/s). With hold, delay
and current loop tried on a grid, K and K·a are linear: two columns of least squares.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from backend.analysis.arrays import ComplexArray, FloatArray
from backend.analysis.line_spectra import Record, mean_spectra
from backend.analysis.sampling import (
    Hold,
    SignalPath,
    delay_response,
    lag_response,
    sampled_command_response,
)

_TURN = 2 * np.pi
#: Torque and speed are trusted as samples of what is there up to this share of the sample rate.
_TRUSTED = 0.2
_CORNERS_HZ = np.geomspace(250.0, 4000.0, 5)
_CYCLES = np.arange(0.0, 3.01, 0.25)
#: A slower integral than this makes no torque worth speaking of within a measurement.
_SLOWEST_HZ = 0.2


def integral_hz(records: tuple[Record, ...], path: SignalPath) -> float | None:
    """a/2π of K·(1 + a/s); None where the torque shows no integral.

    ``records`` hold the reference in rad/s as their excitation, velocity and torque.

    Raises:
        ValueError: every period has a gap, or there is no torque.
    """
    f, sent, torque, velocity = mean_spectra(records)
    use = f <= _TRUSTED * path.sample_rate_hz
    f, sent = f[use], sent[use]
    weight = np.sqrt(sent / np.sum(sent))
    torque, velocity = torque[use] / sent, velocity[use] / sent
    goal = _parts(torque * weight)
    best: tuple[float, float, float] | None = None
    holds: tuple[Hold, ...] = ("zero", "linear")
    known = path.current_bandwidth_hz
    corners = _CORNERS_HZ if known is None else [known]
    for hold, cycles, corner in itertools.product(holds, _CYCLES, corners):
        tried = replace(
            path, hold=hold, command_delay_s=float(cycles) / path.sample_rate_hz,
            current_bandwidth_hz=float(corner),
        )  # fmt: skip
        table = _columns(f, velocity, tried) * weight
        table = np.column_stack([_parts(column) for column in table])
        found, *_ = np.linalg.lstsq(table, goal, rcond=None)
        rest = float(np.sum((table @ found - goal) ** 2))
        if found[0] > 0 and (best is None or rest < best[0]):
            best = rest, float(found[0]), float(found[1])
    if best is None:
        return None
    corner_hz = best[2] / best[1] / _TURN
    return corner_hz if corner_hz > _SLOWEST_HZ else None


def _columns(f: FloatArray, velocity: ComplexArray, path: SignalPath) -> ComplexArray:
    """Torque per unit of K and of K·a, [2, lines]."""
    s = 1j * _TURN * f
    given = sampled_command_response(f, path)
    # The reference is held, so its integral over a cycle is that of the trapezoid rule.
    summed = 0.5j / path.sample_rate_hz / np.tan(-np.pi * f / path.sample_rate_hz)
    answered = velocity * lag_response(f, path.current_bandwidth_hz)
    answered = answered * delay_response(f, path.loop_delay_s)
    return np.asarray([given - answered, given * summed - answered / s])


def _parts(column: ComplexArray) -> FloatArray:
    """Real and imaginary parts in one real vector."""
    return np.concatenate([column.real, column.imag])
