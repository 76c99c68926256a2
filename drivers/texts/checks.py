"""Findings of the check of a profile, as messages of the catalogue."""

from __future__ import annotations

from drivers.texts.message import Text, text
from profiles.check import Finding


def check_line(finding: Finding) -> Text:
    """Return a finding with the place that it concerns."""
    message = Text(finding.code, finding.params)
    return text("profile-check.line", place=finding.key, finding=message)
