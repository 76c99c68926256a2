"""Corrects the plant by its measured closed loop, where that differs from the prediction.

With backlash an axis is a different linear system for every way of driving it: a best linear
approximation belongs to its class of excitations (Pintelon & Schoukens, *System Identification*,
2012, section 3.4). A design needs the one within its own loop, so identification and design
alternate (Van den Hof & Schrama, *Identification and control: closed-loop issues*, Automatica 31,
1995). The controller is known; the error of the open loop is assigned to the plant.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.loop.margins import open_from_closed
from backend.analysis.loop.measured_plant import AS_THE_MODEL, MeasuredPlant
from backend.analysis.signals.arrays import BoolArray, ComplexArray, FloatArray
from backend.analysis.thresholds import loop_seen as threshold

#: Lines with a larger deviation than this are not used at all.
_BLURRED = 2.0 * AS_THE_MODEL


@dataclass(frozen=True)
class LoopLines:
    """A closed loop on its known lines; ``deviation`` is that of the logarithm of ``closed``."""

    frequency_hz: FloatArray
    closed: ComplexArray
    deviation: FloatArray


def seen_in_loop(plant: MeasuredPlant, lines: LoopLines, controller: ComplexArray) -> MeasuredPlant:
    """Return the plant corrected by its measured loop; unchanged where the loop shows nothing.

    ``controller`` is the whole loop but the plant, on the lines. Where the loop gain is high the
    closed loop is 1 for any plant: the deviation of log L is 1/|1 - T| times that of log T.
    The uncorrected plant is kept as a further plant that the axis may be.

    Raises:
        ValueError: too few lines show the plant better than a model of it would.
    """
    f, steep = lines.frequency_hz, 1.0 / np.abs(1.0 - lines.closed)
    deviation = np.nan_to_num(lines.deviation, nan=np.inf)
    scatter, off = deviation * steep, threshold.OFF * steep
    known = _known(np.log2(f), deviation < AS_THE_MODEL) & (scatter < AS_THE_MODEL)
    if np.count_nonzero(known) < threshold.LINES:
        raise ValueError("the lines of the loop do not tell the plant")
    ratio = np.log(open_from_closed(lines.closed) / (plant.on(f).response() * controller))
    # Less accurate neighbours are included so that the mean of the last lines is not one-sided.
    use = scatter < _BLURRED
    x = np.log2(f)
    ratio, scatter = _averaged(x[known], x[use], ratio[use], scatter[use], off[use])
    ratio = ratio / (1.0 + (scatter**2 + off[known] ** 2) / AS_THE_MODEL**2)
    f = f[known]
    ends = np.concatenate([[f[0] / threshold.FADE], f, [f[-1] * threshold.FADE]])
    faded = np.concatenate([[0.0], ratio, [0.0]])
    x, xp = np.log(plant.frequency_hz), np.log(ends)
    joined = np.interp(x, xp, faded.real) + 1j * np.interp(x, xp, faded.imag)
    return replace(plant, correction=plant.correction * np.exp(joined), also=plant.shifted())


def _known(octaves: FloatArray, sharp: BoolArray) -> BoolArray:
    """Accurate lines up to where they become sparse: isolated ones are accurate by chance."""
    near = np.abs(octaves[:, None] - octaves) < threshold.OCTAVES
    dense = np.count_nonzero(near & sharp, axis=1) > threshold.DENSE * near.sum(axis=1)
    last = dense.size if np.all(dense) else int(np.argmin(dense))
    return np.asarray(sharp & (np.arange(dense.size) < last))


def _averaged(
    centres: FloatArray,
    octaves: FloatArray,
    value: ComplexArray,
    scatter: FloatArray,
    off: FloatArray,
) -> tuple[ComplexArray, FloatArray]:
    """Local straight-line fit at each centre, and its remaining scatter."""
    out = np.empty(centres.size, dtype=np.complex128)
    left = np.empty(centres.size)
    for i, centre in enumerate(centres):
        x = (octaves - centre) / threshold.OCTAVES
        near = np.abs(x) < 1.0
        weight = (1.0 - np.abs(x[near]) ** 3) ** 3 / (scatter[near] ** 2 + off[near] ** 2)
        total, first = weight.sum(), weight @ x[near]
        second = weight @ x[near] ** 2
        spread = total * second - first**2
        # Too few neighbours for a slope: use the mean.
        flat = spread <= 1e-3 * total * second
        row = weight / total if flat else weight * (second - first * x[near]) / spread
        out[i] = row @ value[near]
        left[i] = np.sqrt(row**2 @ scatter[near] ** 2)
    return out, left
