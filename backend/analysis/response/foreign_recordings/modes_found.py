"""Resonances and antiresonances of a fitted response, with intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from backend.analysis.mechanics.resonance import Resonance
from backend.analysis.response.foreign_recordings.product_model import ProductFit
from backend.analysis.signals.arrays import FloatArray
from backend.analysis.thresholds import modes_found as threshold

_CI95 = 1.96


@dataclass(frozen=True)
class FoundMode:
    """``pair`` is the index of the pair in the model; ``row`` its row of the resonance table."""

    pair: int
    row: Resonance


def modes_of(fit: ProductFit, f: FloatArray) -> tuple[FoundMode, ...]:
    """Return the modes that are a peak or a valley of the curve inside the lines, ascending."""
    model = fit.model
    dense = np.geomspace(f[0], f[-1], 4000)
    db = 20.0 * np.log10(np.maximum(np.abs(model.response(dense)), 1e-300))
    x = np.log(dense)
    flat = db - np.polyval(np.polyfit(x, db, 1), x)
    deviations = np.sqrt(np.maximum(np.diag(fit.covariance), 0.0))
    first = 2 + len(model.poles_hz)
    found: list[FoundMode] = []
    for kind, curve in (("resonance", flat), ("antiresonance", -flat)):
        places, facts = scipy.signal.find_peaks(curve, prominence=threshold.LEAST_DB)
        for place, height in zip(places, facts["prominences"], strict=True):
            near = [
                (abs(np.log(p.frequency_hz / dense[place])) + 0.1 * p.damping, i)
                for i, p in enumerate(model.pairs)
                if p.kind == kind and abs(np.log(p.frequency_hz / dense[place])) < threshold.NEAR
            ]
            if not near:
                continue
            i = min(near)[1]
            pair = model.pairs[i]
            spread = float(np.hypot(deviations[first + 2 * i], threshold.FLOOR))
            of_damping = float(np.hypot(deviations[first + 2 * i + 1], threshold.DAMPING_FLOOR))
            signed = float(height) if kind == "resonance" else -float(height)
            found.append(
                FoundMode(
                    i,
                    Resonance(
                        "resonance" if kind == "resonance" else "antiresonance",
                        pair.frequency_hz,
                        pair.damping,
                        signed,
                        _around(pair.frequency_hz, spread),
                        _around(pair.damping, of_damping),
                    ),
                )
            )
    return tuple(sorted(found, key=lambda mode: mode.row.frequency_hz))


def _around(value: float, deviation: float) -> tuple[float, float]:
    factor = float(np.exp(_CI95 * min(deviation, 3.0)))
    return value / factor, value * factor
