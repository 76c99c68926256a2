"""What moves an axis between the excited lines: friction, and what friction does not explain.

On a linear axis nothing but noise lies on the empty bins of a multisine. Coulomb friction puts
some there, of which its torque by the direction of motion tells how much; what is left is play in
the mechanics, or friction of another kind (Pintelon & Schoukens, *System Identification*, 2012,
section 4.4).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.arrays import FloatArray, neighbour_mean
from backend.analysis.frf import Frf
from backend.analysis.line_spectra import (
    Quantity,
    Record,
    friction_direction,
    good_periods,
    own_torque,
    period_spectra,
)
from backend.analysis.sampling import SignalPath, reported_response

#: Empty bins that a level is taken over, to each side, and the fewest that tell anything.
_REACH, _FEWEST = 6, 12
#: What a bin that is left out may hold of what an excited one does: rounding, and nothing else.
_SILENT = 1e-3
#: Play is looked for above this share of the sample rate: below, friction rules.
_LOWEST = 0.1
#: So much of the motion is too much, in any case or where friction explains none of it.
_MUCH, _SOME, _UNEXPLAINED = 0.17, 0.1, 0.9
#: Power on the empty bins over that of the noise in it, from which on it tells of play.
_ABOVE_NOISE = 4.0


@dataclass(frozen=True)
class Distortion:
    """Motion on empty bins relative to that on the lines around; noise is taken out.

    ``share`` [lines] is what friction does not explain; ``level`` its median in the upper band,
    ``before`` the same with friction. All zero where there are no empty bins.
    """

    share: FloatArray
    level: float = 0.0
    before: float = 0.0

    @property
    def play(self) -> bool:
        """Whether the axis is no linear one, beyond friction: it seems to have play."""
        left = self.level > _UNEXPLAINED * self.before
        return self.level > _MUCH or (self.level > _SOME and left)


def distortion(
    records: tuple[Record, ...], path: SignalPath, quantity: Quantity, frf: Frf
) -> Distortion:
    """From the recordings and a direct estimate of the velocity with its friction."""
    none = Distortion(np.zeros(frf.frequency_hz.size))
    e = records[0].excitation
    if e.segments or quantity == "closed_loop":
        return none
    bins = np.arange(e.lines[0], e.lines[-1] + 1)
    empty = np.setdiff1d(bins, np.append(e.lines, e.base_line))
    # A chirp and a PRBS excite bins that are not evaluated, too.
    played = np.abs(np.fft.rfft(e.one_period))
    empty = empty[played[empty] < _SILENT * np.median(played[e.lines])]
    if empty.size < _FEWEST:
        return none
    f = empty * (e.sample_rate_hz / e.period_samples)
    plant = np.exp(
        np.interp(f, frf.frequency_hz, np.log(np.abs(frf.response)))
        + 1j * np.interp(f, frf.frequency_hz, np.unwrap(np.angle(frf.response)))
    )
    late = reported_response(f, path)
    rest, before, noise, lines = [], [], [], []
    for record in records:
        good, _ = good_periods(record)
        if len(good) < 2:
            continue
        between = replace(record.excitation, lines=empty)
        moved = period_spectra(record.response, between, good)
        if quantity == "torque_injection":
            own = period_spectra(own_torque(record, path), between, good)
            moved = moved - plant * late * own
        mean = moved.mean(axis=0)
        by_friction = frf.coulomb_nm * plant * friction_direction(record, between, good)
        noise.append(np.sum(np.abs(moved - mean) ** 2, axis=0) / (len(good) * (len(good) - 1)))
        before.append(np.abs(mean) ** 2)
        rest.append(np.abs(mean + by_friction.mean(axis=0)) ** 2)
        lines.append(np.abs(period_spectra(record.response, record.excitation, good).mean(axis=0)))
    if not rest:
        return none
    around = np.interp(f, frf.frequency_hz, neighbour_mean(np.mean(lines, axis=0), _REACH))

    def relative(power: list[FloatArray]) -> FloatArray:
        pure = neighbour_mean(np.mean(power, axis=0) - np.mean(noise, axis=0), _REACH)
        return np.asarray(np.sqrt(np.maximum(pure, 0.0)) / around)

    share, plain = relative(rest), relative(before)
    upper = f >= _LOWEST * path.sample_rate_hz
    if np.count_nonzero(upper) < _FEWEST:
        return none
    # Where noise rules (the coarse encoder of DS_C), what is left after it is taken out is noise.
    powers = [float(np.median(np.mean(p, axis=0)[upper])) for p in (rest, noise)]
    if powers[0] < _ABOVE_NOISE * powers[1]:
        return Distortion(np.asarray(np.interp(frf.frequency_hz, f, share)))
    return Distortion(
        # What lies below the first empty bins is told by all of them, not by one beside a valley.
        np.asarray(np.interp(frf.frequency_hz, f, share, left=float(np.median(share)))),
        float(np.median(share[upper])), float(np.median(plain[upper])),
    )  # fmt: skip
