"""What was odd about a description file: codes of the catalogue with their facts.

Words are made of them where they are shown (`drivers.texts.imports`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

_KEPT = 500
#: A reader of JSON rounds whole numbers beyond this.
_EXACT = 2**53

Fact: TypeAlias = str | int | float
Outcome: TypeAlias = Literal["repaired", "left out", "noted"]


class ImportFailed(Exception):
    """Nothing usable is in the file: a code of the catalogue and its facts state why."""

    def __init__(self, code: str, /, **params: Fact) -> None:
        super().__init__(code, params)
        self.code = code
        self.params: Mapping[str, Fact] = _facts(params)

    def __str__(self) -> str:
        return _code_with_facts(self.code, self.params)


@dataclass(frozen=True, slots=True)
class Finding:
    """One oddity: where, what, and what was made of it.

    ``place`` is a file with its line, section or element, in the spelling of the file; ``code``
    and ``params`` are the message.
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
        """Something wrong whose meaning is clear."""
        self._add(place, code, params, "repaired")

    def left_out(self, place: str, code: str, /, **params: Fact) -> None:
        """Something that could not be understood and is missing from the profile."""
        self._add(place, code, params, "left out")

    def noted(self, place: str, code: str, /, **params: Fact) -> None:
        """Something that the user should know."""
        self._add(place, code, params, "noted")

    def _add(self, place: str, code: str, params: Mapping[str, Fact], outcome: Outcome) -> None:
        if len(self.findings) < _KEPT:
            self.findings.append(Finding(place, code, _facts(params), outcome))
        else:
            self.not_listed += 1


def _facts(params: Mapping[str, Fact]) -> dict[str, Fact]:
    """Facts that JSON carries as they are."""
    return {
        name: str(fact) if isinstance(fact, int) and abs(fact) > _EXACT else fact
        for name, fact in params.items()
    }


def _code_with_facts(code: str, params: Mapping[str, Fact]) -> str:
    facts = ", ".join(f"{name}={fact}" for name, fact in params.items())
    return f"{code} ({facts})" if facts else code
