"""Two experiments that determine a 2×2 response: the same multisine on both axes, the second time
with the sign of axis 2 reversed.

The signs are the rows of a Hadamard matrix of order 2: both axes are excited at full amplitude all
the time, and every line is excited in both experiments. Dividing the lines between the axes would
take one experiment instead of two, but determine each entry at every other line only; the lightly
damped skew mode of a gantry then lies between two lines of its own entry. Source: Pintelon &
Schoukens, *System Identification: A Frequency Domain Approach* (2012), section 2.7.
"""

from __future__ import annotations

from dataclasses import dataclass

from backend.analysis.signals.arrays import FloatArray, IntArray
from backend.analysis.signals.excitation import Excitation, multisine

SIGNS = ((1, 1), (1, -1))
"""Sign of each axis, by experiment: common and differential motion."""


@dataclass(frozen=True)
class Experiment:
    """One excitation of both axes: ``excitation`` times the sign of each axis."""

    excitation: Excitation
    signs: tuple[int, int]


def orthogonal_multisines(
    *,
    sample_rate_hz: float,
    period_samples: int,
    lines: IntArray,
    periods: int,
    transient_periods: int,
    realisations: int,
    amplitude: FloatArray | None = None,
    ramp_samples: int | None = None,
) -> tuple[Experiment, ...]:
    """Return pairs of experiments with the same phases, one pair for each realisation.

    Every signal is a speed setpoint whose integral ends where it began.

    Raises:
        ValueError: as `multisine`.
    """
    made = [
        multisine(
            sample_rate_hz=sample_rate_hz, period_samples=period_samples, lines=lines,
            periods=periods, transient_periods=transient_periods, realisation=number,
            amplitude=amplitude, ramp_samples=ramp_samples, integrations=1,
        )
        for number in range(realisations)
    ]  # fmt: skip
    return tuple(Experiment(each, signs) for each in made for signs in SIGNS)
