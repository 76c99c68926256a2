"""Common and differential motion of two coupled axes, and the modes of both.

Common: mean speed of both axes, driven by the sum of their torques. Differential: speed of axis 1
minus that of axis 2, driven by half the difference of their torques. Torque times speed is the same
in both pairs of coordinates, so inertias and stiffnesses keep their mechanical meaning.

The modes are those of a reciprocal mechanical system,
G(s) = e^(-sτ) [R₀/(s + a) + R₁/(s + b) + Σ (Rᵢs + Qᵢωᵢ) / (s² + 2ζᵢωᵢs + ωᵢ²) + s E]
with real symmetric 2×2 matrices (Ewins, *Modal Testing*, 2nd ed. 2000, sections 2.4 and 2.6). Qᵢ
represents non-proportional damping, R₁ a beam that turns freely, E the modes above the band. Given
the poles, the matrices are a linear regression; the poles are searched for (variable projection,
Golub & Pereyra 1973).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy

from backend.analysis.coupled.response import CoupledResponse
from backend.analysis.signals.arrays import ComplexArray, FloatArray, IntArray
from backend.analysis.thresholds import coupled_modes as threshold

_TURN = 2.0 * np.pi
#: Maps the entries 11, 12, 22 of a symmetric matrix to its columns 11, 12, 21, 22.
_SYMMETRIC = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
_FIRST = 3
"""Index of the first mode among the parameters, after a delay and two friction corners."""
_RIGID = 2
"""Number of functions of the rigid body, which precede those of the modes."""
_MEAN_AND_DIFFERENCE = np.array([[0.5, 0.5], [1.0, -1.0]])

Kind = Literal["common", "skew"]
Interval = tuple[float, float]


@dataclass(frozen=True)
class Mode:
    """One mode. ``skew_share`` (0 to 1) is the differential share of its motion at the motors;
    ``kind`` is the larger part.
    """

    kind: Kind
    frequency_hz: float
    frequency_ci95_hz: Interval
    damping: float
    damping_ci95: Interval
    skew_share: float


@dataclass(frozen=True)
class CoupledModes:
    """Modes, inertia and skew stiffness of the pair, with 95 % intervals.

    ``inertia_kgm2`` is that of the whole machine in common motion, seen at one motor that turns at
    the mean speed of both. ``skew_stiffness_nm_per_rad`` is half the static difference of the
    torques over the difference of the positions; None where the axes may differ without a torque,
    or where it cannot be determined.
    """

    modes: tuple[Mode, ...]
    inertia_kgm2: float
    inertia_ci95_kgm2: Interval
    skew_stiffness_nm_per_rad: float | None
    skew_stiffness_ci95: Interval | None
    misfit: float
    """Mean square of the residuals relative to the covariance of the lines, ideally 1."""


def common_and_differential(response: CoupledResponse) -> CoupledResponse:
    """Return the response from torque sum and half difference to mean speed and difference."""
    a = _MEAN_AND_DIFFERENCE
    return response.transformed(a, a.T)


def find_modes(response: CoupledResponse) -> CoupledModes:
    """Return the modes inside the band.

    Raises:
        ValueError: too few lines for a model.
    """
    fit = _Fit.of(response)
    if fit.f.size < threshold.FEWEST_LINES:
        raise ValueError("too few lines for a model of two axes")
    x = fit.solved(np.array([0.0, *np.log(threshold.VISCOUS_RAD_S)]))
    cost = fit.cost(x)
    while (x.size - _FIRST) // 2 < threshold.MODES:
        better, found = x, cost
        for start in fit.candidates(x):
            trial = fit.solved(start)
            if (least := fit.cost(trial)) < found:
                better, found = trial, least
        # Akaike's criterion, with a factor large enough that noise alone does not reach it.
        if cost - found < threshold.GAIN * fit.parameters_of_a_mode:
            break
        x, cost = better, found
    return fit.described(x)


@dataclass(frozen=True)
class _Fit:
    """Lines [n]: whitened real rows of the entries, and the matrix [n, 4, 3] from the entries 11,
    12 and 22 to them.
    """

    f: FloatArray
    right: FloatArray
    symmetric: ComplexArray
    spread: float

    parameters_of_a_mode = 8

    @staticmethod
    def of(response: CoupledResponse) -> _Fit:
        """Return the fit problem for the lines of a response."""
        n = response.frequency_hz.size
        g = response.response.reshape(n, 4)
        # A line is not known better than the model of the path: half a degree.
        floor = threshold.FLOOR * np.linalg.norm(g, axis=1)
        covariance = response.covariance + (floor**2)[:, None, None] * np.eye(4)
        white = np.linalg.inv(np.linalg.cholesky(covariance))
        right = np.einsum("kij,kj->ki", white, g).reshape(-1)
        rows = np.concatenate([right.real, right.imag])
        return _Fit(response.frequency_hz, rows, white @ _SYMMETRIC, response.spread)

    def _columns(self, x: FloatArray) -> ComplexArray:
        """Functions [n, m] of which the symmetric matrices are the coefficients."""
        s = 2j * np.pi * self.f
        shapes = [1.0 / (s + np.exp(x[1])), 1.0 / (s + np.exp(x[2]))]
        for log_hz, log_damping in x[_FIRST:].reshape(-1, 2):
            omega = _TURN * np.exp(log_hz)
            pole = s * s + 2.0 * np.exp(log_damping) * omega * s + omega**2
            shapes += [s / pole, omega / pole]
        shapes.append(s / (_TURN * self.f[-1]) ** 2)
        late = np.exp(-s * x[0] / (_TURN * self.f[-1]))
        return np.asarray(np.stack(shapes, axis=1) * late[:, None])

    def _rows(self, shapes: ComplexArray) -> FloatArray:
        """Real and imaginary rows of these functions, by function and entry 11, 12, 22."""
        whole = (self.symmetric[:, :, None, :] * shapes[:, None, :, None]).reshape(
            self.f.size * 4, -1
        )
        return np.concatenate([whole.real, whole.imag])

    def _regression(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Matrix and solution of the linear regression."""
        a = self._rows(self._columns(x))
        scale = np.linalg.norm(a, axis=0)
        a_scaled = a / scale
        squares = a_scaled.T @ a_scaled
        # The ridge makes nearly identical functions share what they explain.
        squares[np.diag_indices_from(squares)] += threshold.RIDGE
        return a, np.linalg.solve(squares, a_scaled.T @ self.right) / scale

    def residuals(self, x: FloatArray) -> FloatArray:
        """Return whitened residuals at these poles with the best matrices; variance 1/2 each."""
        a, solution = self._regression(x)
        return self.right - a @ solution

    def _slopes(self, x: FloatArray, solution: FloatArray) -> FloatArray:
        """Slopes of the rows by each pole, with the matrices kept."""
        step = 1e-5
        slopes = np.empty((self.right.size, x.size))
        for place in range(x.size):
            shift = np.zeros(x.size)
            shift[place] = step
            change = (self._columns(x + shift) - self._columns(x - shift)) / (2.0 * step)
            slopes[:, place] = self._rows(change) @ solution
        return slopes

    def _jacobian(self, x: FloatArray) -> FloatArray:
        """Jacobian of `residuals` by Kaufman's approximation (1975), matrices projected out."""
        a, solution = self._regression(x)
        q, _ = np.linalg.qr(a / np.linalg.norm(a, axis=0))
        slopes = self._slopes(x, solution)
        return np.asarray(q @ (q.T @ slopes) - slopes)

    def cost(self, x: FloatArray) -> float:
        """Return chi-square."""
        left = self.residuals(x)
        return 2.0 * float(left @ left)

    def solved(self, start: FloatArray) -> FloatArray:
        """Return the best poles near the given ones."""
        modes = (start.size - _FIRST) // 2
        low = [-threshold.DELAY_RAD, *[np.log(threshold.VISCOUS_RANGE[0])] * 2]
        high = [threshold.DELAY_RAD, *[np.log(threshold.VISCOUS_RANGE[1])] * 2]
        band = np.log(self.f[0]), np.log(self.f[-1])
        low += [band[0], np.log(threshold.DAMPING_RANGE[0])] * modes
        high += [band[1], np.log(threshold.DAMPING_RANGE[1])] * modes
        inside = np.clip(start, np.array(low) + 1e-9, np.array(high) - 1e-9)
        found = scipy.optimize.least_squares(
            self.residuals,
            inside,
            self._jacobian,
            bounds=(low, high),
            x_scale=np.maximum(np.abs(inside), 0.1),
            max_nfev=threshold.EVALUATIONS,
        )
        return np.asarray(found.x)

    def candidates(self, x: FloatArray) -> list[FloatArray]:
        """Return starts with one more mode: where it explains most, or splitting a known one."""
        grid = np.geomspace(1.02 * self.f[0], self.f[-1] / 1.02, threshold.PLACES)
        costs = [
            self.cost(np.concatenate([x, [np.log(hz), np.log(threshold.TRIED_DAMPING)]]))
            for hz in grid
        ]
        damping = np.log(threshold.TRIED_DAMPING)
        inner = np.concatenate([[np.inf], costs, [np.inf]])
        lows = [i for i in range(len(costs)) if costs[i] <= min(inner[i], inner[i + 2])]
        order = sorted(lows, key=lambda i: costs[i])[: threshold.STARTS]
        starts = [np.concatenate([x, [np.log(grid[i]), damping]]) for i in order]
        for place in range(_FIRST, x.size, 2):
            two = np.concatenate([x, [x[place] + threshold.APART, damping]])
            two[place : place + 2] = x[place] - threshold.APART, damping
            starts.append(two)
        return starts

    def _covariance(self, x: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        """Joint covariance of poles and matrices, the matrices, and the misfit."""
        a, solution = self._regression(x)
        jacobian = np.hstack([self._slopes(x, solution), a])
        left = self.right - a @ solution
        misfit = 2.0 * float(left @ left) / max(left.size - jacobian.shape[1], 1)
        scale = np.linalg.norm(jacobian, axis=0)
        information = 2.0 * (jacobian / scale).T @ (jacobian / scale)
        covariance = np.linalg.pinv(information, hermitian=True) / np.outer(scale, scale)
        return covariance * max(misfit, 1.0), solution, misfit

    def described(self, x: FloatArray) -> CoupledModes:
        """Return the modes, inertia and stiffness of the model, with intervals."""
        covariance, solution, misfit = self._covariance(x)
        matrices = solution.reshape(-1, 3)
        places = x.size + np.arange(solution.size).reshape(-1, 3)
        deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        modes = []
        for number, (log_hz, log_damping) in enumerate(x[_FIRST:].reshape(-1, 2)):
            place = _FIRST + 2 * number
            share = _skew_share(matrices[_RIGID + 2 * number])
            modes.append(
                Mode(
                    "skew" if share > 0.5 else "common",
                    float(np.exp(log_hz)),
                    self._around(log_hz, np.hypot(deviations[place], threshold.KNOWN_HZ)),
                    float(np.exp(log_damping)),
                    self._around(
                        log_damping, np.hypot(deviations[place + 1], threshold.KNOWN_DAMPING)
                    ),
                    share,
                )
            )
        modes = [mode for mode in modes if self._shown(mode)]
        modes.sort(key=lambda mode: mode.frequency_hz)
        # The mean of the four entries R₀ + R₁ of common motion is 1/J of the whole machine.
        mean = np.zeros(covariance.shape[0])
        mean[places[:_RIGID]] = (0.25, 0.5, 0.25)
        rigid = float(mean[x.size :] @ solution)
        off = self.spread * float(np.sqrt(mean @ covariance @ mean))
        ends = (1.0 / (rigid + off), 1.0 / max(rigid - off, 1e-300))
        stiffness, interval = self._skew_stiffness(x, solution, covariance, places)
        return CoupledModes(tuple(modes), 1.0 / rigid, ends, stiffness, interval, misfit)

    def _shown(self, mode: Mode) -> bool:
        """False for a mode that may lie beyond the band, or that a single line may have caused."""
        low_hz, high_hz = mode.frequency_ci95_hz
        inside = self.f[0] < low_hz and high_hz < self.f[-1]
        low, high = mode.damping_ci95
        return bool(inside and high < threshold.DAMPING_KNOWN * low)

    def _around(self, logarithm: float, deviation: float) -> Interval:
        factor = float(np.exp(min(self.spread * deviation, 10.0)))
        return float(np.exp(logarithm)) / factor, float(np.exp(logarithm)) * factor

    def _skew_stiffness(
        self, x: FloatArray, solution: FloatArray, covariance: FloatArray, places: IntArray
    ) -> tuple[float | None, Interval | None]:
        """Inverse of the static differential compliance: the sum of R/ω² of all modes, and E."""
        difference = np.array([1.0, -2.0, 1.0])
        slope, rigid, common = (np.zeros(covariance.shape[0]) for _ in range(3))
        rigid[places[:_RIGID]] = difference
        common[places[:_RIGID]] = (0.25, 0.5, 0.25)
        moves, mean = float(rigid[x.size :] @ solution), float(common[x.size :] @ solution)
        # A rigid body that moves in the difference as well has no static stiffness.
        if x.size == _FIRST or moves > threshold.RIGID_SHARE * mean:
            return None, None
        for number, log_hz in enumerate(x[_FIRST::2]):
            squared = (_TURN * np.exp(log_hz)) ** 2
            own = places[_RIGID + 2 * number]
            slope[own] = difference / squared
            slope[_FIRST + 2 * number] = -2.0 * float(slope[own] @ solution[own - x.size])
        slope[places[-1]] = difference / (_TURN * self.f[-1]) ** 2
        compliance = float(slope[x.size :] @ solution)
        own_off = float(np.sqrt(np.maximum(slope @ covariance @ slope, 0.0)))
        off = self.spread * float(np.hypot(own_off, threshold.STATIC * compliance))
        if compliance <= off:
            return None, None
        return 1.0 / compliance, (1.0 / (compliance + off), 1.0 / (compliance - off))


def _skew_share(matrix: FloatArray) -> float:
    """Differential share of a mode's motion at the motors, from the larger eigenvector."""
    values, vectors = np.linalg.eigh(np.array([[matrix[0], matrix[1]], [matrix[1], matrix[2]]]))
    v = vectors[:, int(np.argmax(np.abs(values)))]
    return float((v[0] - v[1]) ** 2 / 2.0)
