"""Torque that a speed loop makes of its reference, identified from a recording.

The loop makes its torque of the reference minus the speed, both by K·(1 + a/s). K and K·a are
the only two numbers common to all lines: with hold, delay and current loop tried as for a path
they are the coefficients of two columns in a least-squares problem.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.response.signal_path.path_fit import PathFit, ranked
from backend.analysis.response.signal_path.sampled_model import LoopModel, SampledFit
from backend.analysis.response.signal_path.sampling import (
    Hold,
    SignalPath,
    sampled_command_response,
    sampled_integral_response,
)
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.signals.line_spectra import Record
from backend.analysis.thresholds import reference_gain as threshold

_TURN = 2 * np.pi


@dataclass(frozen=True)
class ReferenceLoop:
    """A speed loop's controller, and the path from its reference to the torque."""

    controller: LoopModel
    path: SignalPath

    def alike(self, other: ReferenceLoop) -> bool:
        """Return whether mechanics identified with the other one would be the same."""
        corners = (p.current_bandwidth_hz or np.inf for p in (self.path, other.path))
        first, second = (1.0 / corner for corner in corners)
        gain = abs(other.controller.c0 / self.controller.c0 - 1.0)
        return gain < threshold.SAME_GAIN and abs(second - first) < threshold.SAME_CORNER * max(
            first, second, 1e-9
        )


def reference_gain(
    records: tuple[Record, ...],
    path: SignalPath,
    integral_rad_s: float | None,
    *,
    hold_known: bool,
    motion: SampledFit | None = None,
) -> ReferenceLoop:
    """Return controller and path that explain the recorded torque.

    ``records`` have the reference as the sent signal, in the unit of the response.
    ``integral_rad_s`` is the corner a of the integral; None: it is fitted. ``motion`` is
    a fit of the mechanics as in `find_paths`, needed as the speed of a light axis is aliased, too.

    Raises:
        ValueError: every period has a gap, or the torque does not follow the reference.
    """
    fit = _ByReference.read(records, path, motion)
    size = float(np.linalg.norm(fit.torque * fit.weight))
    fit = replace(fit, torque=fit.torque / size, integral_rad_s=integral_rad_s)
    holds: tuple[Hold, ...] = (path.hold,) if hold_known else ("zero", "linear")
    best = ranked(fit, holds)[0]
    if integral_rad_s is None and fit.corner_rad_s(best) < _TURN * threshold.SLOWEST_HZ:
        fit = replace(fit, integral_rad_s=0.0)
        best = ranked(fit, holds)[0]
    rest = fit.rest(best)
    gain, corner = fit.gains(best)[0], fit.corner_rad_s(best)
    if gain <= 0 or float(rest @ rest) > threshold.UNRELATED:
        raise ValueError("the torque does not follow the reference: its gain cannot be read")
    return ReferenceLoop(LoopModel(gain * size, gain * size * corner), best)


@dataclass(frozen=True)
class _ByReference(PathFit):
    """The sent signal is the reference; ``integral_rad_s`` is its integral's corner where known."""

    integral_rad_s: float | None = None

    @staticmethod
    def read(
        records: tuple[Record, ...], path: SignalPath, motion: SampledFit | None
    ) -> _ByReference:
        """Return the problem with the same spectra as for a path."""
        fit = PathFit.of(records, path, True, motion)
        return _ByReference(fit.f, fit.torque, fit.velocity, fit.weight, path, True)

    def rest(self, path: SignalPath) -> FloatArray:
        """Return the torque that neither gain nor integral explain, as real and imaginary parts."""
        return np.asarray(self._target() - self._table(path) @ self.gains(path))

    def gains(self, path: SignalPath) -> FloatArray:
        """Return K, and K·a unless a is known."""
        found, *_ = np.linalg.lstsq(self._table(path), self._target(), rcond=None)
        return np.asarray(found)

    def corner_rad_s(self, path: SignalPath) -> float:
        """Return the integral's corner a."""
        if self.integral_rad_s is not None:
            return self.integral_rad_s
        gain, integral = self.gains(path)
        return float(integral / gain)

    def _target(self) -> FloatArray:
        return _parts(self.torque * self.weight)

    def _table(self, path: SignalPath) -> FloatArray:
        answered = self.answered(path)
        by_gain = sampled_command_response(self.f, path) - answered
        by_integral = sampled_integral_response(self.f, path) - answered / (1j * _TURN * self.f)
        columns = [by_gain, by_integral]
        if self.integral_rad_s is not None:
            columns = [by_gain + self.integral_rad_s * by_integral]
        return np.column_stack([_parts(column * self.weight) for column in columns])


def _parts(column: ComplexArray) -> FloatArray:
    """Real and imaginary parts in one real vector."""
    return np.concatenate([column.real, column.imag])
