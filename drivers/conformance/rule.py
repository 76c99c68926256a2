"""A rule of a standard, and what came out of trying it."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from enum import Enum

from drivers.conformance.subject import Subject
from drivers.doctor.diagnosis import Fact
from drivers.texts.message import Text, text
from profiles.schema import LinkKind


class Verdict(Enum):
    """What came out."""

    PASSED = "passed"
    FAILED = "failed"
    NOT_APPLICABLE = "not_applicable"
    NOT_TESTABLE = "not_testable"

    @property
    def text(self) -> Text:
        """The verdict as text."""
        return text(_VERDICTS[self])


_VERDICTS = {
    Verdict.PASSED: "conformance.passed",
    Verdict.FAILED: "conformance.failed",
    Verdict.NOT_APPLICABLE: "conformance.not-applicable",
    Verdict.NOT_TESTABLE: "conformance.not-testable",
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """A verdict with the figures that it rests on."""

    verdict: Verdict
    facts: tuple[Fact, ...] = ()


def passed(*facts: Fact) -> Outcome:
    """The slave does what the clause prescribes."""
    return Outcome(Verdict.PASSED, facts)


def failed(*facts: Fact) -> Outcome:
    """It does not; ``facts`` show what it does."""
    return Outcome(Verdict.FAILED, facts)


def judged(well: bool, *facts: Fact) -> Outcome:
    """`passed` or `failed`."""
    return (passed if well else failed)(*facts)


def not_applicable(*facts: Fact) -> Outcome:
    """The clause is about something that this slave does not have."""
    return Outcome(Verdict.NOT_APPLICABLE, facts)


def not_testable(*facts: Fact) -> Outcome:
    """The slave cannot be brought into the situation that the clause is about."""
    return Outcome(Verdict.NOT_TESTABLE, facts)


@dataclass(frozen=True, slots=True)
class Rule:
    """One clause. ``changes`` says that the slave is written to or changes its state for it."""

    code: str
    clause: str
    check: Callable[[Subject], Awaitable[Outcome]]
    buses: tuple[LinkKind, ...] = ("ethercat", "canopen")
    changes: bool = False

    @property
    def title(self) -> Text:
        """What the clause prescribes, as text."""
        return text(self.code)


def hexadecimal(value: int, digits: int = 8) -> str:
    """As the standards print codes and indices."""
    return f"{value:0{digits}X}h"
