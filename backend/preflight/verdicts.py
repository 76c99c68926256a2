"""What was measured means for a purpose: a typed verdict with the figures that it rests on.

A cycle is missed where waking up and the frame's way together take longer than the cycle: then the
drives hold the setpoint of the cycle before, and a sample is missing. Held setpoints are an error
of the excitation: with a share ``f`` of them and a signal at a tenth of the sampling rate, whose
step from sample to sample is at most 2·sin(π/10) = 0.62 of its amplitude, the rms error is at most
0.62·√f of it; f = 0.001 is 2 % or 0.17 dB, within the accuracy that responses state.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from backend.preflight.findings import Code, Effect, Finding
from drivers.computer.lateness import Measured, missed_bound


class Purpose(StrEnum):
    """What somebody wants to do, and at which cycle."""

    PARAMETERS = "parameters"
    SCOPE_1_KHZ = "scope_1khz"
    RESPONSE_1_KHZ = "response_1khz"
    RESPONSE_4_KHZ = "response_4khz"


class Grade(StrEnum):
    """``not_measured``: without a measurement nothing is stated of timing."""

    SUITABLE = "suitable"
    LIMITED = "limited"
    UNSUITABLE = "unsuitable"
    NOT_MEASURED = "not_measured"


@dataclass(frozen=True, slots=True)
class Verdict:
    """``missed_bound`` is the share of missed cycles that is not exceeded with 95 % confidence;
    ``allowed`` the largest with which the purpose is suitable. None where timing plays no part.
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
#: Suitable up to the first, of limited use up to the second. A scope counts what is missing and
#: shows it; a response needs what its docstring above derives.
_SHARES = {
    Purpose.SCOPE_1_KHZ: (0.01, 0.1),
    Purpose.RESPONSE_1_KHZ: (0.001, 0.01),
    Purpose.RESPONSE_4_KHZ: (0.001, 0.01),
}


def verdicts(found: Sequence[Finding], measured: Mapping[int, Measured]) -> list[Verdict]:
    """One for each purpose. ``measured`` is by its period in µs."""
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
