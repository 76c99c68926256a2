"""Rational fit of a frequency response, and the resonances it holds.

A few Sanathanan-Koerner passes (IEEE Trans. Autom. Control 8 (1963) 56) in the pole basis of
vector fitting (Gustavsen & Semlyen, IEEE Trans. Power Deliv. 14 (1999) 1052) find the poles; a
least-squares refinement of logarithmic errors then judges peaks and valleys alike. Works for any
response, closed loops included; remove a known delay first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.optimize import least_squares

from backend.analysis.arrays import ComplexArray, FloatArray

TURN = 2.0 * np.pi


@dataclass(frozen=True)
class RationalFit:
    """Σ r_i/(s - p_i) + d; ``poles`` and ``residues`` [n] come in conjugate pairs."""

    poles: ComplexArray
    residues: ComplexArray
    direct: float
    error: float

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """Complex response."""
        s = 1j * TURN * np.asarray(frequency_hz, dtype=np.float64)
        parts = self.residues[None, :] / (s[:, None] - self.poles[None, :])
        return np.asarray(parts.sum(axis=1) + self.direct, dtype=np.complex128)

    def zeros(self) -> ComplexArray:
        """Zeros, from the numerator polynomial built at the scale of the largest pole."""
        scale = float(np.max(np.abs(self.poles)))
        poles, residues = self.poles / scale, self.residues / scale
        total: ComplexArray = np.array([self.direct], dtype=np.complex128)
        total = np.polymul(total, np.poly(poles))
        for i in range(poles.size):
            total = np.polyadd(total, residues[i] * np.poly(np.delete(poles, i)))
        numerator = total.real
        significant = np.flatnonzero(np.abs(numerator) > 1e-12 * np.max(np.abs(numerator)))
        return np.asarray(np.roots(numerator[significant[0] :]) * scale, dtype=np.complex128)


@dataclass(frozen=True)
class Resonance:
    """A row of the resonance table; ``height_db`` is how far it rises (or falls) locally.

    ``frequency_ci95_hz`` and ``damping_ci95`` hold the true values in 95 of 100 cases; None where
    nothing was said of that.
    """

    kind: Literal["resonance", "antiresonance"]
    frequency_hz: float
    damping: float
    height_db: float
    frequency_ci95_hz: tuple[float, float] | None = None
    damping_ci95: tuple[float, float] | None = None


def _basis(s: ComplexArray, poles: ComplexArray) -> ComplexArray:
    """Real-coefficient partial fractions: columns for real poles and conjugate pairs."""
    columns = []
    for p in poles:
        if abs(p.imag) < 1e-9 * abs(p):
            columns.append(1.0 / (s - p.real))
        elif p.imag > 0:
            a, b = 1.0 / (s - p), 1.0 / (s - np.conj(p))
            columns += [a + b, 1j * a - 1j * b]
    return np.array(columns).T


def _sorted(poles: ComplexArray) -> ComplexArray:
    """Stable poles: real ones, then each pair as (p, p*) in order of frequency."""
    stable = -np.abs(poles.real) + 1j * poles.imag
    real = np.sort(stable[np.abs(stable.imag) < 1e-9 * np.abs(stable)].real)
    upper = stable[stable.imag >= 1e-9 * np.abs(stable)]
    upper = upper[np.argsort(np.abs(upper))]
    pairs = np.column_stack([upper, upper.conj()]).ravel()
    return np.concatenate([real.astype(np.complex128), pairs])


def _relocate(s: ComplexArray, h: ComplexArray, poles: ComplexArray, weight: FloatArray,
              direct: bool) -> ComplexArray:  # fmt: skip
    """One pass of vector fitting: the zeros of the weighting function are the new poles."""
    phi = _basis(s, poles)
    n = poles.size
    left = np.hstack([phi, np.ones((s.size, 1))]) if direct else phi
    a = np.hstack([left, -h[:, None] * phi]) * weight[:, None]
    b = h * weight
    matrix = np.vstack([a.real, a.imag])
    scale = np.linalg.norm(matrix, axis=0)
    x = np.linalg.lstsq(matrix / scale, np.concatenate([b.real, b.imag]), rcond=None)[0] / scale
    c = x[-n:]
    state = np.zeros((n, n))
    inputs = np.zeros(n)
    i = 0
    for p in poles:
        if abs(p.imag) < 1e-9 * abs(p):
            state[i, i], inputs[i] = p.real, 1.0
            i += 1
        elif p.imag > 0:
            state[i : i + 2, i : i + 2] = [[p.real, p.imag], [-p.imag, p.real]]
            inputs[i] = 2.0
            i += 2
    return _sorted(np.linalg.eigvals(state - np.outer(inputs, c)).astype(np.complex128))


def _residues(s: ComplexArray, h: ComplexArray, poles: ComplexArray, weight: FloatArray,
              direct: bool) -> tuple[ComplexArray, float]:  # fmt: skip
    phi = _basis(s, poles)
    left = np.hstack([phi, np.ones((s.size, 1))]) if direct else phi
    a = left * weight[:, None]
    b = h * weight
    matrix = np.vstack([a.real, a.imag])
    scale = np.linalg.norm(matrix, axis=0)
    x = np.linalg.lstsq(matrix / scale, np.concatenate([b.real, b.imag]), rcond=None)[0] / scale
    residues = np.zeros(poles.size, dtype=np.complex128)
    i = 0
    for k, p in enumerate(poles):
        if abs(p.imag) < 1e-9 * abs(p):
            residues[k] = x[i]
            i += 1
        elif p.imag > 0:
            residues[k], residues[k + 1] = x[i] + 1j * x[i + 1], x[i] - 1j * x[i + 1]
            i += 2
    return residues, float(x[-1]) if direct else 0.0


def fit_rational(
    frequency_hz: FloatArray,
    response: ComplexArray,
    order: int,
    *,
    std_relative: FloatArray | None = None,
    direct: bool = False,
    passes: int = 12,
) -> RationalFit:
    """Stable rational function of ``order`` poles through the lines.

    ``std_relative`` [n] is the relative deviation of each line (default: all alike); ``direct``
    adds a constant, for responses that do not fall off.
    """
    f = np.asarray(frequency_hz, dtype=np.float64)
    if f.size < 2 * order:
        raise ValueError(f"{f.size} lines are too few for {order} poles")
    s = 1j * TURN * f
    spread = np.full(f.size, 0.01) if std_relative is None else np.hypot(std_relative, 0.003)
    weight = 1.0 / (np.abs(response) * spread)
    weight = weight / np.median(weight)
    centres = TURN * np.geomspace(f[0], f[-1], max(order // 2, 1))
    pairs = np.column_stack([centres * (-0.01 + 1j), centres * (-0.01 - 1j)]).ravel()
    start = pairs[: 2 * (order // 2)]
    if order % 2:
        start = np.concatenate([[-TURN * f[0] + 0j], start])
    poles = _sorted(start.astype(np.complex128))
    for _ in range(passes):
        poles = _relocate(s, response, poles, weight, direct)
    poles = _refine(s, response, poles, weight, direct)
    residues, constant = _residues(s, response, poles, weight, direct)
    fit = RationalFit(poles, residues, constant, 0.0)
    error = float(np.median(np.abs(fit.response(f) / response - 1.0)))
    return RationalFit(poles, residues, constant, error)


def _refine(s: ComplexArray, h: ComplexArray, poles: ComplexArray, weight: FloatArray,
            direct: bool) -> ComplexArray:  # fmt: skip
    """Move the poles until the logarithmic error is least; residues follow linearly."""
    real = poles[np.abs(poles.imag) < 1e-9 * np.abs(poles)].real
    upper = poles[poles.imag >= 1e-9 * np.abs(poles)]
    x0 = np.concatenate([np.log(-real), np.log(np.abs(upper)), np.log(-upper.real / np.abs(upper))])

    def poles_of(x: FloatArray) -> ComplexArray:
        r = -np.exp(x[: real.size])
        w = np.exp(x[real.size : real.size + upper.size])
        zeta = np.minimum(np.exp(x[real.size + upper.size :]), 0.999)
        up = w * (-zeta + 1j * np.sqrt(1 - zeta**2))
        pairs = np.column_stack([up, up.conj()]).ravel()
        return np.concatenate([r.astype(np.complex128), pairs])

    def error(x: FloatArray) -> FloatArray:
        p = poles_of(x)
        residues, constant = _residues(s, h, p, weight, direct)
        fitted = (residues[None, :] / (s[:, None] - p[None, :])).sum(axis=1) + constant
        e = (fitted - h) * weight
        return np.concatenate([e.real, e.imag])

    fit = least_squares(error, x0, loss="soft_l1", f_scale=0.1, max_nfev=20, x_scale=0.1)
    return _sorted(poles_of(fit.x))


def resonance_table(
    poles: ComplexArray,
    zeros: ComplexArray,
    band_hz: tuple[float, float],
    *,
    count: int = 8,
    largest_damping: float = 0.35,
) -> tuple[Resonance, ...]:
    """Resonances (poles) and antiresonances (zeros) inside a band, the ``count`` highest of each.

    The height of a pole is 20·log10 of 1/(2ζ) with every nearby zero counted against it, so that
    a pole which a zero almost cancels is low. Sorted by frequency.
    """
    rows: list[Resonance] = []
    pairs: tuple[tuple[Literal["resonance", "antiresonance"], ComplexArray, ComplexArray], ...] = (
        ("resonance", poles, zeros),
        ("antiresonance", zeros, poles),
    )
    for kind, own, other in pairs:
        found = []
        for p in own[own.imag > 0]:
            damping = float(-p.real / abs(p))
            frequency = float(abs(p) / TURN)
            if not band_hz[0] <= frequency <= band_hz[1] or abs(damping) > largest_damping:
                continue
            height = -20 * np.log10(max(2 * abs(damping), 1e-6))
            near = other[other.imag > 0]
            if near.size:
                closest = near[int(np.argmin(np.abs(near - p)))]
                at = 1j * abs(p)
                height += min(0.0, 20 * np.log10(2 * abs(at - closest) / abs(p)))
            found.append(Resonance(kind, frequency, damping, float(height)))
        rows += sorted(found, key=lambda r: -r.height_db)[:count]
    return tuple(sorted(rows, key=lambda r: r.frequency_hz))
