"""Irregularities of a description file: codes of the catalogue with their facts.

Words are generated where they are shown (`drivers.texts.imports`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

_KEPT = 500
#: JSON readers round whole numbers beyond this.
_EXACT = 2**53

Fact: TypeAlias = str | int | float
Outcome: TypeAlias = Literal["repaired", "left out", "noted"]


class ImportFailed(Exception):
    """The file contains nothing usable: a code of the catalogue and its facts state why."""

    def __init__(self, code: str, /, **params: Fact) -> None:
        super().__init__(code, params)
        self.code = code
        self.params: Mapping[str, Fact] = _facts(params)

    def __str__(self) -> str:
        return _code_with_facts(self.code, self.params)


@dataclass(frozen=True, slots=True)
class Finding:
    """One irregularity: its place, a message, and how it was handled.

    ``place`` is a file with its line, section or element, in the spelling of the file; ``code`` and
    ``params`` are the message.
    """

    place: str
    code: str
    params: Mapping[str, Fact]
    outcome: Outcome

    def __str__(self) -> str:
        return f"{self.place}: {_code_with_facts(self.code, self.params)} [{self.outcome}]"


@dataclass(slots=True)
class ImportReport:
    """Findings in the order they were made; beyond 500 they are only counted."""

    findings: list[Finding] = field(default_factory=list)
    not_listed: int = 0

    def repaired(self, place: str, code: str, /, **params: Fact) -> None:
        """Add an error with a clear meaning, which was corrected."""
        self._add(place, code, params, "repaired")

    def left_out(self, place: str, code: str, /, **params: Fact) -> None:
        """Add something that could not be interpreted and is missing from the profile."""
        self._add(place, code, params, "left out")

    def noted(self, place: str, code: str, /, **params: Fact) -> None:
        """Add information for the user."""
        self._add(place, code, params, "noted")

    def _add(self, place: str, code: str, params: Mapping[str, Fact], outcome: Outcome) -> None:
        if len(self.findings) < _KEPT:
            self.findings.append(Finding(place, code, _facts(params), outcome))
        else:
            self.not_listed += 1


def _facts(params: Mapping[str, Fact]) -> dict[str, Fact]:
    """Return facts in a form that JSON keeps exactly."""
    return {
        name: str(fact) if isinstance(fact, int) and abs(fact) > _EXACT else fact
        for name, fact in params.items()
    }


def _code_with_facts(code: str, params: Mapping[str, Fact]) -> str:
    facts = ", ".join(f"{name}={fact}" for name, fact in params.items())
    return f"{code} ({facts})" if facts else code
