"""Hold, delay and current loop between the sent setpoints and the torque, from the recording.

The sampled torque follows the setpoints by a short difference equation, and with a closed loop also
the sampled speed by its controller. Both are fitted together over the lines.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from backend.analysis.response.signal_path.sampled_model import LoopModel, SampledFit
from backend.analysis.response.signal_path.sampling import (
    Hold,
    SignalPath,
    command_delay_s,
    cycles_of,
    delay_response,
    lag_response,
    sampled_command_response,
)
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.signals.line_spectra import Record, mean_spectra
from backend.analysis.thresholds import path_fit as threshold

#: Centre of the prior for the log corner of current loops, Hz.
_USUAL_CORNER = float(np.log(1000.0))
_SLOWEST, _FASTEST = float(np.log(80.0)), float(np.log(6000.0))
_CORNERS_HZ = np.geomspace(200.0, 5000.0, 6)


def find_paths(
    records: tuple[Record, ...],
    path: SignalPath,
    *,
    loop_closed: bool,
    hold_known: bool,
    motion: SampledFit | None = None,
    controller: LoopModel | None = None,
) -> tuple[SignalPath, ...]:
    """Return the paths that explain the reported torque, best first; at least one for each possible
    hold that fits equally well.

    ``path`` states what is known: its hold (``hold_known``), its current loop unless None; its
    delay is used only where no torque was recorded. The torque alone identifies interpolation only
    where the current loop is known or slow; otherwise the fit of the mechanics must. ``motion`` is
    such a fit with a path found before: it corrects for the images in the sampled torque of a
    closed loop and in the speed. ``controller`` is that of the closed loop, where it is known.

    Raises:
        ValueError: every period has a gap.
    """
    if any(r.torque is None for r in records):
        return (path,)
    holds: tuple[Hold, ...] = (path.hold,) if hold_known else ("zero", "linear")
    return ranked(PathFit.of(records, path, loop_closed, motion, controller), holds)


def path_covariance(
    records: tuple[Record, ...],
    path: SignalPath,
    *,
    loop_closed: bool,
    corner_known: bool,
    motion: SampledFit | None = None,
    controller: LoopModel | None = None,
) -> FloatArray:
    """Return how exactly the torque determines a path: cycles of delay and log of the corner.

    Covariance [2, 2], or [1, 1] without a corner. What the torque leaves open is limited by a
    prior: drives in step with the bus take setpoints at its cycles, and a corner that a drive
    reports is meant to be one of first order. ``controller`` is that of the closed loop, where it
    is known.
    """
    usual = [threshold.STEADY if at_whole_cycles(path) else threshold.UNSTEADY]
    if path.current_bandwidth_hz is not None:
        usual.append(threshold.REPORTED if corner_known else threshold.UNTOLD)
    information = np.diag(np.array(usual) ** -2.0)
    if any(r.torque is None for r in records):
        return np.asarray(np.linalg.inv(information))
    fit = PathFit.of(records, path, loop_closed, motion, controller)
    rest = fit.rest(path)
    steps = [moved_path(path, 0.02 * (n == 0), 0.02 * (n == 1)) for n in range(len(usual))]
    slopes = np.column_stack([(fit.rest(step) - rest) / 0.02 for step in steps])
    noise = max(float(rest @ rest), threshold.ROUNDING) / rest.size
    return np.asarray(np.linalg.inv(information + slopes.T @ slopes / noise))


def torque_left(records: tuple[Record, ...], path: SignalPath) -> float:
    """Return the share (RMS) of the reported torque that a path leaves unexplained, no loop."""
    fit = PathFit.of(records, path, False, None)
    rest = fit.rest(path)
    whole = fit.torque * fit.weight
    return float(np.linalg.norm(rest) / np.linalg.norm(whole))


def moved_path(path: SignalPath, cycles: float, log_corner: float) -> SignalPath:
    """Return a path with another delay, and with another corner where there is one."""
    corner = path.current_bandwidth_hz
    late_s = command_delay_s(cycles_of(path) + cycles, path.hold, path.sample_rate_hz)
    if corner is not None:
        corner *= float(np.exp(log_corner))
    return replace(path, command_delay_s=late_s, current_bandwidth_hz=corner)


def path_between(one: SignalPath, other: SignalPath) -> FloatArray:
    """Return the step of `moved_path` from one path to the other: cycles, and log of the corner."""
    cycles = (other.command_delay_s - one.command_delay_s) * one.sample_rate_hz
    corners = (other.current_bandwidth_hz or 1.0) / (one.current_bandwidth_hz or 1.0)
    return np.array([cycles, float(np.log(corners))])


def ranked(fit: PathFit, holds: tuple[Hold, ...]) -> tuple[SignalPath, ...]:
    """Return the best path of each hold that fits equally well, those of whole cycles first.

    Noise and the samples of a stiff loop's torque can make a fraction of a cycle fit better than
    the truth; therefore the best whole number of cycles of every hold is a candidate as well.
    """
    found = sorted((fit.best(hold) for hold in holds), key=lambda t: t[1])
    least = max(found[0][1], threshold.ROUNDING)
    alike = [t for t in found if t[1] < threshold.ALIKE * least]
    whole = [t for t in alike if at_whole_cycles(t[0])]
    there = {p.hold for p, _ in whole}
    pinned = [fit.best_whole(hold) for hold in holds if hold not in there]
    pinned = sorted((t for t in pinned if t[1] < threshold.ALIKE * least), key=lambda t: t[1])
    if whole:
        first = sorted([*whole, *pinned], key=lambda t: t[1])
        return tuple(p for p, _ in [*first, *(t for t in alike if t not in whole)])
    nearly = [t for t in pinned if t[1] < threshold.NEARLY * least]
    return tuple(p for p, _ in [*nearly, *alike, *(t for t in pinned if t not in nearly)])


def at_whole_cycles(path: SignalPath) -> bool:
    """Whether setpoints take effect at whole cycles of the bus, as with drives in step with it."""
    cycles = cycles_of(path)
    return abs(cycles - round(cycles)) < threshold.WHOLE


@dataclass(frozen=True)
class PathFit:
    """Fit of a path to torque and speed per unit of the sent signal, [lines]."""

    f: FloatArray
    torque: ComplexArray
    velocity: ComplexArray
    weight: FloatArray
    path: SignalPath
    loop_closed: bool
    controller: LoopModel | None = None
    """Controller of the closed loop, where it is known."""

    @staticmethod
    def of(
        records: tuple[Record, ...],
        path: SignalPath,
        loop_closed: bool,
        motion: SampledFit | None,
        controller: LoopModel | None = None,
    ) -> PathFit:
        """Return the problem for recordings, with arguments as for `find_paths`."""
        f, sent, torque, velocity = mean_spectra(records)
        size = np.sqrt(np.abs(sent) / np.sum(np.abs(sent)))
        if loop_closed and motion is None:
            size = size / (1.0 + (f / (threshold.OWN_SHARE * path.sample_rate_hz)) ** 4)
        elif loop_closed and motion is not None:
            velocity = velocity * motion.loop_image_factor(f)
        return PathFit(f, torque / sent, velocity / sent, size, path, loop_closed, controller)

    def best(self, hold: Hold) -> tuple[SignalPath, float]:
        """Return the best delay and corner with this hold, and the unexplained residual."""
        # Most of the delay shows in the samples just behind a step, and only from a nearby start.
        cycles = np.sort(
            [
                n + part
                for n in range(4)
                for part in threshold.PARTS
                if n + part < threshold.MOST_CYCLES
            ]
        )
        corners = _CORNERS_HZ if self.path.current_bandwidth_hz is None else [None]
        starts = []
        for late in cycles:
            row = [np.array([late] if c is None else [late, np.log(c)]) for c in corners]
            costs = [float(np.sum(self._rows(x, hold) ** 2)) for x in row]
            starts.append((min(costs), row[int(np.argmin(costs))]))
        order = sorted(range(cycles.size), key=lambda n: starts[n][0])
        whole = [n for n in order if cycles[n] % 1.0 == 0.0]
        ends = [self._refined(starts[n][1], hold) for n in {*order[:3], *whole[:1]}]
        x, cost = min(ends, key=lambda end: end[1])
        return self._path_of(x, hold), cost

    def best_whole(self, hold: Hold) -> tuple[SignalPath, float]:
        """Return the best whole number of cycles with this hold, and the unexplained residual."""
        tried = []
        for late in np.arange(0.0, threshold.MOST_CYCLES):
            corners = _CORNERS_HZ if self.path.current_bandwidth_hz is None else [None]
            row = [np.array([late] if c is None else [late, np.log(c)]) for c in corners]
            costs = [float(np.sum(self._rows(x, hold) ** 2)) for x in row]
            tried.append((min(costs), row[int(np.argmin(costs))]))
        cost, x = min(tried, key=lambda t: t[0])
        if x.size == 1:
            return self._path_of(x, hold), cost
        end = scipy.optimize.minimize_scalar(
            lambda corner: float(np.sum(self._rows(np.array([x[0], corner]), hold) ** 2)),
            bounds=(x[1] - 0.5, x[1] + 0.5),
            method="bounded",
            options={"maxiter": 12},
        )
        return self._path_of(np.array([x[0], end.x]), hold), min(cost, float(end.fun))

    def _refined(self, x0: FloatArray, hold: Hold) -> tuple[FloatArray, float]:
        low = np.array([max(x0[0] - 0.4, 0.0) - 1e-9, _SLOWEST])[: x0.size]
        high = np.array([x0[0] + 0.4, _FASTEST])[: x0.size]
        scale = np.array([0.05, 0.1])[: x0.size]

        def rows(x: FloatArray) -> FloatArray:
            # The solver treats very small numbers as zero.
            return self._rows(x, hold) * threshold.SCALE

        end = scipy.optimize.least_squares(rows, x0, bounds=(low, high), x_scale=scale, max_nfev=30)
        return end.x, 2.0 * float(end.cost) / threshold.SCALE**2

    def _path_of(self, x: FloatArray, hold: Hold) -> SignalPath:
        """Path of the parameters: cycles of delay, and log of the corner if it is not known."""
        late_s = command_delay_s(float(x[0]), hold, self.path.sample_rate_hz)
        known = self.path.current_bandwidth_hz
        corner = float(np.exp(x[1])) if known is None else known
        return replace(self.path, hold=hold, command_delay_s=late_s, current_bandwidth_hz=corner)

    def _rows(self, x: FloatArray, hold: Hold) -> FloatArray:
        """Residuals of the fit, and deviations of the path from the prior."""
        usual = [threshold.WHOLE_CYCLES * np.sin(np.pi * x[0]) / np.pi]
        if x.size == 2:
            usual.append(threshold.ORDINARY * (x[1] - _USUAL_CORNER))
        return np.concatenate([self.rest(self._path_of(x, hold)), usual])

    def rest(self, path: SignalPath) -> FloatArray:
        """Return what the path leaves unexplained, as real and imaginary parts."""
        error = self.torque - sampled_command_response(self.f, path)
        if self.controller is not None:
            error = error + self.answered(path) * self.controller.response(self.f)
        error = error * self.weight
        target = np.concatenate([error.real, error.imag])
        if not self.loop_closed or self.controller is not None:
            return target
        s = 2j * np.pi * self.f
        own = self.answered(path) * self.weight
        columns = np.column_stack([own, own / s, own / s**2])
        matrix = np.concatenate([columns.real, columns.imag])
        matrix = matrix / np.linalg.norm(matrix, axis=0)
        q, _ = np.linalg.qr(matrix)
        return np.asarray(target - q @ (q.T @ target))

    def answered(self, path: SignalPath) -> ComplexArray:
        """Return the torque that the loop makes of the speed, per unit of gain [lines]."""
        own = self.velocity * lag_response(self.f, path.current_bandwidth_hz)
        return np.asarray(own * delay_response(self.f, path.loop_delay_s))
