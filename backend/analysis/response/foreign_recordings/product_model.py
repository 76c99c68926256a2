"""A response as gain, delay, real poles and pairs of poles and zeros: for motor and load side.

Unlike `mechanical_model` it assumes neither that the response is collocated nor that it is a speed:
a recording from another program may be filtered, or of the load. Terms are added greedily and
refined together by least squares on the logarithm, weighted by the relative scatter of each line.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.thresholds import product_model as threshold

TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Pair:
    """Complex poles (``kind`` resonance) or zeros (antiresonance) of s² + 2ζωs + ω²."""

    kind: str
    frequency_hz: float
    damping: float

    def factor(self, f: FloatArray) -> ComplexArray:
        """Return (1 - x² + 2jζx) with x = f/f₀; inverted for poles."""
        x = f / self.frequency_hz
        value = 1.0 - x * x + 2j * self.damping * x
        return np.asarray(value if self.kind == "antiresonance" else 1.0 / value)


@dataclass(frozen=True)
class ProductModel:
    """``gain`` with its sign; ``poles_hz`` corners of real poles; ``delay_s`` in s."""

    gain: float
    delay_s: float
    poles_hz: tuple[float, ...] = ()
    pairs: tuple[Pair, ...] = ()

    def response(self, f: FloatArray) -> ComplexArray:
        """Return the complex response at frequencies in Hz."""
        out = self.gain * np.exp(-2j * np.pi * f * self.delay_s)
        for corner in self.poles_hz:
            out = out / (1.0 + 1j * f / corner)
        for pair in self.pairs:
            out = out * pair.factor(f)
        return np.asarray(out)


@dataclass(frozen=True)
class ProductFit:
    """A fit: ``covariance`` of the parameters (`vector_of`), ``scatter`` per component."""

    model: ProductModel
    covariance: FloatArray
    residual: ComplexArray
    scatter: float


def vector_of(model: ProductModel) -> FloatArray:
    """Return log|gain|, delay in ms, log corners, then log frequency and damping per pair."""
    head = [np.log(abs(model.gain)), model.delay_s * 1e3, *np.log(model.poles_hz)]
    pairs = [v for p in model.pairs for v in (np.log(p.frequency_hz), np.log(p.damping))]
    return np.asarray([*head, *pairs], dtype=np.float64)


def model_of(x: FloatArray, like: ProductModel) -> ProductModel:
    """Return the model of a parameter vector, with structure and sign of another model."""
    real = len(like.poles_hz)
    rest = x[2 + real :]
    pairs = tuple(
        Pair(p.kind, float(np.exp(rest[2 * i])), float(np.exp(rest[2 * i + 1])))
        for i, p in enumerate(like.pairs)
    )
    return ProductModel(
        float(np.sign(like.gain) * np.exp(x[0])),
        float(x[1]) / 1e3,
        tuple(float(np.exp(v)) for v in x[2 : 2 + real]),
        pairs,
    )


def log_ratio(response: ComplexArray, model: ProductModel, f: FloatArray) -> ComplexArray:
    """Return the logarithm of response over model, with the phase within a half turn."""
    return np.asarray(np.log(response / model.response(f)))


def fit_product(f: FloatArray, response: ComplexArray, weight: FloatArray) -> ProductFit | None:
    """Return the simplest product that explains the lines; None below eight lines.

    ``weight`` [lines] is proportional to 1/σ of the logarithm.
    """
    if f.size < 8:
        return None
    w = weight / float(np.sqrt(np.mean(weight**2)))
    best = _start(f, response, w)
    for _ in range(threshold.MOST_PAIRS):
        if _alike(w * log_ratio(response, best, f)) < threshold.WHITE:
            break
        more = _with_pair(best, f, response, w)
        if more is None or _cost(more, f, response, w) > threshold.WORTH * _cost(
            best, f, response, w
        ):
            break
        best = _with_real(more, f, response, w)
    return _described(best, f, response, w)


def _alike(left: ComplexArray) -> float:
    """Correlation of neighbouring lines."""
    near = float(np.vdot(left[:-1], left[1:]).real)
    return near / max(float(np.sum(np.abs(left) ** 2)), 1e-300)


def _cost(model: ProductModel, f: FloatArray, response: ComplexArray, w: FloatArray) -> float:
    """Robust cost: lines in a deep valley that are mostly noise have little influence."""
    z = np.abs(w * log_ratio(response, model, f))
    return float(np.sum(2.0 * (np.sqrt(1.0 + (z / 0.3) ** 2) - 1.0)))


def _start(f: FloatArray, response: ComplexArray, w: FloatArray) -> ProductModel:
    """Gain, delay and up to three real poles, each only where it reduces the cost enough."""
    rows = []
    for real in range(threshold.MOST_REAL + 1):
        corners = tuple(f[0] * 0.3 * 4.0**i for i in range(real))
        for sign in (1.0, -1.0):
            unit = ProductModel(sign, 0.0, corners)
            size = float(np.exp(np.mean(np.log(np.abs(response / unit.response(f))))))
            rows.append(_refined(replace(unit, gain=sign * size), f, response, w))
    best = rows[0]
    for other in rows[1:]:
        if _cost(other, f, response, w) < threshold.WORTH_REAL * _cost(best, f, response, w):
            best = other
    return best


def _with_real(
    model: ProductModel, f: FloatArray, response: ComplexArray, w: FloatArray
) -> ProductModel:
    """Add real poles that become visible only once a mode is explained."""
    best = model
    while len(best.poles_hz) < threshold.MOST_REAL:
        tried = [
            _refined(
                replace(best, gain=sign * best.gain, poles_hz=(*best.poles_hz, corner)),
                f,
                response,
                w,
            )
            for corner in (float(f[0]) / 3.0, float(np.sqrt(f[0] * f[-1])), float(f[-1]))
            for sign in (1.0, -1.0)
        ]
        more = min(tried, key=lambda each: _cost(each, f, response, w))
        if _cost(more, f, response, w) > threshold.WORTH_REAL * _cost(best, f, response, w):
            break
        best = more
    return best


def _with_pair(
    model: ProductModel, f: FloatArray, response: ComplexArray, w: FloatArray
) -> ProductModel | None:
    """The best further resonance, antiresonance, or both, from a grid and then refined."""
    left = log_ratio(response, model, f)
    places = np.geomspace(f[0], f[-1], threshold.GRID)
    peaks = f[np.argsort(-np.abs(w * left))[:6]]
    places = np.unique(np.concatenate([places, peaks]))
    tried: list[tuple[float, tuple[Pair, ...]]] = []
    for damping in threshold.START_DAMPING:
        poles = [Pair("resonance", float(p), damping) for p in places]
        zeros = [Pair("antiresonance", float(p), damping) for p in places]
        of_poles = np.array([np.log(p.factor(f)) for p in poles])
        of_zeros = np.array([np.log(p.factor(f)) for p in zeros])
        for one, logs in ((poles, of_poles), (zeros, of_zeros)):
            tried += [(_left(left - v, w), (p,)) for v, p in zip(logs, one, strict=True)]
        for i, zero in enumerate(zeros):
            for j, pole in enumerate(poles):
                if i != j:
                    tried.append((_left(left - of_zeros[i] - of_poles[j], w), (zero, pole)))
    tried.sort(key=lambda row: row[0])
    best: ProductModel | None = None
    single = [row for row in tried if len(row[1]) == 1][:3]
    for _, pairs in [*tried[:2], *single[:2]]:
        found = _refined(replace(model, pairs=(*model.pairs, *pairs)), f, response, w)
        # A single resonance or antiresonance is preferred to two.
        price = threshold.WORTH ** len(pairs)
        if best is None or _cost(found, f, response, w) / price < _cost(best, f, response, w) / (
            threshold.WORTH ** (len(best.pairs) - len(model.pairs))
        ):
            best = found
    return best


def _left(left: ComplexArray, w: FloatArray) -> float:
    """Cost of a logarithm without its mean, with phases within a half turn."""
    turned = left - np.sum(w * left.real) / np.sum(w)
    imag = (turned.imag + np.pi) % TURN - np.pi
    z = w * np.hypot(turned.real, imag)
    return float(np.sum(np.sqrt(1.0 + (z / 0.3) ** 2) - 1.0))


def _bounds(model: ProductModel, f: FloatArray) -> tuple[FloatArray, FloatArray]:
    real, pairs = len(model.poles_hz), len(model.pairs)
    corner = (np.log(1e-3 * f[0]), np.log(20.0 * f[-1]))
    pair = (
        (np.log(f[0] / threshold.BEYOND), np.log(threshold.DAMPING[0])),
        (np.log(f[-1] * threshold.BEYOND), np.log(threshold.DAMPING[1])),
    )
    late = 1e3 * 2.0 / float(f[-1])
    low = [-60.0, -0.05 * late, *[corner[0]] * real, *list(pair[0]) * pairs]
    high = [60.0, late, *[corner[1]] * real, *list(pair[1]) * pairs]
    return np.asarray(low), np.asarray(high)


def _refined(
    model: ProductModel, f: FloatArray, response: ComplexArray, w: FloatArray
) -> ProductModel:
    low, high = _bounds(model, f)
    span = 1e-9 * (high - low)

    def error(x: FloatArray) -> FloatArray:
        left = w * log_ratio(response, model_of(x, model), f)
        return np.concatenate([left.real, left.imag])

    def slopes(x: FloatArray) -> FloatArray:
        change = -w[:, None] * jacobian(model_of(x, model), f)
        return np.vstack([change.real, change.imag])

    x0 = np.clip(vector_of(model), low + span, high - span)
    found = scipy.optimize.least_squares(
        error,
        x0,
        slopes,
        bounds=(low, high),
        loss="soft_l1",
        f_scale=0.3,
        max_nfev=threshold.STEPS,
        x_scale="jac",
    )
    return model_of(np.asarray(found.x), model)


def jacobian(model: ProductModel, f: FloatArray) -> ComplexArray:
    """Return the derivatives of the logarithm [lines, parameters] by `vector_of`."""
    columns = [np.ones(f.size, dtype=np.complex128), -2e-3j * np.pi * f]
    for corner in model.poles_hz:
        turned = 1j * f / corner
        columns.append(turned / (1.0 + turned))
    for pair in model.pairs:
        x = f / pair.frequency_hz
        sign = 1.0 if pair.kind == "antiresonance" else -1.0
        damped = 2j * pair.damping * x
        factor = 1.0 - x * x + damped
        columns += [sign * (2.0 * x * x - damped) / factor, sign * damped / factor]
    return np.asarray(np.stack(columns, axis=1))


def _described(
    model: ProductModel, f: FloatArray, response: ComplexArray, w: FloatArray
) -> ProductFit:
    """Gauss-Newton covariance; correlated residuals of neighbours count as fewer lines."""
    left = log_ratio(response, model, f)
    slopes = w[:, None] * jacobian(model, f)
    stacked = np.vstack([slopes.real, slopes.imag])
    weighted = w * left
    freedom = max(2 * f.size - stacked.shape[1], 1)
    square = float(np.sum(np.abs(weighted) ** 2)) / freedom
    share = min(max(_alike(weighted), 0.0), 0.9)
    covariance = np.linalg.pinv(stacked.T @ stacked) * square * (1 + share) / (1 - share)
    return ProductFit(model, np.asarray(covariance), left, float(np.sqrt(square)))
