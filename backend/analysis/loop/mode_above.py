"""Axes with a resonance above the measured band, where the last lines show that there is one.

Torque and speed at the same shaft of a passive axis: poles and zeros alternate, so that a speed
that leads the torque at the last lines is that of a spring, and a resonance follows. Where no model
was fitted, nothing else knows of it, and a loop may cross 0 dB once more at its peak.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.response.frf import Frf
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.thresholds import mode_above as threshold


@dataclass(frozen=True)
class ModeAbove:
    """1/(2πjf)·(``rest`` - ``residue``·f²/(f_0² - f²)), with a damping, above the line ``top_hz``.

    ``frequency_hz`` is f_0; ``rest`` and ``residue`` are inverse inertias.
    """

    frequency_hz: float
    damping: float
    rest: float
    residue: float
    top_hz: float

    def extended(self, frequency_hz: FloatArray, response: ComplexArray) -> ComplexArray:
        """The response [lines], above the top line with this mode, continuous in its size."""
        own = self._own(frequency_hz)
        at = float(np.interp(self.top_hz, frequency_hz, np.abs(response)))
        scale = at / float(np.abs(self._own(np.array([self.top_hz]))[0]))
        return np.where(frequency_hz > self.top_hz, scale * own, response)

    def _own(self, f: FloatArray) -> ComplexArray:
        return np.asarray(self.acceleration(f) / (2j * np.pi * f))

    def acceleration(self, f: FloatArray) -> ComplexArray:
        """Acceleration per torque on these lines."""
        swings = self.frequency_hz**2 - f**2 + 2j * self.damping * self.frequency_hz * f
        return np.asarray(self.rest - self.residue * f**2 / swings)


def modes_above(frf: Frf, coherence: float) -> tuple[ModeAbove, ...]:
    """Modes above the band that the lines up to its end allow; none where these show no spring.

    The lowest, the best and the highest frequency with which a mode explains the last lines, each
    with the damping that explains them best and with a low one.
    """
    use = frf.in_band & (frf.coherence > coherence)
    f, response = frf.frequency_hz[use], frf.response[use]
    leads = np.degrees(np.angle(response)) > threshold.LEADS_DEG
    lags = np.flatnonzero(~leads)
    begin = int(lags[-1]) + 1 if lags.size else 0
    f, response = f[begin:], response[begin:]
    if f.size < threshold.LINES:
        return ()
    top_hz = float(f[-1])
    # Inverse inertia that the lines show; its error is a share of itself, and no less next to the
    # antiresonance, which is the load's.
    seen = 2j * np.pi * f * response
    weight = 1.0 / (threshold.OFF * np.hypot(np.abs(seen), np.median(np.abs(seen))))
    fits = []
    for hz in np.geomspace(
        threshold.NEAREST * top_hz, threshold.FARTHEST * top_hz, threshold.PLACES
    ):
        for damping in threshold.DAMPINGS:
            one = ModeAbove(float(hz), damping, 0.0, 1.0, top_hz)
            columns = np.column_stack([np.ones(f.size, np.complex128), one.acceleration(f)])
            columns, target = columns * weight[:, None], seen * weight
            matrix = np.concatenate([columns.real, columns.imag])
            x = np.linalg.lstsq(matrix, np.concatenate([target.real, target.imag]), rcond=None)[0]
            left = float(np.mean(np.abs(columns @ x - target) ** 2))
            if x[1] > 0.0:
                fits.append((left, replace(one, rest=float(x[0]), residue=float(x[1]))))
    if not fits:
        return ()
    best = min(fits, key=lambda each: each[0])
    alike = [mode for left, mode in fits if left <= best[0] + threshold.ALIKE]
    chosen = (
        min(alike, key=lambda mode: mode.frequency_hz),
        best[1],
        max(alike, key=lambda mode: mode.frequency_hz),
    )
    lightly = tuple(replace(mode, damping=min(threshold.DAMPINGS)) for mode in chosen)
    return tuple(dict.fromkeys((*chosen, *lightly)))
