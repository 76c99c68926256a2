"""Verdicts on the computer's suitability for a purpose, with the figures they are based on.

A cycle is missed where wake-up and transmission of the frame together take longer than the cycle:
the drives then hold the setpoint of the cycle before, and a sample is missing. Held setpoints are
an error of the excitation. With a share ``f`` of them and a signal at a tenth of the sampling
rate, whose step from sample to sample is at most 2·sin(π/10) = 0.62 of its amplitude, the rms error
is at most 0.62·√f of the amplitude; f = 0.001 results in 2 % or 0.17 dB, within the stated accuracy
of responses.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from backend.foundation.preflight.findings import Code, Effect, Finding
from drivers.computer.timing.lateness import Measured, missed_bound


class Purpose(StrEnum):
    """Purpose for which the computer is judged, with its cycle."""

    PARAMETERS = "parameters"
    SCOPE_1_KHZ = "scope_1khz"
    RESPONSE_1_KHZ = "response_1khz"
    RESPONSE_4_KHZ = "response_4khz"


class Grade(StrEnum):
    """Suitability for a purpose; ``not_measured``: timing is not known without a measurement."""

    SUITABLE = "suitable"
    LIMITED = "limited"
    UNSUITABLE = "unsuitable"
    NOT_MEASURED = "not_measured"


@dataclass(frozen=True, slots=True)
class Verdict:
    """Verdict on one purpose.

    ``missed_bound``: share of missed cycles that is not exceeded with 95 % confidence; ``allowed``:
    largest share with which the computer is suitable. None where timing does not matter.
    """

    purpose: Purpose
    grade: Grade
    blocked_by: Code | None = None
    missed_bound: float | None = None
    allowed: float | None = None
    frames_included: bool = False


PERIODS_US = {
    Purpose.SCOPE_1_KHZ: 1000,
    Purpose.RESPONSE_1_KHZ: 1000,
    Purpose.RESPONSE_4_KHZ: 250,
}
#: Share of missed cycles up to which the grade is suitable, and up to which it is limited. A scope
#: counts and shows missing samples; for responses the module's docstring derives the limit.
_SHARES = {
    Purpose.SCOPE_1_KHZ: (0.01, 0.1),
    Purpose.RESPONSE_1_KHZ: (0.001, 0.01),
    Purpose.RESPONSE_4_KHZ: (0.001, 0.01),
}


def verdicts(found: Sequence[Finding], measured: Mapping[int, Measured]) -> list[Verdict]:
    """One verdict for each purpose. ``measured``: by period [µs]."""
    blocked = next((one.code for one in found if one.effect is Effect.BLOCKS), None)
    return [_verdict(purpose, blocked, measured) for purpose in Purpose]


def _verdict(purpose: Purpose, blocked: Code | None, measured: Mapping[int, Measured]) -> Verdict:
    if blocked is not None:
        return Verdict(purpose, Grade.UNSUITABLE, blocked_by=blocked)
    period = PERIODS_US.get(purpose)
    if period is None:
        return Verdict(purpose, Grade.SUITABLE)
    suitable, limited = _SHARES[purpose]
    run = measured.get(period)
    if run is None:
        return Verdict(purpose, Grade.NOT_MEASURED, allowed=suitable)
    bound = missed_bound(run.missed, run.cycles)
    grade = (
        Grade.SUITABLE
        if bound <= suitable
        else Grade.LIMITED
        if bound <= limited
        else Grade.UNSUITABLE
    )
    return Verdict(purpose, grade, None, bound, suitable, run.round_trip is not None)
