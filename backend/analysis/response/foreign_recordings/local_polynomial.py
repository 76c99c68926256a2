"""Local polynomial method: response, transient and scatter from one record of any excitation.

Around each frequency response and leakage are smooth, the excitation is not (Pintelon &
Schoukens, *System Identification*, 2012, section 7.2): Y(k+r) = G(k+r)·U(k+r) + T(k+r) + V(k+r)
with polynomials G and T in r, fitted by least squares.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.analysis.signals.arrays import ComplexArray, FloatArray, IntArray
from backend.analysis.thresholds import local_polynomial as threshold

_ORDER = 2
#: Unknowns of a window: the coefficients of both polynomials. Further equations show the scatter.
_UNKNOWNS = 2 * (_ORDER + 1)


@dataclass(frozen=True)
class LocalEstimate:
    """``response`` [lines], its variance (of the complex number), and the coherence without
    leakage.

    The variance is the residual power of the window times (XᴴX)⁻¹ of the response.
    """

    response: ComplexArray
    variance: FloatArray
    coherence: FloatArray


def local_polynomial(
    input_spectrum: ComplexArray, output_spectrum: ComplexArray, centres: IntArray, reach: int
) -> LocalEstimate:
    """Estimate at the bins ``centres`` from ``reach`` bins on each side."""
    least = (_UNKNOWNS + threshold.SPARE) // 2
    reach = max(reach, least)
    bins = input_spectrum.size
    out = np.empty(centres.size, dtype=np.complex128)
    variance, coherence = np.empty(centres.size), np.empty(centres.size)
    for i, centre in enumerate(centres):
        first = int(min(max(centre - reach, 1), max(bins - 2 * reach - 1, 1)))
        k = np.arange(first, min(first + 2 * reach + 1, bins))
        x = (k - centre) / reach
        powers = np.vander(x, _ORDER + 1, increasing=True)
        basis = np.hstack([powers * input_spectrum[k, None], powers.astype(np.complex128)])
        scale = np.maximum(np.linalg.norm(basis, axis=0), 1e-300)
        q, r = np.linalg.qr(basis / scale)
        y = output_spectrum[k]
        fitted = q.conj().T @ y
        inverse = np.linalg.pinv(r)
        solution = inverse @ fitted / scale
        left = y - q @ fitted
        freedom = k.size - _UNKNOWNS
        noise = float(np.vdot(left, left).real) / freedom
        out[i] = solution[0]
        variance[i] = noise * float(np.sum(np.abs(inverse[0]) ** 2)) / float(scale[0]) ** 2
        caused = float(np.mean(np.abs(solution[0] * input_spectrum[k]) ** 2))
        coherence[i] = caused / max(caused + noise, 1e-300)
    return LocalEstimate(out, variance, coherence)


def smooth_residual(values: ComplexArray, reach: int) -> tuple[ComplexArray, FloatArray]:
    """Return the residual of each value [lines] from a local parabola through ``reach`` neighbours
    on each side, and the share of the scatter's variance that this residual keeps.
    """
    n = values.size
    reach = min(reach, max((n - 1) // 2, 1))
    order = min(_ORDER, 2 * reach - 1)
    left, kept = np.empty(n, dtype=np.complex128), np.empty(n)
    width = min(2 * reach + 1, n)
    rows = [
        np.linalg.pinv(np.vander((np.arange(width) - own) / reach, order + 1, increasing=True))[0]
        for own in range(width)
    ]
    for i in range(n):
        first = min(max(i - reach, 0), n - width)
        row = rows[i - first]
        left[i] = values[i] - row @ values[first : first + width]
        own = float(row[i - first])
        kept[i] = 1.0 - 2.0 * own + float(np.sum(row**2))
    return left, kept
