"""Resonances and antiresonances of a fitted model that a measurement shows."""

from __future__ import annotations

import numpy as np

from backend.analysis.mechanics.identification.mode_uncertainty import ModeUncertainty
from backend.analysis.mechanics.mechanical_model import MechanicalModel
from backend.analysis.mechanics.resonance import Resonance
from backend.analysis.signals.arrays import FloatArray
from backend.analysis.thresholds import resonance_table as threshold

#: A mode with a larger standard deviation of its log residue than this may not exist.
_UNSURE = 1.0 / 3.0
#: Standard deviations to either side of a value that give a 95 % interval.
_CI95 = 1.96


def resonance_table(
    model: MechanicalModel,
    lines_hz: FloatArray,
    highest_hz: float,
    uncertainties: tuple[ModeUncertainty, ...] = (),
) -> tuple[Resonance, ...]:
    """Return the resonances and antiresonances that the lines show, ascending; heights are local,
    dB.

    A mode that hardly rises, or that lies between two lines and is narrower than their spacing, may
    only explain noise; so may one whose residue may be zero, by ``uncertainties`` (one for each
    mode, or none). They are left out.
    """
    rows: list[Resonance] = []
    for number, mode in enumerate(model.modes):
        known = uncertainties[number] if uncertainties else None
        height = model.height_db(mode)
        low = mode.frequency_hz < threshold.LOWEST_MODE_HZ
        nearest_hz = float(np.min(np.abs(lines_hz - mode.frequency_hz)))
        half_width_hz = mode.damping * mode.frequency_hz
        seen = model.prominence(mode) / np.hypot(1.0, nearest_hz / half_width_hz)
        shown = height > threshold.WEAK_DB if low else seen > threshold.LEAST_SHARE
        inside = lines_hz[0] < mode.frequency_hz <= highest_hz
        sure = known is None or known.residue < _UNSURE
        if shown and sure and inside and mode.damping < 1.0:
            rows.append(
                Resonance(
                    "resonance",
                    mode.frequency_hz,
                    mode.damping,
                    height,
                    _around(mode.frequency_hz, known.frequency if known else None),
                    known.damping_interval(mode.damping, _CI95) if known else None,
                )
            )
    kept = [row.frequency_hz for row in rows]
    for frequency, damping in model.antiresonances():
        # An antiresonance belongs to the next mode above it, which may lie beyond the band.
        above = min((m.frequency_hz for m in model.modes if m.frequency_hz > frequency), default=0)
        paired = above in kept or above > highest_hz
        paired = paired or (not above and frequency > 0.25 * highest_hz)
        if not paired or not lines_hz[0] < frequency <= highest_hz:
            continue
        around = np.array([frequency * 0.5, frequency, frequency * 2.0])
        db = 20 * np.log10(np.abs(model.response(around)))
        depth = float(db[1] - (db[0] + db[2]) / 2)
        if depth < -threshold.LEAST_DB:
            rows.append(Resonance("antiresonance", frequency, damping, depth))
    return tuple(sorted(rows, key=lambda row: row.frequency_hz))


def _around(value: float, deviation: float | None) -> tuple[float, float] | None:
    """The 95 % interval of a value whose logarithm has this deviation."""
    if deviation is None:
        return None
    factor = float(np.exp(_CI95 * min(deviation, 5.0)))
    return value / factor, value * factor
