"""The mechanics on a dense grid: measured near the measured lines, the model elsewhere."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from backend.analysis.loop.mode_above import ModeAbove
from backend.analysis.mechanics.mechanical_model import MechanicalModel
from backend.analysis.response.frf import Frf
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.thresholds import measured_plant as threshold

FREQUENCY_FACTORS = threshold.FREQUENCY_FACTORS
DAMPING_FACTORS = threshold.DAMPING_FACTORS
BEYOND = threshold.BEYOND
#: A line with this standard deviation of its logarithm is as accurate as the model there: an error
#: of one per cent in a mode's frequency turns the lines next to it by as much.
AS_THE_MODEL = np.radians(10.0)


@dataclass(frozen=True)
class MeasuredPlant:
    """Response from torque to velocity on ``frequency_hz`` [lines].

    ``measured_hz`` is the highest measured line. ``variants`` are other mechanics that the axis may
    have, such as the motor alone within the backlash: a design must hold for them, too.
    """

    frequency_hz: FloatArray
    correction: ComplexArray
    model: MechanicalModel
    measured_hz: float
    variants: tuple[MechanicalModel, ...] = ()
    also: ComplexArray | None = None
    """Responses [m, lines] of the axis under other conditions."""

    def response(self, frequency_factor: float = 1.0, damping_factor: float = 1.0) -> ComplexArray:
        """Return the response with all modes shifted; keeps the measured deviation
        from the model.
        """
        moved = self.model.perturbed(1.0, damping_factor)
        modes = tuple(
            replace(
                m,
                frequency_hz=m.frequency_hz * frequency_factor ** self._uncertainty(m.frequency_hz),
            )
            for m in moved.modes
        )
        moved = replace(moved, modes=modes)
        return np.asarray(moved.response(self.frequency_hz) * self.correction)

    def _uncertainty(self, mode_hz: float) -> int:
        """Multiplicity of a shift for a mode at this frequency: larger beyond the measured band."""
        if mode_hz <= self.measured_hz:
            return 1
        return 2 if mode_hz <= BEYOND * self.measured_hz else 4

    def shifted(self) -> ComplexArray:
        """Return all responses that the axis may have, [shifts, lines]."""
        moves = list(product(FREQUENCY_FACTORS, DAMPING_FACTORS)) if self.model.modes else [(1, 1)]
        rows = [self.response(*move) for move in moves]
        rows += [v.response(self.frequency_hz) for v in self.variants]
        return np.array([*rows, *(self.also if self.also is not None else ())])

    def motor_alone_above(self, motor_inertia_kgm2: float) -> ComplexArray:
        """Return the response if only the motor moves above the highest measured line.

        The load may decouple there: whether a mode above the band exists is not known.
        """
        f = self.frequency_hz
        nominal = self.response()
        if self.measured_hz <= 0.0:
            return nominal
        alone = 1.0 / (2j * np.pi * f * motor_inertia_kgm2)
        share = np.clip(np.log(f / self.measured_hz) / np.log(threshold.LET_GO), 0.0, 1.0)
        return np.asarray(nominal * np.exp(share * np.log(alone / nominal)))

    def on(self, frequency_hz: FloatArray) -> MeasuredPlant:
        """Return the plant on other lines (ascending), without variants and other conditions."""
        x, xp, turns = np.log(frequency_hz), np.log(self.frequency_hz), np.log(self.correction)
        joined = np.interp(x, xp, turns.real) + 1j * np.interp(x, xp, turns.imag)
        return replace(
            self, frequency_hz=frequency_hz, correction=np.exp(joined), variants=(), also=None
        )


def measured_plant(
    frf: Frf,
    model: MechanicalModel,
    *,
    highest_hz: float = 6000.0,
    lines: int = 400,
    variants: tuple[MechanicalModel, ...] = (),
    fitted: bool = True,
    above: tuple[ModeAbove, ...] = (),
) -> MeasuredPlant:
    """Combine a corrected measurement with its model.

    With ``fitted``, the model was fitted to all lines: next to each line it is weighted by the
    accuracy of that line. Otherwise a line hidden by friction or noise would determine a design by
    its error. Each mode of ``above`` is one more axis that this may be.

    The ratio measurement/model is smooth, so it may be interpolated between lines where the
    response itself may not; outside the measured band it fades to 1 within a third of an octave.
    """
    use = frf.in_band & (frf.coherence > 0.8)
    f = frf.frequency_hz[use]
    grid = [np.geomspace(1.0, highest_hz, lines)]
    special = [m.frequency_hz for m in model.modes] + [a[0] for a in model.antiresonances()]
    special += [m.frequency_hz for m in above]
    grid += [np.geomspace(0.85 * x, 1.18 * x, 60) for x in special if 1.0 < x < highest_hz / 1.2]
    dense = np.unique(np.concatenate(grid))
    if f.size < 2:
        flat = np.ones(dense.size, dtype=np.complex128)
        return MeasuredPlant(dense, flat, model, 0.0, variants)
    log_ratio = np.log(frf.response[use] / model.response(f))
    if fitted:
        log_ratio = log_ratio * _own_share(frf)[use]
    fade_f = np.concatenate([[f[0] / 1.26], f, [f[-1] * 1.26]])
    fade = np.concatenate([[0.0], log_ratio, [0.0]])
    x, xp = np.log(dense), np.log(fade_f)
    joined = np.interp(x, xp, fade.real) + 1j * np.interp(x, xp, fade.imag)
    plant = MeasuredPlant(dense, np.exp(joined), model, float(f[-1]), variants)
    if not above:
        return plant
    response = plant.response()
    return replace(plant, also=np.array([each.extended(dense, response) for each in above]))


def _own_share(frf: Frf) -> FloatArray:
    """Weight of a line against a model of all lines, 0 to 1, from the variances of both.

    A line with unknown deviation, as from a single period, has the full weight.
    """
    parts = (np.log(10.0) / 20.0 * frf.std_db, np.radians(frf.std_deg))
    variance = 0.5 * sum(np.nan_to_num(part, nan=0.0) ** 2 for part in parts)
    return np.asarray(1.0 / (1.0 + variance / AS_THE_MODEL**2))
