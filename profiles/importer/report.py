"""What was odd about a description file."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Literal

_KEPT = 500


class ImportFailed(Exception):
    """Nothing usable is in the file; the message states why and what to do."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One oddity: where, what, and what was made of it."""

    place: str
    text: str
    outcome: Literal["repaired", "left out", "noted"]

    def __str__(self) -> str:
        return f"{self.place}: {self.text} ({self.outcome})"


@dataclass(slots=True)
class ImportReport:
    """Findings in the order they were made; beyond 500 they are only counted."""

    findings: list[Finding] = field(default_factory=list)
    not_listed: int = 0

    def repaired(self, place: str, text: str) -> None:
        """Something wrong whose meaning is clear."""
        self._add(Finding(place, text, "repaired"))

    def left_out(self, place: str, text: str) -> None:
        """Something that could not be understood and is missing from the profile."""
        self._add(Finding(place, text, "left out"))

    def noted(self, place: str, text: str) -> None:
        """Something that the user should know."""
        self._add(Finding(place, text, "noted"))

    def _add(self, finding: Finding) -> None:
        if len(self.findings) < _KEPT:
            self.findings.append(finding)
        else:
            self.not_listed += 1

    def summary(self) -> str:
        """One sentence for a heading."""
        if not self.findings:
            return "nothing odd"
        counts = Counter(f.outcome for f in self.findings)
        parts = [f"{counts[o]} {o}" for o in ("repaired", "left out", "noted") if counts[o]]
        extra = f", {self.not_listed} more not listed" if self.not_listed else ""
        return ", ".join(parts) + extra
