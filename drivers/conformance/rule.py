"""A rule of a standard, and the outcome of its test."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from enum import Enum

from drivers.conformance.subject import Subject
from drivers.doctor.diagnosis import Fact
from drivers.texts.message import Text, text
from profiles.schema import LinkKind


class Verdict(Enum):
    """Verdict of a test."""

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
    """A verdict with the figures on which it is based."""

    verdict: Verdict
    facts: tuple[Fact, ...] = ()


def passed(*facts: Fact) -> Outcome:
    """The slave complies with the clause."""
    return Outcome(Verdict.PASSED, facts)


def failed(*facts: Fact) -> Outcome:
    """The slave does not comply; ``facts`` show its behaviour."""
    return Outcome(Verdict.FAILED, facts)


def judged(well: bool, *facts: Fact) -> Outcome:
    """Return `passed` or `failed`."""
    return (passed if well else failed)(*facts)


def not_applicable(*facts: Fact) -> Outcome:
    """The clause concerns something that this slave does not have."""
    return Outcome(Verdict.NOT_APPLICABLE, facts)


def not_testable(*facts: Fact) -> Outcome:
    """The slave cannot be brought into the situation described in the clause."""
    return Outcome(Verdict.NOT_TESTABLE, facts)


@dataclass(frozen=True, slots=True)
class Rule:
    """One clause. ``changes``: testing it writes to the slave or changes its state."""

    code: str
    clause: str
    check: Callable[[Subject], Awaitable[Outcome]]
    buses: tuple[LinkKind, ...] = ("ethercat", "canopen")
    changes: bool = False

    @property
    def title(self) -> Text:
        """Requirement of the clause, as text."""
        return text(self.code)


def hexadecimal(value: int, digits: int = 8) -> str:
    """Return the notation of codes and indices in the standards."""
    return f"{value:0{digits}X}h"
